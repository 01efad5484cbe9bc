//! Rolling on the line: the axis is horizontal and both rims stick, so the barrel has one freedom, its roll.
//!
//! The equations of [`dynamics`](super::dynamics) are projected on the twist that the ground leaves, A = R ω̇ t̂ and
//! α = ω̇ a (t̂ the heading). Of the weights only the motion across their own axes is felt, with the arms
//! q1 = R sin φ − s1 and q2 = R cos φ + s2:
//!
//! ```text
//! M_eff = I_a + M R² + m (q1² + q2²) + m (1−λ) R²,   Q = −m q1 (g cos φ − 2ω ṡ1) − m q2 (2ω ṡ2 − g sin φ)
//!         + m (1−λ) R ω² (s1 cos φ + s2 sin φ) − λ R (F1 cos φ + F2 sin φ) − friction·ω + pushes
//! ```
//!
//! The equations left over give the forces in the two rims. While both press down and need no more than μ of that, this
//! is the motion; RK4 at 10 ms follows it. Coulomb rolling resistance takes −clip(Q + M_eff ω/(2 dt), ±τ): what is
//! needed to stop, up to its limit, so rest is held.

use super::body::Body;
use super::drive::{Axis, Setpoint, Sliders, clip};
use super::dynamics::Inertia;

/// Constants of rolling.
#[derive(Clone, Debug)]
pub(super) struct Line {
    pub radius: f64,
    pub length: f64,
    pub friction: f64,
    pub rolling_resistance: f64,
    pub mu: f64,
}

impl Line {
    /// What of a body decides its rolling.
    pub fn of(body: &Body) -> Self {
        Self {
            radius: body.radius,
            length: body.length,
            friction: body.friction,
            rolling_resistance: body.rolling_resistance,
            mu: body.mu,
        }
    }
}

/// Pushes in the directions that matter here: along the heading, along the axis, up.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Push {
    /// About the cylinder axis, N·m.
    pub roll: f64,
    /// About the heading, N·m.
    pub pitch: f64,
    /// About the vertical, N·m.
    pub yaw: f64,
    /// Along the heading, N.
    pub ahead: f64,
    /// Along the cylinder axis, N.
    pub aside: f64,
    /// Up, N.
    pub up: f64,
}

/// What does not change during a step.
#[derive(Clone, Copy)]
pub(super) struct Given<'a> {
    pub body: &'a Inertia,
    pub axis: &'a Axis,
    pub told: &'a Setpoint,
    pub push: &'a Push,
    /// The step, s: the time over which rolling resistance may stop the barrel.
    pub dt: f64,
}

/// What moves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Roll {
    /// Angle of roll, rad: e1 = (cos φ, −sin φ) in heading and up.
    pub angle: f64,
    /// Its rate, rad/s.
    pub omega: f64,
    pub sliders: Sliders,
}

/// Forces of the ground on the rims at −L/2 and +L/2, N.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Reaction {
    /// Up.
    pub normal: [f64; 2],
    /// Along the heading.
    pub ahead: [f64; 2],
    /// Along the axis.
    pub aside: [f64; 2],
}

/// Forces and accelerations at one instant.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instant {
    pub omega_dot: f64,
    /// What rolling resistance takes, N·m.
    pub held: f64,
    rate: Sliders,
    sin: f64,
    cos: f64,
}

impl Line {
    /// Accelerations at an instant.
    #[inline(always)]
    pub fn instant(&self, given: &Given, at: &Roll, (sin, cos): (f64, f64)) -> Instant {
        let Given { body, axis, told, push, dt } = *given;
        let Sliders { s, v, memory } = at.sliders;
        let (r, g, w, m) = (self.radius, body.gravity, at.omega, body.weight);
        let (f1, i1) = axis.force(told.value[0], told.rate[0], s[0], v[0], memory[0]);
        let (f2, i2) = axis.force(told.value[1], told.rate[1], s[1], v[1], memory[1]);
        let (q1, q2) = (r * sin - s[0], r * cos + s[1]);
        let inertia = body.axial + (body.shell + body.held) * r * r + m * (q1 * q1 + q2 * q2);
        let across = q1 * (g * cos - 2.0 * w * v[0]) + q2 * (2.0 * w * v[1] - g * sin);
        let mut torque = push.roll + r * push.ahead - m * across + body.held * r * w * w * (s[0] * cos + s[1] * sin)
            - body.share * r * (f1 * cos + f2 * sin)
            - self.friction * w;
        let mut held = 0.0;
        if self.rolling_resistance > 0.0 {
            held = clip(torque + inertia * w / (2.0 * dt), self.rolling_resistance);
            // Never with the motion: for an instant the estimate may be on the wrong side of a reversal.
            if held * w < 0.0 {
                held = 0.0;
            }
            torque -= held;
        }
        let omega_dot = torque / inertia;
        let slide = if m > 0.0 {
            let inverse = body.share / m;
            [
                f1 * inverse + body.share * (g * sin + s[0] * w * w - r * cos * omega_dot),
                f2 * inverse + body.share * (s[1] * w * w - g * cos - r * sin * omega_dot),
            ]
        } else {
            [0.0, 0.0]
        };
        let rate = Sliders { s: if m > 0.0 { v } else { [0.0, 0.0] }, v: slide, memory: [i1, i2] };
        Instant { omega_dot, held, rate, sin, cos }
    }

    /// Forces in the rims that make the motion of `now` come true.
    #[inline(always)]
    pub fn reaction(&self, given: &Given, at: &Roll, now: &Instant) -> Reaction {
        let Given { body, push, .. } = *given;
        let (r, g, w, m, a) = (self.radius, body.gravity, at.omega, body.weight, now.omega_dot);
        let Sliders { s, v, .. } = at.sliders;
        let (sin, cos) = (now.sin, now.cos);
        // Acceleration less gravity of each weight, along e1 and e2.
        let along1 = now.rate.v[0] + r * cos * a - w * w * s[0] - g * sin;
        let across1 = (r * sin - s[0]) * a - 2.0 * w * v[0] + g * cos;
        let along2 = now.rate.v[1] + r * sin * a - w * w * s[1] + g * cos;
        let across2 = (r * cos + s[1]) * a + 2.0 * w * v[1] - g * sin;
        let ahead = [m * (along1 * cos + across1 * sin), m * (across2 * cos + along2 * sin)];
        let up = [m * (across1 * cos - along1 * sin), m * (along2 * cos - across2 * sin)];

        let normal = body.shell * g + up[0] + up[1] - push.up;
        let forward = body.shell * r * a + ahead[0] + ahead[1] - push.ahead;
        let aside = -push.aside;
        let [h1, h2] = body.shift;
        let tip = (h1 * up[0] + h2 * up[1] - push.pitch - r * aside) / self.length;
        let turn = (h1 * ahead[0] + h2 * ahead[1] + push.yaw) / self.length;
        Reaction {
            normal: [0.5 * normal - tip, 0.5 * normal + tip],
            ahead: [0.5 * forward - turn, 0.5 * forward + turn],
            aside: [0.5 * aside; 2],
        }
    }

    /// Whether both rims press down and friction holds them.
    #[inline(always)]
    pub fn holds(&self, reaction: &Reaction) -> bool {
        let rim = |i: usize| {
            let (n, x, y) = (reaction.normal[i], reaction.ahead[i], reaction.aside[i]);
            n > 0.0 && x * x + y * y <= self.mu * self.mu * n * n
        };
        rim(0) && rim(1)
    }

    /// One step of RK4, or `None` if the ground cannot hold the barrel on the line at its start.
    #[inline(always)]
    pub fn step(&self, given: &Given, at: &Roll) -> Option<Roll> {
        let Given { axis, dt, .. } = *given;
        let begin = libm::sincos(at.angle);
        let k1 = self.instant(given, at, begin);
        if !self.holds(&self.reaction(given, at, &k1)) {
            return None;
        }
        let half = 0.5 * dt;
        let ahead = |omega: f64, k: &Instant, h: f64| {
            Roll { angle: at.angle, omega: at.omega + h * k.omega_dot, sliders: at.sliders.plus(&k.rate, h) }
                .turned(omega * h)
        };
        let two = ahead(at.omega, &k1, half);
        let k2 = self.instant(given, &two, turn(begin, at.omega * half));
        let three = ahead(two.omega, &k2, half);
        let k3 = self.instant(given, &three, turn(begin, two.omega * half));
        let four = ahead(three.omega, &k3, dt);
        let k4 = self.instant(given, &four, turn(begin, three.omega * dt));
        let sixth = dt / 6.0;
        let mean = |a: f64, b: f64, c: f64, d: f64| sixth * (a + 2.0 * (b + c) + d);
        let pair = |pick: fn(&Sliders) -> [f64; 2], start: [f64; 2]| {
            let [a, b, c, d] = [pick(&k1.rate), pick(&k2.rate), pick(&k3.rate), pick(&k4.rate)];
            [start[0] + mean(a[0], b[0], c[0], d[0]), start[1] + mean(a[1], b[1], c[1], d[1])]
        };
        let memory = pair(|r| r.memory, at.sliders.memory);
        Some(Roll {
            angle: at.angle + mean(at.omega, two.omega, three.omega, four.omega),
            omega: at.omega + mean(k1.omega_dot, k2.omega_dot, k3.omega_dot, k4.omega_dot),
            sliders: Sliders {
                s: pair(|r| r.s, at.sliders.s),
                v: pair(|r| r.v, at.sliders.v),
                memory: [axis.settle(memory[0]), axis.settle(memory[1])],
            },
        })
    }
}

impl Roll {
    #[inline(always)]
    fn turned(mut self, by: f64) -> Self {
        self.angle += by;
        self
    }
}

/// Sine and cosine of an angle turned by a little: a Taylor series of 1e-17 for what a step usually turns, cheaper than
/// a second reduction of the whole angle.
#[inline(always)]
fn turn((sin, cos): (f64, f64), by: f64) -> (f64, f64) {
    if by.abs() > 0.125 {
        let (s, c) = libm::sincos(by);
        return (sin * c + cos * s, cos * c - sin * s);
    }
    // Terms in pairs: half as long a chain as Horner's.
    let x = by * by;
    let xx = x * x;
    let s = by * ((1.0 - x * (1.0 / 6.0)) + xx * ((1.0 / 120.0 - x * (1.0 / 5040.0)) + xx * (1.0 / 362_880.0)));
    let c = (1.0 - x * 0.5) + xx * ((1.0 / 24.0 - x * (1.0 / 720.0)) + xx * (1.0 / 40_320.0 - x * (1.0 / 3_628_800.0)));
    (sin * c + cos * s, cos * c - sin * s)
}
