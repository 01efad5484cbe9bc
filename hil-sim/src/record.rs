//! What is recorded of a run, one record per control step: the brain after learning, and the plant as it stands at the
//! same instant.

use crate::plant::Plant;
use firmware::{Robot, Scalar};
use protocol::Telemetry;

/// The brain after one control step, in its own number format.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BrainRecord<T = f32> {
    /// Time of the step, s.
    pub t: f64,
    /// Inclinations.
    pub x: [T; 2],
    /// Motor values, −1…1.
    pub y: [T; 2],
    /// Controller matrix, row by row.
    pub c: [T; 4],
    /// Controller bias.
    pub h: [T; 2],
    /// Model matrix, row by row.
    pub a: [T; 4],
    /// Model bias.
    pub b: [T; 2],
    /// Prediction error ξ.
    pub xi: [T; 2],
    /// E = ξᵀξ.
    pub error: T,
    /// Time loop error vᵀv.
    pub time_loop_error: T,
}

impl<T: Copy> BrainRecord<T> {
    /// The same record in another number format.
    pub fn map<U>(&self, convert: impl Fn(T) -> U) -> BrainRecord<U> {
        let f = &convert;
        BrainRecord {
            t: self.t,
            x: self.x.map(f),
            y: self.y.map(f),
            c: self.c.map(f),
            h: self.h.map(f),
            a: self.a.map(f),
            b: self.b.map(f),
            xi: self.xi.map(f),
            error: f(self.error),
            time_loop_error: f(self.time_loop_error),
        }
    }
}

impl BrainRecord {
    /// What the robot says of its brain, at time `t`, s.
    pub fn from_telemetry(telemetry: &Telemetry, t: f64) -> Self {
        let Telemetry { x, y, c, h, a, b, xi, time_loop_error, .. } = *telemetry;
        BrainRecord { t, x, y, c, h, a, b, xi, error: xi[0] * xi[0] + xi[1] * xi[1], time_loop_error }
    }
}

impl<S: Scalar> BrainRecord<S> {
    /// The brain of a robot at hand, in its own number format, at time `t`, s.
    pub fn of(robot: &Robot<S>, t: f64) -> Self {
        let firmware::robot::State { x, y, c, h, a, b, xi, error, time_loop_error } = *robot.state();
        BrainRecord { t, x, y, c, h, a, b, xi, error, time_loop_error }
    }
}

/// The simulated barrel at the same instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlantRecord {
    /// Angular velocity about the cylinder axis, rad/s, positive when x turns by U(+χ).
    pub omega: f64,
    /// Its integral from `phi0`, rad.
    pub phi: f64,
    /// Positions of the two weights on their axes, m.
    pub weights: [f64; 2],
    /// Centre of the cylinder, m.
    pub position: [f64; 3],
    /// Tilt of the cylinder axis from the horizontal, rad.
    pub tilt: f64,
    /// Quaternion (w, x, y, z) from body to world axes; NaN where it was not recorded.
    pub orientation: [f64; 4],
}

impl PlantRecord {
    /// The plant as it stands.
    pub fn of(plant: &Plant) -> Self {
        PlantRecord {
            omega: plant.omega(),
            phi: plant.phi(),
            weights: plant.weights(),
            position: plant.position(),
            tilt: plant.tilt(),
            orientation: plant.orientation(),
        }
    }
}

/// One row of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Record {
    /// The brain.
    pub brain: BrainRecord,
    /// The plant.
    pub plant: PlantRecord,
}
