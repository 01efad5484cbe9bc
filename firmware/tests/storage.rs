//! The stored record against power cuts, flipped bits, other layouts and a bus that garbles.

use std::ops::Range;

use crc::{CRC_32_ISO_HDLC, Crc};
use firmware::attitude::ImuCalibration;
use firmware::storage::{MEMORY_BYTES, Memory, MemoryError, Record, forget, load, save};
use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;
use protocol::message::{MemoryState, Refusal};
use protocol::parameter::{COUNT, Id, Kind, LAYOUT, TABLE};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

/// Length of a slot with a record, and of one that says that there is none, as the module's table has it.
const FULL: usize = 20 + 4 * (COUNT + 24) + 4;
const BARE: usize = 20 + 4;
const SECOND: usize = 0x400;

/// Bytes that stay, a supply that may be cut, and a bus that may garble.
#[derive(Clone)]
struct Chip {
    bytes: Vec<u8>,
    /// Bytes that can still be written before the supply is gone.
    supply: Option<usize>,
    /// What the byte becomes that is being written when the supply goes.
    torn: Option<u8>,
    /// One transfer of so many has a bit flipped.
    garbles: Option<u32>,
    /// The next so many transfers are lost: what is read is all ones.
    lost: u32,
    random: Pcg32,
}

impl Chip {
    fn new(fill: u8) -> Self {
        let bytes = vec![fill; usize::from(MEMORY_BYTES)];
        Chip { bytes, supply: None, torn: None, garbles: None, lost: 0, random: Pcg32::seed_from_u64(7) }
    }

    fn cut_after(&self, supply: usize, torn: Option<u8>) -> Self {
        Chip { supply: Some(supply), torn, ..self.clone() }
    }

    fn powered_again(mut self) -> Self {
        (self.supply, self.torn) = (None, None);
        self
    }

    fn is_lost(&mut self) -> bool {
        let lost = self.lost > 0;
        self.lost = self.lost.saturating_sub(1);
        lost
    }

    fn garble(&mut self, bytes: &mut [u8]) {
        if self.garbles.is_some_and(|one_of| self.random.next_u32().is_multiple_of(one_of)) {
            let bit = self.random.next_u32() as usize % (8 * bytes.len());
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
    }
}

impl Memory for Chip {
    fn read(&mut self, address: u16, buffer: &mut [u8]) -> Result<(), MemoryError> {
        if self.supply == Some(0) {
            return Err(MemoryError::NoAnswer);
        }
        let from = usize::from(address);
        let held = self.bytes.get(from..from + buffer.len()).ok_or(MemoryError::OutOfBounds)?;
        buffer.copy_from_slice(held);
        if self.is_lost() {
            buffer.fill(0xFF);
        }
        self.garble(buffer);
        Ok(())
    }

    fn write(&mut self, address: u16, bytes: &[u8]) -> Result<(), MemoryError> {
        if self.is_lost() {
            return Ok(());
        }
        let mut bytes = bytes.to_vec();
        self.garble(&mut bytes);
        for (i, byte) in bytes.into_iter().enumerate() {
            let held = self.bytes.get_mut(usize::from(address) + i).ok_or(MemoryError::OutOfBounds)?;
            match &mut self.supply {
                Some(0) => {
                    *held = self.torn.take().unwrap_or(*held);
                    return Err(MemoryError::NoAnswer);
                }
                Some(left) => *left -= 1,
                None => {}
            }
            *held = byte;
        }
        Ok(())
    }
}

fn record(seed: u64) -> Record {
    let mut random = Pcg32::seed_from_u64(seed);
    let mut between = |low: f32, high: f32| {
        let value = low + (high - low) * (random.next_u32() as f32 / u32::MAX as f32);
        value.clamp(low, high)
    };
    let parameters = core::array::from_fn(|i| {
        let value = between(TABLE[i].min as f32, TABLE[i].max as f32);
        if TABLE[i].kind == Kind::Whole { value.round() } else { value }
    });
    let mut vector = |low, high| Vector3::new(between(low, high), between(low, high), between(low, high));
    let angles = vector(-3.0, 3.0);
    let calibration = ImuCalibration {
        accelerometer_bias: vector(-0.3, 0.3),
        accelerometer_scale: vector(0.8, 1.2),
        gyroscope_bias: vector(-0.05, 0.05),
        gyroscope_scale: vector(0.9, 1.1),
        mounting: Rotation3::from_euler_angles(angles.x, angles.y, angles.z).into_inner(),
        position: vector(-0.1, 0.1),
    };
    Record { parameters, calibration }
}

/// A slot as the module's documentation describes it, put together without its code.
fn image(sequence: u32, record: Option<&Record>) -> Vec<u8> {
    let mut numbers = Vec::new();
    if let Some(Record { parameters, calibration }) = record {
        numbers.extend_from_slice(parameters);
        numbers.extend(calibration.accelerometer_bias.iter());
        numbers.extend(calibration.accelerometer_scale.iter());
        numbers.extend(calibration.gyroscope_bias.iter());
        numbers.extend(calibration.gyroscope_scale.iter());
        for column in 0..3 {
            for row in 0..3 {
                numbers.push(calibration.mounting[(row, column)]);
            }
        }
        numbers.extend(calibration.position.iter());
    }
    let mut bytes = b"brl1".to_vec();
    bytes.extend(LAYOUT.to_le_bytes());
    bytes.extend(1u16.to_le_bytes());
    bytes.extend(sequence.to_le_bytes());
    bytes.extend((4 * numbers.len() as u16).to_le_bytes());
    bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
    seal(bytes)
}

fn seal(mut bytes: Vec<u8>) -> Vec<u8> {
    bytes.extend(Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&bytes).to_le_bytes());
    bytes
}

fn put(chip: &mut Chip, address: usize, bytes: &[u8]) {
    chip.bytes[address..address + bytes.len()].copy_from_slice(bytes);
}

const NOTHING: (MemoryState, Option<Record>) = (MemoryState::Empty, None);
const UNREADABLE: (MemoryState, Option<Record>) = (MemoryState::Unreadable, None);

fn loaded(record: &Record) -> (MemoryState, Option<Record>) {
    (MemoryState::Loaded, Some(record.clone()))
}

/// What is done to a memory that is cut off.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "a test has room")]
enum Action {
    Save(Record),
    Forget,
}

impl Action {
    fn run(&self, chip: &mut Chip) -> Result<(), MemoryError> {
        match self {
            Action::Save(record) => save(chip, record),
            Action::Forget => forget(chip),
        }
    }

    fn outcome(&self) -> (MemoryState, Option<Record>) {
        match self {
            Action::Save(record) => loaded(record),
            Action::Forget => NOTHING,
        }
    }

    fn bytes(&self) -> usize {
        match self {
            Action::Save(_) => FULL,
            Action::Forget => BARE,
        }
    }
}

#[test]
fn the_slots_are_laid_out_as_documented() {
    let mut chip = Chip::new(0);
    let (first, second) = (record(1), record(2));
    save(&mut chip, &first).expect("a sound memory");
    assert_eq!(chip.bytes[..FULL], image(0, Some(&first)));
    save(&mut chip, &second).expect("a sound memory");
    assert_eq!(chip.bytes[SECOND..SECOND + FULL], image(1, Some(&second)));
    forget(&mut chip).expect("a sound memory");
    assert_eq!(chip.bytes[..BARE], image(2, None));
    assert_eq!(chip.bytes[SECOND..SECOND + FULL], image(1, Some(&second)), "the newer slot was touched");
}

#[test]
fn a_blank_memory_is_empty_and_one_of_garbage_is_unreadable() {
    for fill in [0x00, 0xFF] {
        assert_eq!(load(&mut Chip::new(fill)), NOTHING);
    }
    assert_eq!(load(&mut Chip::new(0xA5)), UNREADABLE);
    let mut half = Chip::new(0);
    half.bytes[SECOND..].fill(0x5A);
    assert_eq!(load(&mut half), UNREADABLE);
    // Garbage does not keep a record away.
    for fill in [0xA5, 0x00, 0xFF] {
        let mut chip = Chip::new(fill);
        save(&mut chip, &record(1)).expect("a sound memory");
        assert_eq!(load(&mut chip), loaded(&record(1)));
        forget(&mut chip).expect("a sound memory");
        assert_eq!(load(&mut chip), NOTHING);
    }
}

#[test]
fn a_memory_that_does_not_answer_is_absent() {
    let mut dead = Chip::new(0).cut_after(0, None);
    assert_eq!(load(&mut dead), (MemoryState::Absent, None));
    assert_eq!(save(&mut dead, &record(1)), Err(MemoryError::NoAnswer));
    assert_eq!(forget(&mut dead), Err(MemoryError::NoAnswer));
}

#[test]
fn a_memory_that_does_not_take_what_is_written_says_so() {
    struct ReadOnly(Chip);
    impl Memory for ReadOnly {
        fn read(&mut self, address: u16, buffer: &mut [u8]) -> Result<(), MemoryError> {
            self.0.read(address, buffer)
        }
        fn write(&mut self, _: u16, _: &[u8]) -> Result<(), MemoryError> {
            Ok(())
        }
    }
    let mut chip = ReadOnly(Chip::new(0));
    assert_eq!(save(&mut chip, &record(1)), Err(MemoryError::NotWritten));
    assert_eq!(forget(&mut chip), Err(MemoryError::NotWritten));
    assert_eq!(load(&mut chip), NOTHING);
}

#[test]
fn a_cut_after_any_byte_leaves_the_record_before_or_the_one_after() {
    let mut cuts = 0;
    for saves in 0..4 {
        for forgotten in [false, true] {
            let mut chip = Chip::new(0xFF);
            for seed in 0..saves {
                save(&mut chip, &record(seed)).expect("a sound memory");
            }
            if forgotten {
                forget(&mut chip).expect("a sound memory");
            }
            let before = load(&mut chip);
            // The same record as two saves ago too: then only number and checksum differ from what is overwritten.
            let same = record(saves.saturating_sub(2));
            for action in [Action::Save(record(99)), Action::Save(same), Action::Forget] {
                for cut in 0..=action.bytes() {
                    for torn in [None, Some(0x00), Some(0xFF), Some(0xA5)] {
                        cuts += 1;
                        let mut cut_off = chip.cut_after(cut, torn);
                        // One that was written whole could not be read back: the supply was gone by then.
                        assert!(action.run(&mut cut_off).is_err());
                        let mut chip = cut_off.powered_again();
                        let after = load(&mut chip);
                        // Of a memory without a record, what is torn is no longer blank.
                        let old = after == before || (before.1.is_none() && after == UNREADABLE);
                        let new = after == action.outcome();
                        assert!(old || new, "cut {cut}, torn {torn:?}: {after:?}");
                        assert!(new || cut < action.bytes(), "all was written, but is not there");
                        action.run(&mut chip).expect("a sound memory");
                        assert_eq!(load(&mut chip), action.outcome());
                    }
                }
            }
        }
    }
    println!("{cuts} cuts");
}

#[test]
fn no_single_flipped_bit_makes_a_wrong_record() {
    let mut chip = Chip::new(0);
    let (first, second) = (record(1), record(2));
    save(&mut chip, &first).expect("a sound memory");
    let one = chip.clone();
    save(&mut chip, &second).expect("a sound memory");
    for bit in 0..8 * chip.bytes.len() {
        let (byte, mask) = (bit / 8, 1 << (bit % 8));
        let newer = (SECOND..SECOND + FULL).contains(&byte);
        let flip = |chip: &Chip| {
            let mut flipped = chip.clone();
            flipped.bytes[byte] ^= mask;
            load(&mut flipped)
        };
        assert_eq!(flip(&chip), if newer { loaded(&first) } else { loaded(&second) }, "bit {bit}");
        let older = byte < FULL;
        assert_eq!(flip(&one), if older { UNREADABLE } else { loaded(&first) }, "bit {bit} of one record");
    }
}

#[test]
fn the_number_wraps() {
    let mut chip = Chip::new(0);
    put(&mut chip, 0, &image(u32::MAX - 2, Some(&record(0))));
    for seed in 1..8 {
        save(&mut chip, &record(seed)).expect("a sound memory");
        assert_eq!(load(&mut chip), loaded(&record(seed)));
    }
    assert_eq!(chip.bytes[14..18], 3u32.to_le_bytes());
    assert_eq!(chip.bytes[SECOND + 14..SECOND + 18], 4u32.to_le_bytes());
}

#[test]
fn a_record_of_another_layout_is_unreadable() {
    // Eight bytes of the parameters' layout, two of the calibration's.
    for byte in 4..14 {
        let mut bytes = image(5, Some(&record(1)));
        bytes.truncate(FULL - 4);
        bytes[byte] ^= 1;
        let mut chip = Chip::new(0);
        put(&mut chip, 0, &seal(bytes));
        assert_eq!(load(&mut chip), UNREADABLE, "byte {byte}");
        save(&mut chip, &record(2)).expect("a sound memory");
        assert_eq!(load(&mut chip), loaded(&record(2)));
    }
}

#[test]
fn a_host_is_told_a_bad_value_from_a_bad_memory() {
    let good = record(1);
    let mut bad = good.clone();
    // As the brain may learn it.
    bad.parameters[usize::from(Id::C11.index())] = 100.5;
    let mut dead = Chip::new(0).cut_after(0, None);
    let told = |chip: &mut Chip, record| save(chip, record).map_err(Refusal::from);
    assert_eq!(told(&mut Chip::new(0), &bad), Err(Refusal::BadValue));
    assert_eq!(told(&mut dead, &good), Err(Refusal::NoMemory));
    for error in [MemoryError::NoAnswer, MemoryError::OutOfBounds, MemoryError::NotWritten] {
        assert_eq!(Refusal::from(error), Refusal::NoMemory);
    }
}

#[test]
fn a_record_with_a_wrong_number_is_neither_read_nor_written() {
    let good = record(1);
    let parameter = |id: Id, value: f32| {
        let mut record = good.clone();
        record.parameters[usize::from(id.index())] = value;
        record
    };
    let calibration = |change: fn(&mut ImuCalibration)| {
        let mut record = good.clone();
        change(&mut record.calibration);
        record
    };
    let bad = [
        parameter(Id::Kp, f32::NAN),
        parameter(Id::C11, f32::INFINITY),
        parameter(Id::Kp, -1.0),
        parameter(Id::Range, 10.1),
        parameter(Id::Rule, 1.5),
        parameter(Id::Rule, 4.0),
        parameter(Id::Mu, f32::NEG_INFINITY),
        calibration(|c| c.position.x = f32::NAN),
        calibration(|c| c.accelerometer_bias.y = f32::INFINITY),
        calibration(|c| c.gyroscope_bias.z = f32::NAN),
        calibration(|c| c.accelerometer_scale.x = 0.4),
        calibration(|c| c.gyroscope_scale.z = f32::NAN),
        calibration(|c| c.mounting = -c.mounting),
        calibration(|c| c.mounting *= 1.05),
        calibration(|c| c.mounting[(1, 1)] = f32::NAN),
        calibration(|c| c.mounting.swap_columns(0, 1)),
    ];
    for (i, bad) in bad.iter().enumerate() {
        let mut chip = Chip::new(0);
        assert_eq!(save(&mut chip, bad), Err(MemoryError::BadRecord), "record {i}");
        assert_eq!(chip.bytes, Chip::new(0).bytes, "record {i} was written");
        put(&mut chip, 0, &image(1, Some(bad)));
        assert_eq!(load(&mut chip), UNREADABLE, "record {i}");
        put(&mut chip, SECOND, &image(0, Some(&good)));
        assert_eq!(load(&mut chip), loaded(&good), "record {i} hid the good one");
    }
}

#[test]
fn the_limits_of_every_parameter_can_be_stored() {
    for limit in [|i: usize| TABLE[i].min as f32, |i: usize| TABLE[i].max as f32, |i: usize| TABLE[i].default as f32] {
        let limits = Record { parameters: core::array::from_fn(limit), ..record(1) };
        let mut chip = Chip::new(0);
        save(&mut chip, &limits).expect("in range");
        assert_eq!(load(&mut chip), loaded(&limits));
    }
}

#[test]
fn a_thousand_cuts_in_a_row_never_lose_more_than_the_last_save() {
    let mut random = Pcg32::seed_from_u64(42);
    let mut chip = Chip::new(0xFF);
    let mut held = NOTHING;
    let mut news = 0;
    for round in 0..1000 {
        let action = if random.next_u32().is_multiple_of(10) { Action::Forget } else { Action::Save(record(round)) };
        let cut = random.next_u32() as usize % (action.bytes() + 40);
        let torn = random.next_u32().is_multiple_of(2).then_some(random.next_u32() as u8);
        let mut cut_off = chip.cut_after(cut, torn);
        let written = action.run(&mut cut_off);
        chip = cut_off.powered_again();
        let after = load(&mut chip);
        assert_eq!(written.is_ok(), cut > action.bytes(), "round {round}");
        let new = after == action.outcome();
        assert!(new || written.is_err(), "round {round}: {written:?}, but {after:?}");
        assert!(new || after == held || (held.1.is_none() && after == UNREADABLE), "round {round}: {after:?}");
        news += usize::from(new);
        held = after;
    }
    assert!((100..900).contains(&news), "{news} of 1000 came through: this test tries little");
}

#[test]
fn a_bus_that_garbles_makes_no_wrong_record() {
    let mut chip = Chip { garbles: Some(5), ..Chip::new(0) };
    let mut tried: Vec<Record> = Vec::new();
    let (mut saved, mut found_again) = (0, 0);
    for seed in 0..2000 {
        let new = record(seed);
        let written = save(&mut chip, &new).is_ok();
        tried.push(new);
        let (_, found) = load(&mut chip);
        // A save that failed may be there all the same: what was read back had been garbled.
        assert!(found.as_ref().is_none_or(|found| tried.contains(found)), "a record that nobody saved");
        saved += usize::from(written);
        found_again += usize::from(written && found.as_ref() == tried.last());
    }
    println!("one transfer of five garbled: {saved} of 2000 saves succeeded, {found_again} of them were found at once");
    // Three tries each: 4.7 % of the saves and 0.8 % of the reads fail.
    assert!(saved > 1800 && found_again * 50 > saved * 49, "{saved} saves, {found_again} of them found");
}

proptest! {
    #[test]
    fn what_is_saved_is_loaded_bit_for_bit(seed: u64, zero in 0..2) {
        let mut record = record(seed);
        record.parameters[usize::from(Id::C11.index())] = if zero == 0 { -0.0 } else { f32::from_bits(1) };
        let mut chip = Chip::new(0);
        save(&mut chip, &record).expect("a sound memory");
        let found = load(&mut chip).1.expect("saved");
        prop_assert_eq!(found.parameters.map(f32::to_bits), record.parameters.map(f32::to_bits));
        prop_assert_eq!(found.calibration, record.calibration);
    }

    #[test]
    fn any_bytes_are_read_without_a_panic(bytes in proptest::collection::vec(any::<u8>(), usize::from(MEMORY_BYTES))) {
        let mut chip = Chip::new(0);
        chip.bytes = bytes;
        prop_assert_eq!(load(&mut chip), UNREADABLE);
        save(&mut chip, &record(1)).expect("a sound memory");
        prop_assert_eq!(load(&mut chip), loaded(&record(1)));
    }
}

#[test]
fn what_is_said_to_be_saved_is_loaded_whatever_transfers_were_lost() {
    let (old, new) = (record(1), record(2));
    let (mut saved, mut refused) = (0, 0);
    for first in 0..2 {
        for lost in 0..80 {
            let mut chip = Chip::new(0);
            // The valid record is in the one slot or in the other.
            for _ in 0..=first {
                save(&mut chip, &old).expect("saved");
            }
            chip.lost = lost;
            let said = save(&mut chip, &new);
            chip.lost = 0;
            let found = load(&mut chip);
            if said.is_ok() {
                saved += 1;
                assert_eq!(found, loaded(&new), "{lost} lost");
            } else {
                refused += 1;
                assert!(found == loaded(&old) || found == loaded(&new), "{lost} lost: {:?}", found.0);
            }
        }
    }
    assert!(saved > 10 && refused > 10, "{saved} times saved, {refused} times refused");
}

/// A chip on a bus on which some reads, counted from the first one, come out wrong.
struct BadBus {
    chip: Chip,
    reads: u32,
    wrong: Range<u32>,
    /// What is wrong with them: they are lost, or have a flipped bit.
    lost: bool,
}

impl Memory for BadBus {
    fn read(&mut self, address: u16, buffer: &mut [u8]) -> Result<(), MemoryError> {
        self.chip.read(address, buffer)?;
        if self.wrong.contains(&self.reads) {
            self.chip.garbles = Some(1);
            self.chip.garble(buffer);
            self.chip.garbles = None;
            if self.lost {
                buffer.fill(0xFF);
            }
        }
        self.reads += 1;
        Ok(())
    }

    fn write(&mut self, address: u16, bytes: &[u8]) -> Result<(), MemoryError> {
        self.chip.write(address, bytes)
    }
}

#[test]
fn no_burst_of_bad_reads_puts_the_newest_record_at_the_mercy_of_a_cut() {
    let (older, newest, new) = (record(1), record(2), record(3));
    let (mut saved, mut cut_off, mut refused) = (0, 0, 0);
    // The newest record is in the one slot or in the other, and what is beside it is valid, torn or blank.
    for (slot, beside) in (0..2).flat_map(|slot| (0..3).map(move |beside| (slot, beside))) {
        let mut chip = Chip::new(0xFF);
        let at = [0, SECOND];
        put(&mut chip, at[slot], &image(8, Some(&newest)));
        let other = image(7, Some(&older));
        put(&mut chip, at[1 - slot], &other[..[other.len(), 100, 0][beside]]);
        let lengths = || (0..14).chain((14..90).step_by(7));
        let bursts = (0..10).flat_map(|from| lengths().map(move |length| (from, length)));
        for ((from, length), lost) in bursts.flat_map(|burst| [(burst, false), (burst, true)]) {
            // Nothing tells an empty memory from so long a silence before anything valid is read.
            let first_valid = if slot == 1 && beside > 0 { 3 } else { 0 };
            if lost && from <= first_valid && length >= 9 {
                continue;
            }
            for cut in [0, 1, 5, 17, 30, 200, FULL - 1, FULL, 10 * FULL] {
                let bus = |chip| BadBus { chip, reads: 0, wrong: from..from + length, lost };
                let mut bad = bus(chip.cut_after(cut, Some(0xA5)));
                let said = save(&mut bad, &new);
                let cut_short = bad.chip.supply == Some(0);
                let found = load(&mut bad.chip.powered_again());
                assert!(
                    found == loaded(&new) || (said.is_err() && found == loaded(&newest)),
                    "slot {slot}, beside {beside}, lost {lost}, {length} from {from}, cut {cut}: {said:?}"
                );
                saved += u32::from(said.is_ok());
                cut_off += u32::from(cut_short);
                refused += u32::from(said == Err(MemoryError::NotWritten));
            }
        }
    }
    println!("{saved} saved, {cut_off} cut off, {refused} refused");
    assert!(saved > 1000 && cut_off > 1000 && refused > 100, "{saved} saved, {cut_off} cut off, {refused} refused");
}

#[test]
fn no_short_burst_of_bad_reads_makes_a_start_take_the_older_record_for_the_newest() {
    let (older, newest) = (record(1), record(2));
    for slot in 0..2 {
        let mut chip = Chip::new(0xFF);
        let at = [0, SECOND];
        put(&mut chip, at[slot], &image(8, Some(&newest)));
        put(&mut chip, at[1 - slot], &image(7, Some(&older)));
        for (from, length) in (0..6).flat_map(|from| (0..8).map(move |length| (from, length))) {
            for lost in [false, true] {
                let mut bad = BadBus { chip: chip.clone(), reads: 0, wrong: from..from + length, lost };
                assert_eq!(load(&mut bad), loaded(&newest), "slot {slot}, lost {lost}, {length} from {from}");
            }
        }
    }
}
