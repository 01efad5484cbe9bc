//! `barrel replay`: the sensors of a recording through the brain alone.
//!
//! A log is replayed frame by frame: a fresh robot hears what the recorded one heard, and must answer with the same bytes.
//! A CSV is replayed row by row from its columns x1 and x2.

use crate::cli::{Format, ReplayArgs};
use crate::csv::{self, Number, Table};
use crate::draft::Draft;
use crate::failure::Failure;
use crate::log::{self, Entry};
use firmware::scalar::Fixed16;
use firmware::{Robot, Scalar};
use hil_sim::experiment::Experiment;
use hil_sim::link::Direction;
use hil_sim::record::BrainRecord;
use hil_sim::replay::{self, Event};
use hil_sim::run::time;
use hil_sim::setup::{BodyKind, Setup};
use hil_sim::world::robot_parameters;
use protocol::HostMessage;
use protocol::parameter::Scope;
use std::io::{self, Write};
use std::path::Path;

/// How a brain's numbers are written: the floats as they are, fixed point as the decimal of its exact value.
trait Written: Scalar {
    type As: Number;
    fn written(self) -> Self::As;
}

impl Written for f32 {
    type As = f32;
    fn written(self) -> f32 {
        self
    }
}

impl Written for f64 {
    type As = f64;
    fn written(self) -> f64 {
        self
    }
}

impl Written for Fixed16 {
    type As = f64;
    fn written(self) -> f64 {
        self.to_f64()
    }
}

/// Replays a log or a CSV and says how it compares with what was recorded.
///
/// # Errors
/// A recording that cannot be read, a CSV that cannot be written. A log that does not reproduce under its own settings is
/// a failure too: one of the two robots is wrong.
pub fn replay(args: &ReplayArgs) -> Result<(), Failure> {
    Failure::unless_there(&args.file)?;
    if let Some((id, _)) =
        args.sets.iter().find(|(id, _)| !matches!(id.parameter().scope, Scope::Brain | Scope::Stimulus))
    {
        return Err(Failure::bad(format!("{} does not act on the brain alone: replay cannot set it", id.name())));
    }
    if !log::is_log(&args.file) {
        return replay_csv(args);
    }
    if args.experiment.is_some() || args.seed.is_some() {
        return Err(Failure::bad("a log brings its own experiment and seed: leave --experiment and --seed out"));
    }
    replay_log(args)
}

fn replay_csv(args: &ReplayArgs) -> Result<(), Failure> {
    let table = csv::read_recording(&args.file).map_err(Failure::bad)?;
    match args.precision.unwrap_or(Format::F64) {
        Format::F64 => brain_alone::<f64>(args, &table),
        Format::F32 => brain_alone::<f32>(args, &table),
        Format::Fixed => brain_alone::<Fixed16>(args, &table),
    }
}

/// Runs the sensors of `table` through a brain with the parameters of the command line.
fn brain_alone<S: Written>(args: &ReplayArgs, table: &Table) -> Result<(), Failure> {
    let mut robot = Robot::<S>::default();
    let experiment = args
        .experiment
        .or_else(|| Experiment::find("homeokinetic"))
        .ok_or_else(|| Failure::bad("there is no homeokinetic experiment: this build is broken"))?;
    let mut setup = Setup::new(experiment, BodyKind::Chapter);
    for &(id, value) in &args.sets {
        setup.set(id, value).map_err(Failure::bad)?;
    }
    for id in robot_parameters() {
        let value = setup.values.get(id);
        robot.set(id, value).map_err(|_| Failure::bad(format!("{} = {value} is not taken", id.name())))?;
    }
    robot.restart(args.seed.unwrap_or(setup.seed));
    robot.handle(&HostMessage::SimulatedSensors(true), &mut |_| {});
    robot.handle(&HostMessage::Arm, &mut |_| {});
    let sensors = table.sensors().map_err(Failure::bad)?;
    let mut out = Output::create(args.csv.as_deref())?;
    let mut comparison = Comparison::default();
    for (k, x) in sensors.iter().enumerate() {
        robot.think(x.map(S::from_f64));
        if robot.safety_state() != protocol::SafetyState::Armed {
            return Err(Failure::broken(format!("row {}: a number in the brain is no longer finite", k + 1)));
        }
        let record = BrainRecord::of(&robot, time(k as u64));
        comparison.add(table, k, &record);
        out.write(&record)?;
    }
    out.finish()?;
    if !out_is_stdout(args) {
        say!("{} rows replayed in {}", sensors.len(), Format::from(S::PRECISION).name());
        comparison.print();
    }
    Ok(())
}

fn replay_log(args: &ReplayArgs) -> Result<(), Failure> {
    let mut reader = log::Reader::open(&args.file).map_err(Failure::bad)?;
    let mut frames: Vec<(Direction, Vec<u8>)> = Vec::new();
    for entry in reader.by_ref() {
        if let Entry::Frame { direction, bytes, .. } = entry.map_err(Failure::bad)? {
            frames.push((direction, bytes));
        }
    }
    if frames.is_empty() {
        return Err(Failure::bad(format!("{} holds no frames to replay", args.file.display())));
    }
    let run = reader.run();
    let schema = format!("{:016x}", protocol::SCHEMA);
    if let Some(recorded) = run.get("schema_hash").filter(|recorded| **recorded != schema) {
        return Err(Failure::bad(format!(
            "{} was recorded with messages of schema {recorded}, this version has {schema}: replay it with version {}",
            args.file.display(),
            run.get("barrel_version").map_or("the one that wrote it", String::as_str)
        )));
    }
    let own = match run.get("precision").map(String::as_str) {
        Some("f64") => Format::F64,
        Some("fixed") => Format::Fixed,
        _ => Format::F32,
    };
    let format = args.precision.unwrap_or(own);
    if reader.truncated() {
        eprintln!("barrel: {} was cut off: this is all of it up to its last whole chunk", args.file.display());
    }
    let verdict = match format {
        Format::F64 => frames_alone::<f64>(args, &frames),
        Format::F32 => frames_alone::<f32>(args, &frames),
        Format::Fixed => frames_alone::<Fixed16>(args, &frames),
    }?;
    let mut told: Box<dyn Write> = if out_is_stdout(args) { Box::new(io::stderr()) } else { Box::new(io::stdout()) };
    let as_recorded = format == own && args.sets.is_empty();
    let text = if verdict.is_identical() {
        format!(
            "{} control steps replayed in {}: every frame of the robot is the same, bit for bit",
            verdict.steps,
            format.name()
        )
    } else {
        format!(
            "{} control steps replayed in {}: {} of {} frames differ, by {:.3e} at most{}",
            verdict.steps,
            format.name(),
            verdict.different,
            verdict.recorded,
            verdict.largest,
            verdict.first.map_or(String::new(), |(was, _)| format!(", from step {} on", was.tick))
        )
    };
    if as_recorded && !verdict.is_identical() {
        return Err(Failure::broken(format!("{text}; this build does not compute what the recorded robot did")));
    }
    writeln!(told, "{text}").map_err(Failure::broken)
}

/// Replays the frames in `S`, writing the CSV of the run that follows the last restart.
fn frames_alone<S: Written>(args: &ReplayArgs, frames: &[(Direction, Vec<u8>)]) -> Result<replay::Verdict, Failure> {
    let mut rows: Vec<BrainRecord<S>> = Vec::new();
    let verdict = replay::replay::<S>(frames.iter().map(|(d, b)| (*d, &b[..])), &args.sets, |event| match event {
        Event::Restart => rows.clear(),
        Event::Step(robot) => rows.push(BrainRecord::of(robot, time(rows.len() as u64))),
    });
    let mut out = Output::create(args.csv.as_deref())?;
    for row in &rows {
        out.write(row)?;
    }
    out.finish()?;
    Ok(verdict)
}

fn out_is_stdout(args: &ReplayArgs) -> bool {
    args.csv.as_deref() == Some(Path::new("-"))
}

/// Where a replay's CSV goes: nowhere, to standard output, or to a file that appears whole or not at all.
enum Output {
    None,
    Standard(csv::Writer<io::Stdout>),
    File(Option<(csv::Writer, Draft)>),
}

impl Output {
    fn create(path: Option<&Path>) -> Result<Self, Failure> {
        Ok(match path {
            None => Output::None,
            Some(path) if path == Path::new("-") => Output::Standard(csv::Writer::new(io::stdout(), false)),
            Some(path) => {
                let draft = Draft::beside(path)
                    .map_err(|error| Failure::bad(format!("cannot write {}: {error}", path.display())))?;
                Output::File(Some((csv::Writer::create(draft.path(), false).map_err(Failure::bad)?, draft)))
            }
        })
    }

    fn write<S: Written>(&mut self, record: &BrainRecord<S>) -> Result<(), Failure> {
        let row = record.map(S::written);
        match self {
            Output::Standard(writer) => unless_left(writer.write(&row, None)),
            Output::File(Some((writer, _))) => writer.write(&row, None).map_err(Failure::broken),
            Output::None | Output::File(None) => Ok(()),
        }
    }

    fn finish(&mut self) -> Result<(), Failure> {
        match self {
            Output::None => Ok(()),
            Output::Standard(writer) => unless_left(writer.flush()),
            Output::File(file) => file.take().map_or(Ok(()), |(writer, draft)| {
                writer.finish().map_err(Failure::broken)?;
                draft.commit().map_err(Failure::broken)
            }),
        }
    }
}

/// A reader of standard output who has gone, as `head` does, is no error.
fn unless_left(result: Result<(), csv::CsvError>) -> Result<(), Failure> {
    match result {
        Err(csv::CsvError::Write { source, .. }) if source.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        result => result.map_err(Failure::broken),
    }
}

/// How far a replay is from the recorded columns.
#[derive(Default)]
struct Comparison {
    compared: bool,
    largest: f64,
    at: Option<(usize, &'static str)>,
}

impl Comparison {
    fn add<S: Written>(&mut self, table: &Table, row: usize, record: &BrainRecord<S>) {
        let names = csv::BRAIN_COLUMNS[1..].iter().map(|c| c.name);
        for (name, number) in names.zip(csv::brain_row(record)) {
            // The sensors are what was put in.
            if name.starts_with('x') && !name.starts_with("xi") {
                continue;
            }
            let Some(recorded) = table.get(name).and_then(|column| column.get(row)) else { continue };
            self.compared = true;
            let difference = (recorded - number.written().as_read()).abs();
            if difference > self.largest {
                self.largest = difference;
                self.at = Some((row, name));
            }
        }
    }

    fn print(&self) {
        match (self.compared, self.at) {
            (false, _) => say!("the recording has no brain columns to compare with"),
            (true, None) => say!("every recorded number of the brain is reproduced"),
            (true, Some((row, name))) => {
                say!("largest difference from the recorded brain: {:.3e}, in {name} of row {}", self.largest, row + 1)
            }
        }
    }
}
