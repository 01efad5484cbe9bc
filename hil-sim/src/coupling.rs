//! How a robot and the simulated world are coupled: in lock-step of frames, the world's sensors inside them.
//!
//! A [`crate::link::Link`] couples by its frames: time passes only between an answer and the next request. A robot whose own
//! chips sense the world is coupled by its pins, and time passes for both together whatever is said on the wire.

use crate::link::{Answer, Direction, Link, LinkError, hello};
use crate::record::PlantRecord;
use crate::run::RunError;
use crate::setup::BodyKind;
use crate::world::{Command, World, parameter_messages};
use firmware::timing::SERVO_TICKS;
use protocol::message::{SafetyState, Vitals};
use protocol::{HostMessage, RobotMessage, Telemetry};

/// One control step: the brain after it, and the world as it was when its sensors were read.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// The brain.
    pub telemetry: Telemetry,
    /// The barrel.
    pub plant: PlantRecord,
}

/// A robot that can be put into a world.
pub trait Coupling {
    /// Readies the robot for a run: the setup's parameters, a brain afresh, Armed. The world is held at its start and let go
    /// by the run.
    ///
    /// # Errors
    /// A robot that cannot be reached, differs in version or refuses; parameters that make no barrel.
    fn start(&mut self, world: &mut World) -> Result<(), RunError>;

    /// Asks the robot something. Where time does not wait for the answer, it passes in `world`, too.
    ///
    /// # Errors
    /// No answer.
    fn request(&mut self, message: &HostMessage, world: &mut World) -> Result<Answer, LinkError>;

    /// Goes on until the brain has taken its next step.
    ///
    /// # Errors
    /// A robot that does not answer, or that refuses its sensors.
    fn control_step(&mut self, world: &mut World) -> Result<Step, LinkError>;

    /// Leaves the robot as it should be found: disarmed, with its own sensors.
    ///
    /// # Errors
    /// No answer.
    fn finish(&mut self, world: &mut World) -> Result<(), LinkError>;

    /// Hands over every frame that went over the wire since the last call, in order. Empty where there is no wire.
    fn drain_frames(&mut self, sink: &mut dyn FnMut(Direction, &[u8]));

    /// What the robot last said of itself. A robot without a board has nothing to say.
    fn vitals(&self) -> Option<&Vitals>;
}

impl<L: Link> Coupling for L {
    fn start(&mut self, world: &mut World) -> Result<(), RunError> {
        hello(self)?;
        demand(self.request(&HostMessage::Disarm))?;
        demand(self.request(&HostMessage::SimulatedSensors(true)))?;
        // A robot without the chips that it looks for is in Fault until it is told not to look.
        demand(self.request(&HostMessage::ClearFault))?;
        for message in parameter_messages(world.setup()) {
            demand(self.request(&message))?;
        }
        demand(self.request(&HostMessage::Restart { seed: world.setup().seed }))?;
        demand(self.request(&HostMessage::Arm))?;
        Ok(world.hold_at_start()?)
    }

    fn request(&mut self, message: &HostMessage, _world: &mut World) -> Result<Answer, LinkError> {
        Link::request(self, message)
    }

    fn control_step(&mut self, world: &mut World) -> Result<Step, LinkError> {
        match world.setup().body {
            BodyKind::Chapter => step_inclination(self, world),
            BodyKind::Tabletop => step_transducers(self, world),
        }
    }

    fn finish(&mut self, _world: &mut World) -> Result<(), LinkError> {
        demand(Link::request(self, &HostMessage::Disarm))?;
        demand(Link::request(self, &HostMessage::SimulatedSensors(false)))?;
        Ok(())
    }

    fn drain_frames(&mut self, sink: &mut dyn FnMut(Direction, &[u8])) {
        Link::drain_frames(self, sink);
    }

    fn vitals(&self) -> Option<&Vitals> {
        Link::vitals(self)
    }
}

/// The body measures its inclination and servoes its weights itself: one exchange a step.
fn step_inclination(link: &mut impl Link, world: &mut World) -> Result<Step, LinkError> {
    let x = world.inclination();
    let answer = link.request(&HostMessage::Inclination { x })?;
    let telemetry = telemetry(&answer)?;
    let plant = world.record();
    let command = match telemetry.state {
        SafetyState::Armed => Command::MotorValues(telemetry.y.map(f64::from)),
        SafetyState::Disarmed | SafetyState::Fault(_) => Command::Off,
    };
    world.advance(u32::from(SERVO_TICKS), command);
    Ok(Step { telemetry, plant })
}

/// The robot senses through its chips and servoes the weights: one exchange a servo tick, the brain in the first of twenty.
fn step_transducers(link: &mut impl Link, world: &mut World) -> Result<Step, LinkError> {
    let mut step = None;
    for tick in 0..SERVO_TICKS {
        let answer = link.request(&HostMessage::Transducers(world.transducers()))?;
        if tick == 0 {
            step = Some(Step { telemetry: telemetry(&answer)?, plant: world.record() });
        }
        match answer.message {
            RobotMessage::Actuators { duty } => world.advance(1, Command::Duty(duty.map(f64::from))),
            RobotMessage::Refused(refusal) => return Err(LinkError::Refused(refusal)),
            _ => return Err(LinkError::NoAnswer),
        }
    }
    step.ok_or(LinkError::NoAnswer)
}

fn telemetry(answer: &Answer) -> Result<Telemetry, LinkError> {
    answer.telemetry.ok_or(match answer.message {
        RobotMessage::Refused(refusal) => LinkError::Refused(refusal),
        _ => LinkError::NoAnswer,
    })
}

/// Takes the answer to something that a run cannot do without; returns the parameter's value where one was set or asked for.
pub(crate) fn demand(answer: Result<Answer, LinkError>) -> Result<f32, LinkError> {
    match answer?.message {
        RobotMessage::Parameter { value, .. } => Ok(value),
        RobotMessage::State(_) => Ok(0.0),
        RobotMessage::Refused(refusal) => Err(LinkError::Refused(refusal)),
        _ => Err(LinkError::NoAnswer),
    }
}
