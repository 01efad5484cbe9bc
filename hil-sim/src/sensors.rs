//! What a run's robot senses: the inclination itself, or the chips that it is computed from.

use crate::plant::Plant;
use crate::setup::{BodyKind, Setup};
use crate::transducers::{Encoder, Imu, Inclination};
use protocol::Id;
use protocol::message::Transducers;

/// Bandwidth that the inertial sensor is set to, Hz: a quarter of the servo's rate.
const IMU_BANDWIDTH: f64 = 250.0;

/// The sensors of one body.
#[derive(Clone, Debug)]
pub struct Sensors {
    inclination: Inclination,
    imu: Imu,
    imu_position: [f64; 3],
    encoder: Encoder,
    body: BodyKind,
}

impl Sensors {
    /// The sensors of the setup's body, their noise from its seed.
    pub fn new(setup: &Setup) -> Self {
        let body = setup.plant_body();
        let get = |id| setup.values.get(id);
        Sensors {
            inclination: Inclination::new(get(Id::SensorNoise), get(Id::SensorNoiseTau), setup.seed),
            imu: Imu::new(IMU_BANDWIDTH, setup.seed),
            imu_position: body.imu_position,
            encoder: Encoder { counts_per_metre: body.counts_per_metre },
            body: setup.body,
        }
    }

    /// Takes over the noise of `setup`, from the next reading on.
    pub fn set(&mut self, setup: &Setup) {
        self.inclination.strength = setup.values.get(Id::SensorNoise);
        self.inclination.tau = setup.values.get(Id::SensorNoiseTau);
    }

    /// Inclinations as the robot sees them in this control step: with noise where they are measured directly, without where
    /// they are computed from chips.
    pub fn inclination(&mut self, plant: &Plant) -> [f32; 2] {
        let x = match self.body {
            BodyKind::Chapter => self.inclination.read(plant.inclination()),
            BodyKind::Tabletop => plant.inclination(),
        };
        x.map(|x| x as f32)
    }

    /// What the chips read in this servo tick, in a barrel that moves by itself or is `held`: turned evenly by hand.
    pub fn transducers(&mut self, plant: &Plant, held: bool) -> Transducers {
        let force = if held {
            plant.specific_force_in_hand(self.imu_position)
        } else {
            plant.specific_force(self.imu_position)
        };
        let reading = self.imu.read(force, plant.angular_velocity_body());
        let encoder = plant.weights().map(|s| self.encoder.read(s));
        Transducers { accelerometer: reading.accel, gyroscope: reading.gyro, encoder }
    }
}
