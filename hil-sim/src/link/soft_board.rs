//! A board made of the firmware library alone: its robot senses for itself, with no chip, no clock and no wire in between. What
//! a real board does differently is the board's.

use super::{Board, LinkError};
use firmware::axes::ImuCounts;
use firmware::robot::Senses;
use firmware::{Port, Robot, Scalar};
use protocol::RobotMessage;
use protocol::frame::MAX_FRAME;
use protocol::message::Transducers;

/// Supply of the motors, mV.
const BATTERY: u16 = 12_000;

/// The library on its own sensors.
#[derive(Debug)]
pub struct SoftBoard<S: Scalar> {
    robot: Robot<S>,
    port: Port,
    /// Where the encoders stood at power-on: they count from there.
    encoder: Option<[i32; 2]>,
}

impl<S: Scalar> SoftBoard<S> {
    /// Powers `robot` on.
    pub fn new(robot: Robot<S>) -> Self {
        SoftBoard { robot, port: Port::default(), encoder: None }
    }

    /// The robot itself.
    pub fn robot(&self) -> &Robot<S> {
        &self.robot
    }
}

impl<S: Scalar> Board for SoftBoard<S> {
    fn tick(
        &mut self,
        transducers: &Transducers,
        to_robot: &[u8],
        from_robot: &mut Vec<u8>,
    ) -> Result<[f32; 2], LinkError> {
        self.port.serve(to_robot, &mut self.robot, &mut |frame| from_robot.extend_from_slice(frame));
        let start = *self.encoder.get_or_insert(transducers.encoder);
        let tick = self.robot.servo_tick(&Senses {
            imu: Some(ImuCounts { accelerometer: transducers.accelerometer, gyroscope: transducers.gyroscope }),
            encoder: std::array::from_fn(|i| transducers.encoder[i].wrapping_sub(start[i])),
            battery_mv: Some(BATTERY),
            ..Senses::default()
        });
        if tick.stepped {
            let frame = RobotMessage::Telemetry(self.robot.telemetry());
            from_robot.extend_from_slice(self.port.announce(&frame, &mut [0; MAX_FRAME]));
        }
        Ok(tick.outputs.duty())
    }
}
