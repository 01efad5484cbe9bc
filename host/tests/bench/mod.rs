//! A bench without hardware: the robot's own code on a simulated barrel, at the far end of a pseudo-terminal. `barrel` opens
//! the near end as the serial port that it is.
#![allow(dead_code, reason = "each test file uses its part")]

use firmware::axes::ImuCounts;
use firmware::port::Incoming;
use firmware::robot::{Boot, Errand, Senses};
use firmware::storage::Record;
use firmware::{Port, Robot};
use hil_sim::experiment::Experiment;
use hil_sim::setup::{BodyKind, Setup};
use hil_sim::world::{Command as Motors, World};
use protocol::RobotMessage;
use protocol::frame::MAX_FRAME;
use protocol::message::{MemoryState, Refusal, ResetCause, Vitals};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

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

/// A device that is plugged in.
pub struct Plugged<D> {
    name: PathBuf,
    unplug: Arc<AtomicBool>,
    bridge: Option<JoinHandle<D>>,
}

impl<D: Device> Plugged<D> {
    /// Plugs `device` in: `name` becomes its serial port.
    pub fn new(name: &Path, device: D) -> Self {
        Self::until(name, device, |_| false)
    }

    /// As [`Plugged::new`]; pulled out by itself when `is_enough` says so of the bytes it has said.
    pub fn until(name: &Path, device: D, is_enough: impl Fn(u64) -> bool + Send + 'static) -> Self {
        // Closed in the programs that other tests start: else the line would live on in them.
        let far = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).expect("a pseudo-terminal");
        grantpt(&far).expect("granted");
        unlockpt(&far).expect("unlocked");
        let mut settings = tcgetattr(&far).expect("settings");
        settings.make_raw();
        tcsetattr(&far, OptionalActions::Now, &settings).expect("taken");
        let near = ptsname(&far, Vec::new()).expect("it has a name").into_string().expect("a path");
        std::os::unix::fs::symlink(near, name).expect("linked");
        let far = File::from(far);
        let unplug = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&unplug);
        let bridge = std::thread::spawn(move || bridge(far, device, &flag, is_enough));
        Plugged { name: name.to_owned(), unplug, bridge: Some(bridge) }
    }

    /// Pulls it out; it goes on with what it knows when it is plugged in again.
    pub fn unplug(mut self) -> D {
        let _ = std::fs::remove_file(&self.name);
        self.unplug.store(true, Ordering::Relaxed);
        self.bridge.take().expect("it is plugged in").join().expect("the device works")
    }
}

impl<D> Drop for Plugged<D> {
    fn drop(&mut self) {
        self.unplug.store(true, Ordering::Relaxed);
        if let Some(bridge) = self.bridge.take() {
            let _ = bridge.join();
        }
    }
}

fn bridge<D: Device>(mut far: File, mut device: D, unplug: &AtomicBool, is_enough: impl Fn(u64) -> bool) -> D {
    let mut arrived = [0; 4096];
    let mut said: u64 = 0;
    while !unplug.load(Ordering::Relaxed) && !is_enough(said) {
        let count = if is_ready(&far, PollFlags::IN) { far.read(&mut arrived).unwrap_or(0) } else { 0 };
        let mut out = Vec::new();
        device.turn(&arrived[..count], &mut out);
        said += out.len() as u64;
        let mut rest = out.as_slice();
        // The line takes what it takes: nothing is lost that a test has not asked for, unless nobody has the port open.
        while !rest.is_empty() && !unplug.load(Ordering::Relaxed) && !is_ready(&far, PollFlags::HUP) {
            if is_ready(&far, PollFlags::OUT) {
                let count = far.write(&rest[..rest.len().min(256)]).unwrap_or(rest.len());
                rest = &rest[count..];
            }
        }
    }
    device
}

/// Whether this can be said of the line, now or within a millisecond.
fn is_ready(far: &File, what: PollFlags) -> bool {
    let wait = if what == PollFlags::HUP { 0 } else { 1_000_000 };
    let mut poll_fd = [PollFd::new(far, what)];
    let _ = poll(&mut poll_fd, Some(&Timespec { tv_sec: 0, tv_nsec: wait }));
    let happened = poll_fd[0].revents();
    if happened.contains(PollFlags::HUP) && what != PollFlags::HUP {
        // Nobody has the port open, and that is known at once.
        std::thread::sleep(Duration::from_millis(1));
    }
    happened.contains(what)
}

/// The link to what is plugged in as `robot`.
pub const OVER_SERIAL: [&str; 2] = ["--link", "serial:./robot"];

/// A `barrel` in `folder`, ready to be started.
pub fn barrel(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_barrel"));
    command.args(args).current_dir(folder).env("HOME", folder).env_remove("XDG_STATE_HOME");
    command
}

/// Runs `barrel`, which must succeed, and returns what it said.
pub fn succeed(folder: &Path, args: &[&str]) -> String {
    let output = barrel(folder, args).stdin(Stdio::null()).output().expect("barrel starts");
    assert!(output.status.success(), "{args:?}: {}{}", text(&output.stdout), text(&output.stderr));
    text(&output.stdout)
}

/// Runs `barrel`, which must fail with this exit code, and returns what it complained of.
pub fn fail(folder: &Path, code: i32, args: &[&str]) -> String {
    let Output { status, stderr, .. } = barrel(folder, args).stdin(Stdio::null()).output().expect("barrel starts");
    assert_eq!(status.code(), Some(code), "{args:?}: {}", text(&stderr));
    text(&stderr)
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A `barrel` that goes on, with its output line by line.
pub struct Running {
    pub child: Child,
    lines: Receiver<String>,
    /// Everything it has said so far.
    pub said: Vec<String>,
}

impl Running {
    pub fn start(folder: &Path, args: &[&str]) -> Self {
        let mut child = barrel(folder, args)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("barrel starts");
        let output = child.stdout.take().expect("piped");
        let (send, lines) = mpsc::channel();
        std::thread::spawn(move || {
            for line in BufReader::new(output).lines().map_while(Result::ok) {
                if send.send(line).is_err() {
                    return;
                }
            }
        });
        Running { child, lines, said: Vec::new() }
    }

    /// Waits for a line with these words, and returns it.
    pub fn wait_for(&mut self, words: &str) -> String {
        loop {
            match self.lines.recv_timeout(Duration::from_secs(60)) {
                Ok(line) => {
                    self.said.push(line.clone());
                    if line.contains(words) {
                        return line;
                    }
                }
                Err(_) => {
                    let _ = self.child.kill();
                    let mut complaint = String::new();
                    let _ = self.child.stderr.take().map(|mut stderr| stderr.read_to_string(&mut complaint));
                    panic!("'{words}' was not said: {:#?} {complaint}", self.said);
                }
            }
        }
    }

    /// Presses Ctrl-C, and returns the rest of what it says.
    pub fn interrupt(mut self) -> String {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().expect("kill starts").success());
        let status = self.child.wait().expect("it ends");
        let rest: Vec<String> = self.lines.iter().collect();
        assert!(status.success(), "{:#?} {rest:#?}", self.said);
        rest.join("\n")
    }
}

/// Types `script` into a console, which must end well, and returns what it said.
pub fn talk(folder: &Path, args: &[&str], script: &str) -> String {
    let mut child = barrel(folder, &[&["console"][..], &OVER_SERIAL, args].concat())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("barrel starts");
    child.stdin.take().expect("piped").write_all(script.as_bytes()).expect("taken");
    let output = child.wait_with_output().expect("ends");
    assert!(output.status.success(), "{}{}", text(&output.stdout), text(&output.stderr));
    text(&output.stdout)
}

/// Looks for all of `words` in what was said, one after the other.
pub fn in_turn(said: &str, words: &[&str]) {
    let mut rest = said;
    for word in words {
        let at = rest.find(word).unwrap_or_else(|| panic!("'{word}' is not said in its turn: {said}"));
        rest = &rest[at + word.len()..];
    }
}
