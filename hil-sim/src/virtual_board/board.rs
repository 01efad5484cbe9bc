//! The board: an STM32F427, which is the die of the NUCLEO's F429, with the robot's chips on its buses and the robot's wires on
//! its pins. The pins are those of `docs/hardware.md`.

use super::fram::Fram;
use super::wire::Wire;
use rigless::chip::icm42688p::Icm42688p;
use rigless::chip::uart::Rate;
use rigless::device::Level;
use rigless::edge::Pulse;
use rigless::machine::{Board, Crystal, Target, armv7m};
use rigless::mcu::{Mcu, Operate};
use rigless::soc::Error;
use rigless::soc::stm32f427::Stm32f427;
use rigless::soc::stm32f427::peripherals::adc;
use rigless::soc::stm32f427::peripherals::gpio::Pin;
use rigless::soc::stm32f427::peripherals::spi::Select;
use rigless::soc::stm32f427::peripherals::tim::Channel;
use rigless::time::VirtualNanos;
use std::num::{NonZeroU32, NonZeroU64};

/// Clock of the core, and instructions it executes in a second: one a cycle.
pub const CORE_HZ: u64 = 168_000_000;

/// The clock that the debug probe gives.
const CRYSTAL_HZ: u64 = 8_000_000;
/// The microcontroller's supply at power-on.
const RAIL_MV: u32 = 3300;
const NAME: &str = "barrel";
const MCU: &str = "stm32f427";
/// SPI1 and SPI3.
pub const IMU_BUS: usize = 0;
/// As above.
pub const FRAM_BUS: usize = 2;
/// USART3 is the virtual COM port, USART2 the radio.
const UARTS: [usize; 2] = [2, 1];
/// TIM1 among the advanced timers; TIM3 and TIM4 among the others.
const PWM_TIMER: usize = 0;
const ENCODER_TIMERS: [usize; 2] = [1, 2];
const PORT_B: usize = 1;
const PORT_C: usize = 2;
const PORT_E: usize = 4;
const DIRECTIONS: [u8; 2] = [7, 8];
/// PE10.
pub const ENABLE: u8 = 10;
const STOP_LOOP: u8 = 13;
const STOP_BUTTON: u8 = 13;
const LAMPS: [u8; 3] = [0, 7, 14];
/// Counts that an encoder turns in a millisecond at most: 15 km/s.
const FASTEST: i64 = 100_000;
/// The supply's divider on PA3, in tenths: 47 kΩ and 10 kΩ.
const DIVIDER: u32 = 57;
const BATTERY_CHANNEL: u8 = 3;

/// The virtual board.
#[derive(Debug)]
pub struct Barrel {
    mcu: Stm32f427,
    /// Where each encoder stands, in counts.
    shaft: [i64; 2],
}

rigless::store!(Barrel { values: [shaft], parts: [mcu], built: [] });

impl Barrel {
    /// A board whose FRAM holds `contents`.
    ///
    /// # Errors
    /// Tables of the emulator that do not fit together.
    pub fn new(contents: Vec<u8>) -> Result<Self, Error> {
        let mut mcu = Stm32f427::new()?;
        mcu.rcc.attach_crystals(CRYSTAL_HZ, Crystal::NONE.0);
        mcu.set_supply(RAIL_MV);
        let select = |port, number| Select { port, pin: pin(number), active: Level::Low };
        mcu.spi[IMU_BUS].attach_selected(Icm42688p::new(), select("GPIOD", 14));
        mcu.spi[FRAM_BUS].attach_selected(Fram::with(contents), select("GPIOD", 2));
        for uart in UARTS {
            mcu.usart[uart].attach(Wire::default());
        }
        Ok(Barrel { mcu, shaft: [0; 2] })
    }

    /// The microcontroller.
    pub fn mcu(&mut self) -> &mut Stm32f427 {
        &mut self.mcu
    }

    /// The far end of a UART: 0 the virtual COM port, 1 the radio.
    pub fn wire(&mut self, which: usize) -> &mut Wire {
        self.mcu.usart[UARTS[which]].chip_mut().expect("attached when the board was built")
    }

    /// The inertial sensor.
    pub fn imu(&mut self) -> &mut Icm42688p {
        self.mcu.spi[IMU_BUS].chip_mut(0).expect("attached when the board was built")
    }

    /// Cuts the inertial sensor off its bus, or puts it back.
    pub fn silence_imu(&mut self, silent: bool) {
        let _ = self.mcu.spi[IMU_BUS].silence(0, silent);
    }

    /// Loses the next so many transactions on a bus.
    pub fn lose(&mut self, bus: usize, transactions: u32) {
        if let Some(place) = self.mcu.spi[bus].place_mut(0) {
            (0..transactions).for_each(|_| place.drop_next());
        }
    }

    /// Flips bits of the next byte that the chip on a bus answers.
    pub fn flip(&mut self, bus: usize, bits: u8) {
        if let Some(place) = self.mcu.spi[bus].place_mut(0) {
            place.flip(u64::from(bits));
        }
    }

    /// Has so many bytes in a million arrive at the UARTs with noise, and as many with a framing error.
    pub fn garble_uarts(&mut self, per_million: u32) {
        for uart in UARTS {
            let errors = self.mcu.usart[uart].errors_mut();
            errors.noise = Rate { name: "noise", per_million };
            errors.framing = Rate { name: "framing", per_million };
        }
    }

    /// Stops the clock of the debug probe.
    pub fn fail_clock(&mut self, at: VirtualNanos) {
        self.mcu.drive_clocks(at, |rcc, registers, context| rcc.fail_hse(registers, context));
    }

    /// Supply of the microcontroller, mV.
    pub fn set_supply(&mut self, millivolts: u32) {
        self.mcu.set_supply(millivolts);
    }

    /// The memory of parameters and calibration.
    pub fn fram(&mut self) -> &mut Fram {
        self.mcu.spi[FRAM_BUS].chip_mut(0).expect("attached when the board was built")
    }

    /// Puts both encoders' phases on their pins, as after a reset, which forgets them.
    pub fn drive_encoders(&mut self, at: VirtualNanos) {
        for (which, timer) in ENCODER_TIMERS.into_iter().enumerate() {
            let (a, b) = phases(self.shaft[which]);
            self.mcu.drive_timer(at, timer, |tim, registers, context| {
                tim.drive_input(channel(1), Level::from(a), registers, context);
                tim.drive_input(channel(2), Level::from(b), registers, context);
            });
        }
    }

    /// Turns an encoder to a count, one quadrature edge a count: A leads B. An encoder that is to turn further in a millisecond
    /// than any motor can is that of a world that broke down, which its run is about to notice: it stays behind.
    pub fn turn(&mut self, at: VirtualNanos, which: usize, to: i64) {
        let to = to.clamp(self.shaft[which] - FASTEST, self.shaft[which] + FASTEST);
        while self.shaft[which] != to {
            let next = self.shaft[which] + (to - self.shaft[which]).signum();
            let (before, after) = (phases(self.shaft[which]), phases(next));
            self.mcu.drive_timer(at, ENCODER_TIMERS[which], |tim, registers, context| {
                if before.0 != after.0 {
                    tim.drive_input(channel(1), Level::from(after.0), registers, context);
                }
                if before.1 != after.1 {
                    tim.drive_input(channel(2), Level::from(after.1), registers, context);
                }
            });
            self.shaft[which] = next;
        }
    }

    /// Stop button and stop loop.
    pub fn drive_stop(&mut self, at: VirtualNanos, button: bool, loop_open: bool) {
        self.mcu.drive_port(at, PORT_C, |port, registers, context| {
            port.drive(pin(STOP_BUTTON), Some(Level::from(button)), registers, context);
        });
        // Open, nobody drives it, and the microcontroller's pull-up lifts it.
        let level = if loop_open { None } else { Some(Level::Low) };
        self.mcu.drive_port(at, PORT_E, |port, registers, context| {
            port.drive(pin(STOP_LOOP), level, registers, context);
        });
    }

    /// Supply of the motors, mV, behind its divider.
    pub fn set_battery(&mut self, millivolts: u32) {
        let (converter, _) = self.mcu.converter(0);
        converter.set_input(adc::Channel::new(BATTERY_CHANNEL).expect("one of sixteen"), millivolts * 10 / DIVIDER);
    }

    /// Whether the drivers are switched on.
    pub fn enabled(&mut self) -> bool {
        self.level(PORT_E, ENABLE)
    }

    /// What the two PWM pins and direction pins carry: −1…1.
    pub fn duty(&mut self) -> [f32; 2] {
        [1, 2].map(|number| {
            let (timer, registers) = self.mcu.advanced_timer(PWM_TIMER);
            let share = match timer.pulse(channel(number), registers) {
                Some(Pulse { width, period }) if period.0 > 0 => width.0 as f32 / period.0 as f32,
                _ => 0.0,
            };
            if self.level(PORT_E, DIRECTIONS[usize::from(number) - 1]) { -share } else { share }
        })
    }

    /// Green, blue and red lamp.
    pub fn lamps(&mut self) -> [bool; 3] {
        LAMPS.map(|number| self.level(PORT_B, number))
    }

    fn level(&mut self, port: usize, number: u8) -> bool {
        let (port, registers) = self.mcu.port(port);
        port.level(pin(number), registers) == Level::High
    }
}

impl Board for Barrel {
    fn name(&self) -> &'static str {
        NAME
    }

    fn target_names(&self) -> Vec<&'static str> {
        vec![MCU]
    }

    fn mcu(&mut self, target: usize) -> Option<&mut dyn Mcu> {
        (target == 0).then_some(&mut self.mcu)
    }

    fn targets(&mut self) -> Vec<Target<'_>> {
        let nonzero = |n| NonZeroU64::new(n).expect("not zero");
        let lines = u32::from(self.mcu.cpu().interrupt_lines);
        let core = armv7m::Core {
            variant: armv7m::Variant::M4,
            clock_hz: nonzero(CORE_HZ),
            interrupt_lines: NonZeroU32::new(lines).expect("a part with interrupts"),
            priority_bits: 4,
            refclk_divider: NonZeroU32::new(8).expect("not zero"),
            instructions_per_second: nonzero(CORE_HZ),
            boot: "flash",
        }
        .spec_with_parts(
            &rigless::cpu::armv7m::windows(self.mcu.bus()),
            armv7m::Fpu::FpV4Sp,
            armv7m::MpuRegions::Eight,
        );
        vec![Target::new(MCU, &mut self.mcu, core)]
    }
}

/// Levels of A and B at a count.
fn phases(count: i64) -> (bool, bool) {
    match count.rem_euclid(4) {
        0 => (false, false),
        1 => (true, false),
        2 => (true, true),
        _ => (false, true),
    }
}

fn pin(number: u8) -> Pin {
    Pin::new(number).expect("a pin of the table")
}

fn channel(number: u8) -> Channel {
    Channel::new(number).expect("a channel of the table")
}
