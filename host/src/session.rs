//! A barrel that goes on while somebody talks to it: what the console and the playground have in common.
//!
//! [`Simulated`] is a recorded run in pace with the clock, [`Attached`] a robot on a line with its own sensors. Both carry out
//! the console's lines, one after the other, and tell an [`Audience`] what comes of them.

mod attached;
mod simulated;

pub use attached::Attached;
pub use simulated::{Pace, Simulated};

use protocol::RobotMessage;

/// Who a session tells what happens.
pub trait Audience {
    /// Hears a sentence for people; it may have several lines, or be empty.
    fn say(&mut self, text: &str);

    /// Hears that something could not be done, and why.
    fn complain(&mut self, text: &str) {
        self.say(text);
    }

    /// Hears what a robot on a line says by itself; `t` is the time of its last control step, s.
    fn heard(&mut self, _t: f64, _message: &RobotMessage) {}
}
