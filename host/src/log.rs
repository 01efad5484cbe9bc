//! The log of a run: an MCAP file with the raw frames, the decoded brain and plant, and what happened.
//!
//! | topic | encoding | one message per |
//! |---|---|---|
//! | `/wire/host` | `postcard-cobs` | frame from host to robot, as sent, delimiter included |
//! | `/wire/robot` | `postcard-cobs` | frame from robot to host |
//! | `/brain` | `json` | control step: [`crate::csv::BRAIN_COLUMNS`] |
//! | `/plant` | `json` | control step: [`crate::csv::PLANT_COLUMNS`], [`crate::csv::ATTITUDE_COLUMNS`] and `t` |
//! | `/events` | `json` | event: `t`, `kind`, `text` |
//! | `/vitals` | `json` | second of a robot on a line: [`protocol::message::Vitals`] and `t` |
//!
//! Times are virtual, in ns; in a run nothing comes from the wall clock, so one seed gives one file, byte for byte.
//! Two metadata records stand in front: `run` (how to repeat it, versions) and `parameters` (all of them, at the start).
//!
//! Chunks hold about one simulated second and reach the file whole, in order, with nothing to patch afterwards: a run
//! that is killed loses its open chunk and no more. [`Reader`] reads such a file up to its last whole chunk.

mod read;
mod write;

use std::io;
use std::path::PathBuf;

use hil_sim::link::Direction;
use hil_sim::record::{BrainRecord, PlantRecord};
use protocol::message::Vitals;
use thiserror::Error;

pub use read::{Export, Reader, export, is_log, read_table, table};
pub use write::Writer;

/// Topic of the frames from host to robot.
pub const WIRE_HOST: &str = "/wire/host";
/// Topic of the frames from robot to host.
pub const WIRE_ROBOT: &str = "/wire/robot";
/// Topic of the brain.
pub const BRAIN: &str = "/brain";
/// Topic of the plant.
pub const PLANT: &str = "/plant";
/// Topic of the events.
pub const EVENTS: &str = "/events";
/// Topic of the robot's vitals.
pub const VITALS: &str = "/vitals";

/// One message of a log.
#[derive(Clone, Debug, PartialEq)]
pub enum Entry {
    /// A frame as it went over the wire.
    Frame {
        /// Virtual time, ns.
        time: u64,
        /// Which way it went.
        direction: Direction,
        /// The bytes, delimiter included.
        bytes: Vec<u8>,
    },
    /// The brain after a control step. Its numbers are what the decimals in the log say: for a single-precision brain,
    /// round them to `f32` to have the very numbers back. A number that was not finite is NaN.
    Brain(BrainRecord<f64>),
    /// The plant at time `t`, s.
    Plant {
        /// Virtual time, s.
        t: f64,
        /// The plant.
        plant: PlantRecord,
    },
    /// Something happened.
    Event(Event),
    /// How the robot was at time `t`, s.
    Vitals {
        /// Time, s.
        t: f64,
        /// What it said of itself.
        vitals: Vitals,
    },
}

/// A parameter was set, somebody pushed, the safety state changed, …
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// Virtual time, s.
    pub t: f64,
    /// One word for the sort of event: `parameter`, `push`, `state`, …
    pub kind: String,
    /// What happened, for people.
    pub text: String,
}

/// What can be wrong with a log. A log that merely ends early is none of this, see [`Reader::truncated`].
#[derive(Debug, Error)]
pub enum LogError {
    /// The file cannot be opened or read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The file cannot be created or written.
    #[error("cannot write {}: {reason}; choose a folder that exists, may be written and has room", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The file holds no byte.
    #[error("{} is empty: the run ended before its log began", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The file does not start as an MCAP does.
    #[error("{} is not an MCAP log: it does not start with the MCAP magic bytes{hint}", path.display())]
    NotMcap {
        /// The file.
        path: PathBuf,
        /// What it may be instead.
        hint: &'static str,
    },
    /// Bytes were changed.
    #[error("{} is damaged in the {part} at byte {at}: {reason}; everything before it was read, use another copy for the rest", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Offset of the record that cannot be trusted.
        at: u64,
        /// Which part that is: "3rd chunk, from 2.00 s", "metadata", …
        part: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A whole MCAP, but without what was asked for.
    #[error("{} holds no {topic} message{}", path.display(), if *truncated { ": it was cut off before its first whole chunk" } else { ": it is not a log of this program, or of an empty run" })]
    Missing {
        /// The file.
        path: PathBuf,
        /// The topic.
        topic: &'static str,
        /// Whether the file was cut off.
        truncated: bool,
    },
    /// The CSV beside the log has a problem.
    #[error(transparent)]
    Csv(#[from] crate::csv::CsvError),
}
