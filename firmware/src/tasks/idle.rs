//! Thread mode: polls its tasks and sleeps when there is nothing to do, and counts how long it was awake.

use core::sync::atomic::Ordering::Relaxed;

use embassy_executor::{Spawner, raw};
use static_cell::StaticCell;

use crate::board;
use crate::tasks::shared::AWAKE;

/// What `__pender` takes for thread mode (embassy-executor, `platform/cortex_m.rs`).
const THREAD: *mut () = usize::MAX as *mut ();

/// Runs thread mode for ever.
///
/// The core sleeps with interrupts masked: whatever wakes it is then still pending when the cycle counter is read, and its
/// handler counts as awake. A masked interrupt that becomes pending is an event (SEVONPEND), and so is a task that was woken
/// (SEV): an event before the WFE makes it fall through, so nothing is slept over.
#[allow(unsafe_code)]
pub fn run(spawn: impl FnOnce(Spawner)) -> ! {
    static EXECUTOR: StaticCell<raw::Executor> = StaticCell::new();
    let executor = EXECUTOR.init(raw::Executor::new(THREAD));
    board::wake_on_pending();
    spawn(executor.spawner());
    let mut woken = board::cycles();
    loop {
        // SAFETY: this is the one place that polls this executor.
        unsafe { executor.poll() };
        cortex_m::interrupt::disable();
        let asleep = board::cycles();
        AWAKE.fetch_add(asleep.wrapping_sub(woken), Relaxed);
        cortex_m::asm::wfe();
        woken = board::cycles();
        // SAFETY: nothing here relies on interrupts being masked.
        unsafe { cortex_m::interrupt::enable() };
    }
}
