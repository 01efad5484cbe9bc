//! One file for each command.

pub mod console;
pub mod export;
pub mod list;
pub mod plot;
pub mod replay;
pub mod run;
