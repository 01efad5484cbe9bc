//! What the brain does with numbers that no robot should send it: not finite, extreme, singular.

use firmware::brain::linear::solve;
use firmware::brain::rule::TimeLoop;
use firmware::brain::{Brain, Controller, Drive, Entry, Model, NonFinite, Refused, Rule, Settings};
use firmware::scalar::{Fixed16, FixedWide, Scalar};
use nalgebra::{Matrix2, SMatrix, SVector, Vector2};
use proptest::prelude::*;

const RULES: [Rule; 4] = [Rule::OpenLoop, Rule::Fixed, Rule::Homeostatic, Rule::Homeokinetic];

/// A brain that has moved a few steps, so that it has something to lose.
fn experienced<S: Scalar, const N: usize, const M: usize>(settings: Settings<S::Wide>) -> Brain<S, N, M> {
    let mut brain = Brain::new(settings).expect("in range");
    for k in 0..20_u8 {
        let x = SVector::from_fn(|i, _| S::from_f64((0.1 * f64::from(k) + i as f64).sin()));
        brain.step(&x).expect("finite");
    }
    brain
}

fn with_rule<W: Scalar>(rule: Rule) -> Settings<W> {
    Settings { rule, ..Settings::default() }
}

/// Everything that a step returned and left behind is finite, and the motors are in range.
fn assert_sound<S: Scalar, const N: usize, const M: usize>(
    brain: &mut Brain<S, N, M>,
    x: &SVector<S, N>,
) -> Result<(), NonFinite> {
    let before = brain.clone();
    match brain.step(x) {
        Ok(step) => {
            let one = S::one();
            assert!(step.y.iter().all(|y| *y >= -one && *y <= one), "{step:?}");
            assert!(step.xi.iter().all(|xi| xi.is_finite()), "{step:?}");
            assert!(step.error.is_finite() && step.time_loop_error.is_finite());
            assert!(brain.controller().is_finite(), "{:?}", brain.controller());
            assert!(brain.model().is_finite(), "{:?}", brain.model());
            Ok(())
        }
        Err(reason) => {
            assert_eq!(*brain, before, "a step that fails changes nothing");
            Err(reason)
        }
    }
}

#[test]
fn a_sensor_value_that_is_not_finite_is_reported_and_changes_nothing() {
    for rule in RULES {
        let mut brain = experienced::<f32, 3, 2>(with_rule(rule));
        for channel in 0..3 {
            for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let mut x = SVector::from([0.1, 0.2, 0.3]);
                x[channel] = bad;
                assert_eq!(assert_sound(&mut brain, &x), Err(NonFinite::Input));
            }
        }
        assert_eq!(assert_sound(&mut brain, &SVector::zeros()), Ok(()));
    }
}

#[test]
fn a_motor_value_that_is_undefined_is_reported() {
    let mut brain = experienced::<f32, 2, 2>(with_rule(Rule::Fixed));
    brain.set(Entry::C(1, 0), f32::MAX).expect("finite");
    brain.set(Entry::C(1, 1), -f32::MAX).expect("finite");
    let x = Vector2::new(10.0, 10.0);
    assert_eq!(assert_sound(&mut brain, &x), Err(NonFinite::Motor));
}

#[test]
fn a_model_that_overflows_is_reported() {
    let settings = Settings { eps_a: 1e30, clip_a: 0.0, ..with_rule(Rule::Fixed) };
    let mut brain = Brain::<f32, 2, 2>::new(settings).expect("in range");
    brain.step(&Vector2::new(0.5, 0.5)).expect("finite");
    let x = Vector2::new(1e30, 1e30);
    assert_eq!(assert_sound(&mut brain, &x), Err(NonFinite::Model));
}

#[test]
fn a_controller_that_overflows_is_reported() {
    for rule in [Rule::Homeostatic, Rule::Homeokinetic] {
        let settings = Settings {
            eps_a: 0.0,
            eps_c: 1e38,
            clip_c: 0.0,
            clip_h: 0.0,
            clip_zeta: 0.0,
            clip_v: 0.0,
            ..with_rule(rule)
        };
        let mut brain = Brain::<f32, 2, 2>::new(settings).expect("in range");
        brain.step(&Vector2::new(0.5, -0.5)).expect("finite");
        let x = Vector2::new(1e10, 1e10);
        assert_eq!(assert_sound(&mut brain, &x), Err(NonFinite::Controller));
    }
}

#[test]
fn a_prediction_error_whose_square_overflows_does_not_stop_the_brain() {
    let mut brain = experienced::<f32, 2, 2>(with_rule(Rule::Homeokinetic));
    let step = brain.step(&Vector2::new(1e30, 0.0)).expect("the clips hold");
    assert_eq!(step.error, f32::MAX);
}

#[test]
fn settings_that_are_not_finite_or_out_of_range_are_refused_by_name() {
    let mut brain = experienced::<f32, 2, 2>(Settings::default());
    let before = brain.clone();
    type Field = fn(&mut Settings<f32>) -> &mut f32;
    let fields: [(&str, Field); 14] = [
        ("eps_a", |s| &mut s.eps_a),
        ("eps_c", |s| &mut s.eps_c),
        ("lambda_a", |s| &mut s.lambda_a),
        ("lambda_b", |s| &mut s.lambda_b),
        ("lambda_c", |s| &mut s.lambda_c),
        ("lambda_h", |s| &mut s.lambda_h),
        ("clip_a", |s| &mut s.clip_a),
        ("clip_c", |s| &mut s.clip_c),
        ("clip_h", |s| &mut s.clip_h),
        ("clip_zeta", |s| &mut s.clip_zeta),
        ("clip_v", |s| &mut s.clip_v),
        ("ridge", |s| &mut s.ridge),
        ("gain_floor", |s| &mut s.gain_floor),
        ("pivot_floor", |s| &mut s.pivot_floor),
    ];
    for (name, field) in fields {
        for bad in [f32::NAN, f32::INFINITY, -0.1] {
            let mut settings = Settings::default();
            *field(&mut settings) = bad;
            let refused = brain.set_settings(settings).expect_err("out of range");
            assert_eq!(refused.name, name);
            assert_eq!(brain, before);
        }
    }
}

#[test]
fn entries_are_set_one_by_one_and_bad_ones_are_refused() {
    let mut brain = Brain::<f32, 3, 2>::default();
    for (k, entry) in [Entry::C(1, 2), Entry::H(1), Entry::A(2, 1), Entry::B(2)].into_iter().enumerate() {
        let value = k as f32 + 0.5;
        brain.set(entry, value).expect("it exists");
        assert_eq!(brain.get(entry), Some(value));
        assert_eq!(brain.set(entry, f32::NAN), Err(Refused::NotFinite(entry)));
        assert_eq!(brain.get(entry), Some(value));
    }
    assert_eq!(brain.controller().c[(1, 2)], 0.5);
    assert_eq!(brain.model().a[(2, 1)], 2.5);
    for entry in [
        Entry::C(2, 0),
        Entry::C(0, 3),
        Entry::H(2),
        Entry::A(3, 0),
        Entry::A(0, 2),
        Entry::B(3),
        Entry::C(usize::MAX, usize::MAX),
    ] {
        assert_eq!(brain.get(entry), None);
        assert_eq!(brain.set(entry, 1.0), Err(Refused::NoSuchEntry(entry)));
    }
    let mut controller = *brain.controller();
    controller.c[(1, 2)] = f32::INFINITY;
    let refused = Refused::NotFinite(Entry::C(1, 2));
    assert_eq!(brain.set_controller(controller), Err(refused));
    let mut model = *brain.model();
    model.b[1] = f32::NAN;
    let refused = Refused::NotFinite(Entry::B(1));
    assert_eq!(brain.set_model(model), Err(refused));
}

#[test]
fn the_first_step_and_the_step_after_forgetting_act_but_do_not_learn() {
    let mut brain = Brain::<f64, 2, 2>::default();
    let x = Vector2::new(0.4, -0.2);
    for _ in 0..2 {
        let before = brain.clone();
        let step = brain.step(&x).expect("finite");
        assert_eq!(step.xi, Vector2::zeros());
        assert_eq!((step.error, step.time_loop_error), (0.0, 0.0));
        assert_eq!(brain.model(), before.model());
        assert_eq!(brain.controller(), before.controller());
        let learned = brain.step(&Vector2::new(0.5, 0.1)).expect("finite");
        assert!(learned.error > 0.0 && learned.time_loop_error > 0.0);
        assert_ne!(brain.model(), before.model());
        brain.forget();
    }
}

#[test]
fn rate_and_decay_of_zero_freeze_what_they_belong_to() {
    let settings = Settings { eps_a: 0.0, eps_c: 0.0, lambda_a: 0.0, lambda_b: 0.0, ..Settings::default() };
    let brain = experienced::<f64, 2, 2>(settings);
    assert_eq!(*brain.model(), Model::default());
    assert_eq!(*brain.controller(), Controller::default());
}

#[test]
fn the_decay_acts_without_a_learning_rate_too() {
    let settings = Settings { eps_a: 0.0, eps_c: 0.0, lambda_a: 0.01, lambda_c: 0.01, ..Settings::default() };
    let brain = experienced::<f64, 2, 2>(settings);
    let left = brain.model().a[(0, 0)];
    assert!(left > 0.0 && left < 0.9, "A11 = {left}");
    let left = brain.controller().c[(0, 0)];
    assert!(left > 0.0 && left < 0.9, "C11 = {left}");
}

#[test]
fn every_change_is_clipped_entry_by_entry_decay_included() {
    let settings = Settings {
        eps_a: 10.0,
        eps_c: 10.0,
        lambda_a: 1.0,
        lambda_b: 1.0,
        lambda_c: 1.0,
        lambda_h: 1.0,
        clip_a: 0.01,
        clip_c: 0.02,
        clip_h: 0.03,
        ..Settings::default()
    };
    for rule in [Rule::Homeostatic, Rule::Homeokinetic] {
        let mut brain = Brain::<f64, 2, 2>::new(Settings { rule, ..settings }).expect("in range");
        let mut reached = [0.0_f64; 4];
        for k in 0..200_u8 {
            let (model, controller) = (*brain.model(), *brain.controller());
            let angle = f64::from(k);
            let x = Vector2::new(angle.sin(), angle.cos());
            brain.step(&x).expect("finite");
            let changes = [
                (brain.model().a - model.a).amax(),
                (brain.model().b - model.b).amax(),
                (brain.controller().c - controller.c).amax(),
                (brain.controller().h - controller.h).amax(),
            ];
            for (reached, change) in reached.iter_mut().zip(changes) {
                *reached = reached.max(change);
            }
        }
        for (reached, limit) in reached.iter().zip([0.01, 0.01, 0.02, 0.03]) {
            assert!((reached - limit).abs() < 1e-12, "{reached}, not {limit}");
        }
    }
}

#[test]
fn zeta_and_v_are_clipped_entry_by_entry() {
    let c = Matrix2::new(0.01, 0.0, 0.0, 1.0);
    let slope = Vector2::new(1e-9, 1.0);
    let xi = Vector2::new(-0.1, 0.2);
    let time_loop = TimeLoop::new(&c, &Matrix2::identity(), &slope, &xi, &Settings::default());
    assert!((time_loop.zeta - Vector2::new(-1.0, 0.2)).amax() < 1e-12);
    assert!((time_loop.v - Vector2::new(-1.0, 0.2)).amax() < 1e-7);
    assert!((time_loop.error() - 1.04).abs() < 1e-6);
    // μ follows from the clipped ζ, and is not clipped itself.
    assert!((time_loop.mu[0] / -1e4 - 1.0).abs() < 1e-3, "{}", time_loop.mu);
    let free = Settings { clip_zeta: 0.0, clip_v: 0.0, ..Settings::default() };
    let time_loop = TimeLoop::new(&c, &Matrix2::identity(), &slope, &xi, &free);
    assert!((time_loop.zeta[0] / -1e8 - 1.0).abs() < 1e-9, "a limit of 0 is none");
}

/// A body whose sensors repeat the motors, one step later, turned a little and shaken.
fn largest_coupling_after<S: Scalar>(c0: f64, steps: u32) -> f64 {
    let mut brain = Brain::<S, 2, 2>::new(Settings::default()).expect("in range");
    let c = Matrix2::identity().map(|c: f64| S::from_f64(c0 * c));
    brain.set_controller(Controller::new(c, Vector2::zeros())).expect("finite");
    let mut x = Vector2::new(S::from_f64(0.5), S::from_f64(-0.25));
    for k in 0..steps {
        let y = brain.step(&x).expect("finite").y.map(|y| y.to_f64());
        let shake = 0.1 * (f64::from(k) * 1.7).sin();
        x = Vector2::new(0.9 * y[0] - 0.3 * y[1] + shake, 0.3 * y[0] + 0.9 * y[1] - shake).map(S::from_f64);
    }
    brain.controller().c.iter().fold(0.0, |m, c| c.to_f64().abs().max(m))
}

#[test]
fn no_coupling_at_all_is_a_fixed_point_and_a_little_escapes() {
    fn check<S: Scalar>() {
        assert_eq!(largest_coupling_after::<S>(0.0, 2000), 0.0);
        let grown = largest_coupling_after::<S>(0.001, 2000);
        assert!(grown > 0.5, "|C| = {grown}");
    }
    check::<f64>();
    check::<f32>();
    check::<Fixed16>();
}

#[test]
fn singular_models_dead_controllers_and_saturated_neurons_give_finite_results() {
    fn check<S: Scalar>() {
        let number = S::from_f64;
        let zero = Matrix2::zeros();
        let rank_one = Matrix2::new(1.0, 2.0, 0.5, 1.0);
        let one = Matrix2::identity();
        for a in [zero, rank_one, one] {
            for c in [zero, rank_one, one] {
                for h in [0.0, 50.0, 1000.0] {
                    for clip in [1.0, 0.0] {
                        let settings = Settings {
                            clip_zeta: S::Wide::from_f64(clip),
                            clip_v: S::Wide::from_f64(clip),
                            ..with_rule(Rule::Homeokinetic)
                        };
                        let mut brain = Brain::<S, 2, 2>::new(settings).expect("in range");
                        let controller = Controller::new(c.map(number), Vector2::repeat(number(h)));
                        brain.set_controller(controller).expect("finite");
                        let model = Model::new(a.map(number), Vector2::zeros());
                        brain.set_model(model).expect("finite");
                        for k in 0..300_u16 {
                            let angle = 0.05 * f64::from(k);
                            let x = Vector2::new(angle.sin(), angle.cos()).map(number);
                            let result = assert_sound(&mut brain, &x);
                            // Without a clip the floors alone may let f32 overflow: then it says so.
                            assert!(result.is_ok() || clip == 0.0, "{result:?}");
                        }
                    }
                }
            }
        }
    }
    check::<f64>();
    check::<f32>();
    check::<Fixed16>();
}

#[test]
fn the_solution_is_exact_for_regular_systems_and_finite_for_singular_ones() {
    // The first pivot is zero: only pivoting solves this.
    let a = SMatrix::<f64, 3, 3>::new(0.0, 2.0, 1.0, 1.0, 1.0, 1.0, 4.0, -1.0, 3.0);
    let expected = SVector::from([1.0, -2.0, 3.0]);
    let found = solve(&a, &(a * expected), 0.0);
    assert!((found - expected).norm() < 1e-14, "{found}");

    let singular = Matrix2::new(1.0, 2.0, 2.0, 4.0);
    assert!(solve(&singular, &Vector2::new(1.0, 1.0), 1e-12).iter().all(|v| v.is_finite()));
    let zero = Matrix2::<FixedWide>::zeros();
    let one = Vector2::repeat(FixedWide::from_f64(1.0));
    assert_eq!(solve(&zero, &one, FixedWide::from_f64(0.0)), one.map(|_| FixedWide::MAX));
}

#[test]
fn fixed_point_saturates_and_never_panics() {
    let extremes = [i32::MIN, i32::MIN + 1, -65536, -1, 0, 1, 65536, i32::MAX].map(Fixed16::from_bits);
    let wide = [i64::MIN, -1, 0, 1, i64::MAX].map(FixedWide::from_bits);
    fn all<S: Scalar>(values: &[S]) {
        for &a in values {
            let _ = (a.abs(), -a, a.tanh(), a.sin(), a.exp(), a.sqrt(), a.widen(), a.to_f32());
            assert!(a.tanh() >= -S::one() && a.tanh() <= S::one());
            for &b in values {
                let _ = (a + b, a - b, a * b, a / b, a.clip(b), a.clamp_to(b, a));
            }
        }
    }
    all(&extremes);
    all(&wide);
    let number = Fixed16::from_f64;
    assert_eq!(number(1e9), Fixed16::MAX);
    assert_eq!(number(2.0) / number(0.0), Fixed16::MAX);
    assert_eq!(number(-2.0) / number(0.0), Fixed16::from_bits(i32::MIN));
    assert_eq!(number(f64::NAN), number(0.0));
    assert_eq!(Fixed16::try_from_f64(f64::NAN), None);
    assert_eq!(f32::try_from_f64(1e300), None);
    assert_eq!(Fixed16::narrow(FixedWide::from_f64(0.75 / 65536.0)), Fixed16::from_bits(1));
    assert_eq!(Fixed16::narrow(FixedWide::from_f64(-0.75 / 65536.0)), Fixed16::from_bits(-1));
}

/// Any finite number, the extremes and the smallest as likely as those near 1.
fn any_finite() -> impl Strategy<Value = f64> {
    use proptest::num::{f32, f64};
    prop_oneof![
        4 => -2.0..2.0,
        1 => (f32::NORMAL | f32::SUBNORMAL | f32::ZERO).prop_map(std::primitive::f64::from),
        1 => f64::NORMAL | f64::SUBNORMAL | f64::ZERO,
        1 => prop_oneof![Just(1e38), Just(-1e38), Just(f64::from(std::primitive::f32::MAX)), Just(1e-45), Just(-0.0)],
    ]
}

/// Sensor values: half of the runs stay within what a robot feels, so that long runs are covered.
fn inputs() -> impl Strategy<Value = Vec<f64>> {
    prop_oneof![prop::collection::vec(-1.5..1.5, 900), prop::collection::vec(any_finite(), 900),]
}

/// Settings over their documented ranges: rates and limits from nothing to far beyond sense.
fn settings() -> impl Strategy<Value = Settings<f64>> {
    let rate = || prop_oneof![Just(0.0), 0.0..1.0, 0.0..100.0];
    let decay = || prop_oneof![Just(0.0), 0.0..0.01, 0.0..=1.0];
    let clip = || prop_oneof![Just(0.0), 0.0..1.0, 0.0..1e6];
    let floor = || prop_oneof![Just(0.0), Just(1e-12), 0.0..1.0];
    (
        0..4_u8,
        (rate(), rate()),
        (decay(), decay(), decay(), decay()),
        (clip(), clip(), clip(), clip(), clip()),
        (floor(), floor(), floor()),
    )
        .prop_map(|(rule, eps, lambda, clip, floor)| Settings {
            rule: Rule::from_number(rule).expect("below 4"),
            eps_a: eps.0,
            eps_c: eps.1,
            lambda_a: lambda.0,
            lambda_b: lambda.1,
            lambda_c: lambda.2,
            lambda_h: lambda.3,
            clip_a: clip.0,
            clip_c: clip.1,
            clip_h: clip.2,
            clip_zeta: clip.3,
            clip_v: clip.4,
            ridge: floor.0,
            gain_floor: floor.1,
            pivot_floor: floor.2,
        })
}

fn settings_in<W: Scalar>(s: &Settings<f64>) -> Settings<W> {
    let number = W::from_f64;
    Settings {
        rule: s.rule,
        eps_a: number(s.eps_a),
        eps_c: number(s.eps_c),
        lambda_a: number(s.lambda_a),
        lambda_b: number(s.lambda_b),
        lambda_c: number(s.lambda_c),
        lambda_h: number(s.lambda_h),
        clip_a: number(s.clip_a),
        clip_c: number(s.clip_c),
        clip_h: number(s.clip_h),
        clip_zeta: number(s.clip_zeta),
        clip_v: number(s.clip_v),
        ridge: number(s.ridge),
        gain_floor: number(s.gain_floor),
        pivot_floor: number(s.pivot_floor),
    }
}

/// Runs a brain from any finite state over any finite input; each step is sound or refused.
fn survives<S: Scalar, const N: usize, const M: usize>(settings: &Settings<f64>, state: &[f64], inputs: &[f64]) {
    // What is beyond the scalar's range becomes its largest number of that sign.
    let number = |value: f64| S::try_from_f64(value).unwrap_or(if value < 0.0 { -S::MAX } else { S::MAX });
    let mut brain = Brain::<S, N, M>::new(settings_in(settings)).expect("in range");
    let drive = Drive { noise: S::Wide::from_f64(0.5), ..Drive::default() };
    brain.stimulus_mut().set_drive(drive).expect("in range");
    let mut numbers = state.iter().cycle().map(|v| number(*v));
    let mut next = || numbers.next().expect("endless");
    let controller = Controller::new(SMatrix::from_fn(|_, _| next()), SVector::from_fn(|_, _| next()));
    brain.set_controller(controller).expect("finite");
    let model = Model::new(SMatrix::from_fn(|_, _| next()), SVector::from_fn(|_, _| next()));
    brain.set_model(model).expect("finite");
    for x in inputs.chunks_exact(N) {
        let _ = assert_sound(&mut brain, &SVector::from_fn(|i, _| number(x[i])));
    }
}

fn survives_in_every_scalar<const N: usize, const M: usize>(settings: &Settings<f64>, state: &[f64], inputs: &[f64]) {
    survives::<f32, N, M>(settings, state, inputs);
    survives::<f64, N, M>(settings, state, inputs);
    survives::<Fixed16, N, M>(settings, state, inputs);
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 256,
        // A failure prints the values that show it; they belong in a test of their own.
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn any_finite_input_in_any_state_leaves_the_brain_sound(
        settings in settings(),
        state in prop::collection::vec(any_finite(), 12),
        inputs in inputs(),
    ) {
        survives_in_every_scalar::<2, 2>(&settings, &state, &inputs);
    }

    #[test]
    fn any_finite_input_leaves_a_brain_of_another_shape_sound(
        settings in settings(),
        state in prop::collection::vec(any_finite(), 29),
        inputs in inputs(),
    ) {
        survives_in_every_scalar::<1, 1>(&settings, &state, &inputs);
        survives_in_every_scalar::<3, 2>(&settings, &state, &inputs);
        survives_in_every_scalar::<2, 3>(&settings, &state, &inputs);
        survives_in_every_scalar::<4, 2>(&settings, &state, &inputs);
    }

    /// The task's own claim: with the default precautions nothing within a sensor's range, for any
    /// rates, ever stops the brain.
    #[test]
    fn with_the_default_clips_no_sensor_value_stops_the_brain(
        rule in 0..4_u8,
        eps in (0.0..1.0, 0.0..1.0),
        start in prop::collection::vec(-5.0..5.0, 12),
        inputs in prop::collection::vec(-1.0..1.0, 900),
    ) {
        fn check<S: Scalar>(settings: &Settings<f64>, start: &[f64], inputs: &[f64]) {
            let mut brain = Brain::<S, 2, 2>::new(settings_in(settings)).expect("in range");
            let n = |k: usize| S::from_f64(start[k]);
            let c = Matrix2::new(n(0), n(1), n(2), n(3));
            brain.set_controller(Controller::new(c, Vector2::new(n(4), n(5)))).expect("finite");
            let a = Matrix2::new(n(6), n(7), n(8), n(9));
            brain.set_model(Model::new(a, Vector2::new(n(10), n(11)))).expect("finite");
            for x in inputs.chunks_exact(2) {
                let x = Vector2::new(S::from_f64(x[0]), S::from_f64(x[1]));
                assert_eq!(assert_sound(&mut brain, &x), Ok(()));
            }
        }
        let rule = Rule::from_number(rule).expect("below 4");
        let settings = Settings { eps_a: eps.0, eps_c: eps.1, ..with_rule(rule) };
        check::<f32>(&settings, &start, &inputs);
        check::<f64>(&settings, &start, &inputs);
        check::<Fixed16>(&settings, &start, &inputs);
    }
}
