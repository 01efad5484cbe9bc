//! The monitor: whatever happens to robot and line, it goes on, says so, and its log is whole.
#![cfg(unix)]

mod bench;

use barrel::log::{Entry, Reader};
use bench::{BenchRobot, DeafTo, Mute, Paced, Plugged, Running, Satellites, fail, hold_up};
use firmware::Robot;
use hil_sim::link::Direction;
use protocol::message::ResetCause;
use protocol::{Decoder, HostMessage, RobotMessage, Telemetry};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;
use tempfile::TempDir;

/// What is in a log.
#[derive(Default)]
struct Contents {
    /// Times of the control steps, s.
    steps: Vec<f64>,
    /// Log times of all frames, ns.
    frames: Vec<u64>,
    /// Ticks of all telemetry in the frames.
    ticks: Vec<u32>,
    vitals: usize,
    events: Vec<String>,
    truncated: bool,
}

fn contents(path: &Path) -> Contents {
    let mut reader = Reader::open(path).expect("a log");
    let mut contents = Contents::default();
    let mut decoder = Decoder::new();
    for entry in reader.by_ref() {
        match entry.expect("an undamaged log") {
            Entry::Brain(brain) => contents.steps.push(brain.t),
            Entry::Frame { time, direction, bytes } => {
                contents.frames.push(time);
                if direction == Direction::ToHost {
                    let messages = bytes.iter().filter_map(|&byte| decoder.push::<RobotMessage>(byte));
                    contents.ticks.extend(messages.flatten().filter_map(|(_, message)| match message {
                        RobotMessage::Telemetry(telemetry) => Some(telemetry.tick),
                        _ => None,
                    }));
                }
            }
            Entry::Vitals { .. } => contents.vitals += 1,
            Entry::Event(event) => contents.events.push(format!("{}: {}", event.kind, event.text)),
            Entry::Plant { .. } => panic!("there is no simulated barrel"),
        }
    }
    contents.truncated = reader.truncated();
    contents
}

#[test]
fn resets_gaps_and_an_unplugged_robot_are_seen_and_the_log_goes_on() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let robot = BenchRobot::new(true);
    let wishes = Arc::clone(&robot.wishes);
    let plugged = Plugged::new(&f.join("robot"), robot);
    // It was there first: nobody waits for the monitor.
    let mut monitor = Running::start(f, &["monitor", "--port", "./robot", "--log", "watch.mcap"]);
    let found = monitor.wait_for("found the robot on ./robot@460800");
    assert!(found.contains("firmware 0.1.0") && found.contains("power on"), "{found}");
    monitor.wait_for("battery 12.0 V");

    wishes.lock().expect("nobody panicked").lose = 5;
    monitor.wait_for("lost 5  ");

    wishes.lock().expect("nobody panicked").reset = Some(ResetCause::Watchdog);
    monitor.wait_for("its brain began anew");
    monitor.wait_for("was reset: the watchdog was not fed");
    // What was never sent is no gap.
    monitor.wait_for("lost 5  ");

    let robot = plugged.unplug();
    monitor.wait_for("looking for the robot");
    let plugged = Plugged::new(&f.join("robot"), robot);
    monitor.wait_for("found the robot on ./robot@460800 again");
    monitor.wait_for("lost 5  ");

    wishes.lock().expect("nobody panicked").silent = true;
    monitor.wait_for("does not answer");
    wishes.lock().expect("nobody panicked").silent = false;
    monitor.wait_for("steps/s");

    let summary = monitor.interrupt();
    assert!(summary.contains("5 frames lost") && summary.contains("watch.mcap"), "{summary}");
    plugged.unplug();

    let log = contents(&f.join("watch.mcap"));
    assert!(!log.truncated);
    assert!(log.steps.len() > 100 && log.steps.windows(2).all(|t| t[0] < t[1]), "{} steps", log.steps.len());
    assert!(log.frames.windows(2).all(|time| time[0] <= time[1]), "the log's time goes back");
    assert!(log.ticks.len() >= log.steps.len(), "every step's frame is there, too");
    assert!(log.vitals > 2, "{} vitals", log.vitals);
    for words in ["connected:", "Fault: the watchdog", "restart:", "reset: the robot was reset", "gone:", "silent:"] {
        assert!(log.events.iter().any(|event| event.contains(words)), "no '{words}' in {:#?}", log.events);
    }
}

#[test]
fn a_killed_monitor_loses_a_second_at_most() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let _robot = Plugged::new(&f.join("robot"), BenchRobot::new(false));
    let mut monitor = Running::start(f, &["monitor", "--port", "./robot", "--log", "watch.mcap"]);
    monitor.wait_for("tick");
    let line = monitor.wait_for("tick");
    monitor.child.kill().expect("killed");
    monitor.child.wait().expect("dead");
    let tick = line.split_once("tick ").and_then(|(_, rest)| rest.split(' ').next()).expect("a number");
    let tick: u32 = tick.parse().expect("a number");
    let log = contents(&f.join("watch.mcap"));
    assert!(log.truncated, "it was killed");
    let last = *log.ticks.last().expect("control steps");
    assert!(last + 51 >= tick, "the log ends at tick {last}, {tick} had been seen");
}

#[test]
fn a_named_port_without_a_robot_is_refused_and_nothing_is_written() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let said = fail(f, 2, &["monitor", "--port", "./robot"]);
    assert!(said.contains("no serial port ./robot"), "{said}");
    let mute = Plugged::new(&f.join("robot"), Mute);
    let said = fail(f, 2, &["monitor", "--port", "./robot", "--log", "watch.mcap"]);
    assert!(said.contains("nothing on ./robot answers"), "{said}");
    mute.unplug();
    let satellites = Plugged::new(&f.join("robot"), Satellites);
    let said = fail(f, 2, &["monitor", "--port", "./robot", "--log", "watch.mcap"]);
    assert!(said.contains("nothing on ./robot answers"), "{said}");
    satellites.unplug();
    let said = fail(f, 2, &["monitor", "--port", "./robot", "--log", "no/such/folder.mcap"]);
    assert!(said.contains("no/such/folder.mcap"), "{said}");
    assert_eq!(std::fs::read_dir(f).expect("readable").count(), 0);
}

#[test]
fn without_a_place_the_log_is_in_a_new_folder_and_it_ends_by_itself() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let _robot = Plugged::new(&f.join("robot"), BenchRobot::new(false));
    let said = bench::succeed(f, &["monitor", "--port", "./robot@57600", "--duration", "1.5"]);
    let path = said.lines().find(|line| line.ends_with("run.mcap")).expect("the place is said").trim();
    let log = f.join(path);
    assert!(path.starts_with("runs/") && path.contains("-monitor"), "{said}");
    let about = Reader::open(&log).expect("a log");
    assert_eq!(about.run()["link"], "serial:./robot@57600");
}

#[test]
fn a_robot_that_is_gone_before_its_parameters_are_known_is_looked_for_and_leaves_no_folder() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    // A monitor whose robot was found and lost again.
    let bereft = || {
        let robot = DeafTo::new(BenchRobot::new(false), |message| matches!(message, HostMessage::GetParameter { .. }));
        let is_deaf = Arc::clone(&robot.is_deaf);
        let plugged = Plugged::new(&f.join("robot"), robot);
        let mut monitor = Running::start(f, &["monitor", "--port", "./robot"]);
        while !is_deaf.load(Ordering::Relaxed) {
            std::thread::sleep(Duration::from_millis(1));
        }
        plugged.unplug();
        monitor.wait_for("looking for the robot");
        assert!(!f.join("runs").exists(), "there is nothing to put into a folder");
        monitor
    };
    let (_, complaint) = bereft().interrupted(1);
    assert!(complaint.contains("before its parameters were known"), "{complaint}");
    assert_eq!(std::fs::read_dir(f).expect("readable").count(), 0);

    let mut monitor = bereft();
    let _robot = Plugged::new(&f.join("robot"), BenchRobot::new(false));
    monitor.wait_for("found the robot");
    monitor.wait_for("battery");
    let summary = monitor.interrupt();
    let path = summary.lines().find(|line| line.ends_with("run.mcap")).expect("the place is said").trim();
    let log = contents(&f.join(path));
    assert!(!log.truncated && log.steps.len() > 50, "{} steps", log.steps.len());
    assert_eq!(std::fs::read_dir(f.join("runs")).expect("readable").count(), 1);
}

#[test]
fn the_last_words_of_a_robot_that_is_gone_are_in_the_log() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let robot = BenchRobot::new(false);
    let wishes = Arc::clone(&robot.wishes);
    let plugged = Plugged::new(&f.join("robot"), robot);
    let mut monitor = Running::start(f, &["monitor", "--port", "./robot", "--log", "watch.mcap"]);
    monitor.wait_for("battery");
    let last = Telemetry { tick: 4_000_000_000, ..Robot::<f32>::default().telemetry() };
    {
        let mut wishes = wishes.lock().expect("nobody panicked");
        (wishes.silent, wishes.last_words) = (true, Some(RobotMessage::Telemetry(last)));
    }
    // It speaks when it is asked whether it is still there, and does not answer that; who asks again has heard it.
    while wishes.lock().expect("nobody panicked").asked < 6 {
        std::thread::sleep(Duration::from_millis(1));
    }
    plugged.unplug();
    monitor.wait_for("looking for the robot");
    monitor.interrupt();
    assert_eq!(contents(&f.join("watch.mcap")).ticks.last(), Some(&last.tick));
}

#[test]
fn what_is_lost_while_the_monitor_is_held_up_is_counted_to_the_frame() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let robot = Paced::new(BenchRobot::new(false), BenchRobot::lived);
    let lived = Arc::clone(&robot.lived);
    let held = hold_up(f, robot, &lived);
    assert!(held.meanwhile >= 1000, "the robot lived {} ms while the monitor did not", held.meanwhile);
    assert_eq!(held.counted, held.dropped);
}
