//! The host's end of the wire protocol: frames out, messages in, and a tape of both for the recorder. It carries no bytes
//! itself.

use protocol::frame::{Arrival, MAX_FRAME, Numbering};
use protocol::{Decoder, FrameError, HostMessage, RobotMessage, Sequence, encode};

/// Which way a frame went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// From the host to the robot.
    ToRobot,
    /// From the robot to the host.
    ToHost,
}

/// A frame that comes again is among the last so many.
const KEPT: usize = 32;
/// Garbage without a delimiter goes onto the tape in pieces of this size.
const LONGEST_GARBAGE: usize = 4096;

/// Frames, their numbers, and what was lost.
#[derive(Clone, Debug, Default)]
pub struct Wire {
    decoder: Decoder,
    sequence: Sequence,
    numbering: Numbering,
    garbled: u32,
    repeated: u32,
    /// Bytes of the frame that is arriving.
    frame: Vec<u8>,
    /// The last frames that arrived whole, each in the place of its number.
    kept: [Vec<u8>; KEPT],
    tape: Vec<u8>,
    cuts: Vec<(Direction, usize)>,
}

impl Wire {
    /// The frame of a new request. It goes out through [`Wire::sent`], as often as it takes.
    pub fn frame(&mut self, message: &HostMessage) -> Vec<u8> {
        let mut buffer = [0; MAX_FRAME];
        // Every message of the protocol fits: its tests say so.
        encode(self.sequence.take(), message, &mut buffer).unwrap_or_default().to_vec()
    }

    /// Notes that a frame has been sent.
    pub fn sent(&mut self, frame: &[u8]) {
        self.note(Direction::ToRobot, frame);
    }

    /// Takes one byte of the robot's; at the end of a frame returns its message, or what was wrong with it. A frame that
    /// was heard before is passed over.
    pub fn push(&mut self, byte: u8) -> Option<Result<RobotMessage, FrameError>> {
        self.frame.push(byte);
        let decoded = self.decoder.push::<RobotMessage>(byte);
        let mut frame = Vec::new();
        if byte == 0 || self.frame.len() > LONGEST_GARBAGE {
            frame = core::mem::take(&mut self.frame);
            self.note(Direction::ToHost, &frame);
        }
        match decoded? {
            Ok((number, message)) => {
                let place = &mut self.kept[usize::from(number) % KEPT];
                let same = *place == frame;
                *place = frame;
                match self.numbering.heard(number, &message) {
                    Arrival::Again if same => {
                        self.repeated = self.repeated.wrapping_add(1);
                        return None;
                    }
                    // What is repeated is repeated to the byte: this is a robot that was reset, early in its count.
                    Arrival::Again => self.numbering.begin(number),
                    Arrival::New { .. } | Arrival::Restarted => {}
                }
                Some(Ok(message))
            }
            Err(error) => {
                self.garbled = self.garbled.saturating_add(1);
                Some(Err(error))
            }
        }
    }

    /// Frames of the robot that did not arrive, by the gaps in their numbers.
    pub fn lost(&self) -> u32 {
        self.numbering.lost()
    }

    /// Frames of the robot that arrived garbled.
    pub fn garbled(&self) -> u32 {
        self.garbled
    }

    /// Frames of the robot that had been heard before.
    pub fn repeated(&self) -> u32 {
        self.repeated
    }

    /// Hands over every frame since the last call, in order.
    pub fn drain(&mut self, sink: &mut dyn FnMut(Direction, &[u8])) {
        let mut start = 0;
        for (direction, end) in self.cuts.drain(..) {
            sink(direction, &self.tape[start..end]);
            start = end;
        }
        self.tape.clear();
    }

    fn note(&mut self, direction: Direction, bytes: &[u8]) {
        self.tape.extend_from_slice(bytes);
        self.cuts.push((direction, self.tape.len()));
    }
}
