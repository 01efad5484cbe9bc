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
    /// What a hand pulls at the barrel with, until it lets go.
    hand: Load,
    /// What the chips read last.
    transducers: Option<Transducers>,
}

impl World {
    /// The setup's barrel where the run starts.
    ///
    /// # Errors
    /// Parameters that make no barrel.
    pub fn new(setup: Setup) -> Result<Self, BodyError> {
        let plant = placed(&setup)?;
        let sensors = Sensors::new(&setup);
        Ok(World { setup, plant, sensors, milliseconds: 0, held: false, hand: Load::default(), transducers: None })
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
        *self.transducers.insert(self.sensors.transducers(&self.plant, self.held))
    }

    /// What the chips read last; nothing in a body without them.
    pub fn last_transducers(&self) -> Option<&Transducers> {
        self.transducers.as_ref()
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
            self.plant.set_load(self.hand);
            self.plant.advance(dt);
            return;
        }
        let step = self.plant.body().step.min(dt);
        for i in 0..(dt / step).round() as u32 {
            let (from, to) = (t + f64::from(i) * step, t + f64::from(i + 1) * step);
            self.plant.set_load(self.load(from, to, step));
            self.plant.advance(step);
        }
        self.plant.set_load(self.hand);
    }

    /// The mean of all that pushes and pulls at the barrel between two instants, s, which are `step` apart.
    fn load(&self, from: f64, to: f64, step: f64) -> Load {
        let mean = |of: fn(&Push) -> f64| -> f64 {
            self.setup.pushes.iter().map(|p| of(p) * overlap(p, from, to) / step).sum()
        };
        let (torque, force) = (mean(|p| p.torque), mean(|p| p.force));
        let mut load = Load { axis_torque: self.hand.axis_torque + torque, ..self.hand };
        for (sum, way) in load.force_world.iter_mut().zip(self.across()) {
            *sum += force * way;
        }
        load
    }

    /// Along the ground and across the cylinder axis, to where a barrel with positive omega rolls; of one that stands upright,
    /// along the ground's X.
    fn across(&self) -> [f64; 3] {
        let [_, [x, y, _], _] = self.plant.axes();
        let level = libm::hypot(x, y);
        if level < 1e-3 { [1.0, 0.0, 0.0] } else { [y / level, -x / level, 0.0] }
    }

    /// Pushes the barrel from now on: with a torque about its axis, N·m, and a force along the ground across it, N.
    pub fn push(&mut self, torque: f64, force: f64, seconds: f64) {
        let start = self.time();
        self.setup.pushes.retain(|p| p.start + p.seconds > start);
        self.setup.pushes.push(Push { start, torque, force, seconds });
    }

    /// Pulls at the barrel from now on, until another load is given.
    pub fn pull(&mut self, load: Load) {
        self.hand = load;
    }

    /// All that pushes and pulls at the barrel now.
    pub fn load_now(&self) -> Load {
        let t = self.time();
        self.load(t, t + SERVO_PERIOD, SERVO_PERIOD)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::EXPERIMENTS;
    use crate::setup::BodyKind;

    /// The chapter's barrel, lying or upright, without what would move it by itself.
    fn at_rest(tilt: f64) -> World {
        let mut setup = Setup::new(&EXPERIMENTS[0], BodyKind::Chapter);
        setup.set(Id::Phi0, 0.785).expect("in range");
        setup.set(Id::Tilt0, tilt).expect("in range");
        World::new(setup).expect("a barrel")
    }

    fn milliseconds(world: &mut World, milliseconds: u32) {
        for _ in 0..milliseconds / 10 {
            world.advance(10, Command::MotorValues([0.0; 2]));
        }
    }

    #[test]
    fn a_shove_rolls_a_lying_barrel_to_where_omega_is_positive_and_ends() {
        let mut world = at_rest(0.0);
        world.push(0.0, 30.0, 0.1);
        assert_eq!(world.load_now().force_world, [30.0, 0.0, 0.0]);
        milliseconds(&mut world, 100);
        assert!(world.plant().omega() > 0.5, "{} rad/s", world.plant().omega());
        assert_eq!(world.load_now(), Load::default());
    }

    #[test]
    fn a_shove_the_other_way_is_the_mirror_image() {
        let omega = |force| {
            let mut world = at_rest(0.0);
            world.push(0.0, force, 0.02);
            milliseconds(&mut world, 20);
            world.plant().omega()
        };
        assert!(omega(30.0) > 0.0 && omega(-30.0) < 0.0);
    }

    #[test]
    fn a_shove_moves_an_upright_barrel_along_the_ground() {
        let mut world = at_rest(core::f64::consts::FRAC_PI_2);
        world.push(0.0, 30.0, 0.2);
        milliseconds(&mut world, 200);
        let [x, y, _] = world.plant().position();
        assert!(x > 0.01 && y.abs() < 1e-3, "{x} {y}");
    }

    #[test]
    fn a_hand_pulls_until_it_lets_go() {
        let mut world = at_rest(0.0);
        world.pull(Load { force_world: [10.0, 0.0, 0.0], ..Load::default() });
        milliseconds(&mut world, 100);
        let pulled = world.plant().velocity()[0];
        assert!(pulled > 0.1, "{pulled} m/s");
        world.push(1.0, 0.0, 0.05);
        let both = world.load_now();
        assert!((both.axis_torque - 1.0).abs() < 1e-9 && both.force_world == [10.0, 0.0, 0.0], "{both:?}");
        world.pull(Load::default());
        milliseconds(&mut world, 100);
        assert_eq!(world.load_now(), Load::default());
    }
}
