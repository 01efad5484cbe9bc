//! The core itself: cycle counter and sleep.
#![allow(unsafe_code)]

use cortex_m::peripheral::{DCB, DWT, SCB};

/// Cycles of the core's clock; turns over every 25 s. It counts in sleep, too, since embassy leaves the clock on for the
/// debugger.
pub fn cycles() -> u32 {
    DWT::cycle_count()
}

/// Starts the cycle counter.
pub fn start_cycle_counter() {
    // SAFETY: at the start, before anything else uses these two.
    let (mut dcb, mut dwt) = unsafe { (core::mem::transmute::<(), DCB>(()), core::mem::transmute::<(), DWT>(())) };
    dcb.enable_trace();
    dwt.enable_cycle_counter();
}

/// Makes an interrupt that becomes pending while it is masked an event that ends a WFE (SEVONPEND; PM0214, section 4.4.6).
pub fn wake_on_pending() {
    const SEVONPEND: u32 = 1 << 4;
    // SAFETY: one bit of a register that nobody else writes after the start.
    unsafe { (*SCB::PTR).scr.modify(|scr| scr | SEVONPEND) };
}
