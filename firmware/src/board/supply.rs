//! The microcontroller's own supply, watched by the chip's voltage detector.

use embassy_stm32::pac;
use firmware::reset::LastWords;

use super::crash;

/// The highest threshold, 2.9 V (RM0090, section 5.4.1).
const THRESHOLD: u8 = 7;

/// Watches the supply.
#[derive(Default)]
pub struct Supply {
    was_low: bool,
}

impl Supply {
    /// Switches the detector on.
    pub fn new() -> Self {
        pac::PWR.cr1().modify(|w| {
            w.set_pls(THRESHOLD);
            w.set_pvde(true);
        });
        Supply::default()
    }

    /// Whether the supply is below the threshold. If it goes on falling, the next start is to know why: a chip without a
    /// brown-out level takes that for being switched on.
    pub fn is_low(&mut self) -> bool {
        let low = pac::PWR.csr1().read().pvdo();
        if low != self.was_low {
            self.was_low = low;
            crash::leave(low.then_some(LastWords::BrownOut));
        }
        low
    }
}
