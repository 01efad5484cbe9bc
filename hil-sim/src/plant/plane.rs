//! Off the line, but in its plane: a barrel whose slider axes cross in one point, pushed by nothing that would tip it, stays
//! level while it hops or slips. Ground is rigid here; two freedoms join the roll, the height of the rims and their slip.
//!
//! The equations of [`dynamics`](super::dynamics) with A in the plane and α about the cylinder axis, D = 1/(M + m + m(1−λ)):
//!
//! ```text
//! α = (b_a − D m (s2 b_1 − s1 b_2))/S     A = D (b − m α (s2, −s1))     S = I_a + m (s1² + s2²)(1 − D m)
//! ```
//!
//! The ground's forces T along the heading and N up enter linearly. In flight both are 0; slipping, N keeps the height
//! and T = −μ N against the slip; a landing is an inelastic impulse under the same cone. Found by Hermite interpolation, the
//! instant of landing ends a step early, and so does that of catching.

use super::drive::{Sliders, clip};
use super::rolling::{Given, Line, Roll};

/// A roll with height and slip.
#[derive(Clone, Copy, Debug)]
pub(super) struct Loose {
    pub roll: Roll,
    /// Height of the rims above ground, m, and its rate, m/s.
    pub lift: f64,
    pub climb: f64,
    /// Speed of the rims over the ground along the heading, m/s, and its integral, m.
    pub slip: f64,
    pub skid: f64,
}

/// What the ground does during a step.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mode {
    Flying,
    /// Slipping forwards (1) or backwards (−1).
    Slipping(f64),
}

/// How the barrel answers a unit of T or N: α, slip rate, climb rate.
#[derive(Clone, Copy)]
struct Answer {
    alpha: f64,
    slip: f64,
    climb: f64,
}

/// One evaluation of the equations.
pub(super) struct Course {
    rate: Loose,
    /// Accelerations along heading and up, m/s².
    pub ahead: f64,
    pub up: f64,
    /// Angular acceleration, rad/s².
    pub alpha: f64,
}

/// Without the ground: accelerations and what the ground could do about them.
struct Bare {
    free: Answer,
    along: Answer,
    lift: Answer,
    force: [f64; 2],
    memory: [f64; 2],
    sin: f64,
    cos: f64,
}

impl Line {
    #[inline]
    fn bare(&self, given: &Given, at: &Roll) -> Bare {
        let Given { body, axis, told, push, .. } = *given;
        let Sliders { s, v, memory } = at.sliders;
        let (r, g, w, m) = (self.radius, body.gravity, at.omega, body.weight);
        let (f1, i1) = axis.force(told.value[0], told.rate[0], s[0], v[0], memory[0]);
        let (f2, i2) = axis.force(told.value[1], told.rate[1], s[1], v[1], memory[1]);
        let (sin, cos) = libm::sincos(at.angle);
        // Demands of the weights, then the shell's equations, along e1 and e2.
        let n1 = [body.share * f1 - body.held * (w * w * s[0] + g * sin), m * (g * cos - 2.0 * v[0] * w)];
        let n2 = [m * (2.0 * v[1] * w - g * sin), body.share * f2 + body.held * (g * cos - w * w * s[1])];
        let b1 = body.shell * g * sin + push.ahead * cos - push.up * sin - n1[0] - n2[0];
        let b2 = -body.shell * g * cos + push.ahead * sin + push.up * cos - n1[1] - n2[1];
        let turn = push.roll - self.friction * w + s[0] * n1[1] - s[1] * n2[0];

        let d = 1.0 / (body.shell + m + body.held);
        let inverse = 1.0 / (body.axial + m * (s[0] * s[0] + s[1] * s[1]) * (1.0 - d * m));
        let (sideways, upward) = (s[1] * cos - s[0] * sin, s[1] * sin + s[0] * cos);
        let answer = |x: f64, z: f64, torque: f64| {
            let alpha = (torque - d * m * (x * sideways - z * upward)) * inverse;
            let ahead = d * (x - m * alpha * sideways);
            Answer { alpha, slip: ahead - r * alpha, climb: d * (z + m * alpha * upward) }
        };
        Bare {
            free: answer(b1 * cos + b2 * sin, b2 * cos - b1 * sin, turn),
            along: answer(1.0, 0.0, -r),
            lift: answer(0.0, 1.0, 0.0),
            force: [f1, f2],
            memory: [i1, i2],
            sin,
            cos,
        }
    }

    fn course(&self, given: &Given, at: &Loose, mode: Mode) -> Course {
        let Given { body, dt, .. } = *given;
        let bare = self.bare(given, &at.roll);
        let (mut t, mut n, mut held) = (0.0, 0.0, 0.0);
        if let Mode::Slipping(way) = mode {
            let answer = bare.lift.climb - self.mu * way * bare.along.climb;
            n = if answer > 0.0 { (-bare.free.climb / answer).max(0.0) } else { 0.0 };
            t = -self.mu * way * n;
            held = clip(body.axial * at.roll.omega / (2.0 * dt), self.rolling_resistance);
        }
        let sum = |pick: fn(&Answer) -> f64| pick(&bare.free) + t * pick(&bare.along) + n * pick(&bare.lift);
        let alpha = sum(|a| a.alpha) - held / body.axial;
        let slip = sum(|a| a.slip) + held * self.radius / body.axial;
        let up = if n > 0.0 { 0.0 } else { sum(|a| a.climb) };
        let ahead = slip + self.radius * alpha;
        let Sliders { s, v, .. } = at.roll.sliders;
        let (w, g) = (at.roll.omega, body.gravity);
        let (a1, a2) = (ahead * bare.cos - up * bare.sin, ahead * bare.sin + up * bare.cos);
        let slide = if body.weight > 0.0 {
            [
                body.share * (bare.force[0] / body.weight + w * w * s[0] + g * bare.sin - a1),
                body.share * (bare.force[1] / body.weight + w * w * s[1] - g * bare.cos - a2),
            ]
        } else {
            [0.0, 0.0]
        };
        let sliders = Sliders { s: if body.weight > 0.0 { v } else { [0.0, 0.0] }, v: slide, memory: bare.memory };
        let rate =
            Loose { roll: Roll { angle: w, omega: alpha, sliders }, lift: at.climb, climb: up, slip, skid: at.slip };
        Course { rate, ahead, up, alpha }
    }

    /// What the ground does at present to a barrel off the line.
    fn mode(&self, given: &Given, at: &Loose) -> Mode {
        if at.lift > 0.0 || at.climb > 0.0 {
            return Mode::Flying;
        }
        let bare = self.bare(given, &at.roll);
        let way = if at.slip != 0.0 {
            at.slip.signum()
        } else {
            let [t, n] = hold(&bare, [-bare.free.slip, -bare.free.climb]);
            if n <= 0.0 {
                return Mode::Flying;
            }
            -t.signum()
        };
        let answer = bare.lift.climb - self.mu * way * bare.along.climb;
        if answer <= 0.0 || bare.free.climb >= 0.0 { Mode::Flying } else { Mode::Slipping(way) }
    }

    /// Accelerations now, for whoever rides along.
    pub fn riding(&self, given: &Given, at: &Loose) -> Course {
        self.course(given, at, self.mode(given, at))
    }

    /// One step of RK4 of at most the given length, ended by a landing or by the rims catching; and how long it was.
    pub fn loose_step(&self, given: &Given, at: &Loose) -> (Loose, f64) {
        let Given { axis, dt, .. } = *given;
        let mode = self.mode(given, at);
        let go = |h: f64| {
            let k1 = self.course(given, at, mode).rate;
            let k2 = self.course(given, &at.plus(&k1, 0.5 * h), mode).rate;
            let k3 = self.course(given, &at.plus(&k2, 0.5 * h), mode).rate;
            let k4 = self.course(given, &at.plus(&k3, h), mode).rate;
            let mut next = at.plus(&k1.plus(&k2, 2.0).plus(&k3, 2.0).plus(&k4, 1.0), h / 6.0);
            next.roll.sliders.memory = next.roll.sliders.memory.map(|m| axis.settle(m));
            next
        };
        let next = go(dt);
        match mode {
            Mode::Flying if next.lift <= 0.0 => {
                let part = crossing(at.lift, at.climb * dt, next.lift, next.climb * dt);
                // A hop too short to be resolved lands where the step ends.
                let (mut next, taken) = if part > 1e-3 { (go(part * dt), part * dt) } else { (next, dt) };
                next.lift = 0.0;
                (self.land(given, next, false), taken)
            }
            Mode::Slipping(way) if next.slip * way <= 0.0 => {
                let part = if at.slip == 0.0 { 1.0 } else { at.slip / (at.slip - next.slip) };
                let mut next = if part > 1e-3 && part < 1.0 { go(part * dt) } else { next };
                let taken = if part > 1e-3 { part.min(1.0) * dt } else { dt };
                next.lift = 0.0;
                next.climb = 0.0;
                (self.land(given, next, true), taken)
            }
            Mode::Slipping(_) => (Loose { lift: 0.0, climb: 0.0, ..next }, dt),
            Mode::Flying => (next, dt),
        }
    }

    /// The inelastic impulse that ends a fall, and the slip too if the cone allows or it is over anyway (`catch`).
    fn land(&self, given: &Given, mut at: Loose, catch: bool) -> Loose {
        let body = given.body;
        let bare = self.bare(given, &at.roll);
        let [mut t, mut n] = hold(&bare, [-at.slip, -at.climb]);
        let caught = catch || t.abs() <= self.mu * n.max(0.0);
        if !caught {
            let way = at.slip.signum();
            let answer = bare.lift.climb - self.mu * way * bare.along.climb;
            n = if answer > 0.0 { (-at.climb / answer).max(0.0) } else { 0.0 };
            t = -self.mu * way * n;
        }
        let sum = |pick: fn(&Answer) -> f64| t * pick(&bare.along) + n * pick(&bare.lift);
        let (alpha, slip, climb) = (sum(|a| a.alpha), sum(|a| a.slip), sum(|a| a.climb));
        let ahead = slip + self.radius * alpha;
        at.roll.omega += alpha;
        if body.weight > 0.0 {
            at.roll.sliders.v[0] -= body.share * (ahead * bare.cos - climb * bare.sin);
            at.roll.sliders.v[1] -= body.share * (ahead * bare.sin + climb * bare.cos);
        }
        at.slip = if caught { 0.0 } else { at.slip + slip };
        at.climb = 0.0;
        at
    }
}

/// T and N that change slip and climb by `by`.
fn hold(bare: &Bare, [slip, climb]: [f64; 2]) -> [f64; 2] {
    let (a, b) = (&bare.along, &bare.lift);
    let inverse = 1.0 / (a.slip * b.climb - b.slip * a.climb);
    [(slip * b.climb - climb * b.slip) * inverse, (climb * a.slip - slip * a.climb) * inverse]
}

/// Where in 0…1 the cubic with values `a`, `b` and slopes `da`, `db` at its ends falls through zero.
fn crossing(a: f64, da: f64, b: f64, db: f64) -> f64 {
    let value = |t: f64| {
        let u = 1.0 - t;
        u * u * (a * (1.0 + 2.0 * t) + da * t) + t * t * (b * (3.0 - 2.0 * t) - db * u)
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        if value(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

impl Loose {
    #[inline]
    fn plus(&self, k: &Self, h: f64) -> Self {
        Self {
            roll: Roll {
                angle: self.roll.angle + h * k.roll.angle,
                omega: self.roll.omega + h * k.roll.omega,
                sliders: self.roll.sliders.plus(&k.roll.sliders, h),
            },
            lift: self.lift + h * k.lift,
            climb: self.climb + h * k.climb,
            slip: self.slip + h * k.slip,
            skid: self.skid + h * k.skid,
        }
    }

    /// Whether the rims stand on the ground and stick.
    #[inline]
    pub fn on_line(&self) -> bool {
        self.lift == 0.0 && self.climb == 0.0 && self.slip == 0.0
    }
}
