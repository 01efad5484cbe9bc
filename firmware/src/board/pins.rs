//! The one table of pins. The code takes its pins from here and from nowhere else; `docs/hardware.md` shows the same table,
//! and a test compares the two.

use embassy_stm32::{Peri, peripherals};

macro_rules! pins {
    ($dollar:tt $($name:ident: $pin:ident, $zio:literal, $what:literal;)*) => {
        /// Every pin that is used.
        pub struct Pins {
            $(
                #[doc = $what]
                pub $name: Peri<'static, peripherals::$pin>,
            )*
        }

        /// The pins out of all peripherals.
        macro_rules! take_pins {
            ($dollar all:expr) => {
                $crate::board::pins::Pins { $($name: $dollar all.$pin),* }
            };
        }
        pub(super) use take_pins;
    };
}

// name: pin, connector on the board, what for;
pins! { $
    imu_sck: PA5, "D13", "IMU, SPI1 SCK";
    imu_miso: PA6, "D12", "IMU, SPI1 MISO";
    imu_mosi: PB5, "D22", "IMU, SPI1 MOSI";
    imu_select: PD14, "D10", "IMU, chip select, low";
    fram_sck: PC10, "D45", "FRAM, SPI3 SCK";
    fram_miso: PC11, "D46", "FRAM, SPI3 MISO";
    fram_mosi: PC12, "D47", "FRAM, SPI3 MOSI";
    fram_select: PD2, "D48", "FRAM, chip select, low";
    motor1_pwm: PE9, "D6", "Motor 1, PWM, TIM1 CH1";
    motor1_direction: PE7, "D41", "Motor 1, direction, high: towards the negative end";
    motor2_pwm: PE11, "D5", "Motor 2, PWM, TIM1 CH2";
    motor2_direction: PE8, "D42", "Motor 2, direction, high: towards the negative end";
    motor_enable: PE10, "D40", "Both drivers, enable, high; pulled down outside";
    motor_break: PE15, "D37", "Both motors, break, TIM1 BKIN, high: off; pulled down inside, open";
    encoder1_a: PC6, "D16", "Encoder 1, A, TIM3 CH1";
    encoder1_b: PC7, "D21", "Encoder 1, B, TIM3 CH2";
    encoder2_a: PD12, "D29", "Encoder 2, A, TIM4 CH1";
    encoder2_b: PD13, "D28", "Encoder 2, B, TIM4 CH2";
    usb_tx: PD8, "ST-Link", "Virtual COM port, USART3 TX, 460800 baud";
    usb_rx: PD9, "ST-Link", "Virtual COM port, USART3 RX";
    radio_tx: PD5, "D53", "Radio, USART2 TX, 57600 baud";
    radio_rx: PD6, "D52", "Radio, USART2 RX";
    stop_button: PC13, "B1", "Stop button (blue), high: pressed";
    stop_loop: PE13, "D3", "Stop loop, closed to ground; pulled up inside, high: stop";
    lamp_green: PB0, "LD1", "Green lamp";
    lamp_blue: PB7, "LD2", "Blue lamp";
    lamp_red: PB14, "LD3", "Red lamp";
    battery: PA3, "A0", "Supply of the motors, ADC1 IN3, divided by 5.7";
}
