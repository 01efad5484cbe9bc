//! The console's drawer: a line is typed, completed, sent and brought back.

use eframe::egui::accesskit::Role;
use eframe::egui::{Key, Modifiers, Vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use playground::drawer::Drawer;
use playground::order::Order;
use std::path::PathBuf;

struct Window {
    drawer: Drawer,
    orders: Vec<Order>,
}

fn window(history: Option<PathBuf>) -> Harness<'static, Window> {
    let mut drawer = Drawer::new(history);
    drawer.focus();
    let mut window =
        Harness::builder().with_accessibility_check(true).with_size(Vec2::new(700.0, 260.0)).build_ui_state(
            |ui, window: &mut Window| {
                window.drawer.show(ui, &mut window.orders);
                let _ = ui.button("Elsewhere");
            },
            Window { drawer, orders: Vec::new() },
        );
    window.run();
    window
}

fn type_text(window: &mut Harness<Window>, text: &str) {
    window.get_by_role_and_label(Role::TextInput, "Console line").type_text(text);
    window.run();
}

fn press(window: &mut Harness<Window>, key: Key) {
    window.key_press(key);
    window.run();
}

fn line(window: &Harness<Window>) -> String {
    window.get_by_role_and_label(Role::TextInput, "Console line").value().unwrap_or_default()
}

#[test]
fn enter_sends_the_line_and_the_next_can_be_typed_at_once() {
    let mut window = window(None);
    type_text(&mut window, "epsC = 0.2");
    press(&mut window, Key::Enter);
    type_text(&mut window, "pause");
    press(&mut window, Key::Enter);
    press(&mut window, Key::Enter);
    assert_eq!(window.state().orders, [Order::Line("epsC = 0.2".into()), Order::Line("pause".into())]);
    assert_eq!(line(&window), "");
}

#[test]
fn tab_completes_what_is_certain_and_then_goes_through_the_rest() {
    let mut window = window(None);
    type_text(&mut window, "grav");
    press(&mut window, Key::Tab);
    assert_eq!(line(&window), "gravity");
    type_text(&mut window, " = 3");
    assert_eq!(line(&window), "gravity = 3", "the cursor is behind what was completed");
    press(&mut window, Key::Enter);
    type_text(&mut window, "ep");
    let lines: Vec<String> = (0..4)
        .map(|_| {
            press(&mut window, Key::Tab);
            line(&window)
        })
        .collect();
    assert_eq!(lines, ["eps", "epsA", "epsC", "epsA"]);
    window.get_by_label("epsC").click();
    window.run();
    assert_eq!(line(&window), "epsC");
    assert!(window.query_by_label("epsA").is_none(), "the choice is over");
}

#[test]
fn tab_right_behind_the_first_letter_completes_and_stays_in_the_line() {
    let mut window = window(None);
    window.get_by_role_and_label(Role::TextInput, "Console line").type_text("grav");
    window.step();
    window.key_press(Key::Tab);
    window.run();
    assert_eq!(line(&window), "gravity");
    assert!(window.get_by_role_and_label(Role::TextInput, "Console line").is_focused());
}

#[test]
fn tab_on_an_empty_line_leaves_it() {
    let mut window = window(None);
    press(&mut window, Key::Tab);
    assert!(!window.get_by_role_and_label(Role::TextInput, "Console line").is_focused());
}

#[test]
fn up_and_down_bring_back_what_was_typed_in_this_window_and_in_the_last() {
    let folder = tempfile::tempdir().unwrap();
    let file = Some(folder.path().join("history"));
    let mut first = window(file.clone());
    type_text(&mut first, "epsC = 0.2");
    press(&mut first, Key::Enter);
    let mut second = window(file);
    type_text(&mut second, "pause");
    press(&mut second, Key::Enter);
    type_text(&mut second, "st");
    let lines = [Key::ArrowUp, Key::ArrowUp, Key::ArrowUp, Key::ArrowDown, Key::ArrowDown].map(|key| {
        press(&mut second, key);
        line(&second)
    });
    assert_eq!(lines, ["pause", "epsC = 0.2", "epsC = 0.2", "pause", "st"]);
}

#[test]
fn what_is_said_can_be_read_and_ctrl_l_clears_it() {
    let mut window = window(None);
    let drawer = &mut window.state_mut().drawer;
    drawer.typed("epzC");
    drawer.failed("unknown parameter");
    drawer.said("one\ntwo");
    window.run();
    for text in ["> epzC", "unknown parameter", "one", "two"] {
        assert!(window.query_by_label(text).is_some(), "{text}");
    }
    window.key_press_modifiers(Modifiers::COMMAND, Key::L);
    window.run();
    assert!(window.query_by_label("one").is_none());
}

#[test]
fn the_newest_line_of_many_is_seen() {
    let mut window = window(None);
    for i in 0..300 {
        window.state_mut().drawer.said(&format!("line {i}"));
    }
    window.run();
    assert!(window.query_by_label("line 299").is_some());
    assert!(window.query_by_label("line 0").is_none());
}
