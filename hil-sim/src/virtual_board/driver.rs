//! Runs the emulator on a thread of its own, a millisecond at a time: it asks at every stop what to do next, and waits.

use super::board::{Barrel, ENABLE, FRAM_BUS, IMU_BUS};
use super::{BoardError, Pins, Signals, Trouble};
use rigless::emulator::{Driver, Host, Settled, Start, Stop, Watch, run};
use rigless::image::{self, Image};
use rigless::mcu::Operate;
use rigless::session::Session;
use rigless::snapshot::{self, Reader, Snapshot, Store, Writer};
use rigless::soc::Width;
use rigless::time::VirtualNanos;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};

/// One step, ns.
const STEP: u64 = 1_000_000;

/// TIM5, embassy's time driver: event generation, status and interrupt enables.
const TIM5_EGR: u64 = 0x4000_0C14;
const TIM5_SR: u64 = 0x4000_0C10;
const TIM5_DIER: u64 = 0x4000_0C0C;
/// Counter of TIM4, the second encoder, the last one that a servo tick reads; compare register of TIM1's channel 1, the first
/// motor, the first one that it writes.
const TIM4_CNT: u64 = 0x4000_0824;
const TIM1_CCR1: u64 = 0x4001_0034;
/// Where the drivers' enable is set and cleared.
const GPIOE_BSRR: u64 = 0x4002_1018;
/// Data register of SPI3, the FRAM's bus.
const SPI3_DR: u64 = 0x4000_3C0C;
/// The two UARTs, and the DMA that carries frames to them.
const UARTS: std::ops::Range<u64> = 0x4000_4400..0x4000_4C00;
const DMA1: std::ops::Range<u64> = 0x4002_6000..0x4002_6400;

/// What to do at a stop.
pub enum Command {
    /// Put these signals on the pins, these bytes on the lines, and go on for a millisecond.
    Step(Signals, [Vec<u8>; 2]),
    /// Write everything down.
    Snapshot,
    /// Pull the reset pin.
    Reset,
    /// Make something go wrong.
    Trouble(Trouble),
    /// What the FRAM holds.
    Fram,
    /// Count the instructions of a frame from this address on.
    WatchFraming(u32),
    /// What the emulator could not do as the part does it.
    Gaps,
}

/// What came of it.
pub enum Reply {
    /// The pins after the millisecond.
    Pins(Box<Pins>),
    /// Bytes that were asked for.
    Bytes(Vec<u8>),
    /// It could not be done.
    Failed(String),
    /// Sentences.
    Lines(Vec<String>),
    /// Done.
    Done,
}

/// The emulator on its thread.
#[derive(Debug)]
pub struct Emulator {
    commands: Option<Sender<Command>>,
    replies: Receiver<Reply>,
    thread: Option<JoinHandle<Result<(), BoardError>>>,
}

impl Emulator {
    /// Starts the image, or goes on from a snapshot of it.
    pub fn start(image: &Path, fram: Vec<u8>, snapshot: Option<PathBuf>) -> Self {
        let (commands, for_thread) = channel();
        let (to_caller, replies) = channel();
        let image = image.to_path_buf();
        let thread = thread::spawn(move || emulate(&image, fram, snapshot.as_deref(), for_thread, to_caller));
        Emulator { commands: Some(commands), replies, thread: Some(thread) }
    }

    /// Has a command carried out.
    pub fn ask(&mut self, command: Command) -> Result<Reply, BoardError> {
        let sent = self.commands.as_ref().is_some_and(|commands| commands.send(command).is_ok());
        match self.replies.recv() {
            Ok(Reply::Failed(why)) => Err(BoardError::Emulator(why)),
            Ok(reply) if sent => Ok(reply),
            _ => Err(self.end()),
        }
    }

    /// The pins of the first step, which runs by itself.
    pub fn first(&mut self) -> Result<Pins, BoardError> {
        match self.replies.recv() {
            Ok(Reply::Pins(pins)) => Ok(*pins),
            _ => Err(self.end()),
        }
    }

    /// Why the thread has ended.
    fn end(&mut self) -> BoardError {
        self.commands = None;
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(Err(error))) => error,
            Some(Err(_)) => BoardError::Emulator("it panicked".to_owned()),
            _ => BoardError::Emulator("it has ended".to_owned()),
        }
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // Without commands the run ends at its next stop.
        self.commands = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn emulate(
    path: &Path,
    fram: Vec<u8>,
    snapshot: Option<&Path>,
    commands: Receiver<Command>,
    replies: Sender<Reply>,
) -> Result<(), BoardError> {
    let emulator = |error: &dyn std::fmt::Display| BoardError::Emulator(error.to_string());
    let read = Image::read(path, None);
    let images = [read.map_err(|error| BoardError::Image { path: path.into(), reason: error.to_string() })?];
    let firmware = image::digest(&images, None);
    let board = Barrel::new(fram).map_err(|error| emulator(&error))?;
    let mut session = Session::new(Box::new(board), 0, VirtualNanos(STEP)).map_err(|error| emulator(&error))?;
    let mut driver = LockStep {
        steps: 1,
        instructions: 0,
        sensed: None,
        servo_instructions: None,
        framed: None,
        framing_instructions: None,
        enabled_meanwhile: false,
        stopped_time: 0,
        resets: 0,
        stepped: true,
        firmware,
        commands,
        replies,
    };
    let mut start = Start::new(&images);
    let resume;
    if let Some(path) = snapshot {
        let snapshot = Snapshot::read(path).map_err(|error| emulator(&error))?;
        resume = snapshot.restore(&mut session, &firmware, &mut driver).map_err(|error| emulator(&error))?;
        session.run_until(VirtualNanos(driver.steps * STEP));
        start.resume = Some(&resume);
    }
    let mut finished = run(session, &start, driver).map_err(|error| match error {
        rigless::emulator::Error::Image(error) => BoardError::Image { path: path.into(), reason: error.to_string() },
        error => emulator(&error),
    })?;
    finished.session.take_error().map_or(Ok(()), |error| Err(emulator(&error)))
}

/// The emulator's side of the rendezvous.
struct LockStep {
    /// Milliseconds until the next stop, from the start.
    steps: u64,
    instructions: u64,
    /// Instructions executed when the encoders were last read, since the start.
    sensed: Option<u64>,
    servo_instructions: Option<u64>,
    /// Instructions executed when the framing of a message was last begun, since the start.
    framed: Option<u64>,
    framing_instructions: Option<u64>,
    /// The drivers were told to be enabled in this millisecond.
    enabled_meanwhile: bool,
    /// The interrupts of the servo's clock, while that stands still.
    stopped_time: u64,
    resets: usize,
    /// The last command was a step, and its pins are to be reported.
    stepped: bool,
    firmware: [u8; 32],
    commands: Receiver<Command>,
    replies: Sender<Reply>,
}

impl Store for LockStep {
    fn store(&self, to: &mut Writer) -> Result<(), snapshot::Error> {
        to.put(&(self.steps, self.instructions, self.sensed, self.servo_instructions, self.resets))?;
        to.put(&(self.framed, self.framing_instructions, self.enabled_meanwhile, self.stopped_time))
    }

    fn load(&mut self, from: &mut Reader) -> Result<(), snapshot::Error> {
        (self.steps, self.instructions, self.sensed, self.servo_instructions, self.resets) = from.take()?;
        (self.framed, self.framing_instructions, self.enabled_meanwhile, self.stopped_time) = from.take()?;
        Ok(())
    }
}

impl Driver<Barrel> for LockStep {
    /// Counts the instructions of the servo tick and of a frame, notes what the drivers are told, pulls the reset pin in the middle of
    /// a write where that is wanted, and mends one thing: the timer's model raises its compare flags when embassy's
    /// time driver loads its registers at the start, with the counter and the compare values all 0, which no chip does; the
    /// driver's period would be one ahead for good. The flags are cleared where the chip has none.
    fn on_settled(&mut self, session: &mut Session<Barrel>, host: &mut dyn Host, settled: Settled) {
        let access = match settled {
            Settled::Access { access, .. } => access,
            Settled::Hit(hit) => {
                self.framed = Some(hit.instruction_count);
                return;
            }
            _ => return,
        };
        match access.address {
            TIM5_EGR => {
                let _ = session.board_mut().mcu().write(access.virtual_time, TIM5_SR, Width::W32, 0);
            }
            TIM4_CNT => self.sensed = Some(access.instruction_count),
            TIM1_CCR1 => {
                let sensed = self.sensed.take();
                self.servo_instructions = sensed.map(|count| access.instruction_count - count);
            }
            GPIOE_BSRR => self.enabled_meanwhile |= access.value >> ENABLE & 1 != 0,
            SPI3_DR if session.board_mut().fram().take_reset() => {
                session.reset_by_pin(access.virtual_time, access.instruction_count, host);
            }
            address if self.framed.is_some() && (UARTS.contains(&address) || DMA1.contains(&address)) => {
                let framed = self.framed.take();
                self.framing_instructions = framed.map(|count| access.instruction_count - count);
            }
            _ => {}
        }
    }

    fn on_stop(&mut self, session: &mut Session<Barrel>, stop: Stop, host: &mut dyn Host) -> Option<VirtualNanos> {
        if self.stepped {
            let pins = self.pins(session, stop);
            self.stepped = false;
            self.replies.send(Reply::Pins(Box::new(pins))).ok()?;
        }
        loop {
            let reply = match self.commands.recv().ok()? {
                Command::Step(signals, to_robot) => {
                    self.expose(session, stop.at, &signals);
                    for (which, bytes) in to_robot.into_iter().enumerate() {
                        session.board_mut().wire(which).to_mcu.extend(bytes);
                    }
                    self.stepped = true;
                    self.steps += 1;
                    return Some(VirtualNanos(self.steps * STEP));
                }
                Command::Snapshot => match snapshot::take(session, host, stop, &self.firmware, self) {
                    Ok(taken) => Reply::Bytes(taken.file),
                    Err(error) => Reply::Failed(error.to_string()),
                },
                Command::Reset => {
                    session.reset_by_pin(stop.at, stop.instruction_count, host);
                    Reply::Done
                }
                Command::Trouble(trouble) => match self.trouble(session, stop, host, trouble) {
                    Ok(()) => Reply::Done,
                    Err(why) => Reply::Failed(why),
                },
                Command::Fram => Reply::Bytes(session.board_mut().fram().contents()),
                Command::WatchFraming(address) => match host.watch(Watch::Instruction(u64::from(address))) {
                    true => Reply::Done,
                    false => Reply::Failed(format!("{address:#x} cannot be watched")),
                },
                Command::Gaps => Reply::Lines(gaps(session)),
            };
            self.replies.send(reply).ok()?;
        }
    }
}

impl LockStep {
    /// Puts the signals on the transducers.
    fn expose(&mut self, session: &mut Session<Barrel>, at: VirtualNanos, signals: &Signals) {
        let resets = session.resets().len();
        let board = session.board_mut();
        if resets != self.resets {
            // A reset forgets what is driven from outside.
            self.resets = resets;
            board.drive_encoders(at);
        }
        for (which, count) in signals.encoder.into_iter().enumerate() {
            board.turn(at, which, i64::from(count));
        }
        board.drive_stop(at, signals.stop_button, signals.stop_loop_open);
        board.set_battery(signals.battery_mv);
        board.set_supply(signals.supply_mv);
        board.silence_imu(signals.imu_silent);
        let [x, y, z] = signals.accelerometer.map(micro_g);
        board.imu().set_acceleration(x, y, z);
        let [x, y, z] = signals.gyroscope.map(milli_degrees);
        board.imu().set_rate(x, y, z);
    }

    /// Makes something go wrong.
    fn trouble(
        &mut self,
        session: &mut Session<Barrel>,
        stop: Stop,
        host: &mut dyn Host,
        trouble: Trouble,
    ) -> Result<(), String> {
        let board = session.board_mut();
        match trouble {
            Trouble::LoseImu(count) => board.lose(IMU_BUS, count),
            Trouble::LoseFram(count) => board.lose(FRAM_BUS, count),
            Trouble::FlipImu(bits) => board.flip(IMU_BUS, bits),
            Trouble::FlipFram(bits) => board.flip(FRAM_BUS, bits),
            Trouble::CutFram(bytes) => board.fram().cut_after(bytes),
            Trouble::ResetInWrite(bytes) => board.fram().reset_after(bytes),
            Trouble::GarbleUarts(per_million) => board.garble_uarts(per_million),
            Trouble::FailClock => board.fail_clock(stop.at),
            Trouble::StopTime => {
                let enabled = board.mcu().read(stop.at, TIM5_DIER, Width::W32);
                self.stopped_time = enabled.map_err(|error| format!("{error:?}"))?;
                board.mcu().write(stop.at, TIM5_DIER, Width::W32, 0).map_err(|error| format!("{error:?}"))?;
            }
            Trouble::ResumeTime => {
                let enabled = self.stopped_time;
                board.mcu().write(stop.at, TIM5_DIER, Width::W32, enabled).map_err(|error| format!("{error:?}"))?;
            }
            Trouble::Poke(address, value) => {
                let written = host.write(u64::from(address), Width::W32, u64::from(value));
                written.map_err(|error| error.to_string())?;
            }
        }
        Ok(())
    }

    fn pins(&mut self, session: &mut Session<Barrel>, stop: Stop) -> Pins {
        let instructions = stop.instruction_count - self.instructions;
        self.instructions = stop.instruction_count;
        let resets = session.resets().len();
        let board = session.board_mut();
        let enabled = board.enabled();
        let duty = board.duty();
        Pins {
            duty: if enabled { duty } else { [0.0; 2] },
            pwm: duty,
            enabled,
            enabled_meanwhile: std::mem::take(&mut self.enabled_meanwhile),
            lamps: board.lamps(),
            from_robot: [0, 1].map(|which| std::mem::take(&mut board.wire(which).from_mcu)),
            instructions,
            servo_instructions: self.servo_instructions.take(),
            framing_instructions: self.framing_instructions.take(),
            resets,
            fram_cut: board.fram().is_cut(),
        }
    }
}

/// Acceleration, millionths of g, that the chip at ±4 g reads as `counts`.
fn micro_g(counts: i16) -> i32 {
    (f64::from(counts) * 1e6 / 8192.0).round() as i32
}

/// Rate, thousandths of °/s, that the chip's model at ±2000 °/s reads as `counts`: it has 16.384 counts per °/s, which the
/// data sheet rounds to 16.4.
fn milli_degrees(counts: i16) -> i32 {
    (f64::from(counts) * 1e3 / 16.384).round() as i32
}

/// What a run touched that the emulator does not model as the part has it, one sentence each.
fn gaps(session: &mut Session<Barrel>) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for (at, gap) in session.unimplemented() {
        lines.push(format!("{}.{} at {at:#x} is not modelled", gap.instance, gap.register));
    }
    lines.extend(session.unmapped().iter().map(|unmapped| format!("nothing answers: {unmapped}")));
    lines.extend(session.refused().iter().map(|(at, fault)| format!("{at:#x} was refused: {fault}")));
    lines.extend(session.told().map(|told| format!("{told:?}")));
    lines.extend(
        session.unrouted().iter().map(|(instance, line)| format!("interrupt {line} of {instance} has no line")),
    );
    lines
}
