//! The two SPI buses: the inertial sensor's, by DMA, and the FRAM's, which waits for nobody.

use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::mode::{Async, Blocking};
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{self, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Peri, peripherals};
use embedded_hal_bus::spi::{ExclusiveDevice, NoDelay};
use firmware::imu::Icm42688p;

use super::Irqs;

/// Within the 24 MHz that the sensor takes; APB2 gives 84 MHz by powers of two.
const IMU_CLOCK: Hertz = Hertz(10_000_000);
/// Within the 40 MHz that the memory takes.
const FRAM_CLOCK: Hertz = Hertz(10_000_000);

/// The inertial sensor.
pub type Imu = Icm42688p<ExclusiveDevice<Spi<'static, Async, Master>, Output<'static>, NoDelay>>;
/// The bus of the FRAM.
pub type FramSpi = ExclusiveDevice<Spi<'static, Blocking, Master>, Output<'static>, NoDelay>;

/// The inertial sensor on its bus.
pub fn imu(
    bus: Peri<'static, peripherals::SPI1>,
    pins: (
        Peri<'static, peripherals::PA5>,
        Peri<'static, peripherals::PB5>,
        Peri<'static, peripherals::PA6>,
        Peri<'static, peripherals::PD14>,
    ),
    dma: (Peri<'static, peripherals::DMA2_CH3>, Peri<'static, peripherals::DMA2_CH2>),
) -> Imu {
    let (sck, mosi, miso, select) = pins;
    let spi = Spi::new(bus, sck, mosi, miso, dma.0, dma.1, Irqs, config(IMU_CLOCK));
    Icm42688p::new(device(spi, Output::new(select, Level::High, Speed::VeryHigh)))
}

/// The bus of the FRAM.
pub fn fram(
    bus: Peri<'static, peripherals::SPI3>,
    pins: (
        Peri<'static, peripherals::PC10>,
        Peri<'static, peripherals::PC12>,
        Peri<'static, peripherals::PC11>,
        Peri<'static, peripherals::PD2>,
    ),
) -> FramSpi {
    let (sck, mosi, miso, select) = pins;
    let spi = Spi::new_blocking(bus, sck, mosi, miso, config(FRAM_CLOCK));
    device(spi, Output::new(select, Level::High, Speed::VeryHigh))
}

fn device<B>(bus: B, select: Output<'static>) -> ExclusiveDevice<B, Output<'static>, NoDelay> {
    match ExclusiveDevice::new_no_delay(bus, select) {
        Ok(device) => device,
        // A pin of this chip cannot fail to be set.
        Err(never) => match never {},
    }
}

fn config(clock: Hertz) -> spi::Config {
    let mut config = spi::Config::default();
    config.frequency = clock;
    config
}
