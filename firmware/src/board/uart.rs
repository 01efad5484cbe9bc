//! The two UARTs, both ways by DMA.

use embassy_stm32::gpio::Pull;
use embassy_stm32::mode::Async;
use embassy_stm32::usart::{self, RingBufferedUartRx, UartTx};
use embassy_stm32::{Peri, peripherals};
use static_cell::StaticCell;

use super::Irqs;

/// Bytes that may wait until they are looked at: 5 ms of the faster line.
const RING: usize = 256;
const USB_BAUD: u32 = 460_800;
const RADIO_BAUD: u32 = 57_600;

/// One line to a host.
pub struct Uart {
    tx: UartTx<'static, Async>,
    rx: RingBufferedUartRx<'static>,
}

impl Uart {
    /// Sends all of `bytes`. A line that fails loses them; the frames' numbers tell.
    pub async fn send(&mut self, bytes: &[u8]) {
        let _ = self.tx.write(bytes).await;
    }

    /// Waits for bytes and returns how many have come.
    pub async fn receive(&mut self, buffer: &mut [u8]) -> usize {
        // Noise, a break, an overrun: what was lost is found by the frames' checksums.
        self.rx.read(buffer).await.unwrap_or(0)
    }
}

/// The virtual COM port of the debug probe.
pub fn usb(
    usart: Peri<'static, peripherals::USART3>,
    pins: (Peri<'static, peripherals::PD9>, Peri<'static, peripherals::PD8>),
    dma: (Peri<'static, peripherals::DMA1_CH3>, Peri<'static, peripherals::DMA1_CH1>),
) -> Uart {
    static BUFFER: StaticCell<[u8; RING]> = StaticCell::new();
    let uart = usart::Uart::new(usart, pins.0, pins.1, dma.0, dma.1, Irqs, config(USB_BAUD));
    split(uart, BUFFER.init([0; RING]))
}

/// The radio.
pub fn radio(
    usart: Peri<'static, peripherals::USART2>,
    pins: (Peri<'static, peripherals::PD6>, Peri<'static, peripherals::PD5>),
    dma: (Peri<'static, peripherals::DMA1_CH6>, Peri<'static, peripherals::DMA1_CH5>),
) -> Uart {
    static BUFFER: StaticCell<[u8; RING]> = StaticCell::new();
    let uart = usart::Uart::new(usart, pins.0, pins.1, dma.0, dma.1, Irqs, config(RADIO_BAUD));
    split(uart, BUFFER.init([0; RING]))
}

fn split(uart: Result<usart::Uart<'static, Async>, usart::ConfigError>, buffer: &'static mut [u8; RING]) -> Uart {
    // The two rates are constants that the clocks of this board can make.
    let (tx, rx) = uart.expect("a rate that the clocks can make").split();
    Uart { tx, rx: rx.into_ring_buffered(buffer) }
}

fn config(baud: u32) -> usart::Config {
    let mut config = usart::Config::default();
    config.baudrate = baud;
    // A line to which nothing is connected is quiet.
    config.rx_pull = Pull::Up;
    config
}
