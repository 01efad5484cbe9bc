//! The open-loop drive of Experiment 1.1: a sine for each motor, coloured noise, or both.
//!
//! At control step `k` motor `i` (from 0) gets, clipped to \[−1, 1\],
//!
//! ```text
//! y_i = amplitude · sin(2π k / period + i · phaseshift · π/2) + noise · n_i
//! n_i ← a n_i + √(1 − a²) u_i,    a = exp(−1 / color)
//! ```
//!
//! with `u` uniform, of mean 0 and variance 1. So `n` is stationary from the first step on, with
//! standard deviation 1 and a correlation time of `color` control steps.
//!
//! The chapter says that phaseshift is in units of π. Rolling needs a quarter period between the two
//! axes, which the original simulator writes as 1 unit of **π/2**; that unit is used here.

use nalgebra::SVector;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

use super::settings::{OutOfRange, check_ranges};
use super::sine::sine;
use crate::scalar::Scalar;

/// What the drive is made of. All are finite; [`Drive::check`] says which is not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive<W: Scalar> {
    /// Control steps for one period, at least 1 (2 and less alias). Default 100: 2 s at 50 Hz,
    /// which the barrel follows.
    pub period: W,
    /// Phase between one motor and the next, in units of π/2, ±1000. Default 1, a quarter period.
    pub phaseshift: W,
    /// Amplitude of the sine, 0 to 1. Default 0.5.
    pub amplitude: W,
    /// Standard deviation of the noise before the sum is clipped, at least 0. Default 0.
    pub noise: W,
    /// Correlation time of the noise in control steps, at least 0; 0 is white. Default 10.
    pub color: W,
}

impl<W: Scalar> Default for Drive<W> {
    fn default() -> Self {
        let number = W::from_f64;
        Self {
            period: number(100.0),
            phaseshift: number(1.0),
            amplitude: number(0.5),
            noise: number(0.0),
            color: number(10.0),
        }
    }
}

impl<W: Scalar> Drive<W> {
    /// # Errors
    /// The first field that is not finite or outside its range.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let (zero, one, max) = (W::zero(), W::one(), W::MAX);
        let shift = W::from_f64(1000.0);
        check_ranges(&[
            ("period", self.period, one, max),
            ("phaseshift", self.phaseshift, -shift, shift),
            ("amplitude", self.amplitude, zero, one),
            ("noise", self.noise, zero, max),
            ("color", self.color, zero, max),
        ])
    }
}

/// The generator of the drive for `M` motors.
///
/// The phase is counted in 2⁻⁶⁴ of a turn ([`super::sine`]), so it is as exact after a week as at the start, and it
/// goes on where it is when the period changes.
#[derive(Clone, Debug, PartialEq)]
pub struct Stimulus<W: Scalar, const M: usize> {
    drive: Drive<W>,
    /// 2⁶⁴ / period.
    phase_step: u64,
    /// Of the first motor, and from each to the next.
    phase: u64,
    phase_shift: u64,
    /// `a` and `√(1 − a²)`.
    memory: W,
    innovation: W,
    /// `n`, `None` before the first step.
    noise: Option<SVector<W, M>>,
    random: Pcg32,
}

impl<W: Scalar, const M: usize> Stimulus<W, M> {
    /// The drive from step `k = 0` on; `seed` fixes the noise.
    ///
    /// # Errors
    /// As [`Drive::check`].
    pub fn new(drive: Drive<W>, seed: u64) -> Result<Self, OutOfRange> {
        drive.check()?;
        Ok(Self::of_checked(drive, seed))
    }

    /// What it is made of.
    pub const fn drive(&self) -> &Drive<W> {
        &self.drive
    }

    /// Changes the drive from the next step on, without a jump in phase or in the noise's course.
    ///
    /// # Errors
    /// As [`Drive::check`]; the old drive then goes on.
    pub fn set_drive(&mut self, drive: Drive<W>) -> Result<(), OutOfRange> {
        drive.check()?;
        *self =
            Self { phase: self.phase, noise: self.noise, random: self.random.clone(), ..Self::of_checked(drive, 0) };
        Ok(())
    }

    fn of_checked(drive: Drive<W>, seed: u64) -> Self {
        let memory = if drive.color > W::zero() { (-(W::one() / drive.color)).exp() } else { W::zero() };
        Self {
            drive,
            // The cast saturates: a period of 1 is one turn less 2⁻⁶⁴.
            phase_step: (TURN / drive.period.to_f64()) as u64,
            phase: 0,
            // ±1000 quarter turns in 2⁻³², then all in 2⁻⁶⁴ of a turn: whole turns fall out at the top.
            phase_shift: ((times_2_to_32(drive.phaseshift.to_f64()) as i64) << 30).cast_unsigned(),
            memory,
            // Not 1 − a²: that cancels where a is close to 1. Neither factor is negative.
            innovation: ((W::one() - memory) * (W::one() + memory)).sqrt(),
            noise: None,
            random: Pcg32::seed_from_u64(seed),
        }
    }

    /// Back to step `k = 0`, with the noise of `seed`.
    pub fn restart(&mut self, seed: u64) {
        self.phase = 0;
        self.noise = None;
        self.random = Pcg32::seed_from_u64(seed);
    }

    /// The motor values of this step, each in \[−1, 1\]; the next call is the next step.
    pub fn advance(&mut self) -> SVector<W, M> {
        let phase = self.phase;
        self.phase = self.phase.wrapping_add(self.phase_step);

        let u = SVector::from_fn(|_, _| unit_variance(self.random.next_u32()));
        let noise = match self.noise {
            // A first value of full variance: there is no start-up transient.
            None => u,
            Some(noise) => noise * self.memory + u * self.innovation,
        };
        self.noise = Some(noise);

        let drive = &self.drive;
        SVector::from_fn(|i, _| {
            let sine: W = sine(phase.wrapping_add((i as u64).wrapping_mul(self.phase_shift)));
            let noise = noise.get(i).copied().unwrap_or_else(W::zero);
            (drive.amplitude * sine + drive.noise * noise).clamp_to(-W::one(), W::one())
        })
    }
}

impl<W: Scalar, const M: usize> Default for Stimulus<W, M> {
    /// The default drive, with the noise of seed 0.
    fn default() -> Self {
        Self::of_checked(Drive::default(), 0)
    }
}

/// 2⁶⁴, one turn in units of the phase.
const TURN: f64 = 18_446_744_073_709_551_616.0;
/// 2³² x, by its exponent, which saves the chip a routine of double precision. For x that is finite; what is too small to have
/// an exponent stays next to nothing.
fn times_2_to_32(x: f64) -> f64 {
    const EXPONENT: u32 = f64::MANTISSA_DIGITS - 1;
    if x == 0.0 { x } else { f64::from_bits(x.to_bits().wrapping_add(32 << EXPONENT)) }
}

/// A uniform number of mean 0 and variance 1, in ±√3, from 32 random bits. It passes through 24
/// bits, exact in `f32`: the noise is the same in every scalar but for rounding.
fn unit_variance<W: Scalar>(bits: u32) -> W {
    let within_one = ((bits >> 8) as f32 + 0.5) / 8_388_608.0 - 1.0;
    W::from_f32(within_one) * W::from_f64(1.732_050_807_568_877_2)
}
