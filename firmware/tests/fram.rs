//! The driver of the FRAM against a chip that does what its data sheet says and nothing else.

use std::cell::RefCell;
use std::rc::Rc;

use embedded_hal::spi::{Error, ErrorKind, ErrorType, Operation, SpiDevice};
use firmware::attitude::ImuCalibration;
use firmware::fram::{DEVICE_ID, Fram, SIZE};
use firmware::storage::{Memory, MemoryError, Record, load, save};
use protocol::message::MemoryState;
use protocol::parameter::TABLE;

/// FM25V02, Cypress 001-84494: the array, the status register, and what hangs on the other end of a bad line.
#[derive(Debug)]
struct Chip {
    array: Vec<u8>,
    id: [u8; 9],
    latch: bool,
    /// The latch never sets, as with the write protection of a clone.
    latch_broken: bool,
    /// Nothing on the line but this level, if any.
    stuck: Option<u8>,
    /// Commands that still come through garbled.
    garbled: usize,
    /// The bus itself reports an error.
    bus_error: bool,
    /// Opcodes seen.
    opcodes: Vec<u8>,
}

impl Chip {
    /// One command, from the falling to the rising edge of the select: bytes in, bytes out.
    fn command(&mut self, input: &[u8]) -> Vec<u8> {
        self.opcodes.push(input[0]);
        let address = |input: &[u8]| (usize::from(input[1]) << 8 | usize::from(input[2])) % self.array.len();
        let size = self.array.len();
        let mut output = vec![0; input.len()];
        match input[0] {
            0x06 => self.latch = !self.latch_broken,
            0x04 => self.latch = false,
            0x05 => output[1..].fill(u8::from(self.latch) << 1),
            0x03 => {
                let from = address(input);
                (3..input.len()).for_each(|i| output[i] = self.array[(from + i - 3) % size]);
            }
            0x02 => {
                if self.latch {
                    let from = address(input);
                    (3..input.len()).for_each(|i| self.array[(from + i - 3) % size] = input[i]);
                }
                self.latch = false;
            }
            0x9F => output.iter_mut().skip(1).zip(self.id).for_each(|(out, id)| *out = id),
            _ => {}
        }
        if self.garbled > 0 {
            self.garbled -= 1;
            output.iter_mut().for_each(|byte| *byte ^= 0x10);
        }
        output
    }
}

#[derive(Clone, Debug)]
struct Bus(Rc<RefCell<Chip>>);

impl Bus {
    fn new() -> Self {
        let array = vec![0; usize::from(SIZE)];
        let opcodes = Vec::new();
        let id = [0x7F, 0x7F, 0x7F, 0x7F, 0x7F, 0x7F, 0xC2, 0x22, 0x00];
        Bus(Rc::new(RefCell::new(Chip {
            array,
            id,
            latch: false,
            latch_broken: false,
            stuck: None,
            garbled: 0,
            bus_error: false,
            opcodes,
        })))
    }

    fn driver(&self) -> Fram<Bus> {
        Fram::probe(self.clone()).expect("the chip that is meant")
    }
}

#[derive(Debug)]
struct Overrun;

impl Error for Overrun {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Overrun
    }
}

impl ErrorType for Bus {
    type Error = Overrun;
}

impl SpiDevice for Bus {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Overrun> {
        let mut chip = self.0.borrow_mut();
        if chip.bus_error {
            return Err(Overrun);
        }
        let mut input = Vec::new();
        for operation in operations.iter() {
            match operation {
                Operation::Write(bytes) => input.extend_from_slice(bytes),
                Operation::Read(bytes) => input.extend(std::iter::repeat_n(0, bytes.len())),
                other => panic!("{other:?} is not expected"),
            }
        }
        let output = match chip.stuck {
            Some(level) => vec![level; input.len()],
            None => chip.command(&input),
        };
        let mut rest = output.as_slice();
        for operation in operations.iter_mut() {
            match operation {
                Operation::Write(bytes) => rest = &rest[bytes.len()..],
                Operation::Read(bytes) => {
                    bytes.copy_from_slice(&rest[..bytes.len()]);
                    rest = &rest[bytes.len()..];
                }
                other => panic!("{other:?} is not expected"),
            }
        }
        Ok(())
    }
}

#[test]
fn the_chip_is_known_by_its_id() {
    assert_eq!(DEVICE_ID, Bus::new().0.borrow().id[..8]);
    assert!(Fram::probe(Bus::new()).is_ok());
    for byte in 0..9 {
        let bus = Bus::new();
        bus.0.borrow_mut().id[byte] ^= 1;
        assert_eq!(Fram::probe(bus).err(), Some(MemoryError::NoAnswer), "byte {byte}");
    }
}

#[test]
fn the_two_chips_of_the_parts_list_are_taken_and_no_other_revision() {
    for revision in 0..=0xFF {
        let bus = Bus::new();
        bus.0.borrow_mut().id[8] = revision;
        // FM25V02 and FM25V02A.
        assert_eq!(Fram::probe(bus).is_ok(), [0x00, 0x08].contains(&revision), "revision {revision:#04x}");
    }
}

#[test]
fn no_chip_is_no_answer() {
    for level in [0x00, 0xFF] {
        let bus = Bus::new();
        bus.0.borrow_mut().stuck = Some(level);
        assert_eq!(Fram::probe(bus).err(), Some(MemoryError::NoAnswer));
    }
    let bus = Bus::new();
    bus.0.borrow_mut().bus_error = true;
    assert_eq!(Fram::probe(bus).err(), Some(MemoryError::NoAnswer));
}

#[test]
fn one_garbled_answer_is_not_the_end() {
    let bus = Bus::new();
    bus.0.borrow_mut().garbled = 1;
    let mut fram = bus.driver();
    // The next answer is that to WREN, which has none; the one after is the status.
    bus.0.borrow_mut().garbled = 2;
    fram.write(0, &[1]).expect("tried again");
    assert_eq!(bus.0.borrow().array[0], 1);
}

#[test]
fn a_chip_that_dies_later_is_an_error_and_not_a_write() {
    for level in [0x00, 0xFF] {
        let bus = Bus::new();
        let mut fram = bus.driver();
        bus.0.borrow_mut().stuck = Some(level);
        assert_eq!(fram.write(0, &[1, 2, 3]), Err(MemoryError::NoAnswer));
        assert_eq!(save(&mut fram, &record()), Err(MemoryError::NoAnswer));
    }
    let bus = Bus::new();
    let mut fram = bus.driver();
    bus.0.borrow_mut().latch_broken = true;
    assert_eq!(fram.write(0, &[1, 2, 3]), Err(MemoryError::NoAnswer));
    bus.0.borrow_mut().bus_error = true;
    assert_eq!(fram.write(0, &[1, 2, 3]), Err(MemoryError::NoAnswer));
    assert_eq!(fram.read(0, &mut [0; 3]), Err(MemoryError::NoAnswer));
    assert!(bus.0.borrow().array.iter().all(|byte| *byte == 0));
}

#[test]
fn every_write_is_enabled_anew() {
    let bus = Bus::new();
    let mut fram = bus.driver();
    for (address, bytes) in [(0x0000, [1, 2, 3]), (0x1234, [4, 5, 6]), (0x7FFD, [7, 8, 9])] {
        fram.write(address, &bytes).expect("a sound chip");
        assert!(!bus.0.borrow().latch, "the chip is left open");
        let mut found = [0; 3];
        fram.read(address, &mut found).expect("a sound chip");
        assert_eq!(found, bytes);
        assert_eq!(bus.0.borrow().array[usize::from(address)..][..3], bytes);
    }
    let write = [0x06, 0x05, 0x02, 0x03];
    assert_eq!(bus.0.borrow().opcodes, [&[0x9F][..], &write, &write, &write].concat());
}

#[test]
fn nothing_goes_round_the_end() {
    let bus = Bus::new();
    let mut fram = bus.driver();
    for (address, length) in [(0x7FFE, 3), (0x8000, 1), (0xFFFF, 1), (0, 0x8001), (0xFFFF, 0xFFFF)] {
        assert_eq!(fram.write(address, &vec![1; length]), Err(MemoryError::OutOfBounds));
        assert_eq!(fram.read(address, &mut vec![1; length]), Err(MemoryError::OutOfBounds));
    }
    assert_eq!(bus.0.borrow().opcodes, [0x9F], "the chip was asked");
    fram.write(0, &vec![0xEE; usize::from(SIZE)]).expect("the whole chip");
    assert!(bus.0.borrow().array.iter().all(|byte| *byte == 0xEE));
}

#[test]
fn a_record_survives_in_the_chip() {
    let bus = Bus::new();
    let mut fram = bus.driver();
    assert_eq!(load(&mut fram), (MemoryState::Empty, None));
    save(&mut fram, &record()).expect("a sound chip");
    drop(fram);
    assert_eq!(load(&mut bus.driver()), (MemoryState::Loaded, Some(record())));
}

fn record() -> Record {
    let parameters = core::array::from_fn(|i| TABLE[i].default as f32);
    Record { parameters, calibration: ImuCalibration::default() }
}
