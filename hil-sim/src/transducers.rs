//! Sensors as physics sees them: what is true goes in, what an instrument of the named part says comes out. Each draws its
//! noise from a generator of its own, seeded, so that a run repeats bit by bit on any machine.

use core::f64::consts::TAU;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64;

/// Numbers for noise: a PCG stream, mapped to reals here so that no library's update changes a run.
#[derive(Clone, Debug)]
pub struct Noise(Pcg64);

impl Noise {
    /// The same seed gives the same numbers for ever.
    pub fn new(seed: u64) -> Self {
        Self(Pcg64::seed_from_u64(seed))
    }

    /// Uniform in [−1, 1), 53 bits.
    pub fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 52) as f64) - 1.0
    }

    /// Normal with mean 0 and variance 1 (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        let open = ((self.0.next_u64() >> 11) as f64 + 0.5) * (1.0 / (1_u64 << 53) as f64);
        let turn = (self.0.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64);
        (-2.0 * libm::log(open)).sqrt() * libm::cos(TAU * turn)
    }
}

/// The inclination sensors of the original: x plus coloured noise, n ← n + √τ·U(−1, 1)·strength − τ n per control step.
/// τ = 0.05 is the original's (standard deviation 0.41 of the strength in this law's own units), τ = 1 white.
#[derive(Clone, Debug)]
pub struct Inclination {
    /// Strength of the noise, in units of the inclination (±1); 0 switches it off.
    pub strength: f64,
    /// How much of the noise is forgotten per control step, 0…1.
    pub tau: f64,
    noise: Noise,
    now: [f64; 2],
}

impl Inclination {
    /// A pair of sensors; the noise starts at 0.
    pub fn new(strength: f64, tau: f64, seed: u64) -> Self {
        Self { strength, tau, noise: Noise::new(seed), now: [0.0; 2] }
    }

    /// The readings at a control step from the true inclinations. The stream advances whatever the strength is.
    pub fn read(&mut self, truth: [f64; 2]) -> [f64; 2] {
        for n in &mut self.now {
            *n += self.tau.sqrt() * self.noise.uniform() * self.strength - self.tau * *n;
        }
        [truth[0] + self.now[0], truth[1] + self.now[1]]
    }
}

/// ICM-42688-P at ±4 g and ±2000 °/s (data sheet DS-000347, tables 1 and 2): noise of its density times the root of the
/// bandwidth, a bias of its own, quantisation, saturation.
#[derive(Clone, Debug)]
pub struct Imu {
    noise: Noise,
    /// Standard deviation of accelerometer (m/s²) and gyroscope (rad/s) noise.
    accel_noise: f64,
    gyro_noise: f64,
    /// Bias of each axis, m/s² and rad/s.
    accel_bias: [f64; 3],
    gyro_bias: [f64; 3],
}

/// One reading, as the registers hold it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ImuReading {
    /// 8192 counts per g.
    pub accel: [i16; 3],
    /// 16.4 counts per °/s.
    pub gyro: [i16; 3],
}

impl Imu {
    /// Counts per m/s².
    pub const ACCEL_SCALE: f64 = 8192.0 / 9.806_65;
    /// Counts per rad/s.
    pub const GYRO_SCALE: f64 = 16.4 * 180.0 / core::f64::consts::PI;
    /// Noise density, 70 µg/√Hz, m/s²/√Hz.
    pub const ACCEL_DENSITY: f64 = 70e-6 * 9.806_65;
    /// Noise density, 2.8 m°/s/√Hz, rad/s/√Hz.
    pub const GYRO_DENSITY: f64 = 2.8e-3 * core::f64::consts::PI / 180.0;
    /// Typical offset of an uncalibrated part, ±20 mg, m/s².
    pub const ACCEL_OFFSET: f64 = 20e-3 * 9.806_65;
    /// Typical offset of an uncalibrated part, ±0.5 °/s, rad/s.
    pub const GYRO_OFFSET: f64 = 0.5 * core::f64::consts::PI / 180.0;

    /// One part out of many: `bandwidth` of its filter in Hz (half the data rate at most); the seed draws its biases,
    /// within the data sheet's offsets, and its noise.
    pub fn new(bandwidth: f64, seed: u64) -> Self {
        let mut noise = Noise::new(seed);
        let mut draw = |offset: f64| [0; 3].map(|_: i32| offset * noise.uniform());
        let (accel_bias, gyro_bias) = (draw(Self::ACCEL_OFFSET), draw(Self::GYRO_OFFSET));
        let root = bandwidth.max(0.0).sqrt();
        Self {
            noise,
            accel_noise: Self::ACCEL_DENSITY * root,
            gyro_noise: Self::GYRO_DENSITY * root,
            accel_bias,
            gyro_bias,
        }
    }

    /// The same part without noise and bias: quantisation and saturation only.
    pub fn ideal() -> Self {
        Self { accel_noise: 0.0, gyro_noise: 0.0, accel_bias: [0.0; 3], gyro_bias: [0.0; 3], noise: Noise::new(0) }
    }

    /// A reading from the specific force at the part (m/s²) and the angular velocity (rad/s), both in its own axes.
    pub fn read(&mut self, specific_force: [f64; 3], angular_velocity: [f64; 3]) -> ImuReading {
        let mut reading = ImuReading::default();
        for i in 0..3 {
            let a = specific_force[i] + self.accel_bias[i] + self.accel_noise * self.noise.normal();
            let w = angular_velocity[i] + self.gyro_bias[i] + self.gyro_noise * self.noise.normal();
            // A cast saturates, and makes 0 of NaN.
            reading.accel[i] = libm::round(a * Self::ACCEL_SCALE) as i16;
            reading.gyro[i] = libm::round(w * Self::GYRO_SCALE) as i16;
        }
        reading
    }
}

/// An incremental encoder on a slider axis, counting from the middle of the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Encoder {
    /// Resolution, counts/m.
    pub counts_per_metre: f64,
}

impl Encoder {
    /// Whole counts below the position (m).
    pub fn read(&self, position: f64) -> i32 {
        libm::floor(position * self.counts_per_metre) as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn deviation(values: &[f64]) -> (f64, f64) {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        (mean, (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n).sqrt())
    }

    #[test]
    fn inclination_noise_has_the_originals_spread_and_memory() {
        for (tau, spread, memory) in [(0.05, 0.413, 0.95), (1.0, 0.577, 0.0)] {
            let mut sensor = Inclination::new(1.0, tau, 7);
            let n: Vec<f64> = (0..200_000).map(|_| sensor.read([0.0, 0.0])[0]).collect();
            let (mean, sd) = deviation(&n);
            let product: Vec<f64> = n.windows(2).map(|w| w[0] * w[1]).collect();
            let correlation = (deviation(&product).0 - mean * mean) / (sd * sd);
            assert!(mean.abs() < 0.02, "mean {mean:.3}");
            assert!((sd - spread).abs() < 0.01, "tau {tau}: standard deviation {sd:.3}, expected {spread}");
            assert!((correlation - memory).abs() < 0.01, "tau {tau}: correlation {correlation:.3}, expected {memory}");
        }
    }

    #[test]
    fn one_seed_gives_one_stream_and_silence_is_exact() {
        let mut a = Inclination::new(0.1, 0.05, 3);
        let mut b = Inclination::new(0.1, 0.05, 3);
        let mut c = Inclination::new(0.0, 0.05, 3);
        for _ in 0..100 {
            assert_eq!(a.read([0.5, -0.5]), b.read([0.5, -0.5]));
            assert_eq!(c.read([0.5, -0.5]), [0.5, -0.5]);
        }
        // Pinned: a change of generator or mapping would silently change every run.
        let first = Noise::new(1).uniform();
        assert_eq!(first.to_bits(), PINNED, "the first number of seed 1 is {first} ({:#x})", first.to_bits());
    }

    const PINNED: u64 = 0x3fe5_c07d_7209_018a;

    #[test]
    fn the_imu_reads_gravity_turns_and_its_limits() {
        let mut imu = Imu::ideal();
        let reading = imu.read([0.0, 0.0, 9.806_65], [1.0, 0.0, -0.5]);
        assert_eq!((reading.accel, reading.gyro), ([0, 0, 8192], [940, 0, -470]));
        let reading = imu.read([1e3, -1e3, f64::NAN], [1e3, -1e3, 0.0]);
        assert_eq!((reading.accel, reading.gyro), ([i16::MAX, i16::MIN, 0], [i16::MAX, i16::MIN, 0]));
    }

    #[test]
    fn imu_noise_and_bias_are_those_of_the_data_sheet() {
        let mut imu = Imu::new(250.0, 11);
        let n = 20_000;
        let readings: Vec<ImuReading> = (0..n).map(|_| imu.read([0.0; 3], [0.0; 3])).collect();
        let axis = |pick: &dyn Fn(&ImuReading) -> i16| {
            deviation(&readings.iter().map(|r| f64::from(pick(r))).collect::<Vec<_>>())
        };
        let (bias, sd) = axis(&|r| r.accel[0]);
        // 70 µg·√250 = 1.1 mg = 9.07 counts; rounding adds 1/√12.
        assert!((sd - 9.07).abs() < 0.3 && bias.abs() <= 164.0, "accelerometer {bias:.1} ± {sd:.2} counts");
        let (bias, sd) = axis(&|r| r.gyro[0]);
        // 2.8 m°/s·√250 = 0.044 °/s = 0.73 counts, 0.78 with rounding.
        assert!((sd - 0.78).abs() < 0.05 && bias.abs() <= 8.7, "gyroscope {bias:.1} ± {sd:.2} counts");
    }

    #[test]
    fn the_encoder_counts_down_to_the_next_whole_count() {
        let encoder = Encoder { counts_per_metre: 6600.0 };
        assert_eq!([0.0, 1.0 / 6599.0, -1e-6, 0.06].map(|s| encoder.read(s)), [0, 1, -1, 396]);
        assert_eq!([1e9, -1e9].map(|s| encoder.read(s)), [i32::MAX, i32::MIN]);
    }
}
