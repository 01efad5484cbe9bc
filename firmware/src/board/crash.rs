//! The end: panics and faults of the core. Outputs off first of all, a word for the next start, reset.
#![allow(unsafe_code)]

use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use core::ptr::{addr_of, addr_of_mut};
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m_rt::{ExceptionFrame, exception};
use embassy_stm32::pac;
use firmware::reset::{self, LastWords};
use protocol::message::ResetCause;

use crate::log;

/// Survives a reset, and holds anything after power-on.
#[unsafe(link_section = ".uninit.LAST_WORDS")]
static mut LAST_WORDS: MaybeUninit<u32> = MaybeUninit::uninit();

/// Why the chip starts. Once: the flags and the word are cleared.
pub fn cause() -> ResetCause {
    let csr = pac::RCC.csr();
    let flags = csr.read().0;
    csr.modify(|w| w.set_rmvf(true));
    // SAFETY: every bit pattern is a u32.
    let last_words = unsafe { addr_of!(LAST_WORDS).cast::<u32>().read_volatile() };
    leave(None);
    reset::cause(flags, last_words)
}

/// Leaves a word for the next start, or takes it back.
pub fn leave(word: Option<LastWords>) {
    let word = word.map_or(0, |word| word as u32);
    // SAFETY: one aligned store, which nothing can come in the middle of; whoever stores last is right.
    unsafe { addr_of_mut!(LAST_WORDS).cast::<u32>().write_volatile(word) };
}

/// Takes every output away: the timer's outputs at once, then the enable pin, PE10. After a reset both are so anyway.
fn outputs_off() {
    pac::TIM1.bdtr().modify(|w| w.set_moe(false));
    pac::GPIOE.bsrr().write(|w| w.set_br(10, true));
}

/// Outputs off, and down it goes; what there is to say comes last, since saying it may go wrong, too.
fn go_down(word: LastWords, say: impl FnOnce()) -> ! {
    static GOING_DOWN: AtomicBool = AtomicBool::new(false);
    cortex_m::interrupt::disable();
    outputs_off();
    if !GOING_DOWN.swap(true, Ordering::Relaxed) {
        leave(Some(word));
        say();
    }
    cortex_m::peripheral::SCB::sys_reset()
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    go_down(LastWords::Panic, || log::warning!("panic: {}", log::shown(info)))
}

/// An interrupt that nobody serves is as wrong as a fault. The non-maskable one comes when the clock of the debug probe stops
/// (RM0090, section 6.2.7).
#[exception]
unsafe fn DefaultHandler(_number: i16) {
    go_down(LastWords::HardFault, || {})
}

#[exception]
unsafe fn HardFault(_frame: &ExceptionFrame) -> ! {
    go_down(LastWords::HardFault, || {})
}
