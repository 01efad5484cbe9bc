//! The `barrel` command around the unmodified flash image on the virtual board: in its own process, and through a serial port
//! whose other end is the board's UART.
#![cfg(unix)]

mod bench;

use barrel::log::{Entry, Reader};
use bench::{Device, Noisy, OVER_SERIAL, Paced, Plugged, Running, hold_up, in_turn, succeed, talk};
use hil_sim::experiment::Experiment;
use hil_sim::link::Board;
use hil_sim::setup::{BodyKind, Setup};
use hil_sim::virtual_board::VirtualBoard;
use hil_sim::world::{Command, World};
use protocol::message::Vitals;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use tempfile::TempDir;

const ON_BOARD: [&str; 2] = ["--link", "virtual-board"];

fn image() -> PathBuf {
    std::env::var_os("BARREL_FIRMWARE").expect("`cargo xtask test` builds the image and says where it is").into()
}

fn read(folder: &Path, file: &str) -> Vec<u8> {
    fs::read(folder.join(file)).expect("readable")
}

/// The board in a barrel that lies on the floor, as it lies on a bench: what comes over its line finds it so.
struct OnBench {
    board: VirtualBoard,
    world: World,
    /// Somebody presses the reset button.
    reset: Arc<AtomicBool>,
    /// How long it has lived, ms.
    lived: u64,
}

/// Milliseconds that the board lives in a turn, unless it says something before.
const TURN: usize = 5;

impl OnBench {
    fn new() -> Self {
        let experiment = Experiment::find("homeokinetic").expect("an experiment");
        let mut world = World::new(Setup::new(experiment, BodyKind::Tabletop)).expect("a barrel");
        world.lie_down().expect("it lies");
        OnBench { board: VirtualBoard::power_on(&image()).expect("an image"), world, reset: Arc::default(), lived: 0 }
    }
}

impl Device for OnBench {
    fn turn(&mut self, arrived: &[u8], out: &mut Vec<u8>) {
        if self.reset.swap(false, Ordering::Relaxed) {
            self.board.reset().expect("reset");
        }
        let mut arrived = arrived;
        for _ in 0..TURN {
            let duty = self.board.tick(&self.world.transducers(), arrived, out).expect("the board goes on");
            self.world.advance(1, Command::Duty(duty.map(f64::from)));
            self.lived += 1;
            arrived = &[];
            if !out.is_empty() {
                return;
            }
        }
    }
}

#[test]
fn two_runs_in_the_body_are_the_same_to_the_byte_and_replay_bit_for_bit() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let run = ["run", "homeokinetic", "--body", "tabletop", "--seed", "7", "--duration", "6"];
    for name in ["one", "two"] {
        let (csv, log) = (format!("{name}.csv"), format!("{name}.mcap"));
        succeed(f, &[&run[..], &ON_BOARD, &["--csv", &csv, "--log", &log]].concat());
    }
    assert!(read(f, "one.csv") == read(f, "two.csv"), "the CSVs differ");
    assert!(read(f, "one.mcap") == read(f, "two.mcap"), "the logs differ");
    assert!(succeed(f, &["replay", "one.mcap"]).contains("bit for bit"));
    let mut reader = Reader::open(&f.join("one.mcap")).expect("a log");
    assert_eq!(reader.run()["link"], "virtual-board");
    let vitals = reader.by_ref().filter(|entry| matches!(entry, Ok(Entry::Vitals { .. }))).count();
    assert!(vitals >= 5, "{vitals} seconds of vitals");
}

#[test]
fn the_chapter_s_body_is_the_same_on_the_board_and_in_process() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let run = ["run", "homeostatic", "--push", "1:0.5:0.5", "--seed", "9", "--duration", "10"];
    succeed(f, &[&run[..], &["--csv", "here.csv"]].concat());
    succeed(f, &[&run[..], &ON_BOARD, &["--csv", "there.csv", "--log", "there.mcap"]].concat());
    assert!(read(f, "here.csv") == read(f, "there.csv"), "they differ");
    assert!(succeed(f, &["replay", "there.mcap"]).contains("bit for bit"));
}

#[test]
fn a_console_on_the_board_shows_how_it_does() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let args = ["console", "homeokinetic", "--body", "tabletop", "--speed", "100", "--duration", "3"];
    let mut console = Running::start(f, &[&args[..], &ON_BOARD].concat());
    let mut stdin = console.child.stdin.take().expect("piped");
    std::io::Write::write_all(&mut stdin, b"epsC = 0.2\nstatus\npush 1 0.5\n").expect("taken");
    drop(stdin);
    console.wait_for("epsC = 0.2");
    console.wait_for("it uses its own sensors");
    console.wait_for("core awake");
    console.wait_for("pushing");
    assert!(console.child.wait().expect("ends").success());
}

#[test]
fn a_run_through_a_serial_port_into_the_board_gives_the_bytes_of_a_run_in_process() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let _robot = Plugged::new(&f.join("robot"), OnBench::new());
    for (body, seconds) in [("chapter", "4"), ("tabletop", "1")] {
        let run = ["run", "homeokinetic", "--body", body, "--seed", "7", "--duration", seconds];
        succeed(f, &[&run[..], &["--csv", "here.csv"]].concat());
        succeed(f, &[&run[..], &OVER_SERIAL, &["--csv", "there.csv", "--log", "there.mcap"]].concat());
        assert!(read(f, "here.csv") == read(f, "there.csv"), "{body} differs");
        assert!(succeed(f, &["replay", "there.mcap"]).contains("bit for bit"));
    }
}

#[test]
fn bytes_lost_on_the_way_to_the_board_cost_time_and_nothing_else() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let touched = Arc::new(Mutex::new(0));
    let noisy = Noisy { device: OnBench::new(), random: 11, one_in: 600, touched: Arc::clone(&touched) };
    let _robot = Plugged::new(&f.join("robot"), noisy);
    let run = ["run", "homeokinetic", "--seed", "3", "--duration", "2"];
    succeed(f, &[&run[..], &["--csv", "here.csv"]].concat());
    succeed(f, &[&run[..], &OVER_SERIAL, &["--csv", "there.csv"]].concat());
    let touched = *touched.lock().expect("nobody panicked");
    assert!(touched >= 10, "{touched} bytes were touched: the line was too good to prove anything");
    assert!(read(f, "here.csv") == read(f, "there.csv"), "they differ");
}

#[test]
fn the_console_homes_arms_sets_calibrates_and_stores_the_board() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let robot = Plugged::new(&f.join("robot"), OnBench::new());
    let script = "arm\ncalibrate still\nhome\nepsC = 0.2\narm\ncalibrate still\ndisarm\nepsA = 0.07\nsave\nstop\narm\n\
                  clear\nstatus\n";
    let said = talk(f, &["--log", "talk.mcap"], script);
    in_turn(
        &said,
        &[
            "power on",
            "home first",
            "averaging",
            "the gyroscope's bias is found",
            "homing:",
            "homed: the middle",
            "epsC = 0.2",
            "Armed",
            "disarm first",
            "Disarmed",
            "epsA = 0.07",
            "in the robot's memory",
            "Fault: emergency stop",
            "clear the fault first",
            "Disarmed",
            "the middle of its axes is known",
            "core awake",
            "written: talk.mcap",
        ],
    );
    // After the next power-on it is as it was saved.
    let mut robot = robot.unplug();
    robot.board.power_cycle().expect("comes up again");
    let _robot = Plugged::new(&f.join("robot"), robot);
    in_turn(
        &talk(f, &[], "epsA\nforget\n"),
        &["parameters and calibration in its memory", "epsA = 0.07", "memory is empty"],
    );
}

#[test]
fn the_monitor_records_the_board_through_resets_and_while_it_is_unplugged() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    // It was there first, and has been running for a while.
    let mut robot = OnBench::new();
    (0..200).for_each(|_| robot.turn(&[], &mut Vec::new()));
    let reset = Arc::clone(&robot.reset);
    let plugged = Plugged::new(&f.join("robot"), robot);
    let mut monitor = Running::start(f, &["monitor", "--port", "./robot", "--log", "watch.mcap"]);
    let found = monitor.wait_for("found the robot on ./robot@460800");
    assert!(found.contains("firmware 0.1.0") && found.contains("power on"), "{found}");
    monitor.wait_for("battery 12.0 V");

    reset.store(true, Ordering::Relaxed);
    monitor.wait_for("was reset: the reset button or a debug probe");
    monitor.wait_for("steps/s");

    let mut robot = plugged.unplug();
    monitor.wait_for("looking for the robot");
    robot.board.power_cycle().expect("comes up again");
    let plugged = Plugged::new(&f.join("robot"), robot);
    monitor.wait_for("found the robot on ./robot@460800 again");
    monitor.wait_for("steps/s");
    let summary = monitor.interrupt();
    assert!(summary.contains("watch.mcap"), "{summary}");
    plugged.unplug();

    let (mut steps, mut vitals, mut events) = (0, Vec::new(), Vec::new());
    for entry in Reader::open(&f.join("watch.mcap")).expect("a log") {
        match entry.expect("an undamaged log") {
            Entry::Brain(_) => steps += 1,
            Entry::Vitals { vitals: second, .. } => vitals.push(second),
            Entry::Event(event) => events.push(format!("{}: {}", event.kind, event.text)),
            Entry::Frame { .. } | Entry::Plant { .. } => {}
        }
    }
    assert!(steps > 50 && vitals.len() > 2, "{steps} steps, {} vitals", vitals.len());
    for words in ["connected:", "gone:", "reset: the robot was reset", "last start: power on"] {
        assert!(events.iter().any(|event| event.contains(words)), "no '{words}' in {events:#?}");
    }
}

#[test]
fn a_monitor_that_is_held_up_never_makes_the_board_wait() {
    let folder = TempDir::new().expect("a folder");
    let f = folder.path();
    let board = Paced::new(OnBench::new(), |board| board.lived);
    let lived = Arc::clone(&board.lived);
    let held = hold_up(f, board, &lived);
    assert!(held.meanwhile >= 1000, "the board lived {} ms while the monitor did not", held.meanwhile);
    assert_eq!(held.counted, held.dropped);

    let entries = Reader::open(&f.join("watch.mcap")).expect("a log").map(|entry| entry.expect("an undamaged log"));
    let vitals: Vec<Vitals> = entries
        .filter_map(|entry| match entry {
            Entry::Vitals { vitals, .. } => Some(vitals),
            _ => None,
        })
        .collect();
    let (Some(first), Some(last)) = (vitals.first(), vitals.last()) else { panic!("no vitals were heard") };
    // By its own account, too: its ticks went on, each in its time, and every frame found its UART ready.
    assert!(u64::from(last.ticks - first.ticks) >= held.meanwhile, "{first:?} to {last:?}");
    assert!(vitals.iter().all(|second| second.overruns == 0), "it was made to wait: {vitals:?}");
    assert_eq!(last.unsent, first.unsent, "the line held it up");
}
