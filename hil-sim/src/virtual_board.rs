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
    /// Supply of the microcontroller, mV.
    pub supply_mv: u32,
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
            supply_mv: 3300,
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
    /// Whether they were told to be at any instant of it.
    pub enabled_meanwhile: bool,
    /// Green, blue and red lamp.
    pub lamps: [bool; 3],
    /// What came out of the virtual COM port and of the radio.
    pub from_robot: [Vec<u8>; 2],
    /// Instructions executed in it.
    pub instructions: u64,
    /// Those from the reading of the encoders to the motors' new duties, if there was a servo tick.
    pub servo_instructions: Option<u64>,
    /// Those from where [`VirtualBoard::watch_framing`] watches to when the frame goes to a UART, if one did.
    pub framing_instructions: Option<u64>,
    /// Resets since power-on.
    pub resets: usize,
    /// The FRAM has lost its power, as [`Trouble::CutFram`] wanted.
    pub fram_cut: bool,
}

/// What can go wrong on a board, besides what [`Signals`] can say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trouble {
    /// The next so many transactions with the inertial sensor are lost.
    LoseImu(u32),
    /// The next so many transactions with the FRAM are lost.
    LoseFram(u32),
    /// These bits of the next byte that the inertial sensor answers are flipped.
    FlipImu(u8),
    /// These bits of the next byte that the FRAM answers are flipped.
    FlipFram(u8),
    /// The FRAM loses its power after so many more bytes written to it; [`Pins::fram_cut`] says when.
    CutFram(u32),
    /// Somebody pulls the reset pin after so many more bytes written to the FRAM, which keeps its power.
    ResetInWrite(u32),
    /// From now on so many bytes in a million arrive at both UARTs with noise, and as many with a framing error.
    GarbleUarts(u32),
    /// The clock that the firmware's tasks wait for stops, as if it hung.
    StopTime,
    /// It goes on.
    ResumeTime,
    /// The clock of the debug probe stops.
    FailClock,
    /// A word of memory is written, as by a stray pointer: address and value.
    Poke(u32, u32),
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
    pins: Pins,
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
        let pins = emulator.first()?;
        Ok(VirtualBoard { image: image.into(), emulator, pins })
    }

    /// The pins after the last millisecond; right after power-on, after the first one.
    pub fn pins(&self) -> &Pins {
        &self.pins
    }

    /// Lets a millisecond pass.
    ///
    /// # Errors
    /// An emulator that gave up.
    pub fn step(&mut self, signals: &Signals, to_robot: [&[u8]; 2]) -> Result<&Pins, BoardError> {
        match self.emulator.ask(Command::Step(*signals, to_robot.map(<[u8]>::to_vec)))? {
            Reply::Pins(pins) => {
                self.pins = *pins;
                Ok(&self.pins)
            }
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

    /// Makes something go wrong.
    ///
    /// # Errors
    /// An emulator that gave up; an address without memory.
    pub fn trouble(&mut self, trouble: Trouble) -> Result<(), BoardError> {
        self.emulator.ask(Command::Trouble(trouble)).map(|_| ())
    }

    /// Counts the instructions that a frame takes, from this address of the image on; see [`Pins::framing_instructions`].
    ///
    /// # Errors
    /// An emulator that cannot watch it.
    pub fn watch_framing(&mut self, address: u32) -> Result<(), BoardError> {
        self.emulator.ask(Command::WatchFraming(address)).map(|_| ())
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
        let pins = self.step(&signals, [to_robot, &[]])?;
        from_robot.extend_from_slice(&pins.from_robot[0]);
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
