//! Runs many cases on all cores, shows how long it will take, and keeps what is done: a campaign that was interrupted goes
//! on where it stopped.

use super::case::{Case, Outcome};
use crate::draft::Draft;
use crate::failure::Failure;
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::{Value as Json, json};
use std::collections::{HashMap, HashSet};
use std::fs::File;
use std::hash::{DefaultHasher, Hasher};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

/// Outcomes by [`Case::key`].
pub type Outcomes = HashMap<String, Outcome>;

/// How a campaign is run.
pub struct Campaign<'a> {
    /// How many cases at once.
    pub jobs: usize,
    /// Where what is done is kept until all is; nowhere in a test.
    pub journal: Option<PathBuf>,
    /// Goes up when it is to stop.
    pub stop: &'a AtomicBool,
    /// Whether progress is shown.
    pub quiet: bool,
}

impl Campaign<'_> {
    /// Takes these cases out of the journal, whose report is written; what else is in it is another report's, and stays.
    ///
    /// # Errors
    /// A journal that cannot be written.
    pub fn forget(&self, cases: &[&Case]) -> Result<(), Failure> {
        let Some(path) = &self.journal else { return Ok(()) };
        let failed = |error: std::io::Error| Failure::broken(format!("cannot write {}: {error}", path.display()));
        let text = std::fs::read_to_string(path).map_err(failed)?;
        let done: HashSet<String> = cases.iter().map(|case| case.key()).collect();
        let is_open = |line: &&str| entry(line).is_some_and(|(key, _)| !done.contains(&key));
        let mut lines = text.lines();
        let head = lines.next().unwrap_or_default();
        let open: Vec<&str> = lines.filter(is_open).collect();
        if open.is_empty() {
            return std::fs::remove_file(path).map_err(failed);
        }
        let draft = Draft::beside(path).map_err(failed)?;
        let kept = core::iter::once(head).chain(open).map(|line| format!("{line}\n")).collect::<String>();
        std::fs::write(draft.path(), kept).and_then(|()| draft.commit()).map_err(failed)
    }

    /// Runs every case that the journal does not have yet; the costly ones first, the same one once.
    ///
    /// # Errors
    /// Ctrl-C, with what is done kept; a case that cannot be run; a journal that cannot be written.
    pub fn run<'c>(&self, cases: impl IntoIterator<Item = &'c Case>) -> Result<Outcomes, Failure> {
        let (mut journal, mut outcomes) = Journal::open(self.journal.as_deref())?;
        let mut seen = HashSet::new();
        let mut open: Vec<&Case> = cases.into_iter().filter(|case| seen.insert(case.key())).collect();
        let all = open.len();
        open.retain(|case| !outcomes.contains_key(&case.key()));
        open.sort_by(|a, b| b.cost().total_cmp(&a.cost()));
        let progress = Progress::new(self.quiet, all, all - open.len(), open.iter().map(|case| case.cost()).sum());
        let next = AtomicUsize::new(0);
        let (sender, done) = channel();
        let give_up = AtomicBool::new(false);
        thread::scope(|scope| {
            for _ in 0..self.jobs.clamp(1, open.len().max(1)) {
                let (sender, next, open, give_up) = (sender.clone(), &next, &open, &give_up);
                scope.spawn(move || {
                    while let Some(case) = open.get(next.fetch_add(1, Ordering::Relaxed)) {
                        if give_up.load(Ordering::Relaxed) || sender.send((*case, case.run(self.stop))).is_err() {
                            return;
                        }
                    }
                });
            }
            drop(sender);
            let mut first_failure = None;
            loop {
                match done.recv_timeout(Duration::from_millis(200)) {
                    Ok((case, Ok(outcome))) => {
                        let kept = journal.keep(case, &outcome);
                        outcomes.insert(case.key(), outcome);
                        progress.add(case.cost());
                        if let Err(failure) = kept {
                            give_up.store(true, Ordering::Relaxed);
                            first_failure.get_or_insert(failure);
                        }
                    }
                    Ok((_, Err(failure))) => {
                        give_up.store(true, Ordering::Relaxed);
                        first_failure.get_or_insert(failure);
                    }
                    Err(RecvTimeoutError::Timeout) => progress.show(),
                    Err(RecvTimeoutError::Disconnected) => break,
                }
            }
            progress.finish();
            first_failure.map_or(Ok(()), Err)
        })?;
        Ok(outcomes)
    }
}

/// What is done, one line a case, behind a line that says which program did it.
struct Journal {
    file: Option<(PathBuf, File)>,
}

impl Journal {
    /// Opens the journal and reads what it holds, if this very program wrote it; begins it anew otherwise. A last line that
    /// was torn off is taken away.
    fn open(path: Option<&Path>) -> Result<(Journal, Outcomes), Failure> {
        let Some(path) = path else { return Ok((Journal { file: None }, Outcomes::new())) };
        let failed = |error: std::io::Error| {
            Failure::bad(format!("cannot write {}: {error}; choose a folder that may be written", path.display()))
        };
        let mut file =
            File::options().read(true).write(true).create(true).truncate(false).open(path).map_err(failed)?;
        if file.try_lock().is_err() {
            return Err(Failure::bad(format!(
                "another report is being made in {}: wait for it, or choose another folder with --out",
                path.parent().unwrap_or(path).display()
            )));
        }
        let mut text = String::new();
        // What is no text was not written by this program.
        let _ = file.read_to_string(&mut text);
        let program = fingerprint().map_err(failed)?;
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let mut lines = text[..whole].lines();
        let known = lines.next() == Some(&program);
        let end = if known { whole as u64 } else { 0 };
        file.set_len(end).and_then(|()| file.seek(SeekFrom::Start(end))).map_err(failed)?;
        if !known {
            writeln!(file, "{program}").map_err(failed)?;
        }
        // A line that cannot be read is a case to be run again.
        let outcomes = lines.filter(|_| known).filter_map(entry).collect();
        Ok((Journal { file: Some((path.to_owned(), file)) }, outcomes))
    }

    fn keep(&mut self, case: &Case, outcome: &Outcome) -> Result<(), Failure> {
        let Some((path, file)) = self.file.as_mut().filter(|_| case.is_of_this_program()) else { return Ok(()) };
        let line = json!({ "case": case.key(), "outcome": outcome.to_json() }).to_string() + "\n";
        file.write_all(line.as_bytes()).map_err(|error| {
            Failure::broken(format!("cannot write {}: {error}; make room and give the same line again", path.display()))
        })
    }
}

/// A line of the journal.
fn entry(line: &str) -> Option<(String, Outcome)> {
    let json: Json = serde_json::from_str(line).ok()?;
    Some((json["case"].as_str()?.to_owned(), Outcome::from_json(&json["outcome"])?))
}

/// What tells this program from every other: outcomes of another build are another's.
fn fingerprint() -> std::io::Result<String> {
    let mut hash = DefaultHasher::new();
    hash.write(&std::fs::read(std::env::current_exe()?)?);
    Ok(format!("barrel {} {:016x}", env!("CARGO_PKG_VERSION"), hash.finish()))
}

/// How far it is, and how long it will take.
struct Progress {
    bar: ProgressBar,
    start: Instant,
    cost: f64,
    done: std::cell::Cell<f64>,
}

impl Progress {
    fn new(quiet: bool, all: usize, before: usize, cost: f64) -> Self {
        let bar = ProgressBar::new(all as u64);
        bar.set_draw_target(if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() });
        // The template is a constant: its test is every campaign.
        if let Ok(style) = ProgressStyle::with_template("{bar:24.green/white} {pos}/{len} runs  {msg}") {
            bar.set_style(style.progress_chars("━╸ "));
        }
        bar.inc(before as u64);
        Progress { bar, start: Instant::now(), cost, done: std::cell::Cell::new(0.0) }
    }

    fn add(&self, cost: f64) {
        self.done.set(self.done.get() + cost);
        self.bar.inc(1);
        self.show();
    }

    fn show(&self) {
        let (elapsed, done) = (self.start.elapsed(), self.done.get());
        let left = match done > 0.01 * self.cost {
            true => HumanDuration(elapsed.mul_f64((self.cost / done - 1.0).max(0.0))).to_string(),
            false => "reckoning how long".to_owned(),
        };
        self.bar.set_message(format!("{left} left"));
    }

    fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cases() -> Vec<Case> {
        let line = |seed| format!("run homeokinetic --seed {seed} --duration 2 --measure mean:E --measure motion");
        (1..=6).map(|seed| Case::new(line(seed)).traced(&["omega"], 10)).collect()
    }

    fn run(journal: Option<PathBuf>, jobs: usize) -> Outcomes {
        let stop = AtomicBool::new(false);
        Campaign { jobs, journal, stop: &stop, quiet: true }.run(&cases()).expect("it runs")
    }

    #[test]
    fn what_comes_out_does_not_depend_on_the_number_of_jobs() {
        let outcomes = run(None, 1);
        assert_eq!(outcomes.len(), 6);
        assert_eq!(outcomes, run(None, 3));
    }

    #[test]
    fn an_interrupted_campaign_goes_on_where_it_stopped_even_with_a_torn_line() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("journal");
        let whole = run(Some(path.clone()), 2);
        let text = std::fs::read_to_string(&path).expect("a journal");
        let third = text.match_indices('\n').nth(3).expect("it has lines").0;
        // Three cases, half of a fourth; the second is marked, so that one sees whether it was run again.
        std::fs::write(&path, text[..third + 60].replace("\"broken\":null", "\"broken\":\"kept\"")).expect("written");
        let resumed = run(Some(path.clone()), 2);
        assert_eq!(resumed.values().filter(|outcome| outcome.broken.is_some()).count(), 3);
        for (key, outcome) in &resumed {
            assert_eq!((&outcome.values, &outcome.trace), (&whole[key].values, &whole[key].trace), "{key}");
        }
        // A report that is made of some of it takes its own out, and no more.
        let stop = AtomicBool::new(false);
        let campaign = Campaign { jobs: 1, journal: Some(path.clone()), stop: &stop, quiet: true };
        campaign.forget(&cases()[..4].iter().collect::<Vec<_>>()).expect("written");
        assert_eq!(std::fs::read_to_string(&path).expect("it stays").lines().count(), 1 + 2);
        campaign.forget(&cases().iter().collect::<Vec<_>>()).expect("removed");
        assert!(!path.exists());
        // The journal of another program is begun anew.
        std::fs::write(&path, text.replacen("barrel", "another", 1)).expect("written");
        assert_eq!(run(Some(path), 2), whole);
    }

    #[test]
    fn a_campaign_that_is_stopped_says_so() {
        let stop = AtomicBool::new(true);
        let stopped = Campaign { jobs: 2, journal: None, stop: &stop, quiet: true }.run(&cases());
        assert!(matches!(stopped, Err(Failure::Interrupted(_))), "{stopped:?}");
    }
}
