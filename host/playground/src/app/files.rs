//! Choosing a recording: the logs of this folder's `runs`, a path that is typed, or a file that is dropped on the window.

use super::App;
use crate::keys;
use eframe::egui;
use egui::{Align2, Context, Key, ScrollArea, TextEdit, Vec2, Window};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Recordings that are offered, at most.
const OFFERED: usize = 200;

/// The dialog in which a recording is chosen.
#[derive(Default)]
pub(super) struct Files {
    open: bool,
    path: String,
    offered: Vec<PathBuf>,
    focus: bool,
}

impl Files {
    /// Opens the dialog.
    pub fn choose(&mut self) {
        self.open = true;
        self.focus = true;
        self.offered = recordings(Path::new("runs"));
    }

    /// Shows the dialog; returns what was chosen in it.
    pub fn show(&mut self, context: &Context) -> Option<PathBuf> {
        if !self.open {
            return None;
        }
        keys::hold_escape(context);
        let mut chosen = None;
        let mut open = !context.input(|input| input.key_pressed(Key::Escape));
        let window = Window::new("Open a recording").open(&mut open).default_width(520.0).collapsible(false);
        window.anchor(Align2::CENTER_CENTER, Vec2::ZERO).show(context, |ui| {
            ui.horizontal(|ui| {
                let label = ui.label("File");
                let field = TextEdit::singleline(&mut self.path).hint_text("a log (.mcap) or a CSV; filters the list");
                let field = ui.add(field.desired_width(380.0)).labelled_by(label.id);
                if std::mem::take(&mut self.focus) {
                    field.request_focus();
                }
                let entered = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
                if (ui.button("Open").clicked() || entered) && !self.path.is_empty() {
                    chosen = Some(PathBuf::from(self.path.trim()));
                }
            });
            if self.offered.is_empty() {
                ui.weak("There is no recording in runs/ yet. A file can also be dropped on the window.");
            }
            ScrollArea::vertical().max_height(320.0).show(ui, |ui| {
                let wanted = self.path.to_lowercase();
                for path in &self.offered {
                    let name = path.display().to_string();
                    if name.to_lowercase().contains(&wanted) && ui.selectable_label(false, &name).clicked() {
                        chosen = Some(path.clone());
                    }
                }
            });
        });
        self.open = open && chosen.is_none();
        chosen
    }
}

/// The recordings below a folder, the newest first.
fn recordings(folder: &Path) -> Vec<PathBuf> {
    let mut found: Vec<(SystemTime, PathBuf)> = Vec::new();
    let mut folders = vec![(folder.to_owned(), 0)];
    while let Some((folder, depth)) = folders.pop() {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let (path, Ok(metadata)) = (entry.path(), entry.metadata()) else { continue };
            let is_recording = path.extension().is_some_and(|ending| ending == "mcap" || ending == "csv");
            if metadata.is_dir() && depth < 2 {
                folders.push((path, depth + 1));
            } else if is_recording && metadata.is_file() {
                found.push((metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH), path));
            }
        }
    }
    found.sort_by(|a, b| b.cmp(a));
    found.into_iter().map(|(_, path)| path).take(OFFERED).collect()
}

impl App {
    /// Opens a file that was dropped on the window.
    pub(super) fn dropped(&mut self, context: &Context) {
        let dropped = context.input(|input| input.raw.dropped_files.first().map(|file| file.path().to_owned()));
        if let Some(path) = dropped {
            self.open(path, context);
        }
    }
}
