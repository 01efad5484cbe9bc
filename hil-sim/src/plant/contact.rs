//! A circular rim on flat ground: the rim is a ring of springs, summed in closed form for every tilt.
//!
//! With α the angle between cylinder axis and vertical, B = R sin α, and d the depth of the rim's centre below ground
//! (negative while above), the rim's point at angle θ from its lowest is δ(θ) = d + B cos θ deep. Of the line stiffness k:
//!
//! ```text
//! F = ∫ k max(0, δ) R dθ       G = ∫ k max(0, δ) R² cos θ dθ       U = ∫ ½ k max(0, δ)² R dθ
//! ```
//!
//! over |θ| ≤ θ0 = acos(−d/B): one law for the line of a lying barrel, the point of a tilted one and the face of a standing
//! one, with true circles, and conservative (F = ∂U/∂d, G/R = ∂U/∂B). The pressure acts at the distance ρ = G/F from the
//! rim's centre towards its lowest point. Damping is that of the same springs and follows the rim's height alone, not its
//! material, so that rolling and precession cost nothing. Friction is a spring and a slider (Cundall and Strack 1979), one
//! per rim, and a second one for pivoting, which only a face that stands flat has.

use super::body::Body;
use super::dynamics::Inertia;
use nalgebra::Vector3;

/// Substep that stiffness and damping are tuned for, s.
pub(super) const SUBSTEP: f64 = 0.5e-3;
/// Highest natural frequency the ring may have (rocking while upright), per substep: RK4 is stable to 2.8.
const NORMAL_PHASE: f64 = 1.2;
/// Damping ratio of that motion.
const NORMAL_DAMPING: f64 = 0.4;
/// The same for sticking friction, one rim.
const GRIP_PHASE: f64 = 0.4;
const GRIP_DAMPING: f64 = 0.4;
/// Elastic turn before rolling resistance gives way: natural frequency, per substep.
const TURN_PHASE: f64 = 0.15;
const TURN_DAMPING: f64 = 0.3;
/// A rim bears on a point where ρ/R is above the first figure, on a face below the second.
const POINT: f64 = 0.95;
const FACE: f64 = 0.5;

/// Constants of the ground under one body.
#[derive(Clone, Debug)]
pub(super) struct Ground {
    pub radius: f64,
    /// k: force per depth and length of rim, N/m².
    stiffness: f64,
    /// Damping time of the whole ring, s; a shorter part of it moves slower and is damped for longer, ∝ √(π/θ0).
    damping: f64,
    /// Tangential stiffness and damping of a rim, N/m and N·s/m.
    pub grip: f64,
    grip_damping: f64,
    /// Stiffness and damping of rolling resistance, N·m and N·m·s.
    turn: f64,
    turn_damping: f64,
    pub mu: f64,
    rolling_resistance: f64,
}

/// What a ring of springs gives at one depth and tilt.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Pressure {
    /// F, N.
    pub force: f64,
    /// G, N·m.
    pub moment: f64,
    /// U, J.
    pub energy: f64,
    /// ∫k R dθ, ∫k R² cos θ dθ, ∫k R³ cos² θ dθ over the part in contact.
    slope: [f64; 3],
    /// √(π/θ0).
    slowness: f64,
}

/// Elastic state of a rim's friction, and also its rate of change.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Grip {
    /// Displacement along the ground, world axes, m.
    pub slip: [f64; 2],
    /// Pivoting about the vertical, rad.
    pub pivot: f64,
}

/// A rim's pose and motion, world axes, relative to the middle of the barrel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rim {
    /// From the middle to the rim's centre, m.
    pub centre: Vector3<f64>,
    /// Unit vector in the rim's plane towards its lowest point.
    pub down: Vector3<f64>,
    /// sin α.
    pub sin_tilt: f64,
    /// Depth of the rim's centre below ground, m.
    pub depth: f64,
}

/// Force and torque (about the middle, world axes) of the ground on a rim, and the rate of its friction's springs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    pub force: Vector3<f64>,
    pub torque: Vector3<f64>,
    pub rate: Grip,
    /// Speed of the material over the ground, m/s.
    pub speed: f64,
    /// Largest elastic displacement that friction can hold, m, and the same for pivoting, rad.
    slip_limit: f64,
    pivot_limit: f64,
}

impl Ground {
    pub fn new(body: &Body, inertia: &Inertia) -> Self {
        let (r, l, pi) = (body.radius, body.length, core::f64::consts::PI);
        let per_substep = |phase: f64| phase / SUBSTEP;
        let fast = per_substep(NORMAL_PHASE);
        // Rocking on a face, and bouncing on it with nothing but the shell.
        let rocking = fast * fast * inertia.transverse / (pi * r * r * r);
        let bouncing = fast * fast * inertia.shell / (2.0 * pi * r);
        // The least mass a rim can present to a push along the ground.
        let lever = (r * r / inertia.axial).max((0.25 * l * l + r * r) / inertia.transverse);
        let mass = 1.0 / (1.0 / inertia.shell + lever);
        let (hold, turn) = (per_substep(GRIP_PHASE), per_substep(TURN_PHASE));
        Self {
            radius: r,
            stiffness: rocking.min(bouncing),
            damping: 2.0 * NORMAL_DAMPING / fast,
            grip: mass * hold * hold,
            grip_damping: 2.0 * GRIP_DAMPING * mass * hold,
            turn: inertia.axial * turn * turn,
            turn_damping: 2.0 * TURN_DAMPING * inertia.axial * turn,
            mu: body.mu,
            rolling_resistance: body.rolling_resistance,
        }
    }

    /// The integrals at the top of this file.
    pub fn pressure(&self, depth: f64, sin_tilt: f64) -> Pressure {
        let b = self.radius * sin_tilt;
        if depth <= -b {
            return Pressure::default();
        }
        let (theta, sin, cos) = if depth >= b {
            (core::f64::consts::PI, 0.0, -1.0)
        } else {
            // From 1 − cos θ0, which is known to the last digit however shallow the contact.
            let versine = (depth + b) / b;
            let sin = (versine * (2.0 - versine)).max(0.0).sqrt();
            (libm::atan2(sin, 1.0 - versine), sin, 1.0 - versine)
        };
        let (kr, r) = (2.0 * self.stiffness * self.radius, self.radius);
        let square = 0.5 * (theta + sin * cos);
        Pressure {
            force: (kr * (depth * theta + b * sin)).max(0.0),
            moment: kr * r * (depth * sin + b * square),
            energy: (0.5 * kr * (depth * depth * theta + 2.0 * depth * b * sin + b * b * square)).max(0.0),
            slope: [kr * theta, kr * r * sin, kr * r * r * square],
            slowness: (core::f64::consts::PI / theta).sqrt(),
        }
    }

    /// Depth of the rim's lowest point at which the ring carries `force` at rest, m.
    pub fn sinking(&self, force: f64, sin_tilt: f64) -> f64 {
        let b = self.radius * sin_tilt;
        if force <= 0.0 {
            return 0.0;
        }
        let (mut low, mut high) = (0.0, self.radius);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if self.pressure(middle - b, sin_tilt).force < force {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }

    /// The ground's wrench on one rim; `velocity` and `angular` are the barrel's, world axes.
    pub fn touch(&self, rim: &Rim, velocity: Vector3<f64>, angular: Vector3<f64>, grip: &Grip) -> Option<Touch> {
        let pressure = self.pressure(rim.depth, rim.sin_tilt);
        if pressure.force <= 0.0 {
            return None;
        }
        let up = Vector3::z();
        // Rates of depth of the rim's centre, and of its lowest point against it per radius.
        let sink = -(velocity + angular.cross(&rim.centre)).z;
        let dip = -angular.cross(&rim.down).z;
        let [k0, k1, k2] = pressure.slope;
        let damping = self.damping * pressure.slowness;
        let drag = damping * (k0 * sink + k1 * dip);
        let drag_moment = damping * (k1 * sink + k2 * dip);
        // The ground does not pull: where damping would, it is scaled until it only cancels.
        let scale = if drag < -pressure.force { -pressure.force / drag } else { 1.0 };
        let normal = (pressure.force + scale * drag).max(0.0);
        let moment = pressure.moment + scale * drag_moment;
        let lift = rim.centre * normal + rim.down * moment;

        // Friction acts where the rim touches: at its lowest point, or in the middle of pressure of a face.
        let reach = pressure.moment / (pressure.force * self.radius);
        let face = smooth((POINT - reach) / (POINT - FACE));
        let arm = rim.centre + rim.down * (self.radius * (1.0 - face + face * reach.clamp(0.0, 1.0)));
        let slide = velocity + angular.cross(&arm);
        let limit = self.mu * normal;
        let pull = [
            -self.grip * grip.slip[0] - self.grip_damping * slide.x,
            -self.grip * grip.slip[1] - self.grip_damping * slide.y,
        ];
        let size = (pull[0] * pull[0] + pull[1] * pull[1]).sqrt();
        let cut = if size > limit { limit / size } else { 1.0 };
        let along = Vector3::new(cut * pull[0], cut * pull[1], 0.0);

        // Pivoting friction of a face, which a point does not have.
        let spread = self.radius * face * (1.0 - reach * reach).max(0.0).sqrt();
        let twist = -spread * spread * (self.grip * grip.pivot + self.grip_damping * angular.z);
        let twist = twist.clamp(-limit * spread, limit * spread);

        Some(Touch {
            force: along + up * normal,
            torque: lift.cross(&up) + arm.cross(&along) + up * twist,
            rate: Grip { slip: [slide.x, slide.y], pivot: if spread > 0.0 { angular.z } else { 0.0 } },
            speed: (slide.x * slide.x + slide.y * slide.y).sqrt(),
            slip_limit: limit / self.grip,
            pivot_limit: if spread > 0.0 { limit / (self.grip * spread) } else { 0.0 },
        })
    }

    /// Elastic friction brought back to what the normal force can hold.
    pub fn settle(&self, grip: Grip, touch: Option<&Touch>) -> Grip {
        let Some(touch) = touch else { return Grip::default() };
        let size = (grip.slip[0] * grip.slip[0] + grip.slip[1] * grip.slip[1]).sqrt();
        let cut = if size > touch.slip_limit { touch.slip_limit / size } else { 1.0 };
        Grip {
            slip: [cut * grip.slip[0], cut * grip.slip[1]],
            pivot: grip.pivot.clamp(-touch.pivot_limit, touch.pivot_limit),
        }
    }

    /// Whether a rim's friction holds, with a little to spare.
    pub fn holds(&self, grip: &Grip, touch: &Touch) -> bool {
        let limit = 0.95 * touch.slip_limit;
        grip.slip[0] * grip.slip[0] + grip.slip[1] * grip.slip[1] < limit * limit
    }

    /// Energy of a rim's friction springs, J. The pivoting spring's is bounded by what a flat face can hold.
    pub fn grip_energy(&self, grip: &Grip, spread: f64) -> f64 {
        0.5 * self.grip
            * (grip.slip[0] * grip.slip[0] + grip.slip[1] * grip.slip[1] + spread * spread * grip.pivot * grip.pivot)
    }

    /// Distance over which a rim bears on the ground sideways, as pivoting sees it, m.
    pub fn spread(&self, depth: f64, sin_tilt: f64) -> f64 {
        let pressure = self.pressure(depth, sin_tilt);
        if pressure.force <= 0.0 {
            return 0.0;
        }
        let reach = pressure.moment / (pressure.force * self.radius);
        self.radius * smooth((POINT - reach) / (POINT - FACE)) * (1.0 - reach * reach).max(0.0).sqrt()
    }

    /// Torque of rolling resistance from its elastic turn (rad) and the angular velocity about the cylinder axis, N·m.
    pub fn turn_torque(&self, turn: f64, omega: f64) -> f64 {
        let torque = -self.turn * turn - self.turn_damping * omega;
        torque.clamp(-self.rolling_resistance, self.rolling_resistance)
    }

    /// Elastic turn that gives `torque`, rad.
    pub fn turn_for(&self, torque: f64) -> f64 {
        self.settle_turn(torque / self.turn)
    }

    /// Elastic turn brought back to what rolling resistance can hold, rad.
    pub fn settle_turn(&self, turn: f64) -> f64 {
        let limit = self.rolling_resistance / self.turn;
        turn.clamp(-limit, limit)
    }

    /// Energy of the elastic turn, J.
    pub fn turn_energy(&self, turn: f64) -> f64 {
        0.5 * self.turn * turn * turn
    }
}

/// 0 below 0, 1 above 1, smooth between.
fn smooth(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

#[cfg(test)]
mod tests {
    use super::super::drive::Axis;
    use super::*;

    fn ground() -> Ground {
        let body = Body::chapter();
        let axis = Axis::new(&body.drive, body.weight_mass, body.stop);
        Ground::new(&body, &Inertia::new(&body, &axis))
    }

    #[test]
    fn the_closed_form_is_the_integral_over_the_rim() {
        let g = ground();
        let mut worst: f64 = 0.0;
        for (depth, sin_tilt) in [(-0.3, 0.7), (-0.49, 1.0), (0.01, 0.0), (0.001, 0.02), (0.001, 0.001), (-0.0499, 0.1)]
        {
            let n = 200_000;
            let (mut f, mut m, mut u) = (0.0, 0.0, 0.0);
            for i in 0..n {
                let theta = core::f64::consts::TAU * (f64::from(i) + 0.5) / f64::from(n);
                let delta = (depth + 0.5 * sin_tilt * libm::cos(theta)).max(0.0);
                let arc = 0.5 * core::f64::consts::TAU / f64::from(n);
                f += g.stiffness * delta * arc;
                m += g.stiffness * delta * 0.5 * libm::cos(theta) * arc;
                u += 0.5 * g.stiffness * delta * delta * arc;
            }
            let p = g.pressure(depth, sin_tilt);
            let off = ((p.force - f) / f).abs().max(((p.moment - m) / f).abs()).max(((p.energy - u) / u).abs());
            worst = worst.max(off);
        }
        assert!(worst < 1e-6, "closed form and numerical integral differ by {worst:.1e}");
    }

    #[test]
    fn force_and_moment_are_the_slopes_of_one_potential() {
        let g = ground();
        let mut worst: f64 = 0.0;
        for (depth, sin_tilt) in [(-0.3, 0.7), (-0.4999, 1.0), (0.001, 0.02), (0.001, 0.001), (-0.0499, 0.1)] {
            let e = 1e-7;
            let p = g.pressure(depth, sin_tilt);
            let slope = |a: Pressure, b: Pressure| (a.energy - b.energy) / (2.0 * e);
            let f = slope(g.pressure(depth + e, sin_tilt), g.pressure(depth - e, sin_tilt));
            let m = slope(g.pressure(depth, sin_tilt + e), g.pressure(depth, sin_tilt - e));
            worst = worst.max(((p.force - f) / f).abs()).max(((p.moment - m) / m).abs());
        }
        assert!(worst < 1e-4, "relative difference {worst:.1e}");
    }

    #[test]
    fn static_sinking_is_well_below_a_millimetre() {
        let g = ground();
        let (lying, upright) = (g.sinking(0.5 * 3.0 * 9.81, 1.0), g.sinking(3.0 * 9.81, 0.0));
        assert!(lying < 5e-4 && upright < 1e-5, "lying {lying:.1e} m, upright {upright:.1e} m");
        assert!((g.pressure(lying - 0.5, 1.0).force - 0.5 * 3.0 * 9.81).abs() < 1e-6);
    }
}
