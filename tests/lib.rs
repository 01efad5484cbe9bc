//! What several tests need: a setup by names, a line that loses bytes, a bench for the board.

#[cfg(feature = "virtual-board")]
pub mod board;

use hil_sim::experiment::Experiment;
use hil_sim::setup::{BodyKind, Setup};
use protocol::Id;

/// A line that loses bytes and changes some, the same ones every time.
#[derive(Clone, Debug)]
pub struct BadLine {
    /// Every so many-th byte is lost, and the seventh after each is changed.
    every: u32,
    bytes: u32,
}

impl BadLine {
    /// A line that loses every so many-th byte.
    pub fn losing(every: u32) -> Self {
        BadLine { every, bytes: 0 }
    }

    /// What arrives of these bytes.
    pub fn carry(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut arrived = Vec::new();
        for &byte in bytes {
            self.bytes += 1;
            match self.bytes % self.every {
                0 => {}
                7 => arrived.push(byte ^ 0x10),
                _ => arrived.push(byte),
            }
        }
        arrived
    }
}

/// An experiment on a body, with parameters by name.
///
/// # Panics
/// On an unknown name or a value out of range: a mistake in the test.
pub fn setup(experiment: &str, body: BodyKind, seed: u64, sets: &[(&str, f64)]) -> Setup {
    let experiment = Experiment::find(experiment).expect("an experiment of the table");
    let mut setup = Setup::new(experiment, body);
    setup.seed = seed;
    for (name, value) in sets {
        let id = Id::from_name(name).expect("a parameter of the table");
        setup.set(id, *value).expect("a value in range");
    }
    setup
}
