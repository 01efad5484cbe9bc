//! Every message between host and robot.
//!
//! The first variant of each direction is `Hello` and keeps its shape for ever: two builds of different versions can
//! still tell each other so. Numbers are `f32`, the robot's own precision; a fixed-point robot rounds what it receives
//! and reports what it holds.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// From the host to the robot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum HostMessage {
    /// Asks the robot who it is; answered by [`RobotMessage::Hello`].
    Hello {
        /// [`crate::VERSION`] of the host.
        version: u16,
        /// [`crate::SCHEMA`] of the host.
        schema: u64,
    },
    /// Lets the brain move the weights. Refused in Fault.
    Arm,
    /// Holds the outputs at zero. Always taken; does not clear a fault.
    Disarm,
    /// Faults at once, with zero outputs, until [`HostMessage::ClearFault`].
    EmergencyStop,
    /// Leaves Fault for Disarmed.
    ClearFault,
    /// Starts the brain afresh from its parameters, at tick 0, and seeds the stimulus.
    Restart {
        /// Seed of the stimulus' noise.
        seed: u64,
    },
    /// Takes the sensors from the host's frames (true) or from the robot's own hardware (false). Refused while Armed. With
    /// simulated sensors the power stage is held off, whatever the outputs are.
    SimulatedSensors(bool),
    /// Sets one parameter; answered by [`RobotMessage::Parameter`].
    SetParameter {
        /// Index in [`crate::parameter::TABLE`].
        index: u8,
        /// The new value.
        value: f32,
    },
    /// Asks for one parameter; answered by [`RobotMessage::Parameter`].
    GetParameter {
        /// Index in [`crate::parameter::TABLE`].
        index: u8,
    },
    /// Simulated sensors of a body that measures its inclination directly and servoes its weights itself: one control
    /// step. Answered by [`RobotMessage::Telemetry`], whose `y` is the command.
    Inclination {
        /// Vertical components of the two sliding axes, in −1…1 plus noise.
        x: [f32; 2],
    },
    /// Simulated sensors of a body with an IMU and encoders: one servo tick. Answered by
    /// [`RobotMessage::Actuators`] and, when the brain ran, by [`RobotMessage::Telemetry`] before it.
    Transducers(Transducers),
    /// Finds the middle of both axes: arms, drives each weight gently from stop to stop and back to the middle, disarms.
    /// Only while Disarmed. Progress shows in the state, the outcome in [`Vitals::homed`].
    Home,
    /// Calibrates the inertial sensor, step by step; answered by [`RobotMessage::Calibration`]. Refused while Armed.
    Calibrate(CalibrationStep),
    /// Writes all parameters and the calibration to the robot's memory; answered by [`RobotMessage::Stored`] once they are
    /// there.
    Store,
    /// Empties the robot's memory: the next start has the defaults. Answered by [`RobotMessage::Stored`].
    Forget,
}

impl HostMessage {
    /// Whether `reply` is the last thing the robot says to this message. Every message gets exactly one such answer;
    /// telemetry may come before it.
    pub fn is_answered_by(&self, reply: &RobotMessage) -> bool {
        match self {
            HostMessage::Hello { .. } => matches!(reply, RobotMessage::Hello { .. }),
            HostMessage::Arm
            | HostMessage::Disarm
            | HostMessage::EmergencyStop
            | HostMessage::ClearFault
            | HostMessage::Restart { .. }
            | HostMessage::SimulatedSensors(_)
            | HostMessage::Home => {
                matches!(reply, RobotMessage::State(_) | RobotMessage::Refused(_))
            }
            // Not another one's value: it may answer a request that was given up.
            HostMessage::SetParameter { index: asked, .. } | HostMessage::GetParameter { index: asked } => {
                match reply {
                    RobotMessage::Parameter { index, .. } => index == asked,
                    reply => matches!(reply, RobotMessage::Refused(_)),
                }
            }
            HostMessage::Inclination { .. } => {
                matches!(reply, RobotMessage::Telemetry(_) | RobotMessage::Refused(_))
            }
            HostMessage::Transducers(_) => matches!(reply, RobotMessage::Actuators { .. } | RobotMessage::Refused(_)),
            HostMessage::Calibrate(_) => matches!(reply, RobotMessage::Calibration(_) | RobotMessage::Refused(_)),
            HostMessage::Store | HostMessage::Forget => {
                matches!(reply, RobotMessage::Stored | RobotMessage::Refused(_))
            }
        }
    }
}

/// What the chips of a robot read in one servo tick, as their registers have it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Transducers {
    /// Specific force along the body axes (slider 1, cylinder, slider 2), 8192 LSB/g.
    pub accelerometer: [i16; 3],
    /// Angular velocity about the same axes, 16.4 LSB/(°/s).
    pub gyroscope: [i16; 3],
    /// Encoder counts of the two axes, zero in the middle.
    pub encoder: [i32; 2],
}

/// From the robot to the host.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum RobotMessage {
    /// Who the robot is.
    Hello {
        /// [`crate::VERSION`] of the robot.
        version: u16,
        /// [`crate::SCHEMA`] of the robot.
        schema: u64,
        /// Version of the firmware: major, minor, patch.
        firmware: [u8; 3],
        /// Number format of the brain.
        precision: Precision,
        /// Safety state.
        state: SafetyState,
        /// Why the firmware last started.
        reset: ResetCause,
        /// What its memory of parameters and calibration held at that start.
        memory: MemoryState,
    },
    /// Answer to a command that changes the safety state or restarts the brain.
    State(SafetyState),
    /// A parameter as the robot holds it, asked for or just set.
    Parameter {
        /// Index in [`crate::parameter::TABLE`].
        index: u8,
        /// Its value.
        value: f32,
    },
    /// A command that was not carried out.
    Refused(Refusal),
    /// The brain after one control step.
    Telemetry(Telemetry),
    /// The outputs after one servo tick, for a simulated power stage.
    Actuators {
        /// Duty of the two axes, −1…1.
        duty: [f32; 2],
    },
    /// How far the calibration is.
    Calibration(CalibrationProgress),
    /// The robot's memory has been written and read back.
    Stored,
    /// How the robot itself is, once a second.
    Vitals(Vitals),
}

/// The whole brain after one control step: sensors read, acted, learned. The prediction error `E = ξᵀξ` follows from
/// `xi` and is not sent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Telemetry {
    /// Control steps since the start; the step of this telemetry is the 0th, 1st, …
    pub tick: u32,
    /// Safety state after the step.
    pub state: SafetyState,
    /// Inclinations.
    pub x: [f32; 2],
    /// Motor values, −1…1; what the brain wants, also while Disarmed.
    pub y: [f32; 2],
    /// Controller matrix, row by row: C11 C12 C21 C22.
    pub c: [f32; 4],
    /// Controller bias.
    pub h: [f32; 2],
    /// Model matrix, row by row.
    pub a: [f32; 4],
    /// Model bias.
    pub b: [f32; 2],
    /// Prediction error ξ.
    pub xi: [f32; 2],
    /// Time loop error vᵀv.
    pub time_loop_error: f32,
}

/// How the microcontroller and its board are; figures are of the second before, counts since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Vitals {
    /// Servo ticks since the start.
    pub ticks: u32,
    /// Whether the middle of both axes is known.
    pub homed: bool,
    /// Whether the sensors are the host's.
    pub simulated_sensors: bool,
    /// Part of the time that the core was awake, 1/10 000.
    pub load: u16,
    /// Longest servo tick without a control step, ns from its start to its outputs.
    pub servo_ns: u32,
    /// Longest servo tick with a control step, ns.
    pub brain_ns: u32,
    /// Largest distance between two servo ticks' starts from a period, ns.
    pub jitter_ns: u32,
    /// Servo ticks that missed their deadline.
    pub overruns: u32,
    /// Servo ticks without a new reading of the inertial sensor.
    pub imu_missed: u32,
    /// Supply of the motors, mV.
    pub battery_mv: u16,
    /// Where the encoders of the two axes stand, counts since the start.
    pub encoder: [i32; 2],
    /// Frames that found this line busy and were not sent.
    pub unsent: u32,
    /// Frames that arrived garbled on this line.
    pub garbled: u32,
}

/// One step of the inertial sensor's calibration. Each averages two seconds of rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum CalibrationStep {
    /// How far is it?
    Status,
    /// The body rests, in any attitude: finds the gyroscope's bias.
    Still,
    /// The body rests with this axis up: once all six are known, finds the accelerometer's bias and scale and how the
    /// chip is mounted.
    Up(BodyAxis),
    /// Gives the six attitudes up and starts over; what was calibrated before stays.
    Restart,
}

/// Axes of the body, both ways; the six attitudes of the calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum BodyAxis {
    /// Positive end of sliding axis 1.
    Slider1,
    /// Negative end of sliding axis 1.
    Slider1Negative,
    /// Positive end of the cylinder axis.
    Cylinder,
    /// Negative end of the cylinder axis.
    CylinderNegative,
    /// Positive end of sliding axis 2.
    Slider2,
    /// Negative end of sliding axis 2.
    Slider2Negative,
}

/// How far the calibration is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct CalibrationProgress {
    /// What became of the last step.
    pub phase: CalibrationPhase,
    /// The attitudes that are known, bit n for the nth [`BodyAxis`].
    pub attitudes: u8,
}

/// What became of the last step of the calibration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum CalibrationPhase {
    /// None was asked for.
    #[default]
    Idle,
    /// It is still averaging.
    Averaging,
    /// Done; more attitudes are needed before it has an effect.
    Taken,
    /// Done and in use, until the next start unless it is stored.
    Applied,
    /// The body moved: do it again.
    Moved,
    /// The six attitudes do not fit together: one was not what it was said to be.
    Inconsistent,
}

/// Why the firmware started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum ResetCause {
    /// The supply came up.
    #[default]
    PowerOn,
    /// The reset button, or a debug probe.
    Pin,
    /// The firmware asked for it.
    Software,
    /// The watchdog was not fed.
    Watchdog,
    /// The supply sagged.
    BrownOut,
    /// The firmware panicked.
    Panic,
    /// The core took a fault.
    HardFault,
}

/// What the robot's memory of parameters and calibration held at the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum MemoryState {
    /// There is none, or it does not answer.
    #[default]
    Absent,
    /// Nothing: the defaults are in use.
    Empty,
    /// A valid record, now in use.
    Loaded,
    /// No record that can be read, or one of another version: the defaults are in use.
    Unreadable,
}

/// Number format of a brain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Precision {
    /// Double precision, on a host only.
    F64,
    /// Single precision.
    F32,
    /// Fixed point with 16 fraction bits.
    Fixed,
}

/// Safety state of the robot. Outputs are zero unless Armed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum SafetyState {
    /// Outputs zero, ready to be armed.
    Disarmed,
    /// The brain moves the weights.
    Armed,
    /// Outputs zero until the fault is cleared.
    Fault(FaultCode),
}

/// Why the robot is in Fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum FaultCode {
    /// A sensor has not been read for too long.
    StaleSensor,
    /// A sensor reads what no barrel can do.
    ImpossibleSensor,
    /// An axis is driven but does not follow.
    StalledAxis,
    /// NaN or infinity in the brain.
    NonFinite,
    /// A tick did not finish in time.
    MissedDeadline,
    /// The button, or the host, said stop.
    EmergencyStop,
    /// The firmware panicked before its last reset.
    Panic,
    /// The watchdog reset the firmware.
    Watchdog,
    /// The supply sagged.
    BrownOut,
    /// The core took a fault before its last reset.
    HardFault,
    /// An axis does not end where it should: jammed, the wrong way round, or no encoder.
    Homing,
}

impl core::fmt::Display for FaultCode {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            FaultCode::StaleSensor => "a sensor has not been read for too long; look at its wires",
            FaultCode::ImpossibleSensor => "a sensor reads what no barrel can do",
            FaultCode::StalledAxis => "an axis is driven but does not follow; is it jammed, or without power?",
            FaultCode::NonFinite => "a number in the brain is no longer finite",
            FaultCode::MissedDeadline => "a tick did not finish in time",
            FaultCode::EmergencyStop => "emergency stop",
            FaultCode::Panic => "the firmware panicked before its last reset",
            FaultCode::Watchdog => "the watchdog reset the firmware",
            FaultCode::BrownOut => "the supply is or was too low; charge the battery",
            FaultCode::HardFault => "the core took a fault before its last reset",
            FaultCode::Homing => "an axis does not end where it should: jammed, the wrong way round, or no encoder",
        })
    }
}

/// Why a command was not carried out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Refusal {
    /// Arm in Fault: clear the fault first.
    InFault,
    /// Not while Armed: disarm first.
    WhileArmed,
    /// Arm before the middle of both axes is known: home first.
    NotHomed,
    /// Not while the sensors are the host's: what would be calibrated or stored is not the robot's own.
    WhileSimulated,
    /// The robot has no memory, or it did not take what was written.
    NoMemory,
    /// The memory is still being written: ask again.
    Busy,
    /// Simulated sensors sent to a robot that uses its own: send `SimulatedSensors(true)` first.
    OwnSensors,
    /// No parameter has this index.
    UnknownParameter,
    /// The parameter is the simulator's, not the robot's.
    NotTheRobots,
    /// The value is NaN, infinite, out of range or not whole.
    BadValue,
}
