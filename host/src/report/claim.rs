//! A claim of the chapter: what is run for it, and how its runs are judged.

use super::case::{Case, Outcome};
use super::figure::Figure;
use core::fmt;

/// How much is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scale {
    /// A first look: fewer seeds, coarser maps.
    pub quick: bool,
    /// The seeds are this one and those that follow it.
    pub seed: u64,
}

impl Scale {
    /// `full` seeds, or `quick` for a first look.
    pub fn seeds(self, full: u64, quick: u64) -> core::ops::Range<u64> {
        self.seed..self.seed + if self.quick { quick } else { full }
    }

    /// One of two, the second for a first look.
    pub fn pick<T>(self, full: T, quick: T) -> T {
        if self.quick { quick } else { full }
    }
}

/// A claim, with all that is needed to judge it.
pub struct Claim {
    /// Short name, as in `barrel report --only locking`.
    pub name: &'static str,
    /// Where the chapter has it.
    pub section: &'static str,
    /// The claim, in one sentence.
    pub title: &'static str,
    /// What is run and how it is measured, with every departure from the chapter's settings.
    pub method: String,
    /// The runs.
    pub cases: Vec<Case>,
    judge: Box<Judge>,
}

type Judge = dyn Fn(&[Outcome]) -> Finding + Send + Sync;

impl Claim {
    /// A claim whose runs are judged by `judge`, which gets their outcomes in the order of `cases`.
    pub fn new(
        name: &'static str,
        section: &'static str,
        title: &'static str,
        method: impl Into<String>,
        cases: Vec<Case>,
        judge: impl Fn(&[Outcome]) -> Finding + Send + Sync + 'static,
    ) -> Claim {
        Claim { name, section, title, method: method.into(), cases, judge: Box::new(judge) }
    }

    /// The finding of these outcomes, one for each case, in their order.
    pub fn judge(&self, outcomes: &[Outcome]) -> Finding {
        let mut finding = (self.judge)(outcomes);
        let broken: Vec<&str> = outcomes.iter().filter_map(|outcome| outcome.broken.as_deref()).collect();
        if let Some(first) = broken.first() {
            finding.check(
                "runs that came to their end",
                (outcomes.len() - broken.len()) as f64,
                "",
                Wanted::AtLeast(outcomes.len() as f64),
            );
            finding.note(format!("A run that did not: {first}."));
        }
        finding
    }
}

impl fmt::Debug for Claim {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Claim {} ({} cases)", self.name, self.cases.len())
    }
}

/// What a number must be for the claim to hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wanted {
    /// Within these, both included.
    Within(f64, f64),
    /// This or more.
    AtLeast(f64),
    /// This or less.
    AtMost(f64),
    /// Anything: it is told, not judged.
    Anything,
}

impl Wanted {
    fn is_met_by(self, value: f64) -> bool {
        match self {
            Wanted::Within(low, high) => (low..=high).contains(&value),
            Wanted::AtLeast(low) => value >= low,
            Wanted::AtMost(high) => value <= high,
            Wanted::Anything => true,
        }
    }
}

impl fmt::Display for Wanted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Wanted::Within(low, high) => write!(f, "{low} to {high}"),
            Wanted::AtLeast(low) => write!(f, "at least {low}"),
            Wanted::AtMost(high) => write!(f, "at most {high}"),
            Wanted::Anything => Ok(()),
        }
    }
}

/// A number and what it must be.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// What it is.
    pub what: String,
    /// Its value; NaN for what never happened.
    pub value: f64,
    /// Its unit, empty for a pure number.
    pub unit: &'static str,
    /// What it must be.
    pub wanted: Wanted,
}

impl Check {
    /// Whether it is so.
    pub fn holds(&self) -> bool {
        self.wanted.is_met_by(self.value)
    }
}

/// Whether a claim holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Every number is what it must be.
    Holds,
    /// Some are, some are not.
    Partly,
    /// None is.
    Fails,
    /// Nothing was judged.
    NotJudged,
}

impl Verdict {
    /// In words.
    pub const fn name(self) -> &'static str {
        match self {
            Verdict::Holds => "holds",
            Verdict::Partly => "holds in part",
            Verdict::Fails => "does not hold",
            Verdict::NotJudged => "not judged",
        }
    }
}

/// A table of the report.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    /// What stands over it.
    pub caption: String,
    /// Its columns.
    pub head: Vec<String>,
    /// Its rows, each as long as the head.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table with this caption and these columns.
    pub fn new(caption: impl Into<String>, head: &[&str]) -> Table {
        Table { caption: caption.into(), head: head.iter().map(ToString::to_string).collect(), rows: Vec::new() }
    }

    /// Adds a row.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }
}

/// What the runs of a claim show.
#[derive(Clone, Debug, Default)]
pub struct Finding {
    /// The numbers that decide, and others worth telling.
    pub checks: Vec<Check>,
    /// Pictures with what they show.
    pub figures: Vec<(String, Figure)>,
    /// Tables.
    pub tables: Vec<Table>,
    /// What else is to be said: why a claim does not hold, what was searched.
    pub notes: Vec<String>,
}

impl Finding {
    /// A number that decides.
    pub fn check(&mut self, what: impl Into<String>, value: f64, unit: &'static str, wanted: Wanted) {
        self.checks.push(Check { what: what.into(), value, unit, wanted });
    }

    /// A number that is told and decides nothing.
    pub fn tell(&mut self, what: impl Into<String>, value: f64, unit: &'static str) {
        self.check(what, value, unit, Wanted::Anything);
    }

    /// A picture.
    pub fn figure(&mut self, caption: impl Into<String>, figure: Figure) {
        self.figures.push((caption.into(), figure));
    }

    /// A sentence.
    pub fn note(&mut self, text: impl Into<String>) {
        self.notes.push(text.into());
    }

    /// Whether the claim holds.
    pub fn verdict(&self) -> Verdict {
        let deciding = || self.checks.iter().filter(|check| check.wanted != Wanted::Anything);
        match (deciding().count(), deciding().filter(|check| check.holds()).count()) {
            (0, _) => Verdict::NotJudged,
            (all, holding) if all == holding => Verdict::Holds,
            (_, 0) => Verdict::Fails,
            _ => Verdict::Partly,
        }
    }
}
