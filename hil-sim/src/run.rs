//! A run: world and robot, coupled. This is where everything meets; who reads [`Run::step`] and
//! [`crate::coupling`] knows the system.
//!
//! One control step of 20 ms, at t = 0.02 k: the sensors are read, the brain acts, then learns; the record is taken (brain
//! after learning, plant as it stands at t); then the plant moves on under the new commands. A body with an IMU and
//! encoders does the same in twenty servo ticks of 1 ms, the brain in the first of them.

use crate::coupling::{Coupling, demand};
use crate::link::{Answer, LinkError};
use crate::plant::{BodyError, Load, Plant};
use crate::record::{BrainRecord, Record};
use crate::schedule::{Action, Schedule};
use crate::setup::{SetError, Setup};
use crate::world::World;
use protocol::message::SafetyState;
use protocol::parameter::Scope;
use protocol::{HostMessage, Id, RobotMessage};
use std::fmt;

/// Parameters that make the barrel or its start; the rest may change while it rolls.
const ONLY_AT_START: [Id; 9] =
    [Id::Phi0, Id::Omega0, Id::Tilt0, Id::Radius, Id::Length, Id::ShellMass, Id::WeightMass, Id::AxesShift, Id::Range];

/// A world and a robot in it.
#[derive(Debug)]
pub struct Run<C> {
    world: World,
    link: C,
    /// What is still to be done to the barrel.
    schedule: Schedule,
    /// The next control step.
    step: u64,
    /// The robot's state after the last step.
    state: SafetyState,
}

/// Why a run did not start or go on.
#[derive(Clone, Debug, PartialEq)]
pub enum RunError {
    /// The robot cannot be reached or understood.
    Link(LinkError),
    /// The parameters make no barrel.
    Body(BodyError),
    /// A parameter was given a value that it does not take.
    Set(SetError),
    /// The parameter only matters at the start.
    OnlyAtStart(Id),
    /// The simulated barrel left what its equations can follow.
    Plant {
        /// When, s.
        t: f64,
    },
}

impl fmt::Display for RunError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            RunError::Link(error) => error.fmt(f),
            RunError::Body(error) => error.fmt(f),
            RunError::Set(error) => error.fmt(f),
            RunError::OnlyAtStart(id) => {
                write!(f, "{} only matters at the start: give it with --set when the run begins", id.name())
            }
            RunError::Plant { t } => write!(
                f,
                "the simulated barrel broke down at {t:.2} s: its numbers are no longer finite; choose less extreme parameters"
            ),
        }
    }
}

impl std::error::Error for RunError {}

impl From<LinkError> for RunError {
    fn from(error: LinkError) -> Self {
        RunError::Link(error)
    }
}

impl From<BodyError> for RunError {
    fn from(error: BodyError) -> Self {
        RunError::Body(error)
    }
}

impl<C: Coupling> Run<C> {
    /// Builds the world, hands the robot its parameters and arms it.
    ///
    /// # Errors
    /// Parameters that make no barrel; a robot that cannot be reached, differs in version or refuses.
    pub fn start(setup: Setup, mut link: C) -> Result<Self, RunError> {
        if let Some(id) = setup.schedule.iter().find_map(|event| only_at_start(&event.action)) {
            return Err(RunError::OnlyAtStart(id));
        }
        let schedule = Schedule::new(&setup.schedule, setup.seed);
        let mut world = World::new(setup)?;
        link.start(&mut world)?;
        world.let_go();
        Ok(Run { world, link, schedule, step: 0, state: SafetyState::Armed })
    }

    /// One control step of 20 ms, and before it what the schedule has for it.
    ///
    /// # Errors
    /// A robot that does not answer, or that refuses its sensors; a plant that broke down; those of [`Run::act`].
    pub fn step(&mut self) -> Result<Record, RunError> {
        while let Some(action) = self.schedule.due(self.step) {
            self.act(action)?;
        }
        if !self.world.is_finite() {
            return Err(RunError::Plant { t: self.time() });
        }
        let step = self.link.control_step(&mut self.world)?;
        self.state = step.telemetry.state;
        // Telemetry that was lost on the way leaves a gap in time, not in the count.
        let tick = u64::from(step.telemetry.tick);
        self.step = tick + 1;
        Ok(Record { brain: BrainRecord::from_telemetry(&step.telemetry, time(tick)), plant: step.plant })
    }

    /// Ends the run: the robot is left disarmed, with its own sensors.
    ///
    /// # Errors
    /// A robot that does not answer.
    pub fn finish(&mut self) -> Result<(), RunError> {
        Ok(self.link.finish(&mut self.world)?)
    }

    /// Time of the next control step, s.
    pub fn time(&self) -> f64 {
        time(self.step)
    }

    /// The robot's safety state after the last step.
    pub fn state(&self) -> SafetyState {
        self.state
    }

    /// What the run was started with, and what was changed since.
    pub fn setup(&self) -> &Setup {
        self.world.setup()
    }

    /// The simulated barrel.
    pub fn plant(&self) -> &Plant {
        self.world.plant()
    }

    /// The link, for what the robot says of itself.
    pub fn link(&self) -> &C {
        &self.link
    }

    /// The link, for its tape.
    pub fn link_mut(&mut self) -> &mut C {
        &mut self.link
    }

    /// The barrel and its surroundings.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Pushes the barrel from now on: with a torque about its axis, N·m, and a force along the ground across it, N.
    pub fn push(&mut self, torque: f64, force: f64, seconds: f64) {
        self.world.push(torque, force, seconds);
    }

    /// Pulls at the barrel from now on, until another load is given.
    pub fn pull(&mut self, load: Load) {
        self.world.pull(load);
    }

    /// Does something to the barrel, now. Random numbers come from the run's seed, and go on from one action to the next.
    ///
    /// # Errors
    /// Those of [`Run::set`]. An entry that would leave its range ends at its bound.
    pub fn act(&mut self, action: Action) -> Result<(), RunError> {
        if let Action::Set(id, value) = action {
            return self.set(id, value).map(drop);
        }
        for &id in action.random_entries() {
            let now = match action {
                Action::Scatter(_) => self.get(id)?,
                _ => 0.0,
            };
            let value = action.drawn(id, now, &mut self.schedule);
            self.set(id, value)?;
        }
        Ok(())
    }

    /// The value of a parameter now: the robot's own, where it holds it.
    ///
    /// # Errors
    /// A robot that does not answer.
    pub fn get(&mut self, id: Id) -> Result<f64, RunError> {
        let set = self.world.setup().values.get(id);
        if !id.parameter().scope.is_robot() {
            return Ok(set);
        }
        Ok(as_set(demand(self.ask(&HostMessage::GetParameter { index: id.index() }))?, set))
    }

    /// Sets a parameter while the run goes on, and returns its value as it is held now.
    ///
    /// # Errors
    /// A value out of range, or a parameter that only matters at the start; nothing is then changed.
    pub fn set(&mut self, id: Id, value: f64) -> Result<f64, RunError> {
        if ONLY_AT_START.contains(&id) && value != self.world.setup().values.get(id) {
            return Err(RunError::OnlyAtStart(id));
        }
        let mut changed = self.world.setup().clone();
        changed.set(id, value).map_err(RunError::Set)?;
        self.world.change(changed, matches!(id.parameter().scope, Scope::Plant | Scope::Servo))?;
        if !id.parameter().scope.is_robot() {
            return Ok(value);
        }
        let held = demand(self.ask(&HostMessage::SetParameter { index: id.index(), value: value as f32 }))?;
        Ok(as_set(held, value))
    }

    /// Arms, disarms, stops or clears; returns the robot's state afterwards.
    ///
    /// # Errors
    /// The robot's refusal, or no answer.
    pub fn command(&mut self, message: &HostMessage) -> Result<SafetyState, RunError> {
        match self.ask(message)?.message {
            RobotMessage::State(state) => Ok(state),
            RobotMessage::Refused(refusal) => Err(LinkError::Refused(refusal).into()),
            _ => Err(LinkError::NoAnswer.into()),
        }
    }

    /// Asks the robot anything.
    ///
    /// # Errors
    /// No answer.
    pub fn ask(&mut self, message: &HostMessage) -> Result<Answer, LinkError> {
        self.link.request(message, &mut self.world)
    }
}

/// The parameter that an action would set, if it only matters at the start.
pub fn only_at_start(action: &Action) -> Option<Id> {
    match action {
        Action::Set(id, _) if ONLY_AT_START.contains(id) => Some(*id),
        _ => None,
    }
}

/// Time of control step k, s: the double nearest to k/50.
pub fn time(step: u64) -> f64 {
    step as f64 / 50.0
}

/// A robot's single-precision value as a person would write it: as it was set, if it is that, else its shortest decimal.
pub fn as_set(held: f32, set: f64) -> f64 {
    if set as f32 == held { set } else { in_decimal(held) }
}

/// A robot's single-precision value as a person would write it: its shortest decimal.
pub fn in_decimal(held: f32) -> f64 {
    held.to_string().parse().unwrap_or(f64::from(held))
}
