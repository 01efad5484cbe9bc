//! Tab completion and hints.

use std::borrow::Cow;

use protocol::Id;
use rustyline::completion::{Completer, FilenameCompleter, Pair};
use rustyline::highlight::Highlighter;
use rustyline::hint::{Hint, Hinter};
use rustyline::validate::Validator;
use rustyline::{Context, Helper};

use super::COMMANDS;
use super::command::{AXES, begins_like, words};

/// What the word at the end of `line` can become: where the word starts, and the names. Case does not matter for a
/// match. `None` where a file name is due.
pub fn complete(line: &str) -> Option<(usize, Vec<&'static str>)> {
    let ends_word = |&(_, c): &(usize, char)| c.is_whitespace() || c == '=';
    let start = line.char_indices().rfind(ends_word).map_or(0, |(at, c)| at + c.len_utf8());
    let (before, word) = line.split_at(start);
    let candidates: Vec<&'static str> = match before.split_whitespace().collect::<Vec<_>>()[..] {
        [] if !before.contains('=') => words().collect(),
        ["help" | "?"] => words().collect(),
        ["calibrate"] => vec!["still", "up", "status", "restart"],
        ["calibrate", "up"] => AXES.iter().map(|(name, _)| *name).collect(),
        ["random"] => vec!["C", "h"],
        ["list"] => Id::ALL.iter().map(|id| id.name()).collect(),
        ["store" | "load", ..] => return None,
        _ => Vec::new(),
    };
    Some((start, candidates.into_iter().filter(|name| begins_like(name, word)).collect()))
}

/// What stands in grey behind the cursor: a parameter's range and meaning, a command's arguments.
pub fn hint(line: &str) -> Option<String> {
    let word = line.trim_start().split(|c: char| c.is_whitespace() || c == '=').next()?;
    if let Some(id) = Id::from_name(word) {
        let p = id.parameter();
        let unit = if p.unit.is_empty() { String::new() } else { format!(" {}", p.unit) };
        return match line.trim_end().strip_suffix(word) {
            Some(_) => Some(format!("   {} to {}{unit}: {}", p.min, p.max, p.help)),
            None => line.trim_end().ends_with('=').then(|| format!("   {} to {}{unit}", p.min, p.max)),
        };
    }
    let command = COMMANDS.iter().find(|command| command.name == word)?;
    (line.trim() == word).then(|| format!("{}   {}", &command.usage[word.len()..], command.help))
}

/// Completion and hints as the line editor wants them.
pub(super) struct Assistant {
    files: FilenameCompleter,
}

impl Assistant {
    pub(super) fn new() -> Self {
        Assistant { files: FilenameCompleter::new() }
    }
}

impl Completer for Assistant {
    type Candidate = Pair;

    fn complete(&self, line: &str, at: usize, context: &Context<'_>) -> rustyline::Result<(usize, Vec<Pair>)> {
        match complete(&line[..at]) {
            Some((start, names)) => {
                let pair = |name: &str| Pair { display: name.into(), replacement: name.into() };
                Ok((start, names.into_iter().map(pair).collect()))
            }
            None => self.files.complete(line, at, context),
        }
    }
}

/// A hint that is only shown, never taken over.
pub(super) struct Shown(String);

impl Hint for Shown {
    fn display(&self) -> &str {
        &self.0
    }

    fn completion(&self) -> Option<&str> {
        None
    }
}

impl Hinter for Assistant {
    type Hint = Shown;

    fn hint(&self, line: &str, at: usize, _: &Context<'_>) -> Option<Shown> {
        if at == line.len() { hint(line).map(Shown) } else { None }
    }
}

impl Highlighter for Assistant {
    fn highlight_hint<'h>(&self, hint: &'h str) -> Cow<'h, str> {
        // Grey.
        Cow::Owned(format!("\x1b[90m{hint}\x1b[0m"))
    }
}

impl Validator for Assistant {}
impl Helper for Assistant {}
