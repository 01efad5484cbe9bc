//! The virtual board: the unmodified flash image on an emulated microcontroller, whose chips sense what they are told and
//! whose pins can be read. Time passes a millisecond at a time and only when it is asked to, so the same signals give the same
//! bytes.
//!
//! The emulator is `rigless`. Where it is not the part, and what is done about it: see [`VirtualBoard::gaps`] and `driver.rs`.

mod board;
mod driver;
mod fram;
mod wire;

pub use board::CORE_HZ;

use crate::link::{Board, LinkError};
use driver::{Command, Emulator, Reply};
use protocol::message::Transducers;
use std::fmt;
use std::path::{Path, PathBuf};

/// What the board's transducers are exposed to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Signals {
    /// What the inertial sensor is to read, at ±4 g and ±2000 °/s.
    pub accelerometer: [i16; 3],
    /// As above.
    pub gyroscope: [i16; 3],
    /// It is cut off its bus.
    pub imu_silent: bool,
    /// Where the encoders stand, in counts.
    pub encoder: [i32; 2],
    /// The stop button is pressed.
    pub stop_button: bool,
    /// The stop loop is open.
    pub stop_loop_open: bool,
    /// Supply of the motors, mV.
    pub battery_mv: u32,
}

impl Default for Signals {
    /// A barrel that lies still, its second slider upright.
    fn default() -> Self {
        Signals {
            accelerometer: [0, 0, 8192],
            gyroscope: [0; 3],
            imu_silent: false,
            encoder: [0; 2],
            stop_button: false,
            stop_loop_open: false,
            battery_mv: 12_000,
        }
    }
}

/// What a millisecond brought out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pins {
    /// What the motors get, −1…1: nothing while the drivers are not enabled.
    pub duty: [f32; 2],
    /// What the PWM and direction pins carry, enabled or not.
    pub pwm: [f32; 2],
    /// Whether the drivers are enabled.
    pub enabled: bool,
    /// Green, blue and red lamp.
    pub lamps: [bool; 3],
    /// What came out of the virtual COM port and of the radio.
    pub from_robot: [Vec<u8>; 2],
    /// Instructions executed in it.
    pub instructions: u64,
    /// Those from the reading of the encoders to the motors' new duties, if there was a servo tick.
    pub servo_instructions: Option<u64>,
    /// Resets since power-on.
    pub resets: usize,
    /// The power has gone in the middle of a write, as [`VirtualBoard::cut_fram_after`] wanted.
    pub fram_cut: bool,
}

/// Why the board does not go on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BoardError {
    /// The flash image cannot be used.
    Image {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The emulator gave up, or could not do what it was asked.
    Emulator(String),
}

impl fmt::Display for BoardError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            BoardError::Image { path, reason } => write!(
                f,
                "{} is no flash image for this board: {reason}; build one with `cargo xtask firmware`",
                path.display()
            ),
            BoardError::Emulator(why) => write!(f, "the virtual board stopped: {why}"),
        }
    }
}

impl std::error::Error for BoardError {}

/// A board with power on it.
#[derive(Debug)]
pub struct VirtualBoard {
    image: PathBuf,
    emulator: Emulator,
}

impl VirtualBoard {
    /// Switches on a board with this flash image and an FRAM as it leaves the factory. The first millisecond has passed.
    ///
    /// # Errors
    /// A file that is no image for this board.
    pub fn power_on(image: &Path) -> Result<Self, BoardError> {
        VirtualBoard::power_on_with(image, Vec::new())
    }

    /// As [`VirtualBoard::power_on`], its FRAM holding `fram` from address 0 on.
    ///
    /// # Errors
    /// A file that is no image for this board.
    pub fn power_on_with(image: &Path, fram: Vec<u8>) -> Result<Self, BoardError> {
        VirtualBoard::begin(image, Emulator::start(image, fram, None))
    }

    /// A board as it stood when the snapshot was taken.
    ///
    /// # Errors
    /// A snapshot of another image or board.
    pub fn resume(image: &Path, snapshot: &[u8]) -> Result<Self, BoardError> {
        // The emulator reads snapshots from files only.
        let file = std::env::temp_dir().join(format!("barrel-{}-{:p}.snapshot", std::process::id(), snapshot));
        std::fs::write(&file, snapshot).map_err(|error| BoardError::Emulator(error.to_string()))?;
        let board = VirtualBoard::begin(image, Emulator::start(image, Vec::new(), Some(file.clone())));
        let _ = std::fs::remove_file(&file);
        board
    }

    fn begin(image: &Path, mut emulator: Emulator) -> Result<Self, BoardError> {
        emulator.first()?;
        Ok(VirtualBoard { image: image.into(), emulator })
    }

    /// Lets a millisecond pass.
    ///
    /// # Errors
    /// An emulator that gave up.
    pub fn step(&mut self, signals: &Signals, to_robot: [&[u8]; 2]) -> Result<Pins, BoardError> {
        match self.emulator.ask(Command::Step(*signals, to_robot.map(<[u8]>::to_vec)))? {
            Reply::Pins(pins) => Ok(*pins),
            _ => Err(out_of_step()),
        }
    }

    /// Takes the power away and gives it back: RAM and chips start afresh, the FRAM keeps what it holds.
    ///
    /// # Errors
    /// An emulator that gave up.
    pub fn power_cycle(&mut self) -> Result<(), BoardError> {
        let contents = self.fram()?;
        *self = VirtualBoard::power_on_with(&self.image, contents)?;
        Ok(())
    }

    /// Pulls the reset pin.
    ///
    /// # Errors
    /// An emulator that gave up.
    pub fn reset(&mut self) -> Result<(), BoardError> {
        self.emulator.ask(Command::Reset).map(|_| ())
    }

    /// Everything as it stands, for [`VirtualBoard::resume`].
    ///
    /// # Errors
    /// A state that cannot be kept.
    pub fn snapshot(&mut self) -> Result<Vec<u8>, BoardError> {
        self.bytes(Command::Snapshot)
    }

    /// What the FRAM holds.
    ///
    /// # Errors
    /// An emulator that gave up.
    pub fn fram(&mut self) -> Result<Vec<u8>, BoardError> {
        self.bytes(Command::Fram)
    }

    /// Takes the power from the FRAM after so many more bytes written to it; [`Pins::fram_cut`] says when.
    ///
    /// # Errors
    /// An emulator that gave up.
    pub fn cut_fram_after(&mut self, bytes: u32) -> Result<(), BoardError> {
        self.emulator.ask(Command::CutFram(bytes)).map(|_| ())
    }

    /// Loses the next so many transactions with the inertial sensor.
    ///
    /// # Errors
    /// An emulator that gave up.
    pub fn lose_imu(&mut self, transactions: u32) -> Result<(), BoardError> {
        self.emulator.ask(Command::LoseImu(transactions)).map(|_| ())
    }

    /// Loses the next so many transactions with the FRAM.
    ///
    /// # Errors
    /// An emulator that gave up.
    pub fn lose_fram(&mut self, transactions: u32) -> Result<(), BoardError> {
        self.emulator.ask(Command::LoseFram(transactions)).map(|_| ())
    }

    /// Stops the clock that the firmware's tasks wait for, as if it hung.
    ///
    /// # Errors
    /// An emulator that gave up.
    pub fn stop_time(&mut self) -> Result<(), BoardError> {
        self.emulator.ask(Command::StopTime).map(|_| ())
    }

    /// Writes a word of memory, as a stray pointer would.
    ///
    /// # Errors
    /// An address without memory.
    pub fn poke(&mut self, address: u32, value: u32) -> Result<(), BoardError> {
        self.emulator.ask(Command::Poke(address, value)).map(|_| ())
    }

    /// What the run touched that the emulator does not model as the part has it, one sentence each.
    ///
    /// # Errors
    /// An emulator that gave up.
    pub fn gaps(&mut self) -> Result<Vec<String>, BoardError> {
        match self.emulator.ask(Command::Gaps)? {
            Reply::Lines(lines) => Ok(lines),
            _ => Err(out_of_step()),
        }
    }

    fn bytes(&mut self, command: Command) -> Result<Vec<u8>, BoardError> {
        match self.emulator.ask(command)? {
            Reply::Bytes(bytes) => Ok(bytes),
            _ => Err(out_of_step()),
        }
    }
}

impl Board for VirtualBoard {
    fn tick(
        &mut self,
        transducers: &Transducers,
        to_robot: &[u8],
        from_robot: &mut Vec<u8>,
    ) -> Result<[f32; 2], LinkError> {
        let Transducers { accelerometer, gyroscope, encoder } = *transducers;
        let signals = Signals { accelerometer, gyroscope, encoder, ..Signals::default() };
        let mut pins = self.step(&signals, [to_robot, &[]])?;
        from_robot.append(&mut pins.from_robot[0]);
        Ok(pins.duty)
    }
}

impl From<BoardError> for LinkError {
    fn from(error: BoardError) -> Self {
        LinkError::Broken(error.to_string())
    }
}

fn out_of_step() -> BoardError {
    BoardError::Emulator("it answered something else".to_owned())
}
