//! What can be at the end of a serial line: the robot, what is none, and what comes in between.

use firmware::axes::ImuCounts;
use firmware::port::Incoming;
use firmware::robot::{Boot, Errand, Senses};
use firmware::storage::Record;
use firmware::{Port, Robot};
use hil_sim::experiment::Experiment;
use hil_sim::setup::{BodyKind, Setup};
use hil_sim::world::{Command as Motors, World};
use protocol::frame::MAX_FRAME;
use protocol::message::{MemoryState, Refusal, ResetCause, SafetyState, Vitals};
use protocol::{Decoder, HostMessage, RobotMessage};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Something at the end of a serial line.
pub trait Device: Send + 'static {
    /// Takes what has arrived, if anything, and appends what it says. Called about a thousand times a second.
    fn turn(&mut self, arrived: &[u8], out: &mut Vec<u8>);
}

/// A robot on a simulated barrel. Each turn is a control step of its own time, so it lives faster than real time.
pub struct BenchRobot {
    robot: Robot<f32>,
    port: Port,
    world: World,
    ticks: u32,
    /// Where the encoders stood at power-on.
    encoder: [i32; 2],
    /// Whether it has a memory, and what is in it.
    has_memory: bool,
    memory: Option<Record>,
    pub wishes: Arc<Mutex<Wishes>>,
}

/// What a test can do to a robot in the middle of everything.
#[derive(Default)]
pub struct Wishes {
    /// Reset it, for this reason.
    pub reset: Option<ResetCause>,
    /// Number this many frames that are then not sent.
    pub lose: u32,
    /// Stop answering and telling.
    pub silent: bool,
    /// While silent, say this at the next thing that is heard.
    pub last_words: Option<RobotMessage>,
    /// How often something was heard while silent.
    pub asked: u32,
}

impl BenchRobot {
    pub fn new(has_memory: bool) -> Self {
        let experiment = Experiment::find("homeokinetic").expect("an experiment");
        let mut world = World::new(Setup::new(experiment, BodyKind::Tabletop)).expect("a barrel");
        world.lie_down().expect("it lies");
        let encoder = world.transducers().encoder;
        let mut robot = BenchRobot {
            robot: Robot::default(),
            port: Port::default(),
            world,
            ticks: 0,
            encoder,
            has_memory,
            memory: None,
            wishes: Arc::default(),
        };
        robot.start(ResetCause::PowerOn);
        robot
    }

    /// How long it has lived since its last start, ms.
    pub fn lived(&self) -> u64 {
        self.ticks.into()
    }

    /// Whether it is as a run should leave it: disarmed, with its own sensors.
    pub fn is_left_in_order(&self) -> bool {
        self.robot.safety_state() == SafetyState::Disarmed && !self.robot.simulated_sensors()
    }

    fn start(&mut self, reset: ResetCause) {
        let memory = match (&self.memory, self.has_memory) {
            (_, false) => MemoryState::Absent,
            (None, true) => MemoryState::Empty,
            (Some(_), true) => MemoryState::Loaded,
        };
        self.robot = Robot::new(&Boot { reset, memory, record: self.memory.clone() });
        self.port = Port::default();
        self.ticks = 0;
        self.encoder = self.world.transducers().encoder;
    }

    fn errand(&mut self, errand: Errand) -> RobotMessage {
        if !self.has_memory {
            return RobotMessage::Refused(Refusal::NoMemory);
        }
        self.memory = match errand {
            Errand::Store(record) => Some(record),
            Errand::Forget => None,
        };
        RobotMessage::Stored
    }

    fn announce(&mut self, message: &RobotMessage, out: &mut Vec<u8>) {
        out.extend_from_slice(self.port.announce(message, &mut [0; MAX_FRAME]));
    }
}

impl Device for BenchRobot {
    fn turn(&mut self, arrived: &[u8], out: &mut Vec<u8>) {
        let wishes = Arc::clone(&self.wishes);
        let mut wishes = wishes.lock().expect("no test panicked with it");
        if let Some(cause) = wishes.reset.take() {
            self.start(cause);
            out.push(0);
        }
        for _ in 0..std::mem::take(&mut wishes.lose) {
            self.announce(&RobotMessage::Vitals(Vitals::default()), &mut Vec::new());
        }
        if wishes.silent {
            if !arrived.is_empty() {
                wishes.asked += 1;
                wishes.last_words.take().iter().for_each(|message| self.announce(message, out));
            }
            return;
        }
        for &byte in arrived {
            let mut replies = Vec::new();
            match self.port.push(byte) {
                None => continue,
                Some(Incoming::Again(frames)) => out.extend_from_slice(frames),
                Some(Incoming::Request(message)) => self.robot.handle(&message, &mut |reply| replies.push(*reply)),
            }
            replies.extend(self.robot.take_errand().map(|errand| self.errand(errand)));
            for reply in replies {
                out.extend_from_slice(self.port.answer(&reply, &mut [0; MAX_FRAME]));
            }
        }
        for _ in 0..20 {
            self.ticks += 1;
            let transducers = self.world.transducers();
            let tick = self.robot.servo_tick(&Senses {
                imu: Some(ImuCounts { accelerometer: transducers.accelerometer, gyroscope: transducers.gyroscope }),
                encoder: std::array::from_fn(|i| transducers.encoder[i] - self.encoder[i]),
                battery_mv: Some(12_000),
                ..Senses::default()
            });
            self.world.advance(1, Motors::Duty(tick.outputs.duty().map(f64::from)));
            if tick.stepped {
                self.announce(&RobotMessage::Telemetry(self.robot.telemetry()), out);
            }
            if self.ticks.is_multiple_of(1000) {
                let vitals = Vitals {
                    ticks: self.ticks,
                    homed: self.robot.homed(),
                    simulated_sensors: self.robot.simulated_sensors(),
                    load: 240,
                    battery_mv: 12_000,
                    ..Vitals::default()
                };
                self.announce(&RobotMessage::Vitals(vitals), out);
            }
        }
    }
}

/// A device that never says anything.
pub struct Mute;

impl Device for Mute {
    fn turn(&mut self, _: &[u8], _: &mut Vec<u8>) {}
}

/// A plug that connects what is sent to what is received.
pub struct Loopback;

impl Device for Loopback {
    fn turn(&mut self, arrived: &[u8], out: &mut Vec<u8>) {
        out.extend_from_slice(arrived);
    }
}

/// A device whose bytes are counted as they arrive.
pub struct Counted<D> {
    device: D,
    pub arrived: Arc<AtomicU64>,
}

impl<D> Counted<D> {
    pub fn new(device: D) -> Self {
        Counted { device, arrived: Arc::default() }
    }
}

impl<D: Device> Device for Counted<D> {
    fn turn(&mut self, arrived: &[u8], out: &mut Vec<u8>) {
        self.arrived.fetch_add(arrived.len() as u64, Ordering::Relaxed);
        self.device.turn(arrived, out);
    }
}

/// A device that hears no question like this one, and from the first on nothing at all.
pub struct DeafTo<D> {
    device: D,
    question: fn(&HostMessage) -> bool,
    decoder: Decoder,
    /// It has come.
    pub is_deaf: Arc<AtomicBool>,
}

impl<D> DeafTo<D> {
    pub fn new(device: D, question: fn(&HostMessage) -> bool) -> Self {
        DeafTo { device, question, decoder: Decoder::new(), is_deaf: Arc::default() }
    }
}

impl<D: Device> Device for DeafTo<D> {
    fn turn(&mut self, arrived: &[u8], out: &mut Vec<u8>) {
        for &byte in arrived {
            if let Some(Ok((_, message))) = self.decoder.push::<HostMessage>(byte)
                && (self.question)(&message)
            {
                self.is_deaf.store(true, Ordering::Relaxed);
            }
        }
        self.device.turn(if self.is_deaf.load(Ordering::Relaxed) { &[] } else { arrived }, out);
    }
}

/// A device whose time does not pass faster than the clock's.
pub struct Paced<D> {
    device: D,
    /// How long it has lived, ms.
    age: fn(&D) -> u64,
    start: Instant,
    /// As it is after the last turn.
    pub lived: Arc<AtomicU64>,
}

impl<D> Paced<D> {
    pub fn new(device: D, age: fn(&D) -> u64) -> Self {
        Paced { device, age, start: Instant::now(), lived: Arc::default() }
    }
}

impl<D: Device> Device for Paced<D> {
    fn turn(&mut self, arrived: &[u8], out: &mut Vec<u8>) {
        self.device.turn(arrived, out);
        let lived = (self.age)(&self.device);
        self.lived.store(lived, Ordering::Relaxed);
        std::thread::sleep(Duration::from_millis(lived).saturating_sub(self.start.elapsed()));
    }
}

/// Another program: a satellite receiver, in text and without end.
pub struct Satellites;

impl Device for Satellites {
    fn turn(&mut self, _: &[u8], out: &mut Vec<u8>) {
        out.extend_from_slice(b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n");
    }
}

/// A robot of another build.
pub struct Stranger(pub Port, pub RobotMessage);

impl Device for Stranger {
    fn turn(&mut self, arrived: &[u8], out: &mut Vec<u8>) {
        for &byte in arrived {
            if matches!(self.0.push(byte), Some(Incoming::Request(_))) {
                out.extend_from_slice(self.0.answer(&self.1, &mut [0; MAX_FRAME]));
            }
        }
    }
}

/// A line that loses bytes and makes some up, the same ones every time.
pub struct Noisy<D> {
    pub device: D,
    pub random: u64,
    /// One byte in so many is touched.
    pub one_in: u64,
    /// Bytes that were.
    pub touched: Arc<Mutex<u64>>,
}

impl<D> Noisy<D> {
    fn spoil(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut spoilt = Vec::new();
        for &byte in bytes {
            // Knuth's MMIX generator.
            self.random = self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let draw = self.random >> 33;
            if !draw.is_multiple_of(self.one_in) {
                spoilt.push(byte);
                continue;
            }
            *self.touched.lock().expect("no test panicked with it") += 1;
            match draw / self.one_in % 4 {
                0 | 1 => {}
                2 => spoilt.push(byte ^ 0x10),
                _ => spoilt.extend([byte, 0x55, 0xaa, 0x00]),
            }
        }
        spoilt
    }
}

impl<D: Device> Device for Noisy<D> {
    fn turn(&mut self, arrived: &[u8], out: &mut Vec<u8>) {
        let arrived = self.spoil(arrived);
        let mut said = Vec::new();
        self.device.turn(&arrived, &mut said);
        out.extend(self.spoil(&said));
    }
}
