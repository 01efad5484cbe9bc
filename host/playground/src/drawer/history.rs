//! The lines that were typed before, in the file of `barrel console`.
//!
//! The file is rustyline's: `#V2`, then a line each, with `\\` for a backslash and `\n` for a line end within.

use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// What the file begins with.
const VERSION: &str = "#V2";
/// How many lines are offered.
const KEPT: usize = 1000;

/// The lines that were typed before, and which of them stands in the field.
#[derive(Debug)]
pub(super) struct History {
    lines: Vec<String>,
    /// The line that is shown; the number of lines is the new one.
    at: usize,
    /// The new line, as it was before an older one was brought back.
    draft: String,
    file: Option<PathBuf>,
}

impl History {
    /// The lines of `file`; a file that is not there yet has none.
    pub(super) fn load(file: Option<PathBuf>) -> Self {
        let text = file.as_ref().and_then(|file| fs::read_to_string(file).ok()).unwrap_or_default();
        let mut lines = text.lines().peekable();
        let is_escaped = lines.next_if_eq(&VERSION).is_some();
        let mut lines: Vec<String> =
            lines.map(|line| if is_escaped { unescaped(line) } else { line.to_owned() }).collect();
        lines.drain(..lines.len().saturating_sub(KEPT));
        History { at: lines.len(), lines, draft: String::new(), file }
    }

    /// The line before the one that is shown, which is `now`; `None` at the first.
    pub(super) fn older(&mut self, now: &str) -> Option<String> {
        if self.at == self.lines.len() {
            self.draft = now.to_owned();
        }
        self.at = self.at.checked_sub(1)?;
        Some(self.lines[self.at].clone())
    }

    /// The line after the one that is shown, at last the new one; `None` there.
    pub(super) fn newer(&mut self) -> Option<String> {
        if self.at == self.lines.len() {
            return None;
        }
        self.at += 1;
        Some(self.lines.get(self.at).unwrap_or(&self.draft).clone())
    }

    /// Keeps a line, unless it is the last one again. What went wrong is said once; then the lines are kept in this
    /// window only.
    pub(super) fn add(&mut self, line: &str) -> Option<String> {
        let is_new = self.lines.last().is_none_or(|last| last != line);
        if is_new {
            self.lines.push(line.to_owned());
        }
        self.at = self.lines.len();
        let file = self.file.as_ref().filter(|_| is_new)?;
        let error = append(file, line).err()?;
        let said = format!("the history cannot be kept in {}: {error}", file.display());
        self.file = None;
        Some(said)
    }
}

fn append(file: &Path, line: &str) -> io::Result<()> {
    let mut file = OpenOptions::new().create(true).append(true).open(file)?;
    let mut text = if file.metadata()?.len() == 0 { format!("{VERSION}\n") } else { String::new() };
    text.push_str(&line.replace('\\', "\\\\").replace('\n', "\\n"));
    text.push('\n');
    file.write_all(text.as_bytes())
}

fn unescaped(line: &str) -> String {
    let mut text = String::new();
    let mut characters = line.chars();
    while let Some(c) = characters.next() {
        match c {
            '\\' => match characters.next() {
                Some('n') => text.push('\n'),
                Some(other) => text.push(other),
                None => text.push('\\'),
            },
            c => text.push(c),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_come_back_in_order_and_the_new_one_last() {
        let mut history = History::load(None);
        history.add("epsC = 0.2");
        history.add("pause");
        assert_eq!(history.newer(), None);
        assert_eq!(history.older("st").as_deref(), Some("pause"));
        assert_eq!(history.older("pause").as_deref(), Some("epsC = 0.2"));
        assert_eq!(history.older("epsC = 0.2"), None);
        assert_eq!(history.newer().as_deref(), Some("pause"));
        assert_eq!(history.newer().as_deref(), Some("st"));
    }

    #[test]
    fn a_line_outlives_the_window_whatever_is_in_it() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("history");
        for line in ["store C:\\new", "pause", "pause"] {
            assert_eq!(History::load(Some(file.clone())).add(line), None);
        }
        assert_eq!(fs::read_to_string(&file).unwrap(), "#V2\nstore C:\\\\new\npause\n");
        assert_eq!(History::load(Some(file)).lines, ["store C:\\new", "pause"]);
    }

    #[test]
    fn a_history_that_cannot_be_written_is_said_once() {
        let folder = tempfile::tempdir().unwrap();
        let mut history = History::load(Some(folder.path().join("none/history")));
        assert!(history.add("pause").is_some_and(|said| said.contains("cannot be kept")));
        assert_eq!(history.add("go"), None);
        assert_eq!(history.older("").as_deref(), Some("go"));
    }
}
