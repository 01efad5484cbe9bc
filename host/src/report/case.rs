//! One case of the report: a command line, what is measured of its run, and what is kept of it for a figure.

use crate::cli::{ChainArgs, Cli, Command, Format, Link as LinkKind, RunArgs};
use crate::commands::run::{About, OverLink, over_link};
use crate::failure::Failure;
use clap::Parser;
use firmware::scalar::Fixed16;
use firmware::{Robot, Scalar};
use hil_sim::chain::{self, reading};
use hil_sim::coupling::Coupling;
use hil_sim::link::Direct;
use hil_sim::measure::{Motion, Quantity, Readings, Value};
use hil_sim::run::Run;
use hil_sim::setup::BodyKind;
use protocol::Id;
use protocol::message::SafetyState;
use serde_json::{Value as Json, json};
use std::sync::atomic::{AtomicBool, Ordering};

/// A command line and what is kept of its run.
#[derive(Clone, Debug)]
pub struct Case {
    /// The line, as it is typed: all that decides the run, and its measures.
    pub line: String,
    work: Work,
    trace: Option<Trace>,
}

/// What a line asks for.
#[derive(Clone, Debug)]
enum Work {
    Barrel(Box<RunArgs>),
    Chain(ChainArgs),
}

/// Numbers over time that a figure needs.
#[derive(Clone, Debug, PartialEq)]
struct Trace {
    quantities: Vec<&'static str>,
    /// One in so many control steps.
    every: usize,
}

/// What came of a case.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// One value for each measure of the line.
    pub values: Vec<Value>,
    /// Time, s, and after it each quantity that was asked for: columns of equal length.
    pub trace: Vec<Vec<f64>>,
    /// Why the run did not come to its end, if it did not.
    pub broken: Option<String>,
}

impl Outcome {
    /// The number of the i-th measure; NaN if it never happened.
    pub fn number(&self, i: usize) -> f64 {
        self.values.get(i).and_then(Value::number).unwrap_or(f64::NAN)
    }

    /// The kind of motion that the i-th measure told.
    pub fn motion(&self, i: usize) -> Option<Motion> {
        match self.values.get(i) {
            Some(Value::Word(name)) => Motion::find(name),
            _ => None,
        }
    }

    /// The i-th quantity over time, to draw.
    pub fn curve(&self, i: usize) -> Vec<[f64; 2]> {
        match (self.trace.first(), self.trace.get(i + 1)) {
            (Some(t), Some(numbers)) => t.iter().zip(numbers).map(|(t, n)| [*t, *n]).collect(),
            _ => Vec::new(),
        }
    }

    /// The i-th quantity against the j-th, to draw.
    pub fn portrait(&self, i: usize, j: usize) -> Vec<[f64; 2]> {
        self.curve(i).into_iter().zip(self.curve(j)).map(|([_, x], [_, y])| [x, y]).collect()
    }

    /// For the journal and the report: every number exact.
    pub fn to_json(&self) -> Json {
        json!({ "values": self.values.iter().map(value_json).collect::<Vec<_>>(), "trace": self.trace, "broken": self.broken })
    }

    /// As [`Outcome::to_json`] wrote it, or nothing.
    pub fn from_json(json: &Json) -> Option<Outcome> {
        let value = |json: &Json| match json {
            Json::Null => Some(Value::Never),
            Json::Number(number) => number.as_f64().map(Value::Number),
            Json::String(word) => Motion::find(word).map(|motion| Value::Word(motion.name())),
            _ => None,
        };
        let column = |json: &Json| json.as_array()?.iter().map(Json::as_f64).collect::<Option<Vec<f64>>>();
        Some(Outcome {
            values: json["values"].as_array()?.iter().map(value).collect::<Option<_>>()?,
            trace: json["trace"].as_array()?.iter().map(column).collect::<Option<_>>()?,
            broken: json["broken"].as_str().map(str::to_owned),
        })
    }
}

/// A value in JSON: a number, a word, or null for what never happened.
pub fn value_json(value: &Value) -> Json {
    match value {
        Value::Number(number) => json!(number),
        Value::Word(word) => json!(word),
        Value::Never => Json::Null,
    }
}

impl Case {
    /// The case of a line without its `barrel`, as in `run homeokinetic --seed 3 --measure interval`.
    ///
    /// # Panics
    /// On a line that `barrel` would refuse: a mistake in the report.
    pub fn new(line: impl AsRef<str>) -> Case {
        let words: Vec<&str> = line.as_ref().split_whitespace().collect();
        let line = format!("barrel {}", words.join(" "));
        match Cli::try_parse_from(line.split_whitespace()).map(|cli| cli.command) {
            Ok(Some(Command::Run(args))) => Case { line, work: Work::Barrel(Box::new(args)), trace: None },
            Ok(Some(Command::Chain(args))) => Case { line, work: Work::Chain(args), trace: None },
            Ok(_) => panic!("the report does not run `{line}`"),
            Err(error) => panic!("the report's line `{line}` is wrong: {error}"),
        }
    }

    /// Keeps these quantities over time, one in so many control steps.
    #[must_use]
    pub fn traced(mut self, quantities: &[&'static str], every: usize) -> Case {
        self.trace = Some(Trace { quantities: quantities.to_vec(), every });
        self
    }

    /// The measures of the line, as they are written there.
    pub fn measures(&self) -> Vec<(String, &'static str)> {
        match &self.work {
            Work::Barrel(args) => args.measures.iter().map(|measure| (measure.to_string(), measure.unit())).collect(),
            Work::Chain(args) => args.measures.iter().map(|measure| (measure.to_string(), measure.what.unit)).collect(),
        }
    }

    /// What the line sets otherwise than the preset, from the start or at a time: names and values, as they are written.
    pub fn departures(&self) -> impl Iterator<Item = (&str, &str)> {
        let words = self.line.split_whitespace();
        let values = words.clone().skip(1).zip(words).filter_map(|(value, option)| match option {
            "--set" => Some(value),
            "--at" => value.split_once(':').map(|(_, action)| action),
            "--body" | "--precision" | "--link" => Some(value),
            _ => None,
        });
        values.map(|value| value.split_once('=').unwrap_or(("robot", value)))
    }

    /// What the outcome is known by: two cases with the same key have the same outcome.
    pub fn key(&self) -> String {
        let trace = self.trace.as_ref().map(|trace| format!(" # {} every {}", trace.quantities.join(","), trace.every));
        format!("{}{}", self.line, trace.unwrap_or_default())
    }

    /// Whether all that decides its outcome is in this program: not that of a flash image.
    pub fn is_of_this_program(&self) -> bool {
        match &self.work {
            Work::Barrel(args) => args.setup.link == LinkKind::InProcess,
            Work::Chain(_) => true,
        }
    }

    /// How long it takes, roughly, in simulated seconds of the lying barrel.
    pub fn cost(&self) -> f64 {
        let args = match &self.work {
            Work::Barrel(args) => args,
            Work::Chain(args) => return 50.0 + 2.0 * args.duration,
        };
        let upright = args.setup.setup().is_ok_and(|setup| setup.values.get(Id::Tilt0) != 0.0);
        let slower = match (&args.setup.link, BodyKind::from(args.setup.body)) {
            (LinkKind::InProcess, BodyKind::Chapter) if upright => 60.0,
            (LinkKind::InProcess, BodyKind::Chapter) => 1.0,
            (LinkKind::InProcess, BodyKind::Tabletop) => 20.0,
            _ => 10_000.0,
        };
        50.0 + slower * args.duration
    }

    /// Runs it.
    ///
    /// # Errors
    /// A run that cannot even be started, as for want of the virtual board; Ctrl-C.
    pub fn run(&self, stop: &AtomicBool) -> Result<Outcome, Failure> {
        let args = match &self.work {
            Work::Barrel(args) => args,
            Work::Chain(args) => return self.chain(args, stop),
        };
        match (&args.setup.link, args.setup.precision.unwrap_or(Format::F32)) {
            (LinkKind::InProcess, Format::F32) => self.barrel(args, direct::<f32>(), stop),
            (LinkKind::InProcess, Format::F64) => self.barrel(args, direct::<f64>(), stop),
            (LinkKind::InProcess, Format::Fixed) => self.barrel(args, direct::<Fixed16>(), stop),
            _ => {
                let mut outcome = Outcome::default();
                over_link(&args.setup, Observer { case: self, args, stop, outcome: &mut outcome })?;
                Ok(outcome)
            }
        }
    }

    fn barrel(&self, args: &RunArgs, link: impl Coupling, stop: &AtomicBool) -> Result<Outcome, Failure> {
        let find = |name: &&str| Quantity::find(name).unwrap_or_else(|| panic!("there is no quantity '{name}'"));
        let quantities = self.trace.iter().flat_map(|trace| &trace.quantities).map(find).collect::<Vec<_>>();
        let mut tape = Tape::new(self.trace.as_ref());
        let mut broken = None;
        let mut run = Run::start(args.setup.setup()?, link).map_err(Failure::bad)?;
        let mut readings = Readings::new(&args.measures);
        while run.time() < args.duration - 1e-9 {
            if stop.load(Ordering::Relaxed) {
                return Err(Failure::Interrupted("interrupted".to_owned()));
            }
            match run.step() {
                Ok(record) => {
                    readings.add(&record);
                    tape.take(record.brain.t, quantities.iter().map(|quantity| quantity.of(&record)));
                }
                Err(error) => {
                    broken = Some(error.to_string());
                    break;
                }
            }
            // As in `barrel run`, the barrel goes on, its motors off.
            if let SafetyState::Fault(code) = run.state() {
                broken.get_or_insert_with(|| format!("Fault at {:.2} s: {code}", run.time()));
            }
        }
        Ok(Outcome { values: readings.values().collect(), trace: tape.columns, broken })
    }

    fn chain(&self, args: &ChainArgs, stop: &AtomicBool) -> Result<Outcome, Failure> {
        if stop.load(Ordering::Relaxed) {
            return Err(Failure::Interrupted("interrupted".to_owned()));
        }
        let find = |name: &&str| reading::quantity(name).unwrap_or_else(|| panic!("there is no quantity '{name}'"));
        let quantities = self.trace.iter().flat_map(|trace| &trace.quantities).map(find).collect::<Vec<_>>();
        let mut tape = Tape::new(self.trace.as_ref());
        let mut records = Vec::new();
        let ended = chain::run(&args.setup()?, args.duration, |record| {
            tape.take(record.t, quantities.iter().map(|of| of(&record)));
            records.push(record);
        });
        let values = args.measures.iter().map(|measure| measure.of(&records)).collect();
        Ok(Outcome { values, trace: tape.columns, broken: ended.err().map(|broken| broken.to_string()) })
    }
}

/// What is kept of a run for a figure.
#[derive(Default)]
struct Tape {
    columns: Vec<Vec<f64>>,
    every: usize,
    steps: usize,
}

impl Tape {
    fn new(trace: Option<&Trace>) -> Self {
        trace.map_or_else(Tape::default, |trace| Tape {
            columns: vec![Vec::new(); trace.quantities.len() + 1],
            every: trace.every,
            steps: 0,
        })
    }

    fn take(&mut self, t: f64, numbers: impl Iterator<Item = f64>) {
        if self.every > 0 && self.steps.is_multiple_of(self.every) {
            self.columns.iter_mut().zip(core::iter::once(t).chain(numbers)).for_each(|(column, n)| column.push(n));
        }
        self.steps += 1;
    }
}

fn direct<S: Scalar>() -> Direct<S> {
    Direct(Robot::default())
}

/// Runs a case over a link that is made for it.
struct Observer<'a> {
    case: &'a Case,
    args: &'a RunArgs,
    stop: &'a AtomicBool,
    outcome: &'a mut Outcome,
}

impl OverLink for Observer<'_> {
    fn over(self, link: impl Coupling, _: &About) -> Result<(), Failure> {
        *self.outcome = self.case.barrel(self.args, link, self.stop)?;
        Ok(())
    }
}
