//! Links between the host and a robot: requests go out, answers come back, in lock-step.
//!
//! [`Line`] speaks the wire protocol over any [`Transport`] of bytes; its [`Wire`] keeps a tape of every frame for the recorder;
//! [`InProcess`] is the transport to a robot in this process, made of the firmware library itself; [`Serial`] the one to a
//! robot that can be touched.
//! [`Direct`] calls that robot's message handler without a wire in between, for sweeps and benchmarks.
//!
//! [`Embodied`] is the other kind: a [`Board`] whose own chips sense the simulated world. [`SoftBoard`] is the library itself
//! as such a board. [`Tethered`] makes a transport of a board that lies on the desk.

mod direct;
mod embodied;
mod in_process;
mod line;
pub mod serial;
mod soft_board;
mod tethered;
mod wire;

pub use direct::Direct;
pub use embodied::{Board, Embodied};
pub use in_process::InProcess;
pub use line::{Line, Transport};
pub use serial::Serial;
pub use soft_board::SoftBoard;
pub use tethered::Tethered;
pub use wire::{Direction, Wire};

use core::fmt;
use protocol::message::{MemoryState, Precision, Refusal, ResetCause, SafetyState, Vitals};
use protocol::{FrameError, HostMessage, RobotMessage, Telemetry};

/// What the robot said to one request.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// The last message, the one that answers the request.
    pub message: RobotMessage,
    /// The brain's state, if it took a step.
    pub telemetry: Option<Telemetry>,
}

/// A robot that can be asked.
pub trait Link {
    /// Sends a message and waits for the answer to it.
    fn request(&mut self, message: &HostMessage) -> Result<Answer, LinkError>;

    /// Hands over every frame that went over the wire since the last call, in order. Empty where there is no wire.
    fn drain_frames(&mut self, _sink: &mut dyn FnMut(Direction, &[u8])) {}

    /// What the robot last said of itself while it was asked something else.
    fn vitals(&self) -> Option<&Vitals> {
        None
    }
}

/// Why a request got no answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LinkError {
    /// The robot said nothing, or not what answers the request.
    NoAnswer,
    /// What it said was garbled.
    Garbled(FrameError),
    /// The robot speaks another version of the protocol.
    Version {
        /// The robot's version.
        robot: u16,
    },
    /// The robot's messages or parameters have another shape.
    Schema {
        /// The robot's schema hash.
        robot: u64,
    },
    /// The robot refused a request that the run depends on.
    Refused(Refusal),
    /// The way to the robot is gone or was never there: a port unplugged, busy or not allowed, an emulator that stopped. A
    /// sentence that says what to do.
    Broken(String),
}

impl fmt::Display for LinkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LinkError::NoAnswer => write!(f, "the robot does not answer"),
            LinkError::Garbled(error) => write!(f, "the robot's answer is garbled: {error}"),
            LinkError::Version { robot } => write!(
                f,
                "the robot speaks version {robot} of the protocol, this host version {}: update the older of the two",
                protocol::VERSION
            ),
            LinkError::Schema { robot } => write!(
                f,
                "the robot's messages differ from this host's (schema {robot:016x} against {:016x}): build both from one version",
                protocol::SCHEMA
            ),
            LinkError::Refused(refusal) => write!(f, "the robot refuses: {}", explain(*refusal)),
            LinkError::Broken(why) => f.write_str(why),
        }
    }
}

impl std::error::Error for LinkError {}

/// What a refusal means and what to do, for a person.
pub fn explain(refusal: Refusal) -> &'static str {
    match refusal {
        Refusal::InFault => "it is in Fault; clear the fault first",
        Refusal::WhileArmed => "not while it is Armed; disarm first",
        Refusal::NotHomed => "the middle of its axes is not known yet; home first",
        Refusal::WhileSimulated => "its sensors are the simulation's; end that first",
        Refusal::Busy => "its memory is still being written; ask again",
        Refusal::NoMemory => "it has no memory, or the memory did not take it",
        Refusal::OwnSensors => "it uses its own sensors; switch it to simulated sensors first",
        Refusal::UnknownParameter => "it has no such parameter; host and firmware differ in version",
        Refusal::NotTheRobots => "this parameter is the simulator's, not the robot's",
        Refusal::BadValue => "the value is out of range or not a number",
    }
}

/// Who the robot at the other end is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Version of its firmware: major, minor, patch.
    pub firmware: [u8; 3],
    /// Number format of its brain.
    pub precision: Precision,
    /// Its safety state.
    pub state: SafetyState,
    /// Why it last started.
    pub reset: ResetCause,
    /// What its memory of parameters and calibration held then.
    pub memory: MemoryState,
}

/// The question who a robot is.
pub const HELLO: HostMessage = HostMessage::Hello { version: protocol::VERSION, schema: protocol::SCHEMA };

/// Says hello and makes sure that both sides mean the same by their messages.
///
/// # Errors
/// As [`recognise`]; no answer.
pub fn hello(link: &mut impl Link) -> Result<Identity, LinkError> {
    recognise(&link.request(&HELLO)?.message)
}

/// Who a robot is that has answered a hello.
///
/// # Errors
/// [`LinkError::Version`] or [`LinkError::Schema`] where the two sides do not mean the same by their messages.
pub fn recognise(answer: &RobotMessage) -> Result<Identity, LinkError> {
    match *answer {
        RobotMessage::Hello { version, .. } if version != protocol::VERSION => {
            Err(LinkError::Version { robot: version })
        }
        RobotMessage::Hello { schema, .. } if schema != protocol::SCHEMA => Err(LinkError::Schema { robot: schema }),
        RobotMessage::Hello { firmware, precision, state, reset, memory, .. } => {
            Ok(Identity { firmware, precision, state, reset, memory })
        }
        _ => Err(LinkError::NoAnswer),
    }
}
