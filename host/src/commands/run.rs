//! `barrel run`: an experiment from start to end, recorded.

use crate::cli::{Format, Link as LinkKind, RunArgs, SetupArgs};
use crate::failure::Failure;
use crate::interrupt;
use crate::plot::Title;
use crate::reach::reach;
use crate::recorded::{Recorded, Step};
use crate::recorder::Places;
use crate::words;
use firmware::scalar::Fixed16;
use firmware::{Robot, Scalar};
use hil_sim::coupling::Coupling;
use hil_sim::link::{Identity, InProcess, Line};
use hil_sim::measure::{Measures, Readings, norm};
use hil_sim::record::Record;
use hil_sim::run::time;
use hil_sim::setup::{BodyKind, Setup};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use protocol::message::SafetyState;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Control steps in a second.
const STEPS: f64 = 50.0;

/// Runs the experiment over the link that was asked for.
///
/// # Errors
/// Parameters that make no barrel, files that cannot be written, a robot that does not answer; a robot that went into Fault or
/// was reset on the way; Ctrl-C.
pub fn run(args: &RunArgs) -> Result<(), Failure> {
    let places = Places::new(args.csv.clone(), args.log.clone(), args.plot.clone());
    // What is wrong with the places is said before a robot hears of the run.
    if is_for_a_folder(args, &places) {
        Places::check_run_folder()?
    } else {
        places.check()?
    }
    let stop = interrupt::flag()?;
    over_link(&args.setup, Recording { args, places, stop: &stop })
}

/// Whether the run gets a folder of its own: where nothing else is asked of it.
fn is_for_a_folder(args: &RunArgs, places: &Places) -> bool {
    places.is_empty() && args.measures.is_empty()
}

/// Something to do with a robot, whatever its brain's number format and however it is reached.
pub trait OverLink {
    /// Does it with this robot.
    ///
    /// # Errors
    /// Its own.
    fn over(self, link: impl Coupling, robot: &About) -> Result<(), Failure>;
}

/// What is known of a robot before anything is done with it.
#[derive(Clone, Debug)]
pub struct About {
    /// Number format of its brain.
    pub precision: Format,
    /// Version of its firmware.
    pub firmware: String,
}

impl About {
    /// Checks what a robot says it is against what was asked for.
    ///
    /// # Errors
    /// A brain in another number format than the one asked for: it is what it was built with.
    pub fn checked(identity: &Identity, asked: Option<Format>) -> Result<Self, Failure> {
        let precision = Format::from(identity.precision);
        match asked {
            Some(asked) if asked != precision => Err(Failure::bad(format!(
                "this robot's brain is in {}, not in {}: leave --precision out, or flash an image that was built so",
                precision.name(),
                asked.name()
            ))),
            _ => Ok(About { precision, firmware: words::version(identity.firmware) }),
        }
    }
}

/// Reaches the robot that was asked for and does `what` with it.
///
/// # Errors
/// A robot that cannot be reached; those of `what`.
pub fn over_link(args: &SetupArgs, what: impl OverLink) -> Result<(), Failure> {
    if args.firmware.is_some() && args.link != LinkKind::VirtualBoard {
        return Err(Failure::bad(
            "--firmware is the image of a virtual board: add --link virtual-board, or leave it out",
        ));
    }
    match &args.link {
        LinkKind::InProcess => in_process(args.precision.unwrap_or(Format::F32), what),
        LinkKind::VirtualBoard => virtual_board(args, what),
        LinkKind::Serial(address) => {
            // What is wrong with the setup is said before the robot hears of it.
            args.setup()?;
            let (line, identity) = reach(address)?;
            what.over(line, &About::checked(&identity, args.precision)?)
        }
    }
}

fn in_process(precision: Format, what: impl OverLink) -> Result<(), Failure> {
    let robot = About { precision, firmware: words::version(firmware::robot::VERSION) };
    match precision {
        Format::F64 => what.over(line::<f64>(), &robot),
        Format::F32 => what.over(line::<f32>(), &robot),
        Format::Fixed => what.over(line::<Fixed16>(), &robot),
    }
}

/// A robot in this process, behind the wire protocol.
fn line<S: Scalar>() -> Line<InProcess<S>> {
    Line::new(InProcess::new(Robot::default()))
}

/// The flash image on an emulated board: in the simulated body, whose sensors are chips; or on the desk, and the chapter's
/// body, which measures its inclination itself, in frames.
#[cfg(feature = "virtual-board")]
fn virtual_board(args: &SetupArgs, what: impl OverLink) -> Result<(), Failure> {
    use hil_sim::link::{Embodied, HELLO, Tethered, hello, recognise};
    use hil_sim::virtual_board::VirtualBoard;
    use hil_sim::world::World;

    // What is wrong with the setup is said before an image is built.
    let mut world = World::new(args.setup()?).map_err(Failure::bad)?;
    let image = crate::image::find(args.firmware.as_deref())?;
    let board = VirtualBoard::power_on(&image).map_err(Failure::bad)?;
    match world.setup().body {
        BodyKind::Chapter => {
            let mut line = Line::new(Tethered::new(board));
            let identity = hello(&mut line).map_err(Failure::bad)?;
            what.over(line, &About::checked(&identity, args.precision)?)
        }
        BodyKind::Tabletop => {
            let mut body = Embodied::new(board);
            let answer = body.request(&HELLO, &mut world).map_err(Failure::bad)?;
            let identity = recognise(&answer.message).map_err(Failure::bad)?;
            what.over(body, &About::checked(&identity, args.precision)?)
        }
    }
}

#[cfg(not(feature = "virtual-board"))]
fn virtual_board(_: &SetupArgs, _: impl OverLink) -> Result<(), Failure> {
    Err(Failure::bad(
        "this `barrel` was built without the virtual board, whose emulator takes some minutes to compile: in the project's \
         folder, `cargo virtual run … --link virtual-board` builds and runs one with it",
    ))
}

struct Recording<'a> {
    args: &'a RunArgs,
    places: Places,
    stop: &'a AtomicBool,
}

impl OverLink for Recording<'_> {
    fn over(self, link: impl Coupling, robot: &About) -> Result<(), Failure> {
        record(self, link, robot)
    }
}

fn record(Recording { args, places, stop }: Recording, link: impl Coupling, robot: &About) -> Result<(), Failure> {
    let setup = args.setup.setup()?;
    let about = description(&args.setup, &setup, robot, Some(args.duration));
    let end = time((args.duration * STEPS).round().max(1.0) as u64);
    if stop.load(Ordering::Relaxed) {
        return Err(Failure::Interrupted("interrupted before the run began".to_owned()));
    }
    let places = || {
        if is_for_a_folder(args, &places) {
            Places::run_folder(&format!("{}-seed{}", args.setup.experiment.name, args.setup.seed))
        } else {
            Ok(places)
        }
    };
    let mut run = Recorded::start(setup, link, places, &about, title(&args.setup, args.duration))?;
    let mut seen = Seen { readings: Readings::new(&args.measures), ..Seen::default() };
    let progress = Progress::new(args.quiet, end);
    let ended = go_on(&mut run, end, stop, &mut seen, &progress);
    let ended = match (seen.fault(), ended) {
        (None, ended) => ended,
        (Some(fault), Ok(())) => Err(Failure::broken(fault)),
        (Some(fault), Err(failure)) => Err(Failure::broken(format!("{fault}; {failure}"))),
    };
    let lasted = run.time();
    let files = run.finish(ended);
    let speed = progress.finish(lasted);
    if !args.quiet && seen.measures.steps() > 0 {
        say!(
            "{} on the {} body, {} s, seed {}:",
            args.setup.experiment.name,
            BodyKind::from(args.setup.body).name(),
            args.duration,
            args.setup.seed
        );
        for line in seen.measures.summary() {
            say!("  {line}");
        }
        for line in seen.states() {
            say!("  {line}.");
        }
        say!("  Simulated, recorded and drawn at {speed:.0} x real time.");
    }
    for (measure, value) in args.measures.iter().zip(seen.readings.values()) {
        say!("{}", format!("{measure} = {value} {}", measure.unit()).trim_end());
    }
    let files = files?;
    if !args.quiet && !files.is_empty() {
        say!("Written:");
        for file in files {
            say!("  {}", file.display());
        }
    }
    Ok(())
}

/// Runs until `end`, s, or until somebody says stop.
fn go_on<L: Coupling>(
    run: &mut Recorded<L>,
    end: f64,
    stop: &AtomicBool,
    seen: &mut Seen,
    progress: &Progress,
) -> Result<(), Failure> {
    while run.time() < end {
        if stop.load(Ordering::Relaxed) {
            return Err(Failure::Interrupted("interrupted".to_owned()));
        }
        let Step { record, state } = run.step()?;
        seen.measures.add(&record);
        seen.readings.add(&record);
        seen.changes.extend(state.map(|state| (record.brain.t, state)));
        progress.show(seen.measures.steps(), run.time(), &record);
    }
    Ok(())
}

/// What there is to say of a run when it is over.
#[derive(Default)]
struct Seen {
    measures: Measures,
    readings: Readings,
    /// Every safety state that the robot went into, and when, s.
    changes: Vec<(f64, SafetyState)>,
}

impl Seen {
    fn states(&self) -> impl Iterator<Item = String> {
        self.changes.iter().map(|&(t, state)| match state {
            SafetyState::Fault(code) => format!("Fault at {t:.2} s: {code}"),
            state => format!("{} at {t:.2} s", words::state(state)),
        })
    }

    /// The first fault, if there was one.
    fn fault(&self) -> Option<String> {
        let at = self.changes.iter().position(|(_, state)| matches!(state, SafetyState::Fault(_)))?;
        self.states().nth(at)
    }
}

/// The title of a run's picture.
pub fn title(args: &SetupArgs, duration: f64) -> Title {
    Title {
        heading: format!("{} ({})", args.experiment.name, args.experiment.section),
        details: format!(
            "{} body, seed {}, {duration} s{}",
            BodyKind::from(args.body).name(),
            args.seed,
            args.sets.iter().map(|(id, value)| format!(", {} = {value}", id.name())).collect::<String>()
        ),
    }
}

/// What a log says of its run: enough to repeat it.
pub fn description(args: &SetupArgs, setup: &Setup, robot: &About, duration: Option<f64>) -> BTreeMap<String, String> {
    let mut command = SetupArgs { precision: Some(robot.precision), ..args.clone() }.line();
    if let Some(duration) = duration {
        command += &format!(" --duration {duration}");
    }
    BTreeMap::from(
        [
            ("experiment", setup.experiment.name.to_owned()),
            ("body", setup.body.name().to_owned()),
            ("link", args.link.to_string()),
            ("precision", robot.precision.name().to_owned()),
            ("seed", setup.seed.to_string()),
            ("duration", duration.map_or("open".to_owned(), |d| d.to_string())),
            ("command", command),
            ("firmware_version", robot.firmware.clone()),
        ]
        .map(|(name, value)| (name.to_owned(), value)),
    )
}

/// The progress bar of a run: simulated time, speed against real time, live figures.
struct Progress {
    bar: ProgressBar,
    start: Instant,
    /// When the run is over, s.
    end: f64,
    next: std::cell::Cell<Duration>,
}

impl Progress {
    fn new(quiet: bool, end: f64) -> Self {
        let bar = ProgressBar::new((end * STEPS) as u64);
        bar.set_draw_target(if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() });
        // The template is a constant: its test is every run.
        if let Ok(style) = ProgressStyle::with_template("{bar:24.green/white} {msg}") {
            bar.set_style(style.progress_chars("━╸ "));
        }
        Progress { bar, start: Instant::now(), end, next: std::cell::Cell::new(Duration::ZERO) }
    }

    /// Shows that so many steps were taken, until `time`, s.
    fn show(&self, steps: u64, time: f64, record: &Record) {
        // The clock is read once in a simulated second: it decides nothing but when to draw.
        if !steps.is_multiple_of(50) || self.bar.is_hidden() {
            return;
        }
        let elapsed = self.start.elapsed();
        if elapsed < self.next.get() {
            return;
        }
        self.next.set(elapsed + Duration::from_millis(100));
        self.bar.set_position((time * STEPS) as u64);
        self.bar.set_message(format!(
            "{time:.0}/{:.0} s  {:.0} x real time  omega {:+.2} rad/s  E {:.1e}  |C| {:.2}",
            self.end,
            time / elapsed.as_secs_f64().max(1e-9),
            record.plant.omega,
            record.brain.error,
            norm(&record.brain.c)
        ));
    }

    /// Ends the bar at this time, s, and returns the speed against real time.
    fn finish(&self, time: f64) -> f64 {
        self.bar.finish_and_clear();
        time / self.start.elapsed().as_secs_f64().max(1e-9)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::{Cli, Command};
    use clap::Parser;
    use hil_sim::link::{Board, Embodied, LinkError, SoftBoard};
    use protocol::message::Transducers;
    use std::path::Path;

    /// A board in the body, and what happens to it on the way.
    struct Eventful {
        board: SoftBoard<f32>,
        /// Frames of telemetry that it has said.
        said: u64,
        /// Its supply drops out at this one.
        cut_at: Option<u64>,
        /// The line loses one in so many.
        loses_one_in: u64,
    }

    impl Eventful {
        fn new(cut_at: Option<u64>, loses_one_in: u64) -> Embodied<Self> {
            Embodied::new(Eventful { board: SoftBoard::new(Robot::default()), said: 0, cut_at, loses_one_in })
        }
    }

    impl Board for Eventful {
        fn tick(
            &mut self,
            transducers: &Transducers,
            to_robot: &[u8],
            from_robot: &mut Vec<u8>,
        ) -> Result<[f32; 2], LinkError> {
            let before = from_robot.len();
            let duty = self.board.tick(transducers, to_robot, from_robot)?;
            // An answer comes alone or in front; what is long is telemetry.
            if from_robot.len() - before > 64 {
                self.said += 1;
                if self.cut_at == Some(self.said) {
                    self.board = SoftBoard::new(Robot::default());
                }
                if self.said.is_multiple_of(self.loses_one_in) {
                    from_robot.truncate(before);
                }
            }
            Ok(duty)
        }
    }

    /// Runs for so many seconds into this folder.
    fn run_for(seconds: &str, folder: &Path, link: impl Coupling) -> Result<(), Failure> {
        let cli = Cli::parse_from(["barrel", "run", "homeokinetic", "--body", "tabletop", "--duration", seconds, "-q"]);
        let Some(Command::Run(args)) = cli.command else { panic!("`barrel run` is the run command") };
        let places = Places::new(Some(folder.join("run.csv")), Some(folder.join("run.mcap")), None);
        let robot = About { precision: Format::F32, firmware: "0.0.0".to_owned() };
        record(Recording { args: &args, places, stop: &AtomicBool::new(false) }, link, &robot)
    }

    /// Times of the control steps in it, s.
    fn times(folder: &Path) -> Vec<f64> {
        let table = crate::csv::read(&folder.join("run.csv")).expect("a whole CSV");
        table.get("t").expect("it has times").to_vec()
    }

    #[test]
    fn a_run_lasts_as_long_as_was_asked_whatever_the_line_loses() {
        let folder = tempfile::tempdir().expect("a folder");
        run_for("4", folder.path(), Eventful::new(None, 10)).expect("it runs");
        let times = times(folder.path());
        assert!((175..185).contains(&times.len()), "{} of 200 steps arrived", times.len());
        assert!(times.last().is_some_and(|last| (3.9..4.05).contains(last)), "{:?}", times.last());
    }

    #[test]
    fn a_count_of_steps_that_goes_back_is_a_reset_and_ends_the_run() {
        let folder = tempfile::tempdir().expect("a folder");
        let robot = Eventful::new(Some(1500), u64::MAX);
        let said = run_for("1000", folder.path(), robot).expect_err("it was reset").to_string();
        assert!(said.contains("the robot was reset at") && said.contains("run.csv"), "{said}");
        let times = times(folder.path());
        assert!(times.len() > 100 && times.windows(2).all(|t| t[0] < t[1]), "{} steps", times.len());
        let events = crate::log::Reader::open(&folder.path().join("run.mcap"))
            .expect("a log")
            .filter(|entry| matches!(entry, Ok(crate::log::Entry::Event(event)) if event.kind == "reset"));
        assert_eq!(events.count(), 1);
    }
}
