//! Lamps and battery, ten times a second.

use core::sync::atomic::Ordering::Relaxed;

use embassy_time::{Duration, Instant, Ticker};
use firmware::indicator::lamps;

use crate::board::{Battery, Lamps};
use crate::tasks::shared::{BATTERY, SHOWN};

/// Shows the state and measures the supply, for ever.
#[embassy_executor::task]
pub async fn panel(mut leds: Lamps, mut battery: Battery) {
    let mut ticker = Ticker::every(Duration::from_hz(10));
    loop {
        ticker.next().await;
        BATTERY.store(battery.millivolts(), Relaxed);
        let shown = SHOWN.lock(core::cell::Cell::get);
        leds.show(lamps(shown.state, shown.homed, shown.simulated, Instant::now().as_millis() as u32));
    }
}
