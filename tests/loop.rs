//! The whole loop: what goes over the wire decides nothing that the library would not, and a recording holds all of it.

use barrel_tests::setup;
use firmware::scalar::Fixed16;
use firmware::{Robot, Scalar};
use hil_sim::link::{Direct, Direction, InProcess, Line, Link};
use hil_sim::record::Record;
use hil_sim::replay::{self, Event};
use hil_sim::run::Run;
use hil_sim::setup::BodyKind;
use protocol::Id;

type Frames = Vec<(Direction, Vec<u8>)>;

fn recorded<S: Scalar>(experiment: &str, body: BodyKind, steps: usize) -> (Vec<Record>, Frames) {
    let setup = setup(experiment, body, 3, &[]);
    let mut run = Run::start(setup, Line::new(InProcess::new(Robot::<S>::default()))).expect("starts");
    let mut records = Vec::new();
    for k in 0..steps {
        if k == steps / 2 {
            run.set(Id::EpsC, 0.2).expect("in range");
        }
        records.push(run.step().expect("goes on"));
    }
    let mut frames = Frames::new();
    run.link_mut().drain_frames(&mut |direction, bytes| frames.push((direction, bytes.to_vec())));
    (records, frames)
}

fn replays<S: Scalar>(frames: &Frames) -> (replay::Verdict, u64) {
    let mut steps = 0;
    let verdict = replay::replay::<S>(frames.iter().map(|(d, b)| (*d, &b[..])), &[], |event| {
        steps = if matches!(event, Event::Restart) { 0 } else { steps + 1 };
    });
    (verdict, steps)
}

#[test]
fn a_recording_replays_bit_for_bit_in_every_experiment() {
    for e in hil_sim::experiment::EXPERIMENTS {
        let (_, frames) = recorded::<f32>(e.name, BodyKind::Chapter, 500);
        let (verdict, steps) = replays::<f32>(&frames);
        assert!(verdict.is_identical(), "{}: {verdict:?}", e.name);
        assert_eq!(steps, 500, "{}", e.name);
    }
}

#[test]
fn a_recording_replays_bit_for_bit_on_every_body_and_in_every_number_format() {
    for body in BodyKind::ALL {
        let (_, frames) = recorded::<f32>("homeokinetic", body, 250);
        assert!(replays::<f32>(&frames).0.is_identical(), "f32 on {}", body.name());
        let (_, frames) = recorded::<f64>("homeokinetic", body, 250);
        assert!(replays::<f64>(&frames).0.is_identical(), "f64 on {}", body.name());
        let (_, frames) = recorded::<Fixed16>("homeokinetic", body, 250);
        assert!(replays::<Fixed16>(&frames).0.is_identical(), "fixed on {}", body.name());
    }
}

#[test]
fn another_number_format_is_seen_to_differ() {
    let (_, frames) = recorded::<f32>("homeokinetic", BodyKind::Chapter, 250);
    let (verdict, _) = replays::<Fixed16>(&frames);
    assert!(!verdict.is_identical() && verdict.largest > 0.0 && verdict.largest < 0.1, "{verdict:?}");
}

#[test]
fn the_wire_changes_nothing() {
    let (over_the_wire, _) = recorded::<f32>("homeokinetic", BodyKind::Chapter, 1000);
    let mut run =
        Run::start(setup("homeokinetic", BodyKind::Chapter, 3, &[]), Direct(Robot::<f32>::default())).expect("starts");
    for (k, record) in over_the_wire.iter().enumerate() {
        if k == 500 {
            run.set(Id::EpsC, 0.2).expect("in range");
        }
        assert_eq!(run.step().expect("goes on"), *record, "step {k}");
    }
}

#[test]
fn one_seed_gives_one_run_and_another_seed_another() {
    let last = |seed| {
        let setup = setup("homeokinetic", BodyKind::Chapter, seed, &[]);
        let mut run = Run::start(setup, Direct(Robot::<f32>::default())).expect("starts");
        (0..1000).map(|_| run.step().expect("goes on")).last().expect("steps")
    };
    assert_eq!(last(7), last(7));
    assert_ne!(last(7), last(8));
}
