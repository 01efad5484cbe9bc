//! What the window asks of the session behind it.

use hil_sim::experiment::Experiment;
use hil_sim::plant::Load;
use hil_sim::setup::BodyKind;
use protocol::Id;

/// Something that the window asks for. The window never waits: what comes of it is told in the session's news.
#[derive(Clone, Debug, PartialEq)]
pub enum Order {
    /// A line of the console; it and its answer are shown in the drawer.
    Line(String),
    /// A parameter takes a value that was checked; a knob that is being turned sends many of these.
    Set(Id, f64),
    /// A hand pulls the barrel from now on, until another order says otherwise.
    Hand(Load),
    /// The session ends, and another begins.
    Start(Start),
}

/// A session to begin.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// The experiment.
    pub experiment: &'static Experiment,
    /// The barrel.
    pub body: BodyKind,
    /// Seed of all randomness.
    pub seed: u64,
    /// What differs from the experiment's preset.
    pub sets: Vec<(Id, f64)>,
}
