//! Calibration of the inertial sensor: its biases, its scale, and how it is mounted, from the body at rest.
//!
//! At rest, whatever the attitude, the gyroscope reads its bias ([`CalibrationStep::Still`]). The accelerometer's mean
//! with each end of each body axis up in turn ([`CalibrationStep::Up`]), in m/s² and chip axes, is
//!
//! ```text
//! m(±j) = b ± g S⁻¹ Mᵀ e_j            S = diag(scale), M = mounting, e_j = body axis j
//! ```
//!
//! so b is the mean of all six, and half the difference of a pair, divided by g, is column j of D = S⁻¹ Mᵀ. Row i of D
//! is chip axis i seen from the body, divided by its scale: its length gives the scale and its direction the column i
//! of M. Nobody puts a barrel on its side to a tenth of a degree; what is left of that makes the columns a little skew,
//! and M is the nearest rotation. M may be any right-handed one, so the chip may be soldered in any attitude.
//!
//! An attitude that was not what it was said to be shows: in a scale more than [`SCALE_LIMIT`] off, in a left-handed M,
//! or in one of the six means being more than [`RESIDUAL_LIMIT`] away from gravity along its axis. (Bias and mounting
//! take up part of the error of a single attitude: up to 5° off, it does not show.) The other five are kept, so that
//! the one can be repeated.

use nalgebra::{Matrix3, Vector3};
use protocol::message::{BodyAxis, CalibrationPhase, CalibrationProgress, CalibrationStep};

use crate::attitude::{ACCELEROMETER_LSB, GYROSCOPE_LSB, ImuCalibration, STANDARD_GRAVITY};

/// Readings that one step averages: two seconds.
pub const READINGS: u16 = 2000;

/// Largest difference between two readings of the accelerometer in one step, counts of 1/8192 g: 30 mg, twenty times
/// the standard deviation of its noise.
pub const ACCELEROMETER_SPREAD: i16 = 250;

/// Largest difference between two readings of the gyroscope in one step, counts of 1/16.4 °/s: 2 °/s, thirty times
/// the standard deviation of its noise.
pub const GYROSCOPE_SPREAD: i16 = 33;

/// Largest mean of the gyroscope in one step, counts: 3 °/s, six times the offset of a typical part
/// (DS-000347, table 1).
pub const RATE_LIMIT: i32 = 49;

/// Largest deviation of the accelerometer's scale from 1.
pub const SCALE_LIMIT: f32 = 0.2;

/// Largest distance of a mean from gravity along its axis, in g: the sine of 3°.
pub const RESIDUAL_LIMIT: f32 = 0.0523;

/// The calibration, step by step.
#[derive(Clone, Debug, Default)]
pub struct Calibrator {
    phase: CalibrationPhase,
    step: Step,
    average: Average,
    /// Which of the six attitudes are known, bit n for the nth [`BodyAxis`].
    known: u8,
    /// Mean of the accelerometer in each of them, m/s², chip axes.
    means: [Vector3<f32>; 6],
}

/// What is being averaged for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Step {
    #[default]
    Nothing,
    Still,
    Up(BodyAxis),
}

impl Calibrator {
    /// Begins a step; one that is not finished is given up. [`CalibrationStep::Status`] changes nothing.
    pub fn begin(&mut self, step: CalibrationStep) {
        let step = match step {
            CalibrationStep::Status => return,
            CalibrationStep::Restart => {
                *self = Calibrator::default();
                return;
            }
            CalibrationStep::Still => Step::Still,
            CalibrationStep::Up(axis) => Step::Up(axis),
        };
        self.step = step;
        self.average = Average::default();
        self.phase = CalibrationPhase::Averaging;
    }

    /// Gives the step up that is not finished; the attitudes that are known stay.
    pub fn give_up(&mut self) {
        if self.step != Step::Nothing {
            (self.step, self.phase) = (Step::Nothing, CalibrationPhase::Idle);
        }
    }

    /// How far it is.
    pub fn progress(&self) -> CalibrationProgress {
        CalibrationProgress { phase: self.phase, attitudes: self.known }
    }

    /// Takes one reading of the sensor, as its registers have it. `Some` is the calibration to be used from now on:
    /// `current` with what has been found.
    pub fn tick(
        &mut self,
        accelerometer: [i16; 3],
        gyroscope: [i16; 3],
        current: &ImuCalibration,
    ) -> Option<ImuCalibration> {
        if self.step == Step::Nothing {
            return None;
        }
        self.average.add(accelerometer, gyroscope);
        let outcome = if self.average.moved() {
            Err(CalibrationPhase::Moved)
        } else if self.average.readings < READINGS {
            return None;
        } else {
            self.finish(current)
        };
        self.step = Step::Nothing;
        self.phase = outcome.err().unwrap_or(CalibrationPhase::Applied);
        outcome.ok()
    }

    /// What the averages of a step make: a calibration, or the phase without one.
    fn finish(&mut self, current: &ImuCalibration) -> Result<ImuCalibration, CalibrationPhase> {
        let Step::Up(axis) = self.step else {
            let gyroscope_bias = mean(self.average.gyroscope.sum, GYROSCOPE_LSB);
            return Ok(ImuCalibration { gyroscope_bias, ..*current });
        };
        let mean = mean(self.average.accelerometer.sum, ACCELEROMETER_LSB);
        for (i, (known, _)) in DIRECTIONS.iter().enumerate() {
            if *known == axis {
                self.means[i] = mean;
                self.known |= 1 << i;
            }
        }
        if self.known != 0b11_1111 {
            return Err(CalibrationPhase::Taken);
        }
        solve(&self.means, current).ok_or(CalibrationPhase::Inconsistent)
    }
}

/// The six attitudes, each with the direction of up in body axes. Opposite ones are neighbours.
const DIRECTIONS: [(BodyAxis, [f32; 3]); 6] = [
    (BodyAxis::Slider1, [1.0, 0.0, 0.0]),
    (BodyAxis::Slider1Negative, [-1.0, 0.0, 0.0]),
    (BodyAxis::Cylinder, [0.0, 1.0, 0.0]),
    (BodyAxis::CylinderNegative, [0.0, -1.0, 0.0]),
    (BodyAxis::Slider2, [0.0, 0.0, 1.0]),
    (BodyAxis::Slider2Negative, [0.0, 0.0, -1.0]),
];

/// The calibration that the six means make, or `None` if they do not fit together.
fn solve(means: &[Vector3<f32>; 6], current: &ImuCalibration) -> Option<ImuCalibration> {
    let bias = means.iter().sum::<Vector3<f32>>() / 6.0;
    let pair = |j: usize| (means[2 * j] - means[2 * j + 1]) / (2.0 * STANDARD_GRAVITY);
    // The rows of D, as columns.
    let mut mounting = Matrix3::from_columns(&[pair(0), pair(1), pair(2)]).transpose();
    let mut scale = Vector3::zeros();
    for i in 0..3 {
        scale[i] = 1.0 / libm::sqrtf(mounting.column(i).norm_squared());
        // In a range there is nothing that is not a number.
        if !(1.0 - SCALE_LIMIT..=1.0 + SCALE_LIMIT).contains(&scale[i]) {
            return None;
        }
        mounting.column_mut(i).scale_mut(scale[i]);
    }
    if mounting.determinant() < 0.5 {
        return None;
    }
    // The nearest rotation: Newton's iteration for the polar factor, without an inverse. It converges from columns of
    // length 1 if they are not very skew, and what does not is found below.
    for _ in 0..6 {
        mounting = mounting * (Matrix3::identity() * 3.0 - mounting.tr_mul(&mounting)) * 0.5;
    }
    let fits = means.iter().zip(DIRECTIONS).all(|(mean, (_, up))| {
        let force = mounting * (mean - bias).component_mul(&scale);
        let residual = force / STANDARD_GRAVITY - Vector3::from(up);
        residual.norm_squared() <= RESIDUAL_LIMIT * RESIDUAL_LIMIT
    });
    let found = ImuCalibration { accelerometer_bias: bias, accelerometer_scale: scale, mounting, ..*current };
    fits.then_some(found)
}

fn mean(sum: [i32; 3], lsb: f32) -> Vector3<f32> {
    Vector3::from(sum.map(|sum| sum as f32)) * (lsb / f32::from(READINGS))
}

/// The readings of one step so far.
#[derive(Clone, Copy, Debug, Default)]
struct Average {
    readings: u16,
    accelerometer: Sum,
    gyroscope: Sum,
}

impl Average {
    fn add(&mut self, accelerometer: [i16; 3], gyroscope: [i16; 3]) {
        let first = self.readings == 0;
        self.accelerometer.add(accelerometer, first);
        self.gyroscope.add(gyroscope, first);
        self.readings += 1;
    }

    /// Whether this was no rest: it shook or tilted or, with everything taken, kept turning.
    fn moved(&self) -> bool {
        let turned = self.gyroscope.sum.iter().any(|sum| sum.abs() > RATE_LIMIT * i32::from(READINGS));
        turned || self.accelerometer.spread() > ACCELEROMETER_SPREAD || self.gyroscope.spread() > GYROSCOPE_SPREAD
    }
}

/// Sum and range of three axes. [`READINGS`] of the largest counts fit the sum.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    sum: [i32; 3],
    least: [i16; 3],
    most: [i16; 3],
}

impl Sum {
    fn add(&mut self, counts: [i16; 3], first: bool) {
        if first {
            (self.least, self.most) = (counts, counts);
        }
        for (i, count) in counts.into_iter().enumerate() {
            self.sum[i] += i32::from(count);
            self.least[i] = self.least[i].min(count);
            self.most[i] = self.most[i].max(count);
        }
    }

    /// Largest range of an axis, counts.
    fn spread(&self) -> i16 {
        (0..3).map(|i| self.most[i].saturating_sub(self.least[i])).max().unwrap_or(0)
    }
}
