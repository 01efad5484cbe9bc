//! What a person sees of a robot on a serial line, and does with it.

#![cfg(unix)]

mod bench;

use bench::line::Plugged;
use bench::{BenchRobot, Paced, Window, Wishes, frames, open, until};
use eframe::egui::Key;
use egui_kittest::kittest::Queryable;
use playground::session::LinkState;
use protocol::message::{FaultCode, SafetyState};
use protocol::{Id, RobotMessage};
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

/// A robot on a bench, and a window on it.
struct Bench {
    port: PathBuf,
    robot: Plugged<BenchRobot>,
    wishes: Arc<Mutex<Wishes>>,
    window: Window,
}

impl Bench {
    /// Each test's robot has a port of its own.
    fn new(name: &str) -> Self {
        let port = bench::folder().join(name);
        let robot = BenchRobot::new(true);
        let wishes = robot.wishes.clone();
        let robot = Plugged::new(&port, robot);
        let mut window = open(&["--link", &format!("serial:{}", port.display())]);
        until(&mut window, "the robot is live", |window| window.state().status().link == LinkState::Live);
        until(&mut window, "it is heard", |window| window.state().history().len() > 10);
        Bench { port, robot, wishes, window }
    }
}

fn state(window: &Window) -> Option<SafetyState> {
    window.state().status().state
}

#[test]
fn a_link_is_lost_and_found_again() {
    let Bench { port, robot, mut window, .. } = Bench::new("lost");
    let device = robot.unplug();
    until(&mut window, "the loss is seen", |window| matches!(window.state().status().link, LinkState::Lost(_)));
    window.step();
    assert!(window.query_by_label_contains("Lost").is_some());
    let rows = window.state().history().len();
    frames(&mut window, 5);
    let _robot = Plugged::new(&port, device);
    until(&mut window, "it is found again", |window| window.state().status().link == LinkState::Live);
    until(&mut window, "it is heard again", |window| window.state().history().len() > rows + 10);
    let (history, session) = (window.state().history(), window.state().status().session);
    assert_eq!(session, 1, "what was seen before is kept");
    let times: Vec<f64> = (0..history.len()).filter_map(|row| Some(history.frame(row)?.t)).collect();
    assert!(times.windows(2).all(|t| t[0] <= t[1]), "time goes back");
}

#[test]
fn a_robot_is_homed_armed_disarmed_and_stopped_by_the_big_buttons() {
    let Bench { robot: _robot, mut window, .. } = Bench::new("armed");
    until(&mut window, "it says that it is not homed", |window| window.query_by_label("Home").is_some());
    window.get_by_label("Home").click();
    until(&mut window, "it is homed", |window| {
        window.state().status().vitals.is_some_and(|vitals| vitals.homed)
            && state(window) == Some(SafetyState::Disarmed)
    });
    frames(&mut window, 3);
    window.get_by_label("Arm").click();
    until(&mut window, "it is armed", |window| state(window) == Some(SafetyState::Armed));
    frames(&mut window, 3);
    window.get_by_label("Disarm").click();
    until(&mut window, "it is disarmed", |window| state(window) == Some(SafetyState::Disarmed));
    window.key_press(Key::Escape);
    let stopped = Some(SafetyState::Fault(FaultCode::EmergencyStop));
    until(&mut window, "it is stopped", |window| state(window) == stopped);
}

#[test]
fn a_stop_that_is_asked_for_while_the_link_is_lost_is_given_when_it_is_found() {
    let Bench { port, robot, mut window, .. } = Bench::new("stop");
    let device = robot.unplug();
    until(&mut window, "the loss is seen", |window| matches!(window.state().status().link, LinkState::Lost(_)));
    window.step();
    window.get_by_label("STOP").click();
    frames(&mut window, 5);
    let _robot = Plugged::new(&port, device);
    let stopped = Some(SafetyState::Fault(FaultCode::EmergencyStop));
    until(&mut window, "it is stopped", |window| state(window) == stopped);
}

#[test]
fn a_knob_reaches_the_robot_and_an_experiment_gives_it_its_parameters() {
    let Bench { robot: _robot, mut window, .. } = Bench::new("knob");
    let held = |window: &Window, id| window.state().status().values.as_ref().map(|values| values.get(id));
    window.get_by_label("Experiment").click();
    frames(&mut window, 3);
    window.get_by_label("homeostatic (Experiment 2.2)").click();
    until(&mut window, "the robot learns by Eq. 9", |window| held(window, Id::Rule) == Some(2.0));
}

#[test]
fn a_robot_that_falls_silent_lags_then_is_lost_and_comes_back_when_it_speaks() {
    let Bench { robot: _robot, wishes, mut window, .. } = Bench::new("silent");
    wishes.lock().expect("no test panicked with it").silent = true;
    until(&mut window, "it lags", |window| matches!(window.state().status().link, LinkState::Lagging(_)));
    until(&mut window, "it is lost", |window| matches!(window.state().status().link, LinkState::Lost(_)));
    wishes.lock().expect("no test panicked with it").silent = false;
    until(&mut window, "it is live", |window| window.state().status().link == LinkState::Live);
}

#[test]
fn a_robot_of_another_version_is_refused() {
    let port = bench::folder().join("other");
    let hello = RobotMessage::Hello {
        version: protocol::VERSION + 1,
        schema: protocol::SCHEMA,
        firmware: [9, 0, 0],
        precision: protocol::message::Precision::F32,
        state: SafetyState::Disarmed,
        reset: protocol::message::ResetCause::PowerOn,
        memory: protocol::message::MemoryState::Empty,
    };
    let _stranger = Plugged::new(&port, bench::Stranger(firmware::Port::default(), hello));
    let mut window = open(&["--link", &format!("serial:{}", port.display())]);
    until(&mut window, "it is refused", |window| matches!(window.state().status().link, LinkState::Refused(_)));
    window.step();
    assert!(window.query_by_label_contains("update the older of the two").is_some());
}

#[test]
fn a_board_on_the_line_is_put_into_the_simulated_barrel_and_left_as_it_should_be_found() {
    let port = bench::folder().join("simulated");
    let robot = Plugged::new(&port, BenchRobot::new(false));
    let mut window = open(&["--link", &format!("serial:{}", port.display()), "--simulate", "--body", "tabletop"]);
    until(&mut window, "it runs", |window| window.state().history().len() > 10 && state(window).is_some());
    assert_eq!(state(&window), Some(SafetyState::Armed));
    let knows = |channel| window.state().history().knows(channel);
    assert!(knows(playground::channel::Id::Px), "the barrel is simulated");
    drop(window);
    assert!(robot.unplug().is_left_in_order(), "disarmed, with its own sensors");
}

#[test]
fn a_menu_that_is_open_stays_open_when_the_robot_says_that_it_is_not_homed() {
    let port = bench::folder().join("menu");
    // At the clock's pace: it says so a second after its start.
    let _robot = Plugged::new(&port, Paced::new(BenchRobot::new(true), BenchRobot::lived));
    let mut window = open(&["--link", &format!("serial:{}", port.display())]);
    until(&mut window, "there is something to show", |window| window.query_by_label("Experiment").is_some());
    window.get_by_label("Experiment").click();
    frames(&mut window, 3);
    let item = "homeostatic (Experiment 2.2)";
    assert!(window.query_by_label(item).is_some());
    until(&mut window, "it says so", |window| window.query_by_label("Home").is_some());
    frames(&mut window, 3);
    assert!(window.query_by_label(item).is_some(), "the menu is still there");
}
