//! The chain of pendulums against what is known of it in closed form, and its runs: what decides them, and that all of
//! it does.

use core::f64::consts::{PI, TAU};
use firmware::timing::CONTROL_PERIOD;
use hil_sim::chain::body::{Body, Chain, Touch};
use hil_sim::chain::{Broken, ChainError, ChainRecord, ChainSetup, Hand, PARAMETERS, Shape, run};
use protocol::Id;

/// Without friction.
fn free() -> Body {
    Body { friction: 0.0, ..Body::default() }
}

/// Moves on by so many seconds, servos off and nobody near.
fn coast<const P: usize>(chain: &mut Chain<P>, seconds: f64) {
    for _ in 0..(seconds / CONTROL_PERIOD).round() as u32 {
        chain.advance(None, &[None; P]);
    }
}

fn records(setup: &ChainSetup, seconds: f64) -> Vec<ChainRecord> {
    let mut records = Vec::new();
    run(setup, seconds, |record| records.push(record)).expect("every number is finite");
    records
}

#[test]
fn a_free_chain_keeps_its_energy() {
    for (name, angles, rates) in [
        ("a small swing", [0.1, -0.05, 0.02], [0.0; 3]),
        ("a large one, from nearly upright", [3.0, 2.0, -1.0], [0.0; 3]),
        ("turning over together", [0.0; 3], [14.0, 14.0, 14.0]),
        ("twisted by more than a turn", [0.0, 4.0, 8.0], [5.0, 0.0, -5.0]),
    ] {
        let mut chain = Chain { angles, rates, ..Chain::new(free()) };
        let energy = chain.energy();
        for second in 0..60 {
            coast(&mut chain, 1.0);
            let drift = (chain.energy() / energy - 1.0).abs();
            assert!(drift < 1e-6, "{name}: {drift:.1e} of the energy after {second} s");
        }
    }
}

/// A chain let go in the shape of a mode, 0.1 mrad wide, is where the cosine of that mode's frequency has it.
fn swings_at<const P: usize>(mode: [f64; P], omega: f64) {
    let width = 1e-4;
    let mut chain = Chain { angles: mode.map(|angle| width * angle), ..Chain::new(free()) };
    for k in 1..=3000 {
        coast(&mut chain, CONTROL_PERIOD);
        let expected = libm::cos(omega * CONTROL_PERIOD * f64::from(k));
        for (angle, mode) in chain.angles.iter().zip(mode) {
            let off = angle / width - mode * expected;
            assert!(off.abs() < 1e-3, "mode {mode:?} at {omega} rad/s is off by {off:.1e} of its width at step {k}");
        }
    }
}

#[test]
fn small_swings_have_the_normal_modes_of_the_chain() {
    let Body { gravity: g, spring: k, .. } = free();
    swings_at([1.0], g.sqrt());
    swings_at([1.0, 1.0], g.sqrt());
    swings_at([1.0, -1.0], (g + 2.0 * k).sqrt());
    swings_at([1.0, 1.0, 1.0], g.sqrt());
    swings_at([1.0, 0.0, -1.0], (g + k).sqrt());
    swings_at([1.0, -2.0, 1.0], (g + 3.0 * k).sqrt());
}

#[test]
fn beside_a_pendulum_that_is_held_the_other_swings_as_on_a_fixed_spring() {
    let body = free();
    let omega = (body.gravity + body.spring).sqrt();
    let mut chain = Chain { angles: [0.0, 1e-4], rates: [3.0, 0.0], ..Chain::new(body) };
    for k in 1..=500 {
        chain.advance(None, &[Some(Touch::Hold), None]);
        assert_eq!((chain.angles[0], chain.rates[0]), (0.0, 0.0));
        let expected = libm::cos(omega * CONTROL_PERIOD * f64::from(k));
        assert!((chain.angles[1] / 1e-4 - expected).abs() < 1e-3, "step {k}");
    }
}

#[test]
fn friction_takes_the_energy_that_it_should() {
    let mut chain = Chain { angles: [1e-4, 1e-4], ..Chain::new(Body::default()) };
    let energy = chain.energy();
    coast(&mut chain, 10.0);
    let left = chain.energy() / energy;
    let expected = libm::exp(-chain.body.friction * 10.0);
    assert!((left / expected - 1.0).abs() < 0.02, "{left:.4} of the energy is left, expected {expected:.4}");
}

/// Where two pendulums come to rest under these motor values.
fn held_by_servos(body: Body, y: [f64; 2]) -> [f64; 2] {
    let mut chain = Chain::new(body);
    // A servo at its limit does not damp: the bearings alone take minutes.
    for _ in 0..15_000 {
        chain.advance(Some(&y), &[None; 2]);
    }
    assert!(chain.rates.iter().all(|rate| rate.abs() < 1e-9), "it still moves: {:?}", chain.rates);
    chain.angles
}

#[test]
fn a_servo_holds_where_its_torque_meets_gravity_and_springs() {
    let body = Body::default();
    let (pull, springs) = (body.stiffness * body.range, 2.0 * body.spring);
    let [a, b] = held_by_servos(body, [1e-3, 1e-3]);
    assert!((a / 1e-3 - pull / (body.stiffness + body.gravity)).abs() < 1e-6 && (a - b).abs() < 1e-12, "{a}");
    let [a, b] = held_by_servos(body, [1e-3, -1e-3]);
    assert!((a / 1e-3 - pull / (body.stiffness + body.gravity + springs)).abs() < 1e-6 && (a + b).abs() < 1e-12, "{a}");
    let weak = Body { max_torque: 0.5 * body.gravity, ..body };
    let [a, _] = held_by_servos(weak, [1.0, 1.0]);
    assert!((a - PI / 6.0).abs() < 1e-6, "half of gravity holds at 30 degrees, not at {a} rad");
}

/// A chain moved for a second by motor values and a push that change all the time.
fn driven(start: [f64; 3], sign: f64, order: [usize; 3]) -> [[f64; 3]; 2] {
    let mut chain = Chain { angles: order.map(|i| sign * start[i]), ..Chain::new(Body::default()) };
    for k in 0..50 {
        let phase = f64::from(k) * 0.3;
        let y = [libm::sin(phase), libm::sin(2.0 * phase), 0.8].map(|y| sign * y);
        let hands = [Some(Touch::Push(sign * 30.0)), None, None];
        chain.advance(Some(&order.map(|i| y[i])), &order.map(|i| hands[i]));
    }
    [chain.angles, chain.rates]
}

#[test]
fn left_and_right_are_alike_to_the_bit() {
    let [there, mirrored] = [1.0, -1.0].map(|sign| driven([0.3, -1.0, 2.0], sign, [0, 1, 2]));
    assert_eq!(there, mirrored.map(|state| state.map(|number| -number)));
}

#[test]
fn both_ends_are_alike() {
    let [there, turned] = [[0, 1, 2], [2, 1, 0]].map(|order| driven([0.3, -1.0, 2.0], 1.0, order));
    for (there, turned) in there.iter().zip(turned) {
        for i in 0..3 {
            assert!((there[i] - turned[2 - i]).abs() < 1e-9, "{there:?} {turned:?}");
        }
    }
}

#[test]
fn a_whole_turn_of_all_pendulums_is_no_difference() {
    let mut here = Chain { angles: [0.5, -0.4, 0.2], ..Chain::new(Body::default()) };
    let mut there = Chain { angles: here.angles.map(|angle| angle + TAU), ..here.clone() };
    coast(&mut here, 5.0);
    coast(&mut there, 5.0);
    for i in 0..3 {
        assert!((there.angles[i] - here.angles[i] - TAU).abs() < 1e-9 && (there.rates[i] - here.rates[i]).abs() < 1e-9);
    }
}

#[test]
fn one_seed_is_one_run_and_another_is_another() {
    for shape in Shape::ALL {
        let setup = ChainSetup::new(shape);
        let first = records(&setup, 20.0);
        assert_eq!(first, records(&setup, 20.0), "{}", shape.name());
        assert_ne!(first, records(&ChainSetup { seed: 2, ..setup }, 20.0), "{}", shape.name());
    }
}

#[test]
fn without_noise_a_hanging_chain_hangs() {
    for shape in Shape::ALL {
        let mut setup = ChainSetup::new(shape);
        setup.set(Id::SensorNoise, 0.0).expect("0 is no noise");
        let last = records(&setup, 60.0).pop().expect("a record");
        assert_eq!(
            (last.angles.iter().sum::<f64>(), last.error, last.time_loop_error),
            (0.0, 0.0, 0.0),
            "{}",
            shape.name()
        );
    }
}

#[test]
fn every_shape_senses_what_it_says() {
    for (shape, pendulums) in [(Shape::Angles, 2), (Shape::AnglesAndRates, 2), (Shape::EndAngles, 3)] {
        assert_eq!(Shape::find(shape.name()), Some(shape));
        let mut setup = ChainSetup::new(shape);
        setup.set(Id::SensorNoise, 0.0).expect("0 is no noise");
        setup.hands.push(Hand { start: 0.1, seconds: 0.5, pendulum: 0, touch: Touch::Push(100.0) });
        let records = records(&setup, 1.0);
        assert!(records.iter().take(6).all(|record| record.angles[0] == 0.0) && records[7].angles[0] > 0.0);
        for ChainRecord { angles, rates, x, y, c, h, a, .. } in &records {
            assert_eq!((angles.len(), rates.len(), y.len(), h.len()), (pendulums, pendulums, pendulums, pendulums));
            assert_eq!((c.len(), a.len()), (pendulums * x.len(), pendulums * x.len()));
            let unit = setup.body.rate_unit();
            let sensed = match shape {
                Shape::Angles => vec![angles[0], angles[1]],
                Shape::AnglesAndRates => vec![angles[0], angles[1], rates[0] / unit, rates[1] / unit],
                Shape::EndAngles => vec![angles[0], angles[2]],
            };
            assert!(sensed.iter().zip(x).all(|(sensed, x)| (sensed - x).abs() < 1e-6), "{sensed:?} {x:?}");
        }
    }
}

#[test]
fn a_fixed_controller_is_unity_on_the_angles() {
    for (shape, unity) in [
        (Shape::Angles, &[1.0, 0.0, 0.0, 1.0][..]),
        (Shape::AnglesAndRates, &[1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]),
        (Shape::EndAngles, &[1.0, 0.0, 0.5, 0.5, 0.0, 1.0]),
    ] {
        let mut setup = ChainSetup::new(shape);
        setup.set(Id::Rule, 1.0).expect("a rule");
        assert_eq!(records(&setup, 1.0).pop().map(|last| last.c).as_deref(), Some(unity), "{}", shape.name());
    }
}

#[test]
fn every_parameter_of_a_chain_decides_its_run_and_no_other_is_taken() {
    let pushed = |shape| {
        let mut setup = ChainSetup::new(shape);
        // Far enough for every precaution to be felt.
        setup.hands.push(Hand { start: 1.0, seconds: 2.0, pendulum: 0, touch: Touch::Push(300.0) });
        setup
    };
    let plain = Shape::ALL.map(|shape| records(&pushed(shape), 20.0));
    for id in Id::ALL.iter().copied() {
        let parameter = id.parameter();
        let other = match id {
            Id::Rule => 2.0,
            // Floors are felt where they are above what they guard.
            Id::GainFloor | Id::PivotFloor => 0.9,
            _ => parameter.default / 3.0 + 0.02,
        };
        let changed = Shape::ALL.map(|shape| {
            let mut setup = pushed(shape);
            setup.set(id, other).map(|()| records(&setup, 20.0))
        });
        for (changed, plain) in changed.iter().zip(&plain) {
            match changed {
                Ok(changed) => {
                    assert!(PARAMETERS.contains(&id) && changed != plain, "{}", id.name())
                }
                Err(error) => assert!(*error == ChainError::NotTheChains(id) && !PARAMETERS.contains(&id), "{error}"),
            }
        }
    }
    let error = ChainSetup::new(Shape::Angles).set(Id::Rule, 1.5).expect_err("no such rule");
    assert!(error.to_string().contains("rule"), "{error}");
}

#[test]
fn a_body_of_no_sense_ends_the_run_and_says_when() {
    let mut setup = ChainSetup::new(Shape::EndAngles);
    setup.body.gravity = f64::NAN;
    let mut seen = 0;
    let Broken { at, .. } = run(&setup, 10.0, |_| seen += 1).expect_err("NaN");
    assert_eq!((seen, at), (1, CONTROL_PERIOD));
}
