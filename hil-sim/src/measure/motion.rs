//! What kind of motion a stretch of a run is.

use crate::measure::{Measures, ROLLING};
use crate::record::Record;
use core::f64::consts::TAU;
use core::fmt;

/// Kinds of motion, by a rule that looks at the whole stretch; the first that fits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Motion {
    /// In more than one step of a hundred the centre is over [`HOP`] above the lowest it was.
    Hopping,
    /// |ω| never exceeds [`ROLLING`].
    Rest,
    /// It turns by a whole turn or more, nine tenths of its way in the positive direction.
    RollingForth,
    /// The same in the negative direction.
    RollingBack,
    /// It turns back at least twice, and the whole of it is within one turn.
    Rocking,
    /// It turns back at least twice, over more than one turn.
    Sweeping,
    /// None of these.
    Irregular,
}

/// A barrel whose centre is higher than this has left the ground, m.
pub const HOP: f64 = 0.005;

impl Motion {
    /// Every kind.
    pub const ALL: [Motion; 7] = [
        Motion::Rest,
        Motion::RollingForth,
        Motion::RollingBack,
        Motion::Rocking,
        Motion::Sweeping,
        Motion::Hopping,
        Motion::Irregular,
    ];

    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Motion::Hopping => "hopping",
            Motion::Rest => "rest",
            Motion::RollingForth => "rolling +",
            Motion::RollingBack => "rolling -",
            Motion::Rocking => "rocking",
            Motion::Sweeping => "sweeping",
            Motion::Irregular => "irregular",
        }
    }

    /// The kind with this name.
    pub fn find(name: &str) -> Option<Motion> {
        Motion::ALL.into_iter().find(|motion| motion.name() == name)
    }

    /// The kind of motion in these records.
    pub fn of(records: &[Record]) -> Motion {
        let floor = records.iter().map(|r| r.plant.position[2]).fold(f64::INFINITY, f64::min);
        let off_ground = records.iter().filter(|r| r.plant.position[2] > floor + HOP).count();
        if off_ground * 100 > records.len() {
            return Motion::Hopping;
        }
        if records.iter().all(|r| r.plant.omega.abs() <= ROLLING) {
            return Motion::Rest;
        }
        let mut measures = Measures::default();
        records.iter().for_each(|record| measures.add(record));
        let net = records.last().map_or(0.0, |last| last.plant.phi - records[0].plant.phi);
        if net.abs() >= TAU && net.abs() >= 0.9 * measures.turns() * TAU {
            return if net > 0.0 { Motion::RollingForth } else { Motion::RollingBack };
        }
        if measures.reversals().len() < 2 {
            return Motion::Irregular;
        }
        let (low, high) = records
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), r| (low.min(r.plant.phi), high.max(r.plant.phi)));
        if high - low < TAU { Motion::Rocking } else { Motion::Sweeping }
    }
}

impl fmt::Display for Motion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motion(omega: impl Fn(f64) -> f64, height: impl Fn(f64) -> f64) -> Motion {
        let mut phi = 0.0;
        let records: Vec<Record> = (0..3000)
            .map(|k| {
                let t = f64::from(k) / 50.0;
                let mut record = Record::default();
                (record.brain.t, record.plant.omega, record.plant.phi) = (t, omega(t), phi);
                record.plant.position[2] = height(t);
                phi += omega(t) / 50.0;
                record
            })
            .collect();
        Motion::of(&records)
    }

    #[test]
    fn each_kind_is_told_from_the_others() {
        let flat = |_| 0.5;
        assert_eq!(motion(|t| 0.4 * (9.0 * t).sin(), flat), Motion::Rest);
        assert_eq!(motion(|t| 3.0 + (9.0 * t).sin(), flat), Motion::RollingForth);
        assert_eq!(motion(|_| -3.0, flat), Motion::RollingBack);
        assert_eq!(motion(|t| 3.0 * (3.0 * t).sin(), flat), Motion::Rocking);
        assert_eq!(motion(|t| 3.0 * (0.3 * t).sin(), flat), Motion::Sweeping);
        assert_eq!(motion(|_| 3.0, |t| 0.5 + 0.05 * (9.0 * t).sin().max(0.0)), Motion::Hopping);
        assert_eq!(motion(|t| if t < 1.0 { 2.0 } else { 0.0 }, flat), Motion::Irregular);
        for kind in Motion::ALL {
            assert_eq!(Motion::find(kind.name()), Some(kind));
        }
    }
}
