//! A robot at the other end of a line, over any transport of bytes: requests and answers in lock-step.

use super::{Answer, Direction, Link, LinkError, Wire};
use protocol::message::Vitals;
use protocol::{FrameError, HostMessage, RobotMessage, Telemetry};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// How often a request is sent before the robot is taken to be deaf. On a line that loses one byte in 200 every second
/// of the longest exchanges fails, which are of 140 bytes; and who waits for a robot that is not there waits this many
/// times the transport's patience.
const ATTEMPTS: u32 = 24;

/// Something that carries bytes to a robot and back.
pub trait Transport {
    /// Sends all of `bytes`.
    fn write(&mut self, bytes: &[u8]) -> Result<(), LinkError>;

    /// Appends what has arrived to `buffer`; waits for at least one byte, within the transport's own time limit.
    ///
    /// # Errors
    /// [`LinkError::NoAnswer`] when nothing comes.
    fn read(&mut self, buffer: &mut Vec<u8>) -> Result<(), LinkError>;

    /// How long an answer may take, whatever else arrives meanwhile. `None` where what has not come will not come.
    fn patience(&self) -> Option<Duration> {
        None
    }
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
    /// The last that were among them.
    vitals: Option<Vitals>,
}

/// Unasked messages that are kept for [`Line::listen`]; older ones give way.
const KEPT: usize = 1024;

impl<T: Transport> Line<T> {
    /// Speaks to the robot behind `transport`.
    pub fn new(transport: T) -> Self {
        Line { transport, wire: Wire::default(), input: VecDeque::new(), unasked: VecDeque::new(), vitals: None }
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
        let until = self.until();
        loop {
            if let Some(message) = self.unasked.pop_front() {
                return Ok(Some(message));
            }
            match self.next(until) {
                Ok(Heard::Message(message)) => return Ok(Some(message)),
                Err(LinkError::NoAnswer) => return Ok(None),
                Ok(Heard::Garbage(_) | Heard::Again) => {}
                Err(error) => return Err(error),
            }
        }
    }

    /// What the robot has said by itself and was heard already, while an answer was waited for; the oldest first.
    pub fn overheard(&mut self) -> Option<RobotMessage> {
        self.unasked.pop_front()
    }

    /// When the transport's patience is at its end.
    fn until(&self) -> Option<Instant> {
        self.transport.patience().map(|patience| Instant::now() + patience)
    }

    /// The next frame that arrives.
    fn next(&mut self, until: Option<Instant>) -> Result<Heard, LinkError> {
        loop {
            while let Some(byte) = self.input.pop_front() {
                let repeated = self.wire.repeated();
                match self.wire.push(byte) {
                    Some(Ok(message)) => return Ok(Heard::Message(message)),
                    Some(Err(error)) => return Ok(Heard::Garbage(error)),
                    None if self.wire.repeated() != repeated => return Ok(Heard::Again),
                    None => {}
                }
            }
            if until.is_some_and(|until| Instant::now() >= until) {
                return Err(LinkError::NoAnswer);
            }
            let mut arrived = Vec::new();
            match self.transport.read(&mut arrived) {
                Err(LinkError::NoAnswer) if until.is_some() => {}
                read => read?,
            }
            self.input.extend(arrived);
        }
    }

    /// Waits until `request` is answered or nothing more comes; telemetry before the answer belongs to it.
    fn await_answer(
        &mut self,
        request: &HostMessage,
        until: Option<Instant>,
        heard: &mut Exchange,
    ) -> Result<(), LinkError> {
        let garbled = self.garbled();
        loop {
            match self.next(until)? {
                Heard::Message(message) => {
                    if let RobotMessage::Telemetry(state) = message {
                        heard.telemetry = Some(state);
                    }
                    if request.is_answered_by(&message) {
                        heard.answer = Some(message);
                    } else {
                        self.keep(message);
                    }
                    if heard.answer.is_some() {
                        return Ok(());
                    }
                }
                // It may have been the answer: if no other comes, it is asked for again.
                Heard::Garbage(error) => heard.garbled = Some(error),
                // The whole answer once more, and nothing new in it.
                Heard::Again if heard.answer.is_some() && self.garbled() == garbled => {
                    heard.complete = true;
                    return Ok(());
                }
                Heard::Again => {}
            }
        }
    }

    fn keep(&mut self, message: RobotMessage) {
        if let RobotMessage::Vitals(vitals) = message {
            self.vitals = Some(vitals);
        }
        if self.unasked.len() == KEPT {
            self.unasked.pop_front();
        }
        self.unasked.push_back(message);
    }
}

/// What came out of the line.
enum Heard {
    Message(RobotMessage),
    /// Something that is no frame of the protocol.
    Garbage(FrameError),
    /// A frame that was heard before.
    Again,
}

/// What has been heard of the answer to a request.
#[derive(Default)]
struct Exchange {
    answer: Option<RobotMessage>,
    telemetry: Option<Telemetry>,
    /// There is nothing more to come.
    complete: bool,
    garbled: Option<FrameError>,
}

impl<T: Transport> Link for Line<T> {
    fn request(&mut self, message: &HostMessage) -> Result<Answer, LinkError> {
        let frame = self.wire.frame(message);
        let lost = self.lost();
        let mut heard = Exchange::default();
        for _ in 0..ATTEMPTS {
            self.transport.write(&frame)?;
            self.wire.sent(&frame);
            match self.await_answer(message, self.until(), &mut heard) {
                Ok(()) | Err(LinkError::NoAnswer) => {}
                Err(error) => return Err(error),
            }
            // A frame that was lost just before the answer may have been the brain's state: it is asked for again.
            let may_lack = matches!(message, HostMessage::Transducers(_)) && heard.telemetry.is_none();
            if heard.answer.is_some() && (heard.complete || !may_lack || self.lost() <= lost) {
                break;
            }
        }
        match (heard.answer, heard.garbled) {
            (Some(message), _) => Ok(Answer { message, telemetry: heard.telemetry }),
            (None, Some(error)) => Err(LinkError::Garbled(error)),
            (None, None) => Err(LinkError::NoAnswer),
        }
    }

    fn drain_frames(&mut self, sink: &mut dyn FnMut(Direction, &[u8])) {
        self.wire.drain(sink);
    }

    fn vitals(&self) -> Option<&Vitals> {
        self.vitals.as_ref()
    }
}
