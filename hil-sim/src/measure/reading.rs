//! A measure of a run as it is asked for and told: `mean:omega:60:120` and its value.

use super::motion::Motion;
use super::quantity::{QUANTITIES, Quantity};
use super::{Measures, precession, stretch};
use crate::record::Record;
use core::fmt;
use core::str::FromStr;
use firmware::timing::CONTROL_PERIOD;

/// A statistic of one quantity over a stretch of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Statistic {
    /// Mean over its control steps.
    Mean,
    /// Standard deviation over its control steps.
    Deviation,
    /// Smallest.
    Min,
    /// Largest.
    Max,
    /// At its first control step.
    First,
    /// At its last control step.
    Last,
    /// Last less first, by the time between them: the mean rate of change, per second.
    Rate,
    /// Settling time, s: after this it stays within a tenth of its largest departure from its final value, the mean of
    /// the last quarter.
    Settle,
}

/// Every statistic with its name and meaning.
pub const STATISTICS: [(Statistic, &str, &str); 8] = [
    (Statistic::Mean, "mean", "mean over the control steps"),
    (Statistic::Deviation, "sd", "standard deviation over the control steps"),
    (Statistic::Min, "min", "smallest"),
    (Statistic::Max, "max", "largest"),
    (Statistic::First, "first", "at the first control step"),
    (Statistic::Last, "last", "at the last control step"),
    (Statistic::Rate, "rate", "last less first, by the time between them"),
    (
        Statistic::Settle,
        "settle",
        "s after which it stays within a tenth of its largest departure from its final value",
    ),
];

impl Statistic {
    fn name(self) -> &'static str {
        STATISTICS.iter().find(|(statistic, ..)| *statistic == self).map_or("", |(_, name, _)| name)
    }

    fn of(self, records: &[Record], quantity: &Quantity) -> Option<f64> {
        let numbers = || records.iter().map(|record| quantity.of(record));
        let mean = |from: usize| numbers().skip(from).sum::<f64>() / (records.len() - from) as f64;
        let (first, last) = (records.first()?, records.last()?);
        Some(match self {
            Statistic::Mean => mean(0),
            Statistic::Deviation => {
                let mean = mean(0);
                (numbers().map(|n| (n - mean).powi(2)).sum::<f64>() / records.len() as f64).sqrt()
            }
            Statistic::Min => numbers().fold(f64::INFINITY, f64::min),
            Statistic::Max => numbers().fold(f64::NEG_INFINITY, f64::max),
            Statistic::First => quantity.of(first),
            Statistic::Last => quantity.of(last),
            Statistic::Rate => {
                let time = last.brain.t - first.brain.t;
                if time <= 0.0 {
                    return None;
                }
                (quantity.of(last) - quantity.of(first)) / time
            }
            Statistic::Settle => {
                let end = mean(records.len() * 3 / 4);
                let band = 0.1 * numbers().map(|n| (n - end).abs()).fold(0.0, f64::max);
                let outside = numbers().collect::<Vec<_>>().iter().rposition(|n| (n - end).abs() > band);
                outside.map_or(0.0, |i| since(first, records.get(i + 1).unwrap_or(last).brain.t))
            }
        })
    }
}

/// Time from this record to `t`, s, on the grid of control steps.
fn since(first: &Record, t: f64) -> f64 {
    crate::run::time(((t - first.brain.t) / CONTROL_PERIOD).round() as u64)
}

/// What can be measured of a stretch of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum What {
    /// A statistic of a quantity.
    Of(Statistic, &'static Quantity),
    /// When |ω| first exceeds [`super::ROLLING`], s after the stretch begins.
    LeftRest,
    /// How often the rolling turns back: ω beyond [`super::ROLLING`] on the other side than before.
    Reversals,
    /// Mean time between two reversals, s.
    Interval,
    /// Turns about the cylinder axis, both directions added.
    Turns,
    /// When a barrel that stood fell and did not get up again, s after the stretch begins.
    Fell,
    /// The longest precession, s: see [`precession`].
    Precession,
    /// The kind of motion, a word: see [`Motion`].
    Motion,
}

/// Names, units and meanings of what is no statistic.
pub const EVENTS: [(What, &str, &str, &str); 7] = [
    (What::LeftRest, "left-rest", "s", "when |omega| first exceeds 0.5 rad/s, after the stretch begins"),
    (What::Reversals, "reversals", "", "how often the rolling turns back (beyond 0.5 rad/s on the other side)"),
    (What::Interval, "interval", "s", "mean time between two reversals"),
    (What::Turns, "turns", "", "turns about the cylinder axis, both directions added"),
    (What::Fell, "fell", "s", "when a barrel that stood fell for good, after the stretch begins"),
    (
        What::Precession,
        "precession",
        "s",
        "longest time that the barrel leans and its lean goes round in one direction",
    ),
    (What::Motion, "motion", "", "rest, rolling +, rolling -, rocking, sweeping, hopping or irregular"),
];

/// What is to be measured, and where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measure {
    /// What.
    pub what: What,
    /// From this time on, s.
    pub from: f64,
    /// Until before this time, s; infinite for the end of the run.
    pub to: f64,
}

/// What was measured.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number.
    Number(f64),
    /// A word.
    Word(&'static str),
    /// It never happened, or there was nothing to measure.
    Never,
}

impl Value {
    /// The number, if it is one.
    pub fn number(&self) -> Option<f64> {
        match self {
            Value::Number(number) => Some(*number),
            Value::Word(_) | Value::Never => None,
        }
    }
}

impl fmt::Display for Value {
    /// A number in the shortest form that reads back exactly.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Number(number) => write!(f, "{number}"),
            Value::Word(word) => f.write_str(word),
            Value::Never => f.write_str("never"),
        }
    }
}

impl Measure {
    /// What, over the whole run.
    pub const fn whole(what: What) -> Self {
        Measure { what, from: 0.0, to: f64::INFINITY }
    }

    /// Whether the record at this time, s, is part of it.
    pub fn covers(&self, t: f64) -> bool {
        t >= self.from - 1e-9 && t < self.to - 1e-9
    }

    /// The value in these records of a run, in the order of time; those outside of its stretch may be missing.
    pub fn of(&self, records: &[Record]) -> Value {
        let start = records.partition_point(|record| record.brain.t < self.from - 1e-9);
        let end = records.partition_point(|record| record.brain.t < self.to - 1e-9);
        let records = &records[start..end.max(start)];
        let measures = || {
            let mut measures = Measures::default();
            records.iter().for_each(|record| measures.add(record));
            measures
        };
        let Some(first) = records.first() else { return Value::Never };
        let since = |t: f64| since(first, t);
        let number = match self.what {
            What::Of(statistic, quantity) => statistic.of(records, quantity),
            What::LeftRest => measures().left_rest().map(since),
            What::Reversals => Some(measures().reversals().len() as f64),
            What::Interval => measures().reversal_interval(),
            What::Turns => Some(measures().turns()),
            What::Fell => measures().fell().map(since),
            What::Precession => Some(precession::longest(records)),
            What::Motion => return Value::Word(Motion::of(records).name()),
        };
        number.filter(|number| number.is_finite()).map_or(Value::Never, Value::Number)
    }

    /// Its unit, empty for a pure number or a word.
    pub fn unit(&self) -> &'static str {
        match self.what {
            What::Of(Statistic::Settle, _) => "s",
            What::Of(Statistic::Rate, quantity) if quantity.name == "phi" => "rad/s",
            What::Of(Statistic::Rate, _) => "per s",
            What::Of(_, quantity) => quantity.unit,
            what => EVENTS.iter().find(|event| event.0 == what).map_or("", |event| event.2),
        }
    }
}

impl fmt::Display for Measure {
    /// As it is written on the command line.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.what {
            What::Of(statistic, quantity) => write!(f, "{}:{}", statistic.name(), quantity.name)?,
            what => f.write_str(EVENTS.iter().find(|event| event.0 == what).map_or("", |event| event.1))?,
        }
        stretch::write(f, self.from, self.to)
    }
}

/// Measures of a run that is under way; keeps the records that they need.
#[derive(Clone, Debug, Default)]
pub struct Readings {
    measures: Vec<Measure>,
    records: Vec<Record>,
}

impl Readings {
    /// For these measures.
    pub fn new(measures: &[Measure]) -> Self {
        Readings { measures: measures.to_vec(), records: Vec::new() }
    }

    /// Takes the next record.
    pub fn add(&mut self, record: &Record) {
        if self.measures.iter().any(|measure| measure.covers(record.brain.t)) {
            self.records.push(*record);
        }
    }

    /// The value of each measure, in the order in which they were asked for.
    pub fn values(&self) -> impl Iterator<Item = Value> {
        self.measures.iter().map(|measure| measure.of(&self.records))
    }
}

/// Why a text is no measure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MeasureError {
    /// There is no such statistic or event.
    What(String),
    /// There is no such quantity.
    Quantity(String),
    /// There is no such measure of a chain; there are these.
    Chain(String, String),
    /// The stretch is not FROM:TO.
    Stretch(String),
}

impl fmt::Display for MeasureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            MeasureError::What(name) => write!(
                f,
                "there is no measure '{name}'; write STATISTIC:QUANTITY[:FROM[:TO]] with a statistic of {}, or one of {}, as \
                 in mean:omega:60:120",
                STATISTICS.map(|(_, name, _)| name).join(", "),
                EVENTS.map(|event| event.1).join(", ")
            ),
            MeasureError::Quantity(name) => {
                let names: Vec<&str> = QUANTITIES.iter().map(|quantity| quantity.name).collect();
                write!(f, "there is no quantity '{name}'; there are {}", names.join(", "))
            }
            MeasureError::Chain(name, known) => write!(f, "there is no measure '{name}' of a chain; there are {known}"),
            MeasureError::Stretch(text) => {
                write!(f, "'{text}' is no stretch of a run; write :FROM or :FROM:TO in s, as in mean:omega:60:120")
            }
        }
    }
}

impl std::error::Error for MeasureError {}

impl FromStr for Measure {
    type Err = MeasureError;

    fn from_str(text: &str) -> Result<Self, MeasureError> {
        let mut parts = text.split(':');
        let name = parts.next().unwrap_or_default();
        let what = match EVENTS.iter().find(|event| event.1 == name) {
            Some(event) => event.0,
            None => {
                let statistic = STATISTICS.iter().find(|(_, of, _)| *of == name);
                let (statistic, ..) = statistic.ok_or_else(|| MeasureError::What(name.to_owned()))?;
                let name = parts.next().unwrap_or_default();
                let quantity = Quantity::find(name).ok_or_else(|| MeasureError::Quantity(name.to_owned()))?;
                What::Of(*statistic, quantity)
            }
        };
        let (from, to) = stretch::parse(&parts.collect::<Vec<_>>())?;
        Ok(Measure { what, from, to })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn records(omega: impl Fn(f64) -> f64) -> Vec<Record> {
        (0..500)
            .map(|k| {
                let mut record = Record::default();
                record.brain.t = f64::from(k) / 50.0;
                record.plant.omega = omega(record.brain.t);
                record.plant.phi = 2.0 * record.brain.t;
                record
            })
            .collect()
    }

    fn measured(text: &str, omega: impl Fn(f64) -> f64) -> Value {
        let measure: Measure = text.parse().expect("a measure");
        assert_eq!(measure.to_string(), text);
        measure.of(&records(omega))
    }

    #[test]
    fn measures_are_those_of_their_stretch() {
        let ramp = |t: f64| t;
        assert_eq!(measured("first:omega:2:4", ramp), Value::Number(2.0));
        assert_eq!(measured("last:omega:2:4", ramp), Value::Number(3.98));
        assert_eq!(measured("max:omega", ramp), Value::Number(9.98));
        assert_eq!(measured("rate:phi:1", ramp), Value::Number(2.0));
        assert_eq!(measured("mean:omega:20", ramp), Value::Never);
        assert_eq!(measured("left-rest:2", |t| if t < 5.0 { 0.0 } else { 1.0 }), Value::Number(3.0));
        assert_eq!(measured("interval", |_| 0.0), Value::Never);
        assert_eq!(measured("motion:0:5", |_| 0.0), Value::Word("rest"));
    }

    #[test]
    fn a_first_order_lag_settles_after_its_time_constant_times_the_logarithm_of_ten() {
        let Value::Number(settled) = measured("settle:omega", |t| 1.0 - (-t / 0.7).exp()) else { panic!("it settles") };
        assert!((settled - 0.7 * 10_f64.ln()).abs() < 0.03, "{settled}");
    }

    #[test]
    fn what_is_no_measure_is_told_with_what_is() {
        let error = |text: &str| text.parse::<Measure>().expect_err("no measure").to_string();
        assert!(error("average:omega").contains("mean"), "{}", error("average:omega"));
        assert!(error("mean:velocity").contains("omega"), "{}", error("mean:velocity"));
        for text in ["mean:omega:5:2", "mean:omega:x", "interval:-1", "mean:omega:1:2:3", "mean:omega:nan"] {
            assert!(error(text).contains("stretch"), "{text}: {}", error(text));
        }
    }
}
