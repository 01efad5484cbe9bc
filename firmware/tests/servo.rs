//! The servo against closed forms: the second-order step, the filter's transfer function, and what its limits promise.

use std::f64::consts::TAU;

use firmware::servo::{Axis, Drive, Servo, ServoError, ServoSettings, Stall, setpoint};
use proptest::prelude::*;
use protocol::message::FaultCode;
use protocol::parameter::Values;

const DT: f32 = 1e-3;

fn settings() -> ServoSettings {
    let defaults = Values::defaults(|value| value as f32);
    ServoSettings { derivative_on_measurement: true, ..ServoSettings::from_parameters(|id| defaults.get(id)) }
}

fn axis() -> Axis {
    Axis {
        metres_per_count: 1e-5,
        travel: 0.39,
        stop_play: 0.02,
        fastest: 1000.0,
        stall_force: 250.0,
        free_speed: 5.0,
        back_emf: 0.0,
        duty_limit: 1.0,
        stall: Stall { duty: 0.5, movement: 1e-3, ticks: 200 },
    }
}

/// A weight of 1 kg without friction under the servo, `dt` small against its period: positions over time.
fn step_response(settings: ServoSettings, axis: Axis, target: f32, dt: f32, seconds: f32) -> Vec<(f32, Drive)> {
    let mut servo = Servo::new(settings, axis);
    let (mut position, mut velocity) = (0.0f64, 0.0f64);
    let steps = (seconds / dt) as usize;
    (0..steps)
        .map(|_| {
            let drive = servo.update(target, position as f32, dt).expect("a sound axis");
            velocity += f64::from(drive.force) * f64::from(dt);
            position += velocity * f64::from(dt);
            (position as f32, drive)
        })
        .collect()
}

#[test]
fn a_step_is_followed_as_the_closed_form_says() {
    // 1 kg under F = KP (e − KD ṡ): ω₀ = √KP, ζ = KD √KP / 2.
    let settings = ServoSettings { ki: 0.0, derivative_time: 0.0, ..settings() };
    let (target, dt) = (0.1, 1e-4);
    let w0 = f64::from(settings.kp).sqrt();
    let zeta = f64::from(settings.kd) * w0 / 2.0;
    let wd = w0 * (1.0 - zeta * zeta).sqrt();
    let mut worst = 0.0f64;
    for (k, (position, _)) in step_response(settings, axis(), target, dt, 1.0).into_iter().enumerate() {
        let t = (k + 1) as f64 * f64::from(dt);
        let decay = (-zeta * w0 * t).exp();
        let exact = f64::from(target) * (1.0 - decay * ((wd * t).cos() + zeta * w0 / wd * (wd * t).sin()));
        worst = worst.max((f64::from(position) - exact).abs());
    }
    println!("step: {:.2} % of the step off the closed form at most", 100.0 * worst / f64::from(target));
    assert!(worst < 0.005 * f64::from(target), "{worst} m of {target}");
}

#[test]
fn the_integral_removes_a_constant_load() {
    let settings = ServoSettings { ki: 5.0, derivative_time: 0.0, ..settings() };
    let mut servo = Servo::new(settings, axis());
    let (mut position, mut velocity) = (0.0f32, 0.0f32);
    for _ in 0..5000 {
        let force = servo.update(0.1, position, DT).expect("sound").force - 9.81;
        velocity += force * DT;
        position += velocity * DT;
    }
    assert!((position - 0.1).abs() < 1e-4, "{position} m with a weight of 1 kg hanging on it");
}

#[test]
fn a_blocked_weight_does_not_wind_the_integral_up() {
    // Ten seconds of pushing at the force limit; then the set point jumps to the other side.
    let settings = ServoSettings { ki: 5.0, max_force: 5.0, ..settings() };
    let patient = Axis { stall: Stall { ticks: u32::MAX, ..axis().stall }, ..axis() };
    let mut servo = Servo::new(settings, patient);
    for _ in 0..10_000 {
        let drive = servo.update(0.3, 0.0, DT).expect("sound");
        assert_eq!((drive.force, drive.limited), (5.0, true));
    }
    let mut fresh = Servo::new(settings, patient);
    let (wound, unwound) = (servo.update(-0.01, 0.0, DT), fresh.update(-0.01, 0.0, DT));
    assert_eq!(wound, unwound, "ten seconds at the limit have left a trace");
    assert!(wound.expect("sound").force < 0.0);
}

#[test]
fn nor_does_a_limit_on_the_duty() {
    let weak = Axis { duty_limit: 0.02, stall: Stall { ticks: u32::MAX, ..axis().stall }, ..axis() };
    let settings = ServoSettings { ki: 5.0, ..settings() };
    let mut servo = Servo::new(settings, weak);
    for _ in 0..10_000 {
        assert_eq!(servo.update(0.3, 0.0, DT).expect("sound").duty, 0.02);
    }
    let mut fresh = Servo::new(settings, weak);
    assert_eq!(servo.update(-0.01, 0.0, DT), fresh.update(-0.01, 0.0, DT));
}

#[test]
fn the_overshoot_after_a_long_saturation_is_that_of_a_servo_without_integral() {
    let limits = ServoSettings { max_force: 2.0, ..settings() };
    let overshoot = |ki: f32| {
        let path = step_response(ServoSettings { ki, ..limits }, Axis { travel: 2.0, ..axis() }, 0.3, DT, 5.0);
        path.iter().map(|(position, _)| position - 0.3).fold(f32::MIN, f32::max)
    };
    let (without, with) = (overshoot(0.0), overshoot(0.5));
    println!("overshoot of 0.3 m at 2 N: {:.1} mm without integral, {:.1} mm with", 1e3 * without, 1e3 * with);
    assert!(with < without + 0.01, "{with} m against {without} m");
}

#[test]
fn a_set_point_step_does_not_kick_when_the_derivative_is_the_positions() {
    let settings = ServoSettings { ki: 0.0, ..settings() };
    let mut servo = Servo::new(settings, axis());
    servo.update(0.0, 0.0, DT).expect("sound");
    let drive = servo.update(0.2, 0.0, DT).expect("sound");
    assert_eq!(drive.force, settings.kp * 0.2);
}

#[test]
fn a_set_point_step_kicks_as_far_as_its_filter_lets_it_when_the_derivative_is_the_errors() {
    let settings = ServoSettings { ki: 0.0, derivative_on_measurement: false, max_force: 1e4, ..settings() };
    let strong = Axis { stall_force: 1e4, ..axis() };
    let mut servo = Servo::new(settings, strong);
    servo.update(0.0, 0.0, DT).expect("sound");
    // The whole kick, KD · Δ, comes out of the filter sooner or later: its area is independent of the tick.
    let mut area = 0.0f64;
    for tick in 0..200 {
        let drive = servo.update(0.05, 0.0, DT).expect("sound");
        if tick == 0 {
            let first = settings.kp * (0.05 + settings.kd * 0.05 / (settings.derivative_time + DT));
            assert!((drive.force - first).abs() < 1e-3, "{} N against {first} N", drive.force);
        }
        area += f64::from(drive.force - settings.kp * 0.05) * f64::from(DT);
    }
    let whole = f64::from(settings.kp * settings.kd * 0.05);
    assert!((area - whole).abs() < 1e-3 * whole, "{area} N s of {whole}");
}

/// Gain and phase of the derivative term at a frequency, against KD s / (τ s + 1) sampled with backward differences.
fn derivative_at(hertz: f64) -> (f64, f64) {
    let settings = ServoSettings { kp: 1.0, ki: 0.0, kd: 1.0, derivative_limit: 1e6, max_force: 1e6, ..settings() };
    let mut servo = Servo::new(settings, Axis { stall_force: 1e7, ..axis() });
    let (amplitude, periods) = (0.01, 40);
    let ticks = (f64::from(periods) / hertz / f64::from(DT)).round() as usize;
    let settled = ticks / 2;
    let (mut re, mut im) = (0.0, 0.0);
    for k in 0..ticks {
        let phase = TAU * hertz * k as f64 * f64::from(DT);
        let position = (amplitude * phase.sin()) as f32;
        let force = servo.update(0.0, position, DT).expect("sound").force;
        if k >= settled {
            let derivative = -f64::from(force) - f64::from(position);
            re += derivative * phase.sin();
            im += derivative * phase.cos();
        }
    }
    let scale = 2.0 / (amplitude * (ticks - settled) as f64);
    ((re * scale).hypot(im * scale), im.atan2(re))
}

#[test]
fn the_derivatives_filter_is_first_order() {
    let (tau, dt) = (f64::from(settings().derivative_time), f64::from(DT));
    let corner = 1.0 / (TAU * tau);
    for hertz in [corner / 4.0, corner, 5.0 * corner] {
        let (gain, phase) = derivative_at(hertz);
        // (1 − z⁻¹)/dt · a / (1 − (1 − a) z⁻¹), a = dt / (τ + dt), at z = exp(iω dt)
        let (w, a) = (TAU * hertz, dt / (tau + dt));
        let (c, s) = ((w * dt).cos(), (w * dt).sin());
        let (n_re, n_im) = (a * (1.0 - c) / dt, a * s / dt);
        let (d_re, d_im) = (1.0 - (1.0 - a) * c, (1.0 - a) * s);
        let exact = (n_re.hypot(n_im) / d_re.hypot(d_im), n_im.atan2(n_re) - d_im.atan2(d_re));
        let analogue = (w / (1.0 + (w * tau).powi(2)).sqrt(), TAU / 4.0 - (w * tau).atan());
        println!("{hertz:6.1} Hz: {gain:7.2} /s {phase:.3} rad; exact {exact:.3?}, continuous {analogue:.3?}");
        assert!((gain / exact.0 - 1.0).abs() < 0.01 && (phase - exact.1).abs() < 0.01, "{hertz} Hz");
        assert!((gain / analogue.0 - 1.0).abs() < 0.12, "{hertz} Hz: {gain} against {}", analogue.0);
    }
}

#[test]
fn a_reset_leaves_no_bump() {
    let settings = ServoSettings { derivative_on_measurement: false, ..settings() };
    let patient = Axis { stall: Stall { ticks: u32::MAX, ..axis().stall }, ..axis() };
    let mut servo = Servo::new(settings, patient);
    for k in 0..500 {
        servo.update(0.3 * (k % 2) as f32, 0.1, DT).expect("sound");
    }
    servo.reset();
    // From wherever the weight is: KP e and the first tick of the integral.
    let drive = servo.update(0.25, -0.3, DT).expect("sound");
    let first = settings.kp * (0.55 + settings.ki * 0.55 * DT);
    assert!((drive.force - first).abs() < 1e-3, "{} N against {first} N", drive.force);
}

#[test]
fn new_gains_leave_the_force_of_the_integral_as_it_is() {
    let slow = ServoSettings { kd: 0.0, ki: 2.0, ..settings() };
    let mut servo = Servo::new(slow, axis());
    for _ in 0..1000 {
        servo.update(0.02, 0.0, DT).expect("sound");
    }
    let held = servo.update(0.0, 0.0, DT).expect("sound").force;
    servo.retune(ServoSettings { kp: 50.0, ..slow });
    let kept = servo.update(0.0, 0.0, DT).expect("sound").force;
    assert!(held > 5.0 && (held - kept).abs() < 1e-3 * held, "{held} N, then {kept} N");
}

#[test]
fn set_points_have_the_chapters_sign_and_stay_in_the_travel() {
    assert_eq!(setpoint(1.0, 0.3), -0.3);
    assert_eq!(setpoint(-0.5, 0.3), 0.15);
    assert_eq!(setpoint(-7.0, 0.3), 0.3);
    assert!(setpoint(f32::NAN, 0.3).is_nan());
    let settings = ServoSettings { ki: 0.0, ..settings() };
    let mut servo = Servo::new(settings, axis());
    let drive = servo.update(5.0, 0.38, DT).expect("sound");
    assert!((drive.force - settings.kp * 0.01).abs() < 1e-3, "{} N towards 0.39 m", drive.force);
}

#[test]
fn nothing_pushes_outwards_at_the_end_of_the_travel() {
    // Thrown back from the stop fast enough for the derivative to push against it.
    let settings = ServoSettings { ki: 0.0, ..settings() };
    let mut servo = Servo::new(settings, axis());
    servo.update(0.39, 0.405, DT).expect("sound");
    let drive = servo.update(0.39, 0.395, DT).expect("sound");
    assert_eq!(drive, Drive { force: 0.0, duty: 0.0, limited: true });
    let inwards = servo.update(0.0, 0.395, DT).expect("sound");
    assert!(inwards.force < 0.0);
}

#[test]
fn the_duty_makes_up_for_the_motors_back_emf() {
    // F = stall_force (duty − v / free_speed): with back_emf = 1 the motor gives the force asked for at any speed.
    let settings = ServoSettings { ki: 0.0, kd: 0.0, ..settings() };
    let axis = Axis { back_emf: 1.0, ..axis() };
    let mut servo = Servo::new(settings, axis);
    let speed = 1.0;
    let mut drive = servo.update(0.1, -0.15, DT).expect("sound");
    for k in 1..200 {
        drive = servo.update(0.1, -0.15 + speed * DT * k as f32, DT).expect("sound");
    }
    let force = axis.stall_force * (drive.duty - speed / axis.free_speed);
    assert!((servo.velocity() - speed).abs() < 1e-3);
    assert!((force - drive.force).abs() < 0.1, "{force} N for {} N", drive.force);
}

#[test]
fn a_blocked_axis_stalls_and_a_held_or_moving_one_does_not() {
    let run = |setpoint: f32, position: &dyn Fn(u32) -> f32| {
        let mut servo = Servo::new(settings(), axis());
        (0..5000).find(|k| servo.update(setpoint, position(*k), DT) == Err(ServoError::Stalled))
    };
    // 0.5 of duty are 125 N, or 0.625 m of error.
    assert_eq!(run(0.39, &|_| -0.3), Some(200), "blocked");
    assert_eq!(run(0.39, &|k| -0.3 + 1e-5 * (k % 2) as f32), Some(200), "trembling");
    assert_eq!(run(0.1, &|_| 0.05), None, "holding 10 N");
    assert_eq!(run(0.39, &|k| -0.39 + 1e-5 * k as f32), None, "a centimetre a second, until the push weakens");
}

#[test]
fn a_stall_ends_with_a_reset_or_with_a_move() {
    let mut servo = Servo::new(settings(), axis());
    while servo.update(0.39, -0.3, DT).is_ok() {}
    assert_eq!(servo.update(0.39, -0.3, DT), Err(ServoError::Stalled));
    assert!(servo.update(0.39, -0.298, DT).is_ok());
    while servo.update(0.39, -0.298, DT).is_ok() {}
    servo.reset();
    assert!(servo.update(0.39, -0.298, DT).is_ok());
}

#[test]
fn impossible_input_is_refused_and_remembered_by_nothing() {
    let strict = Axis { fastest: 10.0, ..axis() };
    let mut servo = Servo::new(settings(), strict);
    let mut twin = Servo::new(settings(), strict);
    servo.update(0.1, 0.0, DT).expect("sound");
    twin.update(0.1, 0.0, DT).expect("sound");
    for (setpoint, position, dt, error) in [
        (f32::NAN, 0.0, DT, ServoError::NotFinite),
        (f32::INFINITY, 0.0, DT, ServoError::NotFinite),
        (0.0, 0.0, 0.0, ServoError::NotFinite),
        (0.0, 0.0, -DT, ServoError::NotFinite),
        (0.0, 0.0, 1.0, ServoError::NotFinite),
        (0.0, 0.0, f32::NAN, ServoError::NotFinite),
        (0.0, f32::NAN, DT, ServoError::ImpossiblePosition),
        (0.0, f32::NEG_INFINITY, DT, ServoError::ImpossiblePosition),
        (0.0, 0.42, DT, ServoError::ImpossiblePosition),
        (0.0, 0.02, DT, ServoError::ImpossiblePosition),
    ] {
        assert_eq!(servo.update(setpoint, position, dt), Err(error), "{setpoint} {position} {dt}");
    }
    assert_eq!(servo.update(0.1, 0.001, DT), twin.update(0.1, 0.001, DT));
    assert_eq!(FaultCode::from(ServoError::Stalled), FaultCode::StalledAxis);
    assert_eq!(FaultCode::from(ServoError::ImpossiblePosition), FaultCode::ImpossibleSensor);
    assert_eq!(FaultCode::from(ServoError::NotFinite), FaultCode::NonFinite);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_limits_hold_for_any_input(
        path in prop::collection::vec((prop::num::f32::ANY, prop::num::f32::ANY, -0.5f32..0.5, 0.0..0.11f32), 1..50),
        gains in prop::array::uniform8(prop::num::f32::ANY),
        wild in any::<bool>(),
        on_measurement in any::<bool>(),
    ) {
        let mut settings = ServoSettings { derivative_on_measurement: on_measurement, ..settings() };
        let mut axis = Axis { back_emf: 0.5, ..axis() };
        if wild {
            (settings.kp, settings.ki, settings.kd, settings.max_force) = (gains[0], gains[1], gains[2], gains[3]);
            (settings.derivative_time, axis.stall_force, axis.free_speed) = (gains[4], gains[5], gains[6]);
            axis.duty_limit = gains[7];
        }
        let mut servo = Servo::new(settings, axis);
        for (setpoint, anywhere, somewhere, dt) in path {
            for position in [anywhere, somewhere] {
                if let Ok(drive) = servo.update(setpoint, position, dt) {
                    let force = settings.max_force.max(0.0);
                    prop_assert!(drive.force.abs() <= force, "{drive:?}");
                    // `max` takes the 0 where the limit is not a number.
                    prop_assert!(drive.duty.abs() <= axis.duty_limit.max(0.0) && drive.duty.abs() <= 1.0, "{drive:?}");
                }
            }
        }
    }

    #[test]
    fn the_servo_is_symmetric(
        path in prop::collection::vec((-1.0f32..1.0, -0.4f32..0.4), 1..300),
        on_measurement in any::<bool>(),
    ) {
        let settings = ServoSettings { derivative_on_measurement: on_measurement, ..settings() };
        let (mut left, mut right) = (Servo::new(settings, axis()), Servo::new(settings, axis()));
        for (setpoint, position) in path {
            let mirrored = right.update(-setpoint, -position, DT)
                .map(|d| Drive { force: -d.force, duty: -d.duty, ..d });
            prop_assert_eq!(left.update(setpoint, position, DT), mirrored);
        }
    }
}
