//! How a session stands.

use crate::order::Start;
use barrel::session::Pace;
use protocol::Values;
use protocol::message::{SafetyState, Vitals};
use std::path::PathBuf;
use std::time::Instant;

/// How a session stands.
#[derive(Clone, Debug)]
pub struct Status {
    /// Counts the sessions that have begun: with a new one, time begins anew.
    pub session: u64,
    /// How the robot is reached.
    pub link: LinkState,
    /// What was begun.
    pub start: Option<Start>,
    /// The robot's safety state, as last heard.
    pub state: Option<SafetyState>,
    /// Whether the robot looks for the middle of its axes, for which it is Armed.
    pub homing: bool,
    /// Whether simulated time goes on.
    pub pace: Pace,
    /// Simulated seconds a second that were asked for; infinite is as fast as it goes.
    pub speed: f64,
    /// The parameters as they are held now.
    pub values: Option<Values<f64>>,
    /// The log that is being written.
    pub log: Option<PathBuf>,
    /// What the robot last said of itself.
    pub vitals: Option<Vitals>,
    /// What the robot is: firmware and number format, in words.
    pub who: String,
    /// When the session last gave a sign of life.
    pub beat: Instant,
    /// Counts what a window must show anew besides control steps.
    pub revision: u64,
}

/// How the robot is reached.
#[derive(Clone, Debug, PartialEq)]
pub enum LinkState {
    /// It is looked for, or being built; a sentence.
    Connecting(String),
    /// It is there.
    Live,
    /// It is there, but behind; a sentence.
    Lagging(String),
    /// It was there and is gone; a sentence. It is looked for.
    Lost(String),
    /// It is there and cannot be talked to: another version; a sentence. It is looked at again.
    Refused(String),
    /// The session has come to its end; a sentence.
    Over(String),
}

impl LinkState {
    /// One word for it.
    pub fn word(&self) -> &'static str {
        match self {
            LinkState::Connecting(_) => "Connecting",
            LinkState::Live => "Connected",
            LinkState::Lagging(_) => "Lagging",
            LinkState::Lost(_) => "Lost",
            LinkState::Refused(_) => "Refused",
            LinkState::Over(_) => "Ended",
        }
    }

    /// Why it is so, and what to do.
    pub fn sentence(&self) -> &str {
        match self {
            LinkState::Live => "the robot is there, and in time",
            LinkState::Connecting(why)
            | LinkState::Lagging(why)
            | LinkState::Lost(why)
            | LinkState::Refused(why)
            | LinkState::Over(why) => why,
        }
    }

    /// Whether the robot can be told something.
    pub fn is_up(&self) -> bool {
        matches!(self, LinkState::Live | LinkState::Lagging(_))
    }
}

impl Default for Status {
    fn default() -> Self {
        Status {
            session: 0,
            link: LinkState::Connecting("starting".to_owned()),
            start: None,
            state: None,
            homing: false,
            pace: Pace::Going,
            speed: 1.0,
            values: None,
            log: None,
            vitals: None,
            who: String::new(),
            beat: Instant::now(),
            revision: 0,
        }
    }
}

impl Status {
    /// What a change of makes the window draw itself anew.
    pub(super) fn shown(&self) -> (u64, LinkState, Option<SafetyState>, bool, Pace, u64) {
        (self.session, self.link.clone(), self.state, self.homing, self.pace, self.revision)
    }
}
