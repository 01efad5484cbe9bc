//! The chapter's claims about the barrel, as its own experiments show them.

use barrel_tests::{mean_omega, measured};
use hil_sim::setup::Push;
use std::f64::consts::TAU;

/// Experiment 1.1: a slow drive takes the barrel with it, one turn a period; a fast one loses it.
#[test]
fn open_loop_locks_to_slow_drives_and_loses_fast_ones() {
    let speed = |period: f64| mean_omega("open-loop", 120.0, 300.0, &[("period", period)]).abs();
    for period in [300.0, 200.0, 150.0, 100.0] {
        let drive = TAU / (period * 0.02);
        let omega = speed(period);
        assert!((omega / drive - 1.0).abs() < 0.01, "period {period}: omega {omega:.4}, drive {drive:.4}");
    }
    let (omega, drive) = (speed(25.0), TAU / 0.5);
    assert!((omega / drive - 1.0).abs() > 0.2, "period 25 should not lock: omega {omega:.3}, drive {drive:.3}");
}

/// Experiment 1.2: C = U(0.5) rolls steadily; the original's derivative of the error leads, that of the measurement does not.
#[test]
fn closed_loop_rolls_at_the_originals_speed() {
    let omega = mean_omega("closed-loop", 60.0, 120.0, &[]);
    assert!((omega - 5.8).abs() < 0.5, "original's servo: {omega:.2} rad/s");
    let omega = mean_omega("closed-loop", 60.0, 120.0, &[("derivativeOnMeasurement", 1.0)]);
    assert!((omega - 3.1).abs() < 0.3, "derivative on the measurement: {omega:.2} rad/s");
}

#[test]
fn closed_loop_is_mirrored_by_the_other_rotation() {
    let backwards = [("coupling2", 0.479_425_538_604_203)];
    let (forth, back) = (mean_omega("closed-loop", 60.0, 90.0, &[]), mean_omega("closed-loop", 60.0, 90.0, &backwards));
    assert!((forth + back).abs() < 0.05 * forth.abs(), "{forth:.3} and {back:.3} rad/s");
}

/// Experiment 3.1: rest is left within a minute, then the barrel sweeps through its speeds and turns back.
#[test]
fn homeokinetic_control_leaves_rest_and_sweeps() {
    let runs: Vec<_> = (1..=20).map(|seed| measured("homeokinetic", seed, 300.0, &[], &[])).collect();
    let left: Vec<_> = runs.iter().map(|m| m.left_rest()).collect();
    let within_a_minute = left.iter().flatten().filter(|t| **t < 60.0).count();
    assert!(within_a_minute >= 19, "{within_a_minute} of 20 left rest within 60 s: {left:?}");
    let intervals: Vec<f64> = runs.iter().filter_map(|m| m.reversal_interval()).collect();
    let sweeping = intervals.iter().filter(|i| (8.0..=14.0).contains(*i)).count();
    assert!(sweeping >= 19, "{sweeping} of 20 reverse every 8 to 14 s: {intervals:.1?}");
}

/// Experiment 2.2: rest is kept until a kick starts a sweep.
#[test]
fn homeostatic_control_rests_until_a_kick_and_then_sweeps() {
    let kick = [Push { start: 60.0, torque: 10.0, seconds: 0.5 }];
    for seed in 1..=10 {
        let m = measured("homeostatic", seed, 300.0, &[], &kick);
        let left = m.left_rest().unwrap_or(f64::INFINITY);
        assert!((60.0..61.0).contains(&left), "seed {seed}: left rest at {left} s, kicked at 60 s");
        let interval = m.reversal_interval().unwrap_or(f64::INFINITY);
        assert!((10.0..16.0).contains(&interval), "seed {seed}: reverses every {interval:.1} s");
    }
}

/// Experiment 2.2: what keeps the rest before a kick. The model's decay does, and where there is none, a servo without an
/// integral term or a little rolling resistance: the integral pushes slowly on, and the ideal floor holds nothing.
#[test]
fn homeostatic_rest_hinges_on_decay_integral_term_and_rolling_resistance() {
    let kept = |sets: &[(&str, f64)]| {
        (1..=10).filter(|&seed| measured("homeostatic", seed, 300.0, sets, &[]).left_rest().is_none()).count()
    };
    let no_decay = [("lambdaA", 0.0), ("lambdaB", 0.0)];
    let with = |name, value| [no_decay[0], no_decay[1], (name, value)];
    for (what, sets, expected) in [
        ("with the decay", &[][..], 10),
        ("without decay", &no_decay, 0),
        ("without decay and integral term", &with("KI", 0.0), 10),
        ("without decay, on a floor with 0.05 N·m of rolling resistance", &with("rollingResistance", 0.05), 10),
    ] {
        let kept = kept(sets);
        assert!(kept.abs_diff(expected) <= 1, "{what}: {kept} of 10 keep rest, {expected} were seen");
    }
}
