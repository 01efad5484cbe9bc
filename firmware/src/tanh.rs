//! The hyperbolic tangent in single precision: half of what a control step computes.
//!
//! libm's takes three times the instructions. As there, everything is plain software arithmetic in a fixed order, so an x86 host
//! and a Cortex-M4F compute the same bits.
//!
//! Near 0 it is an odd polynomial. Elsewhere tanh z = (1 − e)/(1 + e) with e = exp(−2|z|) = 2ⁿ · exp(r), |r| ≤ ln 2 / 2; from
//! e = ½ on, 1 − e loses nothing to cancellation. The coefficients are those of the smallest largest relative error, 4e-10 and
//! 2e-9, found by Lawson's iteration and rounded to single precision.

/// Where the polynomial ends: ln 2 / 2.
const NEAR: f32 = 0.346_573_6;
/// From here on the nearest number is 1.
const FAR: f32 = 9.02;

/// tanh z = z (1 + z² P(z²)) near 0; from the highest power down.
const TANH: [f32; 4] = [0.019_387_988, -0.053_712_17, 0.133_322_4, -0.333_333_16];
/// exp r = 1 + r (1 + r P(r)); from the highest power down.
const EXP: [f32; 5] = [0.001_384_356, 0.008_374_236, 0.041_668_01, 0.166_664_3, 0.499_999_94];

/// ln 2 in two parts, the first one with so few digits that its product with n is exact.
const LN_2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];
/// Added to a small number, it leaves the nearest whole one in the lowest bits.
const ROUND: f32 = 12_582_912.0;
/// Place of the exponent in a number.
const EXPONENT: u32 = 23;

/// tanh z, within 1.1e-7 and 2.5 units in the last place; odd, never beyond ±1, NaN for NaN.
pub fn tanh(z: f32) -> f32 {
    let polynomial = |terms: &[f32], x: f32| terms.iter().fold(0.0, |sum, term| sum * x + term);
    let distance = z.abs();
    if distance < NEAR {
        let square = z * z;
        return z + z * (square * polynomial(&TANH, square));
    }
    if distance > FAR {
        return if z > 0.0 { 1.0 } else { -1.0 };
    }
    let exponent = -2.0 * distance;
    let rounded = exponent * core::f32::consts::LOG2_E + ROUND;
    let n = rounded - ROUND;
    let r = exponent - n * LN_2[0] - n * LN_2[1];
    let power = f32::from_bits((rounded.to_bits() << EXPONENT).wrapping_add(1.0f32.to_bits()));
    let e = power + power * (r + r * (r * polynomial(&EXP, r)));
    let tanh = (1.0 - e) / (1.0 + e);
    if z > 0.0 { tanh } else { -tanh }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of every magnitude that matters, and finely where the function bends.
    fn arguments() -> impl Iterator<Item = f32> {
        let fine = (0..2_000_000).map(|k| k as f32 * 5e-6);
        let tiny = (0..400).map(|k| 2f32.powf(-0.3 * k as f32));
        let seams = [NEAR, FAR, 20.0, 1e30, f32::MAX].into_iter().flat_map(|x| [x.next_down(), x, x.next_up()]);
        fine.chain(tiny).chain(seams)
    }

    #[test]
    fn it_is_the_hyperbolic_tangent() {
        for z in arguments() {
            let (found, exact) = (f64::from(tanh(z)), f64::from(z).tanh());
            let unit = f64::from((exact as f32).next_up() - exact as f32).max(f64::from(f32::from_bits(1)));
            let error = (found - exact).abs();
            assert!(error <= 1.1e-7 && error <= 2.5 * unit, "tanh {z} = {exact}, not {found}: {} units", error / unit);
        }
    }

    #[test]
    fn it_is_odd_monotonic_and_never_beyond_one() {
        let mut before = 0.0;
        for z in (0..2_000_000).map(|k| k as f32 * 5e-6) {
            let y = tanh(z);
            assert!(y >= before && y <= 1.0, "at {z}: {y} after {before}");
            assert_eq!(tanh(-z), -y);
            before = y;
        }
        assert_eq!((tanh(f32::INFINITY), tanh(f32::NEG_INFINITY)), (1.0, -1.0));
        assert!(tanh(f32::NAN).is_nan());
    }
}
