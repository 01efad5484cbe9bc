//! `barrel play`: hands over to the playground, a program of its own, as its window takes minutes to build.

use crate::cli::PlayArgs;
use crate::failure::Failure;
use std::path::PathBuf;
use std::process::Command;

/// The playground's program, in the folder of this one.
const PROGRAM: &str = "barrel-play";

/// Starts the playground with the same arguments, and ends when it does.
///
/// # Errors
/// A playground that was not built, or that ended with an error of its own.
pub fn play(args: &PlayArgs) -> Result<(), Failure> {
    // A window is not needed for that.
    args.check()?;
    let program = beside().ok_or_else(|| {
        Failure::bad(format!(
            "the playground, {PROGRAM}, is not beside this `barrel`: in the project's folder, `cargo play` builds and starts it, \
             which takes some minutes once"
        ))
    })?;
    // The command's own name is left out: what follows it is the playground's, too.
    let mut given = std::env::args_os().skip(1).skip_while(|argument| argument != "play");
    given.next();
    become_it(Command::new(&program).args(given))
        .map_err(|error| Failure::broken(format!("cannot start {}: {error}", program.display())))
}

/// Ctrl-C and the exit code are the playground's: this process becomes it.
#[cfg(unix)]
fn become_it(program: &mut Command) -> std::io::Result<()> {
    Err(std::os::unix::process::CommandExt::exec(program))
}

/// Waits for the playground and ends as it does.
#[cfg(not(unix))]
fn become_it(program: &mut Command) -> std::io::Result<()> {
    match program.status()?.code() {
        Some(0) => Ok(()),
        // It has said itself what was wrong.
        code => std::process::exit(code.unwrap_or(1)),
    }
}

/// Where the playground is.
fn beside() -> Option<PathBuf> {
    let this = std::env::current_exe().ok()?;
    let program = this.with_file_name(format!("{PROGRAM}{}", std::env::consts::EXE_SUFFIX));
    program.is_file().then_some(program)
}
