//! What a line says. No effects here.

use std::path::PathBuf;

use hil_sim::setup::SetError;
use protocol::Id;
use protocol::message::{BodyAxis, CalibrationStep};
use protocol::parameter::TABLE;

use super::ConsoleError;
use crate::suggest::did_you_mean;

/// A line that was understood.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// A blank line or a comment.
    Nothing,
    /// Shows a parameter.
    Show(Id),
    /// Sets a parameter to a value that it takes.
    Set(Id, f64),
    /// Explains.
    Help(Topic),
    /// Shows all parameters whose names begin like this.
    List(String),
    /// Writes all parameters to a file.
    Store(PathBuf),
    /// Sets all parameters of a file.
    Load(PathBuf),
    /// Something for the run or the robot.
    Act(Action),
}

/// What can be explained.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Topic {
    /// The console.
    All,
    /// A parameter.
    Parameter(Id),
    /// A command.
    Command(&'static CommandHelp),
}

/// What a run or a robot can be told to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    /// A torque about the cylinder axis, N·m, for so many seconds.
    Push {
        /// N·m.
        torque: f64,
        /// s.
        seconds: f64,
    },
    /// A force along the ground across the cylinder axis, N, for so many seconds.
    Shove {
        /// N.
        force: f64,
        /// s.
        seconds: f64,
    },
    /// Moves every entry of C by a random amount, uniform in ± this.
    Scatter(f64),
    /// Draws every entry of C anew, uniform in ± this.
    RandomC(f64),
    /// Draws both entries of h anew, uniform in ± this.
    RandomH(f64),
    /// Lets the brain move the weights.
    Arm,
    /// Holds the outputs at zero.
    Disarm,
    /// Emergency stop.
    Stop,
    /// Leaves Fault.
    Clear,
    /// Finds the middle of both axes.
    Home,
    /// Calibrates the inertial sensor, step by step.
    Calibrate(CalibrationStep),
    /// Keeps parameters and calibration in the robot.
    Save,
    /// Empties the robot's memory.
    Forget,
    /// Who the robot is, and how it is.
    Status,
    /// Stops the simulated time.
    Pause,
    /// Lets the simulated time go on.
    Go,
    /// So many control steps, then pause.
    Step(u32),
    /// Simulated seconds per second; infinite is as many as it can.
    Speed(f64),
    /// Ends the run.
    Quit,
}

/// What C and h are drawn from if nothing else is said.
const RANDOM_C: f64 = 5.0;
const RANDOM_H: f64 = 3.0;

/// One row of [`COMMANDS`].
#[derive(Debug, PartialEq, Eq)]
pub struct CommandHelp {
    /// The first word.
    pub name: &'static str,
    /// How it is written.
    pub usage: &'static str,
    /// What it does.
    pub help: &'static str,
}

const fn row(name: &'static str, usage: &'static str, help: &'static str) -> CommandHelp {
    CommandHelp { name, usage, help }
}

/// Every command.
pub const COMMANDS: &[CommandHelp] = &[
    row("help", "help [NAME]", "explains the console, a parameter or a command; also ?"),
    row("list", "list [PREFIX]", "shows the parameters, or those that begin with PREFIX, with their values"),
    row("store", "store FILE", "writes all parameters to a file on this computer that people can read"),
    row("load", "load FILE", "sets the parameters in a file; all of them, or none if one line is wrong"),
    row("save", "save", "keeps parameters and calibration in the robot itself, for its next starts"),
    row("forget", "forget", "empties the robot's own memory: its next start has the defaults"),
    row("status", "status", "who the robot is, and how it is"),
    row("push", "push TORQUE SECONDS", "pushes the barrel: N m about its axis, for so many seconds"),
    row("shove", "shove FORCE SECONDS", "pushes the barrel along the ground: N across its axis, for so many seconds"),
    row("scatter", "scatter BY", "moves every entry of C by a random amount of up to BY"),
    row("random", "random C | h [WITHIN]", "draws C, or h, anew, within ±5 for C and ±3 for h if nothing else is said"),
    row("arm", "arm", "lets the brain move the weights"),
    row("disarm", "disarm", "holds the outputs at zero"),
    row("stop", "stop", "emergency stop: zero outputs until cleared"),
    row("clear", "clear", "leaves Fault; arm again to go on"),
    row("home", "home", "finds the middle of both axes: drives each weight gently from stop to stop"),
    row(
        "calibrate",
        "calibrate still | up AXIS | status | restart",
        "calibrates the inertial sensor at rest; AXIS, which points up, is one of +1 -1 +c -c +2 -2 in turn",
    ),
    row("pause", "pause", "stops the simulated time"),
    row("go", "go", "lets the simulated time go on"),
    row("step", "step [N]", "one control step of 20 ms, or N, then pause"),
    row("speed", "speed X | max", "X simulated seconds per second, or as many as it can"),
    row("quit", "quit", "ends the run; its files are completed"),
];

/// The body's axes, both ways, as they are written; in the order of their bits in the calibration's progress.
pub const AXES: [(&str, BodyAxis); 6] = [
    ("+1", BodyAxis::Slider1),
    ("-1", BodyAxis::Slider1Negative),
    ("+c", BodyAxis::Cylinder),
    ("-c", BodyAxis::CylinderNegative),
    ("+2", BodyAxis::Slider2),
    ("-2", BodyAxis::Slider2Negative),
];

/// Understands a line.
///
/// # Errors
/// What is wrong with it, and how to write it right.
pub fn parse(line: &str) -> Result<Command, ConsoleError> {
    let line = line.split('#').next().unwrap_or_default().trim();
    if line.is_empty() {
        return Ok(Command::Nothing);
    }
    let (word, rest) = line.split_once(char::is_whitespace).map_or((line, ""), |(word, rest)| (word, rest.trim()));
    if line.contains('=') && command(word).is_none() {
        return parse_assignment(line).map(|(id, value)| Command::Set(id, value));
    }
    if let Some(id) = Id::from_name(word) {
        return if rest.is_empty() {
            Ok(Command::Show(id))
        } else {
            // "epsA 0.2": nearly right.
            Err(ConsoleError::Usage { reason: format!("to set {word}, put = before the value"), usage: "NAME = VALUE" })
        };
    }
    let help = command(word).ok_or_else(|| unknown("command or parameter", word, words()))?;
    let words: Vec<&str> = rest.split_whitespace().collect();
    let usage = |reason: &str| ConsoleError::Usage { reason: format!("{word}: {reason}"), usage: help.usage };
    let plain =
        |action| if words.is_empty() { Ok(Command::Act(action)) } else { Err(usage("nothing comes behind it")) };
    match help.name {
        "help" => parse_topic(rest).map(Command::Help),
        "list" => parse_prefix(rest).map(Command::List),
        // A path may hold spaces, and quotes may stand around it.
        "store" | "load" => match rest.trim_matches(['"', '\'']) {
            "" => Err(usage("a file is missing")),
            path if help.name == "store" => Ok(Command::Store(path.into())),
            path => Ok(Command::Load(path.into())),
        },
        "push" | "shove" => match words[..] {
            [strength, seconds] => {
                let example = if word == "push" { "push 5 0.5" } else { "shove 30 0.1" };
                let (strength, seconds) = (number(strength, example)?, number(seconds, example)?);
                if seconds <= 0.0 {
                    return Err(usage("it must last longer than 0 s"));
                }
                Ok(Command::Act(match help.name {
                    "push" => Action::Push { torque: strength, seconds },
                    _ => Action::Shove { force: strength, seconds },
                }))
            }
            _ if help.name == "push" => Err(usage("a torque in N m and a time in s are needed")),
            _ => Err(usage("a force in N and a time in s are needed")),
        },
        "scatter" => match words[..] {
            [by] => random_range(by, "scatter 0.2").map(|by| Command::Act(Action::Scatter(by))),
            _ => Err(usage("one number is needed")),
        },
        "random" => {
            let within = |default: f64| match words[1..] {
                [] => Ok(default),
                [within] => random_range(within, "random C 5"),
                _ => Err(usage("one number at most")),
            };
            match words.first() {
                Some(&("C" | "c")) => within(RANDOM_C).map(|within| Command::Act(Action::RandomC(within))),
                Some(&("h" | "H")) => within(RANDOM_H).map(|within| Command::Act(Action::RandomH(within))),
                _ => Err(usage("C or h?")),
            }
        }
        "step" => match words[..] {
            [] => Ok(Command::Act(Action::Step(1))),
            [count] => match count.parse() {
                Ok(0) | Err(_) => Err(usage("N is a whole number from 1")),
                Ok(count) => Ok(Command::Act(Action::Step(count))),
            },
            _ => Err(usage("one number at most")),
        },
        "speed" => match words[..] {
            ["max"] => Ok(Command::Act(Action::Speed(f64::INFINITY))),
            [speed] => match number(speed, "speed 2")? {
                speed if speed > 0.0 => Ok(Command::Act(Action::Speed(speed))),
                _ => Err(usage("it must be more than 0; pause stops the time")),
            },
            _ => Err(usage("a number is needed")),
        },
        "calibrate" => match words[..] {
            ["still"] => Ok(Command::Act(Action::Calibrate(CalibrationStep::Still))),
            ["status"] => Ok(Command::Act(Action::Calibrate(CalibrationStep::Status))),
            ["restart"] => Ok(Command::Act(Action::Calibrate(CalibrationStep::Restart))),
            ["up", axis] => match AXES.iter().find(|(name, _)| name.eq_ignore_ascii_case(axis)) {
                Some((_, axis)) => Ok(Command::Act(Action::Calibrate(CalibrationStep::Up(*axis)))),
                None => {
                    Err(usage("AXIS is +1 or -1 (the first slider), +c or -c (the cylinder), +2 or -2 (the second)"))
                }
            },
            ["up"] => Err(usage("which axis points up?")),
            _ => Err(usage("one of four things can be done")),
        },
        "home" => plain(Action::Home),
        "save" => plain(Action::Save),
        "forget" => plain(Action::Forget),
        "status" => plain(Action::Status),
        "arm" => plain(Action::Arm),
        "disarm" => plain(Action::Disarm),
        "stop" => plain(Action::Stop),
        "clear" => plain(Action::Clear),
        "pause" => plain(Action::Pause),
        "go" => plain(Action::Go),
        _ => plain(Action::Quit),
    }
}

/// Understands `NAME=VALUE`, spaces allowed, and checks the value.
///
/// # Errors
/// An unknown name (with the nearest one), a missing value, no number, a value that the parameter does not take.
pub fn parse_assignment(text: &str) -> Result<(Id, f64), ConsoleError> {
    let (name, value) = text.split_once('=').unwrap_or((text, ""));
    let (name, value) = (name.trim(), value.trim());
    let id = Id::from_name(name).ok_or_else(|| unknown("parameter", name, TABLE.iter().map(|p| p.name)))?;
    let parameter = id.parameter();
    if value.is_empty() {
        return Err(ConsoleError::MissingValue { name: parameter.name, example: parameter.default });
    }
    let not_a_number = |_| ConsoleError::NotANumber {
        text: value.into(),
        example: format!("{} = {}", parameter.name, parameter.default),
    };
    let value: f64 = value.parse().map_err(not_a_number)?;
    parameter.check(value).map_err(|reason| SetError { id, value, reason })?;
    Ok((id, value))
}

/// The command of this name; `?` is help, `exit` is quit.
fn command(word: &str) -> Option<&'static CommandHelp> {
    let word = match word {
        "?" => "help",
        "exit" => "quit",
        word => word,
    };
    COMMANDS.iter().find(|command| command.name == word)
}

/// Every word that can begin a line.
pub(super) fn words() -> impl Iterator<Item = &'static str> {
    COMMANDS.iter().map(|command| command.name).chain(TABLE.iter().map(|parameter| parameter.name))
}

fn unknown(what: &'static str, word: &str, candidates: impl Iterator<Item = &'static str>) -> ConsoleError {
    ConsoleError::Unknown { what, word: word.into(), suggestion: did_you_mean(word, candidates) }
}

fn parse_topic(word: &str) -> Result<Topic, ConsoleError> {
    if word.is_empty() {
        Ok(Topic::All)
    } else if let Some(id) = Id::from_name(word) {
        Ok(Topic::Parameter(id))
    } else {
        command(word).map(Topic::Command).ok_or_else(|| unknown("command or parameter", word, words()))
    }
}

fn parse_prefix(prefix: &str) -> Result<String, ConsoleError> {
    let names = || TABLE.iter().map(|parameter| parameter.name);
    if names().any(|name| begins_like(name, prefix)) {
        Ok(prefix.into())
    } else {
        Err(unknown("parameter", prefix, names()))
    }
}

/// Whether a name begins with a prefix, whatever the case.
pub(super) fn begins_like(name: &str, prefix: &str) -> bool {
    name.to_lowercase().starts_with(&prefix.to_lowercase())
}

/// The range of random numbers: from 0 to 100.
fn random_range(text: &str, example: &str) -> Result<f64, ConsoleError> {
    number(text, example).and_then(|range| match range {
        0.0..=100.0 => Ok(range),
        _ => Err(ConsoleError::Usage { reason: format!("{range} is not from 0 to 100"), usage: "a number, as in 0.5" }),
    })
}

fn number(text: &str, example: &str) -> Result<f64, ConsoleError> {
    match text.parse() {
        Ok(number) if f64::is_finite(number) => Ok(number),
        _ => Err(ConsoleError::NotANumber { text: text.into(), example: example.into() }),
    }
}
