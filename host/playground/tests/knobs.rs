//! The knobs: what is turned, typed, looked for and set back, and what the session hears of it.

use eframe::egui::accesskit::Role;
use eframe::egui::{Key, Vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use hil_sim::experiment::Experiment;
use hil_sim::setup::{BodyKind, Setup};
use playground::channel::{self, Frame};
use playground::knobs::{self, Held, Knobs};
use playground::order::{Order, Start};
use protocol::{Id, Values};

struct Window {
    knobs: Knobs,
    values: Values<f64>,
    preset: Values<f64>,
    live: Option<Frame>,
    running: Start,
    robot_only: bool,
    orders: Vec<Order>,
}

impl Window {
    fn held(&self) -> Held<'_> {
        let Window { values, preset, live, running, robot_only, .. } = self;
        let (preset, live) = (preset.clone(), *live);
        Held { values, preset, live, running: Some(running), robot_only: *robot_only, enabled: true }
    }
}

/// The knobs of the homeokinetic barrel, with `search` in the field, so that what it finds is unfolded.
fn window(search: &str) -> Harness<'static, Window> {
    let experiment = Experiment::find("homeokinetic").unwrap();
    let preset = Setup::new(experiment, BodyKind::Chapter).values;
    let running = Start { experiment, body: BodyKind::Chapter, seed: 3, sets: Vec::new() };
    let mut knobs = Knobs::default();
    knobs.search = search.into();
    let values = preset.clone();
    let state = Window { knobs, values, preset, live: None, running, robot_only: false, orders: Vec::new() };
    let mut window =
        Harness::builder().with_accessibility_check(true).with_size(Vec2::new(420.0, 1900.0)).build_ui_state(
            |ui, window: &mut Window| {
                let mut knobs = std::mem::take(&mut window.knobs);
                let mut orders = Vec::new();
                knobs::show(ui, &mut knobs, &window.held(), &mut orders);
                window.knobs = knobs;
                // A session that does at once what it is asked for.
                for order in &orders {
                    if let Order::Set(id, value) = order {
                        window.values.set(*id, *value);
                    }
                }
                window.orders.extend(orders);
            },
            state,
        );
    window.run();
    window
}

fn turn(window: &mut Harness<Window>, name: &str, value: f64) {
    window.get_by_role_and_label(Role::Slider, name).set_value_accesskit(value);
    window.run();
}

fn type_number(window: &mut Harness<Window>, name: &str, text: &str) {
    window.get_by_role_and_label(Role::SpinButton, name).focus();
    window.run();
    window.get_by_role_and_label(Role::SpinButton, name).type_text(text);
    window.run();
    window.key_press(Key::Enter);
    window.run();
}

fn click(window: &mut Harness<Window>, name: &str) {
    window.get_by_role_and_label(Role::Button, name).click();
    window.run();
}

fn orders(window: &mut Harness<Window>) -> Vec<Order> {
    std::mem::take(&mut window.state_mut().orders)
}

#[test]
fn every_parameter_has_a_knob_with_its_name() {
    let mut window = window(" ");
    // Every group is unfolded in turn, by what all of its rows have in common.
    for &id in Id::ALL {
        window.state_mut().knobs.search = id.name().to_owned();
        window.run();
        let role = if matches!(id, Id::Rule | Id::DerivativeOnMeasurement) { Role::ComboBox } else { Role::Slider };
        assert!(window.query_by_role_and_label(role, id.name()).is_some(), "{}", id.name());
    }
}

#[test]
fn a_turned_knob_sets_its_parameter_within_its_bounds() {
    let mut window = window("eps");
    turn(&mut window, "epsC", 0.25);
    assert_eq!(orders(&mut window), [Order::Set(Id::EpsC, 0.25)]);
    turn(&mut window, "epsC", 1e9);
    turn(&mut window, "epsC", -1e9);
    assert_eq!(orders(&mut window), [Order::Set(Id::EpsC, 10.0), Order::Set(Id::EpsC, 0.0)]);
}

#[test]
fn every_slider_turned_by_the_arrows_stays_within_its_bounds() {
    let mut window = window(" ");
    for &id in Id::ALL.iter().filter(|id| !matches!(id, Id::Rule | Id::DerivativeOnMeasurement)) {
        window.state_mut().knobs.search = id.name().to_owned();
        window.run();
        window.get_by_role_and_label(Role::Slider, id.name()).focus();
        window.run();
        let mut pending = Vec::new();
        for key in [Key::ArrowRight, Key::ArrowLeft, Key::ArrowLeft] {
            window.key_press(key);
            window.run();
            // What one arrow has taken away from where it was, the next may bring back.
            pending.extend(window.state().knobs.pending.clone());
        }
        window.state_mut().knobs.pending.clear();
        let set = orders(&mut window).into_iter().map(|order| match order {
            Order::Set(id, value) => (id, value),
            other => panic!("{other:?}"),
        });
        let set: Vec<(Id, f64)> = set.chain(pending).collect();
        assert!(!set.is_empty(), "{} cannot be turned by the keyboard", id.name());
        for (other, value) in set {
            assert_eq!((other, id.parameter().check(value)), (id, Ok(())), "{}", id.name());
        }
    }
}

#[test]
fn a_typed_number_is_taken_when_it_is_ended_and_kept_within_the_bounds() {
    let mut window = window("mu");
    type_number(&mut window, "mu", "0,8");
    type_number(&mut window, "mu", "99");
    type_number(&mut window, "mu", "much");
    assert_eq!(orders(&mut window), [Order::Set(Id::Mu, 0.8), Order::Set(Id::Mu, 10.0)]);
}

#[test]
fn only_what_was_changed_can_be_set_back_and_it_goes_to_the_preset() {
    let mut window = window("eps");
    assert!(window.query_by_label("Reset epsC").is_none());
    turn(&mut window, "epsC", 0.25);
    orders(&mut window);
    assert!(window.query_by_label("Reset epsA").is_none());
    click(&mut window, "Reset epsC");
    assert_eq!(orders(&mut window), [Order::Set(Id::EpsC, 0.1)]);
    assert!(window.query_by_label("Reset epsC").is_none());
}

#[test]
fn reset_all_sets_back_what_was_changed_and_nothing_else() {
    let mut window = window("");
    window.state_mut().values.set(Id::EpsC, 0.3);
    window.state_mut().values.set(Id::Mu, 0.3);
    window.state_mut().knobs.pending.push((Id::Phi0, 0.0));
    window.run();
    click(&mut window, "Reset all");
    assert_eq!(orders(&mut window), [Order::Set(Id::EpsC, 0.1), Order::Set(Id::Mu, 0.64)]);
    assert_eq!(window.state().knobs.pending, []);
}

#[test]
fn a_search_finds_names_and_meanings_and_says_when_it_finds_nothing() {
    let mut window = window("gravity");
    assert!(window.query_by_role_and_label(Role::Slider, "gravity").is_some());
    assert!(window.query_by_role_and_label(Role::Slider, "mu").is_none());
    window.state_mut().knobs.search = "coefficient of FRICTION".into();
    window.run();
    assert!(window.query_by_role_and_label(Role::Slider, "mu").is_some());
    window.state_mut().knobs.search = "wheel".into();
    window.run();
    assert!(window.query_by_label_contains("No parameter").is_some());
    click(&mut window, "Clear search");
    assert_eq!(window.state().knobs.search, "");
}

#[test]
fn what_only_matters_at_the_start_waits_for_it() {
    let mut window = window("r");
    turn(&mut window, "radius", 0.4);
    turn(&mut window, "phi0", 0.0);
    assert_eq!(orders(&mut window), []);
    assert_eq!(window.state().knobs.pending, [(Id::Radius, 0.4), (Id::Phi0, 0.0)]);
    assert!(window.query_by_label("2 changes take effect at the next start:").is_some());
    window.state_mut().values.set(Id::EpsC, 0.2);
    window.run();
    click(&mut window, "Start again");
    let sets = vec![(Id::EpsC, 0.2), (Id::Radius, 0.4), (Id::Phi0, 0.0)];
    let start = Start { sets, ..window.state().running.clone() };
    assert_eq!(orders(&mut window), [Order::Start(start)]);
    assert_eq!(window.state().knobs.pending, []);
}

#[test]
fn a_pending_change_that_is_taken_back_or_dropped_is_gone() {
    let mut window = window("r");
    turn(&mut window, "radius", 0.4);
    turn(&mut window, "radius", 0.5);
    assert_eq!(window.state().knobs.pending, []);
    turn(&mut window, "radius", 0.4);
    click(&mut window, "Reset radius");
    assert_eq!(window.state().knobs.pending, []);
    turn(&mut window, "radius", 0.4);
    click(&mut window, "Drop");
    assert_eq!((window.state().knobs.pending.len(), orders(&mut window)), (0, vec![]));
}

#[test]
fn what_is_learned_is_shown_as_it_is_and_is_not_marked_as_changed() {
    let mut window = window("c");
    let mut frame = Frame::at(1.0);
    frame.set_all(channel::Id::C11, &[1.234_56, -0.25, 0.35, 1.0]);
    window.state_mut().live = Some(frame);
    window.run();
    let value = |window: &Harness<Window>, name| window.get_by_role_and_label(Role::SpinButton, name).value().unwrap();
    assert_eq!(value(&window, "C11"), "1.2346");
    assert_eq!(value(&window, "coupling2"), "-0.3000");
    assert!(window.query_by_label_contains("changed").is_none());
    click(&mut window, "Reset C12");
    assert_eq!(orders(&mut window), [Order::Set(Id::C12, 0.0)]);
}

#[test]
fn to_pass_over_a_learned_number_with_the_keyboard_sets_nothing() {
    let mut window = window("controller");
    let mut frame = Frame::at(1.0);
    frame.set_all(channel::Id::C11, &[1.234_567, 0.0, 0.0, 1.0]);
    window.state_mut().live = Some(frame);
    window.get_by_role_and_label(Role::SpinButton, "C11").focus();
    window.run();
    frame.set(channel::Id::C11, 1.5);
    window.state_mut().live = Some(frame);
    window.run();
    window.key_press(Key::Tab);
    window.run();
    assert_eq!(orders(&mut window), []);
}

#[test]
fn what_was_learned_is_forgotten_at_the_next_start_but_not_what_the_session_began_with() {
    let mut window = window("");
    let state = window.state_mut();
    state.running.sets = vec![(Id::Coupling1, -1.0), (Id::Mu, 0.3)];
    state.values.set(Id::C12, 0.7);
    state.values.set(Id::Mu, 0.8);
    let sets = |state: &Window| state.knobs.start_again(&state.held()).unwrap().sets;
    assert_eq!(sets(state), [(Id::Coupling1, -1.0), (Id::Mu, 0.8)]);
    // A fixed controller is a setting as any other.
    state.values.set(Id::Rule, 1.0);
    assert_eq!(sets(state), [(Id::Rule, 1.0), (Id::C12, 0.7), (Id::Mu, 0.8)]);
}

#[test]
fn the_rule_is_chosen_by_its_words() {
    let mut window = window("rule");
    window.get_by_role_and_label(Role::ComboBox, "rule").click();
    window.run();
    window.get_by_label("2  homeostatic (Eq. 9)").click();
    window.run();
    assert_eq!(orders(&mut window), [Order::Set(Id::Rule, 2.0)]);
}

#[test]
fn a_robot_has_no_plant_to_be_turned_and_its_range_changes_at_once() {
    let mut window = window("r");
    window.state_mut().robot_only = true;
    window.run();
    assert!(window.query_by_role_and_label(Role::Slider, "radius").is_none());
    turn(&mut window, "range", 0.05);
    assert_eq!(orders(&mut window), [Order::Set(Id::Range, 0.05)]);
}

fn name_file(window: &mut Harness<Window>, title: &str, path: &str, button: &str) {
    click(window, title);
    let label = match button {
        "Save" => "All parameters, what was learned too, go to this file:",
        _ => "A file of NAME = VALUE lines:",
    };
    window.get_by_role_and_label(Role::TextInput, label).set_text_value_accesskit(path);
    window.run();
    click(window, button);
}

#[test]
fn a_set_is_saved_and_loaded_by_the_consoles_lines() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine").display().to_string();
    let mut window = window("");
    name_file(&mut window, "Save set…", &path, "Save");
    assert_eq!(orders(&mut window), [Order::Line(format!("store {path}.set"))]);
    std::fs::write(format!("{path}.set"), "epsC = 0.3\n").unwrap();
    name_file(&mut window, "Load set…", &format!("{path}.set"), "Load");
    assert_eq!(orders(&mut window), [Order::Line(format!("load {path}.set"))]);
}

#[test]
fn what_a_set_has_of_the_start_waits_for_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.set");
    std::fs::write(&path, "epsC = 0.3\nradius = 0.4\n").unwrap();
    let mut window = window("");
    name_file(&mut window, "Load set…", &path.display().to_string(), "Load");
    assert_eq!(orders(&mut window), [Order::Set(Id::EpsC, 0.3)]);
    assert_eq!(window.state().knobs.pending, [(Id::Radius, 0.4)]);
}

#[test]
fn a_set_that_cannot_be_read_is_told_in_the_dialog_and_changes_nothing() {
    let mut window = window("");
    name_file(&mut window, "Load set…", "/no/such.set", "Load");
    assert_eq!(orders(&mut window), []);
    assert!(window.query_by_label_contains("/no/such.set").is_some());
}

#[test]
fn a_knob_that_waits_for_the_next_start_follows_the_mouse_to_the_end_of_the_drag() {
    let mut window = window("phi0");
    let at = window.get_by_role_and_label(Role::Slider, "phi0").rect().center();
    window.drag_at(at);
    window.run();
    let mut chosen = Vec::new();
    for step in 1..4 {
        // The first change brings a line above the knobs: it is still this one that is held.
        window.hover_at(at + eframe::egui::vec2(12.0 * step as f32, 0.0));
        window.run();
        chosen.push(window.state().knobs.pending.first().map(|(_, value)| *value));
    }
    window.drop_at(at + eframe::egui::vec2(36.0, 0.0));
    assert!(chosen.is_sorted() && chosen[0].is_some() && chosen[0] < chosen[2], "{chosen:?}");
}
