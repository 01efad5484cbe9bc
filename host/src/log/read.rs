//! The reader of a log: streams it chunk by chunk, and takes a file that was cut off anywhere.

use std::collections::{BTreeMap, HashMap, VecDeque};
use std::fs::File;
use std::io::{self, BufReader, Cursor, Read};
use std::path::{Path, PathBuf};

use hil_sim::record::{BrainRecord, PlantRecord};
use mcap::records::{Record, op};
use mcap::sans_io::LinearReader;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReaderOptions};
use mcap::{MAGIC, McapError};

use super::{BRAIN, Direction, EVENTS, Entry, Event, LogError, PLANT, VITALS, WIRE_HOST, WIRE_ROBOT};
use crate::csv::{self, ATTITUDE_COLUMNS, BRAIN_COLUMNS, PLANT_COLUMNS, Table};
use crate::draft::Draft;

/// No chunk of any sane writer unpacks to more than this; a larger one is damage, and would only eat memory.
const MAX_CHUNK_BYTES: usize = 1 << 28;
/// Opcode, then length, in front of every record.
const RECORD_HEAD: u64 = 1 + 8;

/// Streams the entries of a log, in the order of the file.
///
/// An iterator: it yields whole chunks only, each checked against its checksum before its first entry comes out. After
/// an `Err` (damage) it ends. When it has ended, [`Reader::truncated`] says whether the log's own end was there.
pub struct Reader<R: Read = BufReader<File>> {
    /// The file; its first bytes have been looked at and are put in front again.
    input: io::Chain<Cursor<Vec<u8>>, R>,
    path: PathBuf,
    file: LinearReader,
    /// Offset of the record to come.
    at: u64,
    chunks: u32,
    metadata: BTreeMap<String, BTreeMap<String, String>>,
    channels: HashMap<u16, Option<Topic>>,
    entries: VecDeque<Entry>,
    end: Option<End>,
    /// Found while looking for the metadata, kept for the iterator.
    damage: Option<LogError>,
}

#[derive(Clone, Copy)]
enum Topic {
    Wire(Direction),
    Brain,
    Plant,
    Events,
    Vitals,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum End {
    Whole,
    Truncated,
    Damaged,
}

impl Reader<BufReader<File>> {
    /// Opens a log and reads its head: the metadata is there at once.
    ///
    /// # Errors
    /// [`LogError::Read`], [`LogError::Empty`], [`LogError::NotMcap`]. Damage is reported by the iterator.
    pub fn open(path: &Path) -> Result<Self, LogError> {
        let read_error = |source| LogError::Read { path: path.into(), source };
        let file = File::open(path).map_err(read_error)?;
        let metadata = file.metadata().map_err(read_error)?;
        if metadata.is_dir() {
            return Err(read_error(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder")));
        }
        Reader::new(BufReader::new(file), metadata.len(), path)
    }
}

impl<R: Read> Reader<R> {
    /// Reads a log of `length` bytes from `input`; `path` is for messages only.
    ///
    /// # Errors
    /// As [`Reader::open`].
    pub fn new(mut input: R, length: u64, path: &Path) -> Result<Self, LogError> {
        let mut start = Vec::new();
        input
            .by_ref()
            .take(MAGIC.len() as u64)
            .read_to_end(&mut start)
            .map_err(|source| LogError::Read { path: path.into(), source })?;
        if start.is_empty() {
            return Err(LogError::Empty { path: path.into() });
        }
        if !MAGIC.starts_with(&start) {
            let hint = if start.starts_with(b"t,x") { "; it looks like a CSV: give it the ending .csv" } else { "" };
            return Err(LogError::NotMcap { path: path.into(), hint });
        }
        let options = LinearReaderOptions::default()
            .with_emit_chunks(true)
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true)
            // A record that claims to be longer than the file was cut off.
            .with_record_length_limit(usize::try_from(length).unwrap_or(usize::MAX));
        let mut reader = Reader {
            input: Cursor::new(start).chain(input),
            path: path.into(),
            file: LinearReader::new_with_options(options),
            at: MAGIC.len() as u64,
            chunks: 0,
            metadata: BTreeMap::new(),
            channels: HashMap::new(),
            entries: VecDeque::new(),
            end: None,
            damage: None,
        };
        while reader.entries.is_empty() && reader.end.is_none() {
            if let Err(error) = reader.advance() {
                reader.end = Some(End::Damaged);
                reader.damage = Some(error);
            }
        }
        Ok(reader)
    }

    /// How the run can be repeated: experiment, body, link, seed, versions, … Empty if the file ends before it.
    pub fn run(&self) -> BTreeMap<String, String> {
        self.metadata("run").cloned().unwrap_or_default()
    }

    /// The parameters at the start of the run, name to number. Empty if the file ends before them.
    pub fn parameters(&self) -> BTreeMap<String, String> {
        self.metadata("parameters").cloned().unwrap_or_default()
    }

    /// Any metadata record, by name.
    pub fn metadata(&self, name: &str) -> Option<&BTreeMap<String, String>> {
        self.metadata.get(name)
    }

    /// Whether the end of the file is missing: the run was killed, or the copy is not complete. Known once the iterator
    /// has ended.
    pub fn truncated(&self) -> bool {
        self.end == Some(End::Truncated)
    }

    /// The file, for messages.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Reads one record of the file, a whole chunk at most.
    fn advance(&mut self) -> Result<(), LogError> {
        let (opcode, data) = match next_record(&mut self.file, &mut self.input) {
            Ok(Some(record)) => record,
            Ok(None) => {
                self.end = Some(End::Whole);
                return Ok(());
            }
            Err(Failure::Io(source)) => return Err(LogError::Read { path: self.path.clone(), source }),
            Err(Failure::Mcap(McapError::UnexpectedEof | McapError::RecordTooLarge { .. })) => {
                self.end = Some(End::Truncated);
                return Ok(());
            }
            Err(Failure::Mcap(error @ McapError::BadDataCrc { .. })) => {
                return Err(self.damaged("metadata or indexes between the chunks".into(), error.to_string()));
            }
            Err(Failure::Mcap(error)) => return Err(self.damaged("end of the file".into(), error.to_string())),
        };
        match opcode {
            // What a file system leaves behind when the power goes: a tail of zeros.
            0 if data.is_empty() => self.end = Some(End::Truncated),
            op::CHUNK => self.chunk(&data)?,
            op::METADATA => match mcap::parse_record(opcode, &data) {
                Ok(Record::Metadata(record)) => {
                    self.metadata.insert(record.name, record.metadata);
                }
                _ => return Err(self.damaged("metadata".into(), "it cannot be decoded".into())),
            },
            op::SCHEMA | op::CHANNEL | op::MESSAGE => {
                let entry = read_record(opcode, &data, &mut self.channels);
                self.entries.extend(entry.map_err(|reason| self.damaged("records outside chunks".into(), reason))?);
            }
            0 | 0x10..=0x7f => return Err(self.damaged("records".into(), format!("no record has opcode {opcode}"))),
            _ => {}
        }
        self.at += RECORD_HEAD + data.len() as u64;
        Ok(())
    }

    /// Unpacks a chunk, checks it, and only then takes its entries.
    fn chunk(&mut self, data: &[u8]) -> Result<(), LogError> {
        self.chunks += 1;
        let part = |number| {
            let seconds = data.get(..8).and_then(|bytes| bytes.try_into().ok()).map(u64::from_le_bytes);
            format!("chunk {number} (from {:.2} s)", seconds.unwrap_or(0) as f64 * 1e-9)
        };
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(MAX_CHUNK_BYTES);
        let mut chunk = LinearReader::new_with_options(options);
        let head = [&[op::CHUNK][..], &(data.len() as u64).to_le_bytes()].concat();
        let mut input = head.as_slice().chain(data);
        let mut entries = Vec::new();
        loop {
            match next_record(&mut chunk, &mut input) {
                Ok(None) => break,
                Ok(Some((opcode, record))) => match read_record(opcode, &record, &mut self.channels) {
                    Ok(entry) => entries.extend(entry),
                    Err(reason) => return Err(self.damaged(part(self.chunks), reason)),
                },
                Err(Failure::Mcap(error)) => return Err(self.damaged(part(self.chunks), error.to_string())),
                Err(Failure::Io(error)) => return Err(self.damaged(part(self.chunks), error.to_string())),
            }
        }
        self.entries.extend(entries);
        Ok(())
    }

    fn damaged(&self, part: String, reason: String) -> LogError {
        LogError::Damaged { path: self.path.clone(), at: self.at, part, reason }
    }
}

impl<R: Read> Iterator for Reader<R> {
    type Item = Result<Entry, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(entry) = self.entries.pop_front() {
                return Some(Ok(entry));
            }
            if let Some(damage) = self.damage.take() {
                return Some(Err(damage));
            }
            if self.end.is_some() {
                return None;
            }
            if let Err(error) = self.advance() {
                self.end = Some(End::Damaged);
                return Some(Err(error));
            }
        }
    }
}

enum Failure {
    Io(io::Error),
    Mcap(McapError),
}

/// The next record of a file or a chunk, as opcode and content; `None` at the end.
fn next_record(machine: &mut LinearReader, input: &mut impl Read) -> Result<Option<(u8, Vec<u8>)>, Failure> {
    while let Some(event) = machine.next_event() {
        match event.map_err(Failure::Mcap)? {
            LinearReadEvent::Record { opcode, data } => return Ok(Some((opcode, data.to_vec()))),
            LinearReadEvent::ReadRequest(wanted) => {
                let read = input.read(machine.insert(wanted)).map_err(Failure::Io)?;
                machine.notify_read(read);
            }
        }
    }
    Ok(None)
}

/// Takes one schema, channel or message; other topics than ours are passed over.
fn read_record(opcode: u8, data: &[u8], channels: &mut HashMap<u16, Option<Topic>>) -> Result<Option<Entry>, String> {
    if opcode != op::CHANNEL && opcode != op::MESSAGE {
        return Ok(None);
    }
    match mcap::parse_record(opcode, data).map_err(|error| error.to_string())? {
        Record::Channel(channel) => {
            let topic = match (channel.topic.as_str(), channel.message_encoding.as_str()) {
                (WIRE_HOST, _) => Some(Topic::Wire(Direction::ToRobot)),
                (WIRE_ROBOT, _) => Some(Topic::Wire(Direction::ToHost)),
                (BRAIN, "json") => Some(Topic::Brain),
                (PLANT, "json") => Some(Topic::Plant),
                (EVENTS, "json") => Some(Topic::Events),
                (VITALS, "json") => Some(Topic::Vitals),
                _ => None,
            };
            channels.insert(channel.id, topic);
            Ok(None)
        }
        Record::Message { header, data } => {
            let topic = channels
                .get(&header.channel_id)
                .ok_or_else(|| format!("a message of channel {}, which is not described", header.channel_id))?;
            Ok(match topic {
                None => None,
                Some(Topic::Wire(direction)) => {
                    Some(Entry::Frame { time: header.log_time, direction: *direction, bytes: data.into_owned() })
                }
                Some(Topic::Brain) => Some(Entry::Brain(brain(&numbers(&data)?))),
                Some(Topic::Plant) => {
                    let numbers = numbers(&data)?;
                    Some(Entry::Plant { t: get(&numbers, "t"), plant: plant(&numbers) })
                }
                Some(Topic::Events) => Some(Entry::Event(event(&data)?)),
                Some(Topic::Vitals) => Some(vitals(&data)?),
            })
        }
        _ => Ok(None),
    }
}

type Numbers<'a> = HashMap<&'a str, Option<f64>>;

fn numbers(json: &[u8]) -> Result<Numbers<'_>, String> {
    serde_json::from_slice(json).map_err(|error| format!("a message that is not an object of numbers: {error}"))
}

fn get(numbers: &Numbers, name: &str) -> f64 {
    numbers.get(name).copied().flatten().unwrap_or(f64::NAN)
}

fn brain(numbers: &Numbers) -> BrainRecord<f64> {
    let row: [f64; 21] = BRAIN_COLUMNS.map(|column| get(numbers, column.name));
    let [t, x1, x2, y1, y2, c11, c12, c21, c22, h1, h2, a11, a12, a21, a22, b1, b2, xi1, xi2, error, time_loop_error] =
        row;
    BrainRecord {
        t,
        x: [x1, x2],
        y: [y1, y2],
        c: [c11, c12, c21, c22],
        h: [h1, h2],
        a: [a11, a12, a21, a22],
        b: [b1, b2],
        xi: [xi1, xi2],
        error,
        time_loop_error,
    }
}

fn plant(numbers: &Numbers) -> PlantRecord {
    let [omega, phi, s1, s2, px, py, pz, tilt] = PLANT_COLUMNS.map(|column| get(numbers, column.name));
    let orientation = ATTITUDE_COLUMNS.map(|column| get(numbers, column.name));
    PlantRecord { omega, phi, weights: [s1, s2], position: [px, py, pz], tilt, orientation }
}

fn event(json: &[u8]) -> Result<Event, String> {
    let value: serde_json::Value = serde_json::from_slice(json).map_err(|error| format!("a broken event: {error}"))?;
    let text = |name: &str| value[name].as_str().unwrap_or_default().to_string();
    Ok(Event { t: value["t"].as_f64().unwrap_or(f64::NAN), kind: text("kind"), text: text("text") })
}

fn vitals(json: &[u8]) -> Result<Entry, String> {
    let broken = |error| format!("broken vitals: {error}");
    let value: serde_json::Value = serde_json::from_slice(json).map_err(broken)?;
    let t = value["t"].as_f64().unwrap_or(f64::NAN);
    Ok(Entry::Vitals { t, vitals: serde_json::from_value(value).map_err(broken)? })
}

/// All control steps of a log as a table, with the plant's columns where it has them.
///
/// # Errors
/// Damage, and [`LogError::Missing`] if there is not one control step.
pub fn table<R: Read>(reader: &mut Reader<R>) -> Result<Table, LogError> {
    let mut brain: Vec<Vec<f64>> = vec![Vec::new(); BRAIN_COLUMNS.len()];
    let mut plant: Vec<Vec<f64>> = vec![Vec::new(); PLANT_COLUMNS.len()];
    for entry in reader.by_ref() {
        match entry? {
            Entry::Brain(record) => {
                let row = [csv::grid_time(record.t)].into_iter().chain(csv::brain_row(&record));
                brain.iter_mut().zip(row).for_each(|(column, number)| column.push(number));
            }
            Entry::Plant { plant: record, .. } => {
                // A step without a plant, if there ever was one, leaves a gap.
                let row = brain[0].len().saturating_sub(1);
                for (column, number) in plant.iter_mut().zip(csv::plant_row(&record)) {
                    column.resize(row, f64::NAN);
                    column.push(number);
                }
            }
            Entry::Frame { .. } | Entry::Event(_) | Entry::Vitals { .. } => {}
        }
    }
    let rows = brain[0].len();
    if rows == 0 {
        let (path, truncated) = (reader.path.clone(), reader.truncated());
        return Err(LogError::Missing { path, topic: BRAIN, truncated });
    }
    let mut table = Table::new(reader.path.display().to_string());
    for (column, numbers) in BRAIN_COLUMNS.iter().zip(brain) {
        table.insert(column.name, numbers);
    }
    if plant.iter().any(|column| !column.is_empty()) {
        for (column, mut numbers) in PLANT_COLUMNS.iter().zip(plant) {
            numbers.resize(rows, f64::NAN);
            table.insert(column.name, numbers);
        }
    }
    Ok(table)
}

/// Reads a recording of either kind, a log or a CSV, told apart by its first bytes; the flag says whether the end of a
/// log is missing.
pub fn read_table(path: &Path) -> Result<(Table, bool), LogError> {
    if is_log(path) {
        let mut reader = Reader::open(path)?;
        let table = table(&mut reader)?;
        Ok((table, reader.truncated()))
    } else {
        Ok((csv::read(path)?, false))
    }
}

/// Whether a file is a log, by its ending or by how it begins.
pub fn is_log(path: &Path) -> bool {
    let mut start = [0; 4];
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mcap"))
        || File::open(path).is_ok_and(|mut file| file.read_exact(&mut start).is_ok() && MAGIC.starts_with(&start))
}

/// What [`export`] has done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Export {
    /// Rows written.
    pub rows: usize,
    /// Whether the end of the log is missing.
    pub truncated: bool,
}

/// Turns a log into the CSV that the run would have written. The CSV appears whole or not at all.
///
/// # Errors
/// Damage, [`LogError::Missing`] if there is not one control step, a CSV that cannot be written.
pub fn export(log: &Path, csv: &Path) -> Result<Export, LogError> {
    let write_error = |source| csv::CsvError::Write { path: csv.into(), source };
    let mut reader = Reader::open(log)?;
    let draft = Draft::beside(csv).map_err(write_error)?;
    let mut writer: Option<csv::Writer> = None;
    let mut step: Option<BrainRecord<f64>> = None;
    let mut rows = 0;
    // A step is written when its plant, or the next step, or the end has come; the first one decides on the header.
    let mut write = |step: BrainRecord<f64>, plant: Option<PlantRecord>| -> Result<(), LogError> {
        let writer = match &mut writer {
            Some(writer) => writer,
            None => writer.insert(csv::Writer::create(draft.path(), plant.is_some())?),
        };
        rows += 1;
        Ok(writer.write(&step, plant.as_ref())?)
    };
    for entry in reader.by_ref() {
        match entry? {
            Entry::Brain(next) => {
                if let Some(step) = step.replace(next) {
                    write(step, None)?;
                }
            }
            Entry::Plant { plant, .. } => {
                if let Some(step) = step.take() {
                    write(step, Some(plant))?;
                }
            }
            Entry::Frame { .. } | Entry::Event(_) | Entry::Vitals { .. } => {}
        }
    }
    if let Some(step) = step {
        write(step, None)?;
    }
    let truncated = reader.truncated();
    let Some(writer) = writer else {
        return Err(LogError::Missing { path: log.into(), topic: BRAIN, truncated });
    };
    writer.finish()?;
    draft.commit().map_err(write_error)?;
    Ok(Export { rows, truncated })
}
