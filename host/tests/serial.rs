//! A robot on a serial line: the same run as in process, whatever the line does to it; and the console on a bench.
#![cfg(unix)]

mod bench;

use barrel::log::{Entry, Reader};
use bench::{
    BenchRobot, Counted, Mute, Noisy, OVER_SERIAL, Plugged, Running, Satellites, Stranger, fail, in_turn,
    output_within, succeed, talk,
};
use firmware::Port;
use hil_sim::link::Direction;
use protocol::message::{MemoryState, Precision, ResetCause, SafetyState};
use protocol::{Decoder, HostMessage, RobotMessage};
use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tempfile::TempDir;

fn read(folder: &Path, file: &str) -> String {
    fs::read_to_string(folder.join(file)).expect("readable")
}

fn metadata(folder: &Path, log: &str) -> std::collections::BTreeMap<String, String> {
    Reader::open(&folder.join(log)).expect("a log").run()
}

/// What the host has said, and what has happened, as a log has it.
fn requests_and_events(path: &Path) -> (Vec<HostMessage>, Vec<String>) {
    let (mut requests, mut events, mut decoder) = (Vec::new(), Vec::new(), Decoder::new());
    let mut reader = Reader::open(path).expect("a log");
    for entry in reader.by_ref() {
        match entry.expect("an undamaged log") {
            Entry::Frame { direction: Direction::ToRobot, bytes, .. } => {
                let messages = bytes.iter().filter_map(|&byte| decoder.push::<HostMessage>(byte));
                requests.extend(messages.flatten().map(|(_, message)| message));
            }
            Entry::Event(event) => events.push(format!("{}: {}", event.kind, event.text)),
            _ => {}
        }
    }
    assert!(!reader.truncated(), "the log is not complete");
    (requests, events)
}

#[test]
fn a_run_over_a_serial_line_gives_the_bytes_of_a_run_in_process() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let _robot = Plugged::new(&f.join("robot"), BenchRobot::new(false));
    for (body, seconds) in [("chapter", "4"), ("tabletop", "1")] {
        let run = ["run", "homeokinetic", "--body", body, "--seed", "7", "--duration", seconds];
        succeed(f, &[&run[..], &["--csv", "here.csv"]].concat());
        succeed(f, &[&run[..], &OVER_SERIAL, &["--csv", "there.csv", "--log", "there.mcap"]].concat());
        assert!(read(f, "here.csv") == read(f, "there.csv"), "{body} differs");
        let about = metadata(f, "there.mcap");
        assert_eq!(about["link"], "serial:./robot");
        assert_eq!(about["precision"], "f32");
        assert!(about["command"].contains("--link serial:./robot"), "{about:?}");
        let said = succeed(f, &["replay", "there.mcap"]);
        assert!(said.contains("bit for bit"), "{said}");
    }
}

#[test]
fn lost_and_made_up_bytes_cost_time_and_nothing_else() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    for (body, seconds, one_in) in [("chapter", "2", 600), ("tabletop", "0.5", 1500)] {
        let touched = Arc::new(Mutex::new(0));
        let noisy = Noisy { device: BenchRobot::new(false), random: 5, one_in, touched: Arc::clone(&touched) };
        let robot = Plugged::new(&f.join("robot"), noisy);
        let run = ["run", "homeokinetic", "--body", body, "--seed", "3", "--duration", seconds];
        succeed(f, &[&run[..], &["--csv", "here.csv"]].concat());
        succeed(f, &[&run[..], &OVER_SERIAL, &["--csv", "there.csv", "--log", "there.mcap"]].concat());
        let touched = *touched.lock().expect("nobody panicked");
        assert!(touched >= 10, "{touched} bytes were touched: the line was too good to prove anything");
        assert!(read(f, "here.csv") == read(f, "there.csv"), "{body} differs");
        let said = succeed(f, &["replay", "there.mcap"]);
        assert!(said.contains("bit for bit"), "{said}");
        robot.unplug();
    }
}

#[test]
fn a_robot_that_is_unplugged_in_mid_run_leaves_a_whole_recording() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let _robot = Plugged::until(&f.join("robot"), BenchRobot::new(false), |said| said > 20_000);
    let files = ["--csv", "run.csv", "--log", "run.mcap", "--plot", "run.png"];
    let run = [&["run", "homeokinetic", "--duration", "100"][..], &OVER_SERIAL, &files].concat();
    let said = fail(f, 1, &run);
    for words in ["gone", "unplugged", "recorded until then", "run.csv"] {
        assert!(said.contains(words), "'{words}' is not said: {said}");
    }
    let table = barrel::csv::read(&f.join("run.csv")).expect("a whole CSV");
    assert!((50..300).contains(&table.rows()), "{} rows", table.rows());
    let (logged, truncated) = barrel::log::read_table(&f.join("run.mcap")).expect("a whole log");
    assert!(!truncated);
    assert_eq!(logged.rows(), table.rows());
    assert!(f.join("run.png").is_file());
}

#[test]
fn ctrl_c_leaves_the_robot_disarmed_and_the_files_complete() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let robot = Plugged::new(&f.join("robot"), BenchRobot::new(false));
    let files = ["--csv", "run.csv", "--log", "run.mcap", "--plot", "run.png"];
    let run = Running::start(f, &[&["run", "homeokinetic", "--duration", "100000"][..], &OVER_SERIAL, &files].concat());
    // It is well under way.
    while fs::metadata(f.join("run.mcap")).map_or(0, |log| log.len()) < 50_000 {
        std::thread::sleep(Duration::from_millis(10));
    }
    let (said, complaint) = run.interrupted(130);
    assert!(said.contains("The barrel"), "the summary is not said: {said}");
    for words in ["interrupted", "recorded until then", "run.csv", "run.mcap", "run.png"] {
        assert!(complaint.contains(words), "'{words}' is not said: {complaint}");
    }
    assert!(robot.unplug().is_left_in_order());
    let (requests, _) = requests_and_events(&f.join("run.mcap"));
    assert_eq!(requests[requests.len() - 2..], [HostMessage::Disarm, HostMessage::SimulatedSensors(false)]);
    let table = barrel::csv::read(&f.join("run.csv")).expect("a whole CSV");
    assert_eq!(table.rows(), barrel::log::read_table(&f.join("run.mcap")).expect("a whole log").0.rows());
    assert!(f.join("run.png").is_file());
}

#[test]
fn a_robot_that_is_reset_in_mid_run_ends_it_and_the_log_says_so() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let robot = BenchRobot::new(false);
    let wishes = Arc::clone(&robot.wishes);
    let once = Mutex::new(Some(ResetCause::Watchdog));
    let _robot = Plugged::until(&f.join("robot"), robot, move |said| {
        if said > 20_000
            && let Some(cause) = once.lock().expect("nobody panicked").take()
        {
            wishes.lock().expect("nobody panicked").reset = Some(cause);
        }
        false
    });
    let files = ["--csv", "run.csv", "--log", "run.mcap"];
    let said = fail(f, 1, &[&["run", "homeokinetic", "--duration", "1000"][..], &OVER_SERIAL, &files].concat());
    for words in ["was reset at", "the watchdog was not fed", "recorded until then", "run.csv"] {
        assert!(said.contains(words), "'{words}' is not said: {said}");
    }
    let (_, events) = requests_and_events(&f.join("run.mcap"));
    assert!(events.iter().any(|event| event.starts_with("reset: ") && event.contains("watchdog")), "{events:#?}");
    assert!((50..300).contains(&barrel::csv::read(&f.join("run.csv")).expect("a whole CSV").rows()));
}

#[test]
fn a_place_that_cannot_be_written_is_refused_before_the_robot_hears_of_it() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let robot = Counted::new(BenchRobot::new(false));
    let arrived = Arc::clone(&robot.arrived);
    let _robot = Plugged::new(&f.join("robot"), robot);
    for command in [
        &["run", "--link", "serial:./robot", "--log", "no/such/x.mcap"][..],
        &["run", "--link", "serial:./robot", "--csv", "no/such/x.csv"],
        &["run", "--link", "serial:./robot", "--plot", "no/such/x.png"],
        &["console", "--link", "serial:./robot", "--simulate", "--log", "no/such/x.mcap"],
        &["console", "--link", "serial:./robot", "--log", "no/such/x.mcap"],
        &["monitor", "--port", "./robot", "--log", "no/such/x.mcap"],
    ] {
        let said = fail(f, 2, command);
        assert!(said.contains("no/such/x"), "{said}");
        assert_eq!(arrived.load(Ordering::Relaxed), 0, "{command:?} spoke to the robot first");
    }
    fs::write(f.join("runs"), "not a folder").expect("written");
    for command in [&["run", "--link", "serial:./robot"][..], &["monitor", "--port", "./robot"]] {
        assert!(fail(f, 2, command).contains("cannot write runs"));
        assert_eq!(arrived.load(Ordering::Relaxed), 0, "{command:?} spoke to the robot first");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_leaves_the_robot_disarmed_and_the_other_files_complete() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let mut robot = BenchRobot::new(false);
    for (files, code) in [
        // Full when the log is begun; full on the way.
        (["--csv", "run.csv", "--log", "/dev/full"], 2),
        (["--csv", "/dev/full", "--log", "run.mcap"], 1),
    ] {
        let plugged = Plugged::new(&f.join("robot"), robot);
        let run = ["run", "homeokinetic", "--duration", "20"];
        let said = fail(f, code, &[&run[..], &OVER_SERIAL, &files].concat());
        assert!(said.contains("/dev/full") && said.contains("No space left"), "{said}");
        robot = plugged.unplug();
        assert!(robot.is_left_in_order(), "{said}");
        assert_eq!(said.contains("run.mcap"), code == 1, "{said}");
    }
    let (requests, _) = requests_and_events(&f.join("run.mcap"));
    assert_eq!(requests[requests.len() - 2..], [HostMessage::Disarm, HostMessage::SimulatedSensors(false)]);
}

#[test]
fn a_console_whose_robot_is_unplugged_says_where_its_recording_is() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let _robot = Plugged::until(&f.join("robot"), BenchRobot::new(false), |said| said > 20_000);
    let console = ["console", "--simulate", "--speed", "1000", "--duration", "1000"];
    let files = ["--csv", "talk.csv", "--log", "talk.mcap"];
    let said = fail(f, 1, &[&console[..], &OVER_SERIAL, &files].concat());
    for words in ["gone", "recorded until then", "talk.csv, talk.mcap"] {
        assert!(said.contains(words), "'{words}' is not said: {said}");
    }
    assert!(barrel::csv::read(&f.join("talk.csv")).expect("a whole CSV").rows() > 50);
    requests_and_events(&f.join("talk.mcap"));
}

#[test]
fn a_command_that_does_not_end_is_killed_and_named() {
    let waits = || output_within(Duration::from_millis(200), Command::new("sleep").arg("60"), "");
    let panicked = std::panic::catch_unwind(waits).expect_err("it sleeps on");
    let said = panicked.downcast::<String>().expect("words");
    assert!(said.contains("sleep") && said.contains("did not end within 200ms"), "{said}");
}

#[test]
fn a_port_that_is_not_there_is_no_port_or_is_in_use_is_named() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let said = fail(f, 2, &["run", "homeokinetic", "--link", "serial:no-such-port"]);
    assert!(said.contains("no serial port /dev/no-such-port") && said.contains("USB"), "{said}");
    fs::write(f.join("file"), "").expect("written");
    let said = fail(f, 2, &["run", "homeokinetic", "--link", "serial:./file"]);
    assert!(said.contains("./file cannot be used as a serial port"), "{said}");
    let _robot = Plugged::new(&f.join("robot"), BenchRobot::new(false));
    let port = serialport::new(f.join("robot").to_string_lossy(), 9600).open().expect("opened by somebody else");
    let said = fail(f, 2, &[&["run", "homeokinetic"][..], &OVER_SERIAL].concat());
    assert!(said.contains("in use"), "{said}");
    drop(port);
    succeed(f, &[&["run", "homeokinetic", "--duration", "0.1", "--csv", "run.csv"][..], &OVER_SERIAL].concat());
    assert!(!f.join("runs").exists(), "a refused run leaves no folder");
}

#[test]
fn what_is_no_robot_of_this_build_is_told_apart() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let run = [&["run", "homeokinetic"][..], &OVER_SERIAL].concat();
    let mute = Plugged::new(&f.join("robot"), Mute);
    let said = fail(f, 2, &run);
    assert!(said.contains("nothing on ./robot answers") && said.contains("57600"), "{said}");
    mute.unplug();
    let satellites = Plugged::new(&f.join("robot"), Satellites);
    let said = fail(f, 2, &run);
    assert!(said.contains("nothing on ./robot answers"), "{said}");
    satellites.unplug();
    for (version, schema, words) in
        [(protocol::VERSION + 1, protocol::SCHEMA, "version"), (protocol::VERSION, !protocol::SCHEMA, "schema")]
    {
        let hello = RobotMessage::Hello {
            version,
            schema,
            firmware: [9, 9, 9],
            precision: Precision::F32,
            state: SafetyState::Disarmed,
            reset: ResetCause::PowerOn,
            memory: MemoryState::Absent,
        };
        let stranger = Plugged::new(&f.join("robot"), Stranger(Port::default(), hello));
        let said = fail(f, 2, &run);
        assert!(said.contains(words), "'{words}' is not said: {said}");
        stranger.unplug();
    }
}

#[test]
fn a_robot_has_its_own_precision() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let _robot = Plugged::new(&f.join("robot"), BenchRobot::new(false));
    let run = [&["run", "homeokinetic", "--duration", "0.1", "--csv", "run.csv"][..], &OVER_SERIAL].concat();
    let said = fail(f, 2, &[&run[..], &["--precision", "f64"]].concat());
    assert!(said.contains("f32") && said.contains("--precision"), "{said}");
    succeed(f, &[&run[..], &["--precision", "f32"]].concat());
}

#[test]
fn the_console_homes_arms_sets_calibrates_and_stores_a_robot_on_the_bench() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let robot = Plugged::new(&f.join("robot"), BenchRobot::new(true));
    let script = "arm\ncalibrate still\ncalibrate up +2\ncalibrate status\nhome\nepsC = 0.2\narm\ncalibrate still\ndisarm\n\
                  epsA = 0.07\nfriction\nstore set.txt\nsave\npush 1 1\nstop\narm\nclear\nstatus\n";
    let said = talk(f, &["--log", "talk.mcap"], script);
    in_turn(
        &said,
        &[
            "firmware 0.1.0",
            "power on",
            "home first",
            "averaging",
            "the gyroscope's bias is found",
            "averaging",
            "taken; attitudes still to come: +1 -1 +c -c -2",
            "taken; attitudes still to come: +1 -1 +c -c -2",
            "homing:",
            "homed: the middle",
            "epsC = 0.2",
            "Armed",
            "disarm first",
            "Disarmed",
            "epsA = 0.07",
            "friction is the simulator's",
            "stored in set.txt",
            "in the robot's memory",
            "--simulate",
            "Fault: emergency stop",
            "clear the fault first",
            "Disarmed",
            "the middle of its axes is known",
            "written: talk.mcap",
        ],
    );
    let set = read(f, "set.txt");
    assert!(set.contains("epsA = 0.07 ") && set.contains("# friction is not here"), "{set}");
    let (table, truncated) = barrel::log::read_table(&f.join("talk.mcap")).expect("a log");
    assert!(table.rows() > 100 && !truncated, "{} rows", table.rows());
    // After the next power-on it is as it was saved.
    let mut robot = robot.unplug();
    robot.wishes.lock().expect("nobody panicked").reset = Some(ResetCause::PowerOn);
    bench::Device::turn(&mut robot, &[], &mut Vec::new());
    let _robot = Plugged::new(&f.join("robot"), robot);
    in_turn(
        &talk(f, &[], "epsA\nforget\n"),
        &["parameters and calibration in its memory", "epsA = 0.07", "memory is empty"],
    );
}

#[test]
fn homing_can_be_stopped_and_what_was_typed_behind_it_waits_until_then() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let _robot = Plugged::new(&f.join("robot"), BenchRobot::new(false));
    let said = talk(f, &[], "home\nstatus\nstop\nepsA = 0.5\nsave\nclear\nhome\nepsA = 0.6\n");
    in_turn(&said, &["homing:", "firmware", "Fault: emergency stop", "epsA = 0.5", "no memory", "Disarmed", "homing:"]);
    in_turn(&said, &["epsA = 0.5", "homed: the middle", "epsA = 0.6"]);
    assert_eq!(said.matches("homed: the middle").count(), 1, "{said}");
}

#[test]
fn a_console_that_simulates_over_a_serial_line_is_that_of_a_run() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let _robot = Plugged::new(&f.join("robot"), BenchRobot::new(false));
    let said = talk(
        f,
        &["--simulate", "--speed", "1000", "--duration", "2", "--log", "talk.mcap"],
        "pause\nepsA = 0.3\nfriction = 0.3\npush 1 0.5\nsave\nhome\ngo\n",
    );
    in_turn(&said, &["paused", "epsA = 0.3", "friction = 0.3", "pushing", "no memory", "tabletop", "going on"]);
    assert!(succeed(f, &["replay", "talk.mcap"]).contains("bit for bit"));
}

#[test]
fn options_of_a_simulated_run_have_no_place_on_a_bench() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let _robot = Plugged::new(&f.join("robot"), BenchRobot::new(false));
    for option in [&["--set", "epsA=0.2"][..], &["--push", "1:1:1"], &["--csv", "x.csv"], &["--speed", "2"]] {
        let said = fail(f, 2, &[&["console"][..], &OVER_SERIAL, option].concat());
        assert!(said.contains("--simulate"), "{option:?}: {said}");
    }
}
