//! A robot at the other end of a line, over any transport of bytes: requests and answers in lock-step.

use super::{Answer, Direction, Link, LinkError, Wire};
use protocol::{FrameError, HostMessage, RobotMessage};
use std::collections::VecDeque;

/// How often a request is sent before the robot is taken to be deaf.
const ATTEMPTS: u32 = 4;

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

/// A robot at the other end of a line.
#[derive(Debug)]
pub struct Line<T> {
    transport: T,
    wire: Wire,
    /// Bytes read but not yet decoded.
    input: VecDeque<u8>,
    /// What the robot said without being asked.
    unasked: VecDeque<RobotMessage>,
}

/// Unasked messages that are kept for [`Line::listen`]; older ones give way.
const KEPT: usize = 1024;

impl<T: Transport> Line<T> {
    /// Speaks to the robot behind `transport`.
    pub fn new(transport: T) -> Self {
        Line { transport, wire: Wire::default(), input: VecDeque::new(), unasked: VecDeque::new() }
    }

    /// Frames of the robot that did not arrive.
    pub fn lost(&self) -> u32 {
        self.wire.lost()
    }

    /// Frames of the robot that arrived garbled.
    pub fn garbled(&self) -> u32 {
        self.wire.garbled()
    }

    /// The transport itself.
    pub fn transport_mut(&mut self) -> &mut T {
        &mut self.transport
    }

    /// The next thing that the robot says by itself; `None` if it says nothing within the transport's time limit.
    ///
    /// # Errors
    /// A transport that is gone. Garbage is counted and passed over.
    pub fn listen(&mut self) -> Result<Option<RobotMessage>, LinkError> {
        loop {
            if let Some(message) = self.unasked.pop_front() {
                return Ok(Some(message));
            }
            match self.next() {
                Ok(message) => return Ok(Some(message)),
                Err(LinkError::NoAnswer) => return Ok(None),
                Err(LinkError::Garbled(_)) => {}
                Err(error) => return Err(error),
            }
        }
    }

    /// The next message that arrives.
    fn next(&mut self) -> Result<RobotMessage, LinkError> {
        loop {
            while let Some(byte) = self.input.pop_front() {
                if let Some(message) = self.wire.push(byte) {
                    return message.map_err(LinkError::Garbled);
                }
            }
            let mut arrived = Vec::new();
            self.transport.read(&mut arrived)?;
            self.input.extend(arrived);
        }
    }

    /// Waits until `request` is answered or nothing more comes; telemetry before the answer belongs to it.
    fn await_answer(&mut self, request: &HostMessage, garbled: &mut Option<FrameError>) -> Result<Answer, LinkError> {
        let mut telemetry = None;
        loop {
            match self.next() {
                Ok(message) => {
                    if let RobotMessage::Telemetry(state) = message {
                        telemetry = Some(state);
                    }
                    if request.is_answered_by(&message) {
                        return Ok(Answer { message, telemetry });
                    }
                    if self.unasked.len() == KEPT {
                        self.unasked.pop_front();
                    }
                    self.unasked.push_back(message);
                }
                // It may have been the answer: if no other comes, it is asked for again.
                Err(LinkError::Garbled(error)) => *garbled = Some(error),
                Err(error) => return Err(error),
            }
        }
    }
}

impl<T: Transport> Link for Line<T> {
    fn request(&mut self, message: &HostMessage) -> Result<Answer, LinkError> {
        let frame = self.wire.frame(message);
        let mut garbled = None;
        for _ in 0..ATTEMPTS {
            self.transport.write(&frame)?;
            self.wire.sent(&frame);
            match self.await_answer(message, &mut garbled) {
                Err(LinkError::NoAnswer) => {}
                done => return done,
            }
        }
        Err(garbled.map_or(LinkError::NoAnswer, LinkError::Garbled))
    }

    fn drain_frames(&mut self, sink: &mut dyn FnMut(Direction, &[u8])) {
        self.wire.drain(sink);
    }
}
