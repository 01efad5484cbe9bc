//! Another body for the same brain: a chain of driven pendulums, with more sensors than motors or fewer.
//!
//! The chapter says that its rules are general. Here they meet a body that shares nothing with the barrel, is a dozen
//! lines of physics ([`body`]), and has n ≠ m, where the library's pseudo-inverses are at work
//! (`firmware/src/brain/rule.rs`). The motor values are target angles of servos and the sensor values the angles that
//! come of them, as in the book's other robots, so that x̂ = A y + b can be a model of the body: A holds how far a
//! pendulum comes towards its target, and its neighbours with it.
//!
//! | [`Shape`] | n × m | sensor values |
//! |---|---|---|
//! | `Angles` | 2 × 2 | both angles of two pendulums: n = m, where Eq. 12 is as printed |
//! | `AnglesAndRates` | 4 × 2 | both angles and both rates of two |
//! | `EndAngles` | 2 × 3 | the outer angles of three: nothing tells of the middle one but its neighbours |
//!
//! Angles are in units of the servos' range, rates in [`Body::rate_unit`], each with noise by the law of the barrel's
//! sensors.
//!
//! At the start every motor follows its own angle, as in the chapter: `C` is unity on the angles, 0 on the rates, and
//! for a pendulum that is not sensed the mean of its neighbours; `A` is unity on the angles and 0 elsewhere. As the
//! servos do not quite reach their targets (0.91 of them by default), the loop gain is less than 1 and hanging is a
//! stable rest.

pub mod body;
pub mod measure;
pub mod reading;

use crate::setup::SetError;
use crate::transducers::Noise;
use body::{Body, Chain, Touch};
use core::fmt;
use firmware::brain::{Brain, Controller, Model, NonFinite, Settings};
use firmware::robot::settings;
use firmware::timing::CONTROL_PERIOD;
use nalgebra::{SMatrix, SVector};
use protocol::{Id, Values};

/// How many pendulums there are and what is sensed of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Two pendulums, both angles: n = m = 2.
    Angles,
    /// Two pendulums, both angles and then both rates: n = 4, m = 2.
    AnglesAndRates,
    /// Three pendulums, the angles of the first and the last: n = 2, m = 3.
    EndAngles,
}

impl Shape {
    /// Every shape.
    pub const ALL: [Shape; 3] = [Shape::Angles, Shape::AnglesAndRates, Shape::EndAngles];

    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Shape::Angles => "angles",
            Shape::AnglesAndRates => "angles-and-rates",
            Shape::EndAngles => "end-angles",
        }
    }

    /// How many pendulums it has.
    pub const fn pendulums(self) -> usize {
        match self {
            Shape::Angles | Shape::AnglesAndRates => 2,
            Shape::EndAngles => 3,
        }
    }

    /// The shape with this name.
    pub fn find(name: &str) -> Option<Shape> {
        Shape::ALL.into_iter().find(|shape| shape.name() == name)
    }
}

/// A hand on a pendulum for a while.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hand {
    /// When it comes, s: from the first control step at or after it.
    pub start: f64,
    /// How long it stays, s.
    pub seconds: f64,
    /// On which pendulum, counted from 0.
    pub pendulum: usize,
    /// What it does.
    pub touch: Touch,
}

/// Everything that decides a run: the same setup gives the same records.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainSetup {
    /// How many pendulums, and what is sensed.
    pub shape: Shape,
    /// What they are built of.
    pub body: Body,
    /// The parameters; only those of [`PARAMETERS`] are used.
    pub values: Values<f64>,
    /// Seed of the sensors' noise.
    pub seed: u64,
    /// Hands on pendulums; of two on the same one at the same time, the first in this list counts.
    pub hands: Vec<Hand>,
}

/// The parameters of the barrel that a chain has, too: learning and its precautions, and the sensors' noise.
pub const PARAMETERS: [Id; 17] = [
    Id::Rule,
    Id::EpsA,
    Id::EpsC,
    Id::LambdaA,
    Id::LambdaB,
    Id::LambdaC,
    Id::LambdaH,
    Id::ClipA,
    Id::ClipC,
    Id::ClipH,
    Id::ClipZeta,
    Id::ClipV,
    Id::Ridge,
    Id::GainFloor,
    Id::PivotFloor,
    Id::SensorNoise,
    Id::SensorNoiseTau,
];

/// What a chain sets otherwise than the barrel: h forgets within two seconds.
///
/// The chapter's h has no decay, and with as many motors as sensors, or fewer, it needs none: a motor that saturates
/// makes ζ large and is driven out again. With more motors than sensors the others explain ξ, ζ asks nothing of a motor
/// whose slope is 0, and it stays there.
const PRESET: [(Id, f64); 1] = [(Id::LambdaH, 0.01)];

impl ChainSetup {
    /// A chain of the default body under homeokinetic control, seed 1.
    pub fn new(shape: Shape) -> Self {
        let mut values = Values::defaults(|value| value);
        PRESET.iter().for_each(|&(id, value)| values.set(id, value));
        ChainSetup { shape, body: Body::default(), values, seed: 1, hands: Vec::new() }
    }

    /// Sets one parameter.
    ///
    /// # Errors
    /// One that is not of [`PARAMETERS`], or a value out of range; nothing is then changed.
    pub fn set(&mut self, id: Id, value: f64) -> Result<(), ChainError> {
        if !PARAMETERS.contains(&id) {
            return Err(ChainError::NotTheChains(id));
        }
        id.parameter().check(value).map_err(|reason| ChainError::Value(SetError { id, value, reason }))?;
        self.values.set(id, value);
        Ok(())
    }

    fn settings(&self) -> Settings<f32> {
        let mut values = Values::defaults(|value| value as f32);
        PARAMETERS.iter().for_each(|&id| values.set(id, self.values.get(id) as f32));
        settings(&values)
    }

    /// What is done to each pendulum by hand at `t`, s.
    fn hands<const P: usize>(&self, t: f64) -> [Option<Touch>; P] {
        let there = |hand: &&Hand| hand.start <= t && t < hand.start + hand.seconds;
        core::array::from_fn(|i| self.hands.iter().filter(|hand| hand.pendulum == i).find(there).map(|hand| hand.touch))
    }
}

/// Why a parameter was not set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ChainError {
    /// The parameter is the barrel's alone.
    NotTheChains(Id),
    /// The value is not one for this parameter.
    Value(SetError),
}

impl fmt::Display for ChainError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotTheChains(id) => {
                write!(f, "{} is a parameter of the barrel; a chain has", id.name())?;
                PARAMETERS.iter().try_for_each(|id| write!(f, " {}", id.name()))
            }
            Self::Value(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for ChainError {}

/// A control step: the chain as the brain found it, and the brain after learning from it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChainRecord {
    /// Time of the step, s.
    pub t: f64,
    /// Angles of the pendulums from hanging down, rad.
    pub angles: Vec<f64>,
    /// Their rates, rad/s.
    pub rates: Vec<f64>,
    /// Sensor values, with noise.
    pub x: Vec<f64>,
    /// Motor values, −1…1, from now to the next step.
    pub y: Vec<f64>,
    /// Controller matrix, row by row: one row a motor.
    pub c: Vec<f64>,
    /// Controller bias.
    pub h: Vec<f64>,
    /// Model matrix, row by row: one row a sensor.
    pub a: Vec<f64>,
    /// E = ξᵀξ.
    pub error: f64,
    /// Time loop error vᵀv.
    pub time_loop_error: f64,
}

/// A run that could not go on: a number was no longer finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Broken {
    /// When, s.
    pub at: f64,
    /// Where in the brain; [`NonFinite::Input`] if it came from the chain.
    pub cause: NonFinite,
}

impl fmt::Display for Broken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "at {:.2} s: {}", self.at, self.cause)
    }
}

impl std::error::Error for Broken {}

/// Runs a chain from hanging at rest and shows every control step to `observe`.
///
/// # Errors
/// Numbers that overflow, as with a body that is not one; what came before has been observed.
pub fn run(setup: &ChainSetup, seconds: f64, observe: impl FnMut(ChainRecord)) -> Result<(), Broken> {
    use Sense::{Angle, Rate};
    match setup.shape {
        Shape::Angles => {
            let c = SMatrix::from([[1.0, 0.0], [0.0, 1.0]]);
            run_as::<2, 2>(setup, [Angle(0), Angle(1)], c, seconds, observe)
        }
        Shape::AnglesAndRates => {
            // nalgebra takes columns: one a sensor.
            let c = SMatrix::from([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [0.0, 0.0]]);
            run_as::<2, 4>(setup, [Angle(0), Angle(1), Rate(0), Rate(1)], c, seconds, observe)
        }
        Shape::EndAngles => {
            let c = SMatrix::from([[1.0, 0.5, 0.0], [0.0, 0.5, 1.0]]);
            run_as::<3, 2>(setup, [Angle(0), Angle(2)], c, seconds, observe)
        }
    }
}

/// A sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Sense {
    /// Of the angle of a pendulum.
    Angle(usize),
    /// Of its rate.
    Rate(usize),
}

impl Sense {
    /// What it says without noise.
    fn of<const P: usize>(self, chain: &Chain<P>) -> f64 {
        match self {
            Sense::Angle(i) => chain.angles[i] / chain.body.range,
            Sense::Rate(i) => chain.rates[i] / chain.body.rate_unit(),
        }
    }
}

/// A run of `P` pendulums under a brain of `N` sensors and `P` motors.
fn run_as<const P: usize, const N: usize>(
    setup: &ChainSetup,
    senses: [Sense; N],
    c: SMatrix<f32, P, N>,
    seconds: f64,
    mut observe: impl FnMut(ChainRecord),
) -> Result<(), Broken> {
    let mut chain = Chain::<P>::new(setup.body);
    let a = SMatrix::from_fn(|i, j| if senses[i] == Sense::Angle(j) { 1.0 } else { 0.0 });
    let mut brain = Brain::<f32, N, P>::default();
    // Finite, and within the table's ranges, which lie within those of the settings: nothing to refuse.
    let _ = brain.set_settings(setup.settings());
    let _ = brain.set_controller(Controller::new(c, SVector::zeros()));
    let _ = brain.set_model(Model::new(a, SVector::zeros()));

    let (strength, tau) = (setup.values.get(Id::SensorNoise), setup.values.get(Id::SensorNoiseTau));
    let (mut random, mut noise) = (Noise::new(setup.seed), [0.0; N]);
    for k in 0..(seconds / CONTROL_PERIOD).round() as u64 {
        let t = k as f64 * CONTROL_PERIOD;
        for n in &mut noise {
            *n += tau.sqrt() * random.uniform() * strength - tau * *n;
        }
        let x = SVector::from_fn(|i, _| (senses[i].of(&chain) + noise[i]) as f32);
        let step = brain.step(&x).map_err(|cause| Broken { at: t, cause })?;
        let y = step.y.map(f64::from);
        observe(ChainRecord {
            t,
            angles: chain.angles.to_vec(),
            rates: chain.rates.to_vec(),
            x: rows(&x),
            y: y.as_slice().to_vec(),
            c: rows(&brain.controller().c),
            h: rows(&brain.controller().h),
            a: rows(&brain.model().a),
            error: f64::from(step.error),
            time_loop_error: f64::from(step.time_loop_error),
        });
        chain.advance(Some(&y.into()), &setup.hands(t));
    }
    Ok(())
}

/// The entries of a matrix, row by row.
fn rows<const R: usize, const C: usize>(matrix: &SMatrix<f32, R, C>) -> Vec<f64> {
    matrix.row_iter().flat_map(|row| row.iter().map(|entry| f64::from(*entry)).collect::<Vec<_>>()).collect()
}
