//! Replay: what a recorded robot heard is said to a fresh one, and what it answers is held against what was recorded.

use crate::link::Direction;
use firmware::{Robot, Scalar};
use protocol::frame::{Arrival, MAX_FRAME, Numbering, Opens};
use protocol::message::SafetyState;
use protocol::{Decoder, HostMessage, Id, RobotMessage, Telemetry, encode};
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

/// Says every recorded message of the host to a fresh robot whose brain is in `S`, with `overrides` set whenever the
/// recording restarts the brain, and compares what it says with what was recorded.
///
/// In lock-step, the host's messages carry the sensors, and every answer is compared. A robot on its own sensors told in
/// its telemetry what its brain saw: that is put before the fresh brain, each message of the host in the place where it
/// was answered, and the telemetry and the parameters are compared from the first restart on, as nobody knows what the
/// robot had learned before.
pub fn replay<'f, S: Scalar>(
    frames: impl IntoIterator<Item = (Direction, &'f [u8])>,
    overrides: &[(Id, f64)],
    mut observe: impl FnMut(Event<S>),
) -> Verdict {
    let mut player = Player::<S>::new(overrides);
    for (direction, frame) in frames {
        match direction {
            Direction::ToRobot => {
                let Some(message) = decode::<HostMessage>(frame, &mut player.from_host) else { continue };
                if player.lockstep {
                    player.carry_out(&message, &mut observe);
                } else {
                    if message.opens() {
                        // What was asked before and not answered was said to nobody, as to a robot that had not started.
                        player.requests.clear();
                    }
                    player.requests.push_back(message);
                }
            }
            Direction::ToHost => {
                if let Some(said) = decode::<RobotMessage>(frame, &mut player.from_robot) {
                    player.heard(&said, &mut observe);
                }
            }
        }
    }
    player.verdict
}

/// A fresh robot and what it is to be compared with.
struct Player<'o, S: Scalar> {
    robot: Robot<S>,
    overrides: &'o [(Id, f64)],
    from_host: Numbering,
    from_robot: Numbering,
    /// Whether the host's messages carry the sensors.
    lockstep: bool,
    restarted: bool,
    /// Of the host, not yet answered in the recording.
    requests: VecDeque<HostMessage>,
    /// Of the fresh robot, not yet compared.
    answers: VecDeque<RobotMessage>,
    verdict: Verdict,
}

impl<'o, S: Scalar> Player<'o, S> {
    fn new(overrides: &'o [(Id, f64)]) -> Self {
        let mut robot = Robot::default();
        // Nothing is to be homed here.
        robot.handle(&HostMessage::SimulatedSensors(true), &mut |_| {});
        Player {
            robot,
            overrides,
            from_host: Numbering::default(),
            from_robot: Numbering::default(),
            lockstep: false,
            restarted: false,
            requests: VecDeque::new(),
            answers: VecDeque::new(),
            verdict: Verdict::default(),
        }
    }

    /// The host's message, carried out by the fresh robot.
    fn carry_out(&mut self, message: &HostMessage, observe: &mut impl FnMut(Event<S>)) {
        let restarts = matches!(message, HostMessage::Restart { .. });
        if restarts {
            for &(id, value) in self.overrides {
                // Checked on the command line; a parameter of the plant has no effect on the brain.
                let _ = self.robot.set(id, value);
            }
        }
        let answers = &mut self.answers;
        let mut stepped = false;
        self.robot.handle(message, &mut |reply| {
            stepped |= matches!(reply, RobotMessage::Telemetry(_));
            answers.push_back(*reply);
        });
        if restarts {
            self.restarted = true;
            self.verdict.steps = 0;
            observe(Event::Restart);
        }
        if stepped {
            self.verdict.steps += 1;
            observe(Event::Step(&self.robot));
        }
    }

    /// What the recorded robot said.
    fn heard(&mut self, said: &RobotMessage, observe: &mut impl FnMut(Event<S>)) {
        if matches!(said, RobotMessage::Vitals(_)) {
            return;
        }
        if self.lockstep {
            // An answer that was lost at first has come after the next one.
            let kind = std::mem::discriminant(said);
            let at = self.answers.iter().position(|answer| std::mem::discriminant(answer) == kind).unwrap_or(0);
            let replayed = self.answers.remove(at);
            self.compare(said, replayed.as_ref());
            return;
        }
        if let Some(request) = self.requests.front().copied().filter(|request| request.is_answered_by(said)) {
            self.requests.pop_front();
            if let (HostMessage::SimulatedSensors(simulated), RobotMessage::State(_)) = (request, said) {
                self.lockstep = simulated;
            } else {
                self.carry_out(&request, observe);
            }
            let replayed = self.answers.drain(..).next_back();
            if matches!(said, RobotMessage::Parameter { .. }) {
                self.compare(said, replayed.as_ref());
            }
        } else if let (RobotMessage::Telemetry(recorded), true) = (said, self.restarted) {
            // The state is that in which the brain took this step. Why it was disarmed or in Fault no brain can know.
            match (recorded.state, self.robot.safety_state()) {
                (SafetyState::Armed, SafetyState::Armed) => {}
                (SafetyState::Armed, _) => self.robot.handle(&HostMessage::Arm, &mut |_| {}),
                _ => self.robot.handle(&HostMessage::Disarm, &mut |_| {}),
            }
            self.robot.control_step(recorded.x);
            let replayed = Telemetry { state: recorded.state, ..self.robot.telemetry() };
            self.verdict.steps += 1;
            observe(Event::Step(&self.robot));
            self.compare(said, Some(&RobotMessage::Telemetry(replayed)));
        }
    }

    fn compare(&mut self, recorded: &RobotMessage, replayed: Option<&RobotMessage>) {
        let verdict = &mut self.verdict;
        verdict.recorded += 1;
        if replayed.is_some_and(|replayed| bits(replayed) == bits(recorded)) {
            return;
        }
        // Who the recorded robot was, the fresh one cannot be.
        if matches!((recorded, replayed), (RobotMessage::Hello { .. }, Some(RobotMessage::Hello { .. }))) {
            return;
        }
        verdict.different += 1;
        if let (RobotMessage::Telemetry(recorded), Some(RobotMessage::Telemetry(replayed))) = (recorded, replayed) {
            for (a, b) in numbers(recorded).zip(numbers(replayed)) {
                verdict.largest = verdict.largest.max((f64::from(a) - f64::from(b)).abs());
            }
            verdict.first.get_or_insert((*recorded, *replayed));
        }
    }
}

/// A message as it goes over the wire: two of them are the same bit for bit, whether or not they are numbers.
fn bits(message: &RobotMessage) -> Vec<u8> {
    encode(0, message, &mut [0; MAX_FRAME]).unwrap_or_default().to_vec()
}

/// Every number of a telemetry.
fn numbers(t: &Telemetry) -> impl Iterator<Item = f32> + use<> {
    let Telemetry { x, y, c, h, a, b, xi, time_loop_error, .. } = *t;
    x.into_iter().chain(y).chain(c).chain(h).chain(a).chain(b).chain(xi).chain([time_loop_error])
}

/// The message of one whole frame; none if it is garbled, or a frame that came before.
fn decode<M: serde::de::DeserializeOwned + Opens>(frame: &[u8], numbering: &mut Numbering) -> Option<M> {
    let mut decoder = Decoder::new();
    let (number, message): (u16, M) = frame.iter().filter_map(|&byte| decoder.push(byte)).last()?.ok()?;
    (numbering.heard(number, &message) != Arrival::Again).then_some(message)
}
