//! A recording of a robot that was still starting when it was first spoken to.

use firmware::Robot;
use hil_sim::coupling::Coupling;
use hil_sim::experiment::Experiment;
use hil_sim::link::{Board, Direction, Embodied, LinkError, SoftBoard};
use hil_sim::replay::{Event, replay};
use hil_sim::run::Run;
use hil_sim::setup::{BodyKind, Setup};
use protocol::message::Transducers;

/// A board that hears nothing for some servo ticks.
struct Starting {
    board: SoftBoard<f32>,
    deaf: u32,
}

impl Board for Starting {
    fn tick(
        &mut self,
        transducers: &Transducers,
        to_robot: &[u8],
        from_robot: &mut Vec<u8>,
    ) -> Result<[f32; 2], LinkError> {
        let hears = self.deaf == 0;
        self.deaf = self.deaf.saturating_sub(1);
        self.board.tick(transducers, if hears { to_robot } else { &[] }, from_robot)
    }
}

#[test]
fn questions_that_nobody_heard_do_not_stand_in_the_way() {
    let setup = Setup::new(Experiment::find("homeokinetic").expect("an experiment"), BodyKind::Tabletop);
    let board = Starting { board: SoftBoard::new(Robot::default()), deaf: 300 };
    let mut run = Run::start(setup, Embodied::new(board)).expect("it starts");
    for _ in 0..50 {
        run.step().expect("it goes on");
    }
    let mut frames: Vec<(Direction, Vec<u8>)> = Vec::new();
    run.link_mut().drain_frames(&mut |direction, bytes| frames.push((direction, bytes.to_vec())));
    let asked = frames.iter().take_while(|(direction, _)| *direction == Direction::ToRobot).count();
    let verdict =
        replay::<f32>(frames.iter().map(|(way, bytes)| (*way, bytes.as_slice())), &[], |_: Event<'_, f32>| {});
    assert!(verdict.is_identical(), "{verdict:?}");
    assert!(verdict.steps >= 50, "{asked} questions, then {} steps", verdict.steps);
}
