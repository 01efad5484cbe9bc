//! Running other programs, and where they run.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use std::{env, fs, io, thread};

/// The top of the repository.
pub fn root() -> PathBuf {
    let here = env::var_os("CARGO_MANIFEST_DIR").map_or_else(|| env!("CARGO_MANIFEST_DIR").into(), PathBuf::from);
    here.parent().map_or(here.clone(), Path::to_path_buf)
}

/// Where cargo builds: `CARGO_TARGET_DIR`, seen from the top of the repository, or `target` there.
pub fn target_folder() -> PathBuf {
    root().join(env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into()))
}

/// A subcommand of cargo, at the top of the repository.
pub fn cargo(subcommand: &str) -> Command {
    let mut command = Command::new("cargo");
    command.arg(subcommand).current_dir(root());
    command
}

/// Runs a command whose output belongs to the person, and says how long it took.
///
/// # Errors
/// When it cannot be started or fails.
pub fn run(what: &str, command: &mut Command) -> Result<(), String> {
    let line = line(command);
    eprintln!("==> {what}: {line}");
    let start = Instant::now();
    let status = command.status().map_err(|why| format!("{what}: cannot start {line}: {why}"))?;
    if !status.success() {
        return Err(format!("{what} failed: {line}"));
    }
    eprintln!("    {what}: {} s", start.elapsed().as_secs());
    Ok(())
}

/// Runs a command unseen and returns its standard output.
///
/// # Errors
/// When it cannot be started or fails; with the last that it said.
pub fn read(command: &mut Command) -> Result<String, String> {
    let line = line(command);
    let output = command.output().map_err(|why| format!("cannot start {line}: {why}"))?;
    if !output.status.success() {
        return Err(format!("{line} failed:\n{}", last_lines(&String::from_utf8_lossy(&output.stderr))));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Whether a command runs and succeeds, its output unseen.
pub fn succeeds(program: &str, arguments: &[&str]) -> bool {
    Command::new(program).args(arguments).output().is_ok_and(|output| output.status.success())
}

/// Runs a command unseen and ends it when nothing moves for too long: `progress` is any number that changes while there
/// is some. What the command says goes to a file, as a full pipe would stop it.
///
/// # Errors
/// When it cannot be started, fails or stands still; with the last that it said.
pub fn run_watched(
    command: &mut Command,
    patience: Duration,
    mut progress: impl FnMut() -> u64,
    log: &Path,
) -> Result<(), String> {
    let line = line(command);
    let broken = |why: io::Error| format!("{line}: {why}");
    let file = fs::File::create(log).map_err(broken)?;
    let copy = file.try_clone().map_err(broken)?;
    let mut child = command.stdin(Stdio::null()).stdout(file).stderr(copy).spawn().map_err(broken)?;
    let mut moved = (progress(), Instant::now());
    loop {
        if let Some(status) = child.try_wait().map_err(broken)? {
            let said = fs::read_to_string(log).unwrap_or_default();
            return if status.success() { Ok(()) } else { Err(format!("{line} failed:\n{}", last_lines(&said))) };
        }
        let now = progress();
        if now != moved.0 {
            moved = (now, Instant::now());
        }
        if moved.1.elapsed() > patience {
            child.kill().and_then(|()| child.wait()).map_err(broken)?;
            return Err(format!("{line} stood still for {} s", patience.as_secs()));
        }
        thread::sleep(Duration::from_millis(50));
    }
}

/// What one would type, with the variables that are set.
fn line(command: &Command) -> String {
    let set = |(name, value): (&OsStr, Option<&OsStr>)| Some(format!("{}={}", name.display(), value?.display()));
    let variables = command.get_envs().filter_map(set);
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    variables.chain(words.map(|word| word.display().to_string())).collect::<Vec<_>>().join(" ")
}

/// The last few lines of what a program said, indented.
fn last_lines(said: &str) -> String {
    let lines: Vec<&str> = said.lines().filter(|line| !line.trim().is_empty()).collect();
    let last = lines.len().saturating_sub(8);
    lines[last..].iter().map(|line| format!("      {line}")).collect::<Vec<_>>().join("\n")
}
