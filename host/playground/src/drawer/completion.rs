//! What Tab makes of a line: the console's names, or the names of files where one is due.

use std::fs;
use std::path::Path;

/// What a word can become, of several.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Candidates {
    /// The line before the word.
    before: String,
    names: Vec<String>,
    chosen: Option<usize>,
}

impl Candidates {
    pub(super) fn names(&self) -> &[String] {
        &self.names
    }

    pub(super) fn chosen(&self) -> Option<usize> {
        self.chosen
    }

    /// The line with this candidate.
    pub(super) fn line(&self, i: usize) -> String {
        format!("{}{}", self.before, self.names[i])
    }

    /// The line with the next candidate, or the one before; round and round.
    pub(super) fn next(&mut self, forward: bool) -> String {
        let last = self.names.len() - 1;
        let i = match (self.chosen, forward) {
            (None, true) => 0,
            (None, false) | (Some(0), false) => last,
            (Some(i), true) => {
                if i == last {
                    0
                } else {
                    i + 1
                }
            }
            (Some(i), false) => i - 1,
        };
        self.chosen = Some(i);
        self.line(i)
    }
}

/// The line, completed as far as it is certain, and what is left to choose from. `None` if nothing fits.
pub(super) fn complete(line: &str) -> Option<(String, Option<Candidates>)> {
    let (start, names) = match barrel::console::complete(line) {
        Some((start, names)) => (start, names.into_iter().map(str::to_owned).collect()),
        None => files(line),
    };
    let before = &line[..start];
    match &names[..] {
        [] => None,
        [name] => Some((format!("{before}{name}"), None)),
        [first, rest @ ..] => {
            let typed = &line[start..];
            let common = rest.iter().fold(first.as_str(), |common, name| common_start(common, name));
            // Names that differ in case only may have less in common than was typed.
            let word = if common.len() > typed.len() { common } else { typed };
            let completed = format!("{before}{word}");
            Some((completed, Some(Candidates { before: before.to_owned(), names, chosen: None })))
        }
    }
}

/// What both begin with.
fn common_start<'a>(a: &'a str, b: &str) -> &'a str {
    let end =
        a.char_indices().zip(b.chars()).find(|((_, x), y)| x != y).map_or(a.len().min(b.len()), |((at, _), _)| at);
    &a[..end]
}

/// Files and folders that the path behind the first word can become.
fn files(line: &str) -> (usize, Vec<String>) {
    let start = line.find(char::is_whitespace).map_or(line.len(), |at| {
        let rest = &line[at..];
        at + rest.len() - rest.trim_start().len()
    });
    let path = &line[start..];
    let (folder, name) = path.rfind('/').map_or(("", path), |at| path.split_at(at + 1));
    let place = if folder.is_empty() { Path::new(".") } else { Path::new(folder) };
    let mut names: Vec<String> = fs::read_dir(place)
        .into_iter()
        .flatten()
        .flatten()
        .filter_map(|entry| {
            let slash = if entry.path().is_dir() { "/" } else { "" };
            let found = entry.file_name().into_string().ok()?;
            let is_hidden = found.starts_with('.') && !name.starts_with('.');
            (found.starts_with(name) && !is_hidden).then(|| format!("{folder}{found}{slash}"))
        })
        .collect();
    names.sort();
    (start, names)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_fit_completes_the_word() {
        assert_eq!(complete("grav"), Some(("gravity".into(), None)));
        assert_eq!(complete("help GRAV"), Some(("help gravity".into(), None)));
        assert_eq!(complete("no such thing"), None);
    }

    #[test]
    fn several_fits_complete_what_they_share_and_are_gone_through_in_both_directions() {
        let (line, candidates) = complete("ep").unwrap();
        let mut candidates = candidates.unwrap();
        assert_eq!((line.as_str(), candidates.names()), ("eps", &["epsA".to_owned(), "epsC".to_owned()][..]));
        let said: Vec<String> = [true, true, true, false].map(|forward| candidates.next(forward)).into();
        assert_eq!(said, ["epsA", "epsC", "epsA", "epsC"]);
    }

    #[test]
    fn behind_store_and_load_files_are_completed() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("my set.txt"), "").unwrap();
        fs::create_dir(folder.path().join("other")).unwrap();
        let place = folder.path().display();
        assert_eq!(complete(&format!("load {place}/my")), Some((format!("load {place}/my set.txt"), None)));
        assert_eq!(complete(&format!("load {place}/o")), Some((format!("load {place}/other/"), None)));
    }
}
