//! Parameter sets: files of `name = value` lines, with comments that say unit and meaning.
//!
//! A set may give a few parameters only; the others stay as they are. It is checked as a whole before anything is
//! applied, and written as a whole or not at all.

use std::fmt::Write as _;
use std::path::Path;

use protocol::Id;

use super::{ConsoleError, Target, parse_assignment};
use crate::csv::shortest;
use crate::draft::Draft;
use crate::suggest::neighbour;

/// Writes all parameters that the target holds, and returns how many. The couplings are left out: they are views of
/// C11 to C22, which are written.
pub fn store(path: &Path, target: &mut dyn Target) -> Result<usize, ConsoleError> {
    let mut text = String::from("# barrel parameter set: one `name = value` a line, # begins a comment\n");
    let mut count = 0;
    for &id in Id::ALL.iter().filter(|id| id.coupled().is_none()) {
        let parameter = id.parameter();
        let unit = if parameter.unit.is_empty() { String::new() } else { format!("[{}] ", parameter.unit) };
        match target.get(id) {
            Ok(value) => {
                let assignment = format!("{} = {}", parameter.name, shortest(value));
                let _ = writeln!(text, "{assignment:<36} # {unit}{}", parameter.help);
                count += 1;
            }
            Err(reason) => {
                let _ = writeln!(text, "# {} is not here: {reason}", parameter.name);
            }
        }
    }
    let error = |error: std::io::Error| ConsoleError::File {
        doing: "write",
        path: path.into(),
        reason: format!("{error}; choose a folder that exists and may be written"),
    };
    let draft = Draft::beside(path).map_err(error)?;
    std::fs::write(draft.path(), text).map_err(error)?;
    draft.commit().map_err(error)?;
    Ok(count)
}

/// Reads a set and applies it, and returns how many parameters it gives. If the target refuses one of them, those
/// before it are set back.
pub fn load(path: &Path, target: &mut dyn Target) -> Result<usize, ConsoleError> {
    let set = read(path)?;
    let mut before = Vec::new();
    for &(id, value) in &set {
        let result = target.get(id).and_then(|old| target.set(id, value).map(|_| old));
        match result {
            Ok(old) => before.push((id, old)),
            Err(reason) => {
                for (id, old) in before.into_iter().rev() {
                    target.set(id, old).map_err(ConsoleError::Target)?;
                }
                return Err(ConsoleError::Target(format!("{}: {reason}; nothing was changed", id.name())));
            }
        }
    }
    Ok(set.len())
}

/// Reads a set from a file.
pub fn read(path: &Path) -> Result<Vec<(Id, f64)>, ConsoleError> {
    let text = std::fs::read_to_string(path).map_err(|error| ConsoleError::File {
        doing: "read",
        path: path.into(),
        reason: format!("{error}{}", neighbour(path)),
    })?;
    parse(path, &text)
}

/// Reads a set from text; `path` is for messages only.
///
/// # Errors
/// The first bad line: no assignment, an unknown name (with the nearest one), a bad value, a name that came before.
pub fn parse(path: &Path, text: &str) -> Result<Vec<(Id, f64)>, ConsoleError> {
    let mut set: Vec<(Id, f64)> = Vec::new();
    let mut lines: Vec<usize> = Vec::new();
    for (line, content) in text.lines().enumerate().map(|(i, line)| (i + 1, line)) {
        let content = content.split('#').next().unwrap_or_default().trim();
        if content.is_empty() {
            continue;
        }
        let at_line = |error| ConsoleError::Line { path: path.into(), line, error: Box::new(error) };
        let (id, value) = parse_assignment(content).map_err(at_line)?;
        if let Some(before) = set.iter().position(|&(other, _)| other == id) {
            return Err(at_line(ConsoleError::Twice { name: id.name(), before: lines[before] }));
        }
        set.push((id, value));
        lines.push(line);
    }
    if set.is_empty() {
        let reason = "it sets no parameter; a line is NAME = VALUE".into();
        return Err(ConsoleError::File { doing: "use", path: path.into(), reason });
    }
    Ok(set)
}
