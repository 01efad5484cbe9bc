//! The image's brain against the library's, fed the same frames: equal to the last bit, in every rule. The board lies on the
//! desk in HIL mode; every message crosses the UART of the virtual board.

use barrel_tests::board::{image, image_in_fixed_point, image_without_logs};
use barrel_tests::setup;
use firmware::scalar::Fixed16;
use firmware::{Robot, Scalar};
use hil_sim::link::{InProcess, Line, Tethered};
use hil_sim::record::Record;
use hil_sim::run::Run;
use hil_sim::setup::{BodyKind, Setup};
use hil_sim::virtual_board::VirtualBoard;
use protocol::Id;
use std::path::Path;

/// Every number of a step, as its bits.
fn bits(record: &Record) -> Vec<u32> {
    let b = &record.brain;
    let vectors = [&b.x[..], &b.y, &b.c, &b.h, &b.a, &b.b, &b.xi, &[b.time_loop_error]];
    vectors.into_iter().flatten().map(|number| number.to_bits()).collect()
}

/// Runs the setup on the image and on the library, and compares every control step. The closed loop is the harder test: the
/// first bit that differs grows.
fn compare<S: Scalar>(image: &Path, setup: &Setup, steps: u32, change: Option<(Id, f64)>) {
    let board = VirtualBoard::power_on(image).expect("an image");
    let mut there = Run::start(setup.clone(), Line::new(Tethered::new(board))).expect("the board starts");
    let mut here = Run::start(setup.clone(), Line::new(InProcess::new(Robot::<S>::default()))).expect("starts");
    let mut moved = false;
    for step in 0..steps {
        if let Some((id, value)) = change.filter(|_| step == steps / 2) {
            assert_eq!(there.set(id, value).expect("set"), here.set(id, value).expect("set"));
        }
        let (board, library) = (there.step().expect("goes on"), here.step().expect("goes on"));
        assert_eq!(board.brain.t, library.brain.t);
        assert_eq!(bits(&board), bits(&library), "{} differs in step {step}", setup.experiment.name);
        // It moves as the motor values or the duties say, so these were the same, too.
        assert_eq!(board.plant, library.plant, "{} differs in step {step}", setup.experiment.name);
        moved |= board.plant.omega.abs() > 0.5;
    }
    assert!(moved, "{}: nothing happened that could differ", setup.experiment.name);
}

/// Rule 0 to 3, with learning in all that have it, noise and a kick.
fn rule(rule: u8) -> Setup {
    let name = ["open-loop", "closed-loop", "homeostatic", "homeokinetic"][usize::from(rule)];
    let learning = [("epsA", 0.1), ("sensorNoise", 0.02), ("omega0", 2.0)];
    let setup = setup(name, BodyKind::Chapter, 40 + u64::from(rule), &learning);
    assert_eq!(setup.values.get(Id::Rule), f64::from(rule));
    setup
}

#[test]
fn open_loop_for_10_000_steps() {
    compare::<f32>(&image(), &rule(0), 10_000, None);
}

#[test]
fn fixed_controller_for_10_000_steps() {
    compare::<f32>(&image(), &rule(1), 10_000, None);
}

#[test]
fn homeostatic_for_10_000_steps() {
    compare::<f32>(&image(), &rule(2), 10_000, None);
}

#[test]
fn homeokinetic_for_10_000_steps_and_a_change_in_the_middle() {
    compare::<f32>(&image(), &rule(3), 10_000, Some((Id::EpsC, 0.3)));
}

#[test]
fn the_whole_chain_from_chips_to_duties() {
    // Twenty readings of inertial sensor and encoders in every step: attitude, noise, brain, servo and safety.
    for (rule, name) in [(1, "closed-loop"), (3, "homeokinetic")] {
        let setup = setup(name, BodyKind::Tabletop, 50 + rule, &[("epsA", 0.1), ("omega0", 2.0)]);
        compare::<f32>(&image(), &setup, 1000, None);
    }
}

#[test]
fn without_logs_and_with_all_precautions_set_otherwise() {
    let sets = [("epsC", 0.5), ("clipZeta", 0.5), ("clipV", 0.3), ("ridge", 0.01), ("lambdaC", 0.01), ("omega0", 1.0)];
    compare::<f32>(&image_without_logs(), &setup("homeokinetic", BodyKind::Chapter, 77, &sets), 2000, None);
}

#[test]
fn fixed_point_in_every_rule() {
    for number in 0..4 {
        compare::<Fixed16>(&image_in_fixed_point(), &rule(number), 2500, Some((Id::EpsA, 0.05)));
    }
}
