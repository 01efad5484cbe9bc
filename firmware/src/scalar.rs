//! The number types that the brain can be run in: `f32`, `f64` and the fixed-point [`Fixed16`].
//!
//! Everything here is the same arithmetic on every machine. Transcendental functions come from
//! `libm` and [`crate::tanh`], which are plain software, and no product is fused with a sum, so an
//! x86 host and a Cortex-M4F compute the same bits. The fixed-point types saturate where they would overflow, and
//! division by zero saturates too: nothing in this module panics on any value.
//!
//! A state is *stored* in a scalar `S` and each step is *computed* in [`Scalar::Wide`], then
//! rounded back. For the floats the two are one type; for [`Fixed16`] the wide type carries 32
//! fraction bits, which is what the inverses of Eq. 11 need: an inverse of a matrix with entries
//! around 0.1 loses about seven bits, and 16 do not leave enough.

use core::fmt::{self, Debug, Display};
use core::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use fixed::types::{I16F16, I32F32};
use nalgebra::{ClosedAddAssign, ClosedDivAssign, ClosedMulAssign, ClosedSubAssign};
use num_traits::{One, Zero};
use protocol::message::Precision;

/// A number that the controller, the model and the learning rules can be computed in.
///
/// The bounds are those of nalgebra's matrices, so an `SMatrix<S, R, C>` of any scalar here adds,
/// multiplies and transposes.
pub trait Scalar:
    Copy
    + Debug
    + Display
    + PartialOrd
    + Send
    + Sync
    + 'static
    + Zero
    + One
    + Neg<Output = Self>
    + ClosedAddAssign
    + ClosedSubAssign
    + ClosedMulAssign
    + ClosedDivAssign
{
    /// What a step is computed in; at least as fine and as wide as `Self`.
    type Wide: Scalar<Wide = Self::Wide>;

    /// The name of this number format on the wire.
    const PRECISION: Precision;

    /// The largest finite value.
    const MAX: Self;

    /// The smallest positive value: the least that a guard against division by zero may be.
    const SMALLEST: Self;

    /// The same value in the wide type; exact.
    fn widen(self) -> Self::Wide;

    /// The nearest value of this type to `wide`; fixed point rounds half up and saturates.
    fn narrow(wide: Self::Wide) -> Self;

    /// The nearest value to `value`. Fixed point has no image of what is not finite: infinities
    /// saturate and NaN becomes 0, so use [`Scalar::try_from_f64`] on data from outside.
    fn from_f64(value: f64) -> Self;

    /// As [`Scalar::from_f64`], from single precision.
    fn from_f32(value: f32) -> Self;

    /// The nearest double.
    fn to_f64(self) -> f64;

    /// The nearest single.
    fn to_f32(self) -> f32;

    /// `value` in this type, or `None` if it is NaN or infinite, or not finite in this type.
    fn try_from_f64(value: f64) -> Option<Self> {
        let converted = Self::from_f64(value);
        (value.is_finite() && converted.is_finite()).then_some(converted)
    }

    /// Neither NaN nor infinite; a fixed-point number always is.
    fn is_finite(self) -> bool;

    /// Absolute value; the most negative fixed-point number saturates.
    fn abs(self) -> Self;

    /// Hyperbolic tangent, in \[−1, 1\].
    fn tanh(self) -> Self;

    /// Sine of an angle in radians.
    fn sin(self) -> Self;

    /// Exponential function; saturates in fixed point.
    fn exp(self) -> Self;

    /// Square root; of a negative number NaN in the floats and 0 in fixed point.
    fn sqrt(self) -> Self;

    /// `self` limited to ±`limit`, where a limit of 0 means none. NaN stays NaN, to be found by
    /// whoever checks the result.
    #[inline]
    fn clip(self, limit: Self) -> Self {
        if limit <= Self::zero() { self } else { self.clamp_to(-limit, limit) }
    }

    /// `self` limited to `low..=high`. Unlike `clamp` of `core` it accepts any bounds; where they
    /// are in the wrong order `low` wins. NaN stays NaN.
    #[inline]
    fn clamp_to(self, low: Self, high: Self) -> Self {
        if self < low {
            low
        } else if self > high {
            high
        } else {
            self
        }
    }

    /// The larger of two; `other` if `self` is NaN.
    #[inline]
    fn at_least(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
}

/// A float: its name on the wire, its hyperbolic tangent, and libm's functions for it.
macro_rules! float {
    ($name:ident, $precision:ident, $abs:ident, $tanh:path, $sin:ident, $exp:ident, $sqrt:ident) => {
        impl Scalar for $name {
            type Wide = Self;
            const PRECISION: Precision = Precision::$precision;
            const MAX: Self = Self::MAX;
            const SMALLEST: Self = Self::from_bits(1);

            #[inline]
            fn widen(self) -> Self {
                self
            }
            #[inline]
            fn narrow(wide: Self) -> Self {
                wide
            }
            #[inline]
            fn from_f64(value: f64) -> Self {
                value as Self
            }
            #[inline]
            fn from_f32(value: f32) -> Self {
                Self::from(value)
            }
            #[inline]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline]
            fn to_f32(self) -> f32 {
                self as f32
            }
            #[inline]
            fn is_finite(self) -> bool {
                Self::is_finite(self)
            }
            #[inline]
            fn abs(self) -> Self {
                libm::$abs(self)
            }
            #[inline]
            fn tanh(self) -> Self {
                $tanh(self)
            }
            #[inline]
            fn sin(self) -> Self {
                libm::$sin(self)
            }
            #[inline]
            fn exp(self) -> Self {
                libm::$exp(self)
            }
            #[inline]
            fn sqrt(self) -> Self {
                libm::$sqrt(self)
            }
        }
    };
}

float!(f32, F32, fabsf, crate::tanh::tanh, sinf, expf, sqrtf);
float!(f64, F64, fabs, libm::tanh, sin, exp, sqrt);

/// 16 integer and 16 fraction bits, range ±32 768, resolution 1.5e-5: the state of a brain on a
/// microcontroller without a floating-point unit.
///
/// Arithmetic saturates. Products and quotients are formed in [`FixedWide`] and rounded to nearest.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Fixed16(pub I16F16);

/// 32 integer and 32 fraction bits, range ±2.1e9, resolution 2.3e-10: what [`Fixed16`] is computed
/// in. Arithmetic saturates; products and quotients are truncated to the resolution.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct FixedWide(pub I32F32);

impl Mul for FixedWide {
    type Output = Self;
    /// The bits of the crate's product, whose way to them takes a microcontroller half as long again.
    #[inline]
    fn mul(self, other: Self) -> Self {
        let product = (i128::from(self.0.to_bits()) * i128::from(other.0.to_bits())) >> I32F32::FRAC_NBITS;
        let saturated = if product < 0 { i64::MIN } else { i64::MAX };
        Self(I32F32::from_bits(i64::try_from(product).unwrap_or(saturated)))
    }
}

impl Div for FixedWide {
    type Output = Self;
    /// Division of a positive or negative number by zero saturates with its sign; 0/0 is 0.
    // It is long, and the solutions of Eq. 11 have many.
    #[inline(never)]
    fn div(self, other: Self) -> Self {
        if other.0.is_zero() {
            return Self(match self.0.signum().to_bits() {
                0 => I32F32::ZERO,
                s if s > 0 => I32F32::MAX,
                _ => I32F32::MIN,
            });
        }
        let (bits, divisor) = (self.0.to_bits(), other.0.to_bits());
        let magnitude = quotient(bits.unsigned_abs(), divisor.unsigned_abs());
        let saturated = i64::try_from(magnitude).unwrap_or(i64::MAX);
        match (bits < 0) == (divisor < 0) {
            true => Self(I32F32::from_bits(saturated)),
            // One more on this side.
            false if magnitude > i64::MAX.unsigned_abs() => Self(I32F32::MIN),
            false => Self(I32F32::from_bits(-saturated)),
        }
    }
}

/// 2³² a / b, truncated, or the largest number if that is larger; `b` is not 0.
///
/// As one would on paper, in 64 bits: a microcontroller divides 128 bits by 128 in some two thousand instructions, and these in
/// two hundred.
fn quotient(a: u64, b: u64) -> u64 {
    const FRACTION: u32 = I32F32::FRAC_NBITS;
    let mut quotient = a / b;
    if quotient >> (u64::BITS - FRACTION) != 0 {
        return u64::MAX;
    }
    let mut rest = a % b;
    let mut missing = FRACTION;
    while missing > 0 {
        // As many digits as the rest has room for: it is smaller than b, which is 2⁶³ at most, so there is room for one.
        let digits = missing.min(b.leading_zeros().max(1));
        rest <<= digits;
        quotient = (quotient << digits) | (rest / b);
        rest %= b;
        missing -= digits;
    }
    quotient
}

impl Mul for Fixed16 {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        Self::narrow(self.widen() * other.widen())
    }
}

impl Div for Fixed16 {
    type Output = Self;
    /// Division of a positive or negative number by zero saturates with its sign; 0/0 is 0.
    #[inline]
    fn div(self, other: Self) -> Self {
        Self::narrow(self.widen() / other.widen())
    }
}

/// What the two fixed-point types have in common.
macro_rules! fixed_point {
    ($name:ident, $inner:ty) => {
        impl $name {
            /// The value with these bits, the lowest being the resolution.
            #[inline]
            pub const fn from_bits(bits: <$inner as fixed::traits::Fixed>::Bits) -> Self {
                Self(<$inner>::from_bits(bits))
            }
        }

        impl Debug for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                Debug::fmt(&self.0, f)
            }
        }

        impl Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                Display::fmt(&self.0, f)
            }
        }

        impl Add for $name {
            type Output = Self;
            #[inline]
            fn add(self, other: Self) -> Self {
                Self(self.0.saturating_add(other.0))
            }
        }

        impl Sub for $name {
            type Output = Self;
            #[inline]
            fn sub(self, other: Self) -> Self {
                Self(self.0.saturating_sub(other.0))
            }
        }

        impl Neg for $name {
            type Output = Self;
            #[inline]
            fn neg(self) -> Self {
                Self(self.0.saturating_neg())
            }
        }

        impl AddAssign for $name {
            #[inline]
            fn add_assign(&mut self, other: Self) {
                *self = *self + other;
            }
        }

        impl SubAssign for $name {
            #[inline]
            fn sub_assign(&mut self, other: Self) {
                *self = *self - other;
            }
        }

        impl MulAssign for $name {
            #[inline]
            fn mul_assign(&mut self, other: Self) {
                *self = *self * other;
            }
        }

        impl DivAssign for $name {
            #[inline]
            fn div_assign(&mut self, other: Self) {
                *self = *self / other;
            }
        }

        impl Zero for $name {
            #[inline]
            fn zero() -> Self {
                Self(<$inner>::ZERO)
            }
            #[inline]
            fn is_zero(&self) -> bool {
                self.0.is_zero()
            }
        }

        impl One for $name {
            #[inline]
            fn one() -> Self {
                Self(<$inner>::ONE)
            }
        }

        impl Scalar for $name {
            type Wide = FixedWide;
            const PRECISION: Precision = Precision::Fixed;
            const MAX: Self = Self(<$inner>::MAX);
            const SMALLEST: Self = Self(<$inner>::DELTA);

            #[inline]
            fn widen(self) -> FixedWide {
                FixedWide(I32F32::from_num(self.0))
            }

            #[inline]
            fn narrow(wide: FixedWide) -> Self {
                // Half of this type's resolution, so that the truncation below rounds to nearest;
                // 0 where the two types are one.
                const HALF: I32F32 = I32F32::from_bits((1 << (32 - <$inner>::FRAC_NBITS)) >> 1);
                Self(<$inner>::saturating_from_num(wide.0.saturating_add(HALF)))
            }

            #[inline]
            fn from_f64(value: f64) -> Self {
                // The saturating conversion of the crate panics on NaN; this one never does.
                Self(<$inner>::checked_from_num(value).unwrap_or(if value > 0.0 {
                    <$inner>::MAX
                } else if value < 0.0 {
                    <$inner>::MIN
                } else {
                    <$inner>::ZERO
                }))
            }

            #[inline]
            fn from_f32(value: f32) -> Self {
                // The saturating conversion of the crate panics on NaN; this one never does.
                Self(<$inner>::checked_from_num(value).unwrap_or(if value > 0.0 {
                    <$inner>::MAX
                } else if value < 0.0 {
                    <$inner>::MIN
                } else {
                    <$inner>::ZERO
                }))
            }

            #[inline]
            fn to_f64(self) -> f64 {
                self.0.to_num()
            }

            #[inline]
            fn to_f32(self) -> f32 {
                self.0.to_num()
            }

            #[inline]
            fn is_finite(self) -> bool {
                true
            }

            #[inline]
            fn abs(self) -> Self {
                Self(self.0.saturating_abs())
            }

            // Single precision: within 1.1e-7 of the truth, far below the state's resolution of
            // 1.5e-5, and without a floating-point unit several times cheaper than double.
            #[inline]
            fn tanh(self) -> Self {
                Self::from_f32(crate::tanh::tanh(self.to_f32()))
            }

            #[inline]
            fn sin(self) -> Self {
                Self::from_f64(libm::sin(self.to_f64()))
            }

            #[inline]
            fn exp(self) -> Self {
                Self::from_f64(libm::exp(self.to_f64()))
            }

            #[inline]
            fn sqrt(self) -> Self {
                Self::from_f64(libm::sqrt(self.to_f64()))
            }
        }
    };
}

fixed_point!(Fixed16, I16F16);
fixed_point!(FixedWide, I32F32);

#[cfg(test)]
mod tests {
    use rand_core::{Rng, SeedableRng};
    use rand_pcg::Pcg32;

    use super::*;

    #[test]
    fn products_and_quotients_are_those_of_128_bits() {
        let mut random = Pcg32::seed_from_u64(1);
        let ends = [i64::MIN, i64::MIN + 1, -1 << 32, -1, 1, 1 << 31, 1 << 32, 1 << 62, i64::MAX];
        // Of every magnitude, with all its bits at random.
        let mut any = || (random.next_u64() >> (random.next_u32() % 64)).cast_signed();
        let pairs = (0..1_000_000).map(|_| (any(), any())).collect::<std::vec::Vec<_>>();
        let corners = ends.into_iter().flat_map(|a| ends.map(|b| (a, b)));
        for (a, b) in pairs.into_iter().chain(corners).filter(|(_, b)| *b != 0) {
            let (a, b) = (I32F32::from_bits(a), I32F32::from_bits(b));
            assert_eq!((FixedWide(a) / FixedWide(b)).0, a.saturating_div(b), "{a} / {b}");
            assert_eq!((FixedWide(a) * FixedWide(b)).0, a.saturating_mul(b), "{a} * {b}");
        }
    }
}
