//! How a message goes over a wire.
//!
//! ```text
//! frame    = COBS( sequence | message | crc ) 00
//! sequence   u16, little endian: counts every frame of one direction, wraps
//! message    postcard form of HostMessage or RobotMessage
//! crc        CRC-32/ISO-HDLC of sequence and message, little endian
//! ```
//!
//! COBS leaves no zero byte in a frame, so a zero byte always ends one: after garbage the decoder is in step again with
//! the first zero byte, and loses at most the frame that the garbage touched. A leading zero byte, sent by whoever has
//! just opened a line, ends the garbage before it; empty frames are skipped.
//!
//! A host that gets no answer sends the same frame again, with the same number. The robot then repeats its answer and
//! does not carry out the message a second time: a lost byte costs time and nothing else. The host's `Hello` is always
//! carried out, and begins the host's numbers anew. The robot's takes its number in the row, since a robot goes on
//! counting whoever listens; only a robot that starts begins at 0.

use crc::{CRC_32_ISO_HDLC, Crc, Table};
use heapless::Vec;
use serde::{Serialize, de::DeserializeOwned};

use crate::message::{HostMessage, RobotMessage};

/// No frame is longer than this, delimiter included; a longer one is garbage.
pub const MAX_FRAME: usize = 128;

static CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// Bytes of sequence number and checksum around the message.
const SEQUENCE_BYTES: usize = 2;
const CRC_BYTES: usize = 4;

/// What was wrong with the bytes between two delimiters. The decoder has dropped them and is in step again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// More than [`MAX_FRAME`] bytes without a delimiter: not our protocol, or a lost delimiter.
    TooLong,
    /// Not a COBS code, or too short for a frame: bytes were lost or changed.
    Broken,
    /// The checksum does not match: bytes were changed.
    Checksum,
    /// The checksum matches, but no message of this version has this form: the other side is another build.
    UnknownMessage,
}

impl core::fmt::Display for FrameError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            FrameError::TooLong => "no end of frame: not the barrel's protocol, or the wrong baud rate",
            FrameError::Broken => "bytes lost within a frame",
            FrameError::Checksum => "bytes changed within a frame",
            FrameError::UnknownMessage => "a message this build does not know: update host and firmware to one version",
        })
    }
}

impl core::error::Error for FrameError {}

/// CRC-32/ISO-HDLC of some bytes. One function for all that have it: it is unrolled, and large where flash is small.
#[inline(never)]
pub fn checksum(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// Writes one frame into `buffer` and returns the part used, or `None` if it does not fit
/// (never with a buffer of [`MAX_FRAME`] and the messages of this crate).
pub fn encode<'b, M: Serialize>(sequence: u16, message: &M, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
    // One pass for the message, one for the checksum, one for COBS, all in place: that takes the
    // microcontroller far less than doing all three byte by byte.
    let (first, plain) = buffer.split_first_mut()?;
    let (number, message_and_crc) = plain.split_first_chunk_mut::<SEQUENCE_BYTES>()?;
    *number = sequence.to_le_bytes();
    let body = SEQUENCE_BYTES + postcard::to_slice(message, message_and_crc).ok()?.len();
    let end = body + CRC_BYTES;
    let crc = checksum(plain.get(..body)?);
    plain.get_mut(body..end)?.copy_from_slice(&crc.to_le_bytes());
    *plain.get_mut(end)? = 0;
    *first = stuff(plain.get_mut(..end).filter(|plain| plain.len() <= LONGEST_RUN)?);
    buffer.get(..end + 2)
}

/// Without a zero in so many bytes COBS puts no code of its own between them.
const LONGEST_RUN: usize = 253;

/// COBS of a piece that is not too long for it to be the same length (S. Cheshire and M. Baker, "Consistent overhead byte
/// stuffing", IEEE/ACM Trans. Networking 7 (1999)): every zero becomes the distance to the next one, the end counting as one.
/// Returns the distance to the first from the byte before.
fn stuff(plain: &mut [u8]) -> u8 {
    let mut distance: u8 = 1;
    let byte_by_byte = |bytes: &mut [u8], distance: &mut u8| {
        for byte in bytes.iter_mut().rev() {
            if *byte == 0 {
                *byte = core::mem::replace(distance, 0);
            }
            *distance = distance.wrapping_add(1);
        }
    };
    // Four at a time, as most of them have no zero among them.
    let (first, words) = plain.as_rchunks_mut::<4>();
    for word in words.iter_mut().rev() {
        if has_zero(u32::from_ne_bytes(*word)) {
            byte_by_byte(word, &mut distance);
        } else {
            distance = distance.wrapping_add(4);
        }
    }
    byte_by_byte(first, &mut distance);
    distance
}

/// Whether one of the four bytes of a word is 0: only there does a subtraction of 1 borrow into a highest bit that was clear.
fn has_zero(word: u32) -> bool {
    word.wrapping_sub(0x0101_0101) & !word & 0x8080_8080 != 0
}

/// Numbers the frames of one direction.
#[derive(Clone, Debug, Default)]
pub struct Sequence(u16);

impl Sequence {
    /// Takes the number of the next frame.
    pub fn take(&mut self) -> u16 {
        let number = self.0;
        self.0 = self.0.wrapping_add(1);
        number
    }
}

/// Follows the frames' numbers of one direction: counts those that did not arrive, and knows one that came again. A lost
/// frame that arrives after all, because its sender was asked once more, is no longer lost.
#[derive(Clone, Debug, Default)]
pub struct Numbering {
    expected: Option<u16>,
    /// Which of the last frames have arrived: bit n for number `expected − 1 − n`.
    recent: u32,
    lost: u32,
}

/// What a frame's number says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrival {
    /// A new frame, and so many were lost just before it.
    New {
        /// Frames lost.
        lost: u16,
    },
    /// One of the last few frames once more: its sender did not hear that it had arrived.
    Again,
    /// The sender has begun its numbers anew.
    Restarted,
}

/// A number this little behind the expected one is of a recent frame; further behind, the sender has started afresh.
const RECENT: u16 = u32::BITS as u16;

impl Numbering {
    /// Notes an arrived frame.
    pub fn arrived(&mut self, sequence: u16) -> Arrival {
        let Some(expected) = self.expected else {
            self.begin(sequence);
            return Arrival::New { lost: 0 };
        };
        let ahead = sequence.wrapping_sub(expected);
        if ahead >= RECENT.wrapping_neg() {
            let bit = 1 << (u16::MAX - ahead);
            if self.recent & bit != 0 {
                return Arrival::Again;
            }
            self.recent |= bit;
            self.lost = self.lost.saturating_sub(1);
            return Arrival::New { lost: 0 };
        }
        if ahead > u16::MAX / 2 {
            self.begin(sequence);
            return Arrival::Restarted;
        }
        self.expected = Some(sequence.wrapping_add(1));
        self.recent = self.recent.checked_shl(u32::from(ahead) + 1).unwrap_or(0) | 1;
        self.lost = self.lost.saturating_add(u32::from(ahead));
        Arrival::New { lost: ahead }
    }

    /// Notes an arrived frame and what is in it. A host's hello begins its numbers anew. A robot's is one of its frames
    /// as any other, but it is never repeated: one whose number has passed is of a robot that was reset.
    pub fn heard<M: Opens>(&mut self, sequence: u16, message: &M) -> Arrival {
        let passed = self.expected.is_some_and(|expected| sequence.wrapping_sub(expected) > u16::MAX / 2);
        if message.opens() && (M::ANEW || passed) {
            self.begin(sequence);
            return Arrival::Restarted;
        }
        self.arrived(sequence)
    }

    /// Takes this frame as the first of a new sender. What was numbered before it counts as arrived.
    pub fn begin(&mut self, sequence: u16) {
        self.expected = Some(sequence.wrapping_add(1));
        self.recent = u32::MAX;
    }

    /// Frames lost so far.
    pub fn lost(&self) -> u32 {
        self.lost
    }
}

/// Whether a message opens a conversation.
pub trait Opens {
    /// Whether its sender's numbers begin anew with it: its frame's number then says nothing of those before.
    const ANEW: bool;

    /// Whether it is a hello.
    fn opens(&self) -> bool;
}

impl Opens for HostMessage {
    const ANEW: bool = true;

    fn opens(&self) -> bool {
        matches!(self, HostMessage::Hello { .. })
    }
}

impl Opens for RobotMessage {
    const ANEW: bool = false;

    fn opens(&self) -> bool {
        matches!(self, RobotMessage::Hello { .. })
    }
}

/// Cuts a stream of bytes into messages.
#[derive(Clone, Debug, Default)]
pub struct Decoder {
    buffer: Vec<u8, MAX_FRAME>,
    overflowed: bool,
}

impl Decoder {
    /// A decoder that waits for its first frame.
    pub const fn new() -> Self {
        Decoder { buffer: Vec::new(), overflowed: false }
    }

    /// Takes one byte; at the end of a frame returns its sequence number and message, or what was wrong with it.
    pub fn push<M: DeserializeOwned>(&mut self, byte: u8) -> Option<Result<(u16, M), FrameError>> {
        if byte != 0 {
            self.overflowed |= self.buffer.push(byte).is_err();
            return None;
        }
        let result = if self.overflowed {
            Err(FrameError::TooLong)
        } else if self.buffer.is_empty() {
            return None;
        } else {
            open(&mut self.buffer)
        };
        self.buffer.clear();
        self.overflowed = false;
        Some(result)
    }
}

/// Undoes COBS in place, checks the checksum and reads the message.
fn open<M: DeserializeOwned>(frame: &mut [u8]) -> Result<(u16, M), FrameError> {
    let length = cobs::decode_in_place(frame).map_err(|_| FrameError::Broken)?;
    let frame = frame.get(..length).ok_or(FrameError::Broken)?;
    let (body, crc) = frame.split_last_chunk::<CRC_BYTES>().ok_or(FrameError::Broken)?;
    let (sequence, message) = body.split_first_chunk::<SEQUENCE_BYTES>().ok_or(FrameError::Broken)?;
    if checksum(body) != u32::from_le_bytes(*crc) {
        return Err(FrameError::Checksum);
    }
    match postcard::take_from_bytes(message) {
        Ok((message, [])) => Ok((u16::from_le_bytes(*sequence), message)),
        _ => Err(FrameError::UnknownMessage),
    }
}
