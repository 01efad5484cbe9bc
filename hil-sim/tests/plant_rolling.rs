//! The plant while it rolls on the line, against the planar truth and its own laws.

mod oracle;

use hil_sim::plant::{Body, Drive, Load, Plant, Regime, Start};
use oracle::{Oracle, trace};
use std::f64::consts::{FRAC_PI_2, TAU};

fn servo(body: &mut Body) -> &mut hil_sim::plant::Servo {
    match &mut body.drive {
        Drive::Servo(servo) => servo,
        Drive::Motor(_) => panic!("the chapter's body has a servo"),
    }
}

/// The chapter's body with the servo of the reference traces.
fn reference_body(ki: f64) -> Body {
    let mut body = Body::chapter();
    servo(&mut body).ki = ki;
    servo(&mut body).derivative_on_measurement = true;
    body
}

/// A chapter's barrel whose servo gives no force and whose ground takes none: energy has nowhere to go.
fn idle_body() -> Body {
    let mut body = Body::chapter();
    servo(&mut body).kp = 0.0;
    body.friction = 0.0;
    body.mu = 10.0;
    body
}

fn lying(body: Body, phi: f64, omega: f64) -> Plant {
    Plant::new(body, Start::Lying { phi, omega }).expect("a valid body")
}

fn closed_loop(x: [f64; 2], gain: f64, angle: f64) -> [f64; 2] {
    let (s, c) = angle.sin_cos();
    [(gain * (c * x[0] - s * x[1])).tanh(), (gain * (s * x[0] + c * x[1])).tanh()]
}

#[test]
fn the_planar_truth_conserves_energy_without_drive_and_friction() {
    let mut truth = Oracle { kp: 0.0, friction: 0.0, ..Oracle::new(0.4, [0.1, -0.15], 0.0) };
    let begin = truth.energy();
    let mut worst: f64 = 0.0;
    // Free sliders run away in the end: until then.
    for _ in 0..600 {
        truth.step([0.0; 2], 1e-3);
        worst = worst.max((truth.energy() - begin).abs() / begin.abs());
    }
    assert!(worst < 1e-9, "relative drift {worst:.1e}");
}

#[test]
fn the_planar_truth_loses_exactly_what_friction_takes() {
    let mut truth = Oracle { kp: 0.0, friction: 0.1, ..Oracle::new(0.4, [0.1, -0.15], 0.0) };
    truth.state[1] = 2.0;
    let begin = truth.energy();
    let mut taken = 0.0;
    for _ in 0..500 {
        let before = truth.state[1];
        truth.step([0.0; 2], 1e-3);
        taken += 0.1 * 1e-3 * (before * before + truth.state[1] * truth.state[1]) / 2.0;
    }
    let off = truth.energy() + taken - begin;
    assert!(off.abs() < 1e-6 * taken.max(1.0), "{off:.1e} J are missing after {taken:.3} J of friction");
}

/// Largest deviations of φ (rad), ω (rad/s), weights (m) and path (m) from a trace, the plant driven by `command`.
fn deviation(mut plant: Plant, name: &str, command: impl Fn(&oracle::Row, [f64; 2]) -> [f64; 2]) -> [f64; 4] {
    let rows = trace(name);
    plant.place_weights(rows[0].s);
    let mut worst = [0.0_f64; 4];
    for row in &rows {
        let (s, x) = (plant.weights(), plant.inclination());
        worst[0] = worst[0].max((plant.phi() - row.phi).abs());
        worst[1] = worst[1].max((plant.omega() - row.omega).abs());
        worst[2] = worst[2].max((s[0] - row.s[0]).abs()).max((s[1] - row.s[1]).abs());
        worst[3] = worst[3].max((plant.position()[0] - row.path).abs());
        plant.set_command(command(row, x));
        plant.advance(0.02);
    }
    worst
}

#[test]
fn the_traces_are_followed_within_a_fiftieth_of_a_radian() {
    let open = |row: &oracle::Row, _: [f64; 2]| row.y;
    let closed = |_: &oracle::Row, x: [f64; 2]| closed_loop(x, 0.5, 0.5);
    let found = [
        ("plant_open_period100", deviation(lying(reference_body(0.0), 0.3, 0.0), "plant_open_period100", open)),
        (
            "plant_open_period300_locked",
            deviation(lying(reference_body(0.5), 0.0, 0.0), "plant_open_period300_locked", open),
        ),
        ("plant_closed_loop", deviation(lying(reference_body(0.5), 0.3, 0.0), "plant_closed_loop", closed)),
    ];
    for (name, [phi, omega, s, path]) in found {
        println!("{name}: phi {phi:.1e} rad, omega {omega:.1e} rad/s, weights {s:.1e} m, path {path:.1e} m");
        assert!(phi < 0.002, "{name}: phi off by {phi:.2e} rad (0.02 is allowed)");
        assert!(omega < 0.005 && s < 0.001 && path < 0.001, "{name}: {omega:.1e} rad/s, {s:.1e} m, {path:.1e} m");
    }
}

#[test]
fn all_freedoms_follow_the_traces_too() {
    let open = |row: &oracle::Row, _: [f64; 2]| row.y;
    let closed = |_: &oracle::Row, x: [f64; 2]| closed_loop(x, 0.5, 0.5);
    let free = |ki: f64, phi: f64| {
        let mut plant = lying(reference_body(ki), phi, 0.0);
        plant.set_always_free(true);
        plant
    };
    for (name, [phi, omega, s, path]) in [
        ("plant_open_period100", deviation(free(0.0, 0.3), "plant_open_period100", open)),
        ("plant_open_period300_locked", deviation(free(0.5, 0.0), "plant_open_period300_locked", open)),
        ("plant_closed_loop", deviation(free(0.5, 0.3), "plant_closed_loop", closed)),
    ] {
        println!(
            "{name}, all freedoms: phi {phi:.1e} rad, omega {omega:.1e} rad/s, weights {s:.1e} m, path {path:.1e} m"
        );
        assert!(phi < 0.02, "{name}: phi off by {phi:.2e} rad");
    }
}

#[test]
fn rolling_converges_with_the_fourth_order_of_its_step() {
    // Smooth: no end stop, no saturation, one command from start to end.
    let end = |step: f64| {
        let mut body = reference_body(0.5);
        body.step = step;
        let mut plant = lying(body, 0.3, 1.0);
        plant.place_weights([0.05, -0.1]);
        plant.set_command([0.3, 0.4]);
        plant.advance(1.0);
        plant.phi()
    };
    let exact = end(0.0003125);
    let errors: Vec<f64> = [0.01, 0.005, 0.0025].iter().map(|&h| (end(h) - exact).abs()).collect();
    let orders: Vec<f64> = errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect();
    println!("errors {errors:?} rad, orders {orders:?}");
    assert!(orders.iter().all(|o| (3.6..5.0).contains(o)), "errors {errors:?} rad, orders {orders:?}");
}

#[test]
fn energy_is_kept_while_rolling_without_drive() {
    let mut plant = lying(idle_body(), 0.0, 1.5);
    // Weights free to slide, between their stops for this long.
    plant.place_weights([0.05, -0.1]);
    let begin = plant.energy();
    let mut worst: f64 = 0.0;
    let mut steps = 0;
    while plant.weights().iter().all(|s| s.abs() < 0.35) && steps < 200 {
        plant.advance(0.01);
        worst = worst.max((plant.energy() - begin).abs());
        steps += 1;
    }
    println!("energy off by {worst:.1e} J in {steps} steps");
    assert!(steps > 20 && worst < 1e-5, "energy off by {worst:.1e} J of {begin:.2} J in {steps} steps");
}

#[test]
fn energy_never_grows_lying_with_weights_hitting_their_stops() {
    let mut most = f64::MIN;
    for seed in 0..20 {
        let t = f64::from(seed);
        let mut body = idle_body();
        body.friction = 0.02;
        body.mu = 0.64;
        let mut plant = lying(body, t, 0.4 * t - 4.0);
        plant.place_weights([0.25 * (3.0 * t).sin(), 0.25 * (5.0 * t).cos()]);
        let mut least = plant.energy();
        for _ in 0..500 {
            plant.advance(0.01);
            let now = plant.energy();
            most = most.max(now - least);
            least = least.min(now);
        }
    }
    println!("largest growth {most:.1e} J");
    assert!(most < 2e-3, "energy grew by {most:.1e} J");
}

#[test]
fn a_barrel_rests_on_coulomb_friction_without_creep() {
    let mut body = Body::chapter();
    body.rolling_resistance = 0.05;
    let mut plant = lying(body, 0.0, 0.0);
    // A little off balance: 9.81·0.004 = 0.039 N·m.
    plant.place_weights([0.004, -0.2]);
    plant.set_command([-0.004 / 0.3, 0.2 / 0.3]);
    plant.advance(2.0);
    let (begin, speed) = (plant.phi(), plant.omega());
    plant.advance(600.0);
    let crept = (plant.phi() - begin).abs();
    println!("crept {crept:.1e} rad in 10 min, omega {speed:.1e} rad/s after 2 s");
    assert!(crept < 1e-4, "crept {crept:.1e} rad in ten minutes");
}

#[test]
fn open_loop_locks_at_low_frequency_only() {
    let mut found = String::new();
    for (period, locks) in [(300_u32, true), (200, true), (150, true), (100, true), (25, false)] {
        let mut plant = lying(Body::chapter(), 0.0, 0.0);
        let y = |k: u32| {
            let t = TAU * f64::from(k) / f64::from(period);
            [t.sin(), (t + FRAC_PI_2).sin()]
        };
        plant.place_weights(y(0).map(|y| -0.3 * y));
        let mut begin = 0.0;
        let (settle, measure) = (3000, 10 * period);
        for k in 0..settle + measure {
            if k == settle {
                begin = plant.phi();
            }
            plant.set_command(y(k));
            plant.advance(0.02);
        }
        let omega = (plant.phi() - begin) / (0.02 * f64::from(measure));
        let want = TAU / (0.02 * f64::from(period));
        let off = (omega.abs() / want - 1.0).abs();
        found += &format!("T = {period}: {omega:.3} rad/s, locked would be {want:.3}\n");
        assert_eq!(off < 0.01, locks, "{found}");
    }
    println!("{found}");
}

fn closed_loop_speed(on_measurement: bool, angle: f64) -> (f64, f64) {
    let mut body = Body::chapter();
    servo(&mut body).derivative_on_measurement = on_measurement;
    let mut plant = lying(body, 0.0, 0.0);
    let first = closed_loop(plant.inclination(), 1.0, angle);
    plant.place_weights(first.map(|y| -0.3 * y));
    let mut begin = 0.0;
    let mut free = 0;
    for k in 0..3000 {
        if k == 2000 {
            begin = plant.phi();
        }
        free += usize::from(plant.regime() != Regime::Rolling);
        plant.set_command(closed_loop(plant.inclination(), 1.0, angle));
        plant.advance(0.02);
    }
    ((plant.phi() - begin) / 20.0, free as f64 / 3000.0)
}

#[test]
fn closed_loop_rolls_as_fast_as_the_original() {
    for angle in [0.1, 0.3, 0.5, 0.9] {
        let (error, free) = closed_loop_speed(false, angle);
        let (measured, _) = closed_loop_speed(true, angle);
        println!(
            "C = U({angle}): derivative on error {error:.2}, on measurement {measured:.2} rad/s; off the line {free:.2}"
        );
    }
    let (error, _) = closed_loop_speed(false, 0.5);
    let (measured, _) = closed_loop_speed(true, 0.5);
    assert!((error - 5.8).abs() < 0.5, "derivative on the error: {error:.2} rad/s, the original 5.8");
    assert!((measured - 3.1).abs() < 0.3, "derivative on the measurement: {measured:.2} rad/s, 3.1 expected");
    let (mirrored, _) = closed_loop_speed(false, -0.5);
    assert!((mirrored + error).abs() < 0.05, "mirrored: {mirrored:.2} rad/s");
}

#[test]
fn a_kick_rolls_the_barrel_and_a_hard_one_makes_it_slip() {
    let mut plant = lying(Body::chapter(), 0.0, 0.0);
    plant.set_load(Load { axis_torque: 10.0, ..Load::default() });
    plant.advance(0.1);
    plant.set_load(Load::default());
    assert!(plant.omega() > 0.5, "omega {:.2} rad/s", plant.omega());
    let mut plant = lying(Body::chapter(), 0.0, 0.0);
    plant.set_load(Load { axis_torque: 60.0, ..Load::default() });
    plant.advance(0.1);
    let slip = plant.velocity()[0] - 0.5 * plant.omega();
    assert_eq!(plant.regime(), Regime::Plane, "60 N·m about the axis exceed what mu = 0.64 can hold");
    assert!(slip < -0.5, "slip {slip:.2} m/s");
}

/// Without drive, after `kick` N·m about the axis for 0.2 s: the energies that follow.
fn after_kick(always_free: bool, kick: f64, seconds: f64) -> (Vec<f64>, Plant) {
    let mut body = Body::chapter();
    servo(&mut body).ki = 0.0;
    let mut plant = lying(body, 0.4, 0.0);
    plant.set_always_free(always_free);
    plant.set_load(Load { axis_torque: kick, ..Load::default() });
    plant.advance(0.2);
    plant.set_load(Load::default());
    let energies = (0..(seconds / 0.01) as usize)
        .map(|_| {
            plant.advance(0.01);
            plant.energy()
        })
        .collect();
    (energies, plant)
}

#[test]
fn slipping_in_the_plane_is_slipping_with_all_freedoms() {
    for kick in [20.0, 30.0, 40.0] {
        let (_, plane) = after_kick(false, kick, 0.5);
        let (_, free) = after_kick(true, kick, 0.5);
        let found = format!(
            "kick {kick} N·m: omega {:.4} and {:.4} rad/s, path {:.4} and {:.4} m, {:?}",
            plane.omega(),
            free.omega(),
            plane.position()[0],
            free.position()[0],
            plane.regime()
        );
        println!("{found}");
        assert!((plane.omega() - free.omega()).abs() < 0.02 * (1.0 + free.omega().abs()), "{found}");
        assert!((plane.position()[0] - free.position()[0]).abs() < 0.01, "{found}");
    }
}

#[test]
fn energy_never_grows_slipping_or_hopping_in_the_plane() {
    let mut found = String::new();
    let mut most = f64::MIN;
    for (name, kick, pull) in [("slipping", 80.0, 0.0), ("thrown", 5.0, 60.0), ("thrown and spun", -60.0, 45.0)] {
        let mut body = Body::chapter();
        servo(&mut body).kp = 0.0;
        let mut plant = lying(body, 0.4, 0.0);
        plant.set_load(Load { axis_torque: kick, force_world: [5.0, 0.0, pull], ..Load::default() });
        plant.advance(0.2);
        plant.set_load(Load::default());
        let begin = plant.energy();
        let (mut least, mut grown, mut highest) = (begin, f64::MIN, 0.0_f64);
        for _ in 0..500 {
            plant.advance(0.01);
            let now = plant.energy();
            grown = grown.max(now - least);
            least = least.min(now);
            highest = highest.max(plant.position()[2] - 0.5);
        }
        found += &format!("{name}: {begin:.2} J, {least:.2} J left, {highest:.3} m high, growth {grown:.1e} J\n");
        most = most.max(grown);
    }
    println!("{found}");
    assert!(most < 2e-3, "{found}");
}

#[test]
fn a_motor_drives_its_weight_to_speed_and_holds_it_against_gravity_by_friction_alone() {
    let mut body = Body::tabletop();
    body.gravity = 0.01;
    body.rolling_resistance = 1.0;
    let mut plant = lying(body, 0.0, 0.0);
    plant.set_command([0.1, 0.0]);
    plant.advance(0.3);
    let v = plant.weight_rates()[0];
    // 0.1·30 N less 1 N of Coulomb friction, over 30/1.2 + 1 N·s/m.
    assert!((v - 2.0 / 26.0).abs() < 1e-3, "speed {v:.4} m/s at a tenth of duty");
    let mut body = Body::tabletop();
    body.rolling_resistance = 1.0;
    if let Drive::Motor(motor) = &mut body.drive {
        motor.coulomb = 5.0;
    }
    let mut plant = lying(body, 0.0, 0.0);
    plant.place_weights([0.0, 0.02]);
    plant.advance(0.5);
    let begin = plant.weights()[1];
    plant.advance(10.0);
    let crept = plant.weights()[1] - begin;
    assert!(crept.abs() < 1e-9 && (begin - 0.02).abs() < 1e-4, "crept {crept:.1e} m from {begin:.4} m");
}
