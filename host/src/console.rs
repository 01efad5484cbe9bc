//! The console: parameters are shown and set, and the robot is commanded, while the run goes on.
//!
//! ```text
//! line     = name "=" value | name | command | "#" comment
//! command  = see `help`, one row of COMMANDS each
//! ```
//!
//! A line becomes a [`Command`] ([`parse`], pure), which [`execute`] carries out on a [`Target`], the run. [`Console`]
//! reads the lines in a thread of its own, from a terminal (with completion, history and hints) or from a pipe.
//! Parameter sets are files of such lines ([`parameter_set`]).

mod command;
mod complete;
mod execute;
mod input;
pub mod parameter_set;
pub mod robot;

use std::path::PathBuf;

use hil_sim::setup::SetError;
use thiserror::Error;

pub use command::{AXES, Action, COMMANDS, Command, CommandHelp, Topic, parse, parse_assignment};
pub use complete::{complete, hint};
pub use execute::{Target, execute};
pub use input::{Console, Input};

/// Why a line was not carried out.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ConsoleError {
    /// The first word is neither a parameter nor a command.
    #[error("unknown {what} '{word}'{suggestion}")]
    Unknown {
        /// What was looked for: "parameter", "command or parameter".
        what: &'static str,
        /// The word.
        word: String,
        /// The nearest name, as a question.
        suggestion: String,
    },
    /// There is nothing behind the equals sign.
    #[error("{name} = what? Write a number, as in {name} = {example}")]
    MissingValue {
        /// The parameter.
        name: &'static str,
        /// A value it takes.
        example: f64,
    },
    /// What is behind the equals sign, or behind a command, is not a number.
    #[error("'{text}' is not a number; write for example {example}")]
    NotANumber {
        /// What was written.
        text: String,
        /// A right line.
        example: String,
    },
    /// The parameter does not take this value.
    #[error(transparent)]
    Value(#[from] SetError),
    /// A command with the wrong words behind it.
    #[error("{reason}; write {usage}")]
    Usage {
        /// What is wrong.
        reason: String,
        /// How it is written.
        usage: &'static str,
    },
    /// A file that cannot be read or written.
    #[error("cannot {doing} {}: {reason}", path.display())]
    File {
        /// "read" or "write".
        doing: &'static str,
        /// The file.
        path: PathBuf,
        /// Why, and what to do.
        reason: String,
    },
    /// A bad line of a parameter set. Nothing of the set was applied.
    #[error("{}, line {line}: {error}; nothing was changed", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What is wrong with it.
        error: Box<ConsoleError>,
    },
    /// A parameter that a set gives twice.
    #[error("{name} was set before, in line {before}; remove one of the two")]
    Twice {
        /// The parameter.
        name: &'static str,
        /// The first line, from 1.
        before: usize,
    },
    /// What the run or the robot said.
    #[error("{0}")]
    Target(String),
}

/// The file that keeps the lines from one console to the next.
pub fn history() -> Option<PathBuf> {
    let home = std::env::var_os("XDG_STATE_HOME")
        .map(PathBuf::from)
        .or_else(|| std::env::var_os("HOME").map(|home| PathBuf::from(home).join(".local/state")))?;
    let folder = home.join("barrel");
    std::fs::create_dir_all(&folder).ok()?;
    Some(folder.join("history"))
}
