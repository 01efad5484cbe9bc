//! The three lamps.

use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::{Peri, peripherals};
use firmware::indicator;

/// Green, blue and red.
pub struct Lamps([Output<'static>; 3]);

impl Lamps {
    /// All dark.
    pub fn new(
        green: Peri<'static, peripherals::PB0>,
        blue: Peri<'static, peripherals::PB7>,
        red: Peri<'static, peripherals::PB14>,
    ) -> Self {
        Lamps([
            Output::new(green, Level::Low, Speed::Low),
            Output::new(blue, Level::Low, Speed::Low),
            Output::new(red, Level::Low, Speed::Low),
        ])
    }

    /// Lights the lamps as they should be.
    pub fn show(&mut self, lamps: indicator::Lamps) {
        for (lamp, lit) in self.0.iter_mut().zip([lamps.green, lamps.blue, lamps.red]) {
            lamp.set_level(Level::from(lit));
        }
    }
}
