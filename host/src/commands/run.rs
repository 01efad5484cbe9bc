//! `barrel run`: an experiment from start to end, recorded.

use crate::cli::{Format, Link as LinkKind, RunArgs, SetupArgs};
use crate::failure::Failure;
use crate::plot::Title;
use crate::reach::reach;
use crate::recorder::{Places, Recorder};
use crate::words;
use firmware::scalar::Fixed16;
use firmware::{Robot, Scalar};
use hil_sim::coupling::Coupling;
use hil_sim::link::{Identity, InProcess, Line};
use hil_sim::measure::{Measures, norm};
use hil_sim::record::Record;
use hil_sim::run::{Run, RunError};
use hil_sim::setup::Setup;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Runs the experiment over the link that was asked for.
///
/// # Errors
/// Parameters that make no barrel, files that cannot be written, a robot that does not answer.
pub fn run(args: &RunArgs) -> Result<(), Failure> {
    over_link(&args.setup, Recording(args))
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
    use hil_sim::setup::BodyKind;
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

struct Recording<'a>(&'a RunArgs);

impl OverLink for Recording<'_> {
    fn over(self, link: impl Coupling, robot: &About) -> Result<(), Failure> {
        record(self.0, link, robot)
    }
}

fn record(args: &RunArgs, link: impl Coupling, robot: &About) -> Result<(), Failure> {
    let setup = args.setup.setup()?;
    let steps = (args.duration * 50.0).round().max(1.0) as u64;
    let mut run = Run::start(setup, link).map_err(Failure::bad)?;
    let mut places = Places { csv: args.csv.clone(), log: args.log.clone(), plot: args.plot.clone() };
    if places.files().next().is_none() {
        places = Places::run_folder(&format!("{}-seed{}", args.setup.experiment.name, args.setup.seed))?;
    }
    let values = run.setup().values.clone();
    let about = description(&args.setup, run.setup(), robot, Some(args.duration));
    let mut recorder = Recorder::create(&places, &about, &values, title(&args.setup, args.duration))?;
    let mut measures = Measures::default();
    let progress = Progress::new(args.quiet, steps);
    let mut broken = None;
    for k in 0..steps {
        let record = match run.step() {
            Ok(record) => record,
            Err(error) => {
                broken = Some(error);
                break;
            }
        };
        recorder.step(&record, run.link_mut())?;
        measures.add(&record);
        progress.show(k + 1, &record);
    }
    if let Some(error) = broken {
        progress.finish(measures.steps());
        // What there is, is worth keeping; and a robot that still listens is left as it should be found.
        recorder.finish()?;
        if !matches!(error, RunError::Link(_)) {
            run.finish().map_err(Failure::broken)?;
        }
        let files: Vec<String> = places.files().map(|file| file.display().to_string()).collect();
        return Err(Failure::broken(format!(
            "{error}; the run ended at {:.2} s, and what was recorded until then is in {}",
            run.time(),
            files.join(", ")
        )));
    }
    run.finish().map_err(Failure::broken)?;
    recorder.finish()?;
    let speed = progress.finish(steps);
    if !args.quiet {
        say!(
            "{} on the {} body, {} s, seed {}:",
            args.setup.experiment.name,
            run.setup().body.name(),
            args.duration,
            args.setup.seed
        );
        for line in measures.summary() {
            say!("  {line}");
        }
        say!("  Simulated, recorded and drawn at {speed:.0} x real time.");
        say!("Written:");
        for file in places.files() {
            say!("  {}", file.display());
        }
    }
    Ok(())
}

/// The title of a run's picture.
pub fn title(args: &SetupArgs, duration: f64) -> Title {
    Title {
        heading: format!("{} ({})", args.experiment.name, args.experiment.section),
        details: format!(
            "{} body, seed {}, {duration} s{}",
            hil_sim::setup::BodyKind::from(args.body).name(),
            args.seed,
            args.sets.iter().map(|(id, value)| format!(", {} = {value}", id.name())).collect::<String>()
        ),
    }
}

/// What a log says of its run: enough to repeat it.
pub fn description(args: &SetupArgs, setup: &Setup, robot: &About, duration: Option<f64>) -> BTreeMap<String, String> {
    let mut command = format!(
        "barrel run {} --body {} --precision {} --seed {}",
        setup.experiment.name,
        setup.body.name(),
        robot.precision.name(),
        setup.seed
    );
    if args.link != LinkKind::InProcess {
        command += &format!(" --link {}", args.link);
    }
    if let Some(duration) = duration {
        command += &format!(" --duration {duration}");
    }
    for (id, value) in &args.sets {
        command += &format!(" --set {}={value}", id.name());
    }
    for push in &args.pushes {
        command += &format!(" --push {}:{}:{}", push.start, push.torque, push.seconds);
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
    next: std::cell::Cell<Duration>,
}

impl Progress {
    fn new(quiet: bool, steps: u64) -> Self {
        let bar = ProgressBar::new(steps);
        bar.set_draw_target(if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() });
        // The template is a constant: its test is every run.
        if let Ok(style) = ProgressStyle::with_template("{bar:24.green/white} {msg}") {
            bar.set_style(style.progress_chars("━╸ "));
        }
        Progress { bar, start: Instant::now(), next: std::cell::Cell::new(Duration::ZERO) }
    }

    fn show(&self, done: u64, record: &Record) {
        // The clock is read once in a simulated second: it decides nothing but when to draw.
        if !done.is_multiple_of(50) || self.bar.is_hidden() {
            return;
        }
        let elapsed = self.start.elapsed();
        if elapsed < self.next.get() {
            return;
        }
        self.next.set(elapsed + Duration::from_millis(100));
        let simulated = done as f64 / 50.0;
        let total = self.bar.length().unwrap_or(done) as f64 / 50.0;
        self.bar.set_position(done);
        self.bar.set_message(format!(
            "{simulated:.0}/{total:.0} s  {:.0} x real time  omega {:+.2} rad/s  E {:.1e}  |C| {:.2}",
            simulated / elapsed.as_secs_f64().max(1e-9),
            record.plant.omega,
            record.brain.error,
            norm(&record.brain.c)
        ));
    }

    /// Ends the bar and returns the speed against real time.
    fn finish(&self, steps: u64) -> f64 {
        self.bar.finish_and_clear();
        steps as f64 / 50.0 / self.start.elapsed().as_secs_f64().max(1e-9)
    }
}
