//! A simulated barrel: around the firmware's library in this process, the flash image on a virtual board, or a real board on a
//! serial line.

use super::{Asked, LinkState, Port, with_start};
use crate::channel::{Frame, Id as Channel};
use crate::order::{Order, Start};
use barrel::cli::SetupArgs;
use barrel::commands::run::{About, OverLink, description, over_link, title};
use barrel::console::{Target, parse};
use barrel::failure::Failure;
use barrel::recorded::{Recorded, Step};
use barrel::recorder::Places;
use barrel::session::{Audience, Pace, Simulated};
use hil_sim::coupling::Coupling;
use hil_sim::plant::Drive;
use hil_sim::run::Run;
use hil_sim::setup::BodyKind;
use protocol::Id;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// How long control steps are taken before the window is told of them.
const SLICE: Duration = Duration::from_millis(8);
/// Over so long the speed is measured.
const SPEED_SPAN: Duration = Duration::from_secs(1);
/// A run that reaches less than this part of its speed lags.
const LAGS: f64 = 0.9;

/// Runs what was asked for, and what the window asks for after that, until the window is gone.
pub(super) fn play(setup: SetupArgs, mut port: Port) {
    let mut args = setup;
    loop {
        let begun = Start::from(&args);
        let what = match &args.link {
            barrel::cli::Link::VirtualBoard => "the virtual board: its image is found or built, and started",
            barrel::cli::Link::Serial(_) => "asking the board",
            barrel::cli::Link::InProcess => "starting",
        };
        port.publish(|status| {
            status.link = LinkState::Connecting(what.to_owned());
            status.start = Some(begun);
            status.pace = Pace::Going;
        });
        let mut next = Next::Gone;
        let ended = over_link(&args, Barrel { args: &args, port: &mut port, next: &mut next });
        let start = match (next, ended) {
            (Next::Start(start), ended) => {
                ended.unwrap_or_else(|failure| port.complain(&failure.to_string()));
                Some(start)
            }
            (Next::Gone, Ok(())) => None,
            (_, ended) => {
                let why = ended.err().map_or_else(|| "ended".to_owned(), |failure| failure.to_string());
                port.complain(&why);
                port.publish(|status| {
                    status.link = LinkState::Over(why);
                    status.state = None;
                });
                port.wait_for_start()
            }
        };
        let Some(start) = start else { return };
        args = with_start(&args, &start);
    }
}

/// What comes after a run.
enum Next {
    /// Another one.
    Start(Start),
    /// Nothing: the window is gone.
    Gone,
    /// Whatever the window chooses.
    Choice,
}

struct Barrel<'a> {
    args: &'a SetupArgs,
    port: &'a mut Port,
    next: &'a mut Next,
}

impl OverLink for Barrel<'_> {
    fn over(self, link: impl Coupling, robot: &About) -> Result<(), Failure> {
        let Barrel { args, port, next } = self;
        let setup = args.setup()?;
        let about = description(args, &setup, robot, None);
        let places = Places::log_folder(&format!("play-{}-seed{}", args.experiment.name, args.seed));
        let (places, unrecorded) = match places {
            Ok(places) => (places, None),
            // A barrel that nobody records is better than none, if it is said.
            Err(failure) => (Places::default(), Some(failure)),
        };
        let log = places.log.clone();
        let speed = super::lock(&port.desk).status.speed;
        let recorded = Recorded::start(setup, link, || Ok(places), &about, title(args, 0.0))?;
        let values = recorded.run.setup().values.clone();
        let mut barrel = Simulated::new(recorded, speed);
        port.publish(|status| {
            status.session += 1;
            status.link = LinkState::Live;
            status.state = Some(barrel.recorded().run.state());
            status.values = Some(values);
            status.log.clone_from(&log);
            status.vitals = None;
            status.who = format!("firmware {}, brain in {}", robot.firmware, robot.precision.name());
        });
        if let Some(failure) = unrecorded {
            port.complain(&format!("not recorded: {failure}"));
        }
        *next = Next::Choice;
        let ended = go_on(&mut barrel, port, next, Size::new(log));
        port.publish(|status| status.log = None);
        for file in barrel.finish(ended)? {
            port.say(&format!("written: {}", file.display()));
        }
        Ok(())
    }
}

/// At each multiple of this, bytes, of its log, a run stops and asks whether to go on.
const LARGE: u64 = 4_000_000_000;

/// Looks after the size of a log: at a thousand times real time an unwatched run would fill a disk in an hour.
struct Size {
    log: Option<PathBuf>,
    looked: Instant,
    allowed: u64,
}

impl Size {
    fn new(log: Option<PathBuf>) -> Self {
        Size { log, looked: Instant::now(), allowed: LARGE }
    }

    /// The size, GB, if it has become larger than was agreed to.
    fn is_large(&mut self) -> Option<f64> {
        if self.looked.elapsed() < SPEED_SPAN {
            return None;
        }
        self.looked = Instant::now();
        let size = std::fs::metadata(self.log.as_ref()?).ok()?.len();
        (size > self.allowed).then(|| {
            self.allowed = size + LARGE;
            size as f64 / 1e9
        })
    }
}

/// Steps in pace with the clock and does what is asked, until something else is to begin.
fn go_on<L: Coupling>(
    barrel: &mut Simulated<L>,
    port: &mut Port,
    next: &mut Next,
    mut size: Size,
) -> Result<(), Failure> {
    let mut reached = Reached::new(barrel.time());
    loop {
        let mut nap = barrel.nap();
        loop {
            match port.wait(nap) {
                Asked::Order(Order::Start(start)) => {
                    *next = Next::Start(start);
                    return Ok(());
                }
                Asked::Order(order) => carry_out(order, barrel, port)?,
                Asked::Nothing => break,
                Asked::Gone => {
                    *next = Next::Gone;
                    return Ok(());
                }
            }
            if barrel.is_over() {
                return Ok(());
            }
            nap = Duration::ZERO;
        }
        while barrel.carry_on(port)? {}
        if let Some(size) = size.is_large() {
            barrel.offer(parse("pause"), true, port)?;
            port.complain(&format!("the log has {size:.0} GB: `go` goes on, a new start begins another"));
        }
        let until = Instant::now() + SLICE;
        let mut vitals = None;
        while barrel.is_due() && Instant::now() < until {
            let mut frame = frame(&barrel.recorded().run);
            let Step { record, .. } = barrel.step(port)?;
            let run = &barrel.recorded().run;
            frame.t = record.brain.t;
            frame.set_brain(&record.brain);
            frame.set_plant(&record.plant);
            set_command(&mut frame, run);
            vitals = run.link().vitals().copied();
            if let Some(vitals) = &vitals {
                frame.set_vitals(vitals);
            }
            port.frame(frame);
        }
        let run = &barrel.recorded().run;
        let (state, values) = (run.state(), &run.setup().values);
        let (pace, speed, homing) = (barrel.pace(), barrel.speed(), barrel.is_homing());
        let lag = reached.lag(barrel.time(), pace, speed);
        port.publish(|status| {
            status.state = Some(state);
            status.homing = homing;
            (status.pace, status.speed) = (pace, speed);
            if let Some(lag) = lag {
                status.link = lag;
            }
            status.vitals = vitals.or(status.vitals);
            if status.values.as_ref() != Some(values) {
                status.values = Some(values.clone());
                status.revision += 1;
            }
        });
    }
}

fn carry_out<L: Coupling>(order: Order, barrel: &mut Simulated<L>, port: &mut Port) -> Result<(), Failure> {
    match order {
        Order::Line(line) => {
            port.typed(&line);
            barrel.offer(parse(&line), true, port).map(drop)
        }
        Order::Set(id, value) => match barrel.set(id, value) {
            Ok(held) => barrel.event("parameter", &format!("{} = {held}", id.name())),
            Err(why) => {
                port.complain(&why);
                Ok(())
            }
        },
        Order::Hand(load) => {
            barrel.pull(load);
            Ok(())
        }
        // The caller's.
        Order::Start(_) => Ok(()),
    }
}

/// What is seen of the barrel from outside, before its sensors are read.
fn frame<L: Coupling>(run: &Run<L>) -> Frame {
    let mut frame = Frame::at(run.time());
    let (world, plant) = (run.world(), run.plant());
    frame.set_all(Channel::Rate1, &plant.weight_rates().map(|rate| rate as f32));
    match world.last_transducers() {
        Some(read) => frame.set_transducers(read),
        None => {
            frame.set_all(Channel::Acc1, &plant.specific_force([0.0; 3]).map(|acceleration| acceleration as f32));
            frame.set_all(Channel::Gyro1, &plant.angular_velocity_body().map(|omega| omega as f32));
        }
    }
    let load = world.load_now();
    frame.set(Channel::Torque, load.axis_torque as f32);
    frame.set_all(Channel::ForceX, &load.force_world.map(|force| force as f32));
    frame
}

/// What the drives were told in this step.
fn set_command<L: Coupling>(frame: &mut Frame, run: &Run<L>) {
    let plant = run.plant();
    match (run.setup().body, &plant.body().drive) {
        (BodyKind::Chapter, Drive::Servo(_)) => {
            frame.set_all(Channel::Target1, &plant.command().map(|target| target as f32));
        }
        _ => {
            let range = run.setup().values.get(Id::Range) as f32;
            let y = [frame.get(Channel::Y1), frame.get(Channel::Y2)];
            frame.set_all(Channel::Target1, &y.map(|y| -range * y));
            frame.set_all(Channel::Duty1, &plant.command().map(|duty| duty as f32));
        }
    }
}

/// Measures the speed that is reached.
struct Reached {
    since: Instant,
    time: f64,
    was_going: bool,
}

impl Reached {
    fn new(time: f64) -> Self {
        Reached { since: Instant::now(), time, was_going: false }
    }

    /// Whether the run keeps its speed, once in a while.
    fn lag(&mut self, time: f64, pace: Pace, speed: f64) -> Option<LinkState> {
        let passed = self.since.elapsed();
        let is_going = pace == Pace::Going;
        if passed < SPEED_SPAN && is_going == self.was_going {
            return None;
        }
        let reached = (time - self.time) / passed.as_secs_f64();
        let lags = is_going && self.was_going && speed.is_finite() && reached < LAGS * speed;
        (self.since, self.time, self.was_going) = (Instant::now(), time, is_going);
        Some(if lags {
            LinkState::Lagging(format!("it reaches {reached:.1} of the {speed} x real time asked for"))
        } else {
            LinkState::Live
        })
    }
}
