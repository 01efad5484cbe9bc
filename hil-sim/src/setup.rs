//! What a run is made of: an experiment on a body, with parameters, a seed and pushes.

use crate::experiment::Experiment;
use crate::plant::{Body, Drive};
use crate::schedule::Event;
use core::fmt;
use protocol::parameter::{Scope, Sign, ValueError};
use protocol::{Id, Values};

/// Which barrel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BodyKind {
    /// The chapter's: 1 m, inclinations measured directly, a force servo of its own.
    Chapter,
    /// One that can be built: IMU, encoders, motors, and the robot's servo.
    Tabletop,
}

impl BodyKind {
    /// Both bodies.
    pub const ALL: [BodyKind; 2] = [BodyKind::Chapter, BodyKind::Tabletop];

    /// Name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            BodyKind::Chapter => "chapter",
            BodyKind::Tabletop => "tabletop",
        }
    }

    /// The body as it is built, before any parameter is changed.
    pub fn body(self) -> Body {
        match self {
            BodyKind::Chapter => Body::chapter(),
            BodyKind::Tabletop => Body::tabletop(),
        }
    }
}

/// A push from outside for a while.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// When it starts, s.
    pub start: f64,
    /// Its torque about the cylinder axis, N·m.
    pub torque: f64,
    /// Its force on the middle, N: along the ground and across the cylinder axis, to where a barrel with positive omega rolls.
    pub force: f64,
    /// How long it lasts, s.
    pub seconds: f64,
}

/// Everything that decides a run: the same setup gives the same bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct Setup {
    /// The experiment whose preset the values started from.
    pub experiment: &'static Experiment,
    /// The barrel.
    pub body: BodyKind,
    /// One value for every parameter.
    pub values: Values<f64>,
    /// Seed of all randomness.
    pub seed: u64,
    /// Pushes to come.
    pub pushes: Vec<Push>,
    /// What else is done to the barrel while it rolls.
    pub schedule: Vec<Event>,
}

/// Why a parameter was not set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SetError {
    /// The parameter.
    pub id: Id,
    /// The value that was not taken.
    pub value: f64,
    /// What is wrong with it.
    pub reason: ValueError,
}

impl fmt::Display for SetError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let p = self.id.parameter();
        let (min, max, name, value) = (p.min, p.max, p.name, self.value);
        match self.reason {
            ValueError::NotFinite => write!(f, "{name} = {value} is not a finite number; give one from {min} to {max}"),
            ValueError::OutOfRange => {
                let nearest = value.clamp(min, max);
                write!(f, "{name} = {value} is out of range {min} to {max}; the nearest is {nearest}")
            }
            ValueError::NotWhole => {
                write!(
                    f,
                    "{name} = {value} must be a whole number from {min} to {max}; the nearest is {}",
                    value.round()
                )
            }
        }
    }
}

impl std::error::Error for SetError {}

impl Setup {
    /// `experiment` with its preset on `body`.
    pub fn new(experiment: &'static Experiment, body: BodyKind) -> Self {
        let mut values = defaults(body);
        for &(id, value) in experiment.preset {
            // A preset speaks of the chapter's barrel: on another body, that body's own mechanics stand.
            if body == BodyKind::Chapter || id.parameter().scope != Scope::Servo {
                assign(&mut values, id, value);
            }
        }
        Setup { experiment, body, values, seed: 1, pushes: Vec::new(), schedule: Vec::new() }
    }

    /// Sets one parameter, and the entries of C that a coupling stands for.
    ///
    /// # Errors
    /// A value out of range, which leaves everything as it was.
    pub fn set(&mut self, id: Id, value: f64) -> Result<(), SetError> {
        id.parameter().check(value).map_err(|reason| SetError { id, value, reason })?;
        assign(&mut self.values, id, value);
        Ok(())
    }

    /// The plant's body with these parameters.
    ///
    /// On the tabletop `range` moves nothing but the set points: its end blocks are screwed on where homing looks for
    /// them. A range beyond its rail is taken, as the robot itself takes it, whose servo cuts off what lies beyond; were
    /// it refused here, parameters that a robot holds could not be simulated.
    pub fn plant_body(&self) -> Body {
        let mut body = self.body.body();
        let get = |id| self.values.get(id);
        let range = get(Id::Range);
        body.radius = get(Id::Radius);
        match self.body {
            // Its end blocks move with the range that they guard, and stay within the barrel.
            BodyKind::Chapter => {
                body.stop = (body.stop * (range / body.range)).max(range).min(body.radius);
                body.range = range;
            }
            BodyKind::Tabletop => body.range = range.min(body.range),
        }
        // Within the barrel is the weight, too.
        body.weight_radius = body.weight_radius.min(body.radius);
        body.length = get(Id::Length);
        body.shell_mass = get(Id::ShellMass);
        body.weight_mass = get(Id::WeightMass);
        body.axes_shift = get(Id::AxesShift);
        body.friction = get(Id::Friction);
        body.rolling_resistance = get(Id::RollingResistance);
        body.mu = get(Id::Mu);
        body.gravity = get(Id::Gravity);
        if let Drive::Servo(servo) = &mut body.drive {
            servo.kp = get(Id::Kp);
            servo.ki = get(Id::Ki);
            servo.kd = get(Id::Kd);
            servo.max_force = get(Id::MaxForce);
            servo.derivative_on_measurement = get(Id::DerivativeOnMeasurement) == 1.0;
        }
        body
    }
}

/// The table's defaults, with the mechanics of `kind`.
pub fn defaults(kind: BodyKind) -> Values<f64> {
    let mut values = Values::defaults(|v| v);
    let body = kind.body();
    for (id, value) in [
        (Id::Radius, body.radius),
        (Id::Length, body.length),
        (Id::ShellMass, body.shell_mass),
        (Id::WeightMass, body.weight_mass),
        (Id::Range, body.range),
        (Id::AxesShift, body.axes_shift),
        (Id::Friction, body.friction),
        (Id::RollingResistance, body.rolling_resistance),
        (Id::Mu, body.mu),
        (Id::Gravity, body.gravity),
    ] {
        values.set(id, value);
    }
    if kind == BodyKind::Tabletop {
        for (id, value) in firmware::axes::SERVO_PARAMETERS {
            values.set(id, value);
        }
    }
    values
}

/// Sets a parameter without a check, couplings included.
fn assign(values: &mut Values<f64>, id: Id, value: f64) {
    values.set(id, value);
    for (entry, sign) in id.coupled().into_iter().flatten() {
        values.set(entry, if sign == Sign::Same { value } else { -value });
    }
    values.set(Id::Coupling1, (values.get(Id::C11) + values.get(Id::C22)) / 2.0);
    values.set(Id::Coupling2, (values.get(Id::C12) - values.get(Id::C21)) / 2.0);
}
