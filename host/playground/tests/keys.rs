//! The keys: what is struck, and what comes of it.

use eframe::egui::{Event, Key, Modifiers, Vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use playground::drawer::Drawer;
use playground::help;
use playground::keys::{self, Action, Group, KEYS, Stroke};
use playground::order::Order;

struct Window {
    drawer: Drawer,
    is_help: bool,
    actions: Vec<Action>,
    orders: Vec<Order>,
}

fn window() -> Harness<'static, Window> {
    let state = Window { drawer: Drawer::new(None), is_help: false, actions: Vec::new(), orders: Vec::new() };
    Harness::builder().with_accessibility_check(true).with_size(Vec2::new(900.0, 700.0)).build_ui_state(
        |ui, window| {
            window.actions.extend(keys::pressed(ui.ctx()));
            let _ = ui.button("A button");
            window.drawer.show(ui, &mut window.orders);
            help::show(ui.ctx(), &mut window.is_help);
        },
        state,
    )
}

fn strike(window: &mut Harness<Window>, stroke: Stroke) -> Vec<Action> {
    match stroke {
        Stroke::Text(texts) => window.event(Event::Text(texts[0].to_owned())),
        Stroke::Key(key) => window.key_press(key),
        Stroke::Ctrl(key) => window.key_press_modifiers(Modifiers::COMMAND, key),
    }
    window.run();
    std::mem::take(&mut window.state_mut().actions)
}

#[test]
fn every_key_of_the_table_does_what_the_table_says_and_nothing_else() {
    let mut window = window();
    for row in KEYS {
        assert_eq!(strike(&mut window, row.stroke), [row.action], "{}", row.keys);
    }
}

#[test]
fn no_key_is_twice_in_the_table() {
    for (i, row) in KEYS.iter().enumerate() {
        for other in &KEYS[..i] {
            let is_same = match (row.stroke, other.stroke) {
                (Stroke::Text(a), Stroke::Text(b)) => a.iter().any(|text| b.contains(text)),
                (a, b) => a == b,
            };
            assert!(!is_same, "{} and {}", row.keys, other.keys);
        }
        assert!(Group::ALL.contains(&row.group));
    }
}

#[test]
fn every_line_of_a_key_is_understood_by_the_console() {
    for row in KEYS {
        let Action::Lines(lines) = row.action else { continue };
        for line in lines {
            assert!(barrel::console::parse(line).is_ok(), "{}: {line}", row.keys);
        }
    }
}

#[test]
fn what_is_typed_into_the_console_is_no_command_of_the_window() {
    let mut window = window();
    window.state_mut().drawer.focus();
    window.run();
    for text in ["r", "S", "h", "a"] {
        assert_eq!(
            strike(
                &mut window,
                Stroke::Text(match text {
                    "r" => &["r"],
                    "S" => &["S"],
                    "h" => &["h"],
                    _ => &["a"],
                })
            ),
            []
        );
    }
    for key in [Key::Space, Key::Plus, Key::Minus] {
        assert_eq!(strike(&mut window, Stroke::Key(key)), [], "{key:?}");
    }
    window.key_press(Key::Enter);
    window.run();
    assert_eq!(window.state().actions, []);
    assert_eq!(window.state().orders, [Order::Line("rSha".into())]);
}

#[test]
fn esc_and_the_keys_with_ctrl_act_while_something_is_typed() {
    let mut window = window();
    for row in KEYS.iter().filter(|row| matches!(row.stroke, Stroke::Ctrl(_) | Stroke::Key(Key::Escape))) {
        window.state_mut().drawer.focus();
        window.run();
        assert_eq!(strike(&mut window, row.stroke), [row.action], "{}", row.keys);
    }
}

#[test]
fn space_presses_the_button_that_has_the_focus_and_does_not_stop_the_time() {
    let mut window = window();
    window.get_by_label("A button").focus();
    window.run();
    assert_eq!(strike(&mut window, Stroke::Key(Key::Space)), []);
}

#[test]
fn plus_and_minus_act_with_shift_or_without() {
    let mut window = window();
    for (key, action) in [(Key::Plus, Action::Faster), (Key::Minus, Action::Slower)] {
        for modifiers in [Modifiers::NONE, Modifiers::SHIFT] {
            window.key_press_modifiers(modifiers, key);
            window.run();
            assert_eq!(std::mem::take(&mut window.state_mut().actions), [action], "{modifiers:?}");
        }
    }
}

#[test]
fn a_kick_does_not_repeat_while_its_key_is_held_and_a_step_does() {
    let mut window = window();
    for (key, text, count) in [(Key::X, "x", 1), (Key::N, "n", 3)] {
        for _ in 0..3 {
            // As they come from a keyboard: key and text together; egui itself finds out that the key was down before.
            let modifiers = Modifiers::NONE;
            let events = &mut window.input_mut().events;
            events.push(Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers });
            events.push(Event::Text(text.to_owned()));
            window.step();
        }
        window.key_up(key);
        window.run();
        assert_eq!(std::mem::take(&mut window.state_mut().actions).len(), count, "{text}");
    }
}

#[test]
fn esc_closes_the_help_and_stops_nothing_and_stops_again_afterwards() {
    let mut window = window();
    window.state_mut().is_help = true;
    window.run();
    assert!(window.query_by_label("Keys and mouse").is_some());
    assert_eq!(strike(&mut window, Stroke::Key(Key::Escape)), []);
    assert!(!window.state().is_help);
    assert_eq!(strike(&mut window, Stroke::Key(Key::Escape)), [Action::Lines(&["stop"])]);
}

#[test]
fn the_help_tells_of_every_key() {
    let mut window = window();
    window.set_size(Vec2::new(1200.0, 1200.0));
    window.state_mut().is_help = true;
    window.run();
    for row in KEYS {
        assert!(window.query_all_by_label(row.what).count() >= 1, "{}", row.keys);
    }
    for (_, what) in help::MOUSE {
        assert!(window.query_by_label(what).is_some(), "{what}");
    }
}
