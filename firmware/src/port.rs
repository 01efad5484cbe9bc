//! The robot's end of a wire: bytes come in, frames are checked, answers go out as frames. It never waits and never fails:
//! what is garbled is counted and dropped, and the next frame finds it in step.
//!
//! The last request's answer is kept. A host that did not hear it sends the request again under the same number
//! ([`protocol::frame`]), and is given the answer again without the robot being asked twice.

use heapless::Vec;
use protocol::frame::{Arrival, MAX_FRAME, Numbering};
use protocol::{Decoder, HostMessage, RobotMessage, Sequence, encode};

use crate::robot::Robot;
use crate::scalar::Scalar;

/// Room for the longest answer to one request: telemetry and the outputs.
const ANSWERS: usize = MAX_FRAME + 64;

/// One line to a host, and what was lost on it.
#[derive(Clone, Debug, Default)]
pub struct Port {
    decoder: Decoder,
    sequence: Sequence,
    numbering: Numbering,
    garbled: u32,
    /// The frames that answered the last request.
    answers: Vec<u8, ANSWERS>,
}

/// What a byte from the host completed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Incoming<'a> {
    /// A message to be carried out and answered.
    Request(HostMessage),
    /// The last request once more: its answer, to be sent again.
    Again(&'a [u8]),
}

impl Port {
    /// Takes one byte as it arrives.
    pub fn push(&mut self, byte: u8) -> Option<Incoming<'_>> {
        let (number, message) = match self.decoder.push::<HostMessage>(byte)? {
            Ok(frame) => frame,
            Err(_) => {
                self.garbled = self.garbled.saturating_add(1);
                return None;
            }
        };
        if self.numbering.heard(number, &message) == Arrival::Again {
            // Without an answer yet, it is still to come.
            return (!self.answers.is_empty()).then_some(Incoming::Again(&self.answers));
        }
        self.answers.clear();
        Some(Incoming::Request(message))
    }

    /// Takes bytes as they arrive, in pieces of any size, has `robot` carry out what they say, and hands every answer to
    /// `send` as a whole frame.
    pub fn serve<S: Scalar>(&mut self, bytes: &[u8], robot: &mut Robot<S>, send: &mut impl FnMut(&[u8])) {
        for &byte in bytes {
            match self.push(byte) {
                None => {}
                Some(Incoming::Again(frames)) => send(frames),
                Some(Incoming::Request(message)) => robot.handle(&message, &mut |reply| {
                    let mut buffer = [0; MAX_FRAME];
                    send(self.answer(reply, &mut buffer));
                }),
            }
        }
    }

    /// Frames an answer to the last request into `buffer`. Nothing comes out if it does not fit, which no message of the
    /// protocol does.
    pub fn answer<'b>(&mut self, reply: &RobotMessage, buffer: &'b mut [u8; MAX_FRAME]) -> &'b [u8] {
        let frame = self.announce(reply, buffer);
        if self.answers.extend_from_slice(frame).is_err() {
            self.answers.clear();
        }
        frame
    }

    /// Frames a message that no request asked for.
    pub fn announce<'b>(&mut self, message: &RobotMessage, buffer: &'b mut [u8; MAX_FRAME]) -> &'b [u8] {
        encode(self.sequence.take(), message, buffer).unwrap_or_default()
    }

    /// Frames that arrived garbled, since the start.
    pub fn garbled(&self) -> u32 {
        self.garbled
    }

    /// Frames of the host that did not arrive, by the gaps in their numbers.
    pub fn lost(&self) -> u32 {
        self.numbering.lost()
    }
}
