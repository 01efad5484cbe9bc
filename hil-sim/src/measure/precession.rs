//! Precession: the barrel stands leaning on its rim, and its lean goes round.
//!
//! Seen from the barrel, the lean points where the inclinations (x1, x2) point. While it precesses, that direction turns
//! steadily one way.

use crate::record::Record;
use core::f64::consts::{FRAC_PI_2, PI, TAU};

/// Least and largest lean of the cylinder axis from the vertical, rad.
pub const LEAN: [f64; 2] = [0.026, 0.61];
/// Slowest turn of the lean's direction, rad/s, in the mean over [`WINDOW`] steps.
pub const SLOWEST: f64 = 2.0;
/// Control steps of that mean: one second.
pub const WINDOW: usize = 50;

/// The longest precession in these records, s.
pub fn longest(records: &[Record]) -> f64 {
    spells(records).into_iter().map(|(from, to)| to - from).fold(0.0, f64::max)
}

/// Beginning and end of every precession in these records, s.
pub fn spells(records: &[Record]) -> Vec<(f64, f64)> {
    let mut spells = Vec::new();
    let mut current: Option<(f64, f64, f64)> = None;
    let turned = directions(records);
    for k in 0..records.len().saturating_sub(WINDOW) {
        let (t, end) = (records[k].brain.t, records[k + WINDOW].brain.t);
        let rate = (turned[k + WINDOW] - turned[k]) / (end - t);
        let leans = records[k..=k + WINDOW].iter().all(|record| {
            let lean = FRAC_PI_2 - record.plant.tilt.abs();
            (LEAN[0]..=LEAN[1]).contains(&lean)
        });
        let goes = leans && rate.abs() >= SLOWEST;
        current = match current {
            Some((from, _, sign)) if goes && rate.signum() == sign => Some((from, end, sign)),
            ended => {
                spells.extend(ended.map(|(from, to, _)| (from, to)));
                goes.then_some((t, end, rate.signum()))
            }
        };
    }
    spells.extend(current.map(|(from, to, _)| (from, to)));
    spells
}

/// The direction of the lean in the barrel's own axes, rad, unwrapped.
fn directions(records: &[Record]) -> Vec<f64> {
    let mut turned = 0.0;
    let mut last: Option<f64> = None;
    records
        .iter()
        .map(|record| {
            let [x1, x2] = record.brain.x.map(f64::from);
            let now = libm::atan2(x2, x1);
            if let Some(last) = last {
                turned += (now - last + PI).rem_euclid(TAU) - PI;
            }
            last = Some(now);
            turned
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A barrel that leans by so much and whose lean turns at so many rad/s.
    fn leaning(lean: impl Fn(f64) -> f64, rate: impl Fn(f64) -> f64) -> Vec<Record> {
        let mut angle = 0.0_f64;
        (0..3000)
            .map(|k| {
                let mut record = Record::default();
                let t = f64::from(k) / 50.0;
                let lean = lean(t);
                record.brain.t = t;
                record.plant.tilt = FRAC_PI_2 - lean;
                record.brain.x = [(lean.sin() * angle.cos()) as f32, (lean.sin() * angle.sin()) as f32];
                angle += rate(t) / 50.0;
                record
            })
            .collect()
    }

    #[test]
    fn only_a_lean_that_goes_round_one_way_is_precession() {
        let longest_of = |records: Vec<Record>| longest(&records);
        assert!((longest_of(leaning(|_| 0.12, |_| -15.0)) - 59.98).abs() < 0.05);
        // Upright, fallen, or with a lean that stays where it is.
        assert_eq!(longest_of(leaning(|_| 0.01, |_| -15.0)), 0.0);
        assert_eq!(longest_of(leaning(|_| 1.2, |_| -15.0)), 0.0);
        assert_eq!(longest_of(leaning(|_| 0.12, |_| 0.5)), 0.0);
        // Back and forth within a second.
        assert!(longest_of(leaning(|_| 0.12, |t| 15.0 * (TAU * t).cos())) < 0.5);
    }

    #[test]
    fn a_change_of_direction_ends_a_spell() {
        let records = leaning(|_| 0.12, |t| if t < 20.0 { 8.0 } else { -8.0 });
        let spells = spells(&records);
        assert_eq!(spells.len(), 2, "{spells:?}");
        assert!((spells[0].1 - 20.0).abs() < 1.0 && (spells[1].0 - 20.0).abs() < 1.0, "{spells:?}");
    }
}
