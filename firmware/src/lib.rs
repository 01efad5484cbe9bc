//! All behaviour of the barrel's robot, portable: no hardware, no clock of its own, no allocation, no panic on input.
//!
//! [`robot`] is the one place where the parts meet; who has read it knows what the robot does:
//!
//! ```text
//! chips ─► attitude ─► brain (Eq. 1–12) ─► servo (PID per weight) ─► safety ─► duties
//! ```
//!
//! It is run by the microcontroller, by the same image on a virtual board, and by the simulator in process.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod attitude;
pub mod axes;
pub mod brain;
pub mod calibration;
pub mod fram;
pub mod homing;
pub mod imu;
pub mod indicator;
pub mod load;
pub mod noise;
pub mod port;
pub mod reset;
pub mod robot;
pub mod safety;
pub mod scalar;
pub mod servo;
pub mod storage;
pub mod tanh;
pub mod timing;
mod vector;

pub use port::Port;
pub use robot::Robot;
pub use scalar::Scalar;
