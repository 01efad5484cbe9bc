//! A recorded run in pace with the clock, which can be talked to.

use super::Audience;
use crate::console::robot::{self, HOMED, Pending, Robot, is_next, unless_refused};
use crate::console::{Action, Command, ConsoleError, Target, execute};
use crate::failure::Failure;
use crate::recorded::{Recorded, Step};
use crate::words;
use hil_sim::coupling::Coupling;
use hil_sim::plant::Load;
use hil_sim::schedule;
use hil_sim::setup::BodyKind;
use protocol::message::{SafetyState, Vitals};
use protocol::{HostMessage, Id, RobotMessage};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Whether the simulated time goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// With the clock.
    Going,
    /// It stands.
    Paused,
    /// So many steps, then it stands.
    Steps(u32),
}

/// A run that can be talked to.
pub struct Simulated<L> {
    recorded: Recorded<L>,
    /// Simulated seconds a second; infinite is as fast as it goes.
    speed: f64,
    pace: Pace,
    /// When the clock and the simulated time, s, stood together last, and at which speed.
    origin: (Instant, f64, f64),
    /// What the robot was set to and has not come to the end of.
    pending: Option<Pending>,
    /// Lines that wait for that.
    waiting: VecDeque<Result<Command, ConsoleError>>,
    quit: bool,
    /// Control steps taken.
    steps: u64,
}

/// Control steps between two looks at a robot that has something to do.
const LOOK: u64 = 10;
/// A run that falls further behind than this, s, does not try to catch up: as after a suspend, or at a speed that the
/// machine cannot reach.
const TOO_LATE: f64 = 0.25;
/// How often a paused run looks for what happened.
const NAP: Duration = Duration::from_millis(50);

impl<L: Coupling> Simulated<L> {
    /// Goes on with a run at this speed.
    pub fn new(recorded: Recorded<L>, speed: f64) -> Self {
        Simulated {
            speed,
            pace: Pace::Going,
            origin: (Instant::now(), recorded.time(), speed),
            pending: None,
            waiting: VecDeque::new(),
            quit: false,
            steps: 0,
            recorded,
        }
    }

    /// The run.
    pub fn recorded(&self) -> &Recorded<L> {
        &self.recorded
    }

    /// Time of the next control step, s.
    pub fn time(&self) -> f64 {
        self.recorded.time()
    }

    /// Simulated seconds a second; infinite is as fast as it goes.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Whether the simulated time goes on.
    pub fn pace(&self) -> Pace {
        self.pace
    }

    /// Lets the time go on.
    pub fn go(&mut self) {
        self.pace = Pace::Going;
    }

    /// Whether somebody has said quit.
    pub fn is_over(&self) -> bool {
        self.quit
    }

    /// Whether the robot looks for the middle of its axes.
    pub fn is_homing(&self) -> bool {
        matches!(self.pending, Some(Pending::Homing(_)))
    }

    /// Whether every line has been carried out to its end.
    pub fn is_idle(&self) -> bool {
        self.pending.is_none() && self.waiting.is_empty()
    }

    /// How long there is time for other things before the next step is due; never long, so that a line is carried out when it
    /// is typed.
    pub fn nap(&mut self) -> Duration {
        let ahead = self.ahead();
        if self.pace != Pace::Going || self.origin.2 != self.speed || ahead < -TOO_LATE {
            self.origin = (Instant::now(), self.time(), self.speed);
        }
        match self.pace {
            Pace::Going => Duration::try_from_secs_f64(ahead).unwrap_or_default().min(NAP),
            Pace::Paused => NAP,
            Pace::Steps(_) => Duration::ZERO,
        }
    }

    /// Whether a control step is due.
    pub fn is_due(&self) -> bool {
        match self.pace {
            Pace::Going => self.ahead() <= 0.0,
            Pace::Paused => false,
            Pace::Steps(_) => true,
        }
    }

    /// Takes a control step.
    ///
    /// # Errors
    /// Those of [`Recorded::step`].
    pub fn step(&mut self, audience: &mut dyn Audience) -> Result<Step, Failure> {
        let step = self.recorded.step()?;
        self.steps += 1;
        if let Some(state) = step.state {
            audience.say(&format!("{:.2} s: {}", step.record.brain.t, words::state(state)));
        }
        self.look(self.recorded.run.state(), audience);
        if let Pace::Steps(n) = self.pace {
            self.pace = if n > 1 { Pace::Steps(n - 1) } else { Pace::Paused };
        }
        Ok(step)
    }

    /// Takes a line: carries it out, or lets it wait until the robot has come to the end of what it was set to. What a person
    /// types to stop it does not wait. Returns whether it was carried out.
    ///
    /// # Errors
    /// A file of the run that cannot be written any more.
    pub fn offer(
        &mut self,
        line: Result<Command, ConsoleError>,
        is_person: bool,
        audience: &mut dyn Audience,
    ) -> Result<bool, Failure> {
        if is_next(&line, self.pending, self.waiting.is_empty(), is_person) {
            return self.line(line, audience).map(|()| true);
        }
        self.waiting.push_back(line);
        Ok(false)
    }

    /// Carries out a line that waits, if it needs to wait no longer. Returns whether there was one.
    ///
    /// # Errors
    /// A file of the run that cannot be written any more.
    pub fn carry_on(&mut self, audience: &mut dyn Audience) -> Result<bool, Failure> {
        if self.pending.is_some() {
            return Ok(false);
        }
        match self.waiting.pop_front() {
            Some(line) => self.line(line, audience).map(|()| true),
            None => Ok(false),
        }
    }

    /// Pulls at the barrel from now on, until another load is given.
    pub fn pull(&mut self, load: Load) {
        self.recorded.run.pull(load);
    }

    /// Writes that something happened.
    ///
    /// # Errors
    /// A log that cannot be written any more.
    pub fn event(&mut self, kind: &str, text: &str) -> Result<(), Failure> {
        let t = self.time();
        self.recorded.recorder.event(t, kind, text)
    }

    /// Ends the run as it `ended`.
    ///
    /// # Errors
    /// Those of [`Recorded::finish`].
    pub fn finish(self, ended: Result<(), Failure>) -> Result<Vec<std::path::PathBuf>, Failure> {
        self.recorded.finish(ended)
    }

    /// How long until the next step is due, s.
    fn ahead(&self) -> f64 {
        let (clock, time, _) = self.origin;
        (self.time() - time) / self.speed - clock.elapsed().as_secs_f64()
    }

    fn line(&mut self, line: Result<Command, ConsoleError>, audience: &mut dyn Audience) -> Result<(), Failure> {
        match line.and_then(|command| execute(&command, self).map(|said| (command, said))) {
            Ok((command, said)) => {
                audience.say(&said);
                if let Some(kind) = kind(&command) {
                    self.event(kind, &said)?;
                }
            }
            Err(error) => audience.complain(&error.to_string()),
        }
        self.recorded.recorder.frames(self.recorded.time(), self.recorded.run.link_mut())
    }

    /// Looks whether the robot has come to the end of what it was set to, and says so.
    fn look(&mut self, state: SafetyState, audience: &mut dyn Audience) {
        let Some(mut pending) = self.pending.take() else { return };
        let ended = match pending.state(state) {
            Some(homed) => Some(homed.map(|()| HOMED.to_owned())),
            None if self.steps.is_multiple_of(LOOK) => pending.look(self).transpose(),
            None => None,
        };
        match ended {
            Some(Ok(said) | Err(said)) => audience.say(&said),
            None => self.pending = Some(pending),
        }
    }

    fn random(&mut self, action: schedule::Action) -> Result<String, String> {
        self.recorded.run.act(action).map_err(|error| error.to_string())?;
        let entries: Result<Vec<String>, String> = action
            .random_entries()
            .iter()
            .map(|&id| self.get(id).map(|value| format!("{} = {value:.3}", id.name())))
            .collect();
        Ok(entries?.join(", "))
    }
}

/// The kind of event that a command is in the log, if it is one.
fn kind(command: &Command) -> Option<&'static str> {
    match command {
        Command::Set(..) | Command::Load(_) => Some("parameter"),
        Command::Act(Action::Scatter(_) | Action::RandomC(_) | Action::RandomH(_)) => Some("parameter"),
        Command::Act(Action::Push { .. } | Action::Shove { .. }) => Some("push"),
        _ => None,
    }
}

impl<L: Coupling> Robot for Simulated<L> {
    fn ask(&mut self, message: &HostMessage) -> Result<RobotMessage, String> {
        unless_refused(self.recorded.run.ask(message).map(|answer| answer.message))
    }

    fn vitals(&self) -> Option<&Vitals> {
        self.recorded.run.link().vitals()
    }
}

impl<L: Coupling> Target for Simulated<L> {
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
        let time = self.time();
        match action {
            Action::Push { torque, seconds } => {
                self.recorded.run.push(torque, 0.0, seconds);
                Ok(format!("pushing with {torque} N m for {seconds} s from {time:.2} s on"))
            }
            Action::Shove { force, seconds } => {
                self.recorded.run.push(0.0, force, seconds);
                Ok(format!("pushing with {force} N along the ground for {seconds} s from {time:.2} s on"))
            }
            Action::Scatter(by) => self.random(schedule::Action::Scatter(by)),
            Action::RandomC(within) => self.random(schedule::Action::RandomC(within)),
            Action::RandomH(within) => self.random(schedule::Action::RandomH(within)),
            Action::Pause => {
                self.pace = Pace::Paused;
                Ok(format!("paused at {time:.2} s"))
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
                Ok(if speed.is_finite() { format!("{speed} x real time") } else { "as fast as it goes".to_owned() })
            }
            _ => {
                self.quit = true;
                Ok(String::new())
            }
        }
    }
}
