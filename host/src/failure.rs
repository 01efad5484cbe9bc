//! How a command ends when it cannot do what it was asked.

use std::fmt;
use std::process::ExitCode;

/// Why a command stopped.
#[derive(Debug)]
pub enum Failure {
    /// What was asked cannot be done: a wrong name, value or file. Nothing was written. Exit code 2.
    BadInput(String),
    /// Something broke while it was being done. What was written until then is valid. Exit code 1.
    Broken(String),
}

impl Failure {
    /// A failure of what was asked, from any error.
    pub fn bad(error: impl fmt::Display) -> Self {
        Failure::BadInput(error.to_string())
    }

    /// A failure on the way, from any error.
    pub fn broken(error: impl fmt::Display) -> Self {
        Failure::Broken(error.to_string())
    }

    /// The exit code of the process.
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Failure::BadInput(_) => ExitCode::from(2),
            Failure::Broken(_) => ExitCode::FAILURE,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Failure::BadInput(text) | Failure::Broken(text) => f.write_str(text),
        }
    }
}

impl std::error::Error for Failure {}
