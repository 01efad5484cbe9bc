//! What a person does with the window, on a simulated barrel: by clicks, keys and names alone, as a screen reader has them.

mod bench;

use barrel::session::Pace;
use bench::{ctrl, field, folder, frames, letter, number, open, until};
use eframe::egui::{Key, PointerButton, Role};
use egui_kittest::kittest::Queryable;
use playground::channel::Id as Channel;
use playground::session::LinkState;
use protocol::Id;
use protocol::message::{FaultCode, SafetyState};

/// A window in which the homeokinetic barrel is on its way.
fn rolling() -> bench::Window {
    let mut window = open(&["homeokinetic"]);
    until(&mut window, "control steps", |window| window.state().history().len() > 10);
    window
}

fn newest(window: &bench::Window, channel: Channel) -> f32 {
    window.state().history().frame_at(None).map_or(f32::NAN, |frame| frame.get(channel))
}

#[test]
fn an_experiment_is_started_from_the_menu_and_the_barrel_rolls() {
    let mut window = rolling();
    window.get_by_label("Experiment").click();
    frames(&mut window, 3);
    window.get_by_label("closed-loop (Experiment 1.2)").click();
    until(&mut window, "the closed loop runs", |window| {
        window.state().status().start.as_ref().is_some_and(|start| start.experiment.name == "closed-loop")
            && window.state().history().len() > 5
    });
    for speed in [2.0, 5.0, 10.0] {
        window.key_press(Key::Plus);
        until(&mut window, "it goes faster", |window| window.state().status().speed == speed);
    }
    until(&mut window, "C = U(0.5) rolls the barrel", |window| newest(window, Channel::Omega) > 4.0);
}

#[test]
fn a_knob_is_turned_and_marked_and_reset() {
    let mut window = rolling();
    window.get_by_label("Parameters").click();
    frames(&mut window, 3);
    field(&window, "Search parameters").type_text("epsC");
    frames(&mut window, 3);
    let held = |window: &bench::Window| window.state().status().values.as_ref().map(|values| values.get(Id::EpsC));
    assert_eq!(held(&window), Some(0.1));
    number(&window, "epsC").set_value_accesskit(0.25);
    until(&mut window, "the robot holds the new rate", |window| {
        held(window).is_some_and(|rate| (rate - 0.25).abs() < 1e-6)
    });
    frames(&mut window, 3);
    window.get_by_label_contains("Reset epsC").click();
    until(&mut window, "the rate is the preset's again", |window| held(window) == Some(0.1));
}

#[test]
fn a_channel_is_added_to_a_plot() {
    let mut window = rolling();
    let channels = |window: &bench::Window| -> Vec<Vec<Channel>> {
        window.state().plots().channels().map(<[Channel]>::to_vec).collect()
    };
    let before = channels(&window).len();
    window.get_by_label("New plot").click();
    frames(&mut window, 3);
    assert_eq!(channels(&window).len(), before + 1);
    field(&window, "Search channels").type_text("tilt");
    frames(&mut window, 3);
    window.get_by_role_and_label(Role::CheckBox, "tilt").click();
    frames(&mut window, 3);
    assert_eq!(channels(&window).last().map(Vec::as_slice), Some(&[Channel::Tilt][..]));
}

#[test]
fn the_barrel_is_kicked_by_a_key() {
    let mut window = rolling();
    letter(&mut window, "x");
    let kicked = |window: &bench::Window| {
        let history = window.state().history();
        (0..history.len()).filter_map(|row| history.frame(row)).any(|frame| frame.get(Channel::Torque) == 10.0)
    };
    until(&mut window, "the torque is there", kicked);
}

#[test]
fn the_barrel_is_pulled_by_the_mouse_and_let_go() {
    let mut window = rolling();
    let scene = window.get_by_label("Scene").rect();
    let middle = scene.center();
    window.hover_at(middle);
    frames(&mut window, 5);
    window.drag_at(middle);
    frames(&mut window, 3);
    window.hover_at(middle + eframe::egui::vec2(80.0, -20.0));
    let force = |window: &bench::Window| newest(window, Channel::ForceX).hypot(newest(window, Channel::ForceY));
    until(&mut window, "a force pulls", |window| force(window) > 1.0);
    window.drop_at(middle + eframe::egui::vec2(80.0, -20.0));
    until(&mut window, "the hand has let go", |window| force(window) == 0.0);
}

#[test]
fn time_stands_goes_step_by_step_and_goes_on() {
    let mut window = rolling();
    window.key_press(Key::Space);
    until(&mut window, "the time stands", |window| window.state().status().pace == Pace::Paused);
    frames(&mut window, 10);
    let rows = window.state().history().len();
    letter(&mut window, "n");
    until(&mut window, "one step more", |window| window.state().history().len() == rows + 1);
    frames(&mut window, 20);
    assert_eq!(window.state().history().len(), rows + 1);
    window.get_by_label_contains("Go on").click();
    until(&mut window, "the time goes on", |window| window.state().history().len() > rows + 10);
}

#[test]
fn escape_stops_the_robot_and_a_button_brings_it_back() {
    let mut window = rolling();
    window.key_press(Key::Escape);
    let stopped = Some(SafetyState::Fault(FaultCode::EmergencyStop));
    until(&mut window, "it is stopped", |window| window.state().status().state == stopped);
    frames(&mut window, 3);
    window.get_by_label("Clear and arm").click();
    until(&mut window, "it is armed", |window| window.state().status().state == Some(SafetyState::Armed));
}

#[test]
fn letters_that_are_typed_into_the_console_are_no_commands_of_the_window() {
    let mut window = rolling();
    ctrl(&mut window, Key::K);
    frames(&mut window, 5);
    let line = window.get_by_label("Console line");
    line.focus();
    line.type_text("epsC = 0.3");
    frames(&mut window, 5);
    window.key_press(Key::Enter);
    until(&mut window, "the console sets it", |window| {
        window.state().status().values.as_ref().is_some_and(|values| values.get(Id::EpsC) == 0.3)
    });
    assert_eq!(window.state().status().state, Some(SafetyState::Armed));
    assert!(!window.state().is_help_shown());
}

#[test]
fn help_names_every_key() {
    let mut window = rolling();
    letter(&mut window, "h");
    frames(&mut window, 5);
    for row in playground::keys::KEYS {
        assert!(window.query_all_by_label_contains(row.what).next().is_some(), "{}", row.what);
    }
}

/// A window that shows the recording of its first session, while the second goes on behind it.
fn shown_recording() -> bench::Window {
    let mut window = rolling();
    until(&mut window, "two seconds", |window| window.state().history().span().is_some_and(|(_, end)| end > 2.0));
    // Another experiment: the log of the first is complete then.
    let log = folder().join(window.state().status().log.clone().expect("every session is recorded"));
    window.get_by_label("Experiment").click();
    frames(&mut window, 3);
    window.get_by_label("open-loop (Experiment 1.1)").click();
    until(&mut window, "the next session", |window| window.state().status().session == 2);

    ctrl(&mut window, Key::O);
    frames(&mut window, 3);
    field(&window, "File").type_text(&log.display().to_string());
    frames(&mut window, 3);
    window.get_by_label("Open").click();
    until(&mut window, "the recording is shown", |window| window.state().is_recording_shown());
    window
}

#[test]
fn a_recording_shields_the_session_behind_it_from_keys_but_not_from_a_stop() {
    let mut window = shown_recording();
    for kick in ["x", "r", "y"] {
        letter(&mut window, kick);
    }
    frames(&mut window, 3);
    assert!(window.query_by_label_contains("go back to live first").is_some());
    window.get_by_label("STOP").click();
    let stopped = Some(SafetyState::Fault(FaultCode::EmergencyStop));
    until(&mut window, "it is stopped", |window| window.state().status().state == stopped);
    window.get_by_label("Back to live").click();
    frames(&mut window, 3);
    let history = window.state().history();
    let mut all = (0..history.len()).filter_map(|row| history.frame(row));
    assert!(all.all(|frame| frame.get(Channel::Torque) == 0.0 && frame.get(Channel::C11) == 1.0));
}

#[test]
fn an_experiment_that_is_started_is_shown_even_if_a_recording_was() {
    let mut window = shown_recording();
    window.get_by_label("Experiment").click();
    frames(&mut window, 3);
    window.get_by_label("closed-loop (Experiment 1.2)").click();
    until(&mut window, "the third session", |window| window.state().status().session == 3);
    assert!(!window.state().is_recording_shown());
}

#[test]
fn a_log_is_opened_and_scrubbed() {
    let mut window = shown_recording();
    let (begin, end) = window.state().history().span().expect("it has steps");
    assert_eq!(begin, 0.0);
    assert!(end > 1.9, "{end} s");

    number(&window, "Time").set_value_accesskit(1.0);
    frames(&mut window, 3);
    let frame = window.state().frame().expect("a step is shown");
    assert!((frame.t - 1.0).abs() < 1e-9, "{} s", frame.t);
    assert!(frame.get(Channel::Qw).is_finite(), "the attitude is in the log");

    window.key_press(Key::Space);
    until(&mut window, "it plays", |window| window.state().frame().is_some_and(|frame| frame.t > 1.2));
    window.get_by_label("Back to live").click();
    frames(&mut window, 3);
    assert!(!window.state().is_recording_shown());
}

#[test]
fn what_is_no_recording_gets_a_sentence_and_the_window_goes_on() {
    let mut window = rolling();
    std::fs::write(folder().join("torn.mcap"), b"not a log").expect("written");
    ctrl(&mut window, Key::O);
    frames(&mut window, 3);
    field(&window, "File").type_text("torn.mcap");
    frames(&mut window, 3);
    window.get_by_label("Open").click();
    until(&mut window, "it is said", |window| window.query_by_label_contains("is not an MCAP log").is_some());
    let rows = window.state().history().len();
    until(&mut window, "the barrel goes on", |window| window.state().history().len() > rows);
}

#[test]
fn a_board_that_is_not_there_is_said_and_the_window_lives() {
    let mut window = open(&["homeokinetic", "--link", "serial:./nothing-here"]);
    until(
        &mut window,
        "it is said",
        |window| matches!(&window.state().status().link, LinkState::Connecting(why) if why.contains("no serial port")),
    );
    assert!(window.query_by_label_contains("Connecting").is_some());
    assert!(window.query_by_label("STOP").is_some());
    frames(&mut window, 10);
}

#[test]
fn a_middle_click_is_no_push() {
    let mut window = rolling();
    let scene = window.get_by_label("Scene");
    scene.click_button(PointerButton::Middle);
    frames(&mut window, 10);
    assert_eq!(newest(&window, Channel::ForceX), 0.0);
}
