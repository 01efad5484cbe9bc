//! The two SPI buses: the inertial sensor's, by DMA, and the FRAM's, which waits for nobody.

use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::InterruptExt;
use embassy_stm32::mode::{Async, Blocking, Mode};
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{self, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Peri, peripherals};
use embassy_time::Duration;
use embedded_hal::spi::{ErrorType, Operation};
use firmware::imu::Icm42688p;

use super::Irqs;

/// Clock of the inertial sensor, which takes 24 MHz: 84 MHz by a power of two, and kind to some centimetres of wire.
const IMU_CLOCK: Hertz = Hertz(5_250_000);
/// Clock of the memory, which takes 40 MHz: 42 MHz by a power of two.
const FRAM_CLOCK: Hertz = Hertz(5_250_000);

/// The inertial sensor.
pub type Imu = Icm42688p<Selected<Spi<'static, Async, Master>>>;
/// The bus of the FRAM.
pub type FramSpi = Selected<Spi<'static, Blocking, Master>>;

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
    let bus = Spi::new(bus, sck, mosi, miso, dma.0, dma.1, Irqs, config(IMU_CLOCK));
    // What is received ends last and wakes whoever waits for both; that the sending has ended is not worth an interrupt.
    interrupt::DMA2_STREAM3.disable();
    Icm42688p::new(Selected { bus, select: Output::new(select, Level::High, Speed::Medium) })
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
    let bus = Spi::new_blocking(bus, sck, mosi, miso, config(FRAM_CLOCK));
    Selected { bus, select: Output::new(select, Level::High, Speed::Medium) }
}

fn config(clock: Hertz) -> spi::Config {
    let mut config = spi::Config::default();
    config.frequency = clock;
    // Edges no faster than the clock needs them: less ringing on wires.
    config.gpio_speed = Speed::Medium;
    config
}

/// The only chip on a bus, with its select.
pub struct Selected<B> {
    bus: B,
    select: Output<'static>,
}

/// A transaction: the select is low as long as this lives. A transaction that is given up half way, as when the bus hangs,
/// ends for the chip, too.
struct Selection<'a>(&'a mut Output<'static>);

impl<'a> Selection<'a> {
    fn begin(select: &'a mut Output<'static>) -> Self {
        select.set_low();
        Selection(select)
    }
}

impl Drop for Selection<'_> {
    fn drop(&mut self) {
        self.0.set_high();
    }
}

impl<B: ErrorType> ErrorType for Selected<B> {
    type Error = B::Error;
}

impl<M: Mode> Selected<Spi<'static, M, Master>> {
    /// A transaction that waits for the bus byte by byte.
    fn wait_through(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), spi::Error> {
        let _selected = Selection::begin(&mut self.select);
        for operation in operations {
            match operation {
                Operation::Read(bytes) => self.bus.blocking_transfer(bytes, &[])?,
                Operation::Write(bytes) => self.bus.blocking_transfer(&mut [], bytes)?,
                Operation::Transfer(read, write) => self.bus.blocking_transfer(read, write)?,
                Operation::TransferInPlace(bytes) => self.bus.blocking_transfer_in_place(bytes)?,
                Operation::DelayNs(ns) => embassy_time::block_for(Duration::from_nanos(u64::from(*ns))),
            }
        }
        Ok(())
    }
}

impl embedded_hal::spi::SpiDevice for FramSpi {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), spi::Error> {
        self.wait_through(operations)
    }
}

impl embedded_hal_async::spi::SpiDevice for Selected<Spi<'static, Async, Master>> {
    /// Nothing asks for this: the inertial sensor's driver has one transfer in a transaction, which is below.
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), spi::Error> {
        self.wait_through(operations)
    }

    async fn transfer_in_place(&mut self, bytes: &mut [u8]) -> Result<(), spi::Error> {
        let _selected = Selection::begin(&mut self.select);
        self.bus.transfer_in_place(bytes).await
    }
}
