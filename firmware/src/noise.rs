//! Noise on the inclinations of a robot that senses them itself.
//!
//! The barrel's rest can only be left if something disturbs it, and a good inertial sensor on a table does not. The
//! original's sensors carry noise of their own, which the `chapter` body simulates; a real body gets the same law here, n
//! for each inclination and control step, u uniform in −1…1:
//!
//! ```text
//! n ← n + √τ · u · strength − τ n
//! ```

use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

use crate::scalar::Scalar;

/// Two channels of noise, with the generator that drives them.
#[derive(Clone, Debug)]
pub struct InclinationNoise {
    /// √τ · strength.
    amplitude: f32,
    tau: f32,
    now: [f32; 2],
    random: Pcg32,
}

impl Default for InclinationNoise {
    /// None, seed 0.
    fn default() -> Self {
        InclinationNoise { amplitude: 0.0, tau: 1.0, now: [0.0; 2], random: Pcg32::seed_from_u64(0) }
    }
}

impl InclinationNoise {
    /// Changes the law: `strength` in units of the inclination, `tau` the part forgotten per step, 0…1.
    pub fn set(&mut self, strength: f32, tau: f32) {
        (self.amplitude, self.tau) = (libm::sqrtf(tau.at_least(0.0)) * strength, tau);
    }

    /// Starts again, without noise, from a seed.
    pub fn restart(&mut self, seed: u64) {
        self.now = [0.0; 2];
        self.random = Pcg32::seed_from_u64(seed);
    }

    /// One control step: the inclinations with noise.
    pub fn add(&mut self, x: [f32; 2]) -> [f32; 2] {
        for n in &mut self.now {
            // 24 bits, which f32 holds exactly.
            let u = (self.random.next_u32() >> 8) as f32 * (2.0 / 16_777_216.0) - 1.0;
            *n += u * self.amplitude - self.tau * *n;
        }
        [x[0] + self.now[0], x[1] + self.now[1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn its_spread_is_that_of_the_law() {
        for (tau, expected) in [(0.05_f32, 0.413), (1.0, 0.577)] {
            let mut noise = InclinationNoise::default();
            noise.set(1.0, tau);
            noise.restart(3);
            let square: f32 = (0..100_000).map(|_| noise.add([0.0; 2])[0].powi(2)).sum();
            let deviation = (square / 100_000.0).sqrt();
            assert!((deviation - expected).abs() < 0.02, "tau {tau}: {deviation}");
        }
    }
}
