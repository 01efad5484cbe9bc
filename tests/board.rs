//! The images on the virtual board, for tests: where they are, and a bench with a board on it whose pins are watched and whose
//! surroundings can be changed.

use crate::{BadLine, setup};
use hil_sim::coupling::{Coupling, Step};
use hil_sim::link::{Board, Embodied, HELLO, Identity, LinkError, recognise};
use hil_sim::setup::BodyKind;
use hil_sim::virtual_board::{Pins, Signals, VirtualBoard};
use hil_sim::world::World;
use object::{Object, ObjectSymbol};
use protocol::message::{Transducers, Vitals};
use protocol::{HostMessage, RobotMessage};
use rustc_demangle::demangle;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The image with its brain in f32 and with logs.
///
/// # Panics
/// Where `cargo xtask test` has not said where it is.
pub fn image() -> PathBuf {
    named("BARREL_FIRMWARE")
}

/// The image with its brain in f32, without logs.
///
/// # Panics
/// Where `cargo xtask test` has not said where it is.
pub fn image_without_logs() -> PathBuf {
    named("BARREL_FIRMWARE_NO_LOG")
}

/// The image with its brain in fixed point, without logs.
///
/// # Panics
/// Where `cargo xtask test` has not said where it is.
pub fn image_in_fixed_point() -> PathBuf {
    named("BARREL_FIRMWARE_FIXED")
}

fn named(variable: &str) -> PathBuf {
    std::env::var_os(variable)
        .unwrap_or_else(|| panic!("`cargo xtask test` builds the images and sets {variable}"))
        .into()
}

/// Where an image has the variable in RAM whose path ends like this.
///
/// # Panics
/// Where there is none, or more than one.
pub fn variable(image: &Path, path: &str) -> Range<u32> {
    place(image, path, 0x2000_0000..0x4000_0000)
}

/// Where an image has the first instruction of the function whose path ends like this.
///
/// # Panics
/// Where there is none, or more than one.
pub fn function(image: &Path, path: &str) -> u32 {
    // The lowest bit says that it is Thumb code.
    place(image, path, 0x0800_0000..0x2000_0000).start & !1
}

/// Where something lies whose path ends like this. Compilers mangle paths in more than one way.
fn place(image: &Path, path: &str, memory: Range<u64>) -> Range<u32> {
    let ends_so = |mangled: &str| format!("{:#}", demangle(mangled)).replace(['<', '>'], "").ends_with(path);
    let bytes = std::fs::read(image).expect("the image is there");
    let file = object::File::parse(bytes.as_slice()).expect("an ELF file");
    let mut found = file
        .symbols()
        .filter(|symbol| symbol.size() > 0 && memory.contains(&symbol.address()) && symbol.name().is_ok_and(ends_so));
    let symbol = found.next().unwrap_or_else(|| panic!("nothing there is called {path}"));
    assert!(found.next().is_none(), "more than one thing there is called {path}");
    let word = |number: u64| u32::try_from(number).expect("an address of 32 bits");
    word(symbol.address())..word(symbol.address() + symbol.size())
}

/// A board whose pins are watched, and whose line can be a bad one.
#[derive(Debug)]
pub struct Watched {
    /// The board.
    pub board: VirtualBoard,
    /// What surrounds it, but for what the world moves.
    pub around: Signals,
    /// Milliseconds in which a motor pin carried something or the drivers were enabled, since this was last set to 0.
    pub driven: u32,
    /// Its line, where that is a bad one.
    pub line: Option<BadLine>,
    /// What it was told and what came of it, where that is kept.
    pub kept: Option<Vec<Exchange>>,
}

/// A millisecond of a board: what it was exposed to, what arrived, and its pins then.
pub type Exchange = (Signals, Vec<u8>, Pins);

impl Watched {
    /// Watches a board.
    pub fn new(board: VirtualBoard) -> Self {
        Watched { board, around: Signals::default(), driven: 0, line: None, kept: None }
    }

    /// The pins after the last millisecond.
    pub fn pins(&self) -> &Pins {
        self.board.pins()
    }

    fn carry(&mut self, bytes: &[u8]) -> Vec<u8> {
        self.line.as_mut().map_or_else(|| bytes.to_vec(), |line| line.carry(bytes))
    }
}

impl Board for Watched {
    fn tick(&mut self, sensed: &Transducers, to: &[u8], from: &mut Vec<u8>) -> Result<[f32; 2], LinkError> {
        let Transducers { accelerometer, gyroscope, encoder } = *sensed;
        let signals = Signals { accelerometer, gyroscope, encoder, ..self.around };
        let to = self.carry(to);
        let pins = self.board.step(&signals, [&to, &[]])?.clone();
        if let Some(kept) = &mut self.kept {
            kept.push((signals, to, pins.clone()));
        }
        from.extend(self.carry(&pins.from_robot[0]));
        self.driven += u32::from(pins.enabled || pins.enabled_meanwhile || pins.pwm != [0.0; 2]);
        Ok(pins.duty)
    }
}

/// A board in a simulated barrel, and the barrel.
#[derive(Debug)]
pub struct Bench {
    /// The robot.
    pub robot: Embodied<Watched>,
    /// The barrel.
    pub world: World,
}

impl Bench {
    /// Powers an image on, the barrel lying on the floor; parameters by name are set when it starts.
    ///
    /// # Panics
    /// On anything that is not as it should be.
    pub fn power_on(image: &Path, experiment: &str, seed: u64, sets: &[(&str, f64)]) -> Self {
        let mut world = World::new(setup(experiment, BodyKind::Tabletop, seed, sets)).expect("a barrel");
        world.lie_down().expect("it lies");
        let board = VirtualBoard::power_on(image).expect("an image");
        Bench { robot: Embodied::new(Watched::new(board)), world }
    }

    /// As [`Bench::power_on`]; homed, armed and let go.
    ///
    /// # Panics
    /// On anything that is not as it should be.
    pub fn start(image: &Path, experiment: &str, seed: u64, sets: &[(&str, f64)]) -> Self {
        let mut bench = Bench::power_on(image, experiment, seed, sets);
        bench.robot.start(&mut bench.world).expect("starts");
        bench.world.let_go();
        bench
    }

    /// The board and what is known of its pins.
    pub fn board(&mut self) -> &mut Watched {
        self.robot.board_mut()
    }

    /// Lets so many milliseconds pass.
    ///
    /// # Panics
    /// On an emulator that gives up.
    pub fn pass(&mut self, milliseconds: u32) {
        for _ in 0..milliseconds {
            self.robot.tick(&mut self.world).expect("goes on");
        }
    }

    /// The robot's next control step.
    ///
    /// # Panics
    /// If there is none.
    pub fn control_step(&mut self) -> Step {
        self.robot.control_step(&mut self.world).expect("goes on")
    }

    /// Asks the robot something.
    ///
    /// # Panics
    /// If it does not answer.
    pub fn ask(&mut self, message: HostMessage) -> RobotMessage {
        self.robot.request(&message, &mut self.world).expect("an answer").message
    }

    /// What the robot has said of itself in the last second.
    ///
    /// # Panics
    /// If it has not yet said anything.
    pub fn vitals(&self) -> Vitals {
        *self.robot.vitals().expect("they come once a second")
    }

    /// Asks the robot who it is and how it does.
    ///
    /// # Panics
    /// If it does not answer.
    pub fn hello(&mut self) -> Identity {
        recognise(&self.ask(HELLO)).expect("a robot of this build")
    }
}
