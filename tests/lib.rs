//! Runs for tests: an experiment, a seed and a few changes in, its records and measures out.

#[cfg(feature = "virtual-board")]
pub mod board;

use firmware::{Robot, Scalar};
use hil_sim::experiment::Experiment;
use hil_sim::link::Direct;
use hil_sim::measure::Measures;
use hil_sim::record::Record;
use hil_sim::run::Run;
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

/// Runs `setup` for `seconds` with a brain in `S`; every record goes to `observe`.
///
/// # Panics
/// If the run does not start or does not go on.
pub fn run<S: Scalar>(setup: Setup, seconds: f64, mut observe: impl FnMut(&Record)) -> Measures {
    let mut run = Run::start(setup, Direct(Robot::<S>::default())).expect("the run starts");
    let mut measures = Measures::default();
    while run.time() < seconds {
        let record = run.step().expect("the run goes on");
        measures.add(&record);
        observe(&record);
    }
    measures
}
