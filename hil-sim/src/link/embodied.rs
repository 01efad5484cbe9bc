//! A robot in the simulated body: its own chips sense the world, its own motor pins move the weights, and it says what it
//! wants on a wire. Time passes for robot and world together, a servo period at a time, whatever is said.

use super::{Answer, Direction, HELLO, LinkError, Wire, recognise};
use crate::coupling::{Coupling, Step, demand};
use crate::record::PlantRecord;
use crate::run::RunError;
use crate::world::{Command, World, parameter_messages};
use firmware::timing::SERVO_TICKS;
use protocol::message::{Refusal, SafetyState, Transducers, Vitals};
use protocol::{HostMessage, RobotMessage};
use std::collections::VecDeque;

/// A robot with chips and motor pins.
pub trait Board {
    /// Lets one servo period pass: `transducers` is what the chips are exposed to, `to_robot` arrives at the robot's port,
    /// what it sends is appended to `from_robot`. Returns the duty of both motors, −1…1, as the pins have it at the end.
    ///
    /// # Errors
    /// A board that stopped.
    fn tick(
        &mut self,
        transducers: &Transducers,
        to_robot: &[u8],
        from_robot: &mut Vec<u8>,
    ) -> Result<[f32; 2], LinkError>;
}

/// Servo periods after which an unanswered request is sent again.
const PATIENCE: u32 = 50;
/// How often a request is sent. A start makes more than a hundred, and on a line that loses one byte in 200 every
/// third exchange may fail.
const ATTEMPTS: u32 = 20;
/// Servo periods between two looks at a robot that is homing.
const HOMING_LOOK: u32 = 100;
/// Servo periods after which homing should be over.
const HOMING_LIMIT: u32 = 30_000;
/// Servo periods that the world is remembered for: telemetry takes some of them on the wire.
const REMEMBERED: usize = 100;

/// A board in the simulated body.
#[derive(Debug)]
pub struct Embodied<B> {
    board: B,
    wire: Wire,
    /// On their way to the robot.
    outbox: Vec<u8>,
    /// Control steps that have been reported and not been asked for yet.
    steps: VecDeque<Step>,
    vitals: Option<Vitals>,
    memory: Memory,
    /// The next state that is reported answers the restart with which the run begins.
    beginning: bool,
}

impl<B: Board> Embodied<B> {
    /// Puts `board` into the body.
    pub fn new(board: B) -> Self {
        Embodied {
            board,
            wire: Wire::default(),
            outbox: Vec::new(),
            steps: VecDeque::new(),
            vitals: None,
            memory: Memory::default(),
            beginning: false,
        }
    }

    /// The board itself.
    pub fn board_mut(&mut self) -> &mut B {
        &mut self.board
    }

    /// Frames of the robot that did not arrive or arrived garbled.
    pub fn lost(&self) -> u32 {
        self.wire.lost() + self.wire.garbled()
    }

    /// Says something to the robot without waiting for its answer.
    pub fn send(&mut self, message: &HostMessage) {
        let frame = self.wire.frame(message);
        self.wire.sent(&frame);
        self.outbox.extend_from_slice(&frame);
    }

    /// One servo period of robot and world. Returns what the robot said in it besides telemetry and vitals.
    ///
    /// # Errors
    /// A board that stopped.
    pub fn tick(&mut self, world: &mut World) -> Result<Vec<RobotMessage>, LinkError> {
        self.memory.note(world.record());
        let mut bytes = Vec::new();
        let duty = self.board.tick(&world.transducers(), &std::mem::take(&mut self.outbox), &mut bytes)?;
        world.advance(1, Command::Duty(duty.map(f64::from)));
        let mut said = Vec::new();
        for byte in bytes {
            self.memory.byte();
            match self.wire.push(byte) {
                Some(Ok(RobotMessage::Telemetry(telemetry))) => {
                    self.steps.push_back(Step { telemetry, plant: self.memory.at(telemetry.tick) });
                }
                Some(Ok(RobotMessage::Vitals(vitals))) => self.vitals = Some(vitals),
                Some(Ok(message)) => {
                    if self.beginning && matches!(message, RobotMessage::State(_)) {
                        self.beginning = false;
                        self.steps.clear();
                        self.memory.begin();
                    }
                    said.push(message);
                }
                // Counted by the wire: a request is repeated, a lost step is a gap.
                Some(Err(_)) | None => {}
            }
            if byte == 0 {
                self.memory.end_frame();
            }
        }
        Ok(said)
    }

    /// Demands something that a robot in Fault refuses; the error then says what the fault is.
    fn insist(&mut self, message: &HostMessage, world: &mut World) -> Result<(), LinkError> {
        let refused = match demand(self.request(message, world)) {
            Err(refused @ LinkError::Refused(Refusal::InFault)) => refused,
            answer => return answer.map(|_| ()),
        };
        match recognise(&self.request(&HELLO, world)?.message)?.state {
            SafetyState::Fault(code) => {
                Err(LinkError::Broken(format!("the robot cannot be started, it is in Fault: {code}")))
            }
            SafetyState::Disarmed | SafetyState::Armed => Err(refused),
        }
    }

    /// Drives the weights to their stops and back to the middle.
    fn home(&mut self, world: &mut World) -> Result<(), RunError> {
        self.insist(&HostMessage::Home, world)?;
        for _ in 0..HOMING_LIMIT / HOMING_LOOK {
            for _ in 0..HOMING_LOOK {
                self.tick(world)?;
            }
            let answer = self.request(&HELLO, world)?;
            match recognise(&answer.message)?.state {
                SafetyState::Armed => {}
                SafetyState::Disarmed => return Ok(()),
                SafetyState::Fault(code) => {
                    return Err(
                        LinkError::Broken(format!("the robot did not find the middle of its axes: {code}")).into()
                    );
                }
            }
        }
        Err(LinkError::Broken("the robot does not come to an end with homing".to_owned()).into())
    }
}

impl<B: Board> Coupling for Embodied<B> {
    fn start(&mut self, world: &mut World) -> Result<(), RunError> {
        // On the floor from the first word on: a barrel that rolls faster than its gyroscope can follow is in Fault.
        world.lie_down()?;
        recognise(&self.request(&HELLO, world)?.message)?;
        for message in [HostMessage::Disarm, HostMessage::SimulatedSensors(false), HostMessage::ClearFault] {
            demand(self.request(&message, world))?;
        }
        self.home(world)?;
        let mut exchange = u32::MAX;
        for message in parameter_messages(world.setup()).collect::<Vec<_>>() {
            let asked = self.memory.now;
            demand(self.request(&message, world))?;
            exchange = exchange.min((self.memory.now - asked) as u32);
        }
        // The barrel is set down where the run starts: its attitude is found anew by the first restart, which a disarmed
        // robot takes for a move. The second one is where the run begins, at the end of three exchanges.
        world.hold_before_start(3 * exchange - 1)?;
        let restart = HostMessage::Restart { seed: world.setup().seed };
        for message in [restart, HostMessage::Arm] {
            self.insist(&message, world)?;
        }
        self.beginning = true;
        demand(self.request(&restart, world))?;
        Ok(())
    }

    fn request(&mut self, message: &HostMessage, world: &mut World) -> Result<Answer, LinkError> {
        let frame = self.wire.frame(message);
        for _ in 0..ATTEMPTS {
            self.wire.sent(&frame);
            self.outbox.extend_from_slice(&frame);
            for _ in 0..PATIENCE {
                let said = self.tick(world)?;
                if let Some(answer) = said.into_iter().find(|reply| message.is_answered_by(reply)) {
                    return Ok(Answer { message: answer, telemetry: None });
                }
            }
        }
        Err(LinkError::NoAnswer)
    }

    fn control_step(&mut self, world: &mut World) -> Result<Step, LinkError> {
        for _ in 0..ATTEMPTS * PATIENCE {
            if let Some(step) = self.steps.pop_front() {
                return Ok(step);
            }
            self.tick(world)?;
        }
        Err(LinkError::NoAnswer)
    }

    fn finish(&mut self, world: &mut World) -> Result<(), LinkError> {
        demand(self.request(&HostMessage::Disarm, world)).map(|_| ())
    }

    fn drain_frames(&mut self, sink: &mut dyn FnMut(Direction, &[u8])) {
        self.wire.drain(sink);
    }

    fn vitals(&self) -> Option<&Vitals> {
        self.vitals.as_ref()
    }
}

/// The world as it was a little while ago: telemetry arrives later than the sensors were read.
#[derive(Debug, Default)]
struct Memory {
    records: VecDeque<PlantRecord>,
    /// Servo periods so far; the last record is of the one before.
    now: u64,
    /// In which period the frame that is arriving began.
    frame: Option<u64>,
    /// The period of control step 0, as far as is known.
    origin: Option<u64>,
}

impl Memory {
    fn note(&mut self, record: PlantRecord) {
        self.records.push_back(record);
        if self.records.len() > REMEMBERED {
            self.records.pop_front();
        }
        self.now += 1;
    }

    /// Control steps are counted from the next one on.
    fn begin(&mut self) {
        self.origin = None;
    }

    fn byte(&mut self) {
        self.frame.get_or_insert(self.now - 1);
    }

    fn end_frame(&mut self) {
        self.frame = None;
    }

    /// The world when the sensors of control step `tick` were read. Its telemetry leaves in the same period, unless the line
    /// is busy: the earliest that was seen is right for all.
    fn at(&mut self, tick: u32) -> PlantRecord {
        let since = u64::from(tick) * u64::from(SERVO_TICKS);
        let arrived = self.frame.unwrap_or(self.now - 1);
        let seen = arrived.saturating_sub(since);
        let origin = self.origin.map_or(seen, |origin| origin.min(seen));
        self.origin = Some(origin);
        let age = (self.now - 1).saturating_sub(origin + since) as usize;
        let index = self.records.len().saturating_sub(1 + age);
        self.records.get(index).copied().unwrap_or_default()
    }
}
