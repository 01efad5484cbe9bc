//! What the log promises: it is exact, the same every time, and readable when it was cut off anywhere.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use barrel::csv;
use barrel::log::{self, Entry, LogError, Reader, Writer};
use hil_sim::link::Direction;
use hil_sim::record::{BrainRecord, PlantRecord};
use protocol::message::Vitals;
use protocol::{HostMessage, Values};

const ME: &str = "my.mcap";

fn brain(k: u32) -> BrainRecord<f32> {
    let k = k as f32;
    let wave = |i: f32| (k * 0.1 + i).sin();
    BrainRecord {
        t: f64::from(k) * 0.02,
        x: [wave(0.0), wave(1.5)],
        y: [wave(0.3), wave(1.8)],
        c: [wave(2.0) * 3.0, 1e-20, -0.0, wave(2.1)],
        a: [wave(3.0), wave(3.1), wave(3.2), wave(3.3)],
        error: wave(4.0).powi(2) * 1e-5,
        time_loop_error: wave(4.0).powi(2),
        ..BrainRecord::default()
    }
}

fn plant(k: u32) -> PlantRecord {
    let t = f64::from(k) * 0.02;
    PlantRecord {
        omega: t.cos(),
        phi: t.sin(),
        position: [t / 3.0, 0.1 * t, 0.5],
        orientation: [0.5, -0.5, t / 7.0, 0.1],
        ..PlantRecord::default()
    }
}

fn frame(k: u32) -> Vec<u8> {
    let mut buffer = [0; protocol::frame::MAX_FRAME];
    protocol::encode(k as u16, &HostMessage::Inclination { x: brain(k).x }, &mut buffer).unwrap().to_vec()
}

fn run() -> BTreeMap<String, String> {
    [("experiment", "homeokinetic"), ("seed", "7"), ("command", "barrel run homeokinetic --seed 7")]
        .map(|(key, value)| (key.to_string(), value.to_string()))
        .into()
}

fn write_step<W: std::io::Write>(log: &mut Writer<W>, k: u32) -> Result<(), LogError> {
    log.frame(u64::from(k) * 20_000_000, Direction::ToRobot, &frame(k))?;
    log.frame(u64::from(k) * 20_000_000, Direction::ToHost, &[1, 2, 3, 0])?;
    log.record(&brain(k), Some(&plant(k)))
}

fn written(steps: u32) -> Vec<u8> {
    let mut log = Writer::new(Vec::new(), Path::new(ME), &run(), &Values::defaults(|v| v)).unwrap();
    log.event(0.0, "state", "armed \"now\"").unwrap();
    for k in 0..steps {
        write_step(&mut log, k).unwrap();
    }
    log.finish().unwrap()
}

fn reader(bytes: &[u8]) -> Result<Reader<&[u8]>, LogError> {
    Reader::new(bytes, bytes.len() as u64, Path::new(ME))
}

/// The entries up to the end or the damage, whether the end is missing, and the damage.
fn all(bytes: &[u8]) -> Result<(Vec<Entry>, bool, Option<LogError>), LogError> {
    let mut reader = reader(bytes)?;
    let mut entries = Vec::new();
    let mut damage = None;
    for entry in reader.by_ref() {
        match entry {
            Ok(entry) => entries.push(entry),
            Err(error) => damage = Some(error),
        }
    }
    assert!(reader.next().is_none(), "an ended reader stays at its end");
    Ok((entries, reader.truncated(), damage))
}

#[test]
fn vitals_are_read_back_and_the_logs_time_never_goes_back() {
    let mut log = Writer::new(Vec::new(), Path::new(ME), &run(), &Values::defaults(|v| v)).unwrap();
    let vitals = Vitals { ticks: 1000, homed: true, load: 240, battery_mv: 11_900, unsent: 3, ..Vitals::default() };
    log.frame(2_000_000_000, Direction::ToHost, &[1, 0]).unwrap();
    log.vitals(1.5, &vitals).unwrap();
    log.frame(1_000_000_000, Direction::ToHost, &[2, 0]).unwrap();
    log.vitals(2.5, &Vitals { ticks: 2000, ..vitals }).unwrap();
    let (entries, ..) = all(&log.finish().unwrap()).unwrap();
    let frame = |byte| Entry::Frame { time: 2_000_000_000, direction: Direction::ToHost, bytes: vec![byte, 0] };
    let second = Entry::Vitals { t: 2.5, vitals: Vitals { ticks: 2000, ..vitals } };
    assert_eq!(entries, [frame(1), Entry::Vitals { t: 1.5, vitals }, frame(2), second]);
}

#[test]
fn what_is_written_is_read_back_bit_for_bit() {
    let bytes = written(500);
    let head = reader(&bytes).unwrap();
    assert_eq!(head.run()["seed"], "7");
    assert_eq!(head.run()["schema_hash"], format!("{:016x}", protocol::SCHEMA));
    assert_eq!(head.parameters()["epsA"], "0.1");
    assert_eq!(head.parameters()["phi0"], "0.7853981633974483");
    assert_eq!(head.parameters().len(), protocol::parameter::COUNT);

    let (entries, truncated, damage) = all(&bytes).unwrap();
    assert!(!truncated && damage.is_none(), "{damage:?}");
    assert_eq!(entries.len(), 1 + 4 * 500);
    assert!(matches!(&entries[0], Entry::Event(event) if event.kind == "state" && event.text == "armed \"now\""));
    for (k, step) in (0_u32..).zip(entries[1..].chunks(4)) {
        let time = u64::from(k) * 20_000_000;
        assert_eq!(step[0], Entry::Frame { time, direction: Direction::ToRobot, bytes: frame(k) });
        let (Entry::Brain(read), Entry::Plant { plant: read_plant, .. }) = (&step[2], &step[3]) else {
            panic!("{step:?}");
        };
        for (read, written) in csv::brain_row(read).iter().zip(csv::brain_row(&brain(k))) {
            assert_eq!((*read as f32).to_bits(), written.to_bits(), "step {k}");
        }
        assert_eq!(*read_plant, plant(k));
    }
}

#[test]
fn one_run_gives_the_same_bytes_every_time() {
    assert_eq!(written(120), written(120));
}

#[test]
fn a_number_that_is_not_finite_survives_as_nan() {
    let mut log = Writer::new(Vec::new(), Path::new(ME), &run(), &Values::defaults(|v| v)).unwrap();
    log.record(&BrainRecord { y: [f32::NAN, f32::INFINITY], ..brain(0) }, None).unwrap();
    let (entries, ..) = all(&log.finish().unwrap()).unwrap();
    assert!(matches!(&entries[0], Entry::Brain(brain) if brain.y.iter().all(|y| y.is_nan()) && brain.x[0] == 0.0));
}

/// Offsets where the file's records start.
fn records(bytes: &[u8]) -> Vec<usize> {
    let mut at = 8;
    let mut starts = Vec::new();
    while at + 9 <= bytes.len() {
        starts.push(at);
        at += 9 + u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
    }
    starts
}

/// What is read of a cut log must be a beginning of the whole, made of whole chunks, and never shrink. Cuts: every byte
/// of the head, every record's start with its neighbours and its own head, and a dense sample of the rest.
#[test]
fn a_log_cut_off_anywhere_is_read_up_to_its_last_whole_chunk() {
    let bytes = written(130);
    let (whole, ..) = all(&bytes).unwrap();
    let starts = records(&bytes);
    let near = starts.iter().flat_map(|&start| start - 2..start + 12);
    let cuts: BTreeSet<usize> =
        near.chain(1..600).chain((600..bytes.len()).step_by(41)).chain([bytes.len() - 1]).collect();
    let mut last = 0;
    let mut sizes = vec![0];
    assert!(matches!(reader(&[]), Err(LogError::Empty { .. })));
    for cut in cuts.into_iter().filter(|&cut| cut < bytes.len()) {
        let (entries, truncated, damage) = all(&bytes[..cut]).unwrap_or_else(|error| panic!("cut at {cut}: {error}"));
        assert!(truncated && damage.is_none(), "cut at {cut}: {damage:?}");
        assert!(whole.starts_with(&entries) && entries.len() >= last, "cut at {cut}");
        if entries.len() > last {
            sizes.push(entries.len());
        }
        last = entries.len();
    }
    // 130 steps are 2.6 s: chunks of 50, 50 and 30 steps, the first with the event.
    assert_eq!(sizes, [0, 201, 401, 521]);
}

#[test]
fn a_tail_of_zeros_counts_as_cut_off() {
    let mut bytes = written(130);
    let length = bytes.len();
    bytes[length - 3000..].fill(0);
    let (entries, truncated, damage) = all(&bytes).unwrap();
    assert!(truncated || damage.is_some());
    assert!(entries.len() >= 401);
}

#[test]
fn a_chunk_whose_header_was_never_completed_counts_as_cut_off() {
    // What writers leave that patch the chunk's header afterwards: a length of all ones.
    let bytes = written(0);
    let first_chunk = records(&bytes).into_iter().find(|&at| bytes[at] == 0x06).unwrap();
    let mut torn = bytes[..first_chunk].to_vec();
    torn.push(0x06);
    torn.extend_from_slice(&[0xff; 8]);
    torn.extend_from_slice(&[0; 16]);
    torn.extend_from_slice(&[0xff; 12]);
    torn.extend_from_slice(b"\0\0\0\0\xff\xff\xff\xff\xff\xff\xff\xffsome data");
    let (entries, truncated, damage) = all(&torn).unwrap();
    assert!(truncated && damage.is_none() && entries.is_empty(), "{damage:?}");
    assert_eq!(reader(&torn).unwrap().run()["seed"], "7");
}

/// Changes single bytes all over a log: never a panic, never a wrong entry, and almost always a report.
#[test]
fn a_changed_byte_is_noticed_and_nothing_false_is_read() {
    let bytes = written(130);
    let (whole, ..) = all(&bytes).unwrap();
    for at in (0..bytes.len()).step_by(37) {
        let mut changed = bytes.clone();
        changed[at] ^= 0x10;
        let Ok((entries, truncated, damage)) = all(&changed) else { continue };
        assert!(truncated || damage.is_some(), "change at {at} went unnoticed");
        // Message indexes and metadata stand between the chunks: their damage is found at the end, the data is right.
        assert!(whole.starts_with(&entries), "change at {at}");
    }
}

#[test]
fn a_damaged_chunk_is_named_with_place_and_time() {
    let mut bytes = written(130);
    // The third chunk: the second with data. Its middle is content.
    let chunks: Vec<usize> = records(&bytes).into_iter().filter(|&at| bytes[at] == 0x06).collect();
    let at = chunks[2];
    bytes[at + 2000] ^= 1;
    let (entries, truncated, damage) = all(&bytes).unwrap();
    let message = damage.unwrap().to_string();
    assert!(message.contains(&format!("chunk 3 (from 1.00 s) at byte {at}")), "{message}");
    assert!(!truncated && entries.len() == 201);
}

#[test]
fn other_files_are_not_taken_for_logs() {
    let complain = |bytes: &[u8]| reader(bytes).err().unwrap().to_string();
    assert!(complain(b"").contains("is empty"));
    assert!(complain(b"t,x1,x2\n0,1,2\n").contains("looks like a CSV"));
    assert!(complain(b"\x7fELF and so on").contains("not an MCAP log"));
    assert!(matches!(Reader::open(Path::new("/no/such.mcap")), Err(LogError::Read { .. })));
    assert!(matches!(Reader::open(Path::new("/")), Err(LogError::Read { .. })));

    let empty = written(0);
    let error = log::table(&mut reader(&empty).unwrap()).unwrap_err().to_string();
    assert!(error.contains("holds no /brain message"), "{error}");
    let error = log::table(&mut reader(&empty[..40]).unwrap()).unwrap_err().to_string();
    assert!(error.contains("cut off before its first whole chunk"), "{error}");
}

#[test]
fn a_folder_that_cannot_be_written_is_named() {
    let error = Writer::create(Path::new("/no/such/run.mcap"), &run(), &Values::defaults(|v| v)).err().unwrap();
    assert!(error.to_string().contains("/no/such/run.mcap"), "{error}");
}

#[test]
fn export_gives_the_csv_that_the_run_would_have_written() {
    let folder = tempfile::tempdir().unwrap();
    let (log, direct, exported) =
        (folder.path().join("run.mcap"), folder.path().join("run.csv"), folder.path().join("exported.csv"));
    std::fs::write(&log, written(130)).unwrap();
    let mut csv = csv::Writer::create(&direct, true).unwrap();
    for k in 0..130 {
        csv.write(&brain(k), Some(&plant(k))).unwrap();
    }
    csv.finish().unwrap();
    assert_eq!(log::export(&log, &exported).unwrap(), log::Export { rows: 130, truncated: false });
    assert!(std::fs::read(&direct).unwrap() == std::fs::read(&exported).unwrap(), "the files differ");
    assert_eq!(
        log::read_table(&log).unwrap().0.column("phi").unwrap(),
        log::read_table(&exported).unwrap().0.column("phi").unwrap()
    );

    // Damage leaves no half CSV behind, and the one that stood there stays.
    let mut bytes = written(130);
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0xff;
    std::fs::write(&log, bytes).unwrap();
    log::export(&log, &exported).unwrap_err();
    assert!(std::fs::read(&direct).unwrap() == std::fs::read(&exported).unwrap());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3, "a draft was left behind");
}

const VICTIM: &str = "BARREL_TEST_LOG_OF_THE_VICTIM";

/// Not a test of its own: the program that [`a_killed_run_leaves_a_readable_log`] kills.
#[test]
fn the_victim_writes_until_it_is_killed() {
    let Some(path) = std::env::var_os(VICTIM) else { return };
    let mut log = Writer::create(&PathBuf::from(path), &run(), &Values::defaults(|v| v)).unwrap();
    for k in 0.. {
        write_step(&mut log, k).unwrap();
    }
}

#[test]
#[cfg(unix)]
fn a_killed_run_leaves_a_readable_log() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("victim.mcap");
    for round in 1..=3_u64 {
        let _ = std::fs::remove_file(&path);
        let mut victim = std::process::Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "the_victim_writes_until_it_is_killed"])
            .env(VICTIM, &path)
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap();
        let patience = Instant::now() + Duration::from_secs(60);
        while std::fs::metadata(&path).map_or(0, |file| file.len()) < round * 300_000 {
            assert!(Instant::now() < patience && victim.try_wait().unwrap().is_none(), "the victim does not write");
            std::thread::sleep(Duration::from_millis(1));
        }
        // SIGKILL: no destructor runs.
        victim.kill().unwrap();
        victim.wait().unwrap();

        let mut reader = Reader::open(&path).unwrap();
        let table = log::table(&mut reader).unwrap();
        assert!(reader.truncated(), "round {round}");
        assert!(table.rows() >= 500, "only {} steps were saved", table.rows());
        for k in 0..table.rows() {
            assert_eq!(table.difference(k, &brain(k as u32)), None, "step {k}");
        }
    }
}
