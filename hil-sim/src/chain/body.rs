//! The chain as physics sees it: pendulums that hang side by side on one shaft line, each coupled to its neighbours by
//! a torsion spring and turned by a servo of its own (Scott's pendulum line: the sine-Gordon equation in pieces).
//!
//! ```text
//! θ̈ᵢ = −G sin θᵢ − d θ̇ᵢ + k Σⱼ (θⱼ − θᵢ) + uᵢ       j: the neighbours of i, one at the ends
//! uᵢ = clip(K (r yᵢ − θᵢ) − D θ̇ᵢ, ±u_max)             the servo, while it is on; y: the motor value, ±1
//! ```
//!
//! All pendulums are alike. Torques are given over the moment of inertia of one of them, in rad/s².

use firmware::timing::CONTROL_PERIOD;

/// What a chain is built of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// G, gravity over the length of a pendulum, 1/s².
    pub gravity: f64,
    /// k, stiffness of each torsion spring, 1/s².
    pub spring: f64,
    /// d, friction of the bearings, 1/s.
    pub friction: f64,
    /// K, stiffness of the servos, 1/s².
    pub stiffness: f64,
    /// D, damping of the servos, 1/s. It acts on the rate, not on the error: a set-point step gives no kick.
    pub damping: f64,
    /// The largest torque of a servo, rad/s².
    pub max_torque: f64,
    /// r, the angle that a motor value of 1 aims at, rad.
    pub range: f64,
}

impl Default for Body {
    /// Pendulums of 0.25 m. Alone and held by its servo, one swings at 3.3 Hz with a damping ratio of 0.5 and hangs
    /// still at 0.91 of the angle that it is told. The springs are a quarter as stiff as the servos, so that neighbours
    /// are felt. A servo can lift its pendulum five times over.
    fn default() -> Self {
        Body {
            gravity: 9.81 / 0.25,
            spring: 100.0,
            friction: 0.2,
            stiffness: 400.0,
            damping: 20.0,
            max_torque: 200.0,
            range: 1.0,
        }
    }
}

impl Body {
    /// The rate that counts as 1 for a sensor, rad/s: that of a servo's own oscillation, √K, over its whole range.
    pub fn rate_unit(&self) -> f64 {
        self.range * self.stiffness.sqrt()
    }
}

/// What a hand does to a pendulum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Touch {
    /// Pushes it with this torque, rad/s².
    Push(f64),
    /// Holds it where it is.
    Hold,
}

/// Steps of the integration (RK4) in a control step: 2 ms each, at which a free chain of the default body keeps its
/// energy to 1e-6 over a minute.
const STEPS: u32 = 10;

/// A chain of `P` pendulums and how it moves.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain<const P: usize> {
    /// What it is built of.
    pub body: Body,
    /// θ, the angle of each pendulum from hanging down, rad; whole turns count, as the springs feel them.
    pub angles: [f64; P],
    /// θ̇, rad/s.
    pub rates: [f64; P],
}

/// Angles and rates of all pendulums; as a slope, their rates and accelerations.
type State<const P: usize> = [[f64; P]; 2];

impl<const P: usize> Chain<P> {
    /// The chain hanging at rest.
    pub fn new(body: Body) -> Self {
        Chain { body, angles: [0.0; P], rates: [0.0; P] }
    }

    /// Moves on by a control step, with the servos at the motor values `y` (off without any) and what is done to each
    /// pendulum by hand. A pendulum that is held stops at once.
    pub fn advance(&mut self, y: Option<&[f64; P]>, hands: &[Option<Touch>; P]) {
        for (rate, hand) in self.rates.iter_mut().zip(hands) {
            if *hand == Some(Touch::Hold) {
                *rate = 0.0;
            }
        }
        let h = CONTROL_PERIOD / f64::from(STEPS);
        for _ in 0..STEPS {
            let start = [self.angles, self.rates];
            let k1 = self.slope(&start, y, hands);
            let k2 = self.slope(&moved(&start, &k1, 0.5 * h), y, hands);
            let k3 = self.slope(&moved(&start, &k2, 0.5 * h), y, hands);
            let k4 = self.slope(&moved(&start, &k3, h), y, hands);
            let sum = moved(&moved(&moved(&k1, &k2, 2.0), &k3, 2.0), &k4, 1.0);
            [self.angles, self.rates] = moved(&start, &sum, h / 6.0);
        }
    }

    /// Energy over the moment of inertia of one pendulum, 1/s²: of motion, height and springs; 0 when hanging at rest.
    pub fn energy(&self) -> f64 {
        let body = &self.body;
        let motion: f64 = self.rates.iter().map(|rate| 0.5 * rate * rate).sum();
        let height: f64 = self.angles.iter().map(|angle| body.gravity * (1.0 - libm::cos(*angle))).sum();
        let springs: f64 = self.angles.windows(2).map(|pair| 0.5 * body.spring * (pair[1] - pair[0]).powi(2)).sum();
        motion + height + springs
    }

    fn slope(&self, [angles, rates]: &State<P>, y: Option<&[f64; P]>, hands: &[Option<Touch>; P]) -> State<P> {
        let body = &self.body;
        let acceleration = |i: usize| {
            let (angle, rate) = (angles[i], rates[i]);
            let push = match hands[i] {
                Some(Touch::Hold) => return 0.0,
                Some(Touch::Push(torque)) => torque,
                None => 0.0,
            };
            let spring = |j: usize| angles.get(j).map_or(0.0, |other| body.spring * (other - angle));
            let springs = i.checked_sub(1).map_or(0.0, spring) + spring(i + 1);
            let servo = y.map_or(0.0, |y| {
                let torque = body.stiffness * (body.range * y[i] - angle) - body.damping * rate;
                torque.clamp(-body.max_torque, body.max_torque)
            });
            -body.gravity * libm::sin(angle) - body.friction * rate + springs + servo + push
        };
        [*rates, core::array::from_fn(acceleration)]
    }
}

/// `state + by · slope`.
fn moved<const P: usize>(state: &State<P>, slope: &State<P>, by: f64) -> State<P> {
    core::array::from_fn(|k| core::array::from_fn(|i| state[k][i] + by * slope[k][i]))
}
