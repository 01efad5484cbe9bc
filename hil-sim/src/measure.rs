//! What a run did, in numbers: when it left rest, how fast it rolled, how often it turned back.
//!
//! [`Measures`] takes one record at a time and sums up a whole run. [`Measure`] is one number of a stretch of it, by name.

pub mod motion;
pub mod precession;
pub mod quantity;
mod reading;
pub mod stretch;

pub use motion::Motion;
pub use quantity::Quantity;
pub use reading::{EVENTS, Measure, MeasureError, Readings, STATISTICS, Statistic, Value, What};

use crate::record::Record;

/// Rolling means faster than this, rad/s: the chapter's barrel at rest trembles well below it.
pub const ROLLING: f64 = 0.5;

/// A barrel stands while its axis is steeper than this, rad.
pub const STANDING: f64 = core::f64::consts::FRAC_PI_4;

/// Measures gathered one record at a time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measures {
    steps: u64,
    last_time: f64,
    left_rest: Option<f64>,
    direction: f64,
    reversals: Vec<f64>,
    turned: f64,
    last_phi: Option<f64>,
    max_omega: f64,
    sum_speed: f64,
    sum_error: f64,
    sum_time_loop_error: f64,
    max_tilt: f64,
    stood: bool,
    fell: Option<f64>,
    path: f64,
    last_position: Option<[f64; 3]>,
    first_controller: Option<f64>,
    last_controller: f64,
}

impl Measures {
    /// Takes the next record.
    pub fn add(&mut self, record: &Record) {
        let (t, omega) = (record.brain.t, record.plant.omega);
        self.steps += 1;
        self.last_time = t;
        if omega.abs() > ROLLING {
            self.left_rest.get_or_insert(t);
            if omega.signum() == -self.direction {
                self.reversals.push(t);
            }
            self.direction = omega.signum();
        }
        self.turned += self.last_phi.map_or(0.0, |last| (record.plant.phi - last).abs());
        self.last_phi = Some(record.plant.phi);
        let [px, py, _] = record.plant.position;
        self.path += self.last_position.map_or(0.0, |[x, y, _]| (px - x).hypot(py - y));
        self.last_position = Some(record.plant.position);
        self.max_omega = self.max_omega.max(omega.abs());
        self.sum_speed += omega.abs();
        self.sum_error += f64::from(record.brain.error);
        self.sum_time_loop_error += f64::from(record.brain.time_loop_error);
        self.max_tilt = self.max_tilt.max(record.plant.tilt);
        if record.plant.tilt > STANDING {
            self.stood = true;
            self.fell = None;
        } else if self.stood {
            self.fell.get_or_insert(t);
        }
        self.last_controller = norm(&record.brain.c);
        self.first_controller.get_or_insert(self.last_controller);
    }

    /// Control steps seen.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// When |ω| first exceeded [`ROLLING`], s.
    pub fn left_rest(&self) -> Option<f64> {
        self.left_rest
    }

    /// When the rolling turned back: ω beyond [`ROLLING`] on the other side than before, s.
    pub fn reversals(&self) -> &[f64] {
        &self.reversals
    }

    /// Mean time between two reversals, s.
    pub fn reversal_interval(&self) -> Option<f64> {
        match self.reversals[..] {
            [first, .., last] => Some((last - first) / (self.reversals.len() - 1) as f64),
            _ => None,
        }
    }

    /// Mean and largest |ω|, rad/s.
    pub fn speed(&self) -> (f64, f64) {
        (self.sum_speed / self.steps.max(1) as f64, self.max_omega)
    }

    /// Whole turns about the cylinder axis, both directions added.
    pub fn turns(&self) -> f64 {
        self.turned / core::f64::consts::TAU
    }

    /// Length of the path of the centre over the ground, m.
    pub fn path(&self) -> f64 {
        self.path
    }

    /// Mean prediction error and mean time loop error.
    pub fn errors(&self) -> (f64, f64) {
        let n = self.steps.max(1) as f64;
        (self.sum_error / n, self.sum_time_loop_error / n)
    }

    /// |C| (Frobenius) at the start and at the end.
    pub fn controller(&self) -> (f64, f64) {
        (self.first_controller.unwrap_or(0.0), self.last_controller)
    }

    /// When the barrel, having stood, fell and did not get up again, s.
    pub fn fell(&self) -> Option<f64> {
        self.fell
    }

    /// The steepest tilt of the cylinder axis, rad.
    pub fn max_tilt(&self) -> f64 {
        self.max_tilt
    }

    /// The run in words and numbers, one fact a line.
    pub fn summary(&self) -> Vec<String> {
        let (mean, max) = self.speed();
        let mut lines = Vec::new();
        lines.push(match self.left_rest {
            None => format!("The barrel stayed at rest: |omega| never exceeded {ROLLING} rad/s."),
            Some(0.0) => "The barrel was rolling from the start.".to_owned(),
            Some(t) => format!("The barrel left rest after {t:.1} s."),
        });
        if self.left_rest.is_some() {
            lines.push(format!(
                "It rolled at {mean:.1} rad/s on average, {max:.1} at most: {:.0} turns, {:.0} m on the ground.",
                self.turns(),
                self.path()
            ));
            lines.push(match (self.reversals.len(), self.reversal_interval()) {
                (0, _) => "It never turned back.".to_owned(),
                (1, _) => format!("It turned back once, at {:.1} s.", self.reversals[0]),
                (n, Some(interval)) => format!("It turned back {n} times, every {interval:.1} s on average."),
                (n, None) => format!("It turned back {n} times."),
            });
        }
        match self.fell {
            Some(t) => lines.push(format!("It stood upright and fell after {t:.1} s.")),
            None if self.stood => lines.push("It stood upright to the end.".to_owned()),
            None if self.max_tilt > 0.1 => {
                lines.push(format!("Its axis tilted by up to {:.0} degrees.", self.max_tilt.to_degrees()));
            }
            None => {}
        }
        let (error, time_loop_error) = self.errors();
        let (first, last) = self.controller();
        lines.push(format!(
            "Mean prediction error {error:.2e}, mean time loop error {time_loop_error:.2e}; |C| went from {first:.2} to {last:.2}."
        ));
        lines
    }
}

/// Frobenius norm of a matrix given row by row.
pub fn norm(c: &[f32; 4]) -> f64 {
    c.iter().map(|c| f64::from(*c).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(omega: impl Fn(f64) -> f64) -> Measures {
        let mut measures = Measures::default();
        let mut phi = 0.0;
        for k in 0..3000 {
            let t = f64::from(k) / 50.0;
            let mut record = Record::default();
            (record.brain.t, record.plant.omega, record.plant.phi) = (t, omega(t), phi);
            phi += omega(t) / 50.0;
            measures.add(&record);
        }
        measures
    }

    #[test]
    fn a_sweep_is_seen_as_reversals_half_a_period_apart() {
        let m = measured(|t| 4.0 * (core::f64::consts::TAU * t / 20.0).sin());
        let interval = m.reversal_interval().expect("it sweeps");
        assert!((interval - 10.0).abs() < 0.03, "{interval}");
        assert_eq!(m.reversals().len(), 5, "{:?}", m.reversals());
    }

    #[test]
    fn trembling_below_the_threshold_is_rest() {
        let m = measured(|t| 0.4 * (30.0 * t).sin());
        assert_eq!(m.left_rest(), None);
        assert!(m.summary()[0].contains("stayed at rest"));
    }
}
