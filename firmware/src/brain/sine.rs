//! The sine of a phase that is counted in 2⁻⁶⁴ of a turn.
//!
//! libm's sine in single precision works in double precision inside, which on a Cortex-M4F is software: two of them took more
//! than all the rest of a control step, and four kilobytes. A phase that is an integer is reduced exactly, and what is left
//! of it, an eighth of a turn at most, takes a short series in the scalar's own precision.

use crate::scalar::Scalar;

/// 1/n! with the signs of the sine's series, from n = 3 on, and of the cosine's, from n = 2 on. The first term left out is
/// below 2e-14 at an eighth of a turn.
const SINE: [f64; 6] =
    [-1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362_880.0, -1.0 / 39_916_800.0, 1.0 / 6_227_020_800.0];
const COSINE: [f64; 7] = [
    -1.0 / 2.0,
    1.0 / 24.0,
    -1.0 / 720.0,
    1.0 / 40_320.0,
    -1.0 / 3_628_800.0,
    1.0 / 479_001_600.0,
    -1.0 / 87_178_291_200.0,
];

/// sin(2π · phase / 2⁶⁴), within 2e-14 and a few roundings of the scalar.
pub fn sine<W: Scalar>(phase: u64) -> W {
    let quarters = phase.wrapping_add(1 << 61) >> 62;
    let rest = phase.wrapping_sub(quarters << 62).cast_signed();
    // ±2⁶¹, in two parts that single precision holds exactly.
    let (high, low) = ((rest >> 38) as f32, ((rest >> 14) & 0xFF_FFFF) as f32);
    let turns = W::from_f32(high / 67_108_864.0) + W::from_f32(low / 1_125_899_906_842_624.0);
    let angle = turns * W::from_f64(core::f64::consts::TAU);
    let square = angle * angle;
    let series = |terms: &[f64]| {
        let sum = terms.iter().rev().fold(W::zero(), |sum, term| sum * square + W::from_f64(*term));
        W::one() + square * sum
    };
    match quarters & 3 {
        0 => angle * series(&SINE),
        1 => series(&COSINE),
        2 => -(angle * series(&SINE)),
        _ => -series(&COSINE),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scalar::FixedWide;

    fn worst<W: Scalar>() -> f64 {
        // 10 000 phases all over the turn, and those around every eighth.
        let strides = (0..10_000u64).map(|k| k.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let eighths = (0..8u64).flat_map(|k| [u64::MAX, 0, 1].map(|by| (k << 61).wrapping_add(by)));
        strides
            .chain(eighths)
            .map(|phase| {
                let exact =
                    (core::f64::consts::TAU * (phase.cast_signed() as f64 / 18_446_744_073_709_551_616.0)).sin();
                (sine::<W>(phase).to_f64() - exact).abs()
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn it_is_the_sine_in_every_scalar() {
        let errors = [worst::<f64>(), worst::<f32>(), worst::<FixedWide>()];
        assert!(errors[0] < 1e-13 && errors[1] < 2e-7 && errors[2] < 3e-9, "{errors:?}");
    }
}
