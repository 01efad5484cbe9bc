//! How the controller learns: homeostatically (Eq. 9, 10) or homeokinetically (Eq. 11, 12).
//!
//! Both rules are a step down the gradient of an error with respect to `C` and `h`, at fixed ξ, `A`
//! and `b`. The functions here give that direction, `−∂(½E)/∂C` and `−∂(½E)/∂h`; [`learned`] makes
//! a step of it. They are pure and leave every precaution to the [`Settings`] they are handed.
//!
//! # Where the printed equations are left
//!
//! * **Eq. 10** is printed as `η_i = Σ_j A_ji g'(z_j) ξ_i`. The gradient has the slope of motor
//!   neuron `i` and the errors of all sensors `j`: `η_i = g'(z_i) Σ_j A_ji ξ_j`.
//! * **Eq. 11** prints `v = C μ`. Only `v = Cᵀ μ` has `vᵀv = ζᵀ (C Cᵀ)⁻¹ ζ`, the time-loop error.
//! * All rules carry a factor ½ of the true gradient; it is absorbed in the learning rates.
//!
//! `tests/brain_rules.rs` proves each rule by finite differences of its error, and that the printed forms
//! fail.
//!
//! # As many sensors as motors, and not
//!
//! The chapter has `n = m`. For `n` sensors and `m` motors the inverses become pseudo-inverses, and
//! the gradient is taken anew. With `L = A G'` (`n × m`, `G' = diag g'`):
//!
//! | | `n ≥ m` | `n < m` |
//! |---|---|---|
//! | `ζ = L⁺ ξ` | `G'⁻¹ A⁻¹ ξ`, or `G'⁻¹ (AᵀA)⁻¹ Aᵀ ξ` for `n > m` | `Lᵀ (L Lᵀ)⁻¹ ξ` |
//! | `v` | `Cᵀ μ` | `P⁻¹ Cᵀ ζ`, `P = CᵀC + r` |
//! | `μ` | `(C Cᵀ + r)⁻¹ ζ` | `C w`, `w = P⁻¹ v` |
//! | `−∂(½E)/∂C` at fixed ζ | `μ vᵀ` | `μ vᵀ − (ζ − C v) wᵀ` |
//! | through z: `−2 ε_i y_i`, `ε_i =` | `ζ_i μ_i` | `ζ_i (2 Π μ − μ)_i`, `Π = Lᵀ (L Lᵀ)⁻¹ L` |
//!
//! The ridge `r` is part of the error that is descended: `ζᵀ (C Cᵀ + r)⁻¹ ζ` for `n ≥ m`, and
//! `vᵀv` for `n < m`; both are `E_TLE` at `r = 0`.

use nalgebra::{SMatrix, SVector};

use super::controller::Controller;
use super::linear::solve;
use super::settings::Settings;
use crate::scalar::Scalar;

/// A direction in the space of controllers: what `C` and `h` change by at a learning rate of 1.
pub type Direction<W, const N: usize, const M: usize> = Controller<W, N, M>;

/// The errors of one time loop, Eq. 11: from the sensors back through the model to the motor
/// neurons, and on through the controller to the sensors one step before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeLoop<W: Scalar, const N: usize, const M: usize> {
    /// ζ, the change of the motor neurons' potential that would explain ξ; after its clip.
    pub zeta: SVector<W, M>,
    /// μ, as ζ weighed by the controller's inverse.
    pub mu: SVector<W, M>,
    /// v, the change of the previous sensor values that would explain ξ; after its clip.
    pub v: SVector<W, N>,
    /// −∂(½E)/∂C at fixed ζ has, beside `μ vᵀ`, the term `−residual wᵀ`: what of ζ no sensor
    /// change explains. 0 for `N ≥ M`.
    residual: SVector<W, M>,
    w: SVector<W, N>,
    /// `2 Π μ − μ`, which is ε / ζ; μ itself for `N ≥ M`.
    weight: SVector<W, M>,
}

impl<W: Scalar, const N: usize, const M: usize> TimeLoop<W, N, M> {
    /// Eq. 11 for the controller matrix `c`, the model matrix `a`, the motor neurons' slopes
    /// `slope` (each above 0, see [`Controller::slope`]) and the prediction error `xi`.
    ///
    /// Applies `clip_zeta`, `clip_v`, `ridge` and `pivot_floor` of the settings. μ follows from the
    /// clipped ζ, and v is clipped where it is used, in `μ vᵀ` and the error.
    #[inline]
    pub fn new(
        c: &SMatrix<W, M, N>,
        a: &SMatrix<W, N, M>,
        slope: &SVector<W, M>,
        xi: &SVector<W, N>,
        settings: &Settings<W>,
    ) -> Self {
        let s = settings;
        let clip_zeta = |value: W| value.clip(s.clip_zeta);
        let clip_v = |value: W| value.clip(s.clip_v);
        if N >= M {
            let unsloped = if N == M {
                solve(&reshape(a), &reshape(xi), s.pivot_floor)
            } else {
                let at = a.transpose();
                solve(&(at * a), &(at * xi), s.pivot_floor)
            };
            let zeta = unsloped.component_div(slope).map(clip_zeta);
            let mu = solve(&with_ridge(c * c.transpose(), s.ridge), &zeta, s.pivot_floor);
            Self { zeta, mu, v: c.tr_mul(&mu).map(clip_v), residual: SVector::zeros(), w: SVector::zeros(), weight: mu }
        } else {
            let mut l = *a;
            for (mut column, gain) in l.column_iter_mut().zip(slope.iter()) {
                column *= *gain;
            }
            let llt = l * l.transpose();
            let zeta = l.tr_mul(&solve(&llt, xi, s.pivot_floor)).map(clip_zeta);
            let p = with_ridge(c.tr_mul(c), s.ridge);
            let v = solve(&p, &c.tr_mul(&zeta), s.pivot_floor);
            let w = solve(&p, &v, s.pivot_floor);
            let mu = c * w;
            let projected_mu = l.tr_mul(&solve(&llt, &(l * mu), s.pivot_floor));
            Self { zeta, mu, v: v.map(clip_v), residual: zeta - c * v, w, weight: projected_mu + (projected_mu - mu) }
        }
    }

    /// The time-loop error `E_TLE = vᵀv`; infinite or NaN where v is.
    #[inline]
    pub fn error(&self) -> W {
        self.v.dot(&self.v)
    }

    /// Eq. 12 at a learning rate of 1 and without decay: `μ_i v_j − 2 ε_i y_i x_j` for `C` and
    /// `−2 ε_i y_i` for `h`, with `ε_i = μ_i ζ_i` (or its form for `N < M`, see above), for the
    /// sensor values `x` and the motor values `y` before the error.
    #[inline]
    pub fn direction(&self, x: &SVector<W, N>, y: &SVector<W, M>) -> Direction<W, N, M> {
        let two = W::one() + W::one();
        let h = -(self.weight.component_mul(&self.zeta).component_mul(y) * two);
        let mut c = self.mu * self.v.transpose() + h * x.transpose();
        if N < M {
            c -= self.residual * self.w.transpose();
        }
        Direction::new(c, h)
    }
}

/// `matrix` in a shape that it already has, where only the branch taken makes the shapes equal.
#[inline]
fn reshape<W: Scalar, const R: usize, const C: usize, const R2: usize, const C2: usize>(
    matrix: &SMatrix<W, R, C>,
) -> SMatrix<W, R2, C2> {
    SMatrix::from_fn(|i, j| matrix.get((i, j)).copied().unwrap_or_else(W::zero))
}

/// `matrix + ridge · 1`.
#[inline]
fn with_ridge<W: Scalar, const K: usize>(mut matrix: SMatrix<W, K, K>, ridge: W) -> SMatrix<W, K, K> {
    for (k, column) in matrix.data.0.iter_mut().enumerate() {
        if let Some(entry) = column.get_mut(k) {
            *entry += ridge;
        }
    }
    matrix
}

/// Eq. 9 and 10 at a learning rate of 1 and without decay: `η xᵀ` for `C` and `η` for `h`, with
/// `η_i = g'(z_i) Σ_j A_ji ξ_j`. `slope` is g', `x` the sensor values before the error `xi`.
#[inline]
pub fn homeostatic<W: Scalar, const N: usize, const M: usize>(
    a: &SMatrix<W, N, M>,
    slope: &SVector<W, M>,
    x: &SVector<W, N>,
    xi: &SVector<W, N>,
) -> Direction<W, N, M> {
    let eta = a.tr_mul(xi).component_mul(slope);
    Direction::new(eta * x.transpose(), eta)
}

/// The controller after one step of `eps_c` in a direction, less its decay; the whole change of an
/// entry is clipped to ±`clip_c` or ±`clip_h`. The decay acts whatever `eps_c` is, as printed.
#[inline]
#[must_use]
pub fn learned<W: Scalar, const N: usize, const M: usize>(
    controller: &Controller<W, N, M>,
    direction: &Direction<W, N, M>,
    settings: &Settings<W>,
) -> Controller<W, N, M> {
    let s = settings;
    let dc = direction.c * s.eps_c - controller.c * s.lambda_c;
    let dh = direction.h * s.eps_c - controller.h * s.lambda_h;
    Controller::new(controller.c + dc.map(|d| d.clip(s.clip_c)), controller.h + dh.map(|d| d.clip(s.clip_h)))
}
