//! The command line: what can be asked, and the check of every name and number in it.

use crate::console::parse_assignment;
use crate::failure::Failure;
use crate::suggest;
use clap::{Args, Parser, Subcommand, ValueEnum};
use hil_sim::chain::body::Touch;
use hil_sim::chain::reading::ChainMeasure;
use hil_sim::chain::{Hand, Shape};
use hil_sim::experiment::{EXPERIMENTS, Experiment};
use hil_sim::link::serial::USB_BAUD;
use hil_sim::measure::Measure;
use hil_sim::run::{RunError, only_at_start};
use hil_sim::schedule::{Action, Event};
use hil_sim::setup::{BodyKind, Push, Setup};
use protocol::Id;
use protocol::message::Precision;
use std::path::PathBuf;

/// A barrel with two sliding weights teaches itself to roll.
///
/// Without a command: `barrel run homeokinetic`.
#[derive(Debug, Parser)]
#[command(name = "barrel", version, about)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run an experiment of the chapter and record it
    Run(RunArgs),
    /// Run the sensors of a recording through the brain alone
    Replay(ReplayArgs),
    /// Write the CSV of a log
    Export(ExportArgs),
    /// Draw a recording
    Plot(PlotArgs),
    /// List experiments, parameters and columns
    List(ListArgs),
    /// Talk to a running barrel: show and set parameters, push, store and load
    Console(ConsoleArgs),
    /// Open the playground: a window on the barrel, to see it, push it and turn its knobs
    Play(PlayArgs),
    /// Watch a robot and record what it says
    Monitor(MonitorArgs),
    /// The same brain in another body: a chain of driven pendulums, with more sensors than motors or fewer
    Chain(ChainArgs),
    /// Run every claim of the chapter and write what comes of it, as HTML and JSON
    Report(ReportArgs),
}

/// What decides a run.
#[derive(Clone, Debug, Args)]
pub struct SetupArgs {
    /// open-loop, closed-loop, learn-controller, homeostatic, homeokinetic or upright (see `barrel list`)
    #[arg(value_name = "EXPERIMENT", value_parser = experiment, default_value = "homeokinetic")]
    pub experiment: &'static Experiment,
    /// The barrel: the chapter's, or one that can be built
    #[arg(long, value_enum, default_value_t = Body::Chapter)]
    pub body: Body,
    /// How the robot is reached: in-process, virtual-board, or `serial:PORT[@BAUD]`, as in serial:/dev/ttyACM0 (460800 baud, the
    /// board on USB; its radio takes @57600)
    #[arg(long, value_parser = link, default_value = "in-process")]
    pub link: Link,
    /// The flash image of a virtual board [default: built from the sources]
    #[arg(long, value_name = "FILE.elf")]
    pub firmware: Option<PathBuf>,
    /// Number format of the robot's brain; what it reports, and so what is recorded, is f32 in each [default: f32; a robot
    /// that is not in process has its own]
    #[arg(long, value_enum)]
    pub precision: Option<Format>,
    /// Seed of all randomness
    #[arg(long, default_value_t = 1, allow_hyphen_values = true)]
    pub seed: u64,
    /// Set a parameter, as in epsC=0.2 (repeatable; see `barrel list parameters`)
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = assignment)]
    pub sets: Vec<(Id, f64)>,
    /// Push with a torque about the cylinder axis, in s : N·m : s (repeatable)
    #[arg(long = "push", value_name = "START:TORQUE:SECONDS", value_parser = push, allow_hyphen_values = true)]
    pub pushes: Vec<Push>,
    /// Do something at a time in s, or again and again: set a parameter (60:epsC=0.2), scatter C by up to ±0.2 (60:scatter=0.2),
    /// draw C or h anew within ±5 (60:randomC=5, 60:randomH=3; every 90 s from 0 on: 0/90:randomC=5) (repeatable)
    #[arg(long = "at", value_name = "TIME[/EVERY]:ACTION", value_parser = event, allow_hyphen_values = true)]
    pub schedule: Vec<Event>,
}

impl SetupArgs {
    /// The setup that was asked for.
    ///
    /// # Errors
    /// A value out of range.
    pub fn setup(&self) -> Result<Setup, Failure> {
        let mut setup = Setup::new(self.experiment, self.body.into());
        setup.seed = self.seed;
        setup.pushes.clone_from(&self.pushes);
        setup.schedule.clone_from(&self.schedule);
        for &(id, value) in &self.sets {
            setup.set(id, value).map_err(Failure::bad)?;
        }
        Ok(setup)
    }

    /// The line that asks for this setup; what is as by default is left out.
    pub fn line(&self) -> String {
        let mut line = format!("barrel run {}", self.experiment.name);
        if self.body != Body::Chapter {
            line += &format!(" --body {}", BodyKind::from(self.body).name());
        }
        if self.link != Link::InProcess {
            line += &format!(" --link {}", self.link);
        }
        if let Some(precision) = self.precision {
            line += &format!(" --precision {}", precision.name());
        }
        line += &format!(" --seed {}", self.seed);
        for (id, value) in &self.sets {
            line += &format!(" --set {}={value}", id.name());
        }
        for push in &self.pushes {
            line += &format!(" --push {}:{}:{}", push.start, push.torque, push.seconds);
        }
        for event in &self.schedule {
            line += &format!(" --at {event}");
        }
        line
    }
}

/// `barrel run`
#[derive(Clone, Debug, Args)]
pub struct RunArgs {
    /// What decides the run.
    #[command(flatten)]
    pub setup: SetupArgs,
    /// Simulated seconds
    #[arg(long, value_name = "SECONDS", default_value = "120", value_parser = duration, allow_hyphen_values = true)]
    pub duration: f64,
    /// Write the CSV here, and no run folder
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// Write the log (MCAP) here, and no run folder
    #[arg(long, value_name = "FILE.mcap")]
    pub log: Option<PathBuf>,
    /// Draw the picture here (.png or .svg), and no run folder
    #[arg(long, value_name = "FILE")]
    pub plot: Option<PathBuf>,
    /// Print a measure, as in mean:omega:60:120 or interval, and make no run folder (repeatable; see `barrel list measures`)
    #[arg(long = "measure", value_name = "MEASURE[:FROM[:TO]]")]
    pub measures: Vec<Measure>,
    /// No progress, no summary
    #[arg(long, short)]
    pub quiet: bool,
}

impl Default for RunArgs {
    /// The chapter's homeokinetic barrel for two minutes.
    fn default() -> Self {
        match Cli::parse_from(["barrel", "run"]).command {
            Some(Command::Run(args)) => args,
            _ => unreachable!("`barrel run` is the run command"),
        }
    }
}

/// `barrel replay`
#[derive(Debug, Args)]
pub struct ReplayArgs {
    /// A CSV with the columns x1 and x2, or a log
    #[arg(value_name = "FILE.csv|FILE.mcap")]
    pub file: PathBuf,
    /// Number format of the brain [default: of a log its own, of a CSV f64]
    #[arg(long, value_enum)]
    pub precision: Option<Format>,
    /// Start from an experiment's preset instead of the defaults (a log brings its own parameters)
    #[arg(long, value_parser = experiment)]
    pub experiment: Option<&'static Experiment>,
    /// Seed of the open loop's noise (a log brings its own)
    #[arg(long)]
    pub seed: Option<u64>,
    /// Set a parameter (repeatable)
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = assignment)]
    pub sets: Vec<(Id, f64)>,
    /// Write the brain's CSV here (- for standard output)
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
}

/// `barrel export`
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// The log
    #[arg(value_name = "FILE.mcap")]
    pub log: PathBuf,
    /// The CSV to write [default: the log's name with .csv]
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
}

/// `barrel plot`
#[derive(Debug, Args)]
pub struct PlotArgs {
    /// A CSV or a log
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// The picture to write, .png or .svg [default: the recording's name with .png]
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Draw these columns over time instead of the whole run, as in C11,C12
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    pub columns: Vec<String>,
}

/// `barrel list`
#[derive(Debug, Args)]
pub struct ListArgs {
    /// Which list
    #[arg(value_enum)]
    pub what: Option<Listing>,
}

/// `barrel console`
#[derive(Debug, Args)]
pub struct ConsoleArgs {
    /// What decides the run.
    #[command(flatten)]
    pub setup: SetupArgs,
    /// Put a robot on a serial line into the simulated barrel, instead of talking to it as it stands there
    #[arg(long)]
    pub simulate: bool,
    /// Speed against real time
    #[arg(long, default_value_t = 1.0, value_parser = speed, allow_hyphen_values = true)]
    pub speed: f64,
    /// End by itself after this many simulated seconds
    #[arg(long, value_name = "SECONDS", value_parser = duration, allow_hyphen_values = true)]
    pub duration: Option<f64>,
    /// Write the CSV here
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// Write the log (MCAP) here
    #[arg(long, value_name = "FILE.mcap")]
    pub log: Option<PathBuf>,
}

/// `barrel play`
#[derive(Clone, Debug, Args)]
pub struct PlayArgs {
    /// What decides the run that it begins with.
    #[command(flatten)]
    pub setup: SetupArgs,
    /// Put a robot on a serial line into the simulated barrel, instead of showing it as it stands there
    #[arg(long)]
    pub simulate: bool,
    /// Show a recording, a log or a CSV
    #[arg(long, value_name = "FILE")]
    pub open: Option<PathBuf>,
}

impl PlayArgs {
    /// Looks for what is wrong with them that can be known before a window is opened.
    ///
    /// # Errors
    /// A value out of range, a recording that is not there.
    pub fn check(&self) -> Result<(), Failure> {
        self.setup.setup()?;
        self.open.as_deref().map_or(Ok(()), Failure::unless_there)
    }
}

/// `barrel monitor`
#[derive(Debug, Args)]
pub struct MonitorArgs {
    /// The robot's port, as in /dev/ttyACM0 or ttyUSB0@57600 [default: found by asking on every port on USB]
    #[arg(long, value_name = "PORT[@BAUD]", value_parser = address)]
    pub port: Option<Address>,
    /// Write the log (MCAP) here [default: in a new folder of runs/]
    #[arg(long, value_name = "FILE.mcap")]
    pub log: Option<PathBuf>,
    /// End by itself after this many seconds
    #[arg(long, value_name = "SECONDS", value_parser = duration, allow_hyphen_values = true)]
    pub duration: Option<f64>,
}

/// `barrel chain`
#[derive(Clone, Debug, Args)]
pub struct ChainArgs {
    /// angles (2 sensors, 2 motors), angles-and-rates (4, 2) or end-angles (2, 3)
    #[arg(value_name = "SHAPE", value_parser = shape, default_value = "angles-and-rates")]
    pub shape: Shape,
    /// Simulated seconds
    #[arg(long, value_name = "SECONDS", default_value = "120", value_parser = duration, allow_hyphen_values = true)]
    pub duration: f64,
    /// Seed of the sensors' noise
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Set a parameter of the brain or the sensors' noise, as in epsC=0.2 (repeatable)
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = assignment)]
    pub sets: Vec<(Id, f64)>,
    /// Hold a pendulum where it is, in s : s : number from 1 (repeatable)
    #[arg(long = "hold", value_name = "START:SECONDS:PENDULUM", value_parser = hold, allow_hyphen_values = true)]
    pub holds: Vec<Hand>,
    /// Print a measure, as in wave:60 or left-rest (repeatable; see `barrel list measures`)
    #[arg(long = "measure", value_name = "MEASURE[:FROM[:TO]]")]
    pub measures: Vec<ChainMeasure>,
    /// Write the CSV here
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
}

/// `barrel report`
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// The folder for report.html and report.json
    #[arg(long, value_name = "FOLDER", default_value = "report")]
    pub out: PathBuf,
    /// A first look, in less than a minute: fewer seeds, coarser maps
    #[arg(long)]
    pub quick: bool,
    /// Only these claims, as in --only sweep,locking
    #[arg(long, value_delimiter = ',', value_name = "CLAIMS")]
    pub only: Vec<String>,
    /// The seeds are this one and those that follow it, up to 10^15
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(..=1_000_000_000_000_000))]
    pub seed: u64,
    /// Runs at once [default: one for each core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    pub jobs: Option<u16>,
    /// No progress
    #[arg(long, short)]
    pub quiet: bool,
}

/// Which list `barrel list` prints.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Listing {
    /// The chapter's experiments.
    Experiments,
    /// Every parameter with unit, range, default and help.
    Parameters,
    /// The columns of the CSV.
    Columns,
    /// What `--measure` takes.
    Measures,
    /// The bodies.
    Bodies,
}

/// Body names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Body {
    /// The chapter's barrel: 1 m, inclinations measured directly, a force servo of its own
    Chapter,
    /// A barrel that can be built: IMU, encoders, DC motors
    Tabletop,
}

impl From<BodyKind> for Body {
    fn from(body: BodyKind) -> Self {
        match body {
            BodyKind::Chapter => Body::Chapter,
            BodyKind::Tabletop => Body::Tabletop,
        }
    }
}

impl From<Body> for BodyKind {
    fn from(body: Body) -> Self {
        match body {
            Body::Chapter => BodyKind::Chapter,
            Body::Tabletop => BodyKind::Tabletop,
        }
    }
}

/// Number formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Double precision
    F64,
    /// Single precision, as on the robot
    F32,
    /// Fixed point with 16 fraction bits
    Fixed,
}

impl Format {
    /// Name on the command line and in logs.
    pub const fn name(self) -> &'static str {
        match self {
            Format::F64 => "f64",
            Format::F32 => "f32",
            Format::Fixed => "fixed",
        }
    }
}

impl From<Precision> for Format {
    fn from(precision: Precision) -> Self {
        match precision {
            Precision::F64 => Format::F64,
            Precision::F32 => Format::F32,
            Precision::Fixed => Format::Fixed,
        }
    }
}

/// How the robot is reached.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Link {
    /// The firmware library in this process.
    InProcess,
    /// The flash image on an emulated board.
    VirtualBoard,
    /// A board on a serial line.
    Serial(Address),
}

impl std::fmt::Display for Link {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Link::InProcess => f.write_str("in-process"),
            Link::VirtualBoard => f.write_str("virtual-board"),
            Link::Serial(address) => write!(f, "serial:{address}"),
        }
    }
}

/// A serial port, and how fast it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address {
    /// Its device or name.
    pub port: String,
    /// Bits a second, if they were said.
    pub baud: Option<u32>,
}

impl Address {
    /// Bits a second: as said, else those of the board on USB.
    pub fn baud(&self) -> u32 {
        self.baud.unwrap_or(USB_BAUD)
    }
}

impl std::fmt::Display for Address {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.port)?;
        self.baud.map_or(Ok(()), |baud| write!(f, "@{baud}"))
    }
}

fn experiment(name: &str) -> Result<&'static Experiment, String> {
    Experiment::find(name).ok_or_else(|| {
        let hint = suggest::did_you_mean(name, EXPERIMENTS.iter().map(|e| e.name));
        format!("there is no such experiment{hint}; `barrel list` shows them all")
    })
}

fn shape(name: &str) -> Result<Shape, String> {
    Shape::find(name).ok_or_else(|| {
        let names = Shape::ALL.map(Shape::name);
        let hint = suggest::did_you_mean(name, names);
        format!("there is no such chain{hint}; there are {}", names.join(", "))
    })
}

fn hold(text: &str) -> Result<Hand, String> {
    let wrong =
        || format!("'{text}' is no hold; write START:SECONDS:PENDULUM in s, s and a number from 1, as in 60:10:1");
    let parts: Vec<&str> = text.split(':').collect();
    let [start, seconds, pendulum] = parts[..] else { return Err(wrong()) };
    let number = |text: &str| text.parse::<f64>().ok().filter(|t| t.is_finite() && *t >= 0.0).ok_or_else(wrong);
    let pendulum = pendulum.parse::<usize>().ok().and_then(|pendulum| pendulum.checked_sub(1)).ok_or_else(wrong)?;
    Ok(Hand { start: number(start)?, seconds: number(seconds)?, pendulum, touch: Touch::Hold })
}

fn link(name: &str) -> Result<Link, String> {
    match (name, name.strip_prefix("serial:")) {
        ("in-process", _) => Ok(Link::InProcess),
        ("virtual-board", _) => Ok(Link::VirtualBoard),
        (_, Some(port)) => address(port).map(Link::Serial),
        _ => {
            Err("there is no such link; use in-process, virtual-board or serial:PORT, as in serial:/dev/ttyACM0"
                .to_owned())
        }
    }
}

fn address(text: &str) -> Result<Address, String> {
    let usage = "write PORT or PORT@BAUD, as in /dev/ttyACM0 or ttyUSB0@57600";
    let (port, baud) = match text.rsplit_once('@') {
        None => (text, None),
        Some((port, baud)) => match baud.parse() {
            Ok(baud @ 1200..=4_000_000) => (port, Some(baud)),
            _ => return Err(format!("'{baud}' is no speed of a serial port, which is 1200 to 4000000 baud; {usage}")),
        },
    };
    if port.is_empty() {
        return Err(format!("the port is missing; {usage}"));
    }
    Ok(Address { port: port.to_owned(), baud })
}

/// A parameter's name and value, checked against the table as the console does it.
fn assignment(text: &str) -> Result<(Id, f64), String> {
    if !text.contains('=') {
        return Err(format!("'{text}' is not NAME=VALUE; write for example epsC=0.2"));
    }
    parse_assignment(text).map_err(|error| error.to_string())
}

fn event(text: &str) -> Result<Event, String> {
    let usage = "write TIME:ACTION or TIME/EVERY:ACTION, as in 60:epsC=0.2, 60:scatter=0.2, 0/90:randomC=5";
    let wrong = || format!("'{text}' is nothing that can be done at a time; {usage}");
    let (when, action) = text.split_once(':').ok_or_else(wrong)?;
    let (at, every) = match when.split_once('/') {
        Some((at, every)) => (at, Some(every)),
        None => (when, None),
    };
    let seconds = |text: &str| text.parse::<f64>().ok().filter(|t| t.is_finite() && *t >= 0.0).ok_or_else(wrong);
    let every = every.map(seconds).transpose()?;
    if every.is_some_and(|every| every < 0.02) {
        return Err(format!("'{text}': what is done again and again is done every 0.02 s at most; {usage}"));
    }
    let action = match action.split_once('=') {
        Some((name @ ("scatter" | "randomC" | "randomH"), by)) => {
            let by = by.parse::<f64>().ok().filter(|by| (0.0..=100.0).contains(by));
            let by = by.ok_or_else(|| format!("'{text}': {name} takes a number from 0 to 100"))?;
            match name {
                "scatter" => Action::Scatter(by),
                "randomC" => Action::RandomC(by),
                _ => Action::RandomH(by),
            }
        }
        Some(_) => assignment(action).map(|(id, value)| Action::Set(id, value))?,
        None => return Err(wrong()),
    };
    if let Some(id) = only_at_start(&action) {
        return Err(RunError::OnlyAtStart(id).to_string());
    }
    Ok(Event { at: seconds(at)?, every, action })
}

fn push(text: &str) -> Result<Push, String> {
    let usage = "write START:TORQUE:SECONDS in s, N·m and s, as in 30:10:0.5";
    let parts: Vec<f64> = text
        .split(':')
        .map(|part| part.trim().parse::<f64>().ok().filter(|n| n.is_finite()))
        .collect::<Option<_>>()
        .ok_or_else(|| format!("'{text}' is not a push; {usage}"))?;
    match parts[..] {
        [start, torque, seconds] if start >= 0.0 && seconds > 0.0 && torque.abs() <= 1000.0 => {
            Ok(Push { start, torque, force: 0.0, seconds })
        }
        [_, _, _] => {
            Err(format!("'{text}': a push starts at 0 s or later, lasts longer than 0 s and has at most 1000 N·m"))
        }
        _ => Err(format!("'{text}' is not a push; {usage}")),
    }
}

/// Longest run, s: its control steps are counted in 32 bits.
const LONGEST: f64 = 8e7;

fn duration(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (0.02..=LONGEST).contains(&seconds) => Ok(seconds),
        Ok(_) => Err(format!("a run lasts from 0.02 s (one control step) to {LONGEST} s")),
        Err(_) => Err("not a number of seconds; write for example 120".to_owned()),
    }
}

fn speed(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(speed) if (0.01..=1e6).contains(&speed) => Ok(speed),
        _ => Err("a speed is a number from 0.01 to 1e6; 1 is real time".to_owned()),
    }
}
