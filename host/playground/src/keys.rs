//! The keys: one table of what each of them does, for the keyboard and for the help.
//!
//! Letters are taken as text, so that layout and Shift are right; the rest as keys. While a text field has the focus,
//! only Esc, combinations with Ctrl (on a Mac: Command) and the F-keys reach the window.

pub mod speed;

use eframe::egui::{Context, Event, Id, Key, Popup};

/// What a key asks of the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// These lines of the console, one after the other.
    Lines(&'static [&'static str]),
    /// The time stops, or goes on if it has stopped.
    PauseOrGo,
    /// The next speed up the ladder, see [`speed::faster`].
    Faster,
    /// The next speed down the ladder, see [`speed::slower`].
    Slower,
    /// The same session begins again, with what waits for the next start.
    StartAgain,
    /// The camera follows the barrel, or stays.
    Follow,
    /// The help comes or goes.
    Help,
    /// The plots come or go.
    Plots,
    /// The console comes, with the cursor in its line, or goes.
    Console,
    /// A recording is chosen and opened.
    Open,
    /// The parameters are saved under a name.
    SaveSet,
    /// A picture of the window is written.
    Picture,
    /// A film of the scene begins or ends.
    Film,
}

/// A heading of the help.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// Random controllers.
    Controller,
    /// Kicks.
    Kicks,
    /// Pace of the simulated time.
    Time,
    /// What keeps a robot safe.
    Robot,
    /// Panels and files.
    Window,
}

impl Group {
    /// Every group, in the help's order.
    pub const ALL: [Group; 5] = [Group::Time, Group::Kicks, Group::Controller, Group::Robot, Group::Window];

    /// The heading.
    pub const fn name(self) -> &'static str {
        match self {
            Group::Controller => "Controller",
            Group::Kicks => "Kicks (weaker on the tabletop)",
            Group::Time => "Time",
            Group::Robot => "Robot",
            Group::Window => "Window and files",
        }
    }
}

/// What is struck.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stroke {
    /// One of these texts is typed.
    Text(&'static [&'static str]),
    /// A key that types no letter.
    Key(Key),
    /// A key with Ctrl (Command on a Mac).
    Ctrl(Key),
}

/// One row of [`KEYS`].
#[derive(Debug, PartialEq, Eq)]
pub struct KeyHelp {
    /// The key as people write it.
    pub keys: &'static str,
    /// What it does, in a few words.
    pub what: &'static str,
    /// Its heading.
    pub group: Group,
    /// What is struck.
    pub stroke: Stroke,
    /// What comes of it.
    pub action: Action,
}

const fn text(keys: &'static [&'static str], group: Group, action: Action, what: &'static str) -> KeyHelp {
    KeyHelp { keys: keys[0], what, group, stroke: Stroke::Text(keys), action }
}

const fn lines(
    keys: &'static [&'static str],
    group: Group,
    lines: &'static [&'static str],
    what: &'static str,
) -> KeyHelp {
    text(keys, group, Action::Lines(lines), what)
}

const fn key(keys: &'static str, stroke: Stroke, group: Group, action: Action, what: &'static str) -> KeyHelp {
    KeyHelp { keys, what, group, stroke, action }
}

/// Every key of the window. The timeline's (Home, End, arrows) are its own while it has the focus.
pub const KEYS: &[KeyHelp] = &[
    key("Space", Stroke::Key(Key::Space), Group::Time, Action::PauseOrGo, "stop the time, or let it go on"),
    lines(&["n"], Group::Time, &["step"], "one control step of 20 ms, then pause"),
    key("+", Stroke::Key(Key::Plus), Group::Time, Action::Faster, "faster"),
    key("−", Stroke::Key(Key::Minus), Group::Time, Action::Slower, "slower"),
    key("Ctrl+N", Stroke::Ctrl(Key::N), Group::Time, Action::StartAgain, "start again"),
    lines(&["x"], Group::Kicks, &["push 10 0.02"], "+10 N·m about the axis, for one step"),
    lines(&["X"], Group::Kicks, &["push -10 0.02"], "−10 N·m about the axis, for one step"),
    lines(&["y"], Group::Kicks, &["shove 30 0.02"], "+30 N along the ground, for one step"),
    lines(&["Y"], Group::Kicks, &["shove -30 0.02"], "−30 N along the ground, for one step"),
    lines(&["r"], Group::Controller, &["random C 5"], "random C, within ±5"),
    lines(&["R"], Group::Controller, &["random C 5", "random h 3"], "random C, within ±5, and h, within ±3"),
    lines(&["s"], Group::Controller, &["scatter 0.2"], "scatter C by ±0.2"),
    lines(&["S"], Group::Controller, &["scatter 0.5"], "scatter C by ±0.5"),
    key("Esc", Stroke::Key(Key::Escape), Group::Robot, Action::Lines(&["stop"]), "emergency stop"),
    lines(&["A"], Group::Robot, &["arm"], "arm, with Shift: the brain may move the weights"),
    lines(&["D", "d"], Group::Robot, &["disarm"], "disarm: outputs at zero"),
    text(&["h"], Group::Window, Action::Help, "this help"),
    text(&["F", "f"], Group::Window, Action::Follow, "the camera follows the barrel, or stays"),
    key("Ctrl+G", Stroke::Ctrl(Key::G), Group::Window, Action::Plots, "plots"),
    key("Ctrl+K", Stroke::Ctrl(Key::K), Group::Window, Action::Console, "console"),
    key("Ctrl+O", Stroke::Ctrl(Key::O), Group::Window, Action::Open, "open a recording"),
    key("Ctrl+S", Stroke::Ctrl(Key::S), Group::Window, Action::SaveSet, "save the parameters as a set"),
    key("Ctrl+P", Stroke::Ctrl(Key::P), Group::Window, Action::Picture, "a picture (PNG)"),
    key("Ctrl+R", Stroke::Ctrl(Key::R), Group::Window, Action::Film, "a film of the scene, or its end"),
];

/// What was struck since the last pass, in order. To be asked before any widget is shown: a line that is ended in this
/// pass was still being typed, and a combination with Ctrl is the window's and not the text field's.
pub fn pressed(ctx: &Context) -> Vec<Action> {
    let is_typing = ctx.text_edit_focused();
    let is_space_free = !ctx.egui_wants_keyboard_input() || (is_marked(ctx, IDLE_FOCUS) && !is_typing);
    // A menu that is open, or a field that is being edited, is left by it.
    let is_escape_held = is_marked(ctx, DIALOG) || is_typing || Popup::is_any_open(ctx);
    let is_zoom_held = is_marked(ctx, ZOOM);
    let mut actions = Vec::new();
    ctx.input_mut(|input| {
        // egui tells of a repeat with the key, and the text comes behind it.
        let mut is_repeat = false;
        input.events.retain(|event| {
            let row = match event {
                Event::Key { key, pressed: true, repeat, modifiers, .. } => {
                    is_repeat = *repeat;
                    let is_ctrl = modifiers.command || modifiers.ctrl;
                    let is_free = match key {
                        Key::Escape => !is_escape_held,
                        // It presses whatever has the focus.
                        Key::Space => is_space_free,
                        Key::Plus | Key::Minus => !is_typing && !is_zoom_held,
                        _ => !is_typing,
                    };
                    KEYS.iter().find(|row| match row.stroke {
                        Stroke::Ctrl(struck) => struck == *key && modifiers.command && !modifiers.alt,
                        Stroke::Key(struck) => struck == *key && (*key == Key::Escape || !is_ctrl) && is_free,
                        Stroke::Text(_) => false,
                    })
                }
                Event::Text(typed) if !is_typing => {
                    KEYS.iter().find(|row| matches!(row.stroke, Stroke::Text(texts) if texts.contains(&typed.as_str())))
                }
                _ => None,
            };
            let Some(row) = row else { return true };
            if !is_repeat || row.repeats() {
                actions.push(row.action);
            }
            !matches!(row.stroke, Stroke::Ctrl(_))
        });
    });
    actions
}

impl KeyHelp {
    /// Whether it goes on while the key is held down; a kick or a random controller does not.
    fn repeats(&self) -> bool {
        self.group == Group::Time && !matches!(self.action, Action::PauseOrGo | Action::StartAgain)
    }
}

/// To be called in every pass in which a dialog stands that Esc closes: Esc is the dialog's then, and stops nothing.
pub fn hold_escape(ctx: &Context) {
    mark(ctx, DIALOG);
}

/// To be called in every pass in which something has the focus that Space does not press: it stops the time then.
pub fn leave_space(ctx: &Context) {
    mark(ctx, IDLE_FOCUS);
}

/// To be called in every pass in which something has the focus that + and − zoom: they do not change the speed then.
pub fn hold_zoom(ctx: &Context) {
    mark(ctx, ZOOM);
}

const ZOOM: &str = "the focus that + and - zoom";
const DIALOG: &str = "the dialog that Esc closes";
const IDLE_FOCUS: &str = "the focus that Space does not press";

fn mark(ctx: &Context, what: &'static str) {
    let pass = ctx.cumulative_pass_nr();
    ctx.data_mut(|data| data.insert_temp(Id::unique(what), pass));
}

/// Whether it was marked in this pass or the last one.
fn is_marked(ctx: &Context, what: &'static str) -> bool {
    let now = ctx.cumulative_pass_nr();
    ctx.data(|data| data.get_temp::<u64>(Id::unique(what))).is_some_and(|pass| pass + 1 >= now)
}
