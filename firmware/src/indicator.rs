//! What the lamps on the board say. Green is the robot's state, red a fault, blue that the host plays the sensors.
//!
//! | State | Lamps |
//! |---|---|
//! | Disarmed, not homed | green: a short flash every 2 s |
//! | Disarmed, homed | green: half a second on, half a second off |
//! | Armed: the weights may move | green: on |
//! | Sensors are the host's | blue: on, besides the others |
//! | Fault: emergency stop | red: 1 blink, pause |
//! | Fault: watchdog | red: 2 blinks, pause |
//! | Fault: panic | red: 3 blinks, pause |
//! | Fault: hard fault | red: 4 blinks, pause |
//! | Fault: brown-out | red: 5 blinks, pause |
//! | Fault: missed deadline | red: 6 blinks, pause |
//! | Fault: stale sensor | red: 7 blinks, pause |
//! | Fault: impossible sensor | red: 8 blinks, pause |
//! | Fault: not finite | red: 9 blinks, pause |
//! | Fault: stalled axis | red: 10 blinks, pause |
//! | Fault: homing | red: 11 blinks, pause |
//!
//! A blink is 0.2 s on and 0.3 s off, a pause 1.5 s.

use protocol::message::SafetyState;

use crate::safety::FAULT_CODES;

/// The table above, row by row: state, and what the lamps show. Row 4 + n is the nth code of [`FAULT_CODES`], from 0.
pub const PATTERNS: &[(&str, &str)] = &[
    ("Disarmed, not homed", "green: a short flash every 2 s"),
    ("Disarmed, homed", "green: half a second on, half a second off"),
    ("Armed: the weights may move", "green: on"),
    ("Sensors are the host's", "blue: on, besides the others"),
    ("Fault: emergency stop", "red: 1 blink, pause"),
    ("Fault: watchdog", "red: 2 blinks, pause"),
    ("Fault: panic", "red: 3 blinks, pause"),
    ("Fault: hard fault", "red: 4 blinks, pause"),
    ("Fault: brown-out", "red: 5 blinks, pause"),
    ("Fault: missed deadline", "red: 6 blinks, pause"),
    ("Fault: stale sensor", "red: 7 blinks, pause"),
    ("Fault: impossible sensor", "red: 8 blinks, pause"),
    ("Fault: not finite", "red: 9 blinks, pause"),
    ("Fault: stalled axis", "red: 10 blinks, pause"),
    ("Fault: homing", "red: 11 blinks, pause"),
];

/// Lit part of a blink, a blink, and the pause after the last one, ms.
const BLINK_ON: u32 = 200;
const BLINK: u32 = 500;
const PAUSE: u32 = 1500;

/// Which lamps are lit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lamps {
    /// LD1.
    pub green: bool,
    /// LD2.
    pub blue: bool,
    /// LD3.
    pub red: bool,
}

/// The lamps at a time in ms since the start, which may wrap.
pub fn lamps(state: SafetyState, homed: bool, simulated: bool, milliseconds: u32) -> Lamps {
    let mut lamps = Lamps { blue: simulated, ..Lamps::default() };
    match state {
        SafetyState::Armed => lamps.green = true,
        SafetyState::Disarmed if homed => lamps.green = milliseconds % 1000 < 500,
        SafetyState::Disarmed => lamps.green = milliseconds % 2000 < 100,
        SafetyState::Fault(code) => {
            let before = FAULT_CODES.iter().take_while(|other| **other != code).count() as u32;
            let blinking = BLINK * (before + 1);
            let time = milliseconds % (blinking + PAUSE);
            lamps.red = time < blinking && time % BLINK < BLINK_ON;
        }
    }
    lamps
}
