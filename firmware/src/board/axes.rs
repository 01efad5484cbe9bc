//! Motors and encoders. This is the only place that moves a motor pin, and it takes nothing but what the library's safety
//! has let through.

use embassy_stm32::gpio::{AfType, Flex, Level, Output, OutputType, Pull, Speed};
use embassy_stm32::pac;
use embassy_stm32::pac::timer::vals::Bkp;
use embassy_stm32::peripherals::{TIM1, TIM3, TIM4};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::low_level::CountingMode;
use embassy_stm32::timer::qei::Qei;
use embassy_stm32::timer::simple_pwm::{PwmPin, SimplePwm};
use embassy_stm32::{Peri, peripherals};
use firmware::safety::Outputs;

/// Above hearing.
const PWM: Hertz = Hertz(20_000);

/// Both axes.
pub struct Axes {
    pwm: SimplePwm<'static, TIM1>,
    /// Duty that is always on, in counts of the timer.
    full: u32,
    directions: [Output<'static>; 2],
    enable: Output<'static>,
    /// The timer's break input, for as long as the axes are in use.
    _break: Flex<'static>,
    encoders: (Qei<'static, TIM3>, Qei<'static, TIM4>),
    last: [u16; 2],
    counts: [i32; 2],
}

/// What the axes are made of.
pub struct Parts {
    pub enable: Peri<'static, peripherals::PE10>,
    pub pwm: (Peri<'static, TIM1>, Peri<'static, peripherals::PE9>, Peri<'static, peripherals::PE11>),
    pub directions: (Peri<'static, peripherals::PE7>, Peri<'static, peripherals::PE8>),
    pub break_input: Peri<'static, peripherals::PE15>,
    pub encoder1: (Peri<'static, TIM3>, Peri<'static, peripherals::PC6>, Peri<'static, peripherals::PC7>),
    pub encoder2: (Peri<'static, TIM4>, Peri<'static, peripherals::PD12>, Peri<'static, peripherals::PD13>),
}

impl Axes {
    /// Takes the axes into use, off.
    pub fn new(parts: Parts) -> Self {
        // First of all: until here the pull-down on the board held the drivers off.
        let enable = Output::new(parts.enable, Level::Low, Speed::Low);
        let directions = [
            Output::new(parts.directions.0, Level::Low, Speed::Low),
            Output::new(parts.directions.1, Level::Low, Speed::Low),
        ];
        let (timer, pin1, pin2) = parts.pwm;
        let mut pwm = SimplePwm::new(
            timer,
            Some(PwmPin::new(pin1, OutputType::PushPull)),
            Some(PwmPin::new(pin2, OutputType::PushPull)),
            None,
            None,
            PWM,
            CountingMode::EdgeAlignedUp,
        );
        let full = pwm.max_duty_cycle();
        pwm.ch1().set_duty_cycle(0);
        pwm.ch2().set_duty_cycle(0);
        pwm.ch1().enable();
        pwm.ch2().enable();
        let break_input = enable_break(parts.break_input);
        // No pull-ups here: the encoders have their own, to 5 V, which the pins take only without (DS9405, table 17).
        let (timer, a, b) = parts.encoder1;
        let encoder1 = Qei::new(timer, a, b, Default::default());
        let (timer, a, b) = parts.encoder2;
        let encoder2 = Qei::new(timer, a, b, Default::default());
        let last = [encoder1.count(), encoder2.count()];
        Axes {
            pwm,
            full,
            directions,
            enable,
            _break: break_input,
            encoders: (encoder1, encoder2),
            last,
            counts: [0; 2],
        }
    }

    /// Encoder counts since the start. To be read more often than the 16-bit counters turn over half, which at 1 kHz they
    /// would do at 5000 m/s.
    pub fn counts(&mut self) -> [i32; 2] {
        let now = [self.encoders.0.count(), self.encoders.1.count()];
        for ((count, last), now) in self.counts.iter_mut().zip(&mut self.last).zip(now) {
            *count = count.wrapping_add(i32::from(now.wrapping_sub(*last).cast_signed()));
            *last = now;
        }
        self.counts
    }

    /// Gives the motors what they are to get; without `powered` the power stage is off as well.
    pub fn drive(&mut self, outputs: Outputs<2>, powered: bool) {
        if !powered {
            self.enable.set_low();
        }
        let duty = outputs.duty();
        for (direction, duty) in self.directions.iter_mut().zip(duty) {
            direction.set_level(if duty < 0.0 { Level::High } else { Level::Low });
        }
        let counts = duty.map(|duty| (duty.abs() * self.full as f32) as u32);
        self.pwm.ch1().set_duty_cycle(counts[0].min(self.full));
        self.pwm.ch2().set_duty_cycle(counts[1].min(self.full));
        if powered {
            self.enable.set_high();
        }
    }
}

/// From now on the timer lets go of the motors' pins by itself when the clock of the debug probe fails (RM0090, section 17.3.12),
/// or when the pin is high.
fn enable_break(pin: Peri<'static, peripherals::PE15>) -> Flex<'static> {
    /// TIM1 (DS9405, table 12).
    const ALTERNATE_FUNCTION: u8 = 1;
    let mut input = Flex::new(pin);
    input.set_as_af_unchecked(ALTERNATE_FUNCTION, AfType::input(Pull::Down));
    pac::TIM1.bdtr().modify(|w| {
        w.set_bkp(0, Bkp::ACTIVE_HIGH);
        w.set_bke(0, true);
    });
    input
}
