//! A robot in this process, its message handler called without a wire: no frames, no checksums, the same decisions.

use super::{Answer, Link, LinkError};
use firmware::{Robot, Scalar};
use protocol::{HostMessage, RobotMessage};

/// A robot whose message handler is called directly.
#[derive(Debug)]
pub struct Direct<S: Scalar>(pub Robot<S>);

impl<S: Scalar> Link for Direct<S> {
    fn request(&mut self, message: &HostMessage) -> Result<Answer, LinkError> {
        let mut telemetry = None;
        let mut answer = None;
        self.0.handle(message, &mut |reply| {
            if let RobotMessage::Telemetry(state) = reply {
                telemetry = Some(*state);
            }
            if message.is_answered_by(reply) {
                answer = Some(*reply);
            }
        });
        answer.map(|message| Answer { message, telemetry }).ok_or(LinkError::NoAnswer)
    }
}
