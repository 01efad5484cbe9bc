//! The barrel as physics sees it: a rigid cylinder in three dimensions with two sliding weights, on flat ground.
//!
//! World axes: Z up, ground at z = 0. At heading 0 the cylinder axis points along +Y and the barrel rolls towards +X for a
//! positive roll φ: e1 = (cos φ, 0, −sin φ), e2 = (sin φ, 0, cos φ), X = R φ. The inclinations that sensors see are the world-z
//! components of the slider axes, lying (−sin φ, cos φ).
//!
//! One set of equations (`dynamics.rs`) moves it. Where both rims stick to the ground and the axis is level, their
//! projection on the one freedom left is integrated (`rolling.rs`, fast); a level barrel with nothing to tip it hops and
//! slips in its plane (`plane.rs`); everything else has all freedoms and compliant rims (`free.rs`, `contact.rs`).
//! [`Plant::advance`] passes between them by itself.

mod body;
mod command;
mod contact;
mod drive;
mod dynamics;
mod free;
mod observe;
mod plane;
mod rolling;

pub use body::{Body, BodyError};
pub use drive::{Drive, Motor, Servo};

use contact::{Grip, Ground, SUBSTEP};
use drive::{Axis, Setpoint, Sliders, clip};
use dynamics::Inertia;
use free::{Free, Laws, rotation};
use nalgebra::{Quaternion, Vector3};
use plane::Loose;
use rolling::{Given, Line, Push, Reaction, Roll};

/// Rates are kept below these, rad/s and m/s: a barrel pushed without end does not leave what the steps can follow.
const SPIN_LIMIT: f64 = 150.0;
const SPEED_LIMIT: f64 = 100.0;
/// Pushes are limited to this, N and N·m.
const LOAD_LIMIT: f64 = 1000.0;
/// Rolling on the line is resumed after this time of calm, s.
const CALM: f64 = 0.05;
/// What calm is: slope of the axis, and speeds of both rims other than by rolling, of √(g R).
const LEVEL: f64 = 2e-3;
const STILL: f64 = 3e-3;
/// A body that cannot tip needs no more than this many times that speed up or down.
const BOUNCE: f64 = 10.0;
/// While rolling: longest step near an end stop or at high speed, s, and what high speed is, rad/s.
const SHORT_STEP: f64 = 1e-3;
const FAST: f64 = 20.0;
/// Longest step off the line in its plane, s, and how many landings and catches one step may see.
const LOOSE_STEP: f64 = 2.5e-3;
const EVENTS: u32 = 50;

/// How a barrel starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// On its side, rolling without slip, heading 0.
    Lying {
        /// Roll, rad.
        phi: f64,
        /// Its rate, rad/s.
        omega: f64,
    },
    /// On its face at rest, the cylinder axis up.
    Upright,
    /// Anywhere.
    Free {
        /// Of the middle, m.
        position: [f64; 3],
        /// Quaternion (w, x, y, z) from body to world axes; it need not be of unit length.
        orientation: [f64; 4],
        /// Of the middle, world axes, m/s.
        velocity: [f64; 3],
        /// World axes, rad/s.
        angular_velocity: [f64; 3],
    },
}

/// Pushes from outside, held until changed. Each component is limited to ±1000.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load {
    /// About the cylinder axis, N·m.
    pub axis_torque: f64,
    /// On the middle of the cylinder, world axes, N.
    pub force_world: [f64; 3],
    /// World axes, N·m.
    pub torque_world: [f64; 3],
}

/// Which equations move the barrel at present.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Regime {
    /// Both rims stick to the ground and the axis is level.
    Rolling,
    /// The axis is level and stays so while the barrel hops or slips across it.
    Plane,
    /// Anything else.
    Free,
}

/// A barrel in motion. Cloning it takes a snapshot.
#[derive(Clone, Debug)]
pub struct Plant {
    body: Body,
    inertia: Inertia,
    axis: Axis,
    ground: Ground,
    line: Line,
    motion: Motion,
    told: Setpoint,
    /// Time left for which the set-point's rate counts, s.
    rate_left: f64,
    load: Load,
    calm: f64,
    always_free: bool,
    drive_on: bool,
    deepest: f64,
}

#[derive(Clone, Debug)]
enum Motion {
    Rolling(OnLine),
    Free(Free),
}

/// Rolling, and where.
#[derive(Clone, Copy, Debug)]
struct OnLine {
    /// Roll; and height and slip, all 0 while on the line.
    loose: Loose,
    /// Roll less φ, rad: what tumbling has added.
    offset: f64,
    /// Cosine and sine of the heading.
    heading: [f64; 2],
    /// Where the middle was when its roll was `origin_angle`, m.
    origin: Vector3<f64>,
    origin_angle: f64,
    /// Energy that the ground keeps, J.
    stored: f64,
}

impl Plant {
    /// A barrel at rest or in the motion that `start` says, weights in the middle.
    ///
    /// # Errors
    /// What [`Body::validate`] finds, or a start that is not finite.
    pub fn new(body: Body, start: Start) -> Result<Self, BodyError> {
        body.validate()?;
        let axis = Axis::new(&body.drive, body.weight_mass, body.stop);
        let inertia = Inertia::new(&body, &axis);
        let ground = Ground::new(&body, &inertia);
        let line = Line::of(&body);
        let motion = match start {
            Start::Lying { phi, omega } => {
                finite("phi0", &[phi])?;
                finite("omega0", &[omega])?;
                Motion::Rolling(OnLine {
                    loose: loose(Roll { angle: phi, omega: clip(omega, SPIN_LIMIT), sliders: Sliders::default() }),
                    offset: 0.0,
                    heading: [1.0, 0.0],
                    origin: Vector3::new(0.0, 0.0, body.radius),
                    origin_angle: phi,
                    stored: 0.0,
                })
            }
            Start::Upright => {
                let depth = ground.sinking(inertia.total() * inertia.gravity, 0.0);
                let half = core::f64::consts::FRAC_1_SQRT_2;
                Motion::Free(Free {
                    position: Vector3::new(0.0, 0.0, 0.5 * body.length - depth),
                    orientation: Quaternion::new(half, half, 0.0, 0.0),
                    ..Free::still()
                })
            }
            Start::Free { position, orientation, velocity, angular_velocity } => {
                finite("position", &position)?;
                finite("orientation", &orientation)?;
                finite("velocity", &velocity)?;
                finite("angular velocity", &angular_velocity)?;
                let [w, x, y, z] = orientation;
                let q = Quaternion::new(w, x, y, z);
                let size = q.norm();
                if !(1e-6..=1e6).contains(&size) {
                    return Err(BodyError::OutOfRange { field: "orientation", value: size, low: 1e-6, high: 1e6 });
                }
                let q = q / size;
                Motion::Free(Free {
                    position: position.into(),
                    orientation: q,
                    velocity: velocity.into(),
                    angular: rotation(&q).tr_mul(&Vector3::from(angular_velocity)),
                    ..Free::still()
                })
            }
        };
        Ok(Self {
            body,
            inertia,
            axis,
            ground,
            line,
            motion,
            told: Setpoint::default(),
            rate_left: 0.0,
            load: Load::default(),
            calm: 0.0,
            always_free: false,
            drive_on: true,
            deepest: 0.0,
        })
    }

    /// Lets `dt` seconds pass in whole steps, at least one, as near to the body's step as divides `dt`.
    pub fn advance(&mut self, dt: f64) {
        if !(dt > 0.0 && dt.is_finite()) {
            return;
        }
        let steps = libm::round(dt / self.body.step).max(1.0);
        let h = dt / steps;
        for _ in 0..steps as u64 {
            self.step(h);
        }
    }

    fn step(&mut self, h: f64) {
        let mut told = self.told;
        if self.rate_left > 0.0 {
            let part = (self.rate_left / h).min(1.0);
            told.rate = told.rate.map(|r| r * part);
            self.rate_left -= h;
            if self.rate_left < 1e-9 {
                self.rate_left = 0.0;
                self.told.rate = [0.0; 2];
            }
        }
        let left = match self.motion {
            Motion::Rolling(line) => self.roll(line, &told, h),
            Motion::Free(_) => h,
        };
        if left > 0.0 {
            self.fly(&told, left);
        }
    }

    /// Rolls, hops or slips in the plane for `h` seconds; what is left of them if the barrel leaves it.
    #[inline]
    fn roll(&mut self, mut at: OnLine, told: &Setpoint, h: f64) -> f64 {
        let push = self.push(&at);
        let Sliders { s, v, .. } = at.loose.roll.sliders;
        let g = self.body.gravity;
        let delicate = at.loose.roll.omega.abs() > FAST
            || self.axis.near_stop(s[0], v[0], h, g)
            || self.axis.near_stop(s[1], v[1], h, g);
        let longest = if delicate { SHORT_STEP } else { h }.min(self.axis.longest_step);
        let planar = self.tips_by_nothing(&push);
        let mut left = h;
        // Landings and catches cut a step into more pieces than its length asks for.
        let pieces = EVENTS + if longest < h { libm::ceil(h / longest) as u32 } else { 1 };
        for _ in 0..pieces {
            if left < 1e-9 {
                self.motion = Motion::Rolling(at);
                return 0.0;
            }
            let evenly = |longest: f64| if left <= longest { left } else { left / libm::ceil(left / longest - 1e-9) };
            let mut taken = evenly(longest);
            let held =
                if at.loose.on_line() { self.line.step(&self.given(told, &push, taken), &at.loose.roll) } else { None };
            if let Some(roll) = held {
                at.loose.roll = roll;
            } else if planar {
                let dt = evenly(longest.min(LOOSE_STEP));
                (at.loose, taken) = self.line.loose_step(&self.given(told, &push, dt), &at.loose);
                at.loose.slip = clip(at.loose.slip, SPEED_LIMIT);
                at.loose.climb = clip(at.loose.climb, SPEED_LIMIT);
            } else {
                break;
            }
            let roll = &mut at.loose.roll;
            roll.omega = clip(roll.omega, SPIN_LIMIT);
            roll.sliders.v = roll.sliders.v.map(|v| clip(v, SPEED_LIMIT));
            left -= taken;
        }
        if left > 1e-9 {
            self.leave_line(&at, left);
            return left;
        }
        self.motion = Motion::Rolling(at);
        0.0
    }

    /// Moves with all freedoms for `h` seconds.
    fn fly(&mut self, told: &Setpoint, h: f64) {
        let Motion::Free(mut at) = self.motion else { return };
        let parts = libm::ceil(h / SUBSTEP.min(self.axis.longest_step) - 1e-9).max(1.0);
        let laws = self.laws();
        let mut deepest = self.deepest;
        for _ in 0..parts as u32 {
            at = laws.step(&at, told, &self.load, h / parts);
            let axis = rotation(&at.orientation).column(1).into_owned();
            for rim in laws.rims(&at.position, &axis) {
                deepest = deepest.max(rim.depth + self.body.radius * rim.sin_tilt);
            }
        }
        self.deepest = deepest;
        self.motion = Motion::Free(at);
        self.calm = if self.is_calm(&at) { self.calm + h } else { 0.0 };
        if self.calm >= CALM && !self.always_free {
            self.enter_line(&at);
        }
    }

    /// Whether nothing but rolling on the line is going on.
    fn is_calm(&self, at: &Free) -> bool {
        let turned = rotation(&at.orientation);
        let axis = turned.column(1).into_owned();
        if axis.z.abs() > LEVEL {
            return false;
        }
        let still = STILL * (self.body.gravity * self.body.radius).sqrt();
        let arm = 0.5 * self.body.length;
        if at.velocity.dot(&axis).abs() > still || at.angular.x.abs() * arm > still || at.angular.z.abs() * arm > still
        {
            return false;
        }
        let (.., touch) = self.laws().rate(at, &self.told, &self.load);
        let grounded = touch.iter().all(Option::is_some);
        // In the plane slip may go on, and a bounce that is nearly over may end.
        if self.tips_by_nothing(&self.push_along([axis.y, -axis.x])) {
            return grounded && at.velocity.z.abs() < BOUNCE * still;
        }
        at.velocity.z.abs() < still
            && (0..2).all(|i| touch[i].is_some_and(|t| t.speed < still && self.ground.holds(&at.grip[i], &t)))
    }

    /// From all freedoms to the line, energy not growing.
    fn enter_line(&mut self, at: &Free) {
        let before = self.energy();
        let turned = rotation(&at.orientation);
        let axis = turned.column(1);
        let size = (axis.x * axis.x + axis.y * axis.y).sqrt();
        let heading = [axis.y / size, -axis.x / size];
        let e1 = turned.column(0);
        let angle = libm::atan2(-e1.z, e1.x * heading[0] + e1.y * heading[1]);
        let stored = self.ground_energy(at);
        let mut line = OnLine {
            loose: loose(Roll { angle, omega: at.angular.y, sliders: at.sliders }),
            offset: angle - at.phi,
            heading,
            origin: at.position,
            origin_angle: angle,
            stored,
        };
        let push = self.push(&line);
        let begin = libm::sincos(angle);
        let given = self.given(&self.told, &push, self.body.step);
        let now = self.line.instant(&given, &line.loose.roll, begin);
        let slip = at.velocity.x * heading[0] + at.velocity.y * heading[1] - self.body.radius * at.angular.y;
        let still = STILL * (self.body.gravity * self.body.radius).sqrt();
        if slip.abs() > still {
            line.loose.slip = slip;
        } else if !self.line.holds(&self.line.reaction(&given, &line.loose.roll, &now)) && !self.tips_by_nothing(&push)
        {
            self.calm = 0.0;
            return;
        }
        self.motion = Motion::Rolling(line);
        let excess = self.energy() - before;
        if excess > 0.0
            && let Motion::Rolling(line) = &mut self.motion
        {
            line.origin.z -= excess / (self.inertia.total() * self.inertia.gravity);
        }
    }

    /// From the line to all freedoms: rims sunk and friction's springs bent as far as the present forces ask.
    fn leave_line(&mut self, line: &OnLine, dt: f64) {
        let push = self.push(line);
        let begin = libm::sincos(line.loose.roll.angle);
        let given = self.given(&self.told, &push, dt);
        let now = self.line.instant(&given, &line.loose.roll, begin);
        let mut force = self.line.reaction(&given, &line.loose.roll, &now);
        if line.loose.lift > 0.0 {
            force = Reaction::default();
        }
        let ahead = Vector3::new(line.heading[0], line.heading[1], 0.0);
        let aside = Vector3::new(-line.heading[1], line.heading[0], 0.0);
        let sunk = force.normal.map(|n| self.ground.sinking(n, 1.0));
        let slope = (sunk[0] - sunk[1]) / self.body.length;
        let grip = [0, 1].map(|i| {
            let pull = ahead * force.ahead[i] + aside * force.aside[i];
            let limit = self.body.mu * force.normal[i].max(0.0);
            let size = pull.norm();
            let cut = if size > limit { limit / size } else { 1.0 };
            Grip { slip: [-cut * pull.x / self.ground.grip, -cut * pull.y / self.ground.grip], pivot: 0.0 }
        });
        let mut position = self.line_position(line);
        position.z = self.body.radius + line.loose.lift - 0.5 * (sunk[0] + sunk[1]);
        let heading = libm::atan2(line.heading[1], line.heading[0]);
        self.motion = Motion::Free(Free {
            position,
            orientation: about(ahead, slope)
                * about(Vector3::z(), heading)
                * about(Vector3::y(), line.loose.roll.angle),
            velocity: self.line_velocity(line),
            angular: Vector3::new(0.0, line.loose.roll.omega, 0.0),
            sliders: line.loose.roll.sliders,
            phi: line.loose.roll.angle - line.offset,
            grip,
            turn: self.ground.turn_for(now.held),
        });
        self.calm = 0.0;
    }

    fn given<'a>(&'a self, told: &'a Setpoint, push: &'a Push, dt: f64) -> Given<'a> {
        Given { body: &self.inertia, axis: &self.axis, told, push, dt }
    }

    fn laws(&self) -> Laws<'_> {
        Laws {
            inertia: &self.inertia,
            axis: &self.axis,
            ground: &self.ground,
            reach: 0.5 * self.body.length,
            friction: self.body.friction,
        }
    }

    /// Whether a level barrel stays level off the line: its slider axes cross in one point and nothing pushes across.
    fn tips_by_nothing(&self, push: &Push) -> bool {
        self.body.axes_shift == 0.0 && push.pitch == 0.0 && push.yaw == 0.0 && push.aside == 0.0
    }

    /// Pushes as rolling on the line feels them.
    fn push(&self, line: &OnLine) -> Push {
        self.push_along(line.heading)
    }

    fn push_along(&self, [c, s]: [f64; 2]) -> Push {
        let [fx, fy, fz] = self.load.force_world;
        let [tx, ty, tz] = self.load.torque_world;
        Push {
            roll: self.load.axis_torque + c * ty - s * tx,
            pitch: c * tx + s * ty,
            yaw: tz,
            ahead: c * fx + s * fy,
            aside: c * fy - s * fx,
            up: fz,
        }
    }

    fn sliders(&self) -> &Sliders {
        match &self.motion {
            Motion::Rolling(line) => &line.loose.roll.sliders,
            Motion::Free(free) => &free.sliders,
        }
    }

    fn sliders_mut(&mut self) -> &mut Sliders {
        match &mut self.motion {
            Motion::Rolling(line) => &mut line.loose.roll.sliders,
            Motion::Free(free) => &mut free.sliders,
        }
    }

    fn line_position(&self, line: &OnLine) -> Vector3<f64> {
        let far = self.body.radius * (line.loose.roll.angle - line.origin_angle) + line.loose.skid;
        line.origin + Vector3::new(far * line.heading[0], far * line.heading[1], line.loose.lift)
    }

    fn line_velocity(&self, line: &OnLine) -> Vector3<f64> {
        let speed = self.body.radius * line.loose.roll.omega + line.loose.slip;
        Vector3::new(speed * line.heading[0], speed * line.heading[1], line.loose.climb)
    }

    /// Energy that the ground's and friction's springs hold, J.
    fn ground_energy(&self, at: &Free) -> f64 {
        let axis = rotation(&at.orientation).column(1).into_owned();
        let rims = self.laws().rims(&at.position, &axis);
        let mut sum = self.ground.turn_energy(at.turn);
        for (rim, grip) in rims.iter().zip(&at.grip) {
            sum += self.ground.pressure(rim.depth, rim.sin_tilt).energy;
            sum += self.ground.grip_energy(grip, self.ground.spread(rim.depth, rim.sin_tilt));
        }
        sum
    }
}

impl Free {
    fn still() -> Self {
        Self {
            position: Vector3::zeros(),
            orientation: Quaternion::new(1.0, 0.0, 0.0, 0.0),
            velocity: Vector3::zeros(),
            angular: Vector3::zeros(),
            sliders: Sliders::default(),
            phi: 0.0,
            grip: [Grip::default(); 2],
            turn: 0.0,
        }
    }
}

/// A roll on the line.
fn loose(roll: Roll) -> Loose {
    Loose { roll, lift: 0.0, climb: 0.0, slip: 0.0, skid: 0.0 }
}

/// Rotation about a unit vector.
fn about(axis: Vector3<f64>, angle: f64) -> Quaternion<f64> {
    let (sin, cos) = libm::sincos(0.5 * angle);
    Quaternion::new(cos, sin * axis.x, sin * axis.y, sin * axis.z)
}

fn finite(field: &'static str, values: &[f64]) -> Result<(), BodyError> {
    match values.iter().find(|v| !v.is_finite()) {
        Some(&value) => Err(BodyError::NotFinite { field, value }),
        None => Ok(()),
    }
}
