//! The driver of the inertial sensor against a chip that does what its data sheet says and nothing else.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::future::{Future, pending};
use std::pin::pin;
use std::rc::Rc;
use std::task::{Context, Poll, Waker};

use embedded_hal_async::spi::{Error, ErrorKind, ErrorType, Operation, SpiDevice};
use firmware::axes::ImuCounts;
use firmware::imu::Icm42688p;

const DEVICE_CONFIG: u8 = 0x11;
const INT_STATUS: u8 = 0x2D;
const PWR_MGMT0: u8 = 0x4E;
const WHO_AM_I: u8 = 0x75;
const REG_BANK_SEL: u8 = 0x76;

/// What becomes of a transaction.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fate {
    /// It arrives.
    Fine,
    /// The chip does not see it, and the line holds this level.
    Lost(u8),
    /// The bus reports an error.
    Fails,
    /// It never ends.
    Hangs,
}

/// ICM-42688-P, DS-000347 revision 1.6: bank 0, the bank select, samples at 1 kHz.
#[derive(Debug)]
struct Chip {
    registers: [u8; 128],
    identity: u8,
    bank: u8,
    sample: ImuCounts,
    /// Fates of the next transactions, and of those after them.
    fates: VecDeque<Fate>,
    fate: Fate,
    transactions: usize,
    written: Vec<u8>,
}

impl Chip {
    fn new() -> Self {
        let mut chip = Chip {
            registers: [0; 128],
            identity: 0x47,
            bank: 0,
            sample: ImuCounts { accelerometer: [100, -200, 8192], gyroscope: [-1, 2, -300] },
            fates: VecDeque::new(),
            fate: Fate::Fine,
            transactions: 0,
            written: Vec::new(),
        };
        chip.reset();
        chip
    }

    /// Values after a reset (section 14).
    fn reset(&mut self) {
        self.registers = [0; 128];
        self.bank = 0;
        for (address, value) in [(INT_STATUS, 0x10), (0x4F, 0x06), (0x50, 0x06), (0x52, 0x11), (0x65, 0x10)] {
            self.registers[usize::from(address)] = value;
        }
        self.registers[usize::from(WHO_AM_I)] = self.identity;
    }

    /// A millisecond: a sample, if both sensors are on.
    fn pass(&mut self) {
        if self.registers[usize::from(PWR_MGMT0)] & 0x0F != 0x0F {
            return;
        }
        let words = self.sample.accelerometer.into_iter().chain(self.sample.gyroscope);
        for (i, byte) in words.flat_map(i16::to_be_bytes).enumerate() {
            self.registers[0x1F + i] = byte;
        }
        self.registers[usize::from(INT_STATUS)] |= 0x08;
    }

    /// One transaction, from the falling to the rising edge of the select.
    fn transfer(&mut self, bytes: &mut [u8]) {
        let (reads, mut address) = (bytes[0] & 0x80 != 0, bytes[0] & 0x7F);
        if !reads {
            return self.write(address, bytes[1]);
        }
        bytes[0] = 0;
        for byte in &mut bytes[1..] {
            *byte = if self.bank == 0 { self.registers[usize::from(address)] } else { 0 };
            if address == INT_STATUS {
                self.registers[usize::from(INT_STATUS)] = 0;
            }
            address += 1;
        }
    }

    fn write(&mut self, address: u8, value: u8) {
        self.written.push(address);
        match address {
            REG_BANK_SEL => self.bank = value & 7,
            _ if self.bank != 0 => {}
            DEVICE_CONFIG if value & 1 != 0 => self.reset(),
            INT_STATUS | WHO_AM_I => {}
            _ => self.registers[usize::from(address)] = value,
        }
    }
}

/// Select, clock and data of the chip.
#[derive(Clone, Debug)]
struct Bus(Rc<RefCell<Chip>>);

#[derive(Debug)]
struct BusError;

impl Error for BusError {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Overrun
    }
}

impl ErrorType for Bus {
    type Error = BusError;
}

impl SpiDevice for Bus {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), BusError> {
        let [Operation::TransferInPlace(bytes)] = operations else { panic!("one transfer at a time") };
        let fate = {
            let mut chip = self.0.borrow_mut();
            chip.transactions += 1;
            chip.fates.pop_front().unwrap_or(chip.fate)
        };
        match fate {
            Fate::Fine => self.0.borrow_mut().transfer(bytes),
            Fate::Lost(level) => bytes.fill(level),
            Fate::Fails => return Err(BusError),
            Fate::Hangs => pending().await,
        }
        Ok(())
    }
}

/// Driver and chip.
struct Bench {
    imu: Icm42688p<Bus>,
    chip: Rc<RefCell<Chip>>,
}

impl Bench {
    fn new() -> Self {
        let chip = Rc::new(RefCell::new(Chip::new()));
        Bench { imu: Icm42688p::new(Bus(Rc::clone(&chip))), chip }
    }

    /// Set up and reading.
    fn running() -> Self {
        let mut bench = Bench::new();
        bench.start();
        bench
    }

    /// A servo tick. What is not done then is given up, as the servo does.
    fn tick(&mut self) -> Option<ImuCounts> {
        self.chip.borrow_mut().pass();
        let before = self.chip.borrow().transactions;
        let mut context = Context::from_waker(Waker::noop());
        let reading = match pin!(self.imu.tick()).poll(&mut context) {
            Poll::Ready(reading) => reading,
            Poll::Pending => None,
        };
        assert!(self.chip.borrow().transactions <= before + 1, "one transaction a tick");
        reading
    }

    /// Ticks until the first reading.
    fn start(&mut self) -> usize {
        (1..1000).find(|_| self.tick().is_some()).expect("a reading within a second")
    }

    /// Readings in so many ticks.
    fn readings(&mut self, ticks: usize) -> usize {
        (0..ticks).filter(|_| self.tick().is_some()).count()
    }

    fn chip(&self) -> std::cell::RefMut<'_, Chip> {
        self.chip.borrow_mut()
    }
}

#[test]
fn it_is_set_up_within_a_tenth_of_a_second_and_reads_what_the_chip_senses() {
    let mut bench = Bench::new();
    assert!(!bench.imu.is_running());
    let ticks = bench.start();
    assert!(bench.imu.is_running() && ticks <= 100, "{ticks} ticks");
    let registers = bench.chip().registers;
    let settings = [0x4F, 0x50, 0x52, 0x4E].map(|address: usize| registers[address]);
    assert_eq!(settings, [0x06, 0x46, 0x11, 0x0F], "±2000 °/s and ±4 g at 1 kHz, a quarter of it, low noise");
    for k in -3..3 {
        let sample = ImuCounts { accelerometer: [k, i16::MAX, i16::MIN], gyroscope: [256, -257, 1000 * k] };
        bench.chip().sample = sample;
        assert_eq!(bench.tick(), Some(sample));
    }
}

#[test]
fn a_sample_is_read_once() {
    let mut bench = Bench::running();
    assert!(bench.tick().is_some());
    // The chip's clock is slower than the servo's: nothing new in this tick.
    let mut context = Context::from_waker(Waker::noop());
    assert_eq!(pin!(bench.imu.tick()).poll(&mut context), Poll::Ready(None));
    assert!(bench.tick().is_some());
}

#[test]
fn all_but_the_looks_at_the_settings_are_readings() {
    let mut bench = Bench::running();
    let readings = bench.readings(10_000);
    assert!((9_950..10_000).contains(&readings), "{readings} readings in 10 000 ticks");
}

#[test]
fn a_lost_transaction_costs_one_reading() {
    // Wherever it is lost, a look at a setting included.
    for fate in [Fate::Lost(0x00), Fate::Lost(0xFF), Fate::Fails, Fate::Hangs] {
        let undisturbed = Bench::running().readings(600);
        for k in 0..520 {
            let mut bench = Bench::running();
            let before = bench.readings(k);
            bench.chip().fates.push_back(fate);
            let readings = before + bench.readings(600 - k);
            assert_eq!(readings, undisturbed - 1, "{fate:?} in tick {k}");
        }
    }
}

#[test]
fn a_lost_transaction_of_the_set_up_is_made_good() {
    let transactions = {
        let bench = Bench::running();
        let chip = bench.chip();
        chip.transactions
    };
    for fate in [Fate::Lost(0x00), Fate::Lost(0xFF), Fate::Fails, Fate::Hangs] {
        for k in 0..transactions {
            let mut bench = Bench::new();
            bench.chip().fates.extend(std::iter::repeat_n(Fate::Fine, k));
            bench.chip().fates.push_back(fate);
            let ticks = bench.start();
            assert!(ticks <= 200, "{fate:?} for transaction {k}: {ticks} ticks");
            let registers = bench.chip().registers;
            assert_eq!([registers[0x50], registers[0x4E]], [0x46, 0x0F], "{fate:?} for transaction {k}");
        }
    }
}

#[test]
fn a_dead_bus_gives_no_readings_and_is_tried_again() {
    for fate in [Fate::Lost(0x00), Fate::Lost(0xFF), Fate::Fails, Fate::Hangs] {
        let mut bench = Bench::running();
        bench.chip().fate = fate;
        assert_eq!(bench.readings(3000), 0, "{fate:?}");
        assert!(!bench.imu.is_running());
        bench.chip().fate = Fate::Fine;
        let ticks = bench.start();
        assert!(ticks <= 150, "{fate:?}: {ticks} ticks");
    }
}

#[test]
fn a_chip_that_resets_by_itself_is_set_up_again() {
    let mut bench = Bench::running();
    bench.chip().reset();
    bench.chip().registers[0x50] = 0x06;
    assert_eq!(bench.readings(50), 0, "nothing of a chip at ±16 g is taken");
    bench.start();
    assert_eq!(bench.chip().registers[0x50], 0x46);
}

#[test]
fn a_reset_that_comes_with_a_sample_is_noticed_too() {
    let mut bench = Bench::running();
    bench.chip().reset();
    // As if somebody else had switched it on again.
    bench.chip().registers[usize::from(PWR_MGMT0)] = 0x0F;
    bench.chip().registers[usize::from(INT_STATUS)] = 0x10;
    assert_eq!(bench.tick(), None);
}

#[test]
fn a_setting_that_changes_is_noticed_and_mended() {
    for (address, value) in [(0x4F, 0x26), (0x50, 0x06), (0x52, 0x00), (0x65, 0x00)] {
        let mut bench = Bench::running();
        bench.chip().registers[address] = value;
        let mended = (0..3000).any(|_| {
            bench.tick();
            bench.chip().registers[address] != value
        });
        assert!(mended, "register {address:#04x}");
        bench.start();
    }
}

#[test]
fn a_chip_in_another_bank_is_fetched_back() {
    let mut bench = Bench::running();
    bench.chip().bank = 3;
    let ticks = bench.start();
    assert!(ticks <= 200, "{ticks} ticks");
}

#[test]
fn another_chip_is_left_alone() {
    let mut bench = Bench::new();
    bench.chip().identity = 0x68;
    bench.chip().reset();
    assert_eq!(bench.readings(1000), 0);
    assert!(!bench.imu.is_running());
    let others: Vec<u8> =
        bench.chip().written.iter().copied().filter(|a| ![REG_BANK_SEL, DEVICE_CONFIG].contains(a)).collect();
    assert!(others.is_empty(), "no setting is written to it");
}
