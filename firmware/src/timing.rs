//! The two rates of the robot.

/// Time between two control steps, s: 50 Hz, as the original has it.
pub const CONTROL_PERIOD: f64 = 0.02;

/// Time between two servo ticks, s.
pub const SERVO_PERIOD: f64 = 0.001;

/// Servo ticks in a second.
pub const SERVO_HZ: u32 = (1.0 / SERVO_PERIOD) as u32;

/// Servo ticks in a control step.
pub const SERVO_TICKS: u8 = 20;
