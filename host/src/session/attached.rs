//! A robot on a line, with its own sensors and motors, which can be talked to.

use super::Audience;
use crate::console::robot::{self, HOMED, Pending, Robot, is_next, unless_refused};
use crate::console::{Action, Command, ConsoleError, Target, execute};
use crate::failure::Failure;
use crate::journal::{Journal, News};
use crate::words;
use hil_sim::link::{HELLO, Identity, Line, Link, Transport, recognise};
use hil_sim::run::{as_set, in_decimal};
use hil_sim::schedule::{self, Schedule};
use protocol::message::{Refusal, SafetyState, Vitals};
use protocol::{HostMessage, Id, RobotMessage};
use std::collections::VecDeque;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Time between two looks at a robot that calibrates.
const LOOK: Duration = Duration::from_millis(200);

/// A robot that can be talked to.
pub struct Attached<T> {
    line: Line<T>,
    journal: Journal,
    /// What the robot was set to and has not come to the end of.
    pending: Option<Pending>,
    /// Lines that wait for that.
    waiting: VecDeque<Result<Command, ConsoleError>>,
    /// When it was last looked at.
    looked: Instant,
    told_of_simulation: bool,
    quit: bool,
    /// Draws random controllers.
    random: Schedule,
}

impl<T: Transport> Attached<T> {
    /// Talks to the robot at the end of this line, and keeps what it says in this journal.
    pub fn new(line: Line<T>, journal: Journal) -> Self {
        // Nobody repeats what a robot on a floor has done: the clock's odd nanoseconds will do.
        let seed = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| u64::from(time.subsec_nanos()));
        Attached {
            line,
            journal,
            pending: None,
            waiting: VecDeque::new(),
            looked: Instant::now(),
            told_of_simulation: false,
            quit: false,
            random: Schedule::new(&[], seed),
        }
    }

    /// Goes on over another line: the robot was lost, and is found again as it says it is.
    pub fn reconnect(&mut self, line: Line<T>, identity: &Identity) {
        self.line = line;
        self.pending = None;
        self.journal.connected(&self.line, identity);
    }

    /// What the robot has said.
    pub fn journal(&self) -> &Journal {
        &self.journal
    }

    /// What the robot has said, to note what happens.
    pub fn journal_mut(&mut self) -> &mut Journal {
        &mut self.journal
    }

    /// The robot's safety state as last heard.
    pub fn state(&self) -> Option<SafetyState> {
        self.journal.telemetry().map(|telemetry| telemetry.state)
    }

    /// The line to the robot.
    pub fn line_mut(&mut self) -> &mut Line<T> {
        &mut self.line
    }

    /// Whether somebody has said quit.
    pub fn is_over(&self) -> bool {
        self.quit
    }

    /// Ends the session as if somebody had said quit.
    pub fn quit(&mut self) {
        self.quit = true;
    }

    /// Whether the robot looks for the middle of its axes.
    pub fn is_homing(&self) -> bool {
        matches!(self.pending, Some(Pending::Homing(_)))
    }

    /// Whether every line has been carried out to its end.
    pub fn is_idle(&self) -> bool {
        self.pending.is_none() && self.waiting.is_empty()
    }

    /// A run that was broken off may have left the robot with simulated sensors: it gets its own.
    ///
    /// # Errors
    /// A line that is gone.
    pub fn own_sensors(&mut self, audience: &mut dyn Audience) -> Result<(), Failure> {
        let answer = self.line.request(&HostMessage::SimulatedSensors(false)).map_err(Failure::broken)?;
        if answer.message == RobotMessage::Refused(Refusal::WhileArmed) {
            audience.say("it was Armed before");
        }
        Ok(())
    }

    /// Listens to the robot, for a moment at most, and carries out the lines that wait. Returns whether it has said anything.
    ///
    /// # Errors
    /// A line that is gone; a log that cannot be written any more.
    pub fn turn(&mut self, audience: &mut dyn Audience) -> Result<bool, Failure> {
        let heard = self.line.listen().map_err(Failure::broken)?;
        match &heard {
            Some(message) => self.heard(message, audience)?,
            None => self.journal.rest(&mut self.line)?,
        }
        if self.pending.is_some() && self.looked.elapsed() >= LOOK {
            self.looked = Instant::now();
            self.look(audience);
        }
        while self.pending.is_none() && !self.quit {
            let Some(line) = self.waiting.pop_front() else { break };
            self.line(line, audience)?;
        }
        Ok(heard.is_some())
    }

    /// Takes a line: carries it out, or lets it wait until the robot has come to the end of what it was set to. What a person
    /// types to stop it does not wait.
    ///
    /// # Errors
    /// A line that is gone; a log that cannot be written any more.
    pub fn offer(
        &mut self,
        line: Result<Command, ConsoleError>,
        is_person: bool,
        audience: &mut dyn Audience,
    ) -> Result<(), Failure> {
        if is_next(&line, self.pending, self.waiting.is_empty(), is_person) {
            return self.line(line, audience);
        }
        self.waiting.push_back(line);
        Ok(())
    }

    /// Writes down what is still to be read, and completes the log.
    ///
    /// # Errors
    /// A log that cannot be written any more.
    pub fn finish(mut self) -> Result<Option<std::path::PathBuf>, Failure> {
        self.journal.rest(&mut self.line)?;
        self.journal.finish()
    }

    fn heard(&mut self, message: &RobotMessage, audience: &mut dyn Audience) -> Result<(), Failure> {
        for news in self.journal.heard(message, &mut self.line)? {
            match news {
                News::State(state) => audience.say(&format!("{:.2} s: {}", self.journal.now(), words::state(state))),
                News::Restarted => {}
                News::Reset => self.was_reset(audience)?,
                News::Vitals => self.vitals_heard(audience),
            }
        }
        if let (RobotMessage::Telemetry(telemetry), Some(pending)) = (message, &mut self.pending) {
            match pending.state(telemetry.state) {
                Some(Ok(())) => self.pending = Some(Pending::Homed),
                Some(Err(why)) => {
                    self.pending = None;
                    audience.complain(&why);
                }
                None => {}
            }
        }
        audience.heard(self.journal.time(), message);
        Ok(())
    }

    fn was_reset(&mut self, audience: &mut dyn Audience) -> Result<(), Failure> {
        let who = self.line.request(&HELLO).and_then(|answer| recognise(&answer.message)).map_err(Failure::broken)?;
        let said = format!("the robot was reset: {}", words::reset(who.reset));
        audience.say(&said);
        self.pending = None;
        self.journal.event("reset", &said)
    }

    fn vitals_heard(&mut self, audience: &mut dyn Audience) {
        let Some(vitals) = self.journal.vitals() else { return };
        if self.pending == Some(Pending::Homed) {
            audience.say(if vitals.homed { HOMED } else { "not homed: it was broken off" });
            self.pending = None;
        }
        if vitals.simulated_sensors && !self.told_of_simulation {
            self.told_of_simulation = true;
            audience
                .say("its sensors are those of a simulation that goes on or was broken off; disarm gives it its own");
        }
    }

    /// Looks whether a calibration has come to its end, and says so.
    fn look(&mut self, audience: &mut dyn Audience) {
        let Some(pending) = self.pending else { return };
        if let Some(Ok(said) | Err(said)) = pending.look(self).transpose() {
            self.pending = None;
            audience.say(&said);
        }
    }

    fn line(&mut self, line: Result<Command, ConsoleError>, audience: &mut dyn Audience) -> Result<(), Failure> {
        let before = self.pending;
        let done = line.and_then(|command| execute(&command, self).map(|said| (command, said)));
        // What was heard before the answer is no news of what has only now begun.
        let begun = self.pending.filter(|_| before.is_none());
        self.pending = self.pending.and(before);
        while let Some(message) = self.line.overheard() {
            self.heard(&message, audience)?;
        }
        self.pending = self.pending.or(begun);
        match done {
            Ok((command, said)) => {
                audience.say(&said);
                match command {
                    Command::Set(..)
                    | Command::Load(_)
                    | Command::Act(Action::Scatter(_) | Action::RandomC(_) | Action::RandomH(_)) => {
                        self.journal.event("parameter", &said)?;
                    }
                    Command::Act(action) if action != Action::Quit && action != Action::Status => {
                        self.journal.event("command", &said)?;
                    }
                    _ => {}
                }
            }
            Err(error) => audience.complain(&error.to_string()),
        }
        self.journal.rest(&mut self.line)
    }

    fn parameter(&mut self, id: Id, message: &HostMessage) -> Result<f32, String> {
        if !id.parameter().scope.is_robot() {
            return Err(format!("{} is the simulator's, not the robot's", id.name()));
        }
        match self.ask(message)? {
            RobotMessage::Parameter { value, .. } => Ok(value),
            _ => Err("the robot says something else".to_owned()),
        }
    }

    fn draw(&mut self, action: schedule::Action) -> Result<String, String> {
        let mut drawn = Vec::new();
        for &id in action.random_entries() {
            let now = self.get(id)?;
            let value = action.drawn(id, now, &mut self.random);
            let value = self.set(id, value)?;
            drawn.push(format!("{} = {value:.3}", id.name()));
        }
        Ok(drawn.join(", "))
    }
}

impl<T: Transport> Robot for Attached<T> {
    fn ask(&mut self, message: &HostMessage) -> Result<RobotMessage, String> {
        unless_refused(self.line.request(message).map(|answer| answer.message))
    }

    fn vitals(&self) -> Option<&Vitals> {
        self.journal.vitals()
    }
}

impl<T: Transport> Target for Attached<T> {
    fn get(&mut self, id: Id) -> Result<f64, String> {
        self.parameter(id, &HostMessage::GetParameter { index: id.index() }).map(in_decimal)
    }

    fn set(&mut self, id: Id, value: f64) -> Result<f64, String> {
        let held = self.parameter(id, &HostMessage::SetParameter { index: id.index(), value: value as f32 })?;
        Ok(as_set(held, value))
    }

    fn act(&mut self, action: Action) -> Result<String, String> {
        let mut pending = self.pending.take();
        let done = robot::act(action, self, &mut pending);
        self.pending = pending;
        match (action, done) {
            (Action::Disarm, Some(done)) => {
                let said = done?;
                // With the sensors of a simulation it would sense nothing.
                self.ask(&HostMessage::SimulatedSensors(false))?;
                Ok(said)
            }
            (_, Some(done)) => done,
            (Action::Scatter(by), None) => self.draw(schedule::Action::Scatter(by)),
            (Action::RandomC(within), None) => self.draw(schedule::Action::RandomC(within)),
            (Action::RandomH(within), None) => self.draw(schedule::Action::RandomH(within)),
            (Action::Quit, None) => {
                self.quit = true;
                Ok(String::new())
            }
            (_, None) => {
                Err("this is a robot, not a simulation: nobody stops its time, and who wants to push it has hands; \
                              --simulate puts it into the simulated barrel"
                    .to_owned())
            }
        }
    }
}
