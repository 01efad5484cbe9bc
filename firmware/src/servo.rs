//! Servo: brings one weight to its place on its axis, a PID in the original barrel's form, once per servo tick.
//!
//! ```text
//! e = setpoint − position                          m
//! F = KP (e + KI ∫e dt + KD d)                     N, limited to ±maxForce
//! duty = F / stall_force + back_emf · v / free_speed    limited to ±duty_limit
//! ```
//!
//! `d` is the filtered slope of the error, set-point steps included, or of the position alone with its sign turned
//! (`derivativeOnMeasurement`). The two bodies roll at quite different speeds with the one and the other: the slope of
//! the set point is a phase lead of KD times the frequency in the loop through the brain.
//!
//! Integral and derivative terms are lengths, each with its own limit, as in the simulator that the chapter was written
//! with. Against wind-up the integral stands still while force or duty are at their limit and it would push them
//! further (conditional integration; K. J. Åström and T. Hägglund, "PID Controllers", 2nd ed., ISA 1995, section 3.5).
//! The derivative goes through a first-order lag (ibid., section 3.2, backward difference, section 3.6); see
//! [`ServoSettings::derivative_time`] for how long it should be.

use protocol::message::FaultCode;
use protocol::parameter::Id;

use crate::scalar::Scalar;
use crate::vector::are_finite;

/// Longest time step that [`Servo::update`] takes, s.
pub const LONGEST_STEP: f32 = 0.1;

/// The law of the servo, in the units of the table of parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoSettings {
    /// `KP`, N/m.
    pub kp: f32,
    /// `KI`, 1/s, relative to KP.
    pub ki: f32,
    /// `KD`, s, relative to KP.
    pub kd: f32,
    /// `derivativeOnMeasurement`: the slope of the position (true) or of the error (false).
    pub derivative_on_measurement: bool,
    /// `maxForce`, N.
    pub max_force: f32,
    /// Largest integral term, m.
    pub integral_limit: f32,
    /// Largest derivative term, m, after the filter.
    pub derivative_limit: f32,
    /// Time constant of the derivative's filter, s; 0 is none.
    ///
    /// A set point that moves 50 times a second is seen at 1 kHz as one slope of 20 times the height every 20th tick,
    /// and the limit would cut all but a fraction of it off. A filter of 10 ms, the original's physics step, spreads
    /// it below the limit and leaves its area, which is what moves the weight, as it is.
    pub derivative_time: f32,
}

impl ServoSettings {
    /// The same with no limit or time below 0 or without a number, as which it counts as 0.
    fn sound(self) -> Self {
        ServoSettings {
            max_force: self.max_force.at_least(0.0),
            integral_limit: self.integral_limit.at_least(0.0),
            derivative_limit: self.derivative_limit.at_least(0.0),
            derivative_time: self.derivative_time.at_least(0.0),
            ..self
        }
    }

    /// The settings that the table of parameters holds, with the original's limits of 0.5 m and 0.9 m on the terms and
    /// a filter of 10 ms.
    pub fn from_parameters(get: impl Fn(Id) -> f32) -> Self {
        ServoSettings {
            kp: get(Id::Kp),
            ki: get(Id::Ki),
            kd: get(Id::Kd),
            derivative_on_measurement: get(Id::DerivativeOnMeasurement) > 0.5,
            max_force: get(Id::MaxForce),
            integral_limit: 0.5,
            derivative_limit: 0.9,
            derivative_time: 0.01,
        }
    }
}

/// What one axis and its motor are, as far as the servo must know.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// Position of one encoder count, m.
    pub metres_per_count: f32,
    /// The weight moves within ± this, m, from the middle; set points beyond are cut off, and no force pushes outwards
    /// from there on.
    pub travel: f32,
    /// How far past `travel` the stops can give, m; an encoder that reads more is wrong.
    pub stop_play: f32,
    /// Faster than any weight can be, m/s; an encoder that jumps further in a tick is wrong.
    pub fastest: f32,
    /// Force at full duty and standstill, N; positive.
    pub stall_force: f32,
    /// Speed at full duty without load, m/s; positive.
    pub free_speed: f32,
    /// Which part of the motor's back-EMF is made up for, 0…1; 1 makes force independent of speed if the model is
    /// exact, and anything above 1 runs away.
    pub back_emf: f32,
    /// Largest duty, 0…1.
    pub duty_limit: f32,
    /// When the axis counts as stalled.
    pub stall: Stall,
}

/// Driven at least this hard, for more ticks than this, without moving this far: stalled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stall {
    /// Magnitude of the duty; above what holds a weight against gravity, or rest would be a stall.
    pub duty: f32,
    /// Distance, m, from where the weight was when it began to be driven or last moved this far.
    pub movement: f32,
    /// Servo ticks.
    pub ticks: u32,
}

impl Axis {
    /// The same with no limit below 0 or without a number.
    fn sound(self) -> Self {
        Axis { travel: self.travel.at_least(0.0), duty_limit: self.duty_limit.at_least(0.0).clamp_to(0.0, 1.0), ..self }
    }

    /// Position, m, of an encoder count.
    pub fn position(&self, count: i32) -> f32 {
        count as f32 * self.metres_per_count
    }
}

/// Where the weight belongs, m, for a motor value: `−range · y`, with y cut off at ±1.
///
/// The sign is the chapter's: y > 0 drives the weight towards the negative end of its axis, so that C = I puts the
/// weights down. A y that is not a number stays one, for [`Servo::update`] to refuse.
pub fn setpoint(y: f32, range: f32) -> f32 {
    -range * y.clamp_to(-1.0, 1.0)
}

/// What the servo wants of its motor in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// Force on the weight towards the positive end of the axis, N, −maxForce…maxForce.
    pub force: f32,
    /// Duty of the H-bridge for it, −duty_limit…duty_limit.
    pub duty: f32,
    /// Whether a limit held the force or the duty back.
    pub limited: bool,
}

/// Why there is no [`Drive`] in this tick: the output is zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ServoError {
    /// Set point or time step NaN, infinite or out of range, or a setting that makes the force so.
    NotFinite,
    /// The position is beyond the stops, or jumped, or is not a number.
    ImpossiblePosition,
    /// Driven hard, but not moving; see [`Stall`].
    Stalled,
}

impl From<ServoError> for FaultCode {
    fn from(error: ServoError) -> FaultCode {
        match error {
            ServoError::NotFinite => FaultCode::NonFinite,
            ServoError::ImpossiblePosition => FaultCode::ImpossibleSensor,
            ServoError::Stalled => FaultCode::StalledAxis,
        }
    }
}

/// The servo of one axis.
#[derive(Clone, Debug)]
pub struct Servo {
    settings: ServoSettings,
    axis: Axis,
    state: State,
}

/// What the servo remembers from tick to tick.
#[derive(Clone, Copy, Debug, Default)]
struct State {
    /// Position and error of the last tick; none right after a reset, so that nothing has a slope yet.
    last: Option<Last>,
    /// Integral term, m.
    integral: f32,
    /// Filtered slope that the derivative term uses, m/s.
    slope: f32,
    /// Filtered velocity, m/s.
    velocity: f32,
    /// Where the weight last moved or was not driven hard, m.
    anchor: f32,
    /// Ticks of being driven hard at the anchor.
    stalled: u32,
}

#[derive(Clone, Copy, Debug)]
struct Last {
    position: f32,
    error: f32,
}

impl Servo {
    /// A servo at rest.
    pub fn new(settings: ServoSettings, axis: Axis) -> Self {
        Servo { settings: settings.sound(), axis: axis.sound(), state: State::default() }
    }

    /// Forgets the past: no integral, no slope, no stall. The next tick's force is KP e and no more, whatever the set
    /// point and the position did meanwhile. To be called in every tick in which the outputs are zero, since an axis
    /// that is not driven neither follows nor stalls.
    pub fn reset(&mut self) {
        self.state = State::default();
    }

    /// Takes new settings without a bump: what the integral term holds in newtons it goes on holding.
    pub fn retune(&mut self, settings: ServoSettings) {
        let settings = settings.sound();
        let kept = self.state.integral * self.settings.kp / settings.kp;
        self.state.integral = if kept.is_finite() { limited(kept, settings.integral_limit) } else { 0.0 };
        if settings.derivative_on_measurement != self.settings.derivative_on_measurement {
            // The two slopes agree while the set point rests, and the weight's own is what both go on from.
            self.state.slope = -self.state.velocity;
        }
        self.settings = settings;
    }

    /// The settings in use; limits that are below 0 or no numbers are 0 in them.
    pub fn settings(&self) -> &ServoSettings {
        &self.settings
    }

    /// The axis this servo drives.
    pub fn axis(&self) -> &Axis {
        &self.axis
    }

    /// Filtered velocity of the weight, m/s.
    pub fn velocity(&self) -> f32 {
        self.state.velocity
    }

    /// One tick: `setpoint` and `position` in m, `dt` in s since the tick before, at most [`LONGEST_STEP`].
    ///
    /// On an error the servo remembers what it did before; a stall stays one until [`Servo::reset`] or until the weight
    /// moves.
    pub fn update(&mut self, setpoint: f32, position: f32, dt: f32) -> Result<Drive, ServoError> {
        let (settings, axis) = (&self.settings, &self.axis);
        if !(setpoint.is_finite() && dt > 0.0 && dt <= LONGEST_STEP) {
            return Err(ServoError::NotFinite);
        }
        // Written so that a position that is not a number fails the comparison.
        let possible = position.abs() <= axis.travel + axis.stop_play;
        let followed = self.state.last.is_none_or(|last| (position - last.position).abs() <= axis.fastest * dt);
        if !(possible && followed) {
            return Err(ServoError::ImpossiblePosition);
        }

        let mut state = self.state;
        let error = limited(setpoint, axis.travel) - position;
        let last = state.last.unwrap_or(Last { position, error });
        let velocity = (position - last.position) / dt;
        let slope = if settings.derivative_on_measurement { -velocity } else { (error - last.error) / dt };
        let share = dt / (settings.derivative_time + dt);
        state.slope += (slope - state.slope) * share;
        state.velocity += (velocity - state.velocity) * share;
        state.last = Some(Last { position, error });

        let derivative = limited(settings.kd * state.slope, settings.derivative_limit);
        let back_emf = axis.back_emf * state.velocity / axis.free_speed;
        let output = |integral: f32| {
            let wanted = settings.kp * (error + integral + derivative);
            let force = limited(wanted, settings.max_force);
            let wanted_duty = force / axis.stall_force + back_emf;
            let duty = limited(wanted_duty, axis.duty_limit);
            let drive = Drive { force, duty, limited: wanted != force || wanted_duty != duty };
            // A limit would make a number of what is infinite, so what was wanted is looked at.
            if are_finite([wanted, wanted_duty]) { Ok((wanted, drive)) } else { Err(ServoError::NotFinite) }
        };
        let held = state.integral;
        state.integral = limited(held + settings.ki * error * dt, settings.integral_limit);
        let (wanted, mut drive) = output(state.integral)?;
        if drive.limited && wanted * error > 0.0 {
            state.integral = held;
            (_, drive) = output(held)?;
        }
        if position.abs() >= axis.travel && drive.force * position > 0.0 {
            drive = Drive { force: 0.0, duty: 0.0, limited: true };
        }

        let stall = &axis.stall;
        if state.stalled == 0 || drive.duty.abs() < stall.duty || (position - state.anchor).abs() >= stall.movement {
            state.anchor = position;
            state.stalled = 0;
        }
        if drive.duty.abs() >= stall.duty {
            state.stalled = state.stalled.saturating_add(1);
        }
        self.state = state;
        if state.stalled > stall.ticks { Err(ServoError::Stalled) } else { Ok(drive) }
    }
}

/// `value` within ±`limit`; a value that is not a number stays one.
fn limited(value: f32, limit: f32) -> f32 {
    value.clamp_to(-limit, limit)
}
