//! The brain: a controller, a model of the own body, and how both learn (Eq. 1–12).
//!
//! | file | equations |
//! |---|---|
//! | [`controller`] | 1–3: `y = tanh(C x + h)` |
//! | [`model`] | 4–8: `x̂ = A y + b` and how it learns |
//! | [`rule`] | 9–12: how the controller learns, and where the printed forms are left |
//! | [`linear`] | the guarded inverse |
//! | [`stimulus`] | the open-loop drive of Experiment 1.1 |
//! | [`settings`] | learning rates, decays, precautions |
//!
//! [`Brain`] is all of it as one value: hand it the sensor values of a control step and it returns
//! the motor values. It works for any number of sensors `N` and motors `M` and in any [`Scalar`];
//! the barrel's brain is `Brain<f32, 2, 2>`.
//!
//! # One step
//!
//! 1. Act: `yₜ` from `xₜ` with the parameters as they are.
//! 2. Learn from `(xₜ₋₁, yₜ₋₁, xₜ)`. First ξ and E with the old `A` and `b`; then `A` and `b` from
//!    ξ; then `C` and `h`, with the new `A`, the same ξ, and the slopes at `z = C xₜ₋₁ + h` of the
//!    current `C` and `h`. In Eq. 12 `y` is the motor value `yₜ₋₁` that was sent.
//!
//! The first step has nothing to learn from. It is all computed aside and committed at the end: a
//! step that fails leaves the brain as it was.
//!
//! # Numbers that are not finite
//!
//! None gets in: the setters refuse them, and [`Brain::step`] reports a sensor value or a result
//! that is not finite as [`NonFinite`]. After `Ok` everything returned and everything kept is
//! finite and every motor value lies in \[−1, 1\].

pub mod controller;
pub mod linear;
pub mod model;
pub mod rule;
pub mod settings;
pub mod sine;
pub mod stimulus;

use core::fmt;

use nalgebra::{SMatrix, SVector};

pub use controller::Controller;
pub use model::Model;
pub use settings::{OutOfRange, Rule, Settings};
pub use stimulus::{Drive, Stimulus};

use crate::scalar::Scalar;
use rule::TimeLoop;

/// Controller, model and learning for `N` sensors and `M` motors, its state stored in `S`.
#[derive(Clone, Debug, PartialEq)]
pub struct Brain<S: Scalar, const N: usize, const M: usize> {
    controller: Controller<S, N, M>,
    model: Model<S, N, M>,
    /// `xₜ₋₁` and `yₜ₋₁`.
    previous: Option<(SVector<S, N>, SVector<S, M>)>,
    settings: Settings<S::Wide>,
    stimulus: Stimulus<S::Wide, M>,
}

/// What a step of the brain returns; all finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step<S: Scalar, const N: usize, const M: usize> {
    /// Motor values `y` to carry out now, each in \[−1, 1\].
    pub y: SVector<S, M>,
    /// Prediction error ξ (Eq. 5) of these sensor values, in their unit; 0 in the first step.
    pub xi: SVector<S, N>,
    /// `E = ξᵀξ` (Eq. 6), in the sensors' unit squared, limited to the scalar's largest value; 0 in
    /// the first step.
    pub error: S,
    /// `E_TLE = vᵀv` (Eq. 11) after the clips, limited to the scalar's largest value. In the rules
    /// that do not use it, it is what it would be; 0 in the open loop, which has no time loop, and in
    /// the first step.
    pub time_loop_error: S,
}

/// Where a number that is not finite turned up. The step did not take place: the state is as it was
/// before, and no motor value was made.
///
/// The way out of [`NonFinite::Input`] is a good sensor value. The others mean that finite numbers
/// overflowed; lower the learning rates, set clips, or put the entries back in range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NonFinite {
    /// A sensor value.
    Input,
    /// A motor value: `C x + h` is undefined, as ∞ − ∞.
    Motor,
    /// The prediction error, or the model after learning.
    Model,
    /// The controller after learning.
    Controller,
}

impl fmt::Display for NonFinite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Input => "a sensor value is not finite",
            Self::Motor => "a motor value is not finite",
            Self::Model => "the model's learning overflowed",
            Self::Controller => "the controller's learning overflowed",
        })
    }
}

impl core::error::Error for NonFinite {}

/// One number of the state; rows and columns count from 0, so the chapter's `C₁₂` is `C(0, 1)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Entry {
    /// Controller matrix: motor, sensor.
    C(usize, usize),
    /// Controller bias: motor.
    H(usize),
    /// Model matrix: sensor, motor.
    A(usize, usize),
    /// Model offset: sensor.
    B(usize),
}

/// Why an entry was not set; the old value stays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// There is no such row or column.
    NoSuchEntry(Entry),
    /// The value is NaN or infinite.
    NotFinite(Entry),
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoSuchEntry(entry) => write!(f, "there is no {entry:?}"),
            Self::NotFinite(entry) => write!(f, "{entry:?} cannot be set to NaN or infinity"),
        }
    }
}

impl core::error::Error for Refused {}

impl<S: Scalar, const N: usize, const M: usize> Brain<S, N, M> {
    /// A brain with the default controller and model (`C` and `A` identity, `h` and `b` zero), the
    /// default drive and the seed 0.
    ///
    /// # Errors
    /// As [`Settings::check`].
    pub fn new(settings: Settings<S::Wide>) -> Result<Self, OutOfRange> {
        let mut brain = Self::default();
        brain.set_settings(settings)?;
        Ok(brain)
    }

    /// One control step: the motor values for the sensor values `x`, then learning (see the
    /// [module](self)). It takes a bounded time that hardly depends on the values.
    ///
    /// # Errors
    /// [`NonFinite`], with nothing changed, the stimulus's step included. The next step would then
    /// learn across the gap: call [`Brain::forget`] if control was interrupted.
    pub fn step(&mut self, x: &SVector<S, N>) -> Result<Step<S, N, M>, NonFinite> {
        if !all_finite(x) {
            return Err(NonFinite::Input);
        }
        let mut controller = self.controller.widen();
        let mut driven = None;
        let y = if self.settings.rule == Rule::OpenLoop {
            driven.insert(self.stimulus.clone()).advance()
        } else {
            controller.act(&x.map(S::widen))
        };
        let y = y.map(S::narrow);
        if !all_finite(&y) {
            return Err(NonFinite::Motor);
        }

        let mut step = Step { y, xi: SVector::zeros(), error: S::zero(), time_loop_error: S::zero() };
        if let Some((x_before, y_before)) = &self.previous {
            let mut model = self.model.widen();
            let lesson =
                Lesson { x_before: x_before.map(S::widen), y_before: y_before.map(S::widen), x: x.map(S::widen) };
            let errors = lesson.learn(&mut controller, &mut model, &self.settings)?;
            step.xi = errors.xi.map(S::narrow);
            step.error = S::narrow(errors.error);
            step.time_loop_error = S::narrow(errors.time_loop_error);
            self.model = Model::narrow(&model);
            self.controller = Controller::narrow(&controller);
        }
        self.previous = Some((*x, y));
        if let Some(stimulus) = driven {
            self.stimulus = stimulus;
        }
        Ok(step)
    }

    /// Forgets the previous sensor and motor values: the next step acts but does not learn. For
    /// when what follows is not a consequence of the last motor values, as after a fault.
    pub fn forget(&mut self) {
        self.previous = None;
    }

    /// The controller's parameters.
    pub const fn controller(&self) -> &Controller<S, N, M> {
        &self.controller
    }

    /// The model's parameters.
    pub const fn model(&self) -> &Model<S, N, M> {
        &self.model
    }

    /// Replaces the controller's parameters.
    ///
    /// # Errors
    /// The first entry that is not finite; the old controller then stays.
    pub fn set_controller(&mut self, controller: Controller<S, N, M>) -> Result<(), Refused> {
        refuse_non_finite(&controller.c, Entry::C)?;
        refuse_non_finite(&controller.h, |i, _| Entry::H(i))?;
        self.controller = controller;
        Ok(())
    }

    /// Replaces the model's parameters.
    ///
    /// # Errors
    /// The first entry that is not finite; the old model then stays.
    pub fn set_model(&mut self, model: Model<S, N, M>) -> Result<(), Refused> {
        refuse_non_finite(&model.a, Entry::A)?;
        refuse_non_finite(&model.b, |i, _| Entry::B(i))?;
        self.model = model;
        Ok(())
    }

    /// The value of one entry, or `None` if there is no such entry.
    pub fn get(&self, entry: Entry) -> Option<S> {
        match entry {
            Entry::C(i, j) => self.controller.c.get((i, j)),
            Entry::H(i) => self.controller.h.get(i),
            Entry::A(i, j) => self.model.a.get((i, j)),
            Entry::B(i) => self.model.b.get(i),
        }
        .copied()
    }

    /// Sets one entry.
    ///
    /// # Errors
    /// If there is no such entry or the value is not finite; nothing is then changed.
    pub fn set(&mut self, entry: Entry, value: S) -> Result<(), Refused> {
        if !value.is_finite() {
            return Err(Refused::NotFinite(entry));
        }
        let place = match entry {
            Entry::C(i, j) => self.controller.c.get_mut((i, j)),
            Entry::H(i) => self.controller.h.get_mut(i),
            Entry::A(i, j) => self.model.a.get_mut((i, j)),
            Entry::B(i) => self.model.b.get_mut(i),
        };
        *place.ok_or(Refused::NoSuchEntry(entry))? = value;
        Ok(())
    }

    /// The settings in force.
    pub const fn settings(&self) -> &Settings<S::Wide> {
        &self.settings
    }

    /// Changes the settings, the rule included, from the next step on.
    ///
    /// # Errors
    /// As [`Settings::check`]; the old settings then stay.
    pub fn set_settings(&mut self, settings: Settings<S::Wide>) -> Result<(), OutOfRange> {
        settings.check()?;
        self.settings = settings;
        Ok(())
    }

    /// The drive of [`Rule::OpenLoop`]. It advances only in that rule.
    pub const fn stimulus(&self) -> &Stimulus<S::Wide, M> {
        &self.stimulus
    }

    /// As [`Brain::stimulus`], to change or restart it.
    pub const fn stimulus_mut(&mut self) -> &mut Stimulus<S::Wide, M> {
        &mut self.stimulus
    }
}

impl<S: Scalar, const N: usize, const M: usize> Default for Brain<S, N, M> {
    /// Default controller, model, settings and drive.
    fn default() -> Self {
        Self {
            controller: Controller::default(),
            model: Model::default(),
            previous: None,
            settings: Settings::default(),
            stimulus: Stimulus::default(),
        }
    }
}

/// What a step learns from, in the wide type.
struct Lesson<W: Scalar, const N: usize, const M: usize> {
    x_before: SVector<W, N>,
    y_before: SVector<W, M>,
    /// What followed.
    x: SVector<W, N>,
}

/// What was found while learning.
struct Errors<W: Scalar, const N: usize> {
    xi: SVector<W, N>,
    error: W,
    time_loop_error: W,
}

impl<W: Scalar, const N: usize, const M: usize> Lesson<W, N, M> {
    /// Eq. 5–12: the model learns, then the controller.
    #[inline]
    fn learn(
        &self,
        controller: &mut Controller<W, N, M>,
        model: &mut Model<W, N, M>,
        settings: &Settings<W>,
    ) -> Result<Errors<W, N>, NonFinite> {
        let xi = model.prediction_error(&self.y_before, &self.x);
        *model = model.learned(&self.y_before, &xi, settings);
        if !(all_finite(&xi) && model.is_finite()) {
            return Err(NonFinite::Model);
        }

        let mut time_loop_error = W::zero();
        if settings.rule != Rule::OpenLoop {
            let slope = controller.slope(&self.x_before, settings.gain_floor);
            let time_loop = TimeLoop::new(&controller.c, &model.a, &slope, &xi, settings);
            time_loop_error = finite_or_max(time_loop.error());
            match settings.rule {
                Rule::OpenLoop | Rule::Fixed => {}
                Rule::Homeostatic => {
                    let direction = rule::homeostatic(&model.a, &slope, &self.x_before, &xi);
                    *controller = rule::learned(controller, &direction, settings);
                }
                Rule::Homeokinetic => {
                    let direction = time_loop.direction(&self.x_before, &self.y_before);
                    *controller = rule::learned(controller, &direction, settings);
                }
            }
            if !controller.is_finite() {
                return Err(NonFinite::Controller);
            }
        }
        Ok(Errors { xi, error: finite_or_max(xi.dot(&xi)), time_loop_error })
    }
}

/// Whether every entry is finite.
#[inline]
fn all_finite<S: Scalar, const R: usize, const C: usize>(matrix: &SMatrix<S, R, C>) -> bool {
    matrix.iter().all(|entry| entry.is_finite())
}

/// A square that overflowed is reported as the largest number: it is only shown, and a display must
/// not stop a robot whose state is sound.
#[inline]
fn finite_or_max<W: Scalar>(value: W) -> W {
    if value.is_finite() { value } else { W::MAX }
}

/// The first entry of `matrix` that is not finite, by the name that `name` gives it.
fn refuse_non_finite<S: Scalar, const R: usize, const C: usize>(
    matrix: &SMatrix<S, R, C>,
    name: impl Fn(usize, usize) -> Entry,
) -> Result<(), Refused> {
    // nalgebra iterates column by column.
    match matrix.iter().position(|entry| !entry.is_finite()) {
        Some(k) => Err(Refused::NotFinite(name(k % R.max(1), k / R.max(1)))),
        None => Ok(()),
    }
}
