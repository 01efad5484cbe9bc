//! What a barrel is made of: sizes, masses, friction, drive. Two are built in, `chapter` and `tabletop`;
//! every field is public and may be changed before a [`Plant`](super::Plant) is made of it.
//!
//! Body axes: X is the first slider axis, Z the second, Y the cylinder axis, origin in the middle of the cylinder.

use super::drive::{Drive, Motor, Servo};
use core::fmt;

/// A barrel: a solid cylinder with two weights sliding on axes perpendicular to its own and to each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Radius of the cylinder and of its two rims, m.
    pub radius: f64,
    /// Length of the cylinder from rim to rim, m.
    pub length: f64,
    /// Mass of everything but the two weights, kg. Its inertia is that of a solid cylinder.
    pub shell_mass: f64,
    /// Mass of one weight, kg. 0 makes a plain cylinder whose weights stay where they are put.
    pub weight_mass: f64,
    /// Radius of the sphere whose inertia a weight has about its own centre (it does not collide), m.
    pub weight_radius: f64,
    /// Largest commanded distance of a weight from the middle, m.
    pub range: f64,
    /// Distance of the end stops from the middle, m. Not below `range`.
    pub stop: f64,
    /// Distance between the two slider axes along the cylinder axis, m: the first lies at −shift/2, the second at +shift/2.
    pub axes_shift: f64,
    /// Viscous rolling friction: torque per angular velocity about the cylinder axis, N·m·s.
    pub friction: f64,
    /// Coulomb rolling friction about the cylinder axis while the ground is touched, N·m.
    pub rolling_resistance: f64,
    /// Coefficient of friction between rims and ground.
    pub mu: f64,
    /// Acceleration of gravity, m/s².
    pub gravity: f64,
    /// What moves the weights.
    pub drive: Drive,
    /// Integration step while rolling, s, at most 0.01. Other motion divides it further.
    pub step: f64,
    /// Where the inertial sensor sits, body axes, m.
    pub imu_position: [f64; 3],
    /// Resolution of the encoders of the slider axes, counts/m.
    pub counts_per_metre: f64,
}

impl Body {
    /// The barrel of the chapter: 1 m long and thick, 1 kg, two weights of 1 kg, axes through one point, moved by a force
    /// servo that is part of the body.
    ///
    /// Its weights are points, as in the reference traces. The original's are spheres of radius 1/14 m: set `weight_radius` for
    /// their own inertia, which shifts the roll by up to 0.03 rad within the 10 s of those traces.
    pub fn chapter() -> Self {
        Self {
            radius: 0.5,
            length: 1.0,
            shell_mass: 1.0,
            weight_mass: 1.0,
            weight_radius: 0.0,
            range: 0.3,
            stop: 0.39,
            axes_shift: 0.0,
            friction: 0.1,
            rolling_resistance: 0.0,
            mu: 0.64,
            gravity: 9.81,
            drive: Drive::Servo(Servo::chapter()),
            step: 0.010,
            imu_position: [0.0; 3],
            counts_per_metre: 0.0,
        }
    }

    /// A barrel for a table, to be built from parts on sale.
    ///
    /// - Tube: acrylic, 240 mm × 3 mm × 300 mm (0.8 kg) with two end discs, frame, two motors, battery (3S lithium-ion,
    ///   0.2 kg), NUCLEO-F429ZI and H-bridges: 2.2 kg. Rubber bands as tyres on the rims.
    /// - Weights: steel with a carriage on a rail, 0.35 kg, ±60 mm, end blocks at ±65 mm; the axes pass each other at 70 mm.
    /// - Drive: a 25 mm brushed gearmotor of 4.4:1 with a GT2 belt on a 16-tooth pulley (see [`Motor::tabletop`]).
    /// - Encoder on the motor shaft, 48 counts per turn: 48 · 4.4 / 32 mm = 6600 counts/m.
    /// - ICM-42688-P on the board, 55 mm from the cylinder axis, between an end disc and the second slider axis.
    pub fn tabletop() -> Self {
        Self {
            radius: 0.12,
            length: 0.30,
            shell_mass: 2.2,
            weight_mass: 0.35,
            weight_radius: 0.02,
            range: 0.060,
            stop: 0.065,
            axes_shift: 0.070,
            friction: 0.002,
            rolling_resistance: 0.010,
            mu: 0.8,
            gravity: 9.81,
            drive: Drive::Motor(Motor::tabletop()),
            step: 0.001,
            imu_position: [0.040, 0.105, -0.038],
            counts_per_metre: 6600.0,
        }
    }

    /// Checks that every figure is finite and within what the equations and the integration can carry.
    ///
    /// # Errors
    /// The first field found wrong, with its value and what is allowed.
    pub fn validate(&self) -> Result<(), BodyError> {
        let within = |field: &'static str, value: f64, low: f64, high: f64| {
            if !value.is_finite() {
                Err(BodyError::NotFinite { field, value })
            } else if value < low || value > high {
                Err(BodyError::OutOfRange { field, value, low, high })
            } else {
                Ok(())
            }
        };
        within("radius", self.radius, 0.01, 10.0)?;
        within("length", self.length, 0.01, 10.0)?;
        within("shellMass", self.shell_mass, 0.01, 1000.0)?;
        within("weightMass", self.weight_mass, 0.0, 100.0)?;
        if self.weight_mass > 0.0 {
            // A weight is moved by forces divided by its mass: below this the servo outruns every step.
            within("weightMass", self.weight_mass, 0.01 * self.shell_mass, 20.0 * self.shell_mass)?;
        }
        within("weightRadius", self.weight_radius, 0.0, self.radius)?;
        within("stop", self.stop, 0.0, 10.0)?;
        // It is the barrel that has no room for them.
        within("radius", self.radius, self.stop, 10.0)?;
        within("range", self.range, 1e-3, self.radius)?;
        within("stop", self.stop, self.range, self.radius)?;
        within("axesShift", self.axes_shift, 0.0, self.length)?;
        within("friction", self.friction, 0.0, 100.0)?;
        within("rollingResistance", self.rolling_resistance, 0.0, 100.0)?;
        within("mu", self.mu, 0.0, 10.0)?;
        within("gravity", self.gravity, 0.01, 100.0)?;
        within("step", self.step, 1e-6, 0.010)?;
        for (field, value) in ["imuPositionX", "imuPositionY", "imuPositionZ"].into_iter().zip(self.imu_position) {
            within(field, value, -10.0, 10.0)?;
        }
        within("countsPerMetre", self.counts_per_metre, 0.0, 1e9)?;
        match &self.drive {
            Drive::Servo(servo) => {
                within("KP", servo.kp, 0.0, 2000.0)?;
                within("KI", servo.ki, 0.0, 100.0)?;
                within("KD", servo.kd, 0.0, 1.0)?;
                within("maxForce", servo.max_force, 0.0, 10_000.0)
            }
            Drive::Motor(motor) => {
                within("nominalVoltage", motor.nominal_voltage, 0.1, 1000.0)?;
                within("supplyVoltage", motor.supply_voltage, 0.0, 1000.0)?;
                within("stallForce", motor.stall_force, 0.0, 10_000.0)?;
                within("noLoadSpeed", motor.no_load_speed, 1e-3, 100.0)?;
                within("rotorMass", motor.rotor_mass, 0.0, 100.0)?;
                within("slideViscous", motor.viscous, 0.0, 1000.0)?;
                within("slideCoulomb", motor.coulomb, 0.0, 1000.0)
            }
        }
    }
}

/// Why a [`Body`] cannot be simulated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BodyError {
    /// A field is NaN or infinite.
    NotFinite {
        /// The parameter's name.
        field: &'static str,
        /// What it was.
        value: f64,
    },
    /// A field lies outside of what can be simulated; give a value between `low` and `high`.
    OutOfRange {
        /// The parameter's name.
        field: &'static str,
        /// What it was.
        value: f64,
        /// The least allowed.
        low: f64,
        /// The most allowed.
        high: f64,
    },
}

impl fmt::Display for BodyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite { field, value } => write!(f, "{field} is {value}: give a finite number"),
            Self::OutOfRange { field, value, low, high } => {
                write!(f, "{field} is {value}: give a value between {low} and {high}")
            }
        }
    }
}

impl core::error::Error for BodyError {}
