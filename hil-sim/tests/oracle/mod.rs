//! The planar truth: a barrel that rolls on flat ground without slip, from its Lagrangian, integrated with RK4. The
//! plant is judged by it wherever the barrel neither hops nor slips.
//!
//! ```text
//! M_eff φ̈ = −2mφ̇(s1ṡ1+s2ṡ2) + 2mRφ̇(ṡ1 sin φ − ṡ2 cos φ) + mg(s1 cos φ + s2 sin φ) − R(cos φ F1 + sin φ F2) − friction φ̇
//! M_eff = Ic + M R² + m[R² + s1² + s2² + 2R(−s1 sin φ + s2 cos φ)],   Ic = M R²/2
//! s̈1 = s1 φ̇² + g sin φ + F1/m − R cos φ φ̈        s̈2 = s2 φ̇² − g cos φ + F2/m − R sin φ φ̈
//! ```
//!
//! This is the one place where it is written down; the servo here is the continuous one with the derivative on the
//! measurement, by which the traces in `data/` were made.

/// State: φ, φ̇, s1, s2, ṡ1, ṡ2, I1, I2.
pub type State = [f64; 8];

pub const RADIUS: f64 = 0.5;
pub const SHELL: f64 = 1.0;
pub const WEIGHT: f64 = 1.0;
pub const GRAVITY: f64 = 9.81;
pub const RANGE: f64 = 0.3;

#[derive(Clone, Copy, Debug)]
pub struct Oracle {
    pub kp: f64,
    pub ki: f64,
    pub kd: f64,
    pub friction: f64,
    pub state: State,
}

impl Oracle {
    /// The original's servo with the derivative on the measurement, friction 0.1, weights at `s` and at rest.
    pub fn new(phi: f64, s: [f64; 2], ki: f64) -> Self {
        Self { kp: 200.0, ki, kd: 0.1, friction: 0.1, state: [phi, 0.0, s[0], s[1], 0.0, 0.0, 0.0, 0.0] }
    }

    fn rate(&self, q: &State, y: [f64; 2]) -> State {
        let [phi, w, s1, s2, v1, v2, i1, i2] = *q;
        let (sin, cos) = phi.sin_cos();
        let servo = |y: f64, s: f64, v: f64, i: f64| {
            let e = -RANGE * y.clamp(-1.0, 1.0) - s;
            let force = self.kp * (e + i.clamp(-0.5, 0.5) + (-self.kd * v).clamp(-0.9, 0.9));
            (force.clamp(-200.0, 200.0), self.ki * e)
        };
        let (f1, di1) = servo(y[0], s1, v1, i1);
        let (f2, di2) = servo(y[1], s2, v2, i2);
        let (m, r, g) = (WEIGHT, RADIUS, GRAVITY);
        let ic = 0.5 * SHELL * r * r;
        let m_eff = ic + SHELL * r * r + m * (r * r + s1 * s1 + s2 * s2 + 2.0 * r * (-s1 * sin + s2 * cos));
        let a = (-2.0 * m * w * (s1 * v1 + s2 * v2)
            + 2.0 * m * r * w * (v1 * sin - v2 * cos)
            + m * g * (s1 * cos + s2 * sin)
            - r * (cos * f1 + sin * f2)
            - self.friction * w)
            / m_eff;
        let a1 = s1 * w * w + g * sin + f1 / m - r * cos * a;
        let a2 = s2 * w * w - g * cos + f2 / m - r * sin * a;
        [w, a, v1, v2, a1, a2, di1, di2]
    }

    /// One step of RK4 with the command held.
    pub fn step(&mut self, y: [f64; 2], h: f64) {
        let plus = |k: &State, h: f64| {
            let mut q = self.state;
            q.iter_mut().zip(k).for_each(|(q, k)| *q += h * k);
            q
        };
        let k1 = self.rate(&self.state, y);
        let k2 = self.rate(&plus(&k1, 0.5 * h), y);
        let k3 = self.rate(&plus(&k2, 0.5 * h), y);
        let k4 = self.rate(&plus(&k3, h), y);
        for i in 0..8 {
            self.state[i] += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
        }
        for i in [6, 7] {
            self.state[i] = self.state[i].clamp(-0.5, 0.5);
        }
    }

    /// Kinetic and potential energy, from the positions of the three bodies and nothing else, J.
    pub fn energy(&self) -> f64 {
        let [phi, w, s1, s2, v1, v2, ..] = self.state;
        let (sin, cos) = phi.sin_cos();
        let spin = 0.5 * (0.5 * SHELL * RADIUS * RADIUS) * w * w;
        let shell = 0.5 * SHELL * (RADIUS * w) * (RADIUS * w) + SHELL * GRAVITY * RADIUS;
        let weight = |s: f64, v: f64, along: [f64; 2], turned: [f64; 2]| {
            let vx = RADIUS * w + v * along[0] + s * w * turned[0];
            let vz = v * along[1] + s * w * turned[1];
            0.5 * WEIGHT * (vx * vx + vz * vz) + WEIGHT * GRAVITY * (RADIUS + s * along[1])
        };
        spin + shell + weight(s1, v1, [cos, -sin], [-sin, -cos]) + weight(s2, v2, [sin, cos], [cos, -sin])
    }
}

/// One row of a reference trace.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    pub y: [f64; 2],
    pub s: [f64; 2],
    pub omega: f64,
    pub phi: f64,
    pub path: f64,
}

/// Reads a reference trace of `data/`.
pub fn trace(name: &str) -> Vec<Row> {
    let path = format!("{}/tests/data/{name}.csv", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    text.lines()
        .skip(1)
        .map(|line| {
            let n: Vec<f64> = line.split(',').map(|v| v.parse().expect("a number")).collect();
            Row { y: [n[4], n[5]], s: [n[6], n[7]], omega: n[8], phi: n[9], path: n[10] }
        })
        .collect()
}
