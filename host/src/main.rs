//! `barrel`: experiments with the self-organizing barrel, on the command line.

use barrel::cli::{Cli, Command, RunArgs};
use barrel::commands;
use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let cli = Cli::parse();
    let done = match cli.command.unwrap_or_else(|| Command::Run(RunArgs::default())) {
        Command::Run(args) => commands::run::run(&args),
        Command::Replay(args) => commands::replay::replay(&args),
        Command::Export(args) => commands::export::export(&args),
        Command::Plot(args) => commands::plot::plot(&args),
        Command::List(args) => commands::list::list(&args),
        Command::Console(args) => commands::console::console(&args),
        Command::Play(args) => commands::play::play(&args),
        Command::Monitor(args) => commands::monitor::monitor(&args),
        Command::Chain(args) => commands::chain::chain(&args),
        Command::Report(args) => commands::report::report(&args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("barrel: {failure}");
            failure.exit_code()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_command_is_the_default_run() {
        let cli = Cli::parse_from(["barrel"]);
        assert!(cli.command.is_none());
        assert_eq!(RunArgs::default().setup.experiment.name, "homeokinetic");
    }
}
