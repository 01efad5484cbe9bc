//! Parameters and calibration that survive a power cut at any moment.
//!
//! The memory holds two slots, at addresses 0x0000 and 0x0400. The older one is written, so the newer one is whole
//! whenever the power goes; which one is newer is told by a sequence number, and whether one is whole by a checksum.
//! What is read after a cut is therefore the record before it or the record after it.
//!
//! It is an FRAM and not the chip's own flash, because that must be erased by sectors: the smallest takes a quarter to
//! half a second (16 KiB; STM32F429 data sheet), and a core that reads from the same bank stalls meanwhile (RM0090),
//! for hundreds of servo ticks. Flash also wears out, and a power cut during an erase leaves nothing to rely on. An
//! FRAM takes bytes at the speed of its bus, without an erase, and the virtual board has a model of it, so that cuts in
//! the middle of a write are tested on the whole firmware.
//!
//! One slot, numbers little endian:
//!
//! ```text
//! offset  bytes
//!      0      4  magic, "brl1"
//!      4      8  protocol::parameter::LAYOUT of the firmware that wrote it: which parameters, in which order
//!     12      2  layout of the calibration: 1
//!     14      4  sequence number: one more than that of the other slot, wraps
//!     18      2  length of the payload: 4 · (parameters + 24), or 0: nothing is stored, the defaults are in use
//!     20      …  payload: f32 each, bits kept exactly
//!                  every parameter, in the order of protocol::parameter::TABLE
//!                  accelerometer bias (3), scale (3); gyroscope bias (3), scale (3)
//!                  mounting (9), column by column; position (3)
//!   20+l      4  CRC-32/ISO-HDLC of all the bytes before
//! ```
//!
//! A slot is refused if anything in it is not as it should be: magic, length, checksum, a layout that is not this
//! firmware's, a number that is not finite or out of its range. The layouts say what the payload means and nothing more:
//! a calibration outlives a change of the messages. Reads and writes are tried [`ATTEMPTS`] times, since a bus may garble
//! one.

use protocol::frame::checksum;
use protocol::message::{MemoryState, Refusal};
use protocol::parameter::{BOUNDS, COUNT, Kind, LAYOUT};

use crate::attitude::ImuCalibration;

/// Bytes that the two slots take of the memory, from address 0.
pub const MEMORY_BYTES: u16 = 2 * SLOT_DISTANCE;

/// How often a slot is read before it counts as blank or unreadable, and written before the memory counts as broken.
pub const ATTEMPTS: usize = 3;

const SLOT_DISTANCE: u16 = 0x400;
const MAGIC: [u8; 4] = *b"brl1";
/// To be raised when the calibration's numbers become others, or mean something else.
const CALIBRATION_LAYOUT: u16 = 1;
const CALIBRATION_NUMBERS: usize = 24;
const PAYLOAD: usize = 4 * (COUNT + CALIBRATION_NUMBERS);
const HEADER: usize = 20;
const LENGTH: usize = HEADER - 2;
const SEQUENCE: usize = LENGTH - 4;
const CRC_BYTES: usize = 4;
const IMAGE: usize = HEADER + PAYLOAD + CRC_BYTES;
const _: () = assert!(IMAGE <= SLOT_DISTANCE as usize);

/// The bytes of one slot.
type Image = [u8; IMAGE];

/// A memory that keeps its bytes without power, and that can be cut off between any two of them.
pub trait Memory {
    /// Reads from `address` on.
    ///
    /// # Errors
    /// The memory does not answer, or does not reach that far.
    fn read(&mut self, address: u16, buffer: &mut [u8]) -> Result<(), MemoryError>;

    /// Writes from `address` on, in the order of the bytes.
    ///
    /// # Errors
    /// The memory does not answer or does not take the bytes, or does not reach that far.
    fn write(&mut self, address: u16, bytes: &[u8]) -> Result<(), MemoryError>;
}

/// Why something could not be read from a memory or written to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MemoryError {
    /// It does not answer as it should: no chip, another chip, or a broken line.
    NoAnswer,
    /// The memory does not reach that far.
    OutOfBounds,
    /// It answers, but what was to be written is not there.
    NotWritten,
    /// The record itself is wrong: a number is not finite or out of its range. Nothing was written.
    BadRecord,
}

impl From<MemoryError> for Refusal {
    /// What a host is told.
    fn from(error: MemoryError) -> Self {
        match error {
            MemoryError::BadRecord => Refusal::BadValue,
            MemoryError::NoAnswer | MemoryError::OutOfBounds | MemoryError::NotWritten => Refusal::NoMemory,
        }
    }
}

/// What is worth keeping over a power cut.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Every parameter, in the order of [`protocol::parameter::TABLE`]. Those of the simulator are kept, too, so that a
    /// parameter's place is its index.
    pub parameters: [f32; COUNT],
    /// Calibration of the inertial sensor.
    pub calibration: ImuCalibration,
}

impl Record {
    /// Whether every number is finite and in its range, and the mounting a rotation.
    pub fn is_sound(&self) -> bool {
        let parameters = self.parameters.iter().zip(BOUNDS).all(|(&value, parameter)| {
            // In single precision, as the value is: that nearest to a limit may lie just outside of it.
            let in_range = value >= parameter.min as f32 && value <= parameter.max as f32;
            in_range && (parameter.kind == Kind::Real || value == (value as i32) as f32)
        });
        let calibration = &self.calibration;
        let finite = calibration_numbers(calibration).iter().all(|number| number.is_finite());
        let mut scales = calibration.accelerometer_scale.iter().chain(calibration.gyroscope_scale.iter());
        parameters && finite && scales.all(|scale| (0.5..=2.0).contains(scale)) && is_rotation(calibration)
    }
}

/// Columns at right angles and of length 1 within 1 %, right-handed.
fn is_rotation(calibration: &ImuCalibration) -> bool {
    let mounting = &calibration.mounting;
    let deviation = mounting.tr_mul(mounting) - nalgebra::Matrix3::identity();
    deviation.iter().all(|entry| entry.abs() < 0.01) && mounting.determinant() > 0.0
}

/// What the memory holds, and the record if there is a valid one: the newer of two.
pub fn load(memory: &mut impl Memory) -> (MemoryState, Option<Record>) {
    let mut images = [[0; IMAGE]; 2];
    // A start cannot ask again later: what a bus that is too bad to tell has shown last is what there is.
    let Ok((slots, _)) = settled(memory, &mut images, &mut false) else { return (MemoryState::Absent, None) };
    match newest(slots) {
        Some(slot) => match decode(&images[slot]) {
            Some(record) => (MemoryState::Loaded, Some(record)),
            None => (MemoryState::Empty, None),
        },
        None if slots == [Slot::Blank; 2] => (MemoryState::Empty, None),
        None => (MemoryState::Unreadable, None),
    }
}

/// Writes a record into the older slot and reads it back.
///
/// # Errors
/// [`MemoryError::BadRecord`] if [`Record::is_sound`] does not hold; the others are the memory's. The record that was
/// there before stays the valid one after an error, unless the memory is broken.
pub fn save(memory: &mut impl Memory, record: &Record) -> Result<(), MemoryError> {
    if !record.is_sound() {
        return Err(MemoryError::BadRecord);
    }
    replace(memory, Some(record))
}

/// Empties the memory: writes that there is nothing, as safely as a record.
///
/// # Errors
/// Those of the memory; what was there before then stays.
pub fn forget(memory: &mut impl Memory) -> Result<(), MemoryError> {
    replace(memory, None)
}

fn replace(memory: &mut impl Memory, record: Option<&Record>) -> Result<(), MemoryError> {
    let mut images = [[0; IMAGE]; 2];
    let mut image = [0; IMAGE];
    let mut held = false;
    for _ in 0..ATTEMPTS {
        let (slots, agreed) = settled(memory, &mut images, &mut held)?;
        if !agreed {
            continue;
        }
        // The older one, and a number that makes it the newer.
        let (slot, sequence) = match newest(slots) {
            Some(newest) => (1 - newest, sequence(&images[newest]).wrapping_add(1)),
            None => (0, 0),
        };
        let length = encode(record, sequence, &mut image);
        memory.write(address(slot), &image[..length])?;
        // Not only that it is there: that it is what the next start will find. A bus that lost what was read before the
        // write has made an old number of it.
        if newest(survey(memory, &mut images)?) == Some(slot) && images[slot][..length] == image[..length] {
            return Ok(());
        }
    }
    Err(MemoryError::NotWritten)
}

/// What both slots hold, and whether that is certain; if not, the bus is too bad to tell.
///
/// It is if both are valid. A slot that is not valid may be torn, or the newest record, misread: that takes two surveys
/// in a row that found the same in both slots. What is torn is the same every time, what a bus garbles is not. Lost reads are the same, too, but the slots are read in turn: a burst that hides one of them
/// twice hides the other in between. The memory then looks empty, which is not believed once something valid was seen
/// in it (`held`), as a write leaves one valid slot alone. There remains a burst of nine lost reads or more that begins
/// before anything valid is read: no reading tells such a memory from an empty one.
fn settled(
    memory: &mut impl Memory,
    images: &mut [Image; 2],
    held: &mut bool,
) -> Result<([Slot; 2], bool), MemoryError> {
    let mut before = None;
    let mut slots = [Slot::Blank; 2];
    for _ in 0..=ATTEMPTS {
        slots = survey(memory, images)?;
        let is_held = newest(slots).is_some();
        *held |= is_held;
        let agreed = before == Some(slots) && is_held == *held;
        if agreed || matches!(slots, [Slot::Valid(_), Slot::Valid(_)]) {
            return Ok((slots, true));
        }
        before = Some(slots);
    }
    Ok((slots, false))
}

fn address(slot: usize) -> u16 {
    if slot == 0 { 0 } else { SLOT_DISTANCE }
}

/// What one slot holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Slot {
    /// All zeros or all ones: it was never written.
    Blank,
    /// Garbage, or of another layout; with a checksum of all that was read.
    Unreadable(u32),
    /// Something valid, under this sequence number.
    Valid(u32),
}

/// Reads both slots.
fn survey(memory: &mut impl Memory, images: &mut [Image; 2]) -> Result<[Slot; 2], MemoryError> {
    let mut slots = [Slot::Blank; 2];
    for (i, image) in images.iter_mut().enumerate() {
        for _ in 0..ATTEMPTS {
            memory.read(address(i), image)?;
            slots[i] = judge(image);
            // Also what looks blank is read again: so does a bus that nobody answers on.
            if matches!(slots[i], Slot::Valid(_)) {
                break;
            }
        }
    }
    Ok(slots)
}

fn judge(image: &Image) -> Slot {
    if image.iter().all(|&byte| byte == 0) || image.iter().all(|&byte| byte == 0xFF) {
        return Slot::Blank;
    }
    let whole = [HEADER, HEADER + PAYLOAD].into_iter().any(|end| {
        image[..LENGTH] == header(sequence(image))[..LENGTH]
            && image[LENGTH..HEADER] == ((end - HEADER) as u16).to_le_bytes()
            && image[end..end + CRC_BYTES] == checksum(&image[..end]).to_le_bytes()
    });
    if whole && decode(image).is_none_or(|record| record.is_sound()) {
        Slot::Valid(sequence(image))
    } else {
        Slot::Unreadable(checksum(image))
    }
}

/// The slot with the newer valid content; numbers wrap.
fn newest(slots: [Slot; 2]) -> Option<usize> {
    match slots {
        [Slot::Valid(first), Slot::Valid(second)] => Some(usize::from(second.wrapping_sub(first) < 1 << 31)),
        [Slot::Valid(_), _] => Some(0),
        [_, Slot::Valid(_)] => Some(1),
        _ => None,
    }
}

/// Magic, layouts and sequence number; the length is zero.
fn header(sequence: u32) -> [u8; HEADER] {
    let mut header = [0; HEADER];
    header[..4].copy_from_slice(&MAGIC);
    header[4..12].copy_from_slice(&LAYOUT.to_le_bytes());
    header[12..SEQUENCE].copy_from_slice(&CALIBRATION_LAYOUT.to_le_bytes());
    header[SEQUENCE..LENGTH].copy_from_slice(&sequence.to_le_bytes());
    header
}

fn sequence(image: &Image) -> u32 {
    u32::from_le_bytes([image[SEQUENCE], image[SEQUENCE + 1], image[SEQUENCE + 2], image[SEQUENCE + 3]])
}

/// Fills in the image of a slot and returns its length.
fn encode(record: Option<&Record>, sequence: u32, image: &mut Image) -> usize {
    image[..HEADER].copy_from_slice(&header(sequence));
    let mut end = HEADER;
    if let Some(record) = record {
        image[LENGTH..HEADER].copy_from_slice(&(PAYLOAD as u16).to_le_bytes());
        let numbers = record.parameters.iter().copied().chain(calibration_numbers(&record.calibration));
        for (bytes, number) in image[HEADER..HEADER + PAYLOAD].chunks_exact_mut(4).zip(numbers) {
            bytes.copy_from_slice(&number.to_le_bytes());
        }
        end += PAYLOAD;
    }
    let crc = checksum(&image[..end]).to_le_bytes();
    image[end..end + CRC_BYTES].copy_from_slice(&crc);
    end + CRC_BYTES
}

/// The record in a slot whose checksum is right; `None` if it says that there is none.
fn decode(image: &Image) -> Option<Record> {
    if image[LENGTH..HEADER] == [0, 0] {
        return None;
    }
    let mut numbers = image[HEADER..HEADER + PAYLOAD]
        .chunks_exact(4)
        .map(|bytes| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
    let mut next = || numbers.next().unwrap_or_default();
    let parameters = core::array::from_fn(|_| next());
    let mut calibration = ImuCalibration::default();
    for number in calibration_slices_mut(&mut calibration).into_iter().flatten() {
        *number = next();
    }
    Some(Record { parameters, calibration })
}

/// The numbers of a calibration, in the order in which they are stored.
fn calibration_numbers(calibration: &ImuCalibration) -> [f32; CALIBRATION_NUMBERS] {
    let mut copy = *calibration;
    let mut numbers = [0.0; CALIBRATION_NUMBERS];
    for (number, held) in numbers.iter_mut().zip(calibration_slices_mut(&mut copy).into_iter().flatten()) {
        *number = *held;
    }
    numbers
}

fn calibration_slices_mut(calibration: &mut ImuCalibration) -> [&mut [f32]; 6] {
    [
        calibration.accelerometer_bias.as_mut_slice(),
        calibration.accelerometer_scale.as_mut_slice(),
        calibration.gyroscope_bias.as_mut_slice(),
        calibration.gyroscope_scale.as_mut_slice(),
        calibration.mounting.as_mut_slice(),
        calibration.position.as_mut_slice(),
    ]
}
