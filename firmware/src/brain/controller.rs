//! The controller: sensors in, motor commands out (Eq. 1–3).
//!
//! `y = tanh(C x + h)` (Eq. 3; Eq. 1 is the same without tanh) with `C = c U(φ)` for the coupled
//! controllers of Experiment 1.2 (Eq. 2), `U(φ) = [[cos φ, −sin φ], [sin φ, cos φ]]`.

use nalgebra::{SMatrix, SVector};

use crate::scalar::Scalar;

/// The parameters of Eq. 3 for `N` sensors and `M` motors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controller<S: Scalar, const N: usize, const M: usize> {
    /// Coupling `C`, `M × N`, no unit (or 1/unit of the sensor).
    pub c: SMatrix<S, M, N>,
    /// Bias `h`, one for each motor, no unit.
    pub h: SVector<S, M>,
}

impl<S: Scalar, const N: usize, const M: usize> Controller<S, N, M> {
    /// The controller with these matrices.
    pub const fn new(c: SMatrix<S, M, N>, h: SVector<S, M>) -> Self {
        Self { c, h }
    }

    /// `C x + h`, the membrane potential `z`.
    #[inline]
    pub fn potential(&self, x: &SVector<S, N>) -> SVector<S, M> {
        self.c * x + self.h
    }

    /// Eq. 3: the motor values `y = tanh(C x + h)`, each in \[−1, 1\].
    #[inline]
    pub fn act(&self, x: &SVector<S, N>) -> SVector<S, M> {
        self.potential(x).map(Scalar::tanh)
    }

    /// The slope of the motor neurons at `x`, `g'(z) = 1 − tanh²(z)`, but at least `floor` and at
    /// least the scalar's smallest positive value.
    ///
    /// The slope is exactly 0 for |z| > 19 in `f64` and |z| > 9 in `f32`, and Eq. 11 divides by it.
    /// It is computed as `(1 − t)(1 + t)`, which loses nothing to cancellation beyond the rounding
    /// of `t` itself.
    #[inline]
    pub fn slope(&self, x: &SVector<S, N>, floor: S) -> SVector<S, M> {
        let floor = floor.at_least(S::SMALLEST);
        self.potential(x).map(|z| {
            let t = z.tanh();
            let slope = (S::one() - t) * (S::one() + t);
            // A comparison that NaN passes unchanged: it is reported, not hidden by the floor.
            if slope < floor { floor } else { slope }
        })
    }

    /// The same controller in the wide type.
    #[inline]
    pub fn widen(&self) -> Controller<S::Wide, N, M> {
        Controller::new(self.c.map(Scalar::widen), self.h.map(Scalar::widen))
    }

    /// `wide` rounded to this type.
    #[inline]
    pub fn narrow(wide: &Controller<S::Wide, N, M>) -> Self {
        Self::new(wide.c.map(S::narrow), wide.h.map(S::narrow))
    }

    /// Whether every entry is finite.
    #[inline]
    pub fn is_finite(&self) -> bool {
        super::all_finite(&self.c) && super::all_finite(&self.h)
    }
}

impl<S: Scalar> Controller<S, 2, 2> {
    /// Eq. 2: `C = c U(φ)`, `h = 0`; `c` without unit, `phi` in radians.
    pub fn rotation(c: S, phi: S) -> Self {
        let quarter = S::from_f64(core::f64::consts::FRAC_PI_2);
        let (sin, cos) = (phi.sin(), (phi + quarter).sin());
        Self::new(nalgebra::Matrix2::new(c * cos, -(c * sin), c * sin, c * cos), SVector::zeros())
    }
}

impl<S: Scalar, const N: usize, const M: usize> Default for Controller<S, N, M> {
    /// `C` = identity (ones on the diagonal where `N ≠ M`), `h = 0`: every motor follows its sensor.
    /// Not zero, since `C = 0, h = 0` is a fixed point of Eq. 12.
    fn default() -> Self {
        Self::new(SMatrix::identity(), SVector::zeros())
    }
}
