//! One file for each command.

pub mod chain;
pub mod console;
pub mod export;
pub mod list;
pub mod monitor;
pub mod play;
pub mod plot;
pub mod replay;
pub mod report;
mod robot_console;
pub mod run;
