//! The calibration of the inertial sensor against chips with biases, scales and mountings drawn at random.

use firmware::attitude::{ACCELEROMETER_LSB, GYROSCOPE_LSB, ImuCalibration, STANDARD_GRAVITY};
use firmware::calibration::{Calibrator, READINGS};
use nalgebra::{Matrix3, Rotation3, Vector3};
use proptest::prelude::*;
use protocol::message::{BodyAxis, CalibrationPhase, CalibrationProgress, CalibrationStep};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

const ATTITUDES: [(BodyAxis, [f32; 3]); 6] = [
    (BodyAxis::Slider1, [1.0, 0.0, 0.0]),
    (BodyAxis::Slider1Negative, [-1.0, 0.0, 0.0]),
    (BodyAxis::Cylinder, [0.0, 1.0, 0.0]),
    (BodyAxis::CylinderNegative, [0.0, -1.0, 0.0]),
    (BodyAxis::Slider2, [0.0, 0.0, 1.0]),
    (BodyAxis::Slider2Negative, [0.0, 0.0, -1.0]),
];

/// One chip on one board.
#[derive(Clone, Debug)]
struct Chip {
    /// m/s² and rad/s, chip axes.
    accelerometer_bias: Vector3<f32>,
    gyroscope_bias: Vector3<f32>,
    /// What its accelerometer's counts are to be multiplied with.
    scale: Vector3<f32>,
    /// Columns: chip axes in the body.
    mounting: Matrix3<f32>,
    /// Standard deviation, counts.
    noise: f32,
    random: Pcg32,
}

impl Chip {
    fn plain() -> Self {
        Chip {
            accelerometer_bias: Vector3::zeros(),
            gyroscope_bias: Vector3::zeros(),
            scale: Vector3::new(1.0, 1.0, 1.0),
            mounting: Matrix3::identity(),
            noise: 13.0,
            random: Pcg32::seed_from_u64(3),
        }
    }

    /// Close enough to normal: a sum of twelve.
    fn normal(&mut self) -> f32 {
        (0..12).map(|_| self.random.next_u32() as f32 / u32::MAX as f32).sum::<f32>() - 6.0
    }

    /// The registers for a specific force (m/s²) and an angular velocity (rad/s), body axes.
    fn read(&mut self, force: Vector3<f32>, rate: Vector3<f32>) -> ([i16; 3], [i16; 3]) {
        let seen = (self.mounting.transpose() * force).component_div(&self.scale) + self.accelerometer_bias;
        let turning = self.mounting.transpose() * rate + self.gyroscope_bias;
        let mut accelerometer = [0; 3];
        let mut gyroscope = [0; 3];
        for i in 0..3 {
            accelerometer[i] = (seen[i] / ACCELEROMETER_LSB + self.noise * self.normal()).round() as i16;
            gyroscope[i] = (turning[i] / GYROSCOPE_LSB + self.noise / 13.0 * self.normal()).round() as i16;
        }
        (accelerometer, gyroscope)
    }
}

/// Runs one step with the body resting so that `up` is up; returns what came out and when.
fn rest(
    calibrator: &mut Calibrator,
    chip: &mut Chip,
    step: CalibrationStep,
    up: Vector3<f32>,
    current: &mut ImuCalibration,
) -> Option<u16> {
    calibrator.begin(step);
    for reading in 1..=READINGS {
        assert_eq!(calibrator.progress().phase, CalibrationPhase::Averaging);
        let (accelerometer, gyroscope) = chip.read(up * STANDARD_GRAVITY, Vector3::zeros());
        if let Some(found) = calibrator.tick(accelerometer, gyroscope, current) {
            *current = found;
            return Some(reading);
        }
    }
    None
}

/// The six attitudes, each off by `tilt` (rad) in a direction of its own.
fn all_six(calibrator: &mut Calibrator, chip: &mut Chip, tilt: f32, current: &mut ImuCalibration) -> Option<u16> {
    let mut last = None;
    for (axis, up) in ATTITUDES {
        let aside = Vector3::new(chip.normal(), chip.normal(), chip.normal()).cross(&Vector3::from(up)).normalize();
        let up = Vector3::from(up) * tilt.cos() + aside * tilt.sin();
        last = rest(calibrator, chip, CalibrationStep::Up(axis), up, current);
    }
    last
}

fn chips() -> impl Strategy<Value = Chip> {
    let small = || prop::array::uniform3(-1.0..1.0f32).prop_map(Vector3::from);
    (small(), small(), small(), prop::array::uniform3(-3.1..3.1f32), any::<u64>()).prop_map(
        |(accelerometer, gyroscope, scale, angles, seed)| Chip {
            // Twice the data sheet's ±20 mg and ±0.5 °/s, and a scale that no part has.
            accelerometer_bias: accelerometer * 0.4,
            gyroscope_bias: gyroscope * 0.017,
            scale: scale.map(|s| 1.0 + 0.1 * s),
            mounting: Rotation3::from_euler_angles(angles[0], angles[1], angles[2]).into_inner(),
            noise: 13.0,
            random: Pcg32::seed_from_u64(seed),
        },
    )
}

fn known(attitudes: u8, phase: CalibrationPhase) -> CalibrationProgress {
    CalibrationProgress { phase, attitudes }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn any_right_handed_mounting_is_found_with_scale_and_bias(chip in chips()) {
        let mut chip = chip;
        let (mut calibrator, mut current) = (Calibrator::default(), ImuCalibration::default());
        prop_assert_eq!(all_six(&mut calibrator, &mut chip, 0.0, &mut current), Some(READINGS));
        prop_assert_eq!(calibrator.progress(), known(0b11_1111, CalibrationPhase::Applied));
        // Noise of 13 counts over 2000 readings: 0.3 counts, and a few times that in the worst of a thousand.
        let error = (current.accelerometer_bias - chip.accelerometer_bias).amax();
        prop_assert!(error < 3e-3, "bias is {error} m/s² off");
        prop_assert!((current.accelerometer_scale - chip.scale).amax() < 5e-4);
        prop_assert!((current.mounting - chip.mounting).amax() < 5e-4);
        let skew = current.mounting.tr_mul(&current.mounting) - Matrix3::identity();
        prop_assert!(skew.amax() < 1e-5 && current.mounting.determinant() > 0.0, "no rotation: {skew}");
        chip.noise = 0.0;
        for (_, up) in ATTITUDES {
            let gravity = Vector3::from(up) * STANDARD_GRAVITY;
            let (counts, _) = chip.read(gravity, Vector3::zeros());
            prop_assert!((current.specific_force(counts) - gravity).norm() < 0.01);
        }
    }

    #[test]
    fn a_careless_hand_leaves_no_more_than_its_own_error(chip in chips()) {
        let mut chip = chip;
        let (mut calibrator, mut current) = (Calibrator::default(), ImuCalibration::default());
        prop_assert!(all_six(&mut calibrator, &mut chip, 0.017, &mut current).is_some());
        let skew = current.mounting.tr_mul(&current.mounting) - Matrix3::identity();
        prop_assert!(skew.amax() < 1e-5, "no rotation: {skew}");
        let error = Rotation3::from_matrix_unchecked(current.mounting * chip.mounting.transpose()).angle();
        prop_assert!(error < 0.02, "attitudes 1° off make the mounting {error} rad off");
    }

    #[test]
    fn two_attitudes_that_were_swapped_are_inconsistent(chip in chips(), first in 0..6usize, second in 0..6usize) {
        prop_assume!(first != second);
        let mut chip = chip;
        let (mut calibrator, mut current) = (Calibrator::default(), ImuCalibration::default());
        let before = current;
        let mut ups = ATTITUDES.map(|(_, up)| Vector3::from(up));
        ups.swap(first, second);
        for ((axis, _), up) in ATTITUDES.into_iter().zip(ups) {
            rest(&mut calibrator, &mut chip, CalibrationStep::Up(axis), up, &mut current);
        }
        prop_assert_eq!(calibrator.progress(), known(0b11_1111, CalibrationPhase::Inconsistent));
        prop_assert_eq!(current, before);
        // Repeating the two sets it right.
        for i in [first, second] {
            let (axis, up) = ATTITUDES[i];
            rest(&mut calibrator, &mut chip, CalibrationStep::Up(axis), Vector3::from(up), &mut current);
        }
        prop_assert_eq!(calibrator.progress().phase, CalibrationPhase::Applied);
    }

    #[test]
    fn one_attitude_in_place_of_another_is_inconsistent(chip in chips(), wrong in 0..6usize, shown in 0..6usize) {
        prop_assume!(wrong != shown);
        let mut chip = chip;
        let (mut calibrator, mut current) = (Calibrator::default(), ImuCalibration::default());
        let mut ups = ATTITUDES.map(|(_, up)| Vector3::from(up));
        ups[wrong] = ups[shown];
        for ((axis, _), up) in ATTITUDES.into_iter().zip(ups) {
            rest(&mut calibrator, &mut chip, CalibrationStep::Up(axis), up, &mut current);
        }
        prop_assert_eq!(calibrator.progress().phase, CalibrationPhase::Inconsistent);
    }

    #[test]
    fn no_readings_break_it(
        readings in proptest::collection::vec(prop::array::uniform3(any::<i16>()), 6), noise in 0..100i16,
    ) {
        let (mut calibrator, current) = (Calibrator::default(), ImuCalibration::default());
        for ((axis, _), reading) in ATTITUDES.into_iter().zip(readings) {
            calibrator.begin(CalibrationStep::Up(axis));
            for k in 0..READINGS {
                let shaken = reading.map(|count| count.saturating_add(k as i16 % (noise + 1)));
                let found = calibrator.tick(shaken, [0; 3], &current);
                prop_assert!(found.is_none_or(|found| found.mounting.iter().all(|entry| entry.is_finite())));
            }
        }
    }
}

#[test]
fn a_body_at_rest_gives_the_gyroscopes_bias() {
    let mut chip = Chip { gyroscope_bias: Vector3::new(0.01, -0.02, 0.005), ..Chip::plain() };
    let mut calibrator = Calibrator::default();
    let old = ImuCalibration {
        gyroscope_bias: Vector3::new(1.0, 1.0, 1.0),
        accelerometer_bias: Vector3::new(0.1, 0.2, 0.3),
        position: Vector3::new(0.04, 0.1, -0.04),
        ..ImuCalibration::default()
    };
    let mut current = old;
    let taken = rest(&mut calibrator, &mut chip, CalibrationStep::Still, Vector3::x(), &mut current);
    assert_eq!(taken, Some(READINGS));
    assert_eq!(calibrator.progress(), known(0, CalibrationPhase::Applied));
    assert!((current.gyroscope_bias - chip.gyroscope_bias).amax() < 1e-4, "{}", current.gyroscope_bias);
    assert_eq!(ImuCalibration { gyroscope_bias: old.gyroscope_bias, ..current }, old, "nothing else changes");
}

#[test]
fn attitudes_are_counted_until_there_are_six() {
    let mut chip = Chip::plain();
    let (mut calibrator, mut current) = (Calibrator::default(), ImuCalibration::default());
    assert_eq!(calibrator.progress(), known(0, CalibrationPhase::Idle));
    for (i, (axis, up)) in ATTITUDES.into_iter().enumerate().rev() {
        let taken = rest(&mut calibrator, &mut chip, CalibrationStep::Up(axis), Vector3::from(up), &mut current);
        assert_eq!(taken.is_some(), i == 0);
        let phase = if i == 0 { CalibrationPhase::Applied } else { CalibrationPhase::Taken };
        assert_eq!(calibrator.progress(), known((0b11_1111 << i) & 0b11_1111, phase));
        let before = calibrator.progress();
        calibrator.begin(CalibrationStep::Status);
        assert_eq!(calibrator.progress(), before);
    }
    calibrator.begin(CalibrationStep::Restart);
    assert_eq!(calibrator.progress(), known(0, CalibrationPhase::Idle));
}

#[test]
fn nothing_is_averaged_unless_asked_for() {
    let mut chip = Chip::plain();
    let (mut calibrator, current) = (Calibrator::default(), ImuCalibration::default());
    for _ in 0..2 * READINGS {
        let (accelerometer, gyroscope) = chip.read(Vector3::z() * STANDARD_GRAVITY, Vector3::zeros());
        assert_eq!(calibrator.tick(accelerometer, gyroscope, &current), None);
    }
    assert_eq!(calibrator.progress(), known(0, CalibrationPhase::Idle));
}

#[test]
fn motion_is_noticed_and_takes_nothing() {
    type Motion = fn(f32) -> (Vector3<f32>, Vector3<f32>);
    let motions: [(&str, Motion); 5] = [
        ("a knock of 50 mg", |t| {
            (Vector3::z() * (STANDARD_GRAVITY + if t == 1.0 { 0.49 } else { 0.0 }), Vector3::zeros())
        }),
        ("a tilt by 1° in each second", |t| {
            let (sin, cos) = (0.01745 * t).sin_cos();
            (Vector3::new(sin, 0.0, cos) * STANDARD_GRAVITY, Vector3::y() * 0.01745)
        }),
        ("turning at 4 °/s about the vertical", |_| (Vector3::z() * STANDARD_GRAVITY, Vector3::z() * 0.07)),
        ("rocking at 3 °/s", |t| (Vector3::z() * STANDARD_GRAVITY, Vector3::y() * 0.052 * (20.0 * t).sin())),
        ("rolling", |t| {
            let (sin, cos) = (3.0 * t).sin_cos();
            (Vector3::new(sin, 0.0, cos) * STANDARD_GRAVITY, Vector3::y() * 3.0)
        }),
    ];
    for (name, motion) in motions {
        for step in [CalibrationStep::Still, CalibrationStep::Up(BodyAxis::Slider2)] {
            let mut chip = Chip::plain();
            let (mut calibrator, current) = (Calibrator::default(), ImuCalibration::default());
            calibrator.begin(step);
            for k in 0..READINGS {
                let (force, rate) = motion(f32::from(k) / 1000.0);
                let (accelerometer, gyroscope) = chip.read(force, rate);
                assert_eq!(calibrator.tick(accelerometer, gyroscope, &current), None, "{name}");
            }
            assert_eq!(calibrator.progress(), known(0, CalibrationPhase::Moved), "{name}");
        }
    }
}

#[test]
fn a_mirrored_chip_and_one_of_another_range_are_inconsistent() {
    let mirrored = Chip { mounting: Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0)), ..Chip::plain() };
    let coarse = Chip { scale: Vector3::new(2.0, 2.0, 2.0), ..Chip::plain() };
    let one_axis = Chip { scale: Vector3::new(1.0, 1.25, 1.0), ..Chip::plain() };
    for mut chip in [mirrored, coarse, one_axis] {
        let (mut calibrator, mut current) = (Calibrator::default(), ImuCalibration::default());
        assert_eq!(all_six(&mut calibrator, &mut chip, 0.0, &mut current), None);
        assert_eq!(calibrator.progress().phase, CalibrationPhase::Inconsistent);
        assert_eq!(current, ImuCalibration::default());
    }
}

#[test]
fn an_attitude_seven_degrees_off_is_inconsistent_and_one_three_degrees_off_is_not() {
    for (tilt, phase) in [(0.122, CalibrationPhase::Inconsistent), (0.052, CalibrationPhase::Applied)] {
        for wrong in 0..6 {
            let mut chip = Chip::plain();
            let (mut calibrator, mut current) = (Calibrator::default(), ImuCalibration::default());
            for (i, (axis, up)) in ATTITUDES.into_iter().enumerate() {
                let up = Vector3::from(up);
                let tilted = up + up.yzx() * f32::tan(if i == wrong { tilt } else { 0.0 });
                rest(&mut calibrator, &mut chip, CalibrationStep::Up(axis), tilted.normalize(), &mut current);
            }
            assert_eq!(calibrator.progress().phase, phase, "attitude {wrong} off by {tilt} rad");
        }
    }
}
