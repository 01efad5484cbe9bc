//! What the servo and the tasks below it hand to each other. The servo waits for none of them: what it finds no room for is
//! dropped and counted.

use core::sync::atomic::{AtomicU16, AtomicU32};

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use firmware::robot::Errand;
use protocol::message::SafetyState;
use protocol::{HostMessage, RobotMessage};

/// Where a host is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Port {
    /// The virtual COM port of the debug probe.
    Usb,
    /// The radio.
    Radio,
}

impl Port {
    /// Both.
    pub const ALL: [Port; 2] = [Port::Usb, Port::Radio];

    /// What belongs to this port.
    pub fn of<T>(self, both: &'static [T; 2]) -> &'static T {
        &both[self as usize]
    }
}

/// Something to be sent.
#[derive(Clone, Copy, Debug)]
pub enum Outgoing {
    /// The answer to the last request.
    Answer(RobotMessage),
    /// What nobody asked for.
    Announcement(RobotMessage),
}

/// Messages on their way to the robot.
pub static INBOX: Channel<CriticalSectionRawMutex, (Port, HostMessage), 8> = Channel::new();
/// Messages on their way to each host.
pub static OUTBOX: [Channel<CriticalSectionRawMutex, Outgoing, 6>; 2] = [const { Channel::new() }; 2];
/// Places in an outbox that are kept for answers: a host that waits for one must not miss it for telemetry.
pub const FOR_ANSWERS: usize = 3;
/// Messages that found no room in an outbox.
pub static UNSENT: [AtomicU32; 2] = [const { AtomicU32::new(0) }; 2];
/// Frames that arrived garbled.
pub static GARBLED: [AtomicU32; 2] = [const { AtomicU32::new(0) }; 2];
/// What the storage is to see to.
pub static ERRANDS: Channel<CriticalSectionRawMutex, (Port, Errand), 1> = Channel::new();
/// Supply of the motors as it was measured just now, mV; 0 once that has been taken.
pub static BATTERY: AtomicU16 = AtomicU16::new(0);
/// Cycles that the core was awake.
pub static AWAKE: AtomicU32 = AtomicU32::new(0);
/// What the lamps show.
pub static SHOWN: Mutex<CriticalSectionRawMutex, core::cell::Cell<Shown>> =
    Mutex::new(core::cell::Cell::new(Shown { state: SafetyState::Disarmed, homed: false, simulated: false }));

/// What the lamps show.
#[derive(Clone, Copy, Debug)]
pub struct Shown {
    /// Safety state.
    pub state: SafetyState,
    /// Whether the middle of both axes is known.
    pub homed: bool,
    /// Whether the sensors are the host's.
    pub simulated: bool,
}
