//! A bench without hardware and without a screen: the window as the accessibility tree has it, and the robot's own code at the
//! end of a serial line.
#![allow(dead_code, reason = "each test file uses its part")]

#[path = "../../../tests/bench/device.rs"]
mod device;
#[path = "../../../tests/bench/line.rs"]
pub mod line;

pub use device::*;

use barrel::cli::PlayArgs;
use clap::Parser;
use eframe::egui::Role;
use eframe::egui::{Event, Key, Vec2};
use egui_kittest::kittest::Queryable;
use egui_kittest::{Harness, HarnessBuilder, Node};
use playground::app::App;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::OnceLock;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Whatever a test waits for comes within this, however busy the machine is.
const LIMIT: Duration = Duration::from_secs(60);

/// A window on what this command line asks for.
pub type Window = Harness<'static, App>;

#[derive(Parser)]
struct Cli {
    #[command(flatten)]
    play: PlayArgs,
}

/// The folder that the tests run in: what a session records lands there.
pub fn folder() -> &'static Path {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a folder");
        std::env::set_current_dir(folder.path()).expect("it is there");
        folder
    });
    folder.path()
}

/// Opens the playground with these arguments.
pub fn open(args: &[&str]) -> Window {
    open_in(args, Harness::builder().with_size(Vec2::new(1500.0, 940.0)), None)
}

/// Opens the playground in a window of this sort, laid out as it was left in `storage`.
pub fn open_in(args: &[&str], window: HarnessBuilder<App>, storage: Option<&dyn eframe::Storage>) -> Window {
    folder();
    let args = asked(args);
    window.with_step_dt(1.0 / 60.0).build_eframe(|context| App::new(&args, None, storage, &context.egui_ctx))
}

/// What the playground is asked for with these arguments.
pub fn asked(args: &[&str]) -> PlayArgs {
    Cli::parse_from([&["barrel-play"], args].concat()).play
}

/// Lets the window draw its frames until something is so; returns how many that took.
pub fn until(window: &mut Window, what: &str, mut is_so: impl FnMut(&Window) -> bool) -> u32 {
    let start = Instant::now();
    for frames in 0.. {
        if is_so(window) {
            return frames;
        }
        assert!(start.elapsed() < LIMIT, "{what}: not within {LIMIT:?}; status: {:?}", window.state().status());
        window.step();
        std::thread::sleep(Duration::from_millis(2));
    }
    unreachable!("the loop ends by the clock")
}

/// A few frames more.
pub fn frames(window: &mut Window, count: u32) {
    for _ in 0..count {
        window.step();
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// A letter is typed that a key table knows.
pub fn letter(window: &mut Window, letter: &str) {
    window.event(Event::Text(letter.to_owned()));
    window.step();
}

/// A key is pressed with Ctrl.
pub fn ctrl(window: &mut Window, key: Key) {
    window.key_press_modifiers(eframe::egui::Modifiers::COMMAND, key);
    frames(window, 2);
}

/// One frame in which a key is struck with Ctrl, and no other: what the window asks for in it is in its output.
pub fn strike(window: &mut Window, key: Key) {
    let modifiers = eframe::egui::Modifiers::COMMAND;
    let event = Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers };
    window.input_mut().events.push(event);
    window.step();
    window.input_mut().events.push(Event::Key { key, physical_key: None, pressed: false, repeat: false, modifiers });
}

/// What is remembered from one window to the next.
#[derive(Clone, Debug, Default)]
pub struct Kept(pub BTreeMap<String, String>);

impl eframe::Storage for Kept {
    fn get_string(&self, key: &str) -> Option<String> {
        self.0.get(key).cloned()
    }

    fn set_string(&mut self, key: &str, value: String) {
        self.0.insert(key.to_owned(), value);
    }

    fn remove_string(&mut self, key: &str) {
        self.0.remove(key);
    }

    fn flush(&mut self) {}
}

/// The text field of this name.
pub fn field<'w>(window: &'w Window, name: &'w str) -> Node<'w> {
    window.get_by_role_and_label(Role::TextInput, name)
}

/// What has this name and a number, a slider or a value to be dragged.
pub fn number<'w>(window: &'w Window, name: &'w str) -> Node<'w> {
    let numbers = [Role::Slider, Role::SpinButton].into_iter();
    let mut found = numbers.flat_map(|role| window.query_all_by_role_and_label(role, name));
    found.next().unwrap_or_else(|| panic!("there is no number called {name}"))
}
