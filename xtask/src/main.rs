//! Project chores, in Rust so that a machine with cargo can do them all: `cargo xtask test`, `cargo xtask setup`.

use std::env;
use std::process::{Command, ExitCode};
use std::time::Instant;

const HELP: &str = "\
cargo xtask setup   installs what the tests need and is missing
cargo xtask test    setup, then formatting, lints, documentation and every test
cargo xtask bench   every benchmark (criterion); reports in target/criterion";

fn main() -> ExitCode {
    let task = env::args().nth(1);
    let done = match task.as_deref() {
        Some("setup") => setup(),
        Some("test") => setup().and_then(|()| test()),
        Some("bench") => bench(),
        Some("help" | "--help" | "-h") | None => {
            println!("{HELP}");
            Ok(())
        }
        Some(other) => Err(format!("there is no task '{other}'\n{HELP}")),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("xtask: {why}");
            ExitCode::FAILURE
        }
    }
}

/// Makes sure that what the tests call is there.
fn setup() -> Result<(), String> {
    for component in ["rustfmt", "clippy"] {
        let tool = if component == "rustfmt" { "fmt" } else { "clippy" };
        if quiet(&["cargo", tool, "--version"]) {
            println!("    present: {component}");
            continue;
        }
        run(&format!("installing {component}"), &["rustup", "component", "add", component], &[]).map_err(|why| {
            format!("{why}\ninstall {component} for your Rust toolchain by hand, then run this again")
        })?;
    }
    Ok(())
}

fn test() -> Result<(), String> {
    run("formatting", &["cargo", "fmt", "--all", "--check"], &[])?;
    run("lints", &["cargo", "clippy", "--workspace", "--all-targets", "--", "-D", "warnings"], &[])?;
    run("documentation", &["cargo", "doc", "--workspace", "--no-deps"], &[("RUSTDOCFLAGS", "-D warnings")])?;
    run("tests", &["cargo", "test", "--workspace", "--no-fail-fast"], &[])
}

fn bench() -> Result<(), String> {
    run("benchmarks", &["cargo", "bench", "--workspace", "--benches"], &[])
}

/// Runs a command whose output belongs to the person.
fn run(what: &str, command: &[&str], environment: &[(&str, &str)]) -> Result<(), String> {
    println!("==> {what}: {}", command.join(" "));
    let start = Instant::now();
    let status = Command::new(command[0])
        .args(&command[1..])
        .envs(environment.iter().copied())
        .status()
        .map_err(|why| format!("{what}: cannot start {}: {why}", command[0]))?;
    if !status.success() {
        return Err(format!("{what} failed: {}", command.join(" ")));
    }
    println!("    {what}: {} s", start.elapsed().as_secs());
    Ok(())
}

/// Whether a command runs and succeeds, its output unseen.
fn quiet(command: &[&str]) -> bool {
    Command::new(command[0]).args(&command[1..]).output().is_ok_and(|out| out.status.success())
}
