//! Makes a machine ready. Everything may be run again; what is there is left alone.

use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;
use std::{env, fs};

use crate::command;
use crate::debian;
use crate::toolchain::{TARGETS, Toolchain};

/// For how long a download may stand still. A server out of reach can be a silent one.
const PATIENCE: Duration = Duration::from_secs(60);

/// Programs that a person has to install, what they are for and where they come from. To be without one is no error here:
/// the tests need no probe-rs, and this very program has been linked by something.
const PROGRAMS: [(&str, &str); 2] = [
    ("cc", "the C compiler, by which everything is linked; on Debian and Ubuntu it is in the package build-essential"),
    ("probe-rs", "only needed to flash a board and to see its logs; docs/flashing.md says how to get it"),
];

/// Everything that the tests and the image need.
///
/// # Errors
/// When something is missing and cannot be had; with what to do about it.
pub fn everything() -> Result<(), String> {
    programs();
    let failed: Vec<String> = [components(), targets()].into_iter().filter_map(Result::err).collect();
    match failed.is_empty() {
        true => Ok(()),
        false => Err(failed.join("\n")),
    }
}

/// Says which of [`PROGRAMS`] are there.
fn programs() {
    for (program, what) in PROGRAMS {
        match command::succeeds(program, &["--version"]) {
            true => eprintln!("    present: {program}"),
            // Where the system's linker has another name, that is as it should be.
            false if program == "cc" && !cfg!(unix) => {}
            false => eprintln!("    missing: {program}, {what}"),
        }
    }
}

/// The parts of the toolchain that the tests call.
///
/// # Errors
/// When one is missing and rustup cannot install it.
pub fn components() -> Result<(), String> {
    for (component, tool) in [("rustfmt", "fmt"), ("clippy", "clippy")] {
        if command::succeeds("cargo", &[tool, "--version"]) {
            eprintln!("    present: {component}");
            continue;
        }
        eprintln!("    installing: {component}");
        rustup(&["component", "add", component]).map_err(|why| {
            eprintln!("    cannot install: {component}");
            format!("{why}\ninstall {component} for your Rust toolchain by hand, then run this again")
        })?;
        eprintln!("    installed: {component}");
    }
    Ok(())
}

/// A compiler for every target: as it is, by rustup, or out of Debian's packages.
///
/// # Errors
/// When a target can be had in none of these ways.
pub fn targets() -> Result<(), String> {
    let missing: Vec<&str> = TARGETS.into_iter().filter(|target| !present(target)).collect();
    if missing.is_empty() {
        return Ok(());
    }
    eprintln!("    installing: {}, by rustup", missing.join(", "));
    let words: Vec<&str> = ["target", "add"].into_iter().chain(missing.iter().copied()).collect();
    let rustup = rustup(&words);
    if rustup.is_ok() && missing.iter().all(|target| Toolchain::Default.has(target)) {
        eprintln!("    installed: {}", missing.join(", "));
        return Ok(());
    }
    let rustup = rustup.err().unwrap_or_else(|| "rustup added them to another toolchain than that in use".into());
    eprintln!("    cannot install by rustup: {rustup}");
    let debian = match debian::make() {
        Ok(()) if missing.iter().all(|target| present(target)) => return Ok(()),
        Ok(()) => "what was made does not work".into(),
        Err(why) => why,
    };
    eprintln!("    cannot make out of Debian's packages: {debian}");
    Err(format!(
        "no compiler for {0}: neither rustup nor Debian's packages have one (see above); without it no image for the \
         board can be built, everything else works\nwhere rustup's server can be reached, this installs it: \
         rustup target add {0}",
        missing.join(" ")
    ))
}

/// Whether a target is there; says so.
fn present(target: &str) -> bool {
    let Some(toolchain) = Toolchain::find(target) else { return false };
    let from = match &toolchain {
        Toolchain::Default => String::new(),
        Toolchain::Made(prefix) => format!(", by the compiler in {}", prefix.display()),
    };
    eprintln!("    present: {target}{from}");
    true
}

/// Runs rustup; it is stopped when nothing is downloaded any more.
fn rustup(words: &[&str]) -> Result<(), String> {
    let log = env::temp_dir().join(format!("barrel-rustup-{}.log", std::process::id()));
    let mut command = Command::new("rustup");
    // Without retries a server out of reach is known at once.
    command.args(words).env("RUSTUP_MAX_RETRIES", "0").env("RUST_BACKTRACE", "0");
    let done = command::run_watched(&mut command, PATIENCE, downloaded, &log);
    let _ = fs::remove_file(&log);
    done
}

/// How much rustup has downloaded so far, in bytes.
fn downloaded() -> u64 {
    let home = env::var_os("RUSTUP_HOME").map(PathBuf::from);
    let home = home.or_else(|| Some(env::home_dir()?.join(".rustup")));
    let files = home.and_then(|home| home.join("downloads").read_dir().ok());
    files.into_iter().flatten().flatten().filter_map(|file| Some(file.metadata().ok()?.len())).sum()
}
