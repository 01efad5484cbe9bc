//! The drive of Experiment 1.1.

use firmware::brain::{Brain, Drive, Rule, Settings, Stimulus};
use firmware::scalar::{Fixed16, FixedWide, Scalar};
use nalgebra::Vector2;

fn sine(period: f64, phaseshift: f64, amplitude: f64) -> Drive<f64> {
    Drive { period, phaseshift, amplitude, noise: 0.0, color: 0.0 }
}

fn in_scalar<W: Scalar>(drive: &Drive<f64>) -> Drive<W> {
    Drive {
        period: W::from_f64(drive.period),
        phaseshift: W::from_f64(drive.phaseshift),
        amplitude: W::from_f64(drive.amplitude),
        noise: W::from_f64(drive.noise),
        color: W::from_f64(drive.color),
    }
}

/// The largest deviation from `amplitude · sin(2π k / period + i · phaseshift · π/2)` over the steps
/// from `skip` on.
fn deviation<W: Scalar>(drive: &Drive<f64>, skip: u64, steps: u64) -> f64 {
    let mut stimulus = Stimulus::<W, 3>::new(in_scalar(drive), 0).expect("in range");
    let mut worst = 0.0_f64;
    for k in 0..skip + steps {
        let y = stimulus.advance();
        if k < skip {
            continue;
        }
        for (i, y) in y.iter().enumerate() {
            let turn = (k as f64 / drive.period).fract() + i as f64 * drive.phaseshift / 4.0;
            let expected = drive.amplitude * (std::f64::consts::TAU * turn).sin();
            worst = worst.max((y.to_f64() - expected).abs());
        }
    }
    worst
}

#[test]
fn the_sine_is_the_formula_in_every_scalar() {
    for drive in [sine(100.0, 1.0, 0.5), sine(300.0, 1.0, 1.0), sine(37.5, -0.5, 0.7), sine(2.0, 3.25, 1.0)] {
        let worst = [
            deviation::<f64>(&drive, 0, 501),
            deviation::<f32>(&drive, 0, 501),
            deviation::<FixedWide>(&drive, 0, 501),
        ];
        println!("period {}: f64, f32, fixed: {worst:?}", drive.period);
        assert!(worst[0] < 1e-12, "f64: {worst:?}");
        assert!(worst[1] < 1e-6, "f32: {worst:?}");
        assert!(worst[2] < 1e-8, "fixed: {worst:?}");
    }
}

#[test]
fn after_ten_hours_the_phase_is_as_exact_as_at_the_start() {
    let ten_hours = 10 * 3600 * 50;
    for drive in [sine(300.0, 1.0, 1.0), sine(70.5, 1.0, 1.0)] {
        let worst = deviation::<f32>(&drive, ten_hours, 500);
        assert!(worst < 1e-6, "period {}: {worst:e}", drive.period);
    }
}

#[test]
fn a_new_period_goes_on_from_the_phase_reached() {
    let mut stimulus = Stimulus::<f64, 1>::new(sine(100.0, 0.0, 1.0), 0).expect("in range");
    let mut last = 0.0_f64;
    for k in 0..1000 {
        if k == 333 {
            stimulus.set_drive(sine(50.0, 0.0, 1.0)).expect("in range");
        }
        let y = stimulus.advance()[0];
        assert!((y - last).abs() < 0.13, "a jump at step {k}");
        last = y;
    }
}

/// Standard deviation, and the correlation over `lag` steps, of a long run of noise.
fn noise_statistics(strength: f64, color: f64, lag: usize) -> (f64, f64) {
    let drive = Drive { noise: strength, color, ..sine(100.0, 1.0, 0.0) };
    let mut stimulus = Stimulus::<f64, 1>::new(drive, 5).expect("in range");
    let run: Vec<f64> = (0..400_000).map(|_| stimulus.advance()[0]).collect();
    let mean_of = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / run.len() as f64;
    let variance = mean_of(&mut run.iter().map(|y| y * y));
    let covariance = mean_of(&mut run.iter().zip(&run[lag..]).map(|(a, b)| a * b));
    (variance.sqrt(), covariance / variance)
}

#[test]
fn the_noise_has_its_strength_and_its_correlation_time() {
    let (deviation, correlation) = noise_statistics(0.1, 20.0, 20);
    assert!((deviation / 0.1 - 1.0).abs() < 0.03, "{deviation}");
    assert!((correlation - (-1.0_f64).exp()).abs() < 0.03, "{correlation}");
    let (deviation, correlation) = noise_statistics(0.1, 0.0, 1);
    assert!((deviation / 0.1 - 1.0).abs() < 0.01, "{deviation}");
    assert!(correlation.abs() < 0.01, "white: {correlation}");
}

#[test]
fn the_seed_fixes_the_noise() {
    let drive = Drive { noise: 0.3, ..sine(100.0, 1.0, 0.5) };
    let run = |seed| {
        let mut stimulus = Stimulus::<f64, 2>::new(drive, seed).expect("in range");
        let first: Vec<_> = (0..50).map(|_| stimulus.advance()).collect();
        stimulus.restart(seed);
        let again: Vec<_> = (0..50).map(|_| stimulus.advance()).collect();
        assert_eq!(first, again);
        first
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1), run(2));
}

#[test]
fn the_motors_do_not_share_their_noise() {
    let drive = Drive { noise: 0.3, color: 0.0, ..sine(100.0, 0.0, 0.0) };
    let mut stimulus = Stimulus::<f64, 2>::new(drive, 1).expect("in range");
    let product: f64 = (0..20_000).map(|_| stimulus.advance()).map(|y| y[0] * y[1]).sum();
    assert!((product / 20_000.0 / 0.09).abs() < 0.03);
}

#[test]
fn sine_and_noise_add_and_the_sum_is_clipped() {
    let noisy = Drive { noise: 5.0, ..sine(100.0, 1.0, 1.0) };
    let mut stimulus = Stimulus::<f32, 2>::new(in_scalar(&noisy), 3).expect("in range");
    let run: Vec<_> = (0..1000).map(|_| stimulus.advance()).collect();
    assert!(run.iter().flatten().all(|y| y.abs() <= 1.0));
    assert!(run.iter().flatten().any(|y| *y == 1.0));
    assert!(run.iter().flatten().any(|y| *y == -1.0));
}

#[test]
fn a_drive_out_of_range_is_refused_by_name() {
    let good = sine(100.0, 1.0, 0.5);
    let mut stimulus = Stimulus::<f64, 2>::new(good, 0).expect("in range");
    type Spoil = fn(&mut Drive<f64>);
    let spoilt: [(&str, Spoil); 7] = [
        ("period", |d| d.period = 0.0),
        ("period", |d| d.period = f64::NAN),
        ("phaseshift", |d| d.phaseshift = f64::INFINITY),
        ("amplitude", |d| d.amplitude = 1.5),
        ("noise", |d| d.noise = -0.1),
        ("color", |d| d.color = f64::NAN),
        ("color", |d| d.color = -1.0),
    ];
    for (name, spoil) in spoilt {
        let mut drive = good;
        spoil(&mut drive);
        let refused = stimulus.set_drive(drive).expect_err("out of range");
        assert_eq!(refused.name, name);
        assert_eq!(stimulus.drive(), &good);
    }
}

#[test]
fn in_the_open_loop_the_motors_follow_the_drive_and_the_model_learns() {
    fn drives<S: Scalar>(tolerance: f64) {
        let settings = Settings { rule: Rule::OpenLoop, ..Settings::default() };
        let mut brain = Brain::<S, 2, 2>::new(settings).expect("in range");
        let (controller, model) = (*brain.controller(), *brain.model());
        for k in 0..200 {
            let x = Vector2::new(S::from_f64(0.25), S::from_f64(-0.75));
            let step = brain.step(&x).expect("finite");
            let angle = std::f64::consts::TAU * f64::from(k) / 100.0;
            assert!((step.y[0].to_f64() - 0.5 * angle.sin()).abs() < tolerance);
            assert!((step.y[1].to_f64() - 0.5 * angle.cos()).abs() < tolerance);
        }
        assert_eq!(&controller, brain.controller());
        assert_ne!(&model, brain.model());
    }
    drives::<f64>(1e-12);
    drives::<f32>(1e-6);
    drives::<Fixed16>(1e-5);
}
