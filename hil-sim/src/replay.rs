//! Replay: what a recorded robot heard is said to a fresh one, and what it answers is held against what was recorded.

use crate::link::Direction;
use firmware::{Port, Robot, Scalar};
use protocol::{Decoder, HostMessage, Id, RobotMessage, Telemetry};
use std::collections::VecDeque;

/// What a replay found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Verdict {
    /// Control steps replayed since the last restart of the brain.
    pub steps: u64,
    /// Frames of the robot in the recording.
    pub recorded: u64,
    /// Those that the replayed robot did not answer with the same bytes.
    pub different: u64,
    /// The first control step whose telemetry differs, as recorded and as replayed.
    pub first: Option<(Telemetry, Telemetry)>,
    /// Largest difference of any number in any telemetry.
    pub largest: f64,
}

impl Verdict {
    /// Whether every recorded frame was reproduced bit for bit.
    pub fn is_identical(&self) -> bool {
        self.recorded > 0 && self.different == 0
    }
}

/// One event of a replay.
#[derive(Debug)]
pub enum Event<'a, S: Scalar> {
    /// The brain was restarted: what came before is not part of the run.
    Restart,
    /// A control step was taken; the robot as it stands after it.
    Step(&'a Robot<S>),
}

/// Says every recorded frame of the host to a fresh robot whose brain is in `S`, with `overrides` set whenever the
/// recording restarts the brain, and compares its answers with the recorded ones.
pub fn replay<'f, S: Scalar>(
    frames: impl IntoIterator<Item = (Direction, &'f [u8])>,
    overrides: &[(Id, f64)],
    mut observe: impl FnMut(Event<S>),
) -> Verdict {
    let mut robot = Robot::<S>::default();
    let mut port = Port::default();
    let mut answers: VecDeque<Vec<u8>> = VecDeque::new();
    let mut verdict = Verdict::default();
    for (direction, bytes) in frames {
        match direction {
            Direction::ToRobot => {
                let message = decode::<HostMessage>(bytes);
                let restarts = matches!(message, Some(HostMessage::Restart { .. }));
                if restarts {
                    for &(id, value) in overrides {
                        // Checked on the command line; a parameter of the plant has no effect on the brain.
                        let _ = robot.set(id, value);
                    }
                }
                let mut stepped = false;
                port.receive(bytes, &mut robot, &mut |frame| {
                    stepped |= matches!(decode(frame), Some(RobotMessage::Telemetry(_)));
                    answers.push_back(frame.to_vec());
                });
                if restarts {
                    verdict.steps = 0;
                    observe(Event::Restart);
                }
                if stepped {
                    verdict.steps += 1;
                    observe(Event::Step(&robot));
                }
            }
            Direction::ToHost => {
                verdict.recorded += 1;
                let replayed = answers.pop_front();
                if replayed.as_deref() != Some(bytes) {
                    verdict.different += 1;
                    compare(&mut verdict, bytes, replayed.as_deref().unwrap_or_default());
                }
            }
        }
    }
    verdict
}

fn compare(verdict: &mut Verdict, recorded: &[u8], replayed: &[u8]) {
    let (Some(RobotMessage::Telemetry(recorded)), Some(RobotMessage::Telemetry(replayed))) =
        (decode(recorded), decode(replayed))
    else {
        return;
    };
    for (a, b) in numbers(&recorded).zip(numbers(&replayed)) {
        verdict.largest = verdict.largest.max((f64::from(a) - f64::from(b)).abs());
    }
    verdict.first.get_or_insert((recorded, replayed));
}

/// Every number of a telemetry.
fn numbers(t: &Telemetry) -> impl Iterator<Item = f32> {
    let Telemetry { x, y, c, h, a, b, xi, time_loop_error, .. } = *t;
    x.into_iter().chain(y).chain(c).chain(h).chain(a).chain(b).chain(xi).chain([time_loop_error])
}

/// The message of one whole frame.
fn decode<M: serde::de::DeserializeOwned>(frame: &[u8]) -> Option<M> {
    let mut decoder = Decoder::new();
    frame.iter().filter_map(|&byte| decoder.push(byte)).last()?.ok().map(|(_, message)| message)
}
