//! The end: panics and faults of the core. Outputs off, a word for the next start, reset.
#![allow(unsafe_code)]

use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use core::ptr::{addr_of, addr_of_mut};

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
    // SAFETY: called once, before anything else runs, and every bit pattern is a u32.
    let last_words = unsafe { addr_of!(LAST_WORDS).cast::<u32>().read_volatile() };
    // SAFETY: as above.
    unsafe { addr_of_mut!(LAST_WORDS).cast::<u32>().write_volatile(0) };
    reset::cause(flags, last_words)
}

/// Takes every output away, leaves a word and resets.
fn go_down(last_words: LastWords) -> ! {
    cortex_m::interrupt::disable();
    // The timer's outputs at once, then the enable pin, PE10: after a reset both are so anyway.
    pac::TIM1.bdtr().modify(|w| w.set_moe(false));
    pac::GPIOE.bsrr().write(|w| w.set_br(10, true));
    // SAFETY: interrupts are off, and nothing else runs until the reset.
    unsafe { addr_of_mut!(LAST_WORDS).cast::<u32>().write_volatile(last_words as u32) };
    cortex_m::peripheral::SCB::sys_reset()
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    log::warning!("panic: {}", log::shown(info));
    go_down(LastWords::Panic)
}

/// An interrupt that nobody serves is as wrong as a fault.
#[exception]
unsafe fn DefaultHandler(_number: i16) {
    go_down(LastWords::HardFault)
}

#[exception]
unsafe fn HardFault(_frame: &ExceptionFrame) -> ! {
    go_down(LastWords::HardFault)
}
