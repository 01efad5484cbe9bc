//! `barrel console`: a barrel that rolls while its parameters are shown, set, stored and loaded.

use crate::cli::{ConsoleArgs, Link};
use crate::commands::robot_console::robot_console;
use crate::commands::run::{About, OverLink, description, over_link, title};
use crate::console::robot::{self, HOMED, Pending, Robot, is_next, unless_refused};
use crate::console::{Action, Command, Console, ConsoleError, Input, Target, execute};
use crate::failure::Failure;
use crate::recorded::{Recorded, Step};
use crate::recorder::Places;
use crate::words;
use hil_sim::coupling::Coupling;
use hil_sim::measure::Measures;
use hil_sim::setup::BodyKind;
use protocol::message::{SafetyState, Vitals};
use protocol::{HostMessage, Id, RobotMessage};
use std::collections::VecDeque;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Runs the experiment at the speed asked for and carries out every line that is typed, until `quit`; or talks to a robot on
/// a serial line as it stands there.
///
/// # Errors
/// As `barrel run`.
pub fn console(args: &ConsoleArgs) -> Result<(), Failure> {
    match &args.setup.link {
        Link::Serial(address) if !args.simulate => robot_console(args, address),
        _ => {
            let places = Places::new(args.csv.clone(), args.log.clone(), None);
            // What is wrong with the places is said before a robot hears of the run.
            places.check()?;
            over_link(&args.setup, Session { args, places })
        }
    }
}

struct Session<'a> {
    args: &'a ConsoleArgs,
    places: Places,
}

impl OverLink for Session<'_> {
    fn over(self, link: impl Coupling, robot: &About) -> Result<(), Failure> {
        let Session { args, places } = self;
        let setup = args.setup.setup()?;
        let about = description(&args.setup, &setup, robot, args.duration);
        let mut barrel = Barrel {
            recorded: Recorded::start(setup, link, || Ok(places), &about, title(&args.setup, 0.0))?,
            speed: args.speed,
            pace: Pace::Going,
            pending: None,
            waiting: VecDeque::new(),
            quit: false,
        };
        let mut console = Console::start(history().as_deref());
        console.print(&format!(
            "{} on the {} body, seed {}; help explains, quit ends",
            args.setup.experiment.name,
            BodyKind::from(args.setup.body).name(),
            args.setup.seed
        ));
        let mut measures = Measures::default();
        let ended = barrel.go_on(&mut console, &mut measures, args.duration.unwrap_or(f64::INFINITY));
        let files = barrel.recorded.finish(ended)?;
        for line in measures.summary() {
            console.print(&line);
        }
        for file in files {
            console.print(&format!("written: {}", file.display()));
        }
        Ok(())
    }
}

/// The file that keeps the lines from one console to the next.
pub(super) fn history() -> Option<PathBuf> {
    let home = std::env::var_os("XDG_STATE_HOME")
        .map(PathBuf::from)
        .or_else(|| std::env::var_os("HOME").map(|home| PathBuf::from(home).join(".local/state")))?;
    let folder = home.join("barrel");
    std::fs::create_dir_all(&folder).ok()?;
    Some(folder.join("history"))
}

/// Whether the simulated time goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pace {
    Going,
    Paused,
    /// So many steps, then pause.
    Steps(u32),
}

/// A run that can be talked to.
struct Barrel<L> {
    recorded: Recorded<L>,
    speed: f64,
    pace: Pace,
    /// What the robot was set to and has not come to the end of.
    pending: Option<Pending>,
    /// Lines that wait for that.
    waiting: VecDeque<Result<Command, ConsoleError>>,
    quit: bool,
}

/// Control steps between two looks at a robot that has something to do.
const LOOK: u64 = 10;
/// A run that falls further behind than this, s, does not try to catch up: as after a suspend, or at a speed that the
/// machine cannot reach.
const TOO_LATE: f64 = 0.25;
/// How often a paused run looks for what happened.
const NAP: Duration = Duration::from_millis(50);

impl<L: Coupling> Barrel<L> {
    /// Steps in pace with the clock, and carries out lines in between, until the end or `quit`.
    fn go_on(&mut self, console: &mut Console, measures: &mut Measures, end: f64) -> Result<(), Failure> {
        let mut listening = true;
        let (mut origin, mut speed) = ((Instant::now(), self.recorded.time()), self.speed);
        while !self.quit && self.recorded.time() < end {
            let ahead = self.ahead(origin);
            if self.pace != Pace::Going || speed != self.speed || ahead < -TOO_LATE {
                (origin, speed) = ((Instant::now(), self.recorded.time()), self.speed);
            }
            // The clock is waited for in naps, so that a line is carried out when it is typed.
            let nap = match self.pace {
                Pace::Going => Duration::try_from_secs_f64(ahead).unwrap_or_default().min(NAP),
                Pace::Paused => NAP,
                Pace::Steps(_) => Duration::ZERO,
            };
            let input = if !listening {
                std::thread::sleep(nap);
                None
            } else if nap.is_zero() {
                console.poll()
            } else {
                console.wait(nap)
            };
            match input {
                Some(Input::Line(line))
                    if is_next(&line, self.pending, self.waiting.is_empty(), console.is_person()) =>
                {
                    self.line(line, console)?;
                    continue;
                }
                Some(Input::Line(line)) => self.waiting.push_back(line),
                // A script ends; the run goes on to its own end, if it has one.
                Some(Input::End) => {
                    listening = false;
                    self.pace = Pace::Going;
                    continue;
                }
                None => {}
            }
            if self.pending.is_none() {
                if let Some(line) = self.waiting.pop_front() {
                    self.line(line, console)?;
                    continue;
                }
                if !listening && !end.is_finite() {
                    break;
                }
            }
            let is_due = match self.pace {
                Pace::Going => self.ahead(origin) <= 0.0,
                Pace::Paused => false,
                Pace::Steps(_) => true,
            };
            if is_due {
                let Step { record, state } = self.recorded.step()?;
                measures.add(&record);
                if let Some(state) = state {
                    console.print(&format!("{:.2} s: {}", record.brain.t, words::state(state)));
                }
                self.look(self.recorded.run.state(), measures.steps(), console);
                if let Pace::Steps(n) = self.pace {
                    self.pace = if n > 1 { Pace::Steps(n - 1) } else { Pace::Paused };
                }
            }
        }
        Ok(())
    }

    /// How long until the next step is due, s, when the clock and the simulated time stood at `origin` together.
    fn ahead(&self, origin: (Instant, f64)) -> f64 {
        (self.recorded.time() - origin.1) / self.speed - origin.0.elapsed().as_secs_f64()
    }

    fn line(&mut self, line: Result<Command, ConsoleError>, console: &mut Console) -> Result<(), Failure> {
        let t = self.recorded.time();
        match line.and_then(|command| execute(&command, self).map(|said| (command, said))) {
            Ok((command, said)) => {
                console.print(&said);
                match command {
                    Command::Set(..) | Command::Load(_) => self.recorded.recorder.event(t, "parameter", &said)?,
                    Command::Act(Action::Push { .. }) => self.recorded.recorder.event(t, "push", &said)?,
                    _ => {}
                }
            }
            Err(error) => console.print(&error.to_string()),
        }
        self.recorded.recorder.frames(t, self.recorded.run.link_mut())
    }

    /// Looks whether the robot has come to the end of what it was set to, and says so.
    fn look(&mut self, state: SafetyState, step: u64, console: &mut Console) {
        let Some(mut pending) = self.pending.take() else { return };
        let ended = match pending.state(state) {
            Some(homed) => Some(homed.map(|()| HOMED.to_owned())),
            None if step.is_multiple_of(LOOK) => pending.look(self).transpose(),
            None => None,
        };
        match ended {
            Some(Ok(said) | Err(said)) => console.print(&said),
            None => self.pending = Some(pending),
        }
    }
}

impl<L: Coupling> Robot for Barrel<L> {
    fn ask(&mut self, message: &HostMessage) -> Result<RobotMessage, String> {
        unless_refused(self.recorded.run.ask(message).map(|answer| answer.message))
    }

    fn vitals(&self) -> Option<&Vitals> {
        self.recorded.run.link().vitals()
    }
}

impl<L: Coupling> Target for Barrel<L> {
    fn get(&mut self, id: Id) -> Result<f64, String> {
        self.recorded.run.get(id).map_err(|error| error.to_string())
    }

    fn set(&mut self, id: Id, value: f64) -> Result<f64, String> {
        self.recorded.run.set(id, value).map_err(|error| error.to_string())
    }

    fn act(&mut self, action: Action) -> Result<String, String> {
        if matches!(action, Action::Home | Action::Calibrate(_)) && self.recorded.run.setup().body == BodyKind::Chapter
        {
            return Err("the chapter's body has no axes to home and no inertial sensor to calibrate; \
                        --body tabletop has both"
                .to_owned());
        }
        let mut pending = self.pending.take();
        let done = robot::act(action, self, &mut pending);
        self.pending = pending;
        if let Some(done) = done {
            return done;
        }
        match action {
            Action::Push { torque, seconds } => {
                self.recorded.run.push(torque, seconds);
                Ok(format!("pushing with {torque} N m for {seconds} s from {:.2} s on", self.recorded.time()))
            }
            Action::Pause => {
                self.pace = Pace::Paused;
                Ok(format!("paused at {:.2} s", self.recorded.time()))
            }
            Action::Go => {
                self.pace = Pace::Going;
                Ok("going on".to_owned())
            }
            Action::Step(n) => {
                self.pace = Pace::Steps(n);
                Ok(String::new())
            }
            Action::Speed(speed) => {
                self.speed = speed;
                Ok(format!("{speed} x real time"))
            }
            _ => {
                self.quit = true;
                Ok(String::new())
            }
        }
    }
}
