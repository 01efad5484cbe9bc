//! The window without a mouse, for a screen reader, small and large, light and dark.

mod bench;

use bench::{Window, ctrl, field, folder, frames, letter, open, open_in, until};
use eframe::egui::{Key, Modifiers, Rect, Theme, Vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT as _, Queryable};
use protocol::message::{FaultCode, SafetyState};

fn rolling(window: &mut Window) {
    until(window, "control steps", |window| window.state().history().len() > 10);
}

fn tab(window: &mut Window, modifiers: Modifiers) {
    window.key_press_modifiers(modifiers, Key::Tab);
    frames(window, 1);
}

/// The name of what has the focus.
fn focused(window: &Window) -> Option<String> {
    let mut found = window.root().children_recursive().filter(|node| node.is_focused());
    found.next().and_then(|node| node.accesskit_node().label())
}

#[test]
fn tab_walks_through_the_bar_and_stop_is_pressed_by_a_key() {
    let mut window = open(&["homeokinetic"]);
    rolling(&mut window);
    let mut walked: Vec<String> = Vec::new();
    for _ in 0..16 {
        tab(&mut window, Modifiers::NONE);
        walked.extend(focused(&window));
    }
    assert_eq!(walked[0], "STOP", "what stops a robot comes first");
    for name in ["Experiment", "File", "View", "Help", "Pause", "Step", "Slower (-)", "Faster (+)", "STOP", "Disarm"] {
        assert!(walked.iter().any(|other| other == name), "{name} is not reached: {walked:?}");
    }
    for key in [Key::Enter, Key::Space] {
        window.get_by_label("STOP").focus();
        frames(&mut window, 2);
        window.key_press(key);
        let stopped = Some(SafetyState::Fault(FaultCode::EmergencyStop));
        until(&mut window, "it is stopped", |window| window.state().status().state == stopped);
        frames(&mut window, 2);
        window.get_by_label("Clear and arm").focus();
        frames(&mut window, 2);
        window.key_press(key);
        until(&mut window, "it is armed again", |window| window.state().status().state == Some(SafetyState::Armed));
        frames(&mut window, 2);
    }
}

#[test]
fn tab_comes_round_and_goes_back_the_way_it_came() {
    let mut window = open(&["homeokinetic"]);
    rolling(&mut window);
    let mut there: Vec<Option<String>> = Vec::new();
    for _ in 0..8 {
        tab(&mut window, Modifiers::NONE);
        there.push(focused(&window));
    }
    assert!(there.iter().all(Option::is_some), "the focus is lost or has no name: {there:?}");
    for name in there.iter().rev().skip(1) {
        tab(&mut window, Modifiers::SHIFT);
        assert_eq!(focused(&window), *name);
    }
}

fn named(window: &Window, what: &str) {
    let unnamed = window.unnamed_widgets();
    assert!(unnamed.is_empty(), "{what}: {unnamed:#?}");
}

#[test]
fn everything_that_can_be_used_has_a_name() {
    let mut window = open(&["homeokinetic"]);
    rolling(&mut window);
    named(&window, "the guide");
    window.get_by_label("Parameters").click();
    frames(&mut window, 4);
    named(&window, "the knobs");
    ctrl(&mut window, Key::K);
    frames(&mut window, 4);
    named(&window, "the console");
    ctrl(&mut window, Key::K);
    for menu in ["Experiment", "File", "View", "Presets"] {
        window.get_by_label(menu).click();
        frames(&mut window, 4);
        named(&window, menu);
        window.get_by_label(menu).click();
        frames(&mut window, 4);
    }
    window.get_by_label("New plot").click();
    frames(&mut window, 4);
    named(&window, "the tree of channels");
    window.key_press(Key::Escape);
    frames(&mut window, 4);
    letter(&mut window, "h");
    frames(&mut window, 4);
    named(&window, "the help");
    letter(&mut window, "h");
    ctrl(&mut window, Key::S);
    frames(&mut window, 4);
    named(&window, "saving a set");
    window.key_press(Key::Escape);
    frames(&mut window, 4);
    let log = folder().join(window.state().status().log.clone().expect("every session is recorded"));
    ctrl(&mut window, Key::O);
    frames(&mut window, 4);
    named(&window, "opening a recording");
    field(&window, "File").type_text("nothing-of-this-name");
    frames(&mut window, 3);
    window.key_press(Key::Enter);
    until(&mut window, "it is said", |window| window.query_by_label_contains("there is no").is_some());
    named(&window, "a notice");
    window.state().order(playground::order::Order::Line("quit".to_owned()));
    until(&mut window, "the log is whole", |window| window.state().status().log.is_none());
    frames(&mut window, 4);
    named(&window, "a session that is over");
    ctrl(&mut window, Key::O);
    frames(&mut window, 4);
    // What was typed before is still there.
    field(&window, "File").set_text_value_accesskit(&log.display().to_string());
    frames(&mut window, 3);
    window.get_by_label("Open").click();
    until(&mut window, "it is shown", |window| window.state().is_recording_shown());
    frames(&mut window, 4);
    named(&window, "a recording");
}

/// What must be in sight whatever the window's size.
const ALWAYS: [&str; 9] = ["Experiment", "File", "View", "Help", "Arm", "Disarm", "STOP", "Parameters", "New plot"];

#[test]
fn stop_arm_and_disarm_are_in_sight_at_every_size_and_scale_and_in_both_themes() {
    for (theme, scale, size) in [
        (Theme::Light, 1.0, Vec2::new(1560.0, 940.0)),
        (Theme::Dark, 2.0, Vec2::new(1560.0, 940.0)),
        (Theme::Light, 2.0, Vec2::new(800.0, 560.0)),
        (Theme::Dark, 1.0, Vec2::new(800.0, 560.0)),
        (Theme::Dark, 1.0, Vec2::new(1100.0, 700.0)),
    ] {
        let what = format!("{size} points, {scale} pixels each, {theme:?}");
        let builder = Harness::builder().with_size(size).with_pixels_per_point(scale).with_theme(theme);
        let mut window = open_in(&["homeokinetic"], builder, None);
        rolling(&mut window);
        frames(&mut window, 5);
        assert_eq!((window.ctx.theme(), window.ctx.pixels_per_point()), (theme, scale));
        let screen = Rect::from_min_size(Default::default(), size);
        let rects: Vec<(&str, Rect)> = ALWAYS.iter().map(|name| (*name, window.get_by_label(name).rect())).collect();
        for (name, rect) in &rects {
            assert!(screen.contains_rect(*rect), "{what}: {name} is at {rect}");
        }
        for (i, (name, rect)) in rects.iter().enumerate() {
            for (other, covered) in &rects[..i] {
                assert!(!rect.shrink(1.0).intersects(covered.shrink(1.0)), "{what}: {name} covers {other}");
            }
        }
        let scene = window.get_by_label("Scene").rect();
        assert!(scene.width() >= 150.0 && scene.height() >= 150.0, "{what}: the scene is {scene}");
        named(&window, &what);
    }
}

#[test]
fn a_window_that_was_small_for_a_while_is_laid_out_as_before() {
    let large = Vec2::new(1560.0, 940.0);
    let mut window = open_in(&["homeokinetic"], Harness::builder().with_size(large), None);
    rolling(&mut window);
    frames(&mut window, 5);
    let places =
        |window: &Window| ["Scene", "New plot", "Parameters"].map(|name| window.get_by_label(name).rect().min.x);
    let before = places(&window);
    window.set_size(Vec2::new(800.0, 560.0));
    frames(&mut window, 5);
    assert_ne!(places(&window), before);
    window.set_size(large);
    frames(&mut window, 5);
    assert_eq!(places(&window), before);
}
