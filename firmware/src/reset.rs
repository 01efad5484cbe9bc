//! Why the microcontroller starts: its reset flags, and what the firmware left behind before it went down.

use protocol::message::ResetCause;

/// Flags of RCC_CSR (RM0090 rev 22, section 6.3.21).
mod flag {
    pub const BROWN_OUT: u32 = 1 << 25;
    pub const POWER_ON: u32 = 1 << 27;
    pub const SOFTWARE: u32 = 1 << 28;
    pub const INDEPENDENT_WATCHDOG: u32 = 1 << 29;
    pub const WINDOW_WATCHDOG: u32 = 1 << 30;
}

/// What is left in memory that a reset does not clear, before the chip is reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum LastWords {
    /// A panic.
    Panic = 0x5041_4e49,
    /// A fault of the core.
    HardFault = 0x4641_554c,
    /// The supply sagged, and may go on doing so.
    BrownOut = 0x4252_4f57,
}

/// The cause of this start, from RCC_CSR and the word that was left in memory, which after power-on is anything.
///
/// Every reset pulls the reset pin, too, so that flag alone means the pin. A brown-out is a reset of the supply supervisor
/// without the power-on reset that comes with a supply from zero, or any reset after the supply was seen to sag: the memory
/// holds its word a little longer than the supervisor of a chip without a brown-out level waits.
pub fn cause(csr: u32, last_words: u32) -> ResetCause {
    if last_words == LastWords::BrownOut as u32 {
        ResetCause::BrownOut
    } else if csr & flag::POWER_ON != 0 {
        ResetCause::PowerOn
    } else if csr & flag::BROWN_OUT != 0 {
        ResetCause::BrownOut
    } else if csr & (flag::INDEPENDENT_WATCHDOG | flag::WINDOW_WATCHDOG) != 0 {
        ResetCause::Watchdog
    } else if csr & flag::SOFTWARE != 0 {
        match last_words {
            w if w == LastWords::Panic as u32 => ResetCause::Panic,
            w if w == LastWords::HardFault as u32 => ResetCause::HardFault,
            _ => ResetCause::Software,
        }
    } else {
        ResetCause::Pin
    }
}
