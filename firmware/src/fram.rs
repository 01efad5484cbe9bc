//! The memory of parameters and calibration: an FM25V02, 32 KiB of ferroelectric RAM on SPI (Cypress 001-84494,
//! revision G), or the FM25V02A that replaces it and differs, for a driver, in its ID only (Cypress KBA96042).
//!
//! It writes at the speed of the bus, byte by byte as they arrive, without an erase and without ever being busy; a
//! power cut leaves what had arrived ([`crate::storage`] reckons with that). SPI mode 0 or 3, up to 40 MHz; it may be
//! selected 250 µs after its supply is up.

use embedded_hal::spi::{Operation, SpiDevice};

use crate::storage::{ATTEMPTS, Memory, MemoryError};

/// Bytes in the chip.
pub const SIZE: u16 = 0x8000;

/// What the chip answers to RDID (table 6): six continuation codes, the maker, family and density; a revision follows.
pub const DEVICE_ID: [u8; 8] = [0x7F, 0x7F, 0x7F, 0x7F, 0x7F, 0x7F, 0xC2, 0x22];
/// Revisions that the driver knows: FM25V02 and FM25V02A.
pub const REVISIONS: [u8; 2] = [0x00, 0x08];

/// Opcodes, table 1.
const WREN: u8 = 0x06;
const RDSR: u8 = 0x05;
const READ: u8 = 0x03;
const WRITE: u8 = 0x02;
const RDID: u8 = 0x9F;

/// Status register, tables 2 and 3: the write enable latch, and the bits that always read 0.
const WEL: u8 = 1 << 1;
const FIXED: u8 = 0b0111_0001;

/// The driver, on a bus of its own or shared.
#[derive(Debug)]
pub struct Fram<SPI> {
    spi: SPI,
}

impl<SPI: SpiDevice> Fram<SPI> {
    /// Asks the chip who it is.
    ///
    /// # Errors
    /// [`MemoryError::NoAnswer`]: no chip, or another one.
    pub fn probe(spi: SPI) -> Result<Self, MemoryError> {
        let mut fram = Fram { spi };
        for _ in 0..ATTEMPTS {
            let mut answer = [0; DEVICE_ID.len() + 1];
            fram.run(&mut [Operation::Write(&[RDID]), Operation::Read(&mut answer)])?;
            let [id @ .., revision] = answer;
            if id == DEVICE_ID && REVISIONS.contains(&revision) {
                return Ok(fram);
            }
        }
        Err(MemoryError::NoAnswer)
    }

    /// One command, from chip select low to high.
    fn run(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), MemoryError> {
        self.spi.transaction(operations).map_err(|_| MemoryError::NoAnswer)
    }

    /// Sets the write enable latch, which every write clears again, and sees that it is set: nothing else in a write
    /// would show that the chip is there.
    fn enable_write(&mut self) -> Result<(), MemoryError> {
        for _ in 0..ATTEMPTS {
            self.run(&mut [Operation::Write(&[WREN])])?;
            let mut status = [0];
            self.run(&mut [Operation::Write(&[RDSR]), Operation::Read(&mut status)])?;
            if status[0] & (WEL | FIXED) == WEL {
                return Ok(());
            }
        }
        Err(MemoryError::NoAnswer)
    }
}

/// Refuses what would go round the end of the chip to its start.
fn check_bounds(address: u16, length: usize) -> Result<(), MemoryError> {
    if usize::from(address) + length <= usize::from(SIZE) { Ok(()) } else { Err(MemoryError::OutOfBounds) }
}

impl<SPI: SpiDevice> Memory for Fram<SPI> {
    fn read(&mut self, address: u16, buffer: &mut [u8]) -> Result<(), MemoryError> {
        check_bounds(address, buffer.len())?;
        let [high, low] = address.to_be_bytes();
        self.run(&mut [Operation::Write(&[READ, high, low]), Operation::Read(buffer)])
    }

    fn write(&mut self, address: u16, bytes: &[u8]) -> Result<(), MemoryError> {
        check_bounds(address, bytes.len())?;
        self.enable_write()?;
        let [high, low] = address.to_be_bytes();
        self.run(&mut [Operation::Write(&[WRITE, high, low]), Operation::Write(bytes)])
    }
}
