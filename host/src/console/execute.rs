//! Carries out what a line says.

use std::fmt::Write as _;

use protocol::Id;
use protocol::parameter::{Kind, TABLE};

use super::command::begins_like;
use super::{Action, COMMANDS, Command, ConsoleError, Topic, parameter_set};
use crate::csv::shortest;

/// What the console acts on: a run, or a robot at the other end of a wire. Errors are sentences for people.
pub trait Target {
    /// The value of a parameter as it is held.
    fn get(&mut self, id: Id) -> Result<f64, String>;
    /// Sets a parameter to a value that was checked, and returns the value that is held now: a robot may round it.
    fn set(&mut self, id: Id, value: f64) -> Result<f64, String>;
    /// Does something, and says what was done.
    fn act(&mut self, action: Action) -> Result<String, String>;
}

/// Carries out a command and returns what there is to say, without a line end; it may be empty or several lines.
///
/// # Errors
/// What the target said, or a file's problem. A parameter set is applied as a whole or not at all.
pub fn execute(command: &Command, target: &mut dyn Target) -> Result<String, ConsoleError> {
    match command {
        Command::Nothing => Ok(String::new()),
        Command::Show(id) => Ok(show(*id, target.get(*id).map_err(ConsoleError::Target)?)),
        Command::Set(id, value) => {
            let held = target.set(*id, *value).map_err(ConsoleError::Target)?;
            let rounded = if held == *value { "" } else { "  (rounded)" };
            Ok(show(*id, held) + rounded)
        }
        Command::Help(topic) => Ok(help(*topic)),
        Command::List(prefix) => Ok(list(prefix, target)),
        Command::Store(path) => {
            let count = parameter_set::store(path, target)?;
            Ok(format!("{count} parameters stored in {}", path.display()))
        }
        Command::Load(path) => {
            let count = parameter_set::load(path, target)?;
            Ok(format!("{count} parameters loaded from {}", path.display()))
        }
        Command::Act(action) => target.act(*action).map_err(ConsoleError::Target),
    }
}

fn show(id: Id, value: f64) -> String {
    let unit = id.parameter().unit;
    let space = if unit.is_empty() { "" } else { " " };
    format!("{} = {}{space}{unit}", id.name(), shortest(value))
}

fn list(prefix: &str, target: &mut dyn Target) -> String {
    let mut text = String::new();
    for &id in Id::ALL.iter().filter(|id| begins_like(id.name(), prefix)) {
        let parameter = id.parameter();
        let value = target.get(id).map_or("-".into(), shortest);
        let _ = writeln!(text, "{:<24} {value:>22} {:<7} {}", parameter.name, parameter.unit, parameter.help);
    }
    text.truncate(text.trim_end().len());
    text
}

fn help(topic: Topic) -> String {
    match topic {
        Topic::All => {
            let mut text = String::from("NAME = VALUE           sets a parameter\nNAME                   shows it\n");
            for command in COMMANDS {
                let _ = writeln!(text, "{:<22} {}", command.usage, command.help);
            }
            let _ = write!(
                text,
                "{} parameters; Tab completes names, arrows bring back lines, # begins a comment",
                TABLE.len()
            );
            text
        }
        Topic::Parameter(id) => {
            let p = id.parameter();
            let kind = if p.kind == Kind::Whole { "whole, " } else { "" };
            let unit = if p.unit.is_empty() { String::new() } else { format!(" {}", p.unit) };
            format!("{}: {}\n{kind}{} to {}{unit}, default {}", p.name, p.help, p.min, p.max, shortest(p.default))
        }
        Topic::Command(command) => format!("{}: {}", command.usage, command.help),
    }
}
