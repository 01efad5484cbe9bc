//! How the window is laid out is remembered, and nothing that stands where the layout should stand keeps it from opening.

mod bench;

use bench::{Kept, Window, ctrl, field, frames, open_in, until};
use eframe::App as _;
use eframe::egui::{Key, Role, Vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use playground::channel::Id as Channel;
use protocol::message::SafetyState;

/// A window laid out as it was left, in which the barrel is on its way.
fn left_as(kept: Option<&Kept>) -> Window {
    let builder = Harness::builder().with_size(Vec2::new(1500.0, 940.0));
    let storage = kept.map(|kept| kept as &dyn eframe::Storage);
    let mut window = open_in(&["closed-loop"], builder, storage);
    until(&mut window, "control steps", |window| window.state().history().len() > 2);
    frames(&mut window, 3);
    window
}

/// What the window leaves behind.
fn keep(window: &mut Window) -> Kept {
    let mut kept = Kept::default();
    window.state_mut().save(&mut kept);
    kept
}

fn channels(window: &Window) -> Vec<Vec<Channel>> {
    window.state().plots().channels().map(<[Channel]>::to_vec).collect()
}

#[test]
fn plots_camera_console_and_what_is_on_the_left_come_back() {
    let mut window = left_as(None);
    let first = keep(&mut window);
    window.get_by_label("New plot").click();
    frames(&mut window, 3);
    field(&window, "Search channels").type_text("tilt");
    frames(&mut window, 3);
    window.get_by_role_and_label(Role::CheckBox, "tilt").click();
    frames(&mut window, 3);
    window.key_press(Key::Escape);
    frames(&mut window, 20);
    assert_eq!(window.state().status().state, Some(SafetyState::Armed), "Esc closes the tree and stops nothing");
    window.get_by_label("Parameters").click();
    ctrl(&mut window, Key::K);
    frames(&mut window, 3);
    assert!(window.query_by_label("Console line").is_some());
    window.get_by_label("Fixed").click();
    frames(&mut window, 3);
    let (plots, kept) = (channels(&window), keep(&mut window));
    assert_ne!(kept.0, first.0);
    drop(window);

    let mut again = left_as(Some(&kept));
    assert_eq!(channels(&again), plots);
    assert!(again.query_by_label("Console line").is_some(), "the console is gone");
    assert!(again.query_by_label("Search parameters").is_some(), "the parameters are gone");
    assert!(kept.0.values().any(|layout| layout.contains("mode:Fixed")), "{kept:?}");
    // A camera that stands turns with the barrel: its angles are others by now.
    let without_angles = |kept: &Kept| kept.0["app"].split_once("twist").map(|(_, rest)| rest.to_owned());
    assert_eq!(without_angles(&keep(&mut again)), without_angles(&kept), "what was loaded is saved as it was");
}

#[test]
fn a_layout_that_cannot_be_read_gives_way_to_the_first_one() {
    let mut window = left_as(None);
    let (plots, whole) = (channels(&window), keep(&mut window));
    let whole = whole.0.get("app").expect("the layout is kept under this name").clone();
    drop(window);
    for broken in ["", "(", "garbage", "(view:(mode:Sideways))", "[1,2,3]", &whole[..whole.len() / 2]] {
        let kept = Kept([("app".to_owned(), broken.to_owned())].into());
        let window = left_as(Some(&kept));
        assert_eq!(channels(&window), plots, "{broken:?}");
        assert!(window.query_by_label("STOP").is_some());
    }
}

#[test]
fn an_old_layout_keeps_what_is_still_known() {
    // Of a version without most of this, with a channel that is gone.
    let old = "(plots:(panels:[(channels:[\"x1\",\"warp\",\"E\"])]),left:Knobs)";
    let kept = Kept([("app".to_owned(), old.to_owned())].into());
    let window = left_as(Some(&kept));
    assert_eq!(channels(&window), [vec![Channel::X1, Channel::E]]);
    assert!(window.query_by_label("Search parameters").is_some());
}

#[test]
fn numbers_that_nobody_can_have_set_do_not_keep_the_window_from_opening() {
    for number in ["NaN", "inf", "-inf", "-1.0", "0.0", "1e30"] {
        let layout = format!(
            "(view:(azimuth:{number},elevation:{number},distance:{number}),plots:(panels:[\
             (channels:[\"x1\"],scale:Fixed(min:{number},max:{number}),height:Some({number})),\
             (channels:[\"E\"],scale:Fixed(min:0.0,max:{number}))],view:(length:Some({number}))))"
        );
        let kept = Kept([("app".to_owned(), layout)].into());
        let mut window = left_as(Some(&kept));
        assert_eq!(channels(&window), [vec![Channel::X1], vec![Channel::E]], "{number}: the layout was not read");
        let rows = window.state().history().len();
        until(&mut window, "the barrel goes on", |window| window.state().history().len() > rows + 5);
    }
}
