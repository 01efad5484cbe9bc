//! The commands that are the robot's own business, the same in a run and on a bench.

use super::{Action, Command, ConsoleError};
use crate::words;
use hil_sim::link::{HELLO, LinkError, recognise};
use protocol::message::{CalibrationPhase, CalibrationStep, SafetyState, Vitals};
use protocol::{HostMessage, RobotMessage};

/// A robot that can be asked. Errors are sentences for people.
pub trait Robot {
    /// Asks, and returns the answer; a refusal is an error.
    fn ask(&mut self, message: &HostMessage) -> Result<RobotMessage, String>;

    /// What it last said of itself.
    fn vitals(&self) -> Option<&Vitals>;
}

/// What a robot was set to and has not come to the end of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pending {
    /// It looks for the middle of its axes; whether it has been seen to do so.
    Homing(bool),
    /// It has ended that, and is to say whether the middle is known.
    Homed,
    /// It averages for this step of the calibration.
    Calibrating(CalibrationStep),
}

impl Pending {
    /// Takes the robot's state as it is heard. Returns how homing has ended, once it has.
    pub fn state(&mut self, state: SafetyState) -> Option<Result<(), String>> {
        match (&mut *self, state) {
            // What is heard first may have been said before the robot began.
            (Pending::Homing(begun), SafetyState::Armed) => {
                *begun = true;
                None
            }
            (Pending::Homing(true), SafetyState::Disarmed) => Some(Ok(())),
            (Pending::Homing(_), SafetyState::Fault(code)) => Some(Err(format!("not homed: {code}"))),
            _ => None,
        }
    }

    /// Asks how far it is. Returns what there is to say once a calibration's step has ended.
    ///
    /// # Errors
    /// The robot's.
    pub fn look(&self, robot: &mut impl Robot) -> Result<Option<String>, String> {
        let Pending::Calibrating(step) = *self else { return Ok(None) };
        match robot.ask(&HostMessage::Calibrate(CalibrationStep::Status))? {
            RobotMessage::Calibration(progress) if progress.phase == CalibrationPhase::Averaging => Ok(None),
            RobotMessage::Calibration(progress) => Ok(Some(words::calibration(progress, step))),
            other => Err(unexpected(&other)),
        }
    }
}

/// Whether a line is carried out now: it is the first, with nothing of the robot's `pending`, or it cuts in.
pub fn is_next(
    line: &Result<Command, ConsoleError>,
    pending: Option<Pending>,
    is_first: bool,
    is_person: bool,
) -> bool {
    (is_first && pending.is_none()) || cuts_in(line, is_person, is_first)
}

/// Whether a line is carried out at once, even if the robot has not come to the end of what it was set to. What a person types
/// must not wait behind other lines; a script is carried out in its order, to the end.
fn cuts_in(line: &Result<Command, ConsoleError>, is_person: bool, is_first: bool) -> bool {
    match line {
        Ok(Command::Act(Action::Quit)) => is_person,
        Ok(Command::Act(action)) => {
            let at_once = matches!(
                action,
                Action::Disarm
                    | Action::Stop
                    | Action::Status
                    | Action::Pause
                    | Action::Go
                    | Action::Step(_)
                    | Action::Speed(_)
            );
            at_once && (is_person || is_first)
        }
        Err(_) | Ok(Command::Nothing | Command::Help(_)) => is_person || is_first,
        Ok(_) => false,
    }
}

/// Takes an answer apart: a refusal is an error.
///
/// # Errors
/// The refusal, or no answer.
pub fn unless_refused(answer: Result<RobotMessage, LinkError>) -> Result<RobotMessage, String> {
    match answer {
        Ok(RobotMessage::Refused(refusal)) => Err(LinkError::Refused(refusal).to_string()),
        Ok(message) => Ok(message),
        Err(error) => Err(error.to_string()),
    }
}

/// Has the robot carry out an action, and says what it said; `None` if the action is not a robot's. What takes longer is
/// left in `pending`.
///
/// # Errors
/// The robot's refusal, or no answer.
pub fn act(action: Action, robot: &mut impl Robot, pending: &mut Option<Pending>) -> Option<Result<String, String>> {
    let message = match action {
        Action::Arm => HostMessage::Arm,
        Action::Disarm => HostMessage::Disarm,
        Action::Stop => HostMessage::EmergencyStop,
        Action::Clear => HostMessage::ClearFault,
        Action::Home => HostMessage::Home,
        Action::Calibrate(step) => HostMessage::Calibrate(step),
        Action::Save => HostMessage::Store,
        Action::Forget => HostMessage::Forget,
        Action::Status => HELLO,
        Action::Push { .. }
        | Action::Shove { .. }
        | Action::Scatter(_)
        | Action::RandomC(_)
        | Action::RandomH(_)
        | Action::Pause
        | Action::Go
        | Action::Step(_)
        | Action::Speed(_)
        | Action::Quit => return None,
    };
    let mut answer = robot.ask(&message).and_then(|answer| said(action, &answer, pending));
    if let (Action::Status, Ok(said), Some(vitals)) = (action, &mut answer, robot.vitals()) {
        said.push('\n');
        said.push_str(&words::vitals(vitals).join("\n"));
    }
    Some(answer)
}

/// What there is to say when the middle of both axes has been found.
pub const HOMED: &str = "homed: the middle of both axes is known, and the weights rest there";

fn said(action: Action, answer: &RobotMessage, pending: &mut Option<Pending>) -> Result<String, String> {
    match (action, answer) {
        (Action::Home, RobotMessage::State(SafetyState::Armed)) => {
            *pending = Some(Pending::Homing(false));
            Ok("homing: the weights go from stop to stop; stop or disarm breaks it off".to_owned())
        }
        (Action::Disarm | Action::Stop, RobotMessage::State(state)) => {
            *pending = None;
            Ok(words::state(*state))
        }
        (_, RobotMessage::State(state)) => Ok(words::state(*state)),
        (Action::Calibrate(step), RobotMessage::Calibration(progress)) => {
            if progress.phase == CalibrationPhase::Averaging && step != CalibrationStep::Status {
                *pending = Some(Pending::Calibrating(step));
            }
            Ok(words::calibration(*progress, step))
        }
        (Action::Save, RobotMessage::Stored) => {
            Ok("parameters and calibration are in the robot's memory: it will start with them".to_owned())
        }
        (Action::Forget, RobotMessage::Stored) => {
            Ok("the robot's memory is empty: it will start with the defaults".to_owned())
        }
        (Action::Status, hello @ RobotMessage::Hello { .. }) => {
            recognise(hello).map(|identity| words::identity(&identity).join("\n")).map_err(|error| error.to_string())
        }
        (_, other) => Err(unexpected(other)),
    }
}

fn unexpected(message: &RobotMessage) -> String {
    format!("the robot says something else: {message:?}")
}
