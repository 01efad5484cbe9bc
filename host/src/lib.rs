//! The parts of the `barrel` command: recorder, plots, console.

pub mod csv;
pub mod draft;
pub mod log;
pub mod suggest;
