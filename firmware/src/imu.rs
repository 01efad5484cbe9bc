//! The inertial sensor, an ICM-42688-P on SPI (TDK DS-000347, revision 1.6): set up and read one transaction at a time, so
//! that a servo tick never waits for it.
//!
//! A chip that falls silent, resets by itself or loses its settings is set up again from the start; until then it gives no
//! readings, and [`crate::safety`] finds it stale. A transaction that is lost or garbled costs one reading and no more.

use embedded_hal_async::spi::SpiDevice;

use crate::axes::ImuCounts;

/// Registers of bank 0 (DS-000347, section 14); the last one is in every bank.
mod register {
    pub const DEVICE_CONFIG: u8 = 0x11;
    pub const ACCEL_DATA_X1: u8 = 0x1F;
    pub const PWR_MGMT0: u8 = 0x4E;
    pub const GYRO_CONFIG0: u8 = 0x4F;
    pub const ACCEL_CONFIG0: u8 = 0x50;
    pub const GYRO_ACCEL_CONFIG0: u8 = 0x52;
    pub const INT_SOURCE0: u8 = 0x65;
    pub const WHO_AM_I: u8 = 0x75;
    pub const REG_BANK_SEL: u8 = 0x76;
}

/// First bit of a transaction that reads (section 9.6).
const READ: u8 = 0x80;
/// What `WHO_AM_I` says (section 14.58).
const IDENTITY: u8 = 0x47;
/// `DEVICE_CONFIG`: soft reset (section 14.1).
const SOFT_RESET: u8 = 0x01;
/// `INT_STATUS`, the last byte of a reading: a new sample, and a reset since it was last read (section 14.21).
const DATA_READY: u8 = 0x08;
const RESET_DONE: u8 = 0x10;
/// Registers of one reading: six of the accelerometer, six of the gyroscope, two of the time stamp, `INT_STATUS`.
const READING: usize = 15;

/// The settings, in the order in which they are written, and read back.
const SETTINGS: [(u8, u8); 5] = [
    // A new sample is an interrupt, if only in INT_STATUS: no pin is wired (section 14.51).
    (register::INT_SOURCE0, DATA_READY | RESET_DONE),
    // ±2000 °/s at 1 kHz (section 14.37).
    (register::GYRO_CONFIG0, 0x06),
    // ±4 g at 1 kHz (section 14.38).
    (register::ACCEL_CONFIG0, 0x46),
    // Bandwidth of both a quarter of the rate (section 14.40).
    (register::GYRO_ACCEL_CONFIG0, 0x11),
    // Both on, in low-noise mode (section 14.36).
    (register::PWR_MGMT0, 0x0F),
];
/// The setting that a reset surely changes.
const POWER: usize = SETTINGS.len() - 1;

/// Ticks after a soft reset: 1 ms at least (section 14.1).
const AFTER_RESET: u8 = 3;
/// Ticks after the sensors are switched on: the gyroscope needs 30 ms (table 1), and its first samples are not to be used.
const AFTER_START: u8 = 60;
/// Ticks between two attempts at a chip that does not answer.
const RETRY: u8 = 20;
/// Readings between two looks at one of the settings.
const LOOK: u16 = 500;
/// Looks in a row at a setting that is wrong after which the chip is set up again: as many as make the sensor stale, so a burst
/// of lost transactions that the robot can do without never ends in a set-up, which takes longer than that.
const DOUBTS: u8 = 5;
/// Ticks in a row without a new sample after which the chip is set up again.
const PATIENCE: u8 = 20;

/// The chip behind a chip select.
#[derive(Debug)]
pub struct Icm42688p<SPI> {
    spi: SPI,
    phase: Phase,
    /// Ticks to wait before the next transaction.
    wait: u8,
    /// Ticks in a row without a new sample.
    silent: u8,
    /// Readings until the next look at a setting.
    look: u16,
    /// Which setting is looked at next, and how often in a row it was wrong.
    setting: usize,
    doubts: u8,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    /// Back to bank 0, wherever a garbled transaction has led.
    Bank,
    Reset,
    Identify,
    Write(usize),
    Verify(usize),
    /// The reset of the set-up is still noted in `INT_STATUS` and is no news.
    Clear,
    Running,
}

impl<SPI: SpiDevice> Icm42688p<SPI> {
    /// The chip as it comes: it is set up by the first ticks.
    pub fn new(spi: SPI) -> Self {
        Icm42688p { spi, phase: Phase::Bank, wait: 0, silent: 0, look: LOOK, setting: 0, doubts: 0 }
    }

    /// Whether the chip is set up.
    pub fn is_running(&self) -> bool {
        self.phase == Phase::Running
    }

    /// One servo tick, one transaction at most: a new reading, if there is one. The future may be dropped half way, as when
    /// the bus hangs; the tick then counts as one without a sample.
    pub async fn tick(&mut self) -> Option<ImuCounts> {
        if self.phase == Phase::Running {
            return self.run().await;
        }
        if self.wait > 0 {
            self.wait -= 1;
            return None;
        }
        let next = match self.phase {
            Phase::Bank => self.write(register::REG_BANK_SEL, 0).await.then_some((Phase::Reset, 0)),
            Phase::Reset => {
                self.write(register::DEVICE_CONFIG, SOFT_RESET).await.then_some((Phase::Identify, AFTER_RESET))
            }
            Phase::Identify => self.reads(register::WHO_AM_I, IDENTITY).await.then_some((Phase::Write(0), 0)),
            Phase::Write(i) => {
                let (address, value) = SETTINGS[i];
                let next = if i == POWER { (Phase::Verify(0), AFTER_START) } else { (Phase::Write(i + 1), 0) };
                self.write(address, value).await.then_some(next)
            }
            Phase::Verify(i) => {
                let (address, value) = SETTINGS[i];
                let next = if i == POWER { Phase::Clear } else { Phase::Verify(i + 1) };
                self.reads(address, value).await.then_some((next, 0))
            }
            Phase::Clear => self.reading().await.map(|_| (Phase::Running, 0)),
            Phase::Running => None,
        };
        match next {
            Some((phase, wait)) => (self.phase, self.wait) = (phase, wait),
            None => self.start_over(),
        }
        None
    }

    async fn run(&mut self) -> Option<ImuCounts> {
        self.silent += 1;
        if self.silent > PATIENCE {
            self.start_over();
            return None;
        }
        if self.look == 0 {
            self.look_at_a_setting().await;
            return None;
        }
        self.look -= 1;
        let reading = self.reading().await?;
        let status = reading[READING - 1];
        // A bus that is stuck reads one and the same bit everywhere; no status has all of them.
        if status == 0xFF || status & (DATA_READY | RESET_DONE) == 0 {
            return None;
        }
        if status & RESET_DONE != 0 {
            (self.look, self.setting) = (0, POWER);
            return None;
        }
        self.silent = 0;
        let word = |i: usize| i16::from_be_bytes([reading[2 * i], reading[2 * i + 1]]);
        Some(ImuCounts { accelerometer: [word(0), word(1), word(2)], gyroscope: [word(3), word(4), word(5)] })
    }

    /// Looks at one setting, and at the same one in the next tick if it is not what it should be.
    async fn look_at_a_setting(&mut self) {
        let (address, value) = SETTINGS[self.setting];
        if self.reads(address, value).await {
            self.setting = (self.setting + 1) % SETTINGS.len();
            (self.look, self.doubts) = (LOOK, 0);
        } else {
            self.doubts += 1;
            if self.doubts == DOUBTS {
                self.start_over();
            }
        }
    }

    fn start_over(&mut self) {
        (self.phase, self.wait) = (Phase::Bank, RETRY);
        (self.silent, self.look, self.doubts) = (0, LOOK, 0);
    }

    /// Accelerometer, gyroscope and status, unless the bus failed.
    async fn reading(&mut self) -> Option<[u8; READING]> {
        let mut bytes = [0; READING + 1];
        bytes[0] = READ | register::ACCEL_DATA_X1;
        self.spi.transfer_in_place(&mut bytes).await.ok()?;
        let mut reading = [0; READING];
        reading.copy_from_slice(&bytes[1..]);
        Some(reading)
    }

    /// Whether a register reads `value`.
    async fn reads(&mut self, address: u8, value: u8) -> bool {
        let mut bytes = [READ | address, 0];
        self.spi.transfer_in_place(&mut bytes).await.is_ok() && bytes[1] == value
    }

    /// Writes a register; whether the bus did not fail, which says nothing of the chip.
    async fn write(&mut self, address: u8, value: u8) -> bool {
        self.spi.transfer_in_place(&mut [address, value]).await.is_ok()
    }
}
