//! A measure of a chain's run as it is asked for and told: `wave:60:600` and its value.

use super::ChainRecord;
use super::measure::{
    asleep, dominant_frequency, in_phase, largest, left_rest, persistence, reach, slowest, speed, wave,
};
use crate::measure::{MeasureError, Value, stretch};
use core::fmt;
use core::str::FromStr;

/// What can be measured of a stretch of a run.
#[derive(Debug)]
pub struct What {
    /// Its name.
    pub name: &'static str,
    /// Its unit, empty for a pure number.
    pub unit: &'static str,
    /// What it is, in a few words.
    pub help: &'static str,
    of: fn(&[ChainRecord]) -> Option<f64>,
}

/// Everything that can be measured.
pub const MEASURES: [What; 14] = [
    What { name: "left-rest", unit: "s", help: "when some pendulum first swings over 0.6 rad", of: left_rest },
    What { name: "speed", unit: "rad/s", help: "root mean square rate of all pendulums", of: |r| Some(speed(r)) },
    What { name: "slowest", unit: "rad/s", help: "the same in the slowest minute", of: |r| Some(slowest(r, 60.0)) },
    What { name: "reach", unit: "rad", help: "largest angle", of: |r| Some(reach(r)) },
    What { name: "lean", unit: "rad", help: "mean angle of the pendulum that leans least", of: |r| Some(lean(r)) },
    What {
        name: "in-phase",
        unit: "",
        help: "share of the motion that all pendulums have in common",
        of: |r| Some(in_phase(r)),
    },
    What {
        name: "wave",
        unit: "",
        help: "how far neighbours swing a quarter period apart, 0 to 1",
        of: |r| Some(wave(r)),
    },
    What { name: "frequency", unit: "Hz", help: "dominant frequency", of: |r| Some(dominant_frequency(r)) },
    What {
        name: "persistence",
        unit: "",
        help: "correlation of the motor values with those a step before",
        of: |r| Some(persistence(r)),
    },
    What { name: "asleep", unit: "", help: "motors that are saturated in the mean", of: |r| Some(asleep(r) as f64) },
    What { name: "max-C", unit: "", help: "largest entry of C, in magnitude", of: |r| Some(largest(r, |r| &r.c)) },
    What { name: "max-A", unit: "", help: "largest entry of A, in magnitude", of: |r| Some(largest(r, |r| &r.a)) },
    What { name: "max-h", unit: "", help: "largest entry of h, in magnitude", of: |r| Some(largest(r, |r| &r.h)) },
    What {
        name: "rate-gain",
        unit: "",
        help: "mean weight of a motor's own rate, the larger of two; where rates are sensed",
        of: rate_gain,
    },
];

fn mean(records: &[ChainRecord], of: impl Fn(&ChainRecord) -> f64) -> f64 {
    records.iter().map(of).sum::<f64>() / records.len() as f64
}

fn lean(records: &[ChainRecord]) -> f64 {
    let pendulums = records.first().map_or(0, |record| record.angles.len());
    (0..pendulums).map(|i| mean(records, |record| record.angles[i]).abs()).fold(f64::INFINITY, f64::min)
}

/// C row by row: a motor's own rate stands behind the angles.
fn rate_gain(records: &[ChainRecord]) -> Option<f64> {
    let first = records.first()?;
    let (sensors, motors) = (first.x.len(), first.y.len());
    let own = |i: usize| mean(records, |record| record.c[i * sensors + motors + i]);
    (sensors == 2 * motors).then(|| (0..motors).map(own).fold(f64::NEG_INFINITY, f64::max))
}

/// What is to be measured, and where.
#[derive(Clone, Copy, Debug)]
pub struct ChainMeasure {
    /// What.
    pub what: &'static What,
    /// From this time on, s.
    from: f64,
    /// Until before this time, s; infinite for the end of the run.
    to: f64,
}

impl ChainMeasure {
    /// The value in these records of a whole run.
    pub fn of(&self, records: &[ChainRecord]) -> Value {
        let at = |t: f64| records.partition_point(|record| record.t < t - 1e-9);
        let records = &records[at(self.from)..at(self.to)];
        let number = if records.is_empty() { None } else { (self.what.of)(records) };
        number.filter(|number| number.is_finite()).map_or(Value::Never, Value::Number)
    }
}

impl fmt::Display for ChainMeasure {
    /// As it is written on the command line.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.what.name)?;
        stretch::write(f, self.from, self.to)
    }
}

impl FromStr for ChainMeasure {
    type Err = MeasureError;

    fn from_str(text: &str) -> Result<Self, MeasureError> {
        let mut parts = text.split(':');
        let name = parts.next().unwrap_or_default();
        let what = MEASURES.iter().find(|what| what.name == name).ok_or_else(|| {
            let names: Vec<&str> = MEASURES.iter().map(|what| what.name).collect();
            MeasureError::Chain(name.to_owned(), names.join(", "))
        })?;
        let (from, to) = stretch::parse(&parts.collect::<Vec<_>>())?;
        Ok(ChainMeasure { what, from, to })
    }
}

/// A number of every control step, by name: angle1, rate2, y3 and so on.
pub fn quantity(name: &str) -> Option<impl Fn(&ChainRecord) -> f64 + use<>> {
    let (kind, index) = name.split_at(name.len().checked_sub(1)?);
    let of: fn(&ChainRecord) -> &Vec<f64> = match kind {
        "angle" => |record| &record.angles,
        "rate" => |record| &record.rates,
        "y" => |record| &record.y,
        _ => return None,
    };
    let index = index.parse::<usize>().ok()?.checked_sub(1)?;
    Some(move |record: &ChainRecord| of(record).get(index).copied().unwrap_or(f64::NAN))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_measure_is_that_of_its_stretch_and_what_is_none_is_told() {
        let record = |k: u32| {
            let t = f64::from(k) / 50.0;
            let c = vec![1.0, 0.0, -3.0, 0.5, 0.0, 1.0, 0.5, -2.0];
            ChainRecord {
                t,
                angles: vec![t, -0.5],
                rates: vec![1.0, 1.0],
                x: vec![0.0; 4],
                y: vec![0.0; 2],
                c,
                h: vec![0.0; 2],
                a: vec![0.0; 8],
                error: 0.0,
                time_loop_error: 0.0,
            }
        };
        let records: Vec<ChainRecord> = (0..100).map(record).collect();
        let value = |text: &str| {
            let measure: ChainMeasure = text.parse().expect("a measure");
            assert_eq!(measure.to_string(), text);
            measure.of(&records)
        };
        assert_eq!(value("reach:0:1"), Value::Number(0.98));
        assert_eq!(value("rate-gain"), Value::Number(-2.0));
        assert_eq!(value("speed:5"), Value::Never);
        assert!(matches!(value("lean:0:1"), Value::Number(n) if (n - 0.49).abs() < 1e-12));
        let error = "waves".parse::<ChainMeasure>().expect_err("no measure").to_string();
        assert!(error.contains("wave,"), "{error}");
        assert_eq!(quantity("angle2").map(|of| of(&records[0])), Some(-0.5));
        assert!(quantity("angle").is_none() && quantity("mass1").is_none() && quantity("").is_none());
    }
}
