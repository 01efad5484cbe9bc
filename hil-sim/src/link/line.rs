//! The wire protocol's host side, over any transport of bytes.

use super::{Answer, Link, LinkError};
use protocol::frame::{GapCounter, MAX_FRAME};
use protocol::{Decoder, HostMessage, RobotMessage, Sequence, encode};

/// Which way a frame went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// From the host to the robot.
    ToRobot,
    /// From the robot to the host.
    ToHost,
}

/// Garbage without a delimiter goes onto the tape in pieces of this size.
const LONGEST_GARBAGE: usize = 4096;

/// Something that carries bytes to a robot and back.
pub trait Transport {
    /// Sends all of `bytes`.
    fn write(&mut self, bytes: &[u8]) -> Result<(), LinkError>;

    /// Appends what has arrived to `buffer`; waits for at least one byte, within the transport's own time limit.
    ///
    /// # Errors
    /// [`LinkError::NoAnswer`] when nothing comes.
    fn read(&mut self, buffer: &mut Vec<u8>) -> Result<(), LinkError>;
}

/// A robot at the other end of a wire.
#[derive(Debug)]
pub struct Line<T> {
    transport: T,
    decoder: Decoder,
    sequence: Sequence,
    gaps: GapCounter,
    /// Bytes read but not yet decoded.
    input: Vec<u8>,
    /// Bytes of the frame that is arriving.
    frame: Vec<u8>,
    tape: Vec<u8>,
    cuts: Vec<(Direction, usize)>,
}

impl<T: Transport> Line<T> {
    /// Speaks to the robot behind `transport`.
    pub fn new(transport: T) -> Self {
        Line {
            transport,
            decoder: Decoder::new(),
            sequence: Sequence::default(),
            gaps: GapCounter::default(),
            input: Vec::new(),
            frame: Vec::new(),
            tape: Vec::new(),
            cuts: Vec::new(),
        }
    }

    /// Frames of the robot that did not arrive.
    pub fn lost(&self) -> u32 {
        self.gaps.lost()
    }

    fn note(&mut self, direction: Direction, bytes: &[u8]) {
        self.tape.extend_from_slice(bytes);
        self.cuts.push((direction, self.tape.len()));
    }

    /// Decodes one byte; a whole frame, good or not, goes onto the tape.
    fn push(&mut self, byte: u8) -> Option<Result<RobotMessage, LinkError>> {
        self.frame.push(byte);
        let decoded = self.decoder.push::<RobotMessage>(byte);
        if byte == 0 || self.frame.len() > LONGEST_GARBAGE {
            let frame = core::mem::take(&mut self.frame);
            self.note(Direction::ToHost, &frame);
        }
        Some(decoded?.map_err(LinkError::Garbled).map(|(number, message)| {
            self.gaps.arrived(number);
            message
        }))
    }

    /// Reads until `request` is answered; telemetry on the way is kept, what follows the answer stays for the next call.
    fn await_answer(&mut self, request: &HostMessage) -> Result<Answer, LinkError> {
        let mut telemetry = None;
        loop {
            if self.input.is_empty() {
                self.transport.read(&mut self.input)?;
            }
            let mut input = core::mem::take(&mut self.input).into_iter();
            while let Some(byte) = input.next() {
                let Some(message) = self.push(byte) else { continue };
                if let Ok(RobotMessage::Telemetry(state)) = message {
                    telemetry = Some(state);
                }
                match message {
                    Ok(message) if !request.is_answered_by(&message) => {}
                    done => {
                        self.input = input.collect();
                        return done.map(|message| Answer { message, telemetry });
                    }
                }
            }
        }
    }
}

impl<T: Transport> Link for Line<T> {
    fn request(&mut self, message: &HostMessage) -> Result<Answer, LinkError> {
        let mut buffer = [0; MAX_FRAME];
        // Every message of the protocol fits: its tests say so.
        let bytes = encode(self.sequence.take(), message, &mut buffer).ok_or(LinkError::NoAnswer)?;
        self.transport.write(bytes)?;
        self.note(Direction::ToRobot, bytes);
        self.await_answer(message)
    }

    fn drain_frames(&mut self, sink: &mut dyn FnMut(Direction, &[u8])) {
        let mut start = 0;
        for (direction, end) in self.cuts.drain(..) {
            sink(direction, &self.tape[start..end]);
            start = end;
        }
        self.tape.clear();
    }
}
