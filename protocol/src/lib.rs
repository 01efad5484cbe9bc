//! What the barrel robot and its host say to each other, and the one table of parameters.
//!
//! * [`message`]: every message, host to robot and back.
//! * [`frame`]: how a message goes over a wire, byte by byte; encoder and decoder.
//! * [`parameter`]: name, unit, range, default and help of every parameter, used by the command line, the console, the
//!   wire and the recorder alike.
//!
//! The crate is `no_std` and allocates nothing: the same code runs on the microcontroller and on the host.
#![no_std]

pub mod frame;
pub mod message;
pub mod parameter;

pub use frame::{Decoder, FrameError, Sequence, encode};
pub use message::{FaultCode, HostMessage, Refusal, RobotMessage, SafetyState, Telemetry};
pub use parameter::{Id, Parameter, Values};

/// Version of the protocol: raised when the meaning of a message changes without changing its shape.
pub const VERSION: u16 = 1;

/// Hash over the shape of every message and over the names of every parameter, in order.
///
/// Two builds with the same hash read each other's frames and mean the same parameter by the same index.
pub const SCHEMA: u64 = {
    let messages =
        u64::from_le_bytes(postcard_schema::key::hash::fnv1a64::hash_ty_path::<(HostMessage, RobotMessage)>("barrel"));
    // FNV-1a goes on with it as with another byte.
    (messages ^ parameter::LAYOUT).wrapping_mul(0x0000_0100_0000_01b3)
};
