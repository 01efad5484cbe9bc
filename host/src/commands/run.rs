//! `barrel run`: an experiment from start to end, recorded.

use crate::cli::{Format, Link as LinkKind, RunArgs, SetupArgs};
use crate::failure::Failure;
use crate::plot::Title;
use crate::recorder::{Places, Recorder};
use firmware::scalar::Fixed16;
use firmware::{Robot, Scalar};
use hil_sim::coupling::Coupling;
use hil_sim::link::{InProcess, Line};
use hil_sim::measure::{Measures, norm};
use hil_sim::record::Record;
use hil_sim::run::Run;
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

/// Something to do with a robot, whatever its brain's number format.
pub trait OverLink {
    /// Does it with this robot.
    ///
    /// # Errors
    /// Its own.
    fn over(self, link: impl Coupling) -> Result<(), Failure>;
}

/// Reaches the robot that was asked for and does `what` with it.
///
/// # Errors
/// Those of `what`.
pub fn over_link(args: &SetupArgs, what: impl OverLink) -> Result<(), Failure> {
    let LinkKind::InProcess = args.link;
    match args.precision {
        Format::F64 => what.over(line::<f64>()),
        Format::F32 => what.over(line::<f32>()),
        Format::Fixed => what.over(line::<Fixed16>()),
    }
}

/// A robot in this process, behind the wire protocol.
fn line<S: Scalar>() -> Line<InProcess<S>> {
    Line::new(InProcess::new(Robot::default()))
}

struct Recording<'a>(&'a RunArgs);

impl OverLink for Recording<'_> {
    fn over(self, link: impl Coupling) -> Result<(), Failure> {
        record(self.0, link)
    }
}

fn record(args: &RunArgs, link: impl Coupling) -> Result<(), Failure> {
    let setup = args.setup.setup()?;
    let steps = (args.duration * 50.0).round().max(1.0) as u64;
    let mut run = Run::start(setup, link).map_err(Failure::bad)?;
    let mut places = Places { csv: args.csv.clone(), log: args.log.clone(), plot: args.plot.clone() };
    if places.files().next().is_none() {
        places = Places::run_folder(&format!("{}-seed{}", args.setup.experiment.name, args.setup.seed))?;
    }
    let values = run.setup().values.clone();
    let about = description(&args.setup, run.setup(), Some(args.duration));
    let mut recorder = Recorder::create(&places, &about, &values, title(&args.setup, args.duration))?;
    let mut measures = Measures::default();
    let progress = Progress::new(args.quiet, steps);
    for k in 0..steps {
        let record = run.step().map_err(Failure::broken)?;
        recorder.step(&record, run.link_mut())?;
        measures.add(&record);
        progress.show(k + 1, &record);
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
pub fn description(args: &SetupArgs, setup: &Setup, duration: Option<f64>) -> BTreeMap<String, String> {
    let mut command = format!(
        "barrel run {} --body {} --precision {} --seed {}",
        setup.experiment.name,
        setup.body.name(),
        args.precision.name(),
        setup.seed
    );
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
            ("link", "in-process".to_owned()),
            ("precision", args.precision.name().to_owned()),
            ("seed", setup.seed.to_string()),
            ("duration", duration.map_or("open".to_owned(), |d| d.to_string())),
            ("command", command),
            ("firmware_version", firmware::robot::VERSION.map(|n| n.to_string()).join(".")),
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
