//! `barrel console --link serial:PORT`: a robot as it stands there, with its own sensors and motors.

use crate::cli::{Address, ConsoleArgs};
use crate::commands::console::history;
use crate::commands::run::About;
use crate::console::robot::{self, HOMED, Pending, Robot, is_next, unless_refused};
use crate::console::{Action, Command, Console, ConsoleError, Input, Target, execute};
use crate::failure::Failure;
use crate::journal::{Journal, News, parameters};
use crate::reach::reach;
use crate::recorder::Places;
use crate::words;
use hil_sim::link::{HELLO, Line, Link, Serial, recognise};
use hil_sim::run::{as_set, in_decimal};
use protocol::message::{Refusal, SafetyState, Vitals};
use protocol::{HostMessage, Id, RobotMessage};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Time between two looks at a robot that calibrates.
const LOOK: Duration = Duration::from_millis(200);

/// Carries out every line that is typed, and shows what the robot does by itself, until `quit`.
///
/// # Errors
/// A robot that cannot be reached, or whose line goes away; options that only a simulated run has.
pub fn robot_console(args: &ConsoleArgs, address: &Address) -> Result<(), Failure> {
    let of_a_run =
        !args.setup.sets.is_empty() || !args.setup.pushes.is_empty() || args.csv.is_some() || args.speed != 1.0;
    if of_a_run {
        return Err(Failure::bad(
            "--set, --push, --csv and --speed are for a simulated run: set parameters in the console, or add --simulate",
        ));
    }
    // What is wrong with its place is said before the robot hears of it.
    Places::new(None, args.log.clone(), None).check()?;
    let (mut line, identity) = reach(address)?;
    About::checked(&identity, args.setup.precision)?;
    let mut journal = Journal::new();
    journal.connected(&line, &identity);
    if let Some(log) = &args.log {
        let (link, command) = (args.setup.link.to_string(), format!("barrel console --link {}", args.setup.link));
        let values = parameters(&mut line).map_err(Failure::broken)?;
        journal.begin_log(Some(log), &command, &link, &identity, &values)?;
    }
    let mut console = Console::start(history().as_deref());
    console.print(&format!("the robot on {address}; help explains, quit ends"));
    console.print(&words::identity(&identity).join("\n"));
    let mut session =
        Session { line, journal, pending: None, waiting: VecDeque::new(), told_of_simulation: false, quit: false };
    let ended = session.own_sensors(&mut console).and_then(|()| {
        let duration = args.duration.unwrap_or(f64::INFINITY);
        session.go_on(&mut console, duration)
    });
    // The last that was heard belongs into the log, however it ended.
    let ended = session.journal.rest(&mut session.line).and(ended);
    if ended.is_ok() && session.journal.telemetry().is_some_and(|last| last.state == SafetyState::Armed) {
        console.print("the robot stays Armed");
    }
    if let Some(log) = session.journal.finish()? {
        console.print(&format!("written: {}", log.display()));
    }
    ended
}

/// A robot that can be talked to.
struct Session {
    line: Line<Serial>,
    journal: Journal,
    /// What the robot was set to and has not come to the end of.
    pending: Option<Pending>,
    /// Lines that wait for that.
    waiting: VecDeque<Result<Command, ConsoleError>>,
    told_of_simulation: bool,
    quit: bool,
}

impl Session {
    /// A run that was broken off may have left the robot with simulated sensors.
    fn own_sensors(&mut self, console: &mut Console) -> Result<(), Failure> {
        let answer = self.line.request(&HostMessage::SimulatedSensors(false)).map_err(Failure::broken)?;
        if answer.message == RobotMessage::Refused(Refusal::WhileArmed) {
            console.print("it was Armed before");
        }
        Ok(())
    }

    /// Listens to the robot and to the person, until the end or `quit`.
    fn go_on(&mut self, console: &mut Console, duration: f64) -> Result<(), Failure> {
        let start = Instant::now();
        let mut looked = start;
        let mut listening = true;
        while !self.quit && start.elapsed().as_secs_f64() < duration {
            // Waits for the robot, for a moment at most: this is the pace of the loop.
            match self.line.listen().map_err(Failure::broken)? {
                Some(message) => self.heard(&message, console)?,
                None => self.journal.rest(&mut self.line)?,
            }
            if self.pending.is_some() && looked.elapsed() >= LOOK {
                looked = Instant::now();
                self.look(console);
            }
            while let Some(input) = console.poll() {
                match input {
                    Input::Line(line) if is_next(&line, self.pending, self.waiting.is_empty(), console.is_person()) => {
                        self.line(line, console)?
                    }
                    Input::Line(line) => self.waiting.push_back(line),
                    Input::End => listening = false,
                }
            }
            while self.pending.is_none() && !self.quit {
                let Some(line) = self.waiting.pop_front() else { break };
                self.line(line, console)?;
            }
            // A script ends when everything in it has been done.
            self.quit |= !listening && self.pending.is_none() && self.waiting.is_empty() && !duration.is_finite();
        }
        Ok(())
    }

    fn heard(&mut self, message: &RobotMessage, console: &mut Console) -> Result<(), Failure> {
        for news in self.journal.heard(message, &mut self.line)? {
            match news {
                News::State(state) => console.print(&format!("{:.2} s: {}", self.journal.now(), words::state(state))),
                News::Restarted => {}
                News::Reset => self.was_reset(console)?,
                News::Vitals => self.vitals(console),
            }
        }
        if let (RobotMessage::Telemetry(telemetry), Some(pending)) = (message, &mut self.pending) {
            match pending.state(telemetry.state) {
                Some(Ok(())) => self.pending = Some(Pending::Homed),
                Some(Err(why)) => {
                    self.pending = None;
                    console.print(&why);
                }
                None => {}
            }
        }
        Ok(())
    }

    fn was_reset(&mut self, console: &mut Console) -> Result<(), Failure> {
        let who = self.line.request(&HELLO).and_then(|answer| recognise(&answer.message)).map_err(Failure::broken)?;
        let said = format!("the robot was reset: {}", words::reset(who.reset));
        console.print(&said);
        self.pending = None;
        self.journal.event("reset", &said)
    }

    fn vitals(&mut self, console: &mut Console) {
        let Some(vitals) = self.journal.vitals() else { return };
        if self.pending == Some(Pending::Homed) {
            console.print(if vitals.homed { HOMED } else { "not homed: it was broken off" });
            self.pending = None;
        }
        if vitals.simulated_sensors && !self.told_of_simulation {
            self.told_of_simulation = true;
            console
                .print("its sensors are those of a simulation that goes on or was broken off; disarm gives it its own");
        }
    }

    /// Looks whether a calibration has come to its end, and says so.
    fn look(&mut self, console: &mut Console) {
        let Some(pending) = self.pending else { return };
        if let Some(Ok(said) | Err(said)) = pending.look(self).transpose() {
            self.pending = None;
            console.print(&said);
        }
    }

    fn line(&mut self, line: Result<Command, ConsoleError>, console: &mut Console) -> Result<(), Failure> {
        let before = self.pending;
        let done = line.and_then(|command| execute(&command, self).map(|said| (command, said)));
        // What was heard before the answer is no news of what has only now begun.
        let begun = self.pending.filter(|_| before.is_none());
        self.pending = self.pending.and(before);
        while let Some(message) = self.line.overheard() {
            self.heard(&message, console)?;
        }
        self.pending = self.pending.or(begun);
        match done {
            Ok((command, said)) => {
                console.print(&said);
                match command {
                    Command::Set(..) | Command::Load(_) => self.journal.event("parameter", &said)?,
                    Command::Act(action) if action != Action::Quit && action != Action::Status => {
                        self.journal.event("command", &said)?;
                    }
                    _ => {}
                }
            }
            Err(error) => console.print(&error.to_string()),
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
}

impl Robot for Session {
    fn ask(&mut self, message: &HostMessage) -> Result<RobotMessage, String> {
        unless_refused(self.line.request(message).map(|answer| answer.message))
    }

    fn vitals(&self) -> Option<&Vitals> {
        self.journal.vitals()
    }
}

impl Target for Session {
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
