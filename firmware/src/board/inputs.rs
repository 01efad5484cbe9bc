//! Stop button and stop loop.

use embassy_stm32::gpio::{Input, Pull};
use embassy_stm32::{Peri, peripherals};

/// What a person stops the robot with.
pub struct StopInputs {
    button: Input<'static>,
    stop_loop: Input<'static>,
}

impl StopInputs {
    /// The button on the board, which has its own pull-down, and the loop.
    pub fn new(button: Peri<'static, peripherals::PC13>, stop_loop: Peri<'static, peripherals::PE13>) -> Self {
        StopInputs { button: Input::new(button, Pull::None), stop_loop: Input::new(stop_loop, Pull::Up) }
    }

    /// Whether the button is pressed.
    pub fn button(&self) -> bool {
        self.button.is_high()
    }

    /// Whether the loop is open.
    pub fn loop_open(&self) -> bool {
        self.stop_loop.is_high()
    }
}
