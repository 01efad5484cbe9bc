//! Project chores, in Rust so that a machine with cargo can do them all: `cargo xtask test`, `cargo xtask setup`.
//!
//! What is done goes to the standard error stream; only what a program may want to read goes to the standard output.

mod budget;
mod command;
mod debian;
mod elf;
mod firmware;
mod setup;
mod test;
mod toolchain;

use std::env;
use std::process::ExitCode;

const HELP: &str = "\
cargo xtask setup      installs what the tests and the image need and is missing
cargo xtask test       setup, then formatting, lints, documentation, the images and every test
cargo xtask firmware   builds the image for the board and shows what it takes of flash and RAM
    --no-log           without logs; the budget of flash counts for this one
    --fixed            the brain in fixed point instead of f32
    --target TARGET    thumbv7em-none-eabihf (the board; the default) or thumbv7m-none-eabi (no FPU)
    --print-path       the last line of the standard output is the image's path
cargo xtask bench      every benchmark (criterion); reports in target/criterion";

fn main() -> ExitCode {
    let words: Vec<String> = env::args().skip(1).collect();
    let mut words = words.iter().map(String::as_str);
    let task = words.next();
    let rest: Vec<&str> = words.collect();
    let done = match task {
        Some("help" | "--help" | "-h") | None => help(),
        Some(_) if rest.contains(&"--help") || rest.contains(&"-h") => help(),
        Some("firmware") => firmware::Order::parse(&rest).and_then(|order| order.execute()),
        Some("setup" | "test" | "bench") if !rest.is_empty() => {
            Err(format!("'{}' is not understood\n{HELP}", rest.join(" ")))
        }
        Some("setup") => setup::everything(),
        Some("test") => test::everything(),
        Some("bench") => command::run("benchmarks", command::cargo("bench").args(["--workspace", "--benches"])),
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

fn help() -> Result<(), String> {
    println!("{HELP}");
    Ok(())
}
