//! What moves a weight along its axis: a command goes in, an axial force comes out, and the reaction acts on the shell.
//!
//! `chapter` carries the original's force servo. With the target s* = −range·clip(y, ±1) and e = s* − s,
//!
//! ```text
//! F = clip(KP (e + I + D), ±maxForce)     İ = KI e, |I| ≤ 0.5     D = clip(KD (ṡ* − ṡ), ±0.9)
//! ```
//!
//! The original evaluates it every 10 ms with a difference quotient of the error, so a new command kicks the weights with
//! KP·KD·(s*_new − s*_old), at most KP·0.9·10 ms, within the 10 ms that follow it. Here the same impulse is spread over the
//! 20 ms to the next command, ṡ* being its rate: the barrel rolls at the same speed (C = U(0.1) … U(0.9), within 0.5 %), but
//! without a 50 Hz sawtooth on ω that is always sampled at its peak, 4 % above the mean. With `derivative_on_measurement`
//! ṡ* is left out.
//! `tabletop` has brushed motors: F = stall·(duty·supply/nominal − ṡ/no-load speed) less the friction of the slide.

/// How the weights are driven.
#[derive(Clone, Debug, PartialEq)]
pub enum Drive {
    /// The original's force servo; commands are positions y in ±1.
    Servo(Servo),
    /// A brushed motor per axis; commands are duties in ±1.
    Motor(Motor),
}

/// Force servo of the original.
#[derive(Clone, Debug, PartialEq)]
pub struct Servo {
    /// Force per metre of error, N/m.
    pub kp: f64,
    /// Integral gain, 1/s.
    pub ki: f64,
    /// Derivative gain, s.
    pub kd: f64,
    /// Largest force, N.
    pub max_force: f64,
    /// Leaves the set-point's steps out of the derivative.
    pub derivative_on_measurement: bool,
}

impl Servo {
    /// The original's gains: 200 N/m, 0.5 /s, 0.1 s, 200 N, derivative on the error.
    pub fn chapter() -> Self {
        Self { kp: 200.0, ki: 0.5, kd: 0.1, max_force: 200.0, derivative_on_measurement: false }
    }
}

impl Servo {
    /// The part of a set-point step, m, that the derivative of the original sees before it saturates.
    pub(super) fn seen(&self, step: f64) -> f64 {
        if self.kd > 0.0 { clip(step, DERIVATIVE_LIMIT * ORIGINAL_PERIOD / self.kd) } else { step }
    }
}

/// Brushed DC motor with a linear transmission.
#[derive(Clone, Debug, PartialEq)]
pub struct Motor {
    /// Voltage that stall force and no-load speed are given for, V.
    pub nominal_voltage: f64,
    /// Voltage of the supply now, V.
    pub supply_voltage: f64,
    /// Force at standstill and nominal voltage, N.
    pub stall_force: f64,
    /// Speed without load at nominal voltage, m/s.
    pub no_load_speed: f64,
    /// Inertia of rotor and gear as seen at the weight, kg; it takes part in motion along the axis only.
    pub rotor_mass: f64,
    /// Viscous friction of the slide, N·s/m.
    pub viscous: f64,
    /// Coulomb friction of slide and gear, N; it holds a weight at rest without creep.
    pub coulomb: f64,
}

impl Motor {
    /// A Pololu 25D HP 12 V gearmotor of 4.4:1 (about 2300 /min without load, about 0.16 N·m at stall, scaled from the data
    /// of its 47:1 sister) on a 16-tooth GT2 pulley of 5.1 mm radius: 1.2 m/s, 30 N; a rotor of some 4·10⁻⁷ kg·m² (our
    /// estimate) seen through (4.4/5.1 mm)²: 0.3 kg.
    pub fn tabletop() -> Self {
        Self {
            nominal_voltage: 12.0,
            supply_voltage: 12.0,
            stall_force: 30.0,
            no_load_speed: 1.2,
            rotor_mass: 0.3,
            viscous: 1.0,
            coulomb: 1.0,
        }
    }
}

/// Saturation of the servo's integral and derivative, m.
const INTEGRAL_LIMIT: f64 = 0.5;
const DERIVATIVE_LIMIT: f64 = 0.9;
/// Period of the original's servo, s.
const ORIGINAL_PERIOD: f64 = 0.010;
/// How long a set-point step lasts in the derivative, s: to the next command.
pub(super) const SETPOINT_SPREAD: f64 = 0.020;
/// Elastic travel before a slide held by Coulomb friction gives way, m.
const PRESLIDING: f64 = 5e-5;
/// Damping time of the elastic travel, s, about a third of critical for a third of a kilogram at 1 N.
const PRESLIDING_DAMPING: f64 = 2e-3;
/// End stop: stiffness per mass moved, s⁻², and hysteresis, s/m (Hunt and Crossley), which has no jump at touch.
const STOP_STIFFNESS: f64 = 1e5;
const STOP_HYSTERESIS: f64 = 0.5;

/// The two sliders: where they are, how fast, and what the drive remembers of each (the servo's integral, m, or the
/// motor's elastic presliding, m). Also used as its own rate of change.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sliders {
    pub s: [f64; 2],
    pub v: [f64; 2],
    pub memory: [f64; 2],
}

impl Sliders {
    #[inline]
    pub fn plus(&self, rate: &Self, h: f64) -> Self {
        let add = |a: [f64; 2], b: [f64; 2]| [a[0] + h * b[0], a[1] + h * b[1]];
        Self { s: add(self.s, rate.s), v: add(self.v, rate.v), memory: add(self.memory, rate.memory) }
    }
}

/// What the drives are told for the coming step: targets (m) with their rates (m/s), or duties.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Setpoint {
    pub value: [f64; 2],
    pub rate: [f64; 2],
}

/// The drive and the end stops as one law of force per axis, constants worked out.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    law: Law,
    stop: f64,
    stop_stiffness: f64,
    /// Inertia that takes part only in motion along the axis, kg.
    pub rotor_mass: f64,
    /// Largest acceleration the drive can give, m/s².
    max_acceleration: f64,
    /// Longest step that follows the drive, s.
    pub longest_step: f64,
}

#[derive(Clone, Debug)]
enum Law {
    Servo { kp: f64, ki: f64, kd: f64, max_force: f64 },
    Motor { gain: f64, drag: f64, coulomb: f64 },
}

impl Axis {
    pub fn new(drive: &Drive, weight_mass: f64, stop: f64) -> Self {
        let (law, rotor_mass, force, spring, damper) = match drive {
            Drive::Servo(s) => {
                let law = Law::Servo { kp: s.kp, ki: s.ki, kd: s.kd, max_force: s.max_force };
                (law, 0.0, s.max_force, s.kp, s.kp * s.kd)
            }
            Drive::Motor(m) => {
                let gain = m.stall_force * m.supply_voltage / m.nominal_voltage;
                let drag = m.stall_force / m.no_load_speed + m.viscous;
                let spring = m.coulomb / PRESLIDING;
                let law = Law::Motor { gain, drag, coulomb: m.coulomb };
                (law, m.rotor_mass, gain, spring, drag + spring * PRESLIDING_DAMPING)
            }
        };
        let mass = weight_mass + rotor_mass;
        let moves = weight_mass > 0.0;
        let max_acceleration = if moves { force / mass } else { 0.0 };
        // The shell gives way, so that a weight is lighter to move than its mass: by half, say.
        let (fast, damped) = ((2.0 * spring / mass).sqrt(), 2.0 * damper / mass);
        let longest_step = if moves { (0.4 / fast).min(1.0 / damped).clamp(1e-5, 1.0) } else { 1.0 };
        Self { law, stop, stop_stiffness: STOP_STIFFNESS * mass, rotor_mass, max_acceleration, longest_step }
    }

    /// Force on the weight along its axis, N, and the rate of the drive's memory.
    #[inline(always)]
    pub fn force(&self, value: f64, rate: f64, s: f64, v: f64, memory: f64) -> (f64, f64) {
        let (drive, memory_rate) = match self.law {
            Law::Servo { kp, ki, kd, max_force } => {
                let e = value - s;
                let integral = clip(memory, INTEGRAL_LIMIT);
                let derivative = clip(kd * (rate - v), DERIVATIVE_LIMIT);
                (clip(kp * (e + integral + derivative), max_force), ki * e)
            }
            Law::Motor { gain, drag, coulomb } => {
                let held = coulomb / PRESLIDING * (memory + PRESLIDING_DAMPING * v);
                (gain * value - drag * v - clip(held, coulomb), v)
            }
        };
        (drive + self.stop_force(s, v), memory_rate)
    }

    #[inline(always)]
    fn stop_force(&self, s: f64, v: f64) -> f64 {
        let beyond = s.abs() - self.stop;
        if beyond <= 0.0 {
            return 0.0;
        }
        let outward = if s > 0.0 { v } else { -v };
        let push = self.stop_stiffness * beyond * (1.0 + STOP_HYSTERESIS * outward).max(0.0);
        if s > 0.0 { -push } else { push }
    }

    /// Memory brought back into its limits after a step.
    #[inline(always)]
    pub fn settle(&self, memory: f64) -> f64 {
        match self.law {
            Law::Servo { .. } => clip(memory, INTEGRAL_LIMIT),
            Law::Motor { .. } => clip(memory, PRESLIDING),
        }
    }

    /// Energy held in end stop and presliding, J. The servo's spring is an input and not counted.
    pub fn energy(&self, s: f64, memory: f64) -> f64 {
        let beyond = (s.abs() - self.stop).max(0.0);
        let stop = 0.5 * self.stop_stiffness * beyond * beyond;
        match self.law {
            Law::Servo { .. } => stop,
            Law::Motor { coulomb, .. } => stop + 0.5 * coulomb / PRESLIDING * memory * memory,
        }
    }

    /// Whether a weight may meet its end stop within the next `h` seconds.
    #[inline(always)]
    pub fn near_stop(&self, s: f64, v: f64, h: f64, gravity: f64) -> bool {
        let outward = if s > 0.0 { v } else { -v };
        s.abs() + outward.max(0.0) * h + (0.5 * self.max_acceleration + 2.0 * gravity) * h * h >= self.stop
    }
}

/// `value` limited to ±`limit`, NaN to `limit`: two instructions, where `f64::clamp` and its care for NaN take more.
#[inline(always)]
pub(super) fn clip(value: f64, limit: f64) -> f64 {
    let below = if value < limit { value } else { limit };
    if below > -limit { below } else { -limit }
}
