//! What the attitude estimator still gets wrong, measured on a cylinder whose motion is known in closed form and on an
//! ICM-42688-P as its datasheet describes it: 70 µg/√Hz and 2.8 mdps/√Hz (500 Hz of bandwidth at 1 kHz), ±20 mg and
//! ±0.5 °/s of bias, 16 bits at ±4 g and ±2000 °/s. `cargo test -p firmware --test attitude -- --nocapture` prints the
//! whole table.

use firmware::attitude::{
    Attitude, AttitudeSettings, GYROSCOPE_LSB, ImpossibleSensor, ImuCalibration, ImuMonitor, ImuPatience, ImuSample,
    NotFinite, STANDARD_GRAVITY,
};
use nalgebra::{Matrix3, Rotation3, Vector3};
use proptest::prelude::*;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

const DT: f64 = 1e-3;
const G: f64 = 9.80665;
const RADIUS: f64 = 0.12;
/// Where the chip sits, m: as on the table-top body, well off the middle.
const POSITION: [f64; 3] = [0.040, 0.105, -0.038];

/// Angle, rate and angular acceleration about the cylinder axis at a time.
type Motion = fn(f64) -> [f64; 3];

/// The sweeps of homeokinetic control, on the table top: up to ±8 rad/s, a reversal every 10 s, and a ripple of 1.3 Hz
/// as the weights pass; accelerations up to 13 rad/s².
fn sweeping(t: f64) -> [f64; 3] {
    let w = std::f64::consts::PI / 10.0;
    let r = std::f64::consts::TAU * 1.3;
    let (a, b, c) = (7.6, 1.4, 1.0);
    [
        -a / w * (w * t).cos() - b / (3.0 * w) * (3.0 * w * t).cos() - c / r * (r * t).cos(),
        a * (w * t).sin() + b * (3.0 * w * t).sin() + c * (r * t).sin(),
        a * w * (w * t).cos() + 3.0 * b * w * (3.0 * w * t).cos() + c * r * (r * t).cos(),
    ]
}

/// Rocking in a trough, 1.2 rad at 0.7 Hz: the acceleration of the centre goes with the angle, the worst case for an
/// accelerometer that takes it for gravity.
fn rocking(t: f64) -> [f64; 3] {
    let w = std::f64::consts::TAU * 0.7;
    [0.4 + 1.2 * (w * t).sin(), 1.2 * w * (w * t).cos(), -1.2 * w * w * (w * t).sin()]
}

/// Even rolling at 4 rad/s.
fn even(t: f64) -> [f64; 3] {
    [0.3 + 4.0 * t, 4.0, 0.0]
}

/// The chip: its noise, and its biases in units of the largest that the datasheet allows.
struct Chip {
    random: Pcg64Mcg,
    noisy: bool,
    accelerometer_bias: Vector3<f64>,
    gyroscope_bias: Vector3<f64>,
}

impl Chip {
    fn new(seed: u64, bias: f64) -> Chip {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let mut sign = || if random.next_u32() & 1 == 0 { 1.0 } else { -1.0 };
        let accelerometer_bias = Vector3::new(sign(), sign(), sign()) * (bias * 0.020 * G);
        let gyroscope_bias = Vector3::new(sign(), sign(), sign()) * (bias * 0.5f64.to_radians());
        Chip { random, noisy: true, accelerometer_bias, gyroscope_bias }
    }

    fn gauss(&mut self) -> f64 {
        let uniform = |n: u32| (f64::from(n) + 0.5) / 4_294_967_296.0;
        let (u, v) = (uniform(self.random.next_u32()), uniform(self.random.next_u32()));
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }

    fn counts(&mut self, force: Vector3<f64>, rate: Vector3<f64>) -> ([i16; 3], [i16; 3]) {
        let bandwidth = 500f64.sqrt();
        let scale = if self.noisy { 1.0 } else { 0.0 };
        let (force_noise, rate_noise) = (scale * 70e-6 * G * bandwidth, scale * 2.8e-3f64.to_radians() * bandwidth);
        let (a, b) = (force + self.accelerometer_bias, rate + self.gyroscope_bias);
        let mut count = |value: f64, noise: f64, lsb: f64| {
            ((value + noise * self.gauss()) / lsb).round().clamp(-32768.0, 32767.0) as i16
        };
        (
            [0, 1, 2].map(|i| count(a[i], force_noise, G / 8192.0)),
            [0, 1, 2].map(|i| count(b[i], rate_noise, 1f64.to_radians() / 16.4)),
        )
    }
}

/// Up, angular velocity and specific force in body axes of a cylinder rolling without slip; written down in the world
/// (X along the ground, Y the cylinder axis, Z up) and turned into the body, unlike what the estimator does.
fn rolling(motion: Motion, t: f64) -> (Vector3<f64>, Vector3<f64>, Vector3<f64>) {
    let [phi, rate, acceleration] = motion(t);
    let body_to_world = Rotation3::from_axis_angle(&Vector3::y_axis(), phi);
    let r = body_to_world * Vector3::from(POSITION);
    let (omega, alpha) = (Vector3::y() * rate, Vector3::y() * acceleration);
    let centre = Vector3::x() * (RADIUS * acceleration);
    let chip = centre + alpha.cross(&r) + omega.cross(&omega.cross(&r));
    let force = chip + Vector3::z() * G;
    let world_to_body = body_to_world.inverse();
    (world_to_body * Vector3::z(), world_to_body * omega, world_to_body * force)
}

/// Error of the inclination (the larger of the two, as a vertical component: radians near the middle), after `from` s.
#[derive(Clone, Copy, Debug)]
struct Remaining {
    rms: f64,
    max: f64,
}

fn position() -> Vector3<f32> {
    Vector3::from(POSITION).cast()
}

/// The error between `from` and `to` s, over five chips.
fn remaining(motion: Motion, settings: AttitudeSettings, r: Vector3<f32>, bias: f64, from: f64, to: f64) -> Remaining {
    let (mut sum, mut n, mut max) = (0.0, 0.0, 0.0f64);
    for seed in 0..5 {
        let mut chip = Chip::new(seed, bias);
        let mut monitor = ImuMonitor::new(ImuPatience::default());
        let mut attitude = Attitude::new(settings, r);
        for tick in 0..(to / DT) as u32 {
            let t = f64::from(tick) * DT;
            let (up, rate, force) = rolling(motion, t);
            let (accelerometer, gyroscope) = chip.counts(force, rate);
            let sample = monitor
                .read(accelerometer, gyroscope, &ImuCalibration::default())
                .expect("a true reading")
                .expect("no jump");
            attitude.update(&sample, DT as f32).expect("finite");
            if t >= from {
                let x = attitude.inclination();
                let error = (f64::from(x[0]) - up.x).hypot(f64::from(x[1]) - up.z);
                sum += error * error;
                n += 1.0;
                max = max.max(error);
            }
        }
    }
    Remaining { rms: (sum / n).sqrt(), max }
}

/// The same filter, fed with the accelerometer as it is.
fn uncompensated(settings: AttitudeSettings) -> AttitudeSettings {
    AttitudeSettings { radius: 0.0, ..settings }
}

fn ungated(settings: AttitudeSettings) -> AttitudeSettings {
    AttitudeSettings { rate_gate: 1e6, magnitude_gate: 1e6, ..settings }
}

/// A place and a radius that are wrong by what a ruler allows: 5 mm in each direction, and 5 %.
fn misplaced() -> (AttitudeSettings, Vector3<f32>) {
    let settings = AttitudeSettings { radius: 1.05 * RADIUS as f32, ..AttitudeSettings::default() };
    (settings, position() + Vector3::new(0.005, -0.005, 0.005))
}

#[test]
fn what_rolling_adds_to_gravity_is_taken_off() {
    let settings = AttitudeSettings::default();
    println!("remaining error of the inclination, mrad, rms / max over 20-60 s and 5 chips");
    println!("{:44} {:>13} {:>13} {:>13} {:>13}", "", "compensated", "5 mm, 5 % off", "not comp.", "nor gated");
    // With a perfectly calibrated chip and with every bias at its largest: bounds on rms and max, mrad.
    for (name, motion, bias, rms, max, gain) in [
        ("sweeps to 8 rad/s, no bias", sweeping as Motion, 0.0, 1.0, 3.0, 20.0),
        ("sweeps to 8 rad/s, 20 mg and 0.5 deg/s", sweeping, 1.0, 8.0, 20.0, 3.0),
        ("rocking by 1.2 rad at 0.7 Hz, no bias", rocking, 0.0, 1.5, 3.0, 10.0),
        ("rocking, 20 mg and 0.5 deg/s", rocking, 1.0, 18.0, 28.0, 1.5),
        ("even rolling at 4 rad/s, no bias", even, 0.0, 0.5, 1.0, 10.0),
        ("even rolling, 20 mg and 0.5 deg/s", even, 1.0, 4.0, 6.0, 2.0),
    ] {
        let with = remaining(motion, settings, position(), bias, 20.0, 60.0);
        let (off_settings, off_position) = misplaced();
        let off = remaining(motion, off_settings, off_position, bias, 20.0, 60.0);
        let without = remaining(motion, uncompensated(settings), Vector3::zeros(), bias, 20.0, 60.0);
        let raw = remaining(motion, ungated(uncompensated(settings)), Vector3::zeros(), bias, 20.0, 60.0);
        let show = |r: Remaining| format!("{:.1} / {:.1}", 1e3 * r.rms, 1e3 * r.max);
        println!("{name:44} {:>13} {:>13} {:>13} {:>13}", show(with), show(off), show(without), show(raw));
        assert!(1e3 * with.rms < rms && 1e3 * with.max < max, "{name}: {with:?}");
        assert!(off.rms < without.rms, "{name}: a ruler's error {off:?} is worse than none at all {without:?}");
        assert!(without.rms > gain * with.rms, "{name}: {with:?} against {without:?} without compensation");
    }
}

/// Readings of a body at rest (or spinning about the vertical) with this `up`, for `seconds`; the last estimate.
fn at_rest(up: Vector3<f64>, rate: Vector3<f64>, chip: &mut Chip, seconds: f64) -> (Attitude, f64) {
    let mut monitor = ImuMonitor::new(ImuPatience::default());
    let mut attitude = Attitude::new(AttitudeSettings::default(), position());
    let force = up * G + rate.cross(&rate.cross(&Vector3::from(POSITION)));
    let mut worst = 0.0f64;
    for tick in 0..(seconds / DT) as u32 {
        let (accelerometer, gyroscope) = chip.counts(force, rate);
        let sample = monitor
            .read(accelerometer, gyroscope, &ImuCalibration::default())
            .expect("a true reading")
            .expect("no jump");
        attitude.update(&sample, DT as f32).expect("finite");
        if f64::from(tick) * DT > 1.0 {
            worst = worst.max((attitude.up().cast::<f64>() - up).norm());
        }
    }
    (attitude, worst)
}

#[test]
fn at_rest_the_error_is_the_accelerometers_bias_and_no_more() {
    for lean in [0.0f64, 0.3, 0.8, std::f64::consts::FRAC_PI_2] {
        for roll in [0.0f64, 1.0, 2.5, 4.0] {
            // Lean: of the cylinder axis out of the horizontal; a quarter turn is upright.
            let up = Vector3::new(-roll.sin() * lean.cos(), lean.sin(), roll.cos() * lean.cos());
            let (_, worst) = at_rest(up, Vector3::zeros(), &mut Chip::new(7, 0.0), 20.0);
            assert!(worst < 2e-3, "lean {lean}, roll {roll}: {worst} without bias");
            let (_, worst) = at_rest(up, Vector3::zeros(), &mut Chip::new(7, 1.0), 20.0);
            assert!(worst < 45e-3, "lean {lean}, roll {roll}: {worst} with 20 mg on each axis");
        }
    }
}

#[test]
fn an_upright_barrel_that_spins_stays_upright() {
    let (attitude, worst) = at_rest(Vector3::y(), Vector3::y() * -15.0, &mut Chip::new(3, 0.0), 20.0);
    println!("upright at -15 rad/s: {:.2} mrad", 1e3 * worst);
    assert!(worst < 0.01, "{worst} at -15 rad/s");
    assert!(attitude.inclination().iter().all(|x| x.abs() < 0.01));
}

#[test]
fn the_gyroscopes_bias_is_found_while_the_barrel_sweeps() {
    let mut chip = Chip::new(11, 1.0);
    chip.accelerometer_bias = Vector3::zeros();
    let mut attitude = Attitude::new(AttitudeSettings::default(), position());
    for tick in 0..60_000 {
        let (_, rate, force) = rolling(sweeping, f64::from(tick) * DT);
        let (accelerometer, gyroscope) = chip.counts(force, rate);
        let calibration = ImuCalibration::default();
        let sample = ImuSample {
            angular_velocity: calibration.angular_velocity(gyroscope),
            specific_force: Some(calibration.specific_force(accelerometer)),
        };
        attitude.update(&sample, DT as f32).expect("finite");
    }
    let left = (f64::from(attitude.bias().y) - chip.gyroscope_bias.y).abs().to_degrees();
    println!("bias about the cylinder axis: {left:.4} deg/s left of 0.5");
    assert!(left < 0.02, "{left} deg/s of 0.5 are left");
}

#[test]
fn a_start_in_the_middle_of_a_jerk_is_forgotten_in_a_second() {
    // At t = 0 the sweep accelerates by 12 rad/s², which tilts the first sample by 0.15 rad.
    for (to, bound) in [(1.0, 0.2), (2.0, 0.02), (20.0, 0.01)] {
        let from = if to > 2.0 { 2.0 } else { to - 1.0 };
        let error = remaining(sweeping, AttitudeSettings::default(), position(), 0.0, from, to);
        println!("started in a jerk, {from}-{to} s: rms {:.1} max {:.1} mrad", 1e3 * error.rms, 1e3 * error.max);
        assert!(error.max < bound, "{from}-{to} s: {error:?}");
    }
}

#[test]
fn a_knock_to_full_scale_is_ridden_out_on_the_gyroscope() {
    let mut chip = Chip::new(5, 0.0);
    let mut monitor = ImuMonitor::new(ImuPatience::default());
    let mut attitude = Attitude::new(AttitudeSettings::default(), position());
    for tick in 0..20_000 {
        let (up, rate, force) = rolling(sweeping, f64::from(tick) * DT);
        let (mut accelerometer, gyroscope) = chip.counts(force, rate);
        if tick % 500 < 5 && tick > 1000 {
            accelerometer[2] = i16::MAX;
        }
        let sample = monitor
            .read(accelerometer, gyroscope, &ImuCalibration::default())
            .expect("a knock, not a fault")
            .expect("no jump");
        attitude.update(&sample, DT as f32).expect("finite");
        if tick > 2000 {
            assert!((attitude.up().cast::<f64>() - up).norm() < 0.02, "tick {tick}");
        }
    }
}

#[test]
fn a_gyroscope_that_a_bus_got_wrong_is_not_believed_and_one_that_stays_there_is() {
    let calibration = ImuCalibration::default();
    let mut monitor = ImuMonitor::new(ImuPatience::default());
    let mut read = |rate: i16, k: i16| monitor.read([k, 0, 8192], [rate, 0, 0], &calibration);
    for k in 0..100 {
        assert!(read(300 + k, k).expect("good").is_some());
        // Every bit by itself: those that matter less than a knock does are believed.
        let bit = k % 16;
        let wrong = read((300 + k) ^ (1i16.wrapping_shl(bit as u32)), k);
        assert_eq!(wrong.expect("no fault").is_none(), bit > 13, "bit {bit}");
    }
    assert_eq!(read(32_767, 0), Ok(None));
    assert_eq!([1, 2, 3].map(|k| read(9000, k).expect("good").is_some()), [false, false, true]);
    assert!(read(9001, 4).expect("good").is_some());
    let ends = (0..4).map(|k| read(i16::MAX, k)).collect::<Vec<_>>();
    assert_eq!(ends[..3], [Ok(None); 3]);
    assert_eq!(ends[3], Err(ImpossibleSensor::Saturated));
}

#[test]
fn impossible_readings_are_found() {
    use ImpossibleSensor::*;
    let calibration = ImuCalibration::default();
    let still = ([0, 0, 8192], [0; 3]);
    let fresh = || ImuMonitor::new(ImuPatience::default());
    for (accelerometer, gyroscope, reason) in [
        ([i16::MIN; 3], [0; 3], NotReady),
        ([0, 0, 8192], [i16::MIN; 3], NotReady),
        ([0; 3], [0; 3], BusLow),
        ([-1; 3], [-1; 3], BusHigh),
        ([0, 0, 8192], [0, 32_767, 0], Saturated),
        ([0, 0, 8192], [0, i16::MIN, 0], Saturated),
    ] {
        assert_eq!(fresh().read(accelerometer, gyroscope, &calibration), Err(reason), "in the first tick");
    }
    // Each of these has to last: how many ticks it takes, and that one good reading ends it.
    let ticks = |read: &dyn Fn(i16) -> ([i16; 3], [i16; 3])| {
        let mut monitor = fresh();
        for tick in 0..2000u32 {
            let (accelerometer, gyroscope) = read((tick % 2) as i16);
            if let Err(reason) = monitor.read(accelerometer, gyroscope, &calibration) {
                assert!(monitor.read([17, 5, 8190], [1, 2, 3], &calibration).is_ok());
                return Some((tick, reason));
            }
        }
        None
    };
    assert_eq!(ticks(&|_| still), Some((51, Stuck)));
    assert_eq!(ticks(&|k| ([0, i16::MAX, k], [k; 3])), Some((20, Saturated)));
    assert_eq!(ticks(&|k| ([k, 300, 5], [k; 3])), Some((500, NoGravity)));
    assert_eq!(ticks(&|k| ([k, 30_000, 5], [k; 3])), Some((500, NoGravity)));
    assert_eq!(ticks(&|k| ([k, 8192, 5], [k; 3])), None);
}

#[test]
fn counts_become_units_through_the_calibration() {
    // A chip turned by a quarter about Z: its x is the body's y.
    let calibration = ImuCalibration {
        mounting: Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0),
        accelerometer_bias: Vector3::new(0.1, 0.0, 0.0),
        gyroscope_scale: Vector3::new(1.0, 1.0, 2.0),
        ..ImuCalibration::default()
    };
    let force = calibration.specific_force([8192, 0, 0]);
    assert!((force - Vector3::new(0.0, STANDARD_GRAVITY - 0.1, 0.0)).norm() < 1e-6);
    let rate = calibration.angular_velocity([0, 16, 164]);
    assert!((rate - Vector3::new(-16.0 * GYROSCOPE_LSB, 0.0, 20f32.to_radians())).norm() < 1e-6);
}

#[test]
fn turning_by_the_gyroscope_alone_is_exact() {
    // A constant rate about a skew axis at the chip's full scale, no accelerometer: a turn of the exact angle.
    let mut attitude = Attitude::new(AttitudeSettings::default(), Vector3::zeros());
    let rate = Vector3::new(20.0f32, -15.0, 10.0);
    let start = Vector3::new(0.6f32, 0.0, 0.8);
    let first = ImuSample { angular_velocity: rate, specific_force: Some(start * STANDARD_GRAVITY) };
    attitude.update(&first, 1e-3).expect("finite");
    let blind = ImuSample { angular_velocity: rate, specific_force: None };
    for _ in 0..1000 {
        attitude.update(&blind, 1e-3).expect("finite");
    }
    let turn = Rotation3::new(-rate.cast::<f64>());
    let error = (attitude.up().cast::<f64>() - turn * start.cast::<f64>()).norm();
    println!("27 rad at 27 rad/s: {error:.1e} rad off");
    assert!(error < 1e-4, "{error} after 27 rad");
}

#[test]
fn numbers_that_are_not_finite_are_refused_and_change_nothing() {
    let mut attitude = Attitude::new(AttitudeSettings::default(), position());
    let good = ImuSample { angular_velocity: Vector3::zeros(), specific_force: Some(Vector3::new(0.0, 0.0, 9.8)) };
    attitude.update(&good, 1e-3).expect("finite");
    let bad = |f: &dyn Fn(&mut ImuSample)| {
        let mut sample = good;
        f(&mut sample);
        sample
    };
    for sample in [
        bad(&|s| s.angular_velocity.y = f32::NAN),
        bad(&|s| s.angular_velocity.x = f32::INFINITY),
        bad(&|s| s.specific_force = Some(Vector3::new(f32::NAN, 0.0, 1.0))),
    ] {
        assert_eq!(attitude.update(&sample, 1e-3), Err(NotFinite));
    }
    for dt in [0.0, -1e-3, 1.0, f32::NAN, f32::INFINITY] {
        assert_eq!(attitude.update(&good, dt), Err(NotFinite));
    }
    assert_eq!(attitude.up(), Vector3::z());
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn up_is_always_a_unit_vector(
        samples in prop::collection::vec((prop::array::uniform6(prop::num::f32::ANY), 0.0..0.03f32), 1..30),
        extreme in prop::array::uniform6(prop::num::f32::ANY),
    ) {
        let wild = AttitudeSettings {
            radius: extreme[0], gravity: extreme[1], magnitude_gate: extreme[2], start_up: extreme[3],
            bias_limit: extreme[4], derivative_time: extreme[5], ..AttitudeSettings::default()
        };
        for settings in [AttitudeSettings::default(), wild] {
            let mut attitude = Attitude::new(settings, position());
            for (v, dt) in &samples {
                let sample = ImuSample {
                    angular_velocity: Vector3::new(v[0], v[1], v[2]),
                    specific_force: Some(Vector3::new(v[3], v[4], v[5])),
                };
                let _ = attitude.update(&sample, *dt);
                prop_assert!((attitude.up().norm() - 1.0).abs() < 0.06, "{:?}", attitude.up());
                prop_assert!(attitude.inclination().iter().all(|x| x.is_finite()));
            }
        }
    }

    #[test]
    fn any_counts_are_read_or_refused(
        counts in prop::collection::vec(prop::array::uniform6(any::<i16>()), 1..100),
    ) {
        let mut monitor = ImuMonitor::new(ImuPatience::default());
        let mut attitude = Attitude::new(AttitudeSettings::default(), position());
        for c in counts {
            if let Ok(Some(sample)) = monitor.read([c[0], c[1], c[2]], [c[3], c[4], c[5]], &ImuCalibration::default()) {
                prop_assert_eq!(attitude.update(&sample, 1e-3), Ok(()));
            }
        }
    }
}
