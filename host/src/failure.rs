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
    /// Somebody ended it with Ctrl-C. It came to its end in order. Exit code 130, as shells have it.
    Interrupted(String),
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

    /// Nothing wrong with a recording that is there; of one that is not, the nearest name.
    ///
    /// # Errors
    /// A file that is not there.
    pub fn unless_there(path: &std::path::Path) -> Result<(), Self> {
        if path.exists() {
            return Ok(());
        }
        Err(Failure::BadInput(format!("there is no {}{}", path.display(), crate::suggest::neighbour(path))))
    }

    /// The exit code of the process.
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Failure::BadInput(_) => ExitCode::from(2),
            Failure::Broken(_) => ExitCode::FAILURE,
            Failure::Interrupted(_) => ExitCode::from(130),
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Failure::BadInput(text) | Failure::Broken(text) | Failure::Interrupted(text) => f.write_str(text),
        }
    }
}

impl std::error::Error for Failure {}
