//! The parameters of learning and its precautions, each with its default and the reason for it.

use core::fmt;

use crate::scalar::Scalar;

/// Who decides on the motor values, and how the controller learns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Rule {
    /// The motors follow the stimulus (Experiment 1.1); controller untouched.
    OpenLoop = 0,
    /// Eq. 3 with the controller as it is set (Experiment 1.2).
    Fixed = 1,
    /// Eq. 3, the controller learns by Eq. 9 and 10: it reduces the prediction error.
    Homeostatic = 2,
    /// Eq. 3, the controller learns by Eq. 11 and 12: it reduces the time-loop error.
    #[default]
    Homeokinetic = 3,
}

impl Rule {
    /// The rule with this number (0–3), as the console and the wire count them.
    pub const fn from_number(number: u8) -> Option<Self> {
        match number {
            0 => Some(Self::OpenLoop),
            1 => Some(Self::Fixed),
            2 => Some(Self::Homeostatic),
            3 => Some(Self::Homeokinetic),
            _ => None,
        }
    }

    /// Its number, 0–3.
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// Whether `C` and `h` learn.
    pub const fn learns_controller(self) -> bool {
        matches!(self, Self::Homeostatic | Self::Homeokinetic)
    }
}

/// The learning rates, decays and precautions.
///
/// All are finite and not negative; [`Settings::check`] says which is not. None has a unit other
/// than "per control step". They are held in the wide type of the brain's scalar, so that a ridge
/// of 1e-8 is not rounded to nothing in fixed point. The defaults are those of the chapter's
/// homeokinetic run.
///
/// The chapter defers the precautions to a section that is missing; these are the ones that the
/// original simulator takes, plus the two floors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings<W: Scalar> {
    /// Which rule drives and teaches. Default [`Rule::Homeokinetic`].
    pub rule: Rule,
    /// εA, learning rate of the model (Eq. 7, 8). Default 0.1: `A` settles in seconds at 50 Hz. It
    /// works in every rule; at 0 only the decay is left.
    pub eps_a: W,
    /// εC, learning rate of the controller (Eq. 9, 12). Default 0.1. At 0 only the
    /// decay is left.
    pub eps_c: W,
    /// λA, decay of `A` per step, 0 to 1. Default 0.003: lets a direction that is not excited be
    /// forgotten.
    pub lambda_a: W,
    /// λb, decay of `b` per step, 0 to 1. Default 0.001: slower than that of `A`, so that an offset
    /// is explained by `b`.
    pub lambda_b: W,
    /// λC, decay of `C` per step, 0 to 1. Default 0: the time-loop error itself keeps `C` bounded.
    pub lambda_c: W,
    /// λh, decay of `h` per step, 0 to 1. Default 0.
    pub lambda_h: W,
    /// Largest change of an entry of `A` or `b` in one step; 0 = no limit. Default 0.1: one blow
    /// does not undo what was learned.
    pub clip_a: W,
    /// Largest change of an entry of `C` in one step; 0 = no limit. Default 0.05: Eq. 12 is steep
    /// where `C` or a slope is small.
    pub clip_c: W,
    /// Largest change of an entry of `h` in one step; 0 = no limit. Default 0.1.
    pub clip_h: W,
    /// Largest |ζᵢ|, the error carried back to the motor neurons (Eq. 11); 0 = no limit. Default 1:
    /// ζ grows without bound where `A` is singular or a neuron saturates.
    pub clip_zeta: W,
    /// Largest |vⱼ|, the error carried back to the sensors (Eq. 11), where it enters Eq. 12; 0 = no
    /// limit. Default 1: v grows without bound where `C` is singular.
    pub clip_v: W,
    /// Added to the diagonal of `C Cᵀ` before it is inverted. Default 1e-8: makes it regular at
    /// `C = 0` and is nothing beside the `C Cᵀ` of a controller that acts.
    pub ridge: W,
    /// Least slope g' that Eq. 11 divides by. Default 1e-12: below what happens in a working robot
    /// (1e-5 when upright), above the exact 0 of a saturated neuron. Where this is less than the
    /// scalar's smallest positive value, that is used.
    pub gain_floor: W,
    /// Least magnitude of a pivot when `A` or `C Cᵀ` is inverted; the sign is kept. Default 1e-12:
    /// pivots of `A` are above 1e-7 in every run with noise, while without noise det A falls below
    /// 1e-26. Where this is less than the scalar's smallest positive value, that is used.
    pub pivot_floor: W,
}

impl<W: Scalar> Default for Settings<W> {
    fn default() -> Self {
        let number = W::from_f64;
        Self {
            rule: Rule::default(),
            eps_a: number(0.1),
            eps_c: number(0.1),
            lambda_a: number(0.003),
            lambda_b: number(0.001),
            lambda_c: number(0.0),
            lambda_h: number(0.0),
            clip_a: number(0.1),
            clip_c: number(0.05),
            clip_h: number(0.1),
            clip_zeta: number(1.0),
            clip_v: number(1.0),
            ridge: number(1e-8),
            gain_floor: number(1e-12),
            pivot_floor: number(1e-12),
        }
    }
}

impl<W: Scalar> Settings<W> {
    /// # Errors
    /// The first field that is not finite, is negative or, for a decay, above 1.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let max = W::MAX;
        let one = W::one();
        check_ranges(&[
            ("eps_a", self.eps_a, W::zero(), max),
            ("eps_c", self.eps_c, W::zero(), max),
            ("lambda_a", self.lambda_a, W::zero(), one),
            ("lambda_b", self.lambda_b, W::zero(), one),
            ("lambda_c", self.lambda_c, W::zero(), one),
            ("lambda_h", self.lambda_h, W::zero(), one),
            ("clip_a", self.clip_a, W::zero(), max),
            ("clip_c", self.clip_c, W::zero(), max),
            ("clip_h", self.clip_h, W::zero(), max),
            ("clip_zeta", self.clip_zeta, W::zero(), max),
            ("clip_v", self.clip_v, W::zero(), max),
            ("ridge", self.ridge, W::zero(), max),
            ("gain_floor", self.gain_floor, W::zero(), max),
            ("pivot_floor", self.pivot_floor, W::zero(), max),
        ])
    }
}

/// The first name whose value is NaN or outside its `low..=high`.
pub(super) fn check_ranges<W: Scalar>(rows: &[(&'static str, W, W, W)]) -> Result<(), OutOfRange> {
    for &(name, value, low, high) in rows {
        // False for NaN as well.
        if !(value >= low && value <= high) {
            return Err(OutOfRange { name });
        }
    }
    Ok(())
}

/// A setting is not finite or outside its documented range; the old settings stay in force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutOfRange {
    /// The field's name.
    pub name: &'static str,
}

impl fmt::Display for OutOfRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} is not a finite number within its range", self.name)
    }
}

impl core::error::Error for OutOfRange {}
