//! A bench without hardware: the robot's own code on a simulated barrel, at the far end of a pseudo-terminal. `barrel` opens
//! the near end as the serial port that it is.
#![allow(dead_code, reason = "each test file uses its part")]

use barrel::log::{Entry, Reader};
use firmware::axes::ImuCounts;
use firmware::port::Incoming;
use firmware::robot::{Boot, Errand, Senses};
use firmware::storage::Record;
use firmware::{Port, Robot};
use hil_sim::experiment::Experiment;
use hil_sim::link::Direction;
use hil_sim::setup::{BodyKind, Setup};
use hil_sim::world::{Command as Motors, World};
use protocol::frame::MAX_FRAME;
use protocol::message::{MemoryState, Refusal, ResetCause, SafetyState, Vitals};
use protocol::{Decoder, HostMessage, RobotMessage};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::OFlags;
use rustix::io::ioctl_fionread;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
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

/// A device that is plugged in.
pub struct Plugged<D> {
    name: PathBuf,
    unplug: Arc<AtomicBool>,
    bridge: Option<JoinHandle<D>>,
}

/// How a line takes what a device says.
enum Flow {
    /// The device waits until there is room: nothing is lost that a test has not asked for, unless nobody has the port open.
    Waits,
    /// The device goes on, as the robot's UART does: a frame that comes when this much is still to be read at the near end is
    /// lost whole. Every frame is noted.
    Drops { near: File, frame: Vec<u8>, said: Arc<Mutex<Vec<Sent>>> },
}

/// Bytes that a line without flow control holds.
const HELD: u64 = 2048;

/// A frame that a device has said.
#[derive(Clone, Copy, Debug)]
pub struct Sent {
    /// Its number.
    pub number: u16,
    /// It found no room.
    pub is_lost: bool,
}

impl<D: Device> Plugged<D> {
    /// Plugs `device` in: `name` becomes its serial port.
    pub fn new(name: &Path, device: D) -> Self {
        Self::until(name, device, |_| false)
    }

    /// As [`Plugged::new`]; pulled out by itself when `is_enough` says so of the bytes it has said.
    pub fn until(name: &Path, device: D, is_enough: impl Fn(u64) -> bool + Send + 'static) -> Self {
        let (far, _) = pty(name);
        Self::bridged(name, far, Flow::Waits, device, is_enough)
    }

    /// As [`Plugged::new`], on a line that makes the device wait for nobody. Returns its frames, too, as they are said.
    pub fn without_flow_control(name: &Path, device: D) -> (Self, Arc<Mutex<Vec<Sent>>>) {
        let (far, near) = pty(name);
        let said = Arc::default();
        // It is only asked how much there is to read: the port stays free for others.
        let flow = Flow::Drops { near: open_near(&near), frame: Vec::new(), said: Arc::clone(&said) };
        (Self::bridged(name, far, flow, device, |_| false), said)
    }

    fn bridged(
        name: &Path,
        far: File,
        flow: Flow,
        device: D,
        is_enough: impl Fn(u64) -> bool + Send + 'static,
    ) -> Self {
        let unplug = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&unplug);
        let bridge = std::thread::spawn(move || bridge(far, flow, device, &flag, is_enough));
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

/// A pseudo-terminal whose near end is called `name`. Returns the far end, and the near end's own name.
pub fn pty(name: &Path) -> (File, PathBuf) {
    // Closed in the programs that other tests start: else the line would live on in them.
    let far = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).expect("a pseudo-terminal");
    grantpt(&far).expect("granted");
    unlockpt(&far).expect("unlocked");
    let mut settings = tcgetattr(&far).expect("settings");
    settings.make_raw();
    tcsetattr(&far, OptionalActions::Now, &settings).expect("taken");
    let near: PathBuf = ptsname(&far, Vec::new()).expect("it has a name").into_string().expect("a path").into();
    // From the first moment on it is known that nobody has it open, and nothing gathers in it.
    drop(open_near(&near));
    std::os::unix::fs::symlink(&near, name).expect("linked");
    (File::from(far), near)
}

fn open_near(near: &Path) -> File {
    let no_terminal = OFlags::NOCTTY.bits() as i32;
    File::options().read(true).write(true).custom_flags(no_terminal).open(near).expect("it is there")
}

fn bridge<D: Device>(
    mut far: File,
    mut flow: Flow,
    mut device: D,
    unplug: &AtomicBool,
    is_enough: impl Fn(u64) -> bool,
) -> D {
    let mut arrived = [0; 4096];
    let mut said: u64 = 0;
    while !unplug.load(Ordering::Relaxed) && !is_enough(said) {
        let count = if is_ready(&far, PollFlags::IN) { far.read(&mut arrived).unwrap_or(0) } else { 0 };
        let mut out = Vec::new();
        device.turn(&arrived[..count], &mut out);
        said += out.len() as u64;
        match &mut flow {
            Flow::Waits => {
                let mut rest = out.as_slice();
                while !rest.is_empty() && !unplug.load(Ordering::Relaxed) && !is_ready(&far, PollFlags::HUP) {
                    if is_ready(&far, PollFlags::OUT) {
                        let count = far.write(&rest[..rest.len().min(256)]).unwrap_or(rest.len());
                        rest = &rest[count..];
                    }
                }
            }
            Flow::Drops { near, frame, said } => {
                for byte in out {
                    frame.push(byte);
                    if byte == 0 {
                        let frame = std::mem::take(frame);
                        let is_lost = ioctl_fionread(&*near).expect("it can be asked") >= HELD;
                        if !is_lost {
                            far.write_all(&frame).expect("there is room");
                        }
                        let mut decoder = Decoder::new();
                        let decoded = frame.iter().filter_map(|&byte| decoder.push::<RobotMessage>(byte)).last();
                        if let Some(Ok((number, _))) = decoded {
                            said.lock().expect("no test panicked with it").push(Sent { number, is_lost });
                        }
                    }
                }
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
    let output = output(&mut barrel(folder, args), "");
    assert!(output.status.success(), "{args:?}: {}{}", text(&output.stdout), text(&output.stderr));
    text(&output.stdout)
}

/// Runs `barrel`, which must fail with this exit code, and returns what it complained of.
pub fn fail(folder: &Path, code: i32, args: &[&str]) -> String {
    let Output { status, stderr, .. } = output(&mut barrel(folder, args), "");
    assert_eq!(status.code(), Some(code), "{args:?}: {}", text(&stderr));
    text(&stderr)
}

/// A command takes no longer than this.
const LIMIT: Duration = Duration::from_secs(120);

/// Runs a command that hears `input`, and returns what it said. It must end in time.
pub fn output(command: &mut Command, input: &str) -> Output {
    output_within(LIMIT, command, input)
}

/// As [`output`], within this time.
pub fn output_within(limit: Duration, command: &mut Command, input: &str) -> Output {
    let piped = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = piped.spawn().expect("it starts");
    // Who ends before it has heard everything does not want to know.
    let _ = child.stdin.take().expect("piped").write_all(input.as_bytes());
    let [stdout, stderr]: [JoinHandle<Vec<u8>>; 2] = [
        Box::new(child.stdout.take().expect("piped")) as Box<dyn Read + Send>,
        Box::new(child.stderr.take().expect("piped")),
    ]
    .map(|mut pipe| {
        std::thread::spawn(move || {
            let mut said = Vec::new();
            let _ = pipe.read_to_end(&mut said);
            said
        })
    });
    let status = wait_within(limit, &mut child);
    let [stdout, stderr] = [stdout, stderr].map(|said| said.join().expect("read"));
    let Some(status) = status else {
        panic!("{command:?} did not end within {limit:?} and was killed: {}{}", text(&stdout), text(&stderr));
    };
    Output { status, stdout, stderr }
}

/// Waits for a child to end; it is killed when the time is up.
fn wait_within(limit: Duration, child: &mut Child) -> Option<ExitStatus> {
    let until = Instant::now() + limit;
    while Instant::now() < until {
        if let Some(status) = child.try_wait().expect("it can be waited for") {
            return Some(status);
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().expect("killed");
    child.wait().expect("dead");
    None
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

    /// Sends it a signal, as `kill` calls it.
    pub fn signal(&self, name: &str) {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args([name, &id]).status().expect("kill starts").success());
    }

    /// Presses Ctrl-C, and returns the rest of what it says; it must end well.
    pub fn interrupt(self) -> String {
        self.interrupted(0).0
    }

    /// Presses Ctrl-C, and returns the rest of what it says and what it complains of; it must end with this exit code.
    pub fn interrupted(mut self, code: i32) -> (String, String) {
        self.signal("-INT");
        let status = wait_within(LIMIT, &mut self.child);
        let rest: Vec<String> = self.lines.iter().collect();
        let mut complaint = String::new();
        let _ = self.child.stderr.take().map(|mut stderr| stderr.read_to_string(&mut complaint));
        assert_eq!(status.and_then(|s| s.code()), Some(code), "{:#?} {rest:#?} {complaint}", self.said);
        (rest.join("\n"), complaint)
    }
}

impl Drop for Running {
    /// A test that has failed leaves nothing running.
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A monitor that was held up.
pub struct HeldUp {
    /// How long the robot lived meanwhile, ms.
    pub meanwhile: u64,
    /// Frames lost, as the monitor counts them by the gaps in their numbers.
    pub counted: u64,
    /// Frames that found no room on the line, from the first to the last that is in the log.
    pub dropped: u64,
}

/// Lets a monitor watch `device` on a line without flow control, into `watch.mcap`, and holds the monitor up for two seconds at
/// least, until frames have been lost.
pub fn hold_up(folder: &Path, device: impl Device, lived: &AtomicU64) -> HeldUp {
    let (plugged, said) = Plugged::without_flow_control(&folder.join("robot"), device);
    let mut monitor = Running::start(folder, &["monitor", "--port", "./robot", "--log", "watch.mcap"]);
    monitor.wait_for("battery");
    let lost = || said.lock().expect("the bridge goes on").iter().filter(|sent| sent.is_lost).count();
    monitor.signal("-STOP");
    let (start, lost_before, lived_before) = (Instant::now(), lost(), lived.load(Ordering::Relaxed));
    while start.elapsed() < Duration::from_secs(2) || lost() < lost_before + 50 {
        assert!(start.elapsed() < LIMIT, "nothing is lost while nobody reads");
        std::thread::sleep(Duration::from_millis(10));
    }
    let meanwhile = lived.load(Ordering::Relaxed) - lived_before;
    monitor.signal("-CONT");
    // Once a second, and one or two of them may have been said before.
    (0..4).for_each(|_| drop(monitor.wait_for("steps/s")));
    let summary = monitor.interrupt();
    plugged.unplug();
    let counted = summary.split_once(" frames lost").and_then(|(before, _)| before.rsplit(' ').next()?.parse().ok());

    let mut decoder = Decoder::new();
    let frames = Reader::open(&folder.join("watch.mcap")).expect("a log").map(|entry| entry.expect("an undamaged log"));
    let bytes = frames.filter_map(|entry| match entry {
        Entry::Frame { direction: Direction::ToHost, bytes, .. } => Some(bytes),
        _ => None,
    });
    let heard: Vec<u16> = bytes
        .flatten()
        .filter_map(|byte| decoder.push::<RobotMessage>(byte))
        .filter_map(|decoded| Some(decoded.ok()?.0))
        .collect();
    let (Some(first), Some(last)) = (heard.first(), heard.last()) else { panic!("the log holds nothing of the robot") };
    let said = said.lock().expect("the bridge has ended");
    let between = said.iter().skip_while(|sent| sent.number != *first).take_while(|sent| sent.number != *last);
    let dropped = between.filter(|sent| sent.is_lost).count() as u64;
    assert!(dropped >= 50, "the log ends before the gap: {dropped} frames were lost until then");
    HeldUp { meanwhile, counted: counted.expect("the summary says what was lost"), dropped }
}

/// Types `script` into a console, which must end well, and returns what it said.
pub fn talk(folder: &Path, args: &[&str], script: &str) -> String {
    let args = [&["console"][..], &OVER_SERIAL, args].concat();
    let output = output(&mut barrel(folder, &args), script);
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
