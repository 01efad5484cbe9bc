//! The board, a NUCLEO-F429ZI: its pins and what hangs on them, each part as what the tasks need of it.

mod axes;
mod battery;
mod cpu;
pub mod crash;
mod inputs;
mod lamps;
pub mod pins;
mod spi;
mod supply;
mod uart;

pub use axes::Axes;
pub use battery::Battery;
pub use cpu::{cycles, wake_on_pending};
pub use inputs::StopInputs;
pub use lamps::Lamps;
pub use spi::{FramSpi, Imu};
pub use supply::Supply;
pub use uart::Uart;

use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::time::Hertz;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{bind_interrupts, dma, pac, peripherals, rcc, usart};

/// Clock of the core, Hz.
pub const CORE_HZ: u32 = 168_000_000;
/// Clock that the debug probe gives, Hz.
const CRYSTAL: Hertz = Hertz(8_000_000);
/// Looks at the debug probe's clock before it is given up: some 100 ms at the 16 MHz of the start.
const CLOCK_PATIENCE: u32 = 200_000;
/// Time without a servo tick in time after which the watchdog resets the chip, µs: five ticks, of which a bus that hangs takes
/// two. Its clock is anything from 17 to 47 kHz (data sheet DS9405, section 6.3.12), which makes 3.4 to 9.4 ms of it.
const WATCHDOG: u32 = 5_000;
/// Priority of what serves thread mode: below the servo. Its own interrupts keep the highest.
const BELOW_SERVO: Priority = Priority::P12;

bind_interrupts!(struct Irqs {
    USART2 => usart::InterruptHandler<peripherals::USART2>;
    USART3 => usart::InterruptHandler<peripherals::USART3>;
    DMA1_STREAM1 => dma::InterruptHandler<peripherals::DMA1_CH1>;
    DMA1_STREAM3 => dma::InterruptHandler<peripherals::DMA1_CH3>;
    DMA1_STREAM5 => dma::InterruptHandler<peripherals::DMA1_CH5>;
    DMA1_STREAM6 => dma::InterruptHandler<peripherals::DMA1_CH6>;
    DMA2_STREAM2 => dma::InterruptHandler<peripherals::DMA2_CH2>;
    DMA2_STREAM3 => dma::InterruptHandler<peripherals::DMA2_CH3>;
});

/// Feeds the independent watchdog.
pub type Watchdog = IndependentWatchdog<'static, peripherals::IWDG>;

/// Everything on the board.
pub struct Board {
    /// Inertial sensor.
    pub imu: Imu,
    /// Memory of parameters and calibration.
    pub fram: FramSpi,
    /// Motors and encoders.
    pub axes: Axes,
    /// Stop button and stop loop.
    pub stop: StopInputs,
    /// Virtual COM port of the debug probe.
    pub usb: Uart,
    /// Radio.
    pub radio: Uart,
    /// Lamps.
    pub lamps: Lamps,
    /// Supply of the motors.
    pub battery: Battery,
    /// Supply of the microcontroller.
    pub supply: Supply,
    /// The watchdog, not yet started.
    pub watchdog: Watchdog,
}

/// Starts the clocks and takes the board into use, the motors first: off.
pub fn start() -> Board {
    let p = embassy_stm32::init(clocks());
    let pins = pins::take_pins!(p);
    let axes = Axes::new(axes::Parts {
        enable: pins.motor_enable,
        pwm: (p.TIM1, pins.motor1_pwm, pins.motor2_pwm),
        directions: (pins.motor1_direction, pins.motor2_direction),
        break_input: pins.motor_break,
        encoder1: (p.TIM3, pins.encoder1_a, pins.encoder1_b),
        encoder2: (p.TIM4, pins.encoder2_a, pins.encoder2_b),
    });
    cpu::start_cycle_counter();
    watch_clock();
    let board = Board {
        axes,
        imu: spi::imu(p.SPI1, (pins.imu_sck, pins.imu_mosi, pins.imu_miso, pins.imu_select), (p.DMA2_CH3, p.DMA2_CH2)),
        fram: spi::fram(p.SPI3, (pins.fram_sck, pins.fram_mosi, pins.fram_miso, pins.fram_select)),
        stop: StopInputs::new(pins.stop_button, pins.stop_loop),
        usb: uart::usb(p.USART3, (pins.usb_rx, pins.usb_tx), (p.DMA1_CH3, p.DMA1_CH1)),
        radio: uart::radio(p.USART2, (pins.radio_rx, pins.radio_tx), (p.DMA1_CH6, p.DMA1_CH5)),
        lamps: Lamps::new(pins.lamp_green, pins.lamp_blue, pins.lamp_red),
        battery: Battery::new(p.ADC1, pins.battery),
        supply: Supply::new(),
        watchdog: IndependentWatchdog::new(p.IWDG, WATCHDOG),
    };
    lower_priorities();
    board
}

/// 168 MHz from the 8 MHz that the debug probe gives, or from the chip's own 16 MHz where it does not: at room temperature these
/// are within 1 %.
fn clocks() -> embassy_stm32::Config {
    let mut config = embassy_stm32::Config::default();
    let rcc = &mut config.rcc;
    let probe_clock = probe_clock_runs();
    if probe_clock {
        rcc.hse = Some(rcc::Hse { freq: CRYSTAL, mode: rcc::HseMode::Bypass });
        rcc.pll_src = rcc::PllSource::HSE;
    }
    rcc.pll = Some(rcc::Pll {
        prediv: if probe_clock { rcc::PllPreDiv::DIV4 } else { rcc::PllPreDiv::DIV8 },
        mul: rcc::PllMul::MUL168,
        divp: Some(rcc::PllPDiv::DIV2),
        divq: Some(rcc::PllQDiv::DIV7),
        divr: None,
    });
    rcc.ahb_pre = rcc::AHBPrescaler::DIV1;
    rcc.apb1_pre = rcc::APBPrescaler::DIV4;
    rcc.apb2_pre = rcc::APBPrescaler::DIV2;
    rcc.sys = rcc::Sysclk::PLL1_P;
    config
}

/// Whether the debug probe gives its clock. On a battery it may not, and waiting for it would be for ever.
fn probe_clock_runs() -> bool {
    pac::RCC.cr().modify(|cr| cr.set_hsebyp(true));
    pac::RCC.cr().modify(|cr| cr.set_hseon(true));
    let found = (0..CLOCK_PATIENCE).any(|_| pac::RCC.cr().read().hserdy());
    if !found {
        pac::RCC.cr().modify(|cr| cr.set_hseon(false));
    }
    found
}

/// From now on a clock of the debug probe that stops takes the motors' outputs away ([`Axes`]), and the core takes the non-maskable
/// interrupt (RM0090, section 6.2.7). Without that clock in use it does nothing.
fn watch_clock() {
    if pac::RCC.cr().read().hserdy() {
        pac::RCC.cr().modify(|cr| cr.set_csson(true));
    }
}

/// Puts what serves thread mode below the servo.
fn lower_priorities() {
    for line in [interrupt::USART2, interrupt::USART3] {
        line.set_priority(BELOW_SERVO);
    }
    for line in [interrupt::DMA1_STREAM1, interrupt::DMA1_STREAM3, interrupt::DMA1_STREAM5, interrupt::DMA1_STREAM6] {
        line.set_priority(BELOW_SERVO);
    }
}
