//! Looking for a robot among all that is plugged in: it is found, and nothing else is bothered for long.
#![cfg(unix)]

mod bench;

use barrel::reach::Finder;
use bench::{BenchRobot, Counted, Loopback, Mute, Plugged, Satellites, fail};
use hil_sim::link::serial::{Port, PortKind};
use hil_sim::link::{Serial, Transport};
use std::fs::File;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// The ports that a finder is told of.
type Ports = Arc<Mutex<Vec<Port>>>;

fn finder(ports: &Ports) -> Finder {
    let ports = Arc::clone(ports);
    Finder::among(move || ports.lock().expect("nobody panicked").clone())
}

fn port(path: &Path, kind: PortKind) -> Port {
    Port { name: path.to_str().expect("a path").to_owned(), kind }
}

/// What is said when nobody is found.
fn nobody(finder: &mut Finder, now: Instant) -> Vec<String> {
    finder.look(now).expect_err("nobody is there")
}

/// A file that this user may not open, and that not even root may.
fn forbidden() -> &'static Path {
    let path = Path::new(if cfg!(target_os = "linux") { "/sys/kernel/uevent_seqnum" } else { "/dev/klog" });
    let opened = File::options().read(true).write(true).open(path);
    assert!(opened.is_err(), "{} may be opened", path.display());
    path
}

#[test]
fn the_robot_is_found_behind_whatever_else_is_plugged_in() {
    let folder = TempDir::new().expect("a folder");
    let place = |name: &str| folder.path().join(name);
    let _mute = Plugged::new(&place("mute"), Mute);
    let _satellites = Plugged::new(&place("satellites"), Satellites);
    let _loopback = Plugged::new(&place("loopback"), Loopback);
    let busy = Plugged::new(&place("busy"), Mute);
    let other_program = serialport::new(place("busy").to_string_lossy(), 9600).open().expect("opened");
    let mut ports = vec![
        port(&place("own"), PortKind::Other),
        port(&place("mute"), PortKind::Usb),
        port(&place("satellites"), PortKind::Usb),
        port(&place("loopback"), PortKind::Usb),
        port(&place("busy"), PortKind::Usb),
        port(forbidden(), PortKind::Usb),
    ];
    let told = Ports::default();
    told.lock().expect("nobody panicked").clone_from(&ports);
    let mut finder = finder(&told);
    let start = Instant::now();
    let said = nobody(&mut finder, start);
    let words = ["460800 or 57600 baud", "460800 or 57600 baud", "sends back", "in use", "uevent_seqnum"];
    assert_eq!(said.len(), words.len(), "{said:#?}");
    for (said, words) in said.iter().zip(words) {
        assert!(said.contains(words), "'{words}' is not said: {said}");
    }
    // As long as nothing changes, there is nothing else to say.
    for seconds in [1, 2] {
        assert_eq!(nobody(&mut finder, start + Duration::from_secs(seconds)), said);
    }
    // A port that could not be opened was not asked: it is as soon as it can be.
    drop(other_program);
    busy.unplug();
    let _robot = Plugged::new(&place("busy"), BenchRobot::new(false));
    let found = finder.look(start + Duration::from_secs(3)).expect("a robot");
    assert_eq!(found.address.port, ports.remove(4).name);
}

#[test]
fn a_device_that_is_no_robot_is_left_alone_and_asked_anew_when_it_is_plugged_in_again() {
    let folder = TempDir::new().expect("a folder");
    let device = folder.path().join("device");
    let counted = Counted::new(Mute);
    let arrived = Arc::clone(&counted.arrived);
    let _device = Plugged::new(&device, counted);
    let ports = Ports::new(vec![port(&device, PortKind::Usb)].into());
    let mut finder = finder(&ports);
    let mut before = 0;
    let mut is_asked = |finder: &mut Finder, now| {
        let said = nobody(finder, now);
        let after = arrived.load(Ordering::Relaxed);
        (std::mem::replace(&mut before, after) != after, said)
    };
    let start = Instant::now();
    let mut last = Vec::new();
    for (seconds, asked) in [
        (0, true),
        (1, false),
        (4, false),
        (5, true),
        (6, false),
        (64, false),
        (65, true),
        (66, false),
        (90_000, false),
    ] {
        let (is_asked, said) = is_asked(&mut finder, start + Duration::from_secs(seconds));
        assert_eq!(is_asked, asked, "after {seconds} s");
        last = said;
    }
    assert!(last[0].contains("until it is plugged in again"), "{last:?}");
    let plugged = std::mem::take(&mut *ports.lock().expect("nobody panicked"));
    assert!(!is_asked(&mut finder, start).0);
    *ports.lock().expect("nobody panicked") = plugged;
    assert!(is_asked(&mut finder, start).0, "it was plugged in again");
}

#[test]
fn where_the_robot_was_and_on_the_boards_own_probe_it_is_waited_for() {
    let folder = TempDir::new().expect("a folder");
    let device = folder.path().join("device");
    for (kind, is_known) in [(PortKind::Usb, true), (PortKind::DebugProbe, false)] {
        let ports = Ports::new(vec![port(&device, kind)].into());
        let mut finder = finder(&ports);
        let start = Instant::now();
        if is_known {
            let robot = Plugged::new(&device, BenchRobot::new(false));
            let found = finder.look(start).expect("a robot");
            drop(found.line);
            finder.lost(&found.address);
            robot.unplug();
        }
        let mute = Plugged::new(&device, Mute);
        for second in 1..4 {
            nobody(&mut finder, start + Duration::from_secs(second));
        }
        mute.unplug();
        let robot = Plugged::new(&device, BenchRobot::new(false));
        assert!(finder.look(start + Duration::from_secs(4)).is_ok(), "{kind:?}");
        robot.unplug();
    }
}

#[test]
fn a_named_port_is_asked_at_both_speeds_and_an_echo_is_no_robot() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let mute = Plugged::new(&f.join("robot"), Mute);
    let said = fail(f, 2, &["monitor", "--port", "./robot"]);
    assert!(said.contains("nothing on ./robot") && said.contains("460800 or 57600 baud"), "{said}");
    let said = fail(f, 2, &["monitor", "--port", "./robot@57600"]);
    assert!(said.contains("at 57600 baud"), "{said}");
    mute.unplug();
    let _loopback = Plugged::new(&f.join("robot"), Loopback);
    for command in [&["monitor", "--port", "./robot"][..], &["run", "--link", "serial:./robot"]] {
        let said = fail(f, 2, command);
        assert!(said.contains("sends back what it is sent") && !said.contains("update"), "{said}");
    }
}

#[test]
fn a_port_that_takes_nothing_is_not_called_gone() {
    let folder = TempDir::new().expect("a folder");
    let place = folder.path().join("stuck");
    let _far = bench::line::pty(&place);
    let mut serial = Serial::open(place.to_str().expect("a path"), 460_800).expect("it can be opened");
    serial.set_patience(Duration::from_millis(50)).expect("set");
    // Nobody reads at the other end.
    let said = (0..10_000).find_map(|_| serial.write(&[1; 100]).err()).expect("it is full at last").to_string();
    assert!(said.contains("takes nothing") && !said.contains("gone"), "{said}");
}
