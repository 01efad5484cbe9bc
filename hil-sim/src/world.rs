//! The world that a robot finds itself in: the simulated barrel, what senses it and who pushes it, on one clock.

use crate::plant::{BodyError, Load, Plant, Start};
use crate::record::PlantRecord;
use crate::sensors::Sensors;
use crate::setup::{Push, Setup};
use firmware::Robot;
use firmware::timing::SERVO_PERIOD;
use protocol::message::Transducers;
use protocol::{HostMessage, Id};

/// What moves the weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    /// Motor values of a body that servoes its weights itself, −1…1.
    MotorValues([f64; 2]),
    /// Duties of the motors, −1…1.
    Duty([f64; 2]),
    /// The weights run free.
    Off,
}

/// The simulated barrel and its surroundings.
#[derive(Clone, Debug)]
pub struct World {
    setup: Setup,
    plant: Plant,
    sensors: Sensors,
    /// Milliseconds since the start of the run.
    milliseconds: u64,
    /// Somebody has the barrel in hand: nothing moves in it, and it turns evenly, as fast as it will be let go.
    held: bool,
}

impl World {
    /// The setup's barrel where the run starts.
    ///
    /// # Errors
    /// Parameters that make no barrel.
    pub fn new(setup: Setup) -> Result<Self, BodyError> {
        let plant = placed(&setup)?;
        let sensors = Sensors::new(&setup);
        Ok(World { setup, plant, sensors, milliseconds: 0, held: false })
    }

    /// What the world was made of, and what was changed since.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// The simulated barrel.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// Time since the start of the run, s.
    pub fn time(&self) -> f64 {
        self.milliseconds as f64 / 1000.0
    }

    /// Whether every number of the barrel is one.
    pub fn is_finite(&self) -> bool {
        self.plant.phi().is_finite() && self.plant.position().iter().all(|p| p.is_finite())
    }

    /// Inclinations as the body measures them in this control step.
    pub fn inclination(&mut self) -> [f32; 2] {
        self.sensors.inclination(&self.plant)
    }

    /// What the chips read in this servo tick.
    pub fn transducers(&mut self) -> Transducers {
        self.sensors.transducers(&self.plant, self.held)
    }

    /// The barrel as it stands.
    pub fn record(&self) -> PlantRecord {
        PlantRecord::of(&self.plant)
    }

    /// Moves the barrel on by so many milliseconds under `command`, pushed by as much of each push as falls into each of
    /// the plant's steps.
    pub fn advance(&mut self, milliseconds: u32, command: Command) {
        if self.held {
            self.plant.carry_on(f64::from(milliseconds) * SERVO_PERIOD);
            return;
        }
        match command {
            Command::MotorValues(values) | Command::Duty(values) => self.plant.set_command(values),
            Command::Off => {}
        }
        self.plant.set_drive(!matches!(command, Command::Off));
        let dt = f64::from(milliseconds) * SERVO_PERIOD;
        self.move_on(dt, self.time());
        self.milliseconds += u64::from(milliseconds);
    }

    fn move_on(&mut self, dt: f64, t: f64) {
        if self.setup.pushes.iter().all(|p| p.start >= t + dt || p.start + p.seconds <= t) {
            self.plant.set_load(Load::default());
            self.plant.advance(dt);
            return;
        }
        let step = self.plant.body().step.min(dt);
        for i in 0..(dt / step).round() as u32 {
            let (from, to) = (t + f64::from(i) * step, t + f64::from(i + 1) * step);
            let axis_torque = self.setup.pushes.iter().map(|p| p.torque * overlap(p, from, to) / step).sum();
            self.plant.set_load(Load { axis_torque, ..Load::default() });
            self.plant.advance(step);
        }
        self.plant.set_load(Load::default());
    }

    /// Pushes the barrel from now on.
    pub fn push(&mut self, torque: f64, seconds: f64) {
        let start = self.time();
        self.setup.pushes.retain(|p| p.start + p.seconds > start);
        self.setup.pushes.push(Push { start, torque, seconds });
    }

    /// Takes over what was changed in the setup.
    ///
    /// # Errors
    /// Parameters that make no barrel; nothing is then changed.
    pub fn change(&mut self, setup: Setup, mechanics: bool) -> Result<(), BodyError> {
        if mechanics {
            self.plant.set_body(setup.plant_body())?;
        }
        self.sensors.set(&setup);
        self.setup = setup;
        Ok(())
    }

    /// Lays the barrel down on the floor, at rest, its weights as they are.
    ///
    /// # Errors
    /// Parameters that make no barrel.
    pub fn lie_down(&mut self) -> Result<(), BodyError> {
        let weights = self.plant.weights();
        self.plant = Plant::new(self.setup.plant_body(), Start::Lying { phi: 0.0, omega: 0.0 })?;
        self.plant.place_weights(weights);
        self.held = false;
        Ok(())
    }

    /// Takes the barrel up and holds it where the run starts, its weights where the brain's first command wants them: a run
    /// starts at rest, not with a jerk.
    ///
    /// # Errors
    /// Parameters that make no barrel.
    pub fn hold_at_start(&mut self) -> Result<(), BodyError> {
        self.hold_before_start(0)
    }

    /// As [`World::hold_at_start`], so many milliseconds earlier. A barrel that is to start rolling is rolled by hand
    /// until then, evenly: whoever senses it meanwhile finds a motion that goes on when it is let go, and no jerk either.
    ///
    /// # Errors
    /// Parameters that make no barrel.
    pub fn hold_before_start(&mut self, milliseconds: u32) -> Result<(), BodyError> {
        self.plant = placed(&self.setup)?;
        place_weights(&mut self.plant, &self.setup, &self.sensors);
        self.plant.carry_on(-f64::from(milliseconds) * SERVO_PERIOD);
        self.held = true;
        Ok(())
    }

    /// Lets go: the run begins.
    pub fn let_go(&mut self) {
        self.held = false;
        self.milliseconds = 0;
    }
}

/// What tells a robot the setup's parameters.
pub fn parameter_messages(setup: &Setup) -> impl Iterator<Item = HostMessage> {
    let value = |id| setup.values.get(id) as f32;
    robot_parameters().map(move |id| HostMessage::SetParameter { index: id.index(), value: value(id) })
}

/// The parameters that a robot holds and that no other one stands for.
pub fn robot_parameters() -> impl Iterator<Item = Id> {
    Id::ALL.iter().copied().filter(|id| id.parameter().scope.is_robot() && id.coupled().is_none())
}

/// How long a push lasts between two instants, s.
fn overlap(push: &Push, from: f64, to: f64) -> f64 {
    ((push.start + push.seconds).min(to) - push.start.max(from)).max(0.0)
}

/// The setup's plant where the run starts.
fn placed(setup: &Setup) -> Result<Plant, BodyError> {
    let mut plant = Plant::new(setup.plant_body(), start(setup))?;
    plant.count_roll_from(setup.values.get(Id::Phi0));
    Ok(plant)
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

/// Puts the weights where the brain's first command wants them. The command is asked of a second robot with the same
/// parameters, which is then thrown away.
fn place_weights(plant: &mut Plant, setup: &Setup, sensors: &Sensors) {
    let mut scout = Robot::<f32>::default();
    for message in parameter_messages(setup) {
        scout.handle(&message, &mut |_| {});
    }
    scout.handle(&HostMessage::Restart { seed: setup.seed }, &mut |_| {});
    let x = sensors.clone().inclination(plant);
    scout.control_step(x);
    let y = scout.telemetry().y;
    let (range, reach) = (setup.values.get(Id::Range), plant.body().range);
    plant.place_weights(y.map(|y| (-range * f64::from(y)).clamp(-reach, reach)));
}
