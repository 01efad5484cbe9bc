//! The plant off the line: tilted, upright, dropped, hopping, slipping.

use hil_sim::plant::{Body, Drive, Load, Plant, Regime, Start};

/// A plain cylinder of the chapter's size without rolling friction.
fn cylinder(mu: f64) -> Body {
    Body { weight_mass: 0.0, friction: 0.0, mu, ..Body::chapter() }
}

/// A barrel on its lower rim, the axis leaning by `lean` (rad) from the vertical, turning with the components
/// (about its axis, about the slope, about the horizontal tangent) of `spin` (rad/s), its contact point at rest.
fn leaning(body: Body, lean: f64, spin: [f64; 3], sunk: f64) -> Plant {
    let (h, r) = (0.5 * body.length, body.radius);
    let (sin, cos) = lean.sin_cos();
    let (axis, down) = ([0.0, sin, cos], [0.0, cos, -sin]);
    let tangent = cross(axis, down);
    let omega: [f64; 3] = std::array::from_fn(|i| spin[0] * axis[i] + spin[1] * down[i] + spin[2] * tangent[i]);
    let contact: [f64; 3] = std::array::from_fn(|i| -h * axis[i] + r * down[i]);
    let turn = 0.5 * (std::f64::consts::FRAC_PI_2 - lean);
    let start = Start::Free {
        position: [0.0, 0.0, h * cos + r * sin - sunk],
        orientation: [turn.cos(), turn.sin(), 0.0, 0.0],
        velocity: cross(contact, omega),
        angular_velocity: omega,
    };
    Plant::new(body, start).expect("a valid body")
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Angle of the axis from the vertical, rad.
fn lean(plant: &Plant) -> f64 {
    plant.axes()[1][2].clamp(-1.0, 1.0).acos()
}

/// Angular velocity about the axis and about the slope towards the lowest point, rad/s.
fn spin(plant: &Plant) -> [f64; 2] {
    let (a, w) = (plant.axes()[1], plant.angular_velocity());
    let along = w[0] * a[0] + w[1] * a[1] + w[2] * a[2];
    let sin = (1.0 - a[2] * a[2]).sqrt();
    let slope = (a[2] * along - w[2]) / sin;
    [along, slope]
}

fn norm(v: [f64; 3]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

struct Random(u64);

impl Random {
    /// In ±1.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

#[test]
fn an_upright_barrel_stands_for_a_minute() {
    let mut plant = Plant::new(Body::chapter(), Start::Upright).expect("a valid body");
    let begin = plant.position();
    plant.advance(60.0);
    let end = plant.position();
    let moved = norm([end[0] - begin[0], end[1] - begin[1], end[2] - begin[2]]);
    println!("moved {moved:.1e} m, lean {:.1e} rad, spin {:.1e} rad/s", lean(&plant), plant.omega());
    assert!(lean(&plant) < 1e-6 && moved < 1e-6, "moved {moved:.1e} m, leans {:.1e} rad", lean(&plant));
}

#[test]
fn a_barrel_leaning_beyond_its_diagonal_falls_and_one_within_comes_back() {
    let mut over = leaning(Body::chapter(), 50_f64.to_radians(), [0.0; 3], 1e-4);
    over.advance(3.0);
    let mut within = leaning(Body::chapter(), 15_f64.to_radians(), [0.0; 3], 1e-4);
    within.advance(5.0);
    println!("from 50°: tilt {:.4} rad, {:?}; from 15°: lean {:.1e} rad", over.tilt(), over.regime(), lean(&within));
    assert!(over.tilt().abs() < 0.02, "tilt {:.3} rad after falling", over.tilt());
    assert_eq!(over.regime(), Regime::Rolling, "a fallen barrel ends on the line");
    assert!(lean(&within) < 1e-3, "lean {:.1e} rad", lean(&within));
}

#[test]
fn a_frictionless_precession_keeps_energy_momentum_and_spin() {
    let mut plant = leaning(cylinder(0.0), 0.3, [6.0, -2.0, 0.0], 1e-4);
    // Settle the small bounce of the start first: it is damped, and rightly so.
    plant.advance(1.0);
    let begin = (plant.energy(), plant.angular_momentum()[2], plant.omega());
    let (mut low, mut high) = (f64::MAX, f64::MIN);
    let mut worst = [0.0_f64; 3];
    for _ in 0..1000 {
        plant.advance(0.01);
        let now = (plant.energy(), plant.angular_momentum()[2], plant.omega());
        worst[0] = worst[0].max((now.0 - begin.0).abs() / begin.0);
        worst[1] = worst[1].max((now.1 - begin.1).abs() / begin.1.abs());
        worst[2] = worst[2].max((now.2 - begin.2).abs() / begin.2.abs());
        low = low.min(lean(&plant));
        high = high.max(lean(&plant));
    }
    println!("10 s, lean {low:.3} to {high:.3} rad: energy, momentum, spin off by {worst:?}");
    assert!(high - low > 0.05, "the barrel should nod, lean {low:.3} to {high:.3} rad");
    assert!(worst[0] < 2e-3, "energy off by {:.1e}", worst[0]);
    assert!(worst[1] < 1e-6 && worst[2] < 1e-9, "momentum off by {:.1e}, spin by {:.1e}", worst[1], worst[2]);
}

/// The inertias of the plain cylinder: transverse, axial, mass, half length, radius.
const A: f64 = (3.0 * 0.25 + 1.0) / 12.0;
const C: f64 = 0.125;
const M: f64 = 1.0;
const H: f64 = 0.5;
const R: f64 = 0.5;

/// Chaplygin's linear equations for a solid of revolution that rolls on a rim: how the spin n about the axis and the
/// turn p about the slope change with the lean θ. From C ṅ = R f, A ṗ + C n θ̇ + A p θ̇ cot θ = H f with f the friction along the
/// tangent, m times the acceleration of the middle.
fn chaplygin(theta: f64, [n, p]: [f64; 2]) -> [f64; 2] {
    let d = C / R + M * R + M * H * H * C / (R * A);
    let dn = (M * H * C / A * n - M * R * p) / d;
    [dn, H * C / (R * A) * dn - C / A * n - p / theta.tan()]
}

#[test]
fn rolling_on_the_rim_obeys_chaplygins_integrals_and_keeps_its_energy() {
    let mut plant = leaning(cylinder(5.0), 0.45, [4.0, -3.0, 0.0], 1.5e-4);
    plant.advance(1.0);
    let begin = plant.energy();
    let (mut theta, mut predicted) = (lean(&plant), spin(&plant));
    let (mut low, mut high, mut worst, mut energy) = (theta, theta, 0.0_f64, 0.0_f64);
    for _ in 0..500 {
        plant.advance(0.01);
        let end = lean(&plant);
        let h = (end - theta) / 8.0;
        for i in 0..8 {
            let t = theta + h * f64::from(i);
            let go = |k: [f64; 2], s: f64| [predicted[0] + s * k[0], predicted[1] + s * k[1]];
            let k1 = chaplygin(t, predicted);
            let k2 = chaplygin(t + 0.5 * h, go(k1, 0.5 * h));
            let k3 = chaplygin(t + 0.5 * h, go(k2, 0.5 * h));
            let k4 = chaplygin(t + h, go(k3, h));
            predicted = std::array::from_fn(|i| predicted[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
        }
        theta = end;
        let now = spin(&plant);
        worst = worst.max((now[0] - predicted[0]).abs()).max((now[1] - predicted[1]).abs());
        energy = energy.max((plant.energy() - begin).abs() / begin);
        (low, high) = (low.min(theta), high.max(theta));
    }
    println!("5 s, lean {low:.3} to {high:.3} rad: rates off by {worst:.1e} rad/s, energy by {energy:.1e}");
    assert!(high - low > 0.05, "the barrel should nod, lean {low:.3} to {high:.3} rad");
    assert!(worst < 0.03, "rates off by {worst:.1e} rad/s of 5");
    assert!(energy < 5e-3, "energy off by {energy:.1e}");
}

#[test]
fn a_steady_precession_on_the_rim_stays_steady() {
    // Seven degrees, precessing at 15 rad/s; the spin that goes with it from the balance of moments about the tangent.
    let theta = 7_f64.to_radians();
    let rate = 15.0;
    let p = -rate * theta.sin();
    let k = -p * (H / theta.tan() + R);
    let n = (A * p * p / theta.tan() - M * k * H * p + M * 9.81 * (H * theta.sin() - R * theta.cos()))
        / (-C * p + M * k * R);
    let mut plant = leaning(cylinder(5.0), theta, [n, p, 0.0], 1.2e-4);
    let (mut low, mut high, mut heading, mut turned) = (theta, theta, 0.0_f64, 0.0);
    let begin = plant.energy();
    for i in 0..2000 {
        plant.advance(0.005);
        let a = plant.axes()[1];
        let now = a[1].atan2(a[0]);
        let step = now - heading;
        if i > 0 {
            turned += step - (step / std::f64::consts::TAU).round() * std::f64::consts::TAU;
        }
        heading = now;
        (low, high) = (low.min(lean(&plant)), high.max(lean(&plant)));
    }
    let measured = turned / (1999.0 * 0.005);
    let lost = (begin - plant.energy()) / begin;
    println!(
        "10 s: lean {low:.4} to {high:.4} rad of {theta:.4}, precession {measured:.3} rad/s, spin {n:.2}, energy lost {lost:.1e}"
    );
    assert!((measured - rate).abs() < 0.3, "precession {measured:.2} rad/s, {rate} expected");
    assert!(high - theta < 0.02 && theta - low < 0.02, "lean {low:.3} to {high:.3} rad, {theta:.3} expected");
}

#[test]
fn energy_never_grows_without_input() {
    let mut found = String::new();
    let mut most = f64::MIN;
    for (name, mut plant) in [
        ("tilted at rest", leaning(Body::chapter(), 0.6, [0.0; 3], 1e-4)),
        ("tilted, precessing", leaning(Body { friction: 0.0, ..Body::chapter() }, 0.2, [2.0, -2.0, 0.0], 1e-4)),
        ("plain, precessing", leaning(cylinder(0.64), 0.12, [-1.8, -1.8, 0.1], 1e-4)),
        ("plain, rolling on its rim", leaning(cylinder(5.0), 0.5, [5.0, -3.0, 0.5], 1e-4)),
        ("upright, pushed", leaning(Body::chapter(), 0.05, [1.0, 0.0, 0.5], 1e-4)),
        ("lying, slipping", {
            let mut p = Plant::new(Body::chapter(), Start::Lying { phi: 0.3, omega: 0.0 }).expect("valid");
            p.set_load(Load { axis_torque: 60.0, ..Load::default() });
            p.advance(0.3);
            p.set_load(Load::default());
            p
        }),
    ] {
        // Without the servo: its springs would be an input.
        let mut body = plant.body().clone();
        if let Drive::Servo(servo) = &mut body.drive {
            servo.kp = 0.0;
        }
        let start = Start::Free {
            position: plant.position(),
            orientation: plant.orientation(),
            velocity: plant.velocity(),
            angular_velocity: plant.angular_velocity(),
        };
        plant = Plant::new(body, start).expect("a valid body");
        plant.place_weights([0.05, -0.1]);
        let mut least = plant.energy();
        let begin = least;
        let mut grown = f64::MIN;
        for _ in 0..600 {
            plant.advance(0.01);
            let now = plant.energy();
            grown = grown.max(now - least);
            least = least.min(now);
        }
        found += &format!("{name}: {begin:.2} J to {:.2} J, largest growth {grown:.1e} J\n", plant.energy());
        most = most.max(grown);
    }
    println!("{found}");
    assert!(most < 1e-3, "energy grew by {most:.1e} J:\n{found}");
}

#[test]
fn drops_from_a_fifth_of_a_metre_stay_bounded_and_come_to_rest() {
    let mut random = Random(5);
    let (mut deepest, mut spin, mut rolling, mut momentum) = (0.0_f64, 0.0_f64, 0, 0.0_f64);
    for _ in 0..24 {
        let q = [random.next(), random.next(), random.next(), random.next()];
        let size = q.iter().map(|v| v * v).sum::<f64>().sqrt();
        let q = q.map(|v| v / size);
        let axis_z = 2.0 * (q[2] * q[3] + q[0] * q[1]);
        let low = 0.5 * axis_z.abs() + 0.5 * (1.0 - axis_z * axis_z).sqrt();
        let start = Start::Free {
            position: [0.0, 0.0, low + 0.2],
            orientation: q,
            velocity: [0.0; 3],
            angular_velocity: [0.0; 3],
        };
        let mut plant = Plant::new(Body::chapter(), start).expect("a valid body");
        for _ in 0..300 {
            plant.advance(0.01);
            momentum = momentum.max(norm(plant.angular_momentum()));
            spin = spin.max(norm(plant.angular_velocity()));
        }
        deepest = deepest.max(plant.max_penetration());
        rolling += i32::from(plant.regime() == Regime::Rolling);
    }
    println!(
        "deepest {deepest:.1e} m, fastest turn {spin:.1} rad/s, momentum {momentum:.2} N·m·s; {rolling} of 24 roll after 3 s"
    );
    assert!(deepest < 0.015, "a rim sank by {deepest:.1e} m");
    assert!(spin < 20.0 && momentum < 6.0, "turn {spin:.1} rad/s, momentum {momentum:.1} N·m·s");
}

#[test]
fn tilted_motion_converges_under_step_halving() {
    let end = |step: f64| {
        let body = Body { step, ..cylinder(0.0) };
        let mut plant = leaning(body, 0.4, [5.0, -3.0, 0.0], 1.2e-4);
        plant.advance(0.2);
        let (a, p) = (plant.axes()[1], plant.position());
        [a[0], a[1], a[2], p[2]]
    };
    let exact = end(0.03125e-3);
    let errors: Vec<f64> = [1.0e-3, 0.5e-3, 0.25e-3, 0.125e-3]
        .iter()
        .map(|&h| end(h).iter().zip(exact).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt())
        .collect();
    let order = (errors[1] / errors[3]).log2() / 2.0;
    println!("errors {errors:?}, order {order:.2}");
    assert!(order > 2.5, "errors {errors:?}, order {order:.2}");
    assert!(errors[1] < 1e-4, "error at the default substep {:.1e}", errors[1]);
}

#[test]
fn both_sets_of_equations_agree_while_rolling() {
    for body in [Body::chapter(), Body::tabletop()] {
        let run = |always_free: bool| {
            let mut plant = Plant::new(body.clone(), Start::Lying { phi: 0.2, omega: 1.0 }).expect("a valid body");
            plant.set_always_free(always_free);
            plant.place_weights([0.0, -0.15 * body.range]);
            for k in 0..100 {
                let t = 0.02 * f64::from(k);
                plant.set_command([0.1 * (2.0 * t).sin(), 0.15 * (3.0 * t).cos()]);
                plant.advance(0.02);
            }
            (plant.phi(), plant.omega(), plant.position(), plant.regime(), plant.weights())
        };
        let (a, b) = (run(false), run(true));
        println!("line {a:?}\nfree {b:?}");
        let off = (a.0 - b.0).abs();
        assert!(off < 5e-3 * (1.0 + a.0.abs()), "phi {:.5} and {:.5} rad", a.0, b.0);
        assert!((a.2[0] - b.2[0]).abs() < 5e-3, "path {:.5} and {:.5} m", a.2[0], b.2[0]);
    }
}

#[test]
fn a_strong_servo_makes_the_barrel_hop_and_it_lands_again() {
    let mut plant = Plant::new(Body::chapter(), Start::Lying { phi: 0.0, omega: 0.0 }).expect("a valid body");
    plant.place_weights([0.0, 0.3]);
    let mut highest: f64 = 0.0;
    plant.set_command([0.0, 1.0]);
    for _ in 0..100 {
        plant.advance(0.01);
        highest = highest.max(plant.position()[2]);
    }
    plant.advance(3.0);
    println!("highest {highest:.3} m, at the end {:.4} m {:?}", plant.position()[2], plant.regime());
    assert!(highest > 0.52, "highest {highest:.3} m");
    assert!((plant.position()[2] - 0.5).abs() < 1e-3);
}

#[test]
fn on_ice_a_rolling_push_slides() {
    let body = Body { mu: 0.01, ..Body::chapter() };
    let mut plant = Plant::new(body, Start::Lying { phi: 0.0, omega: 0.0 }).expect("a valid body");
    plant.set_load(Load { force_world: [10.0, 0.0, 0.0], ..Load::default() });
    plant.advance(1.0);
    let (v, w) = (plant.velocity()[0], plant.omega());
    // (10 − 0.01·29.43)/3 m/s² along, 0.01·29.43·0.5/0.125 rad/s² about the axis, less a little for the servo's weights.
    println!("after 1 s at 10 N: {v:.2} m/s, {w:.2} rad/s");
    assert!((v - 3.235).abs() < 0.1 && w < 1.5, "{v:.2} m/s, {w:.2} rad/s");
}

#[test]
fn friction_holds_a_pushed_face_without_creep_and_gives_way_at_its_cone() {
    let mut plant = Plant::new(Body::chapter(), Start::Upright).expect("a valid body");
    plant.set_load(Load { force_world: [6.0, 0.0, 0.0], torque_world: [0.0, 0.0, 1.0], ..Load::default() });
    plant.advance(1.0);
    let begin = (plant.position()[0], plant.axes()[0]);
    plant.advance(60.0);
    let crept = plant.position()[0] - begin.0;
    let turned = norm(cross(begin.1, plant.axes()[0]));
    println!("crept {crept:.1e} m, turned {turned:.1e} rad in 60 s");
    assert!(crept.abs() < 1e-6 && turned < 1e-6, "crept {crept:.1e} m, turned {turned:.1e} rad");
    plant.set_load(Load { torque_world: [0.0, 0.0, 12.0], ..Load::default() });
    plant.advance(1.0);
    assert!(plant.angular_velocity()[2] > 1.0, "12 N·m exceed 0.64·29.4·0.5 = 9.4 N·m");
}

#[test]
fn a_hundred_thousand_random_steps_stay_finite() {
    let mut random = Random(9);
    let mut steps = 0;
    for run in 0..20 {
        let body = if run % 4 == 3 { Body::tabletop() } else { Body::chapter() };
        let step = body.step;
        let start = match run % 3 {
            0 => Start::Lying { phi: random.next() * 3.0, omega: random.next() * 5.0 },
            1 => Start::Upright,
            _ => Start::Free {
                position: [0.0, 0.0, 0.9],
                orientation: [random.next(), random.next(), random.next(), random.next()],
                velocity: [random.next() * 3.0, random.next() * 3.0, random.next() * 3.0],
                angular_velocity: [random.next() * 9.0, random.next() * 9.0, random.next() * 9.0],
            },
        };
        let mut plant = Plant::new(body, start).expect("a valid body");
        for k in 0..5000 {
            if k % 3 == 0 {
                plant.set_command([random.next() * 2.0, random.next() * 2.0]);
            }
            if k % 400 == 0 {
                let big = if run % 5 == 4 { 1e9 } else { 30.0 };
                plant.set_load(Load {
                    axis_torque: random.next() * big / 3.0,
                    force_world: [random.next() * big, random.next() * big, random.next() * big / 3.0],
                    torque_world: [random.next() * 5.0, random.next() * 5.0, random.next() * 5.0],
                });
            }
            if k % 400 == 40 {
                plant.set_load(Load::default());
            }
            plant.advance(step);
            steps += 1;
            let (p, x, s) = (plant.position(), plant.inclination(), plant.weights());
            let all = [p[0], p[1], p[2], x[0], x[1], s[0], s[1], plant.omega(), plant.phi(), plant.energy()];
            assert!(all.iter().all(|v| v.is_finite()), "run {run}, step {k}: {all:?}");
            assert!(x[0].abs() <= 1.0 + 1e-9 && x[1].abs() <= 1.0 + 1e-9, "run {run}, step {k}: {x:?}");
        }
    }
    assert_eq!(steps, 100_000);
}

#[test]
fn any_body_that_is_allowed_stays_finite() {
    let mut random = Random(21);
    for run in 0..80 {
        // Spread over decades, kept where validate() allows.
        let mut spread = |low: f64, high: f64| low * (high / low).powf(0.5 + 0.5 * random.next());
        let radius = spread(0.05, 2.0);
        let shell_mass = spread(0.1, 50.0);
        let mut body = if run % 2 == 0 { Body::chapter() } else { Body::tabletop() };
        body.radius = radius;
        body.length = radius * spread(0.3, 5.0);
        body.shell_mass = shell_mass;
        body.weight_mass = shell_mass * spread(0.02, 2.0);
        body.weight_radius = 0.1 * radius;
        body.range = 0.5 * radius;
        body.stop = 0.7 * radius;
        body.axes_shift = if run % 3 == 0 { 0.0 } else { 0.3 * body.length };
        body.mu = spread(0.02, 5.0);
        body.friction = spread(1e-4, 10.0);
        body.rolling_resistance = spread(1e-4, 1.0);
        if let Drive::Servo(servo) = &mut body.drive {
            servo.kp = spread(1.0, 2000.0);
            servo.kd = spread(0.01, 1.0);
            servo.max_force = spread(1.0, 1000.0);
        }
        let mut plant = Plant::new(body, Start::Lying { phi: 0.3, omega: 2.0 }).expect("a valid body");
        for k in 0..100 {
            plant.set_command([random.next(), random.next()]);
            if k == 50 {
                let torque_world = [random.next() * shell_mass, random.next() * shell_mass, 0.0];
                plant.set_load(Load { axis_torque: random.next(), torque_world, ..Load::default() });
            }
            plant.advance(0.01);
            let (e, w) = (plant.energy(), norm(plant.angular_velocity()));
            assert!(e.is_finite() && w.is_finite(), "run {run}, step {k}: {:?}", plant.body());
        }
    }
}

#[test]
fn nonsense_is_refused_by_name() {
    let check = |change: fn(&mut Body), name: &str| {
        let mut body = Body::chapter();
        change(&mut body);
        let error = body.validate().expect_err(name).to_string();
        assert!(error.starts_with(name), "{error}");
        assert!(Plant::new(body, Start::Upright).is_err());
    };
    check(|b| b.radius = 0.0, "radius");
    check(|b| b.length = f64::NAN, "length");
    check(|b| b.shell_mass = -1.0, "shellMass");
    check(|b| b.weight_mass = 1e-6, "weightMass");
    check(|b| b.range = 0.6, "range");
    check(|b| b.stop = 0.1, "stop");
    check(|b| b.axes_shift = 2.0, "axesShift");
    check(|b| b.step = 0.02, "step");
    check(|b| b.gravity = f64::INFINITY, "gravity");
    assert!(Body::chapter().validate().is_ok() && Body::tabletop().validate().is_ok());
    let lost = Start::Lying { phi: f64::NAN, omega: 0.0 };
    assert!(Plant::new(Body::chapter(), lost).is_err());
}

#[test]
fn an_accelerometer_at_rest_sees_gravity_and_a_rolling_one_more() {
    let mut body = Body::tabletop();
    body.rolling_resistance = 0.5;
    let mut plant = Plant::new(body.clone(), Start::Lying { phi: 0.0, omega: 0.0 }).expect("a valid body");
    plant.advance(0.5);
    let f = plant.specific_force(body.imu_position);
    assert!((norm(f) - 9.81).abs() < 1e-6 && (f[2] - 9.81).abs() < 0.01, "{f:?}");
    let rolling = |always_free: bool| {
        let mut plant = Plant::new(body.clone(), Start::Lying { phi: 0.0, omega: 5.0 }).expect("a valid body");
        plant.set_always_free(always_free);
        plant.specific_force(body.imu_position)
    };
    let (a, b) = (rolling(false), rolling(true));
    println!("line {a:?}, all freedoms {b:?}");
    assert!((0..3).all(|i| (a[i] - b[i]).abs() < 0.1), "{a:?} and {b:?}");
}

#[test]
fn a_barrel_turned_evenly_by_hand_moves_and_feels_as_one_that_rolls_or_spins_evenly_by_itself() {
    let mut body = Body::tabletop();
    // Nothing brakes it and nothing in it is out of balance.
    (body.friction, body.rolling_resistance, body.weight_mass) = (0.0, 0.0, 0.0);
    let near = |a: [f64; 3], b: [f64; 3]| (0..3).all(|i| (a[i] - b[i]).abs() < 1e-9);
    let lying = Start::Lying { phi: 0.3, omega: 5.0 };
    let mut rolls = Plant::new(body.clone(), lying).expect("a valid body");
    let mut carried = rolls.clone();
    rolls.advance(0.1);
    carried.carry_on(0.1);
    assert!((carried.phi() - 0.8).abs() < 1e-12 && (carried.phi() - rolls.phi()).abs() < 1e-9);
    assert!(near(carried.position(), rolls.position()));
    let force = |plant: &Plant| plant.specific_force(plant.body().imu_position);
    let in_hand = |plant: &Plant| plant.specific_force_in_hand(plant.body().imu_position);
    assert!(near(in_hand(&carried), force(&rolls)), "{:?} and {:?}", in_hand(&carried), force(&rolls));

    // In the air, tilted and spinning about its own axis; there an accelerometer misses gravity and a hand does not.
    let (lean, tilt) = (libm::sincos(0.2), libm::sincos(0.4));
    let spinning = Start::Free {
        position: [0.0, 0.0, 100.0],
        orientation: [lean.1, lean.0, 0.0, 0.0],
        velocity: [0.0; 3],
        angular_velocity: [0.0, 5.0 * tilt.1, 5.0 * tilt.0],
    };
    let mut spins = Plant::new(body, spinning).expect("a valid body");
    let mut carried = spins.clone();
    spins.advance(0.1);
    carried.carry_on(0.1);
    assert!((carried.phi() - 0.5).abs() < 1e-12 && (carried.phi() - spins.phi()).abs() < 1e-9);
    let weight = carried.axes().map(|axis| 9.81 * axis[2]);
    let felt = force(&spins);
    assert!(near(in_hand(&carried), std::array::from_fn(|i| felt[i] + weight[i])), "{:?}", in_hand(&carried));
    carried.carry_on(-0.1);
    assert!(carried.phi().abs() < 1e-12 && (carried.tilt() - 0.4).abs() < 1e-12);
}
