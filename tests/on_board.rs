//! The unmodified flash images on the virtual board, in closed loop with the simulated barrel.

use barrel_tests::board::{Bench, Watched, image, image_in_fixed_point, image_without_logs};
use barrel_tests::setup;
use firmware::Robot;
use hil_sim::coupling::Coupling;
use hil_sim::link::{Embodied, SoftBoard};
use hil_sim::measure::Measures;
use hil_sim::record::Record;
use hil_sim::run::Run;
use hil_sim::setup::BodyKind;
use hil_sim::virtual_board::VirtualBoard;
use protocol::HostMessage;
use std::path::Path;

fn start(image: &Path, seed: u64) -> Run<Embodied<VirtualBoard>> {
    let board = VirtualBoard::power_on(image).expect("an image");
    Run::start(setup("homeokinetic", BodyKind::Tabletop, seed, &[]), Embodied::new(board)).expect("starts")
}

fn measure(seconds: f64, mut step: impl FnMut() -> Record) -> Measures {
    let mut measures = Measures::default();
    let mut record = step();
    while record.brain.t < seconds {
        measures.add(&record);
        record = step();
    }
    measures
}

/// The whole chain on the image and on the library.
fn both(image: &Path, seed: u64, seconds: f64) -> [Measures; 2] {
    let mut there = start(image, seed);
    let measured = measure(seconds, || there.step().expect("goes on"));
    assert_eq!(there.link_mut().lost(), 0);
    let gaps = there.link_mut().board_mut().gaps().expect("goes on");
    assert_eq!(gaps, Vec::<String>::new(), "what the emulator cannot do");
    let setup = setup("homeokinetic", BodyKind::Tabletop, seed, &[]);
    let library = SoftBoard::new(Robot::<f32>::default());
    let mut here = Run::start(setup, Embodied::new(library)).expect("starts");
    [measured, measure(seconds, || here.step().expect("goes on"))]
}

#[test]
fn it_leaves_rest_and_sweeps_as_the_library_does_over_seeds() {
    const SEEDS: usize = 4;
    let mut means = [0.0; 2];
    let mut turned = [0, 0];
    for seed in 1..=SEEDS as u64 {
        let measures = both(&image_without_logs(), seed, 50.0);
        let left = measures.each_ref().map(|m| m.left_rest().unwrap_or(f64::INFINITY));
        // Until then both see the same noise; afterwards they part, as any two runs do that differ in a bit.
        assert!((left[0] - left[1]).abs() < 1.0, "seed {seed}: left rest at {left:?} s");
        let most = measures.each_ref().map(|m| m.speed().1);
        assert!((most[0] / most[1] - 1.0).abs() < 0.1, "seed {seed}: fastest {most:?} rad/s");
        for (which, m) in measures.iter().enumerate() {
            means[which] += m.speed().0 / SEEDS as f64;
            turned[which] += m.reversals().len();
        }
    }
    assert!((means[0] / means[1] - 1.0).abs() < 0.15, "mean speeds {means:?} rad/s");
    assert!(turned[0].abs_diff(turned[1]) <= SEEDS, "turned back {turned:?} times");
}

#[test]
fn with_logs_it_boots_homes_arms_leaves_rest_and_sweeps() {
    let mut run = start(&image(), 1);
    let measures = measure(40.0, || run.step().expect("goes on"));
    assert!(measures.left_rest().is_some(), "it stayed at rest");
    assert!(measures.turns() > 1.0, "{} turns", measures.turns());
}

#[test]
fn in_fixed_point_it_leaves_rest_and_sweeps_too() {
    let mut run = start(&image_in_fixed_point(), 1);
    let measures = measure(40.0, || run.step().expect("goes on"));
    assert!(measures.left_rest().is_some(), "it stayed at rest");
    assert!(measures.turns() > 1.0, "{} turns", measures.turns());
}

#[test]
fn vitals_tell_where_the_encoders_stand() {
    let mut bench = Bench::power_on(&image(), "homeokinetic", 1, &[]);
    let mut stand = |milliseconds| {
        bench.pass(milliseconds);
        let (told, there) = (bench.vitals().encoder, bench.world.transducers().encoder);
        bench.ask(HostMessage::Home);
        std::array::from_fn::<_, 2, _>(|i| there[i] - told[i])
    };
    // Homing takes the weights from wherever they lie to their ends and to the middle.
    let offset = stand(1500);
    assert_eq!(stand(10_000), offset);
    assert!(bench.vitals().homed);
}

#[test]
fn two_runs_with_one_seed_are_equal_to_the_bit() {
    let records = |seed| {
        let mut run = start(&image(), seed);
        let records: Vec<_> = (0..200).map(|_| run.step().expect("goes on")).collect();
        let mut tape = Vec::new();
        run.link_mut().drain_frames(&mut |_, bytes| tape.extend_from_slice(bytes));
        (records, tape)
    };
    let first = records(3);
    assert!(first == records(3), "the same seed gave another run");
    assert!(first.0 != records(4).0, "another seed must show");
}

#[test]
fn a_snapshot_taken_in_mid_run_resumes_identically() {
    let mut bench = Bench::start(&image(), "homeokinetic", 2, &[("omega0", 2.0)]);
    for _ in 0..100 {
        bench.control_step();
    }
    let snapshot = bench.board().board.snapshot().expect("taken");
    bench.board().kept = Some(Vec::new());
    for _ in 0..200 {
        bench.control_step();
    }
    let kept = bench.board().kept.take().expect("kept");
    let mut resumed = VirtualBoard::resume(&image(), &snapshot).expect("resumes");
    for (millisecond, (signals, to_robot, pins)) in kept.iter().enumerate() {
        let again = resumed.step(signals, [to_robot, &[]]).expect("goes on");
        assert_eq!(again, pins, "differs {millisecond} ms after the snapshot");
    }
    assert!(kept.iter().any(|(_, _, pins)| pins.duty != [0.0; 2]), "nothing happened that could differ");
    let other = VirtualBoard::resume(&image_without_logs(), &snapshot).expect_err("a snapshot of another image");
    assert!(other.to_string().contains("firmware"), "{other}");
}

#[test]
fn board_and_world_go_on_from_a_snapshot_as_they_would_have() {
    let mut bench = Bench::start(&image(), "homeokinetic", 3, &[("omega0", 2.0)]);
    bench.pass(1234);
    let snapshot = bench.board().board.snapshot().expect("taken");
    let board = VirtualBoard::resume(&image(), &snapshot).expect("resumes");
    let mut resumed = Bench { robot: Embodied::new(Watched::new(board)), world: bench.world.clone() };
    let mut fastest: f64 = 0.0;
    for millisecond in 0..4000 {
        bench.pass(1);
        resumed.pass(1);
        let record = bench.world.record();
        assert_eq!(resumed.world.record(), record, "{millisecond} ms after the snapshot");
        fastest = fastest.max(record.omega.abs());
    }
    assert!(fastest > 0.5, "nothing happened that could differ");
}
