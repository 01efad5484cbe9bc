//! Every motion that is not rolling on the line: tilted, upright, slipping, hopping, in the air. Six freedoms and two
//! sliders, compliant rims, RK4 at a substep of half a millisecond.

use super::contact::{Grip, Ground, Rim, Touch};
use super::drive::{Axis, Setpoint, Sliders};
use super::dynamics::{Acceleration, Inertia, Loaded};
use super::{Load, SPEED_LIMIT, SPIN_LIMIT};
use nalgebra::{Matrix3, Quaternion, Vector3};

/// What moves, and also its rate of change.
#[derive(Clone, Copy, Debug)]
pub(super) struct Free {
    /// Of the middle, world axes, m.
    pub position: Vector3<f64>,
    /// From body to world axes.
    pub orientation: Quaternion<f64>,
    /// Of the middle, world axes, m/s.
    pub velocity: Vector3<f64>,
    /// Body axes, rad/s.
    pub angular: Vector3<f64>,
    pub sliders: Sliders,
    /// Integral of the angular velocity about the cylinder axis, rad.
    pub phi: f64,
    /// Friction's springs of the rims at −L/2 and +L/2.
    pub grip: [Grip; 2],
    /// Elastic turn of rolling resistance, rad.
    pub turn: f64,
}

/// The laws that move it.
pub(super) struct Laws<'a> {
    pub inertia: &'a Inertia,
    pub axis: &'a Axis,
    pub ground: &'a Ground,
    /// Half the length, m.
    pub reach: f64,
    pub friction: f64,
}

/// Rotation matrix of a quaternion that need not be of unit length.
pub(super) fn rotation(q: &Quaternion<f64>) -> Matrix3<f64> {
    let s = 2.0 / q.norm_squared();
    let (w, x, y, z) = (q.w, q.i, q.j, q.k);
    Matrix3::new(
        1.0 - s * (y * y + z * z),
        s * (x * y - w * z),
        s * (x * z + w * y),
        s * (x * y + w * z),
        1.0 - s * (x * x + z * z),
        s * (y * z - w * x),
        s * (x * z - w * y),
        s * (y * z + w * x),
        1.0 - s * (x * x + y * y),
    )
}

impl Free {
    #[inline]
    fn plus(&self, k: &Self, h: f64) -> Self {
        let grip = |i: usize| {
            let (a, b) = (&self.grip[i], &k.grip[i]);
            Grip { slip: [a.slip[0] + h * b.slip[0], a.slip[1] + h * b.slip[1]], pivot: a.pivot + h * b.pivot }
        };
        Self {
            position: self.position + k.position * h,
            orientation: self.orientation + k.orientation * h,
            velocity: self.velocity + k.velocity * h,
            angular: self.angular + k.angular * h,
            sliders: self.sliders.plus(&k.sliders, h),
            phi: self.phi + h * k.phi,
            grip: [grip(0), grip(1)],
            turn: self.turn + h * k.turn,
        }
    }
}

impl Laws<'_> {
    /// The two rims of a barrel at `position` with its axis along `axis`, world axes.
    pub fn rims(&self, position: &Vector3<f64>, axis: &Vector3<f64>) -> [Rim; 2] {
        let sin_tilt = (axis.x * axis.x + axis.y * axis.y).sqrt();
        // Upright every direction is the lowest.
        let down = if sin_tilt > 1e-12 {
            let inverse = 1.0 / sin_tilt;
            Vector3::new(axis.z * axis.x * inverse, axis.z * axis.y * inverse, -sin_tilt)
        } else {
            Vector3::x()
        };
        [-self.reach, self.reach].map(|reach| {
            let centre = axis * reach;
            Rim { centre, down, sin_tilt, depth: -(position.z + centre.z) }
        })
    }

    /// Rate of change, the accelerations, and what the ground does.
    pub fn rate(&self, at: &Free, told: &Setpoint, load: &Load) -> (Free, Acceleration, [Option<Touch>; 2]) {
        let turned = rotation(&at.orientation);
        let axis = turned.column(1).into_owned();
        let angular = turned * at.angular;
        let rims = self.rims(&at.position, &axis);
        let touch = [0, 1].map(|i| self.ground.touch(&rims[i], at.velocity, angular, &at.grip[i]));

        let mut force = Vector3::from(load.force_world);
        let mut torque = Vector3::from(load.torque_world);
        let mut grip = [Grip::default(); 2];
        let mut grounded = false;
        for (rate, touch) in grip.iter_mut().zip(&touch) {
            if let Some(t) = touch {
                force += t.force;
                torque += t.torque;
                *rate = t.rate;
                grounded = true;
            }
        }
        let spin = at.angular.y;
        let mut roll = load.axis_torque - self.friction * spin;
        if grounded {
            roll += self.ground.turn_torque(at.turn, spin);
        }
        let Sliders { s, v, memory } = at.sliders;
        let (f1, i1) = self.axis.force(told.value[0], told.rate[0], s[0], v[0], memory[0]);
        let (f2, i2) = self.axis.force(told.value[1], told.rate[1], s[1], v[1], memory[1]);
        let mut torque = turned.tr_mul(&torque);
        torque.y += roll;
        let acceleration = self.inertia.accelerate(&Loaded {
            angular: at.angular,
            gravity: turned.row(2).transpose() * -self.inertia.gravity,
            force: turned.tr_mul(&force),
            torque,
            s,
            v,
            drive: [f1, f2],
        });
        let w = &at.angular;
        let rate = Free {
            position: at.velocity,
            orientation: at.orientation * Quaternion::new(0.0, 0.5 * w.x, 0.5 * w.y, 0.5 * w.z),
            velocity: turned * acceleration.linear,
            angular: acceleration.angular,
            sliders: Sliders {
                s: if self.inertia.weight > 0.0 { v } else { [0.0, 0.0] },
                v: acceleration.slide,
                memory: [i1, i2],
            },
            phi: spin,
            grip,
            turn: if grounded { spin } else { 0.0 },
        };
        (rate, acceleration, touch)
    }

    /// One step of RK4; friction's springs are brought back to what they can hold afterwards.
    pub fn step(&self, at: &Free, told: &Setpoint, load: &Load, h: f64) -> Free {
        let (k1, ..) = self.rate(at, told, load);
        let (k2, ..) = self.rate(&at.plus(&k1, 0.5 * h), told, load);
        let (k3, ..) = self.rate(&at.plus(&k2, 0.5 * h), told, load);
        let (k4, _, touch) = self.rate(&at.plus(&k3, h), told, load);
        let sum = k1.plus(&k2, 2.0).plus(&k3, 2.0).plus(&k4, 1.0);
        let mut next = at.plus(&sum, h / 6.0);

        next.orientation /= next.orientation.norm();
        for (i, touch) in touch.iter().enumerate() {
            next.grip[i] = self.ground.settle(next.grip[i], touch.as_ref());
            next.sliders.memory[i] = self.axis.settle(next.sliders.memory[i]);
            next.sliders.v[i] = next.sliders.v[i].clamp(-SPEED_LIMIT, SPEED_LIMIT);
        }
        next.turn = if touch.iter().any(Option::is_some) { self.ground.settle_turn(next.turn) } else { 0.0 };
        limit(&mut next.velocity, SPEED_LIMIT);
        limit(&mut next.angular, SPIN_LIMIT);
        next
    }
}

/// Shortens a vector to `most`.
fn limit(vector: &mut Vector3<f64>, most: f64) {
    let size = vector.norm();
    if size > most {
        *vector *= most / size;
    }
}
