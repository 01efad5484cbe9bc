//! A run: plant and robot in lock-step. This is where everything meets; who reads [`Run::step`] knows the system.
//!
//! One control step of 20 ms, at t = 0.02 k: the sensors are read, the brain acts, then learns; the record is taken (brain
//! after learning, plant as it stands at t); then the plant moves on under the new commands. A body with an IMU and
//! encoders does the same in twenty servo ticks of 1 ms, the brain in the first of them.

use crate::link::{Link, LinkError, hello};
use crate::plant::{BodyError, Load, Plant, Start};
use crate::record::{BrainRecord, PlantRecord, Record};
use crate::sensors::Sensors;
use crate::setup::{BodyKind, Push, SetError, Setup};
use firmware::Robot;
use firmware::timing::{CONTROL_PERIOD, SERVO_PERIOD, SERVO_TICKS};
use protocol::message::SafetyState;
use protocol::parameter::Scope;
use protocol::{HostMessage, Id, RobotMessage, Telemetry};
use std::fmt;

/// Parameters that make the barrel or its start; the rest may change while it rolls.
const ONLY_AT_START: [Id; 9] =
    [Id::Phi0, Id::Omega0, Id::Tilt0, Id::Radius, Id::Length, Id::ShellMass, Id::WeightMass, Id::AxesShift, Id::Range];

/// A plant and a robot, coupled.
#[derive(Debug)]
pub struct Run<L> {
    setup: Setup,
    plant: Plant,
    sensors: Sensors,
    link: L,
    step: u64,
    /// The robot's state after the last step; unless Armed, the weights run free.
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

impl<L: Link> Run<L> {
    /// Builds the plant, hands the robot its parameters and arms it.
    ///
    /// # Errors
    /// Parameters that make no barrel; a robot that cannot be reached, differs in version or refuses.
    pub fn start(setup: Setup, mut link: L) -> Result<Self, RunError> {
        let mut plant = Plant::new(setup.plant_body(), start(&setup))?;
        plant.count_roll_from(setup.values.get(Id::Phi0));
        let sensors = Sensors::new(&setup);
        hello(&mut link)?;
        demand(&mut link, &HostMessage::Disarm)?;
        demand(&mut link, &HostMessage::SimulatedSensors(true))?;
        for message in parameter_messages(&setup) {
            demand(&mut link, &message)?;
        }
        demand(&mut link, &HostMessage::Restart { seed: setup.seed })?;
        demand(&mut link, &HostMessage::Arm)?;
        place_weights(&mut plant, &setup, &sensors);
        Ok(Run { setup, plant, sensors, link, step: 0, state: SafetyState::Armed })
    }

    /// One control step of 20 ms.
    ///
    /// # Errors
    /// A robot that does not answer, or that refuses its sensors; a plant that broke down.
    pub fn step(&mut self) -> Result<Record, RunError> {
        if !(self.plant.phi().is_finite() && self.plant.position().iter().all(|p| p.is_finite())) {
            return Err(RunError::Plant { t: self.time() });
        }
        match self.setup.body {
            BodyKind::Chapter => self.step_inclination(),
            BodyKind::Tabletop => self.step_transducers(),
        }
    }

    /// The body measures its inclination and servoes its weights itself: one exchange a step.
    fn step_inclination(&mut self) -> Result<Record, RunError> {
        let x = self.sensors.inclination(&self.plant);
        let answer = self.link.request(&HostMessage::Inclination { x })?;
        let telemetry = telemetry(answer.telemetry, answer.message)?;
        let record = self.record(&telemetry);
        self.state = telemetry.state;
        let armed = self.state == SafetyState::Armed;
        if armed {
            self.plant.set_command(telemetry.y.map(f64::from));
        }
        self.plant.set_drive(armed);
        self.advance(CONTROL_PERIOD, self.step as f64 * CONTROL_PERIOD);
        self.step += 1;
        Ok(record)
    }

    /// The robot senses through its chips and servoes the weights: one exchange a servo tick.
    fn step_transducers(&mut self) -> Result<Record, RunError> {
        let mut record = None;
        for tick in 0..SERVO_TICKS {
            let transducers = self.sensors.transducers(&self.plant);
            let answer = self.link.request(&HostMessage::Transducers(transducers))?;
            if tick == 0 {
                let telemetry = telemetry(answer.telemetry, answer.message)?;
                self.state = telemetry.state;
                record = Some(self.record(&telemetry));
            }
            match answer.message {
                RobotMessage::Actuators { duty } => self.plant.set_command(duty.map(f64::from)),
                RobotMessage::Refused(refusal) => return Err(LinkError::Refused(refusal).into()),
                _ => return Err(LinkError::NoAnswer.into()),
            }
            let t = self.step as f64 * CONTROL_PERIOD + f64::from(tick) * SERVO_PERIOD;
            self.advance(SERVO_PERIOD, t);
        }
        self.step += 1;
        record.ok_or(RunError::Link(LinkError::NoAnswer))
    }

    /// Moves the plant on by `dt`, pushed by as much of each push as falls into each of its steps.
    fn advance(&mut self, dt: f64, t: f64) {
        let step = self.plant.body().step.min(dt);
        let steps = (dt / step).round() as u32;
        if self.setup.pushes.iter().all(|p| p.start >= t + dt || p.start + p.seconds <= t) {
            self.plant.set_load(Load::default());
            self.plant.advance(dt);
            return;
        }
        for i in 0..steps {
            let (from, to) = (t + f64::from(i) * step, t + f64::from(i + 1) * step);
            let axis_torque = self.setup.pushes.iter().map(|p| p.torque * overlap(p, from, to) / step).sum();
            self.plant.set_load(Load { axis_torque, ..Load::default() });
            self.plant.advance(step);
        }
        self.plant.set_load(Load::default());
    }

    fn record(&self, telemetry: &Telemetry) -> Record {
        Record { brain: BrainRecord::from_telemetry(telemetry, self.time()), plant: PlantRecord::of(&self.plant) }
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
        &self.setup
    }

    /// The simulated barrel.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// The link, for its tape.
    pub fn link_mut(&mut self) -> &mut L {
        &mut self.link
    }

    /// Pushes the barrel from now on.
    pub fn push(&mut self, torque: f64, seconds: f64) {
        let start = self.time();
        self.setup.pushes.retain(|p| p.start + p.seconds > start);
        self.setup.pushes.push(Push { start, torque, seconds });
    }

    /// The value of a parameter now: the robot's own, where it holds it.
    ///
    /// # Errors
    /// A robot that does not answer.
    pub fn get(&mut self, id: Id) -> Result<f64, RunError> {
        let set = self.setup.values.get(id);
        if !id.parameter().scope.is_robot() {
            return Ok(set);
        }
        Ok(in_decimal(demand(&mut self.link, &HostMessage::GetParameter { index: id.index() })?, set))
    }

    /// Sets a parameter while the run goes on, and returns its value as it is held now.
    ///
    /// # Errors
    /// A value out of range, or a parameter that only matters at the start; nothing is then changed.
    pub fn set(&mut self, id: Id, value: f64) -> Result<f64, RunError> {
        if ONLY_AT_START.contains(&id) && value != self.setup.values.get(id) {
            return Err(RunError::OnlyAtStart(id));
        }
        let mut changed = self.setup.clone();
        changed.set(id, value).map_err(RunError::Set)?;
        if matches!(id.parameter().scope, Scope::Plant | Scope::Servo) {
            self.plant.set_body(changed.plant_body())?;
        }
        self.sensors.set(&changed);
        self.setup = changed;
        if !id.parameter().scope.is_robot() {
            return Ok(value);
        }
        let held = demand(&mut self.link, &HostMessage::SetParameter { index: id.index(), value: value as f32 })?;
        Ok(in_decimal(held, value))
    }

    /// Arms, disarms, stops or clears; returns the robot's state afterwards.
    ///
    /// # Errors
    /// The robot's refusal, or no answer.
    pub fn command(&mut self, message: &HostMessage) -> Result<SafetyState, RunError> {
        match self.link.request(message)?.message {
            RobotMessage::State(state) => Ok(state),
            RobotMessage::Refused(refusal) => Err(LinkError::Refused(refusal).into()),
            _ => Err(LinkError::NoAnswer.into()),
        }
    }
}

/// The parameters that a robot holds and that no other one stands for.
pub fn robot_parameters() -> impl Iterator<Item = Id> {
    Id::ALL.iter().copied().filter(|id| id.parameter().scope.is_robot() && id.coupled().is_none())
}

/// What tells a robot the setup's parameters.
fn parameter_messages(setup: &Setup) -> impl Iterator<Item = HostMessage> {
    let value = |id| setup.values.get(id) as f32;
    robot_parameters().map(move |id| HostMessage::SetParameter { index: id.index(), value: value(id) })
}

/// Time of control step k, s: the double nearest to k/50.
pub fn time(step: u64) -> f64 {
    step as f64 / 50.0
}

/// How long a push lasts between two instants, s.
fn overlap(push: &Push, from: f64, to: f64) -> f64 {
    ((push.start + push.seconds).min(to) - push.start.max(from)).max(0.0)
}

/// Asks for something that a run cannot do without; returns the parameter's value where one was set or asked for.
fn demand(link: &mut impl Link, message: &HostMessage) -> Result<f32, LinkError> {
    match link.request(message)?.message {
        RobotMessage::Parameter { value, .. } => Ok(value),
        RobotMessage::State(_) => Ok(0.0),
        RobotMessage::Refused(refusal) => Err(LinkError::Refused(refusal)),
        _ => Err(LinkError::NoAnswer),
    }
}

/// A robot's single-precision value as a person would write it: as it was set, if it is that, else its shortest decimal.
fn in_decimal(held: f32, set: f64) -> f64 {
    if set as f32 == held { set } else { held.to_string().parse().unwrap_or(f64::from(held)) }
}

fn telemetry(telemetry: Option<Telemetry>, message: RobotMessage) -> Result<Telemetry, LinkError> {
    telemetry.ok_or(match message {
        RobotMessage::Refused(refusal) => LinkError::Refused(refusal),
        _ => LinkError::NoAnswer,
    })
}

/// How the barrel starts: lying, upright, or leaning on its rim.
fn start(setup: &Setup) -> Start {
    let get = |id| setup.values.get(id);
    let (phi, omega, tilt) = (get(Id::Phi0), get(Id::Omega0), get(Id::Tilt0));
    if tilt == 0.0 {
        return Start::Lying { phi, omega };
    }
    if tilt > core::f64::consts::FRAC_PI_2 - 1e-4 && omega == 0.0 && phi == 0.0 {
        return Start::Upright;
    }
    // First the roll about the cylinder axis, then the tilt about the heading.
    let (lean, roll) = ((libm::sin(tilt / 2.0), libm::cos(tilt / 2.0)), (libm::sin(phi / 2.0), libm::cos(phi / 2.0)));
    let (sin, cos) = (libm::sin(tilt), libm::cos(tilt));
    let height = 0.5 * get(Id::Length) * sin + get(Id::Radius) * cos;
    Start::Free {
        position: [0.0, 0.0, height],
        orientation: [lean.1 * roll.1, lean.0 * roll.1, lean.1 * roll.0, lean.0 * roll.0],
        velocity: [0.0; 3],
        angular_velocity: [0.0, omega * cos, omega * sin],
    }
}

/// Puts the weights where the brain's first command wants them: a run starts at rest, not with a jerk. The command is
/// asked of a second robot with the same parameters, which is then thrown away.
fn place_weights(plant: &mut Plant, setup: &Setup, sensors: &Sensors) {
    let mut scout = Robot::<f32>::default();
    for message in parameter_messages(setup) {
        scout.handle(&message, &mut |_| {});
    }
    scout.handle(&HostMessage::Restart { seed: setup.seed }, &mut |_| {});
    let x = sensors.clone().inclination(plant);
    let y = scout.control_step(x).y;
    let range = setup.values.get(Id::Range);
    plant.place_weights(y.map(|y| -range * f64::from(y)));
}
