//! Supply of the motors, behind a divider of 47 kΩ and 10 kΩ.

use embassy_stm32::adc::{Adc, SampleTime};
use embassy_stm32::{Peri, peripherals};

/// Supply that reads full scale, mV: the reference of 3.3 V times 5.7.
const FULL_SCALE: u32 = 18_810;

/// Measures the supply.
pub struct Battery {
    adc: Adc<'static, peripherals::ADC1>,
    pin: Peri<'static, peripherals::PA3>,
}

impl Battery {
    /// Takes the converter into use.
    pub fn new(adc: Peri<'static, peripherals::ADC1>, pin: Peri<'static, peripherals::PA3>) -> Self {
        Battery { adc: Adc::new(adc), pin }
    }

    /// The supply, mV; at least 1.
    pub fn millivolts(&mut self) -> u16 {
        // The divider's 8 kΩ need 84 cycles of the converter (data sheet DS9405, section 6.3.21); this is more.
        let reading = u32::from(self.adc.blocking_read(&mut self.pin, SampleTime::CYCLES480));
        ((reading * FULL_SCALE / 4095) as u16).max(1)
    }
}
