//! A board on the desk: it lies still at the end of its cable, and what it is to sense comes in frames.

use super::{Board, LinkError, Transport};
use protocol::message::Transducers;

/// What a board senses that lies still, its second slider upright.
const LYING: Transducers = Transducers { accelerometer: [0, 0, 8192], gyroscope: [0; 3], encoder: [0; 2] };
/// Servo periods after a request in which its answer begins, or it was lost.
const PATIENCE: u32 = 60;

/// A board at the end of its cable. Its time passes only while an answer is waited for.
#[derive(Debug)]
pub struct Tethered<B> {
    board: B,
    /// On their way to the robot.
    outbox: Vec<u8>,
    /// Servo periods since the last request, or since one was given up.
    waited: u32,
}

impl<B: Board> Tethered<B> {
    /// Puts `board` on the desk.
    pub fn new(board: B) -> Self {
        Tethered { board, outbox: Vec::new(), waited: 0 }
    }

    /// The board itself.
    pub fn board_mut(&mut self) -> &mut B {
        &mut self.board
    }
}

impl<B: Board> Transport for Tethered<B> {
    fn write(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        self.outbox.extend_from_slice(bytes);
        self.waited = 0;
        Ok(())
    }

    fn read(&mut self, buffer: &mut Vec<u8>) -> Result<(), LinkError> {
        let before = buffer.len();
        while self.waited < PATIENCE {
            self.waited += 1;
            self.board.tick(&LYING, &std::mem::take(&mut self.outbox), buffer)?;
            if buffer.len() > before {
                return Ok(());
            }
        }
        self.waited = 0;
        Err(LinkError::NoAnswer)
    }
}
