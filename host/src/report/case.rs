//! One case of the report: a command line, what is measured of its run, and what is kept of it for a figure.

use crate::cli::{Cli, Command, Format, Link as LinkKind, RunArgs};
use crate::commands::run::{About, OverLink, over_link};
use crate::failure::Failure;
use clap::Parser;
use firmware::scalar::Fixed16;
use firmware::{Robot, Scalar};
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
    args: RunArgs,
    trace: Option<Trace>,
}

/// Numbers over time that a figure needs.
#[derive(Clone, Debug, PartialEq)]
struct Trace {
    quantities: Vec<&'static Quantity>,
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
        let line = format!("barrel {}", line.as_ref().trim());
        match Cli::try_parse_from(line.split_whitespace()).map(|cli| cli.command) {
            Ok(Some(Command::Run(args))) => Case { line, args, trace: None },
            Ok(_) => panic!("the report runs `barrel run`, not `{line}`"),
            Err(error) => panic!("the report's line `{line}` is wrong: {error}"),
        }
    }

    /// Keeps these quantities over time, one in so many control steps.
    ///
    /// # Panics
    /// On an unknown quantity: a mistake in the report.
    #[must_use]
    pub fn traced(mut self, quantities: &[&str], every: usize) -> Case {
        let find = |name: &&str| Quantity::find(name).unwrap_or_else(|| panic!("there is no quantity '{name}'"));
        self.trace = Some(Trace { quantities: quantities.iter().map(find).collect(), every });
        self
    }

    /// The measures of the line, as they are written there.
    pub fn measures(&self) -> impl Iterator<Item = (String, &'static str)> {
        self.args.measures.iter().map(|measure| (measure.to_string(), measure.unit()))
    }

    /// What the outcome is known by: two cases with the same key have the same outcome.
    pub fn key(&self) -> String {
        let trace = self.trace.as_ref().map(|trace| {
            let names: Vec<&str> = trace.quantities.iter().map(|quantity| quantity.name).collect();
            format!(" # {} every {}", names.join(","), trace.every)
        });
        format!("{}{}", self.line, trace.unwrap_or_default())
    }

    /// How long it takes, roughly, in simulated seconds of the lying barrel.
    pub fn cost(&self) -> f64 {
        let upright = self.args.setup.setup().is_ok_and(|setup| setup.values.get(Id::Tilt0) != 0.0);
        let slower = match (&self.args.setup.link, BodyKind::from(self.args.setup.body)) {
            (LinkKind::InProcess, BodyKind::Chapter) if upright => 60.0,
            (LinkKind::InProcess, BodyKind::Chapter) => 1.0,
            (LinkKind::InProcess, BodyKind::Tabletop) => 20.0,
            _ => 10_000.0,
        };
        50.0 + slower * self.args.duration
    }

    /// Runs it.
    ///
    /// # Errors
    /// A run that cannot even be started, as for want of the virtual board; Ctrl-C.
    pub fn run(&self, stop: &AtomicBool) -> Result<Outcome, Failure> {
        match (&self.args.setup.link, self.args.setup.precision.unwrap_or(Format::F32)) {
            (LinkKind::InProcess, Format::F32) => self.over(direct::<f32>(), stop),
            (LinkKind::InProcess, Format::F64) => self.over(direct::<f64>(), stop),
            (LinkKind::InProcess, Format::Fixed) => self.over(direct::<Fixed16>(), stop),
            _ => {
                let mut outcome = Outcome::default();
                over_link(&self.args.setup, Observer { case: self, stop, outcome: &mut outcome })?;
                Ok(outcome)
            }
        }
    }

    fn over(&self, link: impl Coupling, stop: &AtomicBool) -> Result<Outcome, Failure> {
        let mut outcome = Outcome::default();
        if let Some(trace) = &self.trace {
            outcome.trace = vec![Vec::new(); trace.quantities.len() + 1];
        }
        let mut run = Run::start(self.args.setup.setup()?, link).map_err(Failure::bad)?;
        let mut readings = Readings::new(&self.args.measures);
        for k in 0.. {
            if run.time() >= self.args.duration - 1e-9 {
                break;
            }
            if stop.load(Ordering::Relaxed) {
                return Err(Failure::Interrupted("interrupted".to_owned()));
            }
            match run.step() {
                Ok(record) => {
                    readings.add(&record);
                    if let Some(trace) = self.trace.as_ref().filter(|trace| k % trace.every == 0) {
                        let numbers = trace.quantities.iter().map(|quantity| quantity.of(&record));
                        let row = core::iter::once(record.brain.t).chain(numbers);
                        outcome.trace.iter_mut().zip(row).for_each(|(column, number)| column.push(number));
                    }
                }
                Err(error) => {
                    outcome.broken = Some(error.to_string());
                    break;
                }
            }
            if let SafetyState::Fault(code) = run.state() {
                outcome.broken = Some(format!("Fault at {:.2} s: {code}", run.time()));
                break;
            }
        }
        outcome.values = readings.values().collect();
        Ok(outcome)
    }
}

fn direct<S: Scalar>() -> Direct<S> {
    Direct(Robot::default())
}

/// Runs a case over a link that is made for it.
struct Observer<'a> {
    case: &'a Case,
    stop: &'a AtomicBool,
    outcome: &'a mut Outcome,
}

impl OverLink for Observer<'_> {
    fn over(self, link: impl Coupling, _: &About) -> Result<(), Failure> {
        *self.outcome = self.case.over(link, self.stop)?;
        Ok(())
    }
}
