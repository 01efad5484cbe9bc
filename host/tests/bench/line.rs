//! A serial line: a pseudo-terminal with a device at its far end. `barrel` opens the near end as the serial port that it is.

use super::Device;
use protocol::{Decoder, RobotMessage};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::OFlags;
use rustix::io::ioctl_fionread;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use std::fs::File;
use std::io::{Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

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
