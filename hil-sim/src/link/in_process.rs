//! A robot in this process: the firmware library behind an in-memory pipe. Every message is framed, checked, decoded and
//! handled exactly as it is on the chip.

use super::{LinkError, Transport};
use firmware::{Port, Robot, Scalar};

/// The in-memory pipe and the robot at its end.
#[derive(Debug)]
pub struct InProcess<S: Scalar> {
    robot: Robot<S>,
    port: Port,
    output: Vec<u8>,
}

impl<S: Scalar> InProcess<S> {
    /// Puts `robot` at the end of a pipe.
    pub fn new(robot: Robot<S>) -> Self {
        InProcess { robot, port: Port::default(), output: Vec::new() }
    }

    /// The robot itself, for tests that look inside.
    pub fn robot(&self) -> &Robot<S> {
        &self.robot
    }
}

impl<S: Scalar> Transport for InProcess<S> {
    fn write(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        let output = &mut self.output;
        self.port.serve(bytes, &mut self.robot, &mut |frame| output.extend_from_slice(frame));
        Ok(())
    }

    fn read(&mut self, buffer: &mut Vec<u8>) -> Result<(), LinkError> {
        // The robot has already said all it will say: no byte now means none ever.
        if self.output.is_empty() {
            return Err(LinkError::NoAnswer);
        }
        buffer.append(&mut self.output);
        Ok(())
    }
}
