//! The inertial sensor, an ICM-42688-P on SPI (TDK DS-000347): set up and read one transaction at a time, so that a servo
//! tick never waits for it.
//!
//! A chip that falls silent, resets by itself or loses its settings is set up again from the start; until then it gives no
//! readings, and [`crate::safety`] finds it stale.

use embedded_hal_async::spi::SpiDevice;

use crate::axes::ImuCounts;

/// Registers of bank 0 (DS-000347, section 14).
mod register {
    pub const DEVICE_CONFIG: u8 = 0x11;
    pub const ACCEL_DATA_X1: u8 = 0x1F;
    pub const PWR_MGMT0: u8 = 0x4E;
    pub const GYRO_CONFIG0: u8 = 0x4F;
    pub const ACCEL_CONFIG0: u8 = 0x50;
    pub const GYRO_ACCEL_CONFIG0: u8 = 0x52;
    pub const WHO_AM_I: u8 = 0x75;
}

/// First bit of a transaction that reads (section 9.6).
const READ: u8 = 0x80;
/// What `WHO_AM_I` says (section 14.48).
const IDENTITY: u8 = 0x47;
/// `DEVICE_CONFIG`: soft reset (section 14.1).
const SOFT_RESET: u8 = 0x01;
/// `INT_STATUS`, the last byte of a reading: a new sample, and a reset since it was last read (section 14.21).
const DATA_READY: u8 = 0x08;
const RESET_DONE: u8 = 0x10;
/// Registers of one reading: six of the accelerometer, six of the gyroscope, two of the time stamp, `INT_STATUS`.
const READING: usize = 15;

/// The settings, in the order in which they are written, and read back.
const SETTINGS: [(u8, u8); 4] = [
    // ±2000 °/s at 1 kHz (section 14.37).
    (register::GYRO_CONFIG0, 0x06),
    // ±4 g at 1 kHz (section 14.38).
    (register::ACCEL_CONFIG0, 0x46),
    // Bandwidth of both a quarter of the rate (section 14.40).
    (register::GYRO_ACCEL_CONFIG0, 0x11),
    // Both on, in low-noise mode (section 14.36).
    (register::PWR_MGMT0, 0x0F),
];

/// Ticks after a soft reset: 1 ms at least (section 14.1).
const AFTER_RESET: u8 = 3;
/// Ticks after the sensors are switched on: the gyroscope needs 30 ms (table 1), and its first samples are not to be used.
const AFTER_START: u8 = 60;
/// Ticks between two attempts at a chip that does not answer.
const RETRY: u8 = 100;
/// Readings between two looks at one of the settings.
const LOOK: u16 = 500;
/// Readings in a row without a new sample after which the chip is set up again.
const PATIENCE: u8 = 20;

/// The chip behind a chip select.
#[derive(Debug)]
pub struct Icm42688p<SPI> {
    spi: SPI,
    phase: Phase,
    /// Ticks to wait before the next transaction.
    wait: u8,
    /// Readings in a row without a new sample.
    silent: u8,
    /// Readings until the next look at a setting.
    look: u16,
    /// Which setting is looked at next.
    setting: usize,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    Reset,
    Identify,
    Write(usize),
    Verify(usize),
    Running,
}

impl<SPI: SpiDevice> Icm42688p<SPI> {
    /// The chip as it comes: it is set up by the first ticks.
    pub fn new(spi: SPI) -> Self {
        Icm42688p { spi, phase: Phase::Reset, wait: 0, silent: 0, look: LOOK, setting: 0 }
    }

    /// Whether the chip is set up.
    pub fn is_running(&self) -> bool {
        self.phase == Phase::Running && self.wait == 0
    }

    /// One servo tick, one transaction at most: a new reading, if there is one.
    pub async fn tick(&mut self) -> Option<ImuCounts> {
        if self.wait > 0 {
            self.wait -= 1;
            return None;
        }
        match self.phase {
            Phase::Running => return self.run().await,
            Phase::Reset => {
                if self.write(register::DEVICE_CONFIG, SOFT_RESET).await {
                    (self.phase, self.wait) = (Phase::Identify, AFTER_RESET);
                } else {
                    self.wait = RETRY;
                }
            }
            Phase::Identify => match self.register(register::WHO_AM_I).await {
                Some(IDENTITY) => self.phase = Phase::Write(0),
                _ => self.start_over(RETRY),
            },
            Phase::Write(i) => match SETTINGS.get(i) {
                Some(&(address, value)) => {
                    if self.write(address, value).await {
                        self.phase = Phase::Write(i + 1);
                    } else {
                        self.start_over(RETRY);
                    }
                }
                None => (self.phase, self.wait) = (Phase::Verify(0), AFTER_START),
            },
            Phase::Verify(i) => match SETTINGS.get(i) {
                Some(&(address, value)) => {
                    if self.register(address).await == Some(value) {
                        self.phase = Phase::Verify(i + 1);
                    } else {
                        self.start_over(RETRY);
                    }
                }
                None => {
                    // The reset that led here is no news.
                    let _ = self.reading().await;
                    (self.phase, self.silent, self.look) = (Phase::Running, 0, LOOK);
                }
            },
        }
        None
    }

    async fn run(&mut self) -> Option<ImuCounts> {
        self.look -= 1;
        if self.look == 0 {
            self.look = LOOK;
            let (address, value) = SETTINGS[self.setting % SETTINGS.len()];
            self.setting = (self.setting + 1) % SETTINGS.len();
            if self.register(address).await != Some(value) {
                self.start_over(0);
            }
            return None;
        }
        let Some(reading) = self.reading().await else {
            self.start_over(0);
            return None;
        };
        let status = reading[READING - 1];
        // A bus that is stuck reads one and the same bit everywhere; no status has all of them.
        let fresh = status & DATA_READY != 0 && status != 0xFF;
        if fresh && status & RESET_DONE != 0 {
            self.start_over(0);
            return None;
        }
        if !fresh {
            self.silent += 1;
            if self.silent > PATIENCE {
                self.start_over(RETRY);
            }
            return None;
        }
        self.silent = 0;
        let word = |i: usize| i16::from_be_bytes([reading[2 * i], reading[2 * i + 1]]);
        Some(ImuCounts { accelerometer: [word(0), word(1), word(2)], gyroscope: [word(3), word(4), word(5)] })
    }

    fn start_over(&mut self, wait: u8) {
        (self.phase, self.wait, self.silent) = (Phase::Reset, wait, 0);
    }

    async fn reading(&mut self) -> Option<[u8; READING]> {
        let mut bytes = [0; READING + 1];
        bytes[0] = READ | register::ACCEL_DATA_X1;
        self.spi.transfer_in_place(&mut bytes).await.ok()?;
        let mut reading = [0; READING];
        reading.copy_from_slice(&bytes[1..]);
        Some(reading)
    }

    async fn register(&mut self, address: u8) -> Option<u8> {
        let mut bytes = [READ | address, 0];
        self.spi.transfer_in_place(&mut bytes).await.ok()?;
        Some(bytes[1])
    }

    async fn write(&mut self, address: u8, value: u8) -> bool {
        self.spi.write(&[address, value]).await.is_ok()
    }
}
