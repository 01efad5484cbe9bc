//! The robot's end of a wire: bytes come in, frames are checked and handled, answers go out. It never waits and never fails:
//! what is garbled is counted and dropped, and the next frame finds it in step.

use protocol::frame::{GapCounter, MAX_FRAME};
use protocol::{Decoder, HostMessage, Sequence, encode};

use crate::robot::Robot;
use crate::scalar::Scalar;

/// One line to a host, and what was lost on it.
#[derive(Clone, Debug, Default)]
pub struct Port {
    decoder: Decoder,
    sequence: Sequence,
    gaps: GapCounter,
    garbled: u32,
}

impl Port {
    /// Takes bytes as they arrive, in pieces of any size; every answer is handed to `send` as a whole frame.
    pub fn receive<S: Scalar>(&mut self, bytes: &[u8], robot: &mut Robot<S>, send: &mut impl FnMut(&[u8])) {
        for &byte in bytes {
            match self.decoder.push::<HostMessage>(byte) {
                None => {}
                Some(Err(_)) => self.garbled = self.garbled.saturating_add(1),
                Some(Ok((number, message))) => {
                    self.gaps.arrived(number);
                    robot.handle(&message, &mut |reply| {
                        let mut buffer = [0; MAX_FRAME];
                        if let Some(frame) = encode(self.sequence.take(), reply, &mut buffer) {
                            send(frame);
                        }
                    });
                }
            }
        }
    }

    /// Frames that arrived garbled, since the start.
    pub fn garbled(&self) -> u32 {
        self.garbled
    }

    /// Frames of the host that did not arrive, by the gaps in their numbers.
    pub fn lost(&self) -> u32 {
        self.gaps.lost()
    }
}
