//! The full chain of a body that can be built: chips, attitude, brain, servo, motors.

use barrel_tests::{run, setup};
use firmware::Robot;
use hil_sim::link::Direct;
use hil_sim::run::Run;
use hil_sim::setup::{BodyKind, Push};
use hil_sim::world::World;
use protocol::message::SafetyState;

#[test]
fn it_leaves_rest_and_sweeps_under_homeokinetic_control() {
    for seed in 1..=5 {
        let m = run::<f32>(setup("homeokinetic", BodyKind::Tabletop, seed, &[]), 180.0, |_| {});
        let left = m.left_rest().unwrap_or(f64::INFINITY);
        assert!(left < 60.0, "seed {seed}: left rest at {left} s");
        assert!(m.reversals().len() >= 4, "seed {seed}: turned back at {:?}", m.reversals());
    }
}

#[test]
fn it_rolls_steadily_in_the_closed_loop() {
    let mut speeds = Vec::new();
    run::<f32>(setup("closed-loop", BodyKind::Tabletop, 1, &[]), 60.0, |record| {
        if record.brain.t > 30.0 {
            speeds.push(record.plant.omega);
        }
    });
    let mean = speeds.iter().sum::<f64>() / speeds.len() as f64;
    let spread = speeds.iter().map(|s| (s - mean).abs()).fold(0.0, f64::max);
    assert!(mean > 4.0 && spread < 0.1 * mean, "{mean:.2} rad/s, {spread:.2} off at most");
}

/// The accelerometer sees more than gravity while the barrel rolls. What is left of that after the estimator has taken it
/// off, on the simulated plant with the biases and the noise of real chips: kicked to and fro under homeokinetic control.
#[test]
fn the_inclination_is_known_to_a_few_hundredths_while_it_rolls() {
    for seed in 1..=3 {
        let mut setup = setup("homeokinetic", BodyKind::Tabletop, seed, &[("sensorNoise", 0.0)]);
        for k in 0..12 {
            let torque = if k % 2 == 0 { 0.5 } else { -0.7 };
            setup.pushes.push(Push { start: 5.0 + 10.0 * f64::from(k), torque, force: 0.0, seconds: 0.5 });
        }
        let mut run = Run::start(setup, Direct(Robot::<f32>::default())).expect("starts");
        let (mut square, mut worst, mut fastest) = (0.0_f64, 0.0_f64, 0.0_f64);
        let steps = 125 * 50;
        for _ in 0..steps {
            let truth = run.plant().inclination();
            let record = run.step().expect("goes on");
            let error = (truth[0] - f64::from(record.brain.x[0])).hypot(truth[1] - f64::from(record.brain.x[1]));
            square += error * error;
            worst = worst.max(error);
            fastest = fastest.max(record.plant.omega.abs());
        }
        let rms = (square / f64::from(steps)).sqrt();
        println!("seed {seed}: inclination wrong by {rms:.4} rms, {worst:.4} at most, at up to {fastest:.1} rad/s");
        assert!(fastest > 3.0, "seed {seed}: it rolled at {fastest:.1} rad/s at most");
        assert!(rms < 0.03 && worst < 0.08, "seed {seed}: error {rms:.4} rms, {worst:.4} at most");
        assert_eq!(run.state(), SafetyState::Armed);
    }
}

#[test]
fn its_end_blocks_stay_where_homing_looks_for_them_and_the_chapters_go_with_the_range() {
    let stop = |body, sets: &[(&str, f64)]| setup("homeokinetic", body, 1, sets).plant_body().stop;
    for range in [0.001, 0.03, 0.06, 0.1, 1.0] {
        assert_eq!(stop(BodyKind::Tabletop, &[("range", range)]), 0.065, "range {range}");
    }
    assert_eq!(stop(BodyKind::Chapter, &[("range", 0.15)]), 0.39 * (0.15 / 0.3));
    assert_eq!(stop(BodyKind::Chapter, &[("range", 0.45)]), 0.5, "no further than the barrel");
    let narrow = World::new(setup("homeokinetic", BodyKind::Tabletop, 1, &[("radius", 0.05)]));
    let why = narrow.expect_err("a barrel without room for its end blocks").to_string();
    assert_eq!(why, "radius is 0.05: give a value between 0.065 and 10");
}

#[test]
fn a_motor_value_beyond_the_rail_is_cut_off_by_the_servo_and_the_run_starts_there() {
    // Upright on slider 1, the first motor value is near 1: the weight is wanted at twice the length of its rail.
    let sets = [("range", 0.12), ("phi0", -core::f64::consts::FRAC_PI_2), ("C11", 5.0)];
    let setup = setup("closed-loop", BodyKind::Tabletop, 1, &sets);
    let mut run = Run::start(setup, Direct(Robot::<f32>::default())).expect("starts");
    let start = run.step().expect("goes on");
    assert!(start.brain.y[0] > 0.9, "{:?}", start.brain.y);
    assert_eq!(start.plant.weights[0], -0.060);
    for _ in 0..50 {
        let weights = run.step().expect("goes on").plant.weights;
        assert!(weights.iter().all(|s| s.abs() < 0.065), "{weights:?}");
    }
    assert_eq!(run.state(), SafetyState::Armed);
}
