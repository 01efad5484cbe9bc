//! What is shown of a recording, whole, cut off, damaged, or none at all.

use barrel::cli::{Cli, Command, SetupArgs};
use barrel::commands::run::{About, OverLink, description, over_link, title};
use barrel::csv::{BRAIN_COLUMNS, PLANT_COLUMNS};
use barrel::failure::Failure;
use barrel::log;
use barrel::recorded::Recorded;
use barrel::recorder::Places;
use clap::Parser;
use hil_sim::coupling::Coupling;
use hil_sim::link::Direction;
use hil_sim::record::BrainRecord;
use hil_sim::setup::{BodyKind, defaults};
use playground::channel::Id as Channel;
use playground::recording::{Recording, read};
use protocol::message::{Transducers, Vitals};
use protocol::{HostMessage, Id, RobotMessage};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Control steps of the runs.
const STEPS: usize = 200;

const ATTITUDE: [Channel; 4] = [Channel::Qw, Channel::Qx, Channel::Qy, Channel::Qz];
const IMU: [Channel; 6] = [Channel::Acc1, Channel::AccC, Channel::Acc2, Channel::Gyro1, Channel::GyroC, Channel::Gyro2];
const DUTY: [Channel; 2] = [Channel::Duty1, Channel::Duty2];
const TARGET: [Channel; 2] = [Channel::Target1, Channel::Target2];

/// A run of [`STEPS`] into a log.
struct Run<'a> {
    args: &'a SetupArgs,
    log: &'a Path,
}

impl OverLink for Run<'_> {
    fn over(self, link: impl Coupling, robot: &About) -> Result<(), Failure> {
        let setup = self.args.setup()?;
        let about = description(self.args, &setup, robot, None);
        let places = Places::new(None, Some(self.log.into()), None);
        let mut run = Recorded::start(setup, link, || Ok(places), &about, title(self.args, 0.0))?;
        for step in 0..STEPS {
            if step == STEPS / 2 {
                run.recorder.event(run.time(), "push", "half way")?;
            }
            run.step()?;
        }
        run.finish(Ok(())).map(drop)
    }
}

/// A log of the homeokinetic barrel with this body, in a folder of its own.
fn logged(body: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let log = folder.path().join("run.mcap");
    let cli = Cli::parse_from(["barrel", "run", "homeokinetic", "--body", body, "--set", "epsC=0.2"]);
    let Some(Command::Run(args)) = cli.command else { panic!("`barrel run` is the run command") };
    over_link(&args.setup, Run { args: &args.setup, log: &log }).expect("it runs");
    (folder, log)
}

fn shown(path: &Path) -> Recording {
    read(path).unwrap_or_else(|why| panic!("{}: {why}", path.display()))
}

fn refused(path: &Path) -> String {
    read(path).err().unwrap_or_else(|| panic!("{} was taken for a recording", path.display()))
}

/// Steps at which all of these are known.
fn known(recording: &Recording, channels: &[Channel]) -> usize {
    let frames = (0..recording.history.len()).filter_map(|row| recording.history.frame(row));
    frames.filter(|frame| channels.iter().all(|&channel| frame.get(channel).is_finite())).count()
}

#[test]
fn a_log_of_the_chapters_body_is_shown_step_by_step_with_its_attitude() {
    let (_folder, log) = logged("chapter");
    let recording = shown(&log);
    assert_eq!((recording.history.len(), recording.body), (STEPS, BodyKind::Chapter));
    assert_eq!(recording.problem, None);
    assert_eq!(recording.values.get(Id::EpsC), 0.2);
    for all in [&ATTITUDE[..], &TARGET, &[Channel::X1, Channel::Etle, Channel::Omega, Channel::Px, Channel::S2]] {
        assert_eq!(known(&recording, all), STEPS, "{all:?}");
    }
    // There is no inertial sensor in the chapter, and its drives are told where to be.
    assert_eq!((known(&recording, &IMU), known(&recording, &DUTY)), (0, 0));
    for row in 0..STEPS {
        let frame = recording.history.frame(row).expect("it is there");
        assert!((frame.t - row as f64 * 0.02).abs() < 1e-9, "step {row} at {} s", frame.t);
        let length: f32 = ATTITUDE.map(|part| frame.get(part).powi(2)).iter().sum();
        assert!((length - 1.0).abs() < 1e-3, "step {row}: an attitude of length {length}");
        let range = recording.values.get(Id::Range) as f32;
        assert_eq!(frame.get(Channel::Target1), -range * frame.get(Channel::Y1));
    }
    let events: Vec<(f64, &str)> = recording.events.iter().map(|event| (event.t, event.text.as_str())).collect();
    assert!(events.contains(&(2.0, "half way")), "{events:?}");
    assert!(recording.title.contains("homeokinetic"), "{}", recording.title);
}

#[test]
fn a_log_of_the_tabletop_is_shown_with_its_sensor_and_its_duties() {
    let (_folder, log) = logged("tabletop");
    let recording = shown(&log);
    assert_eq!((recording.history.len(), recording.body), (STEPS, BodyKind::Tabletop));
    for all in [&ATTITUDE[..], &IMU, &DUTY, &TARGET] {
        assert_eq!(known(&recording, all), STEPS, "{all:?}");
    }
    for frame in (0..STEPS).filter_map(|row| recording.history.frame(row)) {
        let force = [Channel::Acc1, Channel::AccC, Channel::Acc2].map(|axis| f64::from(frame.get(axis)).powi(2));
        let force = force.iter().sum::<f64>().sqrt();
        assert!((2.0..40.0).contains(&force), "{force} m/s² is not about that of gravity");
        assert!(DUTY.iter().all(|&duty| frame.get(duty).abs() <= 1.0));
    }
}

#[test]
fn of_a_log_that_is_cut_off_anywhere_what_is_before_is_shown_and_the_rest_is_said_to_be_missing() {
    let (folder, log) = logged("chapter");
    let (bytes, whole) = (fs::read(&log).expect("read"), shown(&log));
    let torn = folder.path().join("torn.mcap");
    let mut most = 0;
    for part in 0..40 {
        let length = bytes.len() * part / 40;
        fs::write(&torn, &bytes[..length]).expect("written");
        match read(&torn) {
            Ok(recording) => {
                assert!(recording.problem.is_some(), "{length} bytes of {} and no problem", bytes.len());
                assert!(recording.history.len() >= most, "{length} bytes show less than fewer did");
                most = recording.history.len();
                for row in 0..most {
                    let (a, b) = (recording.history.frame(row), whole.history.frame(row));
                    // NaN is not equal to itself, and is written the same.
                    assert_eq!(format!("{a:?}"), format!("{b:?}"), "{length} bytes, step {row}");
                }
            }
            Err(why) => {
                assert_eq!(most, 0, "{length} bytes show nothing, and fewer did");
                assert!(why.contains("torn.mcap") && (why.contains("cut off") || why.contains("empty")), "{why}");
            }
        }
    }
    assert!(most > STEPS / 2, "{most} steps of a log that was nearly whole");
}

#[test]
fn of_a_log_with_a_damaged_byte_what_is_before_is_shown_and_the_damage_is_said() {
    let (folder, log) = logged("chapter");
    let bytes = fs::read(&log).expect("read");
    let spoilt = folder.path().join("spoilt.mcap");
    let (mut shown, mut refused) = (0, 0);
    for part in 0..40 {
        let at = 8 + (bytes.len() - 16) * part / 40;
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x10;
        fs::write(&spoilt, &damaged).expect("written");
        match read(&spoilt) {
            Ok(recording) => {
                shown += 1;
                let steps = recording.history.len();
                assert!(steps == STEPS || recording.problem.is_some(), "byte {at}: {steps} steps and no problem");
                for row in 0..steps {
                    assert!(recording.history.frame(row).is_some_and(|frame| frame.get(Channel::X1).abs() <= 1.0));
                }
            }
            Err(why) => {
                refused += 1;
                assert!(why.contains("damaged") || why.contains("cut off"), "byte {at}: {why}");
            }
        }
    }
    assert!(shown > 20 && refused > 0, "{shown} were shown and {refused} refused");
}

#[test]
fn a_csv_is_shown_with_the_columns_that_it_has() {
    let (folder, log) = logged("chapter");
    let table = folder.path().join("run.csv");
    log::export(&log, &table).expect("exported");
    let (recording, whole) = (shown(&table), shown(&log));
    assert_eq!((recording.history.len(), recording.problem.as_deref()), (STEPS, None));
    assert_eq!(known(&recording, &[Channel::X1, Channel::Etle, Channel::Omega, Channel::Tilt]), STEPS);
    assert_eq!(known(&recording, &ATTITUDE), 0, "a CSV has no attitude");
    for column in BRAIN_COLUMNS[1..].iter().chain(&PLANT_COLUMNS) {
        let channel = Channel::from_name(column.name).expect("every column is a channel");
        for row in [0, 1, STEPS - 1] {
            let [a, b] = [&recording, &whole]
                .map(|recording| recording.history.frame(row).map_or(f32::NAN, |frame| frame.get(channel)));
            assert_eq!(a, b, "{} of step {row}", column.name);
        }
    }
}

#[test]
fn a_csv_of_sensors_alone_is_shown_at_fifty_steps_a_second() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("sensors.csv");
    fs::write(&path, "x1,x2,note\n0.1,0.2,a\n0.3,-0.4,b\n").expect("written");
    let recording = shown(&path);
    assert_eq!(recording.history.span(), Some((0.0, 0.02)));
    assert_eq!(recording.history.number_at(Channel::X2, None), -0.4);
}

#[test]
fn rows_whose_time_goes_back_are_said_to_be_left_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("two.csv");
    fs::write(&path, "t,x1,x2\n0,0.1,0.2\n0.02,0.3,0.4\n0,0.5,0.6\n0.04,0.7,0.8\n").expect("written");
    let recording = shown(&path);
    assert_eq!(recording.history.len(), 3);
    assert!(recording.problem.is_some_and(|problem| problem.contains("1 of its 4 rows")));
}

#[test]
fn a_table_without_a_single_channel_is_no_recording() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("prices.csv");
    fs::write(&path, "bread,milk\n1.5,2.5\n1.6,2.7\n").expect("written");
    let why = refused(&path);
    assert!(why.contains("prices.csv") && why.contains("x1"), "{why}");
}

fn brain(step: u32) -> BrainRecord<f32> {
    let t = f64::from(step) * 0.02;
    BrainRecord { t, x: [t.sin() as f32, 0.25], y: [0.5, -0.5], ..BrainRecord::default() }
}

fn said_to_robot(message: &HostMessage) -> Vec<u8> {
    let mut buffer = [0; protocol::frame::MAX_FRAME];
    protocol::encode(1, message, &mut buffer).expect("it fits").to_vec()
}

fn said_by_robot(message: &RobotMessage) -> Vec<u8> {
    let mut buffer = [0; protocol::frame::MAX_FRAME];
    protocol::encode(1, message, &mut buffer).expect("it fits").to_vec()
}

#[test]
fn a_log_of_a_robot_that_was_watched_has_no_plant_and_its_vitals_stand_until_the_next() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("watched.mcap");
    let about = BTreeMap::from([("command".to_owned(), "barrel monitor".to_owned())]);
    let mut log = log::Writer::create(&path, &about, &defaults(BodyKind::Tabletop)).expect("created");
    log.event(0.0, "state", "armed").expect("written");
    for step in 0..150 {
        log.record(&brain(step), None).expect("written");
        if step == 49 {
            let vitals = Vitals { load: 2400, battery_mv: 11_900, ..Vitals::default() };
            log.vitals(0.98, &vitals).expect("written");
        }
    }
    log.finish().expect("finished");
    let recording = shown(&path);
    assert_eq!((recording.history.len(), recording.body), (150, BodyKind::Tabletop));
    assert_eq!((known(&recording, &ATTITUDE), known(&recording, &[Channel::Omega])), (0, 0));
    assert_eq!(known(&recording, &TARGET), 150);
    assert_eq!(recording.history.number_at(Channel::Battery, None), 11.9);
    assert!(recording.history.number_at(Channel::Battery, Some(0.9)).is_nan(), "nothing is known before it is said");
    assert_eq!(recording.events.len(), 1);
    assert_eq!(recording.title, "barrel monitor");
}

#[test]
fn readings_and_duties_on_the_wire_are_shown_in_si_units() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("wire.mcap");
    let mut log = log::Writer::create(&path, &BTreeMap::new(), &defaults(BodyKind::Tabletop)).expect("created");
    let read = Transducers { accelerometer: [8192, 0, -8192], gyroscope: [0, 1640, 0], ..Transducers::default() };
    let frame = said_to_robot(&HostMessage::Transducers(read));
    log.frame(0, Direction::ToRobot, &frame).expect("written");
    let frame = said_by_robot(&RobotMessage::Actuators { duty: [0.5, -0.25] });
    log.frame(0, Direction::ToHost, &frame).expect("written");
    log.record(&brain(0), None).expect("written");
    log.finish().expect("finished");
    let recording = shown(&path);
    let number = |channel| recording.history.number_at(channel, None);
    assert!((number(Channel::Acc1) - 9.806_65).abs() < 1e-4 && (number(Channel::Acc2) + 9.806_65).abs() < 1e-4);
    assert!((number(Channel::GyroC) - 100.0_f32.to_radians()).abs() < 1e-5);
    assert_eq!([number(Channel::Duty1), number(Channel::Duty2)], [0.5, -0.25]);
}

/// Takes the attitude out of a log, as those before this version had none: its columns get other names, and what was
/// computed from the bytes is said to be unknown.
fn without_attitude(log: &mut [u8]) {
    const CHUNK: u8 = 6;
    const DATA_END: u8 = 15;
    let mut at = 8;
    while let Some(head) = log.get(at..at + 9) {
        let (opcode, length) = (head[0], u64::from_le_bytes(head[1..].try_into().expect("eight bytes")) as usize);
        let Some(record) = log.get_mut(at + 9..at + 9 + length) else { return };
        match opcode {
            CHUNK => {
                record[24..28].fill(0);
                for i in 0..record.len() - 4 {
                    let is_name = record[i] == b'"' && record[i + 1] == b'q' && record[i + 3] == b'"';
                    if is_name && b"wxyz".contains(&record[i + 2]) {
                        record[i + 1] = b'o';
                    }
                }
            }
            DATA_END => record.fill(0),
            _ => {}
        }
        at += 9 + length;
    }
}

#[test]
fn a_log_from_before_the_attitude_was_recorded_is_shown_without_it() {
    let (_folder, log) = logged("chapter");
    let mut bytes = fs::read(&log).expect("read");
    without_attitude(&mut bytes);
    fs::write(&log, bytes).expect("written");
    let recording = shown(&log);
    assert_eq!((recording.history.len(), recording.problem.as_deref()), (STEPS, None));
    assert_eq!(known(&recording, &ATTITUDE), 0);
    assert_eq!(known(&recording, &[Channel::Omega, Channel::Phi, Channel::Tilt, Channel::Px, Channel::S1]), STEPS);
}

#[test]
fn what_is_no_recording_is_refused_with_a_sentence_that_names_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let garbage: Vec<u8> = (0..4096_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    for (name, content, why) in [
        ("garbage.mcap", &garbage[..], "not an MCAP log"),
        ("garbage.csv", &garbage, "not text"),
        ("empty.mcap", b"", "is empty"),
        ("empty.csv", b"", "is empty"),
        ("header.csv", b"t,x1,x2\n", "no row"),
        ("csv.mcap", b"t,x1,x2\n0,0,0\n", "give it the ending .csv"),
        ("picture.png", b"\x89PNG\r\n\x1a\n", "picture.png"),
    ] {
        let path = folder.path().join(name);
        fs::write(&path, content).expect("written");
        let said = refused(&path);
        assert!(said.contains(name) && said.contains(why), "{name}: {said}");
    }
}

#[test]
fn a_recording_that_is_not_there_is_answered_with_the_nearest_name_and_a_folder_is_none() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("run.mcap"), b"").expect("written");
    fs::write(folder.path().join("other.csv"), b"").expect("written");
    let said = refused(&folder.path().join("rum.mcap"));
    assert!(said.contains("did you mean 'run.mcap'?"), "{said}");
    for name in ["runs", "runs.mcap"] {
        let path = folder.path().join(name);
        fs::create_dir(&path).expect("made");
        let said = refused(&path);
        assert!(said.contains("folder") || said.contains("directory"), "{said}");
    }
}
