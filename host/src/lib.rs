//! The parts of the `barrel` command: the command line, one file for each command, recorder, plots, console, report.

#[macro_use]
mod say;

pub mod cli;
pub mod commands;
pub mod console;
pub mod csv;
pub mod draft;
pub mod failure;
pub mod image;
pub mod interrupt;
pub mod journal;
pub mod log;
pub mod plot;
pub mod reach;
pub mod recorded;
pub mod recorder;
pub mod report;
pub mod session;
pub mod suggest;
pub mod words;
