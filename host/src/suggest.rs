//! "Did you mean": the valid name nearest to a misspelt one.

use std::path::Path;

/// The candidate nearest to `name`, or `None` without candidates.
///
/// A name that differs in case only wins, then a candidate that `name` is the beginning of, then the smallest edit
/// distance (insertions, deletions, changes and swaps of neighbours, case ignored). Among equals the first one wins.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let lower = name.to_lowercase();
    candidates.into_iter().min_by_key(|candidate| {
        let candidate = candidate.to_lowercase();
        let rank = if candidate == lower {
            0
        } else if lower.len() > 1 && candidate.starts_with(&lower) {
            1
        } else {
            2
        };
        (rank, strsim::damerau_levenshtein(&candidate, &lower))
    })
}

/// `": did you mean 'epsA'?"`, ready to be put behind an error, or nothing without candidates.
pub fn did_you_mean<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> String {
    nearest(name, candidates).map_or_else(String::new, |nearest| format!(": did you mean '{nearest}'?"))
}

/// The file in the same folder with the nearest name, as a question.
pub fn neighbour(path: &Path) -> String {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let Some(name) = path.file_name().map(|name| name.to_string_lossy()) else { return String::new() };
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut files: Vec<String> = entries
        .filter(|entry| entry.path().is_file())
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .filter(|file| *file != name)
        .collect();
    files.sort();
    did_you_mean(&name, files.iter().map(String::as_str))
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::parameter::TABLE;

    fn parameter(name: &str) -> &'static str {
        nearest(name, TABLE.iter().map(|p| p.name)).unwrap()
    }

    #[test]
    fn slips_of_the_finger_lead_to_the_name_that_was_meant() {
        for (typed, meant) in [
            ("epsa", "epsA"),
            ("epsB", "epsA"),
            ("eps C", "epsC"),
            ("c11", "C11"),
            ("kp", "KP"),
            ("gravty", "gravity"),
            ("grvaity", "gravity"),
            ("senserNoise", "sensorNoise"),
            ("max", "maxForce"),
            ("clipz", "clipZeta"),
        ] {
            assert_eq!(parameter(typed), meant, "typed {typed:?}");
        }
    }

    #[test]
    fn there_is_a_nearest_name_for_anything_but_nothing_to_choose_from() {
        assert!(nearest("", ["a", "b"]).is_some());
        assert!(nearest("ξ…", ["a", "b"]).is_some());
        assert_eq!(nearest("x", []), None);
        assert_eq!(did_you_mean("x", []), "");
        assert_eq!(did_you_mean("epsa", ["epsA"]), ": did you mean 'epsA'?");
    }
}
