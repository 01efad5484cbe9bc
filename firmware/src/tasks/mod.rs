//! What the microcontroller does all day.

pub mod idle;
mod pace;
pub mod panel;
pub mod servo;
pub mod shared;
pub mod storage;
pub mod wire;
