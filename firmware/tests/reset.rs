//! The cause of a start, for every state that the reset flags of an STM32F4 can be in.

use firmware::Robot;
use firmware::reset::{LastWords, cause};
use firmware::robot::Boot;
use protocol::FaultCode;
use protocol::message::{ResetCause, SafetyState};

/// Flags of RCC_CSR as RM0090 (section 6.3.21) names them.
const BOR: u32 = 1 << 25;
const PIN: u32 = 1 << 26;
const POR: u32 = 1 << 27;
const SFT: u32 = 1 << 28;
const IWDG: u32 = 1 << 29;
const WWDG: u32 = 1 << 30;
/// Bits of the same register that are no reset flags: LSI on and ready.
const LSI: u32 = 0b11;

#[test]
fn each_reset_is_told_from_its_flags() {
    for (csr, expected) in [
        (POR | BOR | PIN, ResetCause::PowerOn),
        (BOR | PIN, ResetCause::BrownOut),
        (PIN, ResetCause::Pin),
        (IWDG | PIN, ResetCause::Watchdog),
        (WWDG | PIN, ResetCause::Watchdog),
        (SFT | PIN, ResetCause::Software),
    ] {
        for lsi in [0, LSI] {
            // What memory holds counts after a reset by software only.
            for word in [0, u32::MAX, 0x1234_5678] {
                assert_eq!(cause(csr | lsi, word), expected, "{csr:#x}, {word:#x}");
            }
        }
    }
}

#[test]
fn last_words_count_after_a_reset_by_software_only() {
    for (words, expected) in [(LastWords::Panic, ResetCause::Panic), (LastWords::HardFault, ResetCause::HardFault)] {
        assert_eq!(cause(SFT | PIN, words as u32), expected);
        // Memory that kept them over a power cut, or from a crash before the watchdog or the button came.
        assert_eq!(cause(POR | BOR | PIN, words as u32), ResetCause::PowerOn);
        assert_eq!(cause(BOR | PIN, words as u32), ResetCause::BrownOut);
        assert_eq!(cause(IWDG | PIN, words as u32), ResetCause::Watchdog);
        assert_eq!(cause(PIN, words as u32), ResetCause::Pin);
    }
}

#[test]
fn a_supply_that_was_seen_to_sag_is_the_cause_of_whatever_reset_came_of_it() {
    for flags in [POR | BOR | PIN, BOR | PIN, PIN, IWDG | PIN, SFT | PIN] {
        assert_eq!(cause(flags, LastWords::BrownOut as u32), ResetCause::BrownOut);
    }
}

#[test]
fn a_word_with_one_wrong_bit_is_none() {
    for words in [LastWords::Panic, LastWords::HardFault, LastWords::BrownOut] {
        for bit in 0..32 {
            assert_eq!(cause(SFT | PIN, words as u32 ^ 1 << bit), ResetCause::Software, "bit {bit}");
        }
    }
}

#[test]
fn a_start_after_a_crash_is_a_fault_and_no_other_start_is() {
    for (reset, fault) in [
        (ResetCause::PowerOn, None),
        (ResetCause::Pin, None),
        (ResetCause::Software, None),
        (ResetCause::Watchdog, Some(FaultCode::Watchdog)),
        (ResetCause::BrownOut, Some(FaultCode::BrownOut)),
        (ResetCause::Panic, Some(FaultCode::Panic)),
        (ResetCause::HardFault, Some(FaultCode::HardFault)),
    ] {
        let robot = Robot::<f32>::new(&Boot { reset, ..Boot::default() });
        assert_eq!(robot.safety_state(), fault.map_or(SafetyState::Disarmed, SafetyState::Fault), "{reset:?}");
    }
}
