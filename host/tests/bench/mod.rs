//! A bench without hardware: `barrel` as a process, and the robot's own code on a simulated barrel at the end of its serial
//! line.
#![allow(dead_code, reason = "each test file uses its part")]

mod device;
pub mod line;

pub use device::*;
pub use line::Plugged;

use barrel::log::{Entry, Reader};
use hil_sim::link::Direction;
use protocol::{Decoder, RobotMessage};
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

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
