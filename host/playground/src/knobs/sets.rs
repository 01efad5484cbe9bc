//! The dialog that saves parameter sets and loads them.

use super::{Held, Knobs};
use crate::keys;
use crate::order::Order;
use barrel::console::{Command, parameter_set, parse};
use eframe::egui::{self, Align2, Context, Key, ScrollArea, TextEdit, Ui, Vec2, Window};
use std::fs;
use std::path::{Path, PathBuf};

/// Where sets are kept, under the current folder.
const FOLDER: &str = "sets";
/// How their files' names end.
const ENDINGS: [&str; 2] = ["set", "txt"];

/// An open dialog.
#[derive(Debug)]
pub(super) struct Dialog {
    task: Task,
    /// The file's name, as typed.
    name: String,
    /// What went wrong.
    failed: Option<String>,
    is_new: bool,
}

#[derive(Debug)]
enum Task {
    Save,
    /// Of these.
    Load(Vec<PathBuf>),
}

impl Dialog {
    pub(super) fn save() -> Dialog {
        let name = (1..).map(|n| format!("{FOLDER}/barrel-{n}.set")).find(|name| !Path::new(name).exists());
        Dialog { task: Task::Save, name: name.unwrap_or_default(), failed: None, is_new: true }
    }

    pub(super) fn load() -> Dialog {
        let files = [Path::new(FOLDER), Path::new(".")].into_iter().flat_map(sets_in).collect();
        Dialog { task: Task::Load(files), name: String::new(), failed: None, is_new: true }
    }
}

/// The sets of a folder, by name.
fn sets_in(folder: &Path) -> Vec<PathBuf> {
    let is_set = |path: &PathBuf| {
        path.extension().is_some_and(|ending| ENDINGS.iter().any(|known| ending.eq_ignore_ascii_case(known)))
            && parameter_set::read(path).is_ok()
    };
    let paths = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut sets: Vec<PathBuf> =
        paths.filter(is_set).map(|path| path.strip_prefix(".").unwrap_or(&path).to_path_buf()).collect();
    sets.sort();
    sets
}

/// Shows the dialog if it is open; Esc closes it.
pub(super) fn show(ctx: &Context, knobs: &mut Knobs, held: &Held, orders: &mut Vec<Order>) {
    let Some(mut dialog) = knobs.dialog.take() else { return };
    keys::hold_escape(ctx);
    let mut is_open = !ctx.input(|input| input.key_pressed(Key::Escape));
    let title = match dialog.task {
        Task::Save => "Save parameter set",
        Task::Load(_) => "Load parameter set",
    };
    let mut chosen = None;
    Window::new(title)
        .collapsible(false)
        .resizable(false)
        .anchor(Align2::CENTER_CENTER, Vec2::ZERO)
        .open(&mut is_open)
        .show(ctx, |ui| chosen = contents(ui, &mut dialog));
    let done = match chosen {
        Some(Choice::Cancel) => true,
        Some(Choice::File(name)) => match dialog.task {
            Task::Save => save(&name, orders),
            Task::Load(_) => load(&name, knobs, held, orders),
        }
        .map_err(|failed| dialog.failed = Some(failed))
        .is_ok(),
        None => false,
    };
    if is_open && !done {
        knobs.dialog = Some(dialog);
    }
}

enum Choice {
    File(String),
    Cancel,
}

fn contents(ui: &mut Ui, dialog: &mut Dialog) -> Option<Choice> {
    let mut choice = None;
    ui.set_width(340.0);
    let (words, button) = match &dialog.task {
        Task::Save => ("All parameters, what was learned too, go to this file:", "Save"),
        Task::Load(_) => ("A file of NAME = VALUE lines:", "Load"),
    };
    if let Task::Load(files) = &dialog.task {
        if files.is_empty() {
            ui.label("There are no sets in this folder yet, nor in its folder sets.");
        }
        ScrollArea::vertical().max_height(240.0).show(ui, |ui| {
            for file in files {
                let name = file.display().to_string();
                if ui.add(egui::Button::selectable(false, &name).min_size(Vec2::new(320.0, 0.0))).clicked() {
                    choice = Some(Choice::File(name));
                }
            }
        });
        ui.separator();
    }
    let label = ui.label(words);
    let field = ui.add(TextEdit::singleline(&mut dialog.name).desired_width(f32::INFINITY)).labelled_by(label.id);
    if std::mem::take(&mut dialog.is_new) {
        field.request_focus();
    }
    let is_entered = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
    if let Some(failed) = &dialog.failed {
        ui.colored_label(ui.visuals().error_fg_color, failed);
    }
    ui.add_space(4.0);
    ui.horizontal(|ui| {
        let is_named = !dialog.name.trim().is_empty();
        if ui.add_enabled(is_named, egui::Button::new(button)).clicked() || (is_entered && is_named) {
            choice = Some(Choice::File(dialog.name.trim().to_owned()));
        }
        if ui.button("Cancel").clicked() {
            choice = Some(Choice::Cancel);
        }
    });
    choice
}

fn save(name: &str, orders: &mut Vec<Order>) -> Result<(), String> {
    let path = if Path::new(name).extension().is_some() { name.to_owned() } else { format!("{name}.{}", ENDINGS[0]) };
    let line = format!("store {path}");
    if parse(&line) != Ok(Command::Store(PathBuf::from(&path))) {
        return Err(format!("“{path}” is not a name for a set: # begins a comment"));
    }
    if Path::new(&path).parent() == Some(Path::new(FOLDER)) {
        fs::create_dir_all(FOLDER).map_err(|error| format!("the folder {FOLDER} cannot be made: {error}"))?;
    }
    orders.push(Order::Line(line));
    Ok(())
}

/// By the console's `load`; but where the set has something that only matters at the start and is otherwise now, which
/// `load` would refuse, that waits for the next start.
fn load(name: &str, knobs: &mut Knobs, held: &Held, orders: &mut Vec<Order>) -> Result<(), String> {
    let set = parameter_set::read(Path::new(name)).map_err(|error| error.to_string())?;
    if set.iter().any(|(id, value)| held.waits(*id) && *value != held.values.get(*id)) {
        for (id, value) in set {
            knobs.set(id, value, held, orders);
        }
    } else {
        orders.push(Order::Line(format!("load {name}")));
    }
    Ok(())
}
