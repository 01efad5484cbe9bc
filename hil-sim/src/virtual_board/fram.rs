//! The FRAM with what survives a power cut: its contents can be brought along, and the power can go in the middle of a write.

use rigless::chip::Timeline;
use rigless::chip::fram::Fm25v02;
use rigless::chip::spi::Peer;
use rigless::snapshot::{Error, Reader, Store, Writer};
use rigless::time::EventId;

/// Commands of the FM25V02 (Cypress 001-84494, table 1).
const WREN: u32 = 0x06;
const WRITE: u32 = 0x02;
/// Bits of a frame on the bus.
const BITS: u8 = 8;

/// An FM25V02.
#[derive(Debug)]
pub struct Fram {
    chip: Fm25v02,
    /// What the array holds when the power comes; written the way any master would, before the first access.
    contents: Option<Vec<u8>>,
    /// Bytes that may still be written until the power goes.
    until_cut: Option<u32>,
    /// The power has gone.
    cut: bool,
    /// Bytes that may still be written until somebody pulls the reset pin.
    until_reset: Option<u32>,
    /// Now is the moment.
    reset: bool,
    /// Bytes into the select cycle, and its command.
    position: u32,
    command: u32,
}

impl Fram {
    /// A chip whose array holds `contents` from address 0 on, and zeros behind.
    pub fn with(contents: Vec<u8>) -> Self {
        let chip = Fm25v02::new();
        Fram {
            chip,
            contents: Some(contents),
            until_cut: None,
            cut: false,
            until_reset: None,
            reset: false,
            position: 0,
            command: 0,
        }
    }

    /// What the array holds.
    pub fn contents(&self) -> Vec<u8> {
        match &self.contents {
            Some(waiting) => waiting.clone(),
            None => self.chip.stored().to_vec(),
        }
    }

    /// Takes the power away after so many more bytes written.
    pub fn cut_after(&mut self, bytes: u32) {
        self.until_cut = Some(bytes);
    }

    /// Whether that has happened.
    pub fn is_cut(&self) -> bool {
        self.cut
    }

    /// Has the reset pin pulled after so many more bytes written.
    pub fn reset_after(&mut self, bytes: u32) {
        self.until_reset = Some(bytes);
    }

    /// Whether now is the moment; once.
    pub fn take_reset(&mut self) -> bool {
        std::mem::take(&mut self.reset)
    }

    fn fill(&mut self, contents: &[u8], context: &mut Timeline<'_, '_>) {
        let length = contents.iter().rposition(|byte| *byte != 0).map_or(0, |last| last + 1);
        let data = contents[..length].iter().map(|byte| u32::from(*byte));
        for cycle in [vec![WREN], [WRITE, 0, 0].into_iter().chain(data).collect()] {
            self.chip.select(context);
            for word in cycle {
                self.chip.transfer(word, BITS, context);
            }
            self.chip.deselect(context);
        }
    }
}

/// Counts one byte; whether it is the one that was waited for.
fn passed(until: &mut Option<u32>) -> bool {
    match until {
        Some(0) => {
            *until = None;
            true
        }
        Some(left) => {
            *left -= 1;
            false
        }
        None => false,
    }
}

impl Store for Fram {
    fn store(&self, to: &mut Writer) -> Result<(), Error> {
        to.put(&(&self.contents, self.until_cut, self.cut, self.until_reset, self.reset))?;
        to.put(&(self.position, self.command))?;
        self.chip.store(to)
    }

    fn load(&mut self, from: &mut Reader) -> Result<(), Error> {
        (self.contents, self.until_cut, self.cut, self.until_reset, self.reset) = from.take()?;
        (self.position, self.command) = from.take()?;
        self.chip.load(from)
    }
}

impl Peer for Fram {
    fn select(&mut self, context: &mut Timeline<'_, '_>) {
        if let Some(contents) = self.contents.take() {
            self.fill(&contents, context);
        }
        self.position = 0;
        if !self.cut {
            self.chip.select(context);
        }
    }

    fn transfer(&mut self, mosi: u32, bits: u8, context: &mut Timeline<'_, '_>) -> u32 {
        if self.cut {
            return 0;
        }
        if self.position == 0 {
            self.command = mosi;
        }
        self.position += 1;
        // The command and two bytes of address come before the data.
        if self.command == WRITE && self.position > 3 {
            if passed(&mut self.until_cut) {
                self.cut = true;
                return 0;
            }
            self.reset |= passed(&mut self.until_reset);
        }
        self.chip.transfer(mosi, bits, context)
    }

    fn deselect(&mut self, context: &mut Timeline<'_, '_>) {
        if !self.cut {
            self.chip.deselect(context);
        }
    }

    fn on_event(&mut self, event: EventId, context: &mut Timeline<'_, '_>) {
        self.chip.on_event(event, context);
    }

    fn restarted(&mut self, context: &mut Timeline<'_, '_>) {
        self.chip.restarted(context);
    }
}
