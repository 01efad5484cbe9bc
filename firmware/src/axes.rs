//! The `tabletop` body as its firmware sees it: the inertial sensor that tells the inclination, and the two servoed axes.
//!
//! The constants are those of the simulator's `Body::tabletop`, where the parts are named; a test
//! compares the two.

use nalgebra::Vector3;
use protocol::message::FaultCode;
use protocol::{Id, Values};

use crate::attitude::{Attitude, AttitudeSettings, ImuCalibration, ImuMonitor, ImuPatience};
use crate::servo::{Axis, Servo, ServoSettings, Stall, setpoint};
use crate::timing::{SERVO_PERIOD, SERVO_TICKS};

/// Where the inertial sensor sits, body axes, m.
pub const IMU_POSITION: [f32; 3] = [0.040, 0.105, -0.038];

/// Encoder counts per metre: 48 a turn, 4.4 : 1, 32 mm of belt a turn.
pub const COUNTS_PER_METRE: f32 = 6600.0;

/// The servo parameters of this body: what the robot holds until it is told otherwise.
///
/// A weight and its rotor are 0.65 kg: 600 N/m make it a 5 Hz servo, and 20 N leave the motor a third of its stall force.
pub const SERVO_PARAMETERS: [(Id, f64); 6] = [
    (Id::Range, 0.060),
    (Id::Kp, 600.0),
    (Id::Ki, 0.5),
    (Id::Kd, 0.06),
    (Id::DerivativeOnMeasurement, 0.0),
    (Id::MaxForce, 20.0),
];

/// One axis of this body: rail, belt and motor.
pub const AXIS: Axis = Axis {
    metres_per_count: 1.0 / COUNTS_PER_METRE,
    travel: 0.060,
    stop_play: 0.010,
    fastest: 5.0,
    stall_force: 30.0,
    free_speed: 1.2,
    back_emf: 0.8,
    duty_limit: 1.0,
    // Holding a weight against gravity takes a duty of 0.12.
    stall: Stall { duty: 0.5, movement: 0.001, ticks: 300 },
};

/// One reading of the inertial sensor, as its registers hold it, chip axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ImuCounts {
    /// Specific force, 8192 LSB/g.
    pub accelerometer: [i16; 3],
    /// Angular velocity, 16.4 LSB/(°/s).
    pub gyroscope: [i16; 3],
}

/// Inertial sensor, attitude and both servos.
#[derive(Clone, Debug)]
pub struct Axes {
    calibration: ImuCalibration,
    monitor: ImuMonitor,
    attitude: Attitude,
    servos: [Servo; 2],
    range: f32,
    positions: [f32; 2],
    /// Servo ticks since the last reading of the inertial sensor, that of the next one included.
    since_reading: u8,
}

impl Default for Axes {
    fn default() -> Self {
        let calibration = Axes::uncalibrated();
        let servo_parameter =
            |id: Id| SERVO_PARAMETERS.iter().find(|(i, _)| *i == id).map_or(0.0, |(_, value)| *value as f32);
        let servo = Servo::new(ServoSettings::from_parameters(servo_parameter), AXIS);
        Axes {
            calibration,
            monitor: ImuMonitor::new(ImuPatience::default()),
            attitude: Attitude::new(AttitudeSettings::default(), calibration.position),
            servos: [servo.clone(), servo],
            range: servo_parameter(Id::Range),
            positions: [0.0; 2],
            since_reading: 1,
        }
    }
}

impl Axes {
    /// What the sensor's counts mean as long as nobody has found out more: a perfect chip, aligned with the body.
    pub fn uncalibrated() -> ImuCalibration {
        ImuCalibration { position: Vector3::from(IMU_POSITION), ..ImuCalibration::default() }
    }

    /// Takes where the weights are in this servo tick, in encoder counts from the middle of each axis.
    pub fn locate(&mut self, counts: [i32; 2]) {
        for (i, servo) in self.servos.iter().enumerate() {
            self.positions[i] = servo.axis().position(counts[i]);
        }
    }

    /// Takes what the inertial sensor read in this servo tick; `None` if it has nothing new, as happens now and then where
    /// its clock and the servo's differ. The next reading then stands for the time that passed, as it does after one that is
    /// not believed.
    ///
    /// # Errors
    /// A reading that cannot be true; the attitude then stays as it was.
    pub fn sense(&mut self, reading: Option<&ImuCounts>) -> Result<(), FaultCode> {
        let sample = match reading {
            Some(reading) => self.monitor.read(reading.accelerometer, reading.gyroscope, &self.calibration)?,
            None => None,
        };
        let Some(sample) = sample else {
            self.since_reading = (self.since_reading + 1).min(SERVO_TICKS / 2);
            return Ok(());
        };
        let dt = f32::from(core::mem::replace(&mut self.since_reading, 1)) * SERVO_PERIOD as f32;
        Ok(self.attitude.update(&sample, dt)?)
    }

    /// How the inertial sensor's counts become physical units.
    pub fn calibration(&self) -> &ImuCalibration {
        &self.calibration
    }

    /// Uses another calibration from now on; the attitude is found anew.
    pub fn calibrate(&mut self, calibration: ImuCalibration) {
        self.calibration = calibration;
        self.attitude = Attitude::new(AttitudeSettings::default(), calibration.position);
    }

    /// Inclinations x1, x2: vertical components of the two sliding axes.
    pub fn inclination(&self) -> [f32; 2] {
        self.attitude.inclination()
    }

    /// The duty of both axes that brings the weights towards the motor values `y`.
    ///
    /// # Errors
    /// An axis that stalls or whose position cannot be true.
    pub fn servo(&mut self, y: [f32; 2]) -> Result<[f32; 2], FaultCode> {
        let mut duty = [0.0; 2];
        for i in 0..2 {
            let target = setpoint(y[i], self.range);
            duty[i] = self.servos[i].update(target, self.positions[i], SERVO_PERIOD as f32)?.duty;
        }
        Ok(duty)
    }

    /// To be called instead of [`Axes::servo`] in every tick in which the outputs are zero.
    pub fn rest(&mut self) {
        self.servos.iter_mut().for_each(Servo::reset);
    }

    /// Takes over the servo's parameters.
    pub fn retune<T: Copy>(&mut self, values: &Values<T>, to_f32: impl Fn(T) -> f32) {
        self.range = to_f32(values.get(Id::Range));
        for servo in &mut self.servos {
            servo.retune(ServoSettings::from_parameters(|id| to_f32(values.get(id))));
        }
    }

    /// Forgets what was sensed: for when the sensors are others from now on.
    pub fn restart(&mut self) {
        self.monitor = ImuMonitor::new(ImuPatience::default());
        self.attitude.reset();
        self.rest();
    }
}
