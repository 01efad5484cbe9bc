//! Attitude: which way is up, seen from the body, out of a gyroscope and an accelerometer that roll with it.
//!
//! Body axes: X is sliding axis 1, Y the cylinder axis, Z sliding axis 2, right-handed. The estimate is the unit vector
//! `up` in these axes; the inclinations that the brain reads are its X and Z components, the vertical components of the
//! sliding axes.
//!
//! The estimator is the complementary filter of R. Mahony, T. Hamel and J.-M. Pflimlin, "Nonlinear complementary filters
//! on the special orthogonal group", IEEE Trans. Automatic Control 53 (2008), in its explicit form with one reference
//! direction:
//!
//! ```text
//! up'   = −(ω − b + k_P e) × up        e = ĝ × up
//! b'    = −k_I e                       |b| limited
//! ```
//!
//! ω is the gyroscope, b its bias, ĝ the direction in which the accelerometer sees up. It sees more than gravity, though:
//! at the place r of the chip in a cylinder that rolls on the ground without slip, the specific force is
//!
//! ```text
//! f = g up + ω×(ω×r) + ω'×r + R ω'_Y (Y × up)
//! ```
//!
//! the centripetal and the tangential acceleration of the chip about the centre, and the acceleration of the centre
//! along the ground. Those three are computed from the gyroscope and taken off f before it corrects anything.
//! What is left over is trusted less the further its magnitude is from g and the faster the body turns.
//!
//! What remains wrong, on simulated rolling, is measured in `tests/attitude.rs`. Two things no filter of this kind can
//! see: a bias of the accelerometer at rest (20 mg are 20 mrad) and a slipping barrel.
//!
//! The counts of the chip become physical units in [`ImuCalibration`]; [`ImuMonitor`] finds the readings that no barrel
//! can produce. Chip: TDK ICM-42688-P, DS-000347, at ±4 g and ±2000 °/s.

use core::f32::consts::PI;

use micromath::F32Ext;
use nalgebra::{Matrix3, Vector3};
use protocol::message::FaultCode;

use crate::scalar::Scalar;
use crate::vector::Vec3;

/// Acceleration in m/s² that an accelerometer's "1 g" means (the standard gravity of CGPM 1901).
pub const STANDARD_GRAVITY: f32 = 9.80665;

/// Specific force of one count, m/s², at ±4 g (DS-000347, table 2: 8192 LSB/g).
pub const ACCELEROMETER_LSB: f32 = STANDARD_GRAVITY / 8192.0;

/// Angular velocity of one count, rad/s, at ±2000 °/s (DS-000347, table 1: 16.4 LSB/(°/s)).
pub const GYROSCOPE_LSB: f32 = PI / 180.0 / 16.4;

/// Longest time step that [`Attitude::update`] takes, s: one control step, which at 2000 °/s is 0.7 rad.
pub const LONGEST_STEP: f32 = 0.02;

/// One reading of the inertial sensor in physical units, body axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuSample {
    /// Angular velocity of the body, rad/s.
    pub angular_velocity: Vector3<f32>,
    /// Specific force where the chip sits, m/s²: +g along up at rest. `None` where the accelerometer was of no use in
    /// this tick, as in a knock that drives it to full scale; the gyroscope then carries the estimate alone.
    pub specific_force: Option<Vector3<f32>>,
}

/// How the counts of one particular chip on one particular board become physical units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuCalibration {
    /// What the accelerometer reads too much, m/s², chip axes.
    pub accelerometer_bias: Vector3<f32>,
    /// Factor on the accelerometer after its bias is taken off, nominally 1, chip axes.
    pub accelerometer_scale: Vector3<f32>,
    /// What the gyroscope reads at rest, rad/s, chip axes; the estimator finds what is left of it.
    pub gyroscope_bias: Vector3<f32>,
    /// Factor on the gyroscope after its bias is taken off, nominally 1, chip axes.
    pub gyroscope_scale: Vector3<f32>,
    /// Rotation from chip axes to body axes: its columns are the chip's axes in the body.
    pub mounting: Matrix3<f32>,
    /// Where the chip sits in the body, m, from the middle of the cylinder, body axes.
    pub position: Vector3<f32>,
}

impl Default for ImuCalibration {
    /// A perfect chip, aligned with the body, in its middle.
    fn default() -> Self {
        ImuCalibration {
            accelerometer_bias: Vector3::zeros(),
            accelerometer_scale: Vector3::new(1.0, 1.0, 1.0),
            gyroscope_bias: Vector3::zeros(),
            gyroscope_scale: Vector3::new(1.0, 1.0, 1.0),
            mounting: Matrix3::identity(),
            position: Vector3::zeros(),
        }
    }
}

impl ImuCalibration {
    /// Specific force in body axes, m/s², of the accelerometer's counts.
    pub fn specific_force(&self, counts: [i16; 3]) -> Vector3<f32> {
        self.body_axes(counts, ACCELEROMETER_LSB, &self.accelerometer_bias, &self.accelerometer_scale).into()
    }

    /// Angular velocity in body axes, rad/s, of the gyroscope's counts.
    pub fn angular_velocity(&self, counts: [i16; 3]) -> Vector3<f32> {
        self.body_axes(counts, GYROSCOPE_LSB, &self.gyroscope_bias, &self.gyroscope_scale).into()
    }

    fn body_axes(&self, counts: [i16; 3], lsb: f32, bias: &Vector3<f32>, scale: &Vector3<f32>) -> Vec3 {
        let [x, y, z] = counts.map(f32::from);
        let (bias, scale, m) = (Vec3::from(*bias), Vec3::from(*scale), &self.mounting);
        let chip = Vec3 { x, y, z } * lsb - bias;
        let chip = Vec3 { x: chip.x * scale.x, y: chip.y * scale.y, z: chip.z * scale.z };
        Vec3 {
            x: m.m11 * chip.x + m.m12 * chip.y + m.m13 * chip.z,
            y: m.m21 * chip.x + m.m22 * chip.y + m.m23 * chip.z,
            z: m.m31 * chip.x + m.m32 * chip.y + m.m33 * chip.z,
        }
    }
}

/// Why a reading of the inertial sensor cannot be true.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImpossibleSensor {
    /// All three axes of a sensor read 0x8000, what its registers hold while it is off or not ready.
    NotReady,
    /// The accelerometer reads 0 on all three axes: a bus stuck low.
    BusLow,
    /// The accelerometer reads 0xFFFF on all three axes: a bus stuck high, or no chip on it.
    BusHigh,
    /// The gyroscope is at full scale, or the accelerometer has been for longer than a knock lasts.
    Saturated,
    /// The same six numbers again and again: noise alone should change them.
    Stuck,
    /// Neither held nor rolling nor falling, the specific force was this far from gravity for so long.
    NoGravity,
}

impl From<ImpossibleSensor> for FaultCode {
    fn from(_: ImpossibleSensor) -> FaultCode {
        FaultCode::ImpossibleSensor
    }
}

/// How long a doubtful reading is put up with, in servo ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImuPatience {
    /// Identical readings in a row. Each has about one chance in a million to repeat the one before (noise of 13 and
    /// 1 LSB), so a few repeats only mean that the chip sampled a little slower than the tick.
    pub stuck: u32,
    /// Accelerometer at full scale in a row: a weight that hits its stop can do that for milliseconds.
    pub saturated: u32,
    /// Gyroscope further than [`GYROSCOPE_JUMP`] from the last reading that was believed, in a row.
    pub jumps: u8,
    /// Specific force below a tenth or above three times gravity in a row: no free fall indoors lasts half a second.
    pub no_gravity: u32,
}

impl Default for ImuPatience {
    fn default() -> Self {
        ImuPatience { stuck: 50, saturated: 20, jumps: 3, no_gravity: 500 }
    }
}

/// More than any knock changes the rate by from one reading to the next, counts: 500 °/s. It takes one bit that the bus got wrong,
/// and nothing on the bus tells.
pub const GYROSCOPE_JUMP: i16 = 8192;

/// Watches the counts of the inertial sensor for readings that no barrel can produce.
///
/// A simulated sensor needs its noise, or it will be found [`ImpossibleSensor::Stuck`] while the body rests.
#[derive(Clone, Debug)]
pub struct ImuMonitor {
    patience: ImuPatience,
    last: Option<([i16; 3], [i16; 3])>,
    same: u32,
    saturated: u32,
    /// The last gyroscope that was believed.
    believed: Option<[i16; 3]>,
    jumps: u8,
    no_gravity: u32,
}

impl ImuMonitor {
    /// A monitor that has seen nothing yet.
    pub fn new(patience: ImuPatience) -> Self {
        ImuMonitor { patience, last: None, same: 0, saturated: 0, believed: None, jumps: 0, no_gravity: 0 }
    }

    /// Checks the counts of one tick and turns them into physical units.
    ///
    /// A single sample at full scale on the accelerometer comes back without its specific force, and one whose gyroscope jumped
    /// not at all; a doubtful reading becomes an error, or is believed, once it has lasted as long as [`ImuPatience`] allows.
    pub fn read(
        &mut self,
        accelerometer: [i16; 3],
        gyroscope: [i16; 3],
        calibration: &ImuCalibration,
    ) -> Result<Option<ImuSample>, ImpossibleSensor> {
        let reading = (accelerometer, gyroscope);
        self.same = if self.last == Some(reading) { self.same.saturating_add(1) } else { 0 };
        self.last = Some(reading);

        let square = sum_of_squares(accelerometer);
        let knocked = at_full_scale(accelerometer, square);
        self.saturated = if knocked { self.saturated.saturating_add(1) } else { 0 };
        let possible = 819 * 819..=24_576 * 24_576;
        self.no_gravity = if possible.contains(&square) { 0 } else { self.no_gravity.saturating_add(1) };

        let (all_of_accelerometer, all_of_gyroscope) = (uniform(accelerometer), uniform(gyroscope));
        if all_of_accelerometer == Some(i16::MIN) || all_of_gyroscope == Some(i16::MIN) {
            Err(ImpossibleSensor::NotReady)
        } else if all_of_accelerometer == Some(0) {
            Err(ImpossibleSensor::BusLow)
        } else if all_of_accelerometer == Some(-1) {
            // Of the accelerometer only: at rest a gyroscope reads 0, 0, 0 or −1, −1, −1 every so often.
            Err(ImpossibleSensor::BusHigh)
        } else if self.jumped(gyroscope) {
            Ok(None)
        } else if at_full_scale(gyroscope, sum_of_squares(gyroscope)) || self.saturated > self.patience.saturated {
            Err(ImpossibleSensor::Saturated)
        } else if self.same > self.patience.stuck {
            Err(ImpossibleSensor::Stuck)
        } else if self.no_gravity > self.patience.no_gravity {
            Err(ImpossibleSensor::NoGravity)
        } else {
            Ok(Some(ImuSample {
                angular_velocity: calibration.angular_velocity(gyroscope),
                specific_force: (!knocked).then(|| calibration.specific_force(accelerometer)),
            }))
        }
    }

    /// Whether this is too far from the last reading to be believed, and not yet for too long.
    fn jumped(&mut self, gyroscope: [i16; 3]) -> bool {
        let far = |(a, b): (&i16, &i16)| a.abs_diff(*b) > GYROSCOPE_JUMP.unsigned_abs();
        let jumped = self.believed.is_some_and(|believed| believed.iter().zip(&gyroscope).any(far));
        if jumped && self.jumps < self.patience.jumps {
            self.jumps += 1;
            return true;
        }
        (self.believed, self.jumps) = (Some(gyroscope), 0);
        false
    }
}

/// Three times 2³⁰ at most.
fn sum_of_squares(counts: [i16; 3]) -> u32 {
    counts.iter().map(|c| i32::from(*c).pow(2).cast_unsigned()).sum()
}

/// Whether an axis is at its end; `square` tells at a glance that none is.
fn at_full_scale(counts: [i16; 3], square: u32) -> bool {
    const END: u16 = 32_767;
    square >= (END as u32).pow(2) && counts.iter().any(|c| c.unsigned_abs() >= END)
}

/// What all three axes read, if they read the same.
fn uniform([x, y, z]: [i16; 3]) -> Option<i16> {
    (x == y && y == z).then_some(x)
}

/// What the estimator is told about the body and how far it trusts its sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttitudeSettings {
    /// Radius on which the body rolls, m; 0 takes no acceleration of the centre off.
    pub radius: f32,
    /// Gravity, m/s², that the remaining specific force is compared with.
    pub gravity: f32,
    /// k_P, 1/s: how fast the accelerometer pulls the estimate. Slower is smoother and forgets the gyroscope's bias less.
    pub correction: f32,
    /// k_I, 1/s²: how fast the gyroscope's bias is learnt; k_P²/4 is critical damping.
    pub bias_correction: f32,
    /// Largest bias that is believed, rad/s for each axis.
    pub bias_limit: f32,
    /// Start-up, s: k_P is raised as `start_up / t`, at first [`START_UP_BOOST`]-fold, and k_I by the square of that,
    /// except that the bias waits for the first tenth of the start-up to be over.
    pub start_up: f32,
    /// Rate, rad/s, at which the accelerometer's weight has fallen to a half.
    pub rate_gate: f32,
    /// Relative deviation of the remaining magnitude from gravity at which the weight has fallen to zero.
    pub magnitude_gate: f32,
    /// Time constant, s, of the derivative of the gyroscope.
    pub derivative_time: f32,
}

/// Largest factor on the correction during start-up.
pub const START_UP_BOOST: f32 = 10.0;

impl Default for AttitudeSettings {
    /// A table-top barrel of 0.12 m radius. Of k_P = 0.25, 0.5 and 1, critically damped, on the sweeps of
    /// `tests/attitude.rs` and with the chip's largest biases: 9.0, 4.6 and 6.6 mrad rms.
    fn default() -> Self {
        AttitudeSettings {
            radius: 0.12,
            gravity: STANDARD_GRAVITY,
            correction: 0.5,
            bias_correction: 0.0625,
            bias_limit: 0.03,
            start_up: 10.0,
            rate_gate: 10.0,
            magnitude_gate: 0.3,
            derivative_time: 0.01,
        }
    }
}

/// A number that is not finite, or a time step outside 0…[`LONGEST_STEP`], was refused or came out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotFinite;

impl From<NotFinite> for FaultCode {
    fn from(_: NotFinite) -> FaultCode {
        FaultCode::NonFinite
    }
}

/// The estimator; see the [module](self) for its equations.
#[derive(Clone, Debug)]
pub struct Attitude {
    settings: AttitudeSettings,
    /// Place of the chip, m, body axes.
    position: Vec3,
    /// `None` until the first usable specific force.
    up: Option<Vec3>,
    bias: Vec3,
    /// Bias-corrected angular velocity of the last tick, rad/s.
    rate: Vec3,
    /// Gyroscope of the last tick as it came, rad/s.
    last_gyroscope: Vec3,
    /// Low-passed gyroscope, whose distance from the gyroscope gives the derivative.
    slow_rate: Vec3,
    /// Time since the first sample, s, up to the end of start-up.
    age: f32,
}

impl Attitude {
    /// An estimator that knows nothing yet, for a chip at `position` (m, body axes, [`ImuCalibration::position`]).
    /// A time or limit below 0 counts as 0.
    pub fn new(mut settings: AttitudeSettings, position: Vector3<f32>) -> Self {
        for limit in [&mut settings.bias_limit, &mut settings.start_up, &mut settings.derivative_time] {
            *limit = limit.at_least(0.0);
        }
        Attitude {
            settings,
            position: position.into(),
            up: None,
            bias: Vec3::ZERO,
            rate: Vec3::ZERO,
            last_gyroscope: Vec3::ZERO,
            slow_rate: Vec3::ZERO,
            age: 0.0,
        }
    }

    /// Forgets everything but the settings.
    pub fn reset(&mut self) {
        *self = Attitude::new(self.settings, self.position.into());
    }

    /// Unit vector up in body axes; up along Z (slider 2 upright) before the first sample.
    pub fn up(&self) -> Vector3<f32> {
        self.up.map_or(Vector3::z(), Vector3::from)
    }

    /// The inclinations x1, x2: vertical components of sliding axes 1 and 2, −1…1.
    pub fn inclination(&self) -> [f32; 2] {
        let up = self.up();
        [up.x, up.z]
    }

    /// Angular velocity with the bias taken off, rad/s, body axes.
    pub fn rate(&self) -> Vector3<f32> {
        self.rate.into()
    }

    /// Bias of the gyroscope as learnt so far, rad/s, body axes.
    pub fn bias(&self) -> Vector3<f32> {
        self.bias.into()
    }

    /// Whether start-up is over.
    pub fn is_settled(&self) -> bool {
        self.up.is_some() && self.age >= self.settings.start_up
    }

    /// One servo tick: `sample` was taken now, `dt` seconds after the one before.
    ///
    /// On an error the estimate stays as it was, except that an estimate which would no longer be finite is forgotten.
    pub fn update(&mut self, sample: &ImuSample, dt: f32) -> Result<(), NotFinite> {
        let gyroscope = Vec3::from(sample.angular_velocity);
        let specific_force = sample.specific_force.map(Vec3::from);
        if !gyroscope.is_finite() || specific_force.is_some_and(|f| !f.is_finite()) || !(dt > 0.0 && dt <= LONGEST_STEP)
        {
            return Err(NotFinite);
        }
        let Some(up) = self.up else {
            if let Some(f) = specific_force {
                self.start(gyroscope, f);
            }
            return self.checked();
        };

        // The rate between two samples is their mean: with the newest alone the estimate would lag or lead by half a
        // step, 4 mrad at 8 rad/s.
        let mean_rate = (gyroscope + self.last_gyroscope) * 0.5 - self.bias;
        self.last_gyroscope = gyroscope;
        self.rate = gyroscope - self.bias;

        // First-order lag and the derivative that belongs to it, backward Euler: stable for any time constant.
        let derivative_time = self.settings.derivative_time + dt;
        let acceleration = (gyroscope - self.slow_rate) / derivative_time;
        self.slow_rate = self.slow_rate + acceleration * dt;

        let predicted = rotated(up, mean_rate * dt);
        let (error, weight) = match specific_force {
            Some(f) => self.correction(f, acceleration, predicted),
            None => (Vec3::ZERO, 0.0),
        };
        let boost = (self.settings.start_up / self.age.at_least(1e-3)).clamp_to(1.0, START_UP_BOOST);
        let gain = (self.settings.correction * boost * weight * dt).clamp_to(0.0, 1.0);
        let up = predicted - error.cross(predicted) * gain;
        // One Newton step for 1/√: the length is off by 1e-3 at most, which leaves an error of 1e-6.
        self.up = Some(up * (1.5 - 0.5 * up.norm_squared()));

        let limit = self.settings.bias_limit;
        // Not yet while the boost is full: the first sample may have been taken in the middle of a jerk, and what the
        // estimate then has to make up for is no bias.
        let learning =
            if boost < START_UP_BOOST { self.settings.bias_correction * boost * boost * weight * dt } else { 0.0 };
        self.bias = (self.bias - error * learning).clamp_to(-limit, limit);
        self.age = (self.age + dt).clamp_to(0.0, self.settings.start_up);
        self.checked()
    }

    /// The first sample: the body may turn, but evenly. There is no derivative yet to tell.
    fn start(&mut self, gyroscope: Vec3, specific_force: Vec3) {
        let gravity = specific_force - gyroscope.cross(gyroscope.cross(self.position));
        let square = gravity.norm_squared();
        if square > 0.0 && square < 1e6 {
            let mut up = gravity * square.invsqrt();
            for _ in 0..3 {
                up = up * (1.5 - 0.5 * up.norm_squared());
            }
            self.up = Some(up);
            self.last_gyroscope = gyroscope;
            self.slow_rate = gyroscope;
            self.rate = gyroscope;
        }
    }

    /// The rotation that would bring `up` to where the accelerometer sees it (its axis times the sine of its angle,
    /// within 5 %), and how far that is to be trusted, 0…1.
    fn correction(&self, f: Vec3, acceleration: Vec3, up: Vec3) -> (Vec3, f32) {
        let settings = &self.settings;
        let r = self.position;
        let centripetal = self.rate.cross(self.rate.cross(r));
        let tangential = acceleration.cross(r);
        // Y × up points along the ground and shrinks to nothing as the cylinder stands up, where it does not roll.
        let rolling = Vec3 { x: up.z, y: 0.0, z: -up.x } * (settings.radius * acceleration.y);
        let gravity = f - centripetal - tangential - rolling;

        let square = gravity.norm_squared();
        let g = settings.gravity;
        // |a²/g² − 1| / 2 is the relative deviation of a from g to first order, without a root.
        let deviation = (0.5 * (square / (g * g) - 1.0)).abs();
        let by_magnitude = (1.0 - deviation / settings.magnitude_gate).clamp_to(0.0, 1.0);
        if !(by_magnitude > 0.0 && square > 0.0) {
            return (Vec3::ZERO, 0.0);
        }
        let turns = self.rate.norm_squared() / (settings.rate_gate * settings.rate_gate);
        let weight = by_magnitude / (1.0 + turns);
        // micromath's 1/√ is a shift and a subtraction and errs by up to 5 %. Here its error scales the gain of a slow
        // loop and nothing else; the direction, and with it what the loop converges to, is exact. (It wants a positive
        // argument, which the check above has made sure of.)
        (gravity.cross(up) * square.invsqrt(), weight)
    }

    /// Forgets an estimate that is no longer finite.
    fn checked(&mut self) -> Result<(), NotFinite> {
        let finite = self.up.is_none_or(|up| (up.norm_squared() - 1.0).abs() < 0.1)
            && self.bias.is_finite()
            && self.slow_rate.is_finite();
        if finite {
            Ok(())
        } else {
            self.reset();
            Err(NotFinite)
        }
    }
}

/// A vector that stands still, seen from axes that turned by `angle` (rad, axis times angle): Rodrigues' formula with
/// the first two terms of sine and cosine, good to 1e-7 for the 35 mrad of a tick at 2000 °/s.
fn rotated(v: Vec3, angle: Vec3) -> Vec3 {
    let square = angle.norm_squared();
    let once = angle.cross(v);
    let twice = angle.cross(once);
    v - once * (1.0 - square / 6.0) + twice * (0.5 - square / 24.0)
}
