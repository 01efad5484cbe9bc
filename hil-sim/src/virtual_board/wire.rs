//! The far end of a UART: two queues.

use rigless::chip::{Timeline, uart};
use rigless::snapshot::{Error, Reader, Store, Writer};
use rigless::time::VirtualNanos;
use std::collections::VecDeque;

/// Bytes on their way. The UART's model takes one when its receiver is free, and brings one when its stop bit has ended.
#[derive(Debug, Default)]
pub struct Wire {
    /// To the microcontroller.
    pub to_mcu: VecDeque<u8>,
    /// From the microcontroller.
    pub from_mcu: Vec<u8>,
}

impl Store for Wire {
    fn store(&self, to: &mut Writer) -> Result<(), Error> {
        to.put(&self.to_mcu)?;
        to.put(&self.from_mcu)
    }

    fn load(&mut self, from: &mut Reader) -> Result<(), Error> {
        self.to_mcu = from.take()?;
        self.from_mcu = from.take()?;
        Ok(())
    }
}

impl uart::Peer for Wire {
    fn receive(&mut self, word: u16, _context: &mut Timeline<'_, '_>) {
        // Eight bits are what the firmware frames.
        self.from_mcu.push(word as u8);
    }

    fn transmit(&mut self, _now: VirtualNanos) -> Option<u16> {
        self.to_mcu.pop_front().map(u16::from)
    }
}
