//! The self-model: what the sensors will read after a motor command (Eq. 4–8).
//!
//! `x̂ₜ₊₁ = A yₜ + b` (Eq. 4), prediction error `ξₜ₊₁ = xₜ₊₁ − x̂ₜ₊₁` (Eq. 5), `E = ξᵀξ` (Eq. 6). It
//! learns by descending `½E` (Eq. 7–12 all carry this factor ½ of the true gradient), with decay:
//! `ΔA = εA ξ yᵀ − λA A` (Eq. 7) and `Δb = εA ξ − λb b` (Eq. 8). The chapter writes one λ; here `A`
//! and `b` have one each.

use nalgebra::{SMatrix, SVector};

use super::settings::Settings;
use crate::scalar::Scalar;

/// The parameters of Eq. 4 for `N` sensors and `M` motors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Model<S: Scalar, const N: usize, const M: usize> {
    /// Response `A`, `N × M`, in the sensor's unit.
    pub a: SMatrix<S, N, M>,
    /// Offset `b`, one for each sensor, in the sensor's unit.
    pub b: SVector<S, N>,
}

impl<S: Scalar, const N: usize, const M: usize> Model<S, N, M> {
    /// The model with these matrices.
    pub const fn new(a: SMatrix<S, N, M>, b: SVector<S, N>) -> Self {
        Self { a, b }
    }

    /// Eq. 4: the sensor values expected after the motor values `y`.
    #[inline]
    pub fn predict(&self, y: &SVector<S, M>) -> SVector<S, N> {
        self.a * y + self.b
    }

    /// Eq. 5: `ξ = x − (A y + b)` for the motor values `y` and the sensor values `x` that followed.
    #[inline]
    pub fn prediction_error(&self, y: &SVector<S, M>, x: &SVector<S, N>) -> SVector<S, N> {
        x - self.predict(y)
    }

    /// Eq. 7 and 8: the model after learning from `ξ = xi` that followed `y`.
    ///
    /// The whole change of an entry, decay included, is clipped to ±`clip_a`. The decay acts whatever
    /// `eps_a` is, as printed: a model that shall stay needs both at 0.
    #[inline]
    #[must_use]
    pub fn learned(&self, y: &SVector<S, M>, xi: &SVector<S, N>, settings: &Settings<S>) -> Self {
        let s = settings;
        let step = xi * s.eps_a;
        let (da, db) = (step * y.transpose() - self.a * s.lambda_a, step - self.b * s.lambda_b);
        Self::new(self.a + da.map(|d| d.clip(s.clip_a)), self.b + db.map(|d| d.clip(s.clip_a)))
    }

    /// The same model in the wide type.
    #[inline]
    pub fn widen(&self) -> Model<S::Wide, N, M> {
        Model::new(self.a.map(Scalar::widen), self.b.map(Scalar::widen))
    }

    /// `wide` rounded to this type.
    #[inline]
    pub fn narrow(wide: &Model<S::Wide, N, M>) -> Self {
        Self::new(wide.a.map(S::narrow), wide.b.map(S::narrow))
    }

    /// Whether every entry is finite.
    #[inline]
    pub fn is_finite(&self) -> bool {
        super::all_finite(&self.a) && super::all_finite(&self.b)
    }
}

impl<S: Scalar, const N: usize, const M: usize> Default for Model<S, N, M> {
    /// `A` = identity (ones on the diagonal where `N ≠ M`), `b = 0`: the sensors repeat the motors.
    fn default() -> Self {
        Self::new(SMatrix::identity(), SVector::zeros())
    }
}
