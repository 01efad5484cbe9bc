//! The writer of a log.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use hil_sim::record::{BrainRecord, PlantRecord};
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{McapError, WriteOptions};
use protocol::message::Vitals;
use protocol::{Id, Values};
use serde_json::json;

use super::{BRAIN, Direction, EVENTS, LogError, PLANT, VITALS, WIRE_HOST, WIRE_ROBOT};
use crate::csv::{
    ATTITUDE_COLUMNS, BRAIN_COLUMNS, Column, Number, PLANT_COLUMNS, brain_row, grid_time, plant_row, shortest,
};

/// A chunk is closed when it spans this much virtual time, ns: what a killed run loses at most.
const CHUNK_SPAN: u64 = 1_000_000_000;
/// A chunk is closed when it holds this many bytes: a servo-rate link fills them in a few seconds.
const CHUNK_BYTES: usize = 1 << 20;

/// Writes a log. Memory holds the open chunk only; every closed chunk has been handed to the operating system.
pub struct Writer<W: Write = BufWriter<File>> {
    mcap: mcap::Writer<NoSeek<W>>,
    path: PathBuf,
    channels: Channels,
    sequence: [u32; CHANNELS],
    /// Time of the last message, ns: the log's never goes back.
    latest: u64,
    chunk_start: Option<u64>,
    chunk_bytes: usize,
    json: Vec<u8>,
}

/// Channels that there can be.
const CHANNELS: usize = 6;

/// The channels' ids in the file.
#[derive(Clone, Copy)]
struct Channels {
    wire_host: u16,
    wire_robot: u16,
    brain: u16,
    plant: u16,
    events: u16,
    /// Added when the first vitals come: most runs have none.
    vitals: Option<u16>,
}

impl Writer<BufWriter<File>> {
    /// Creates (or replaces) the file and writes its head: schemas, channels and metadata.
    ///
    /// `run` says how to repeat the run (experiment, body, link, precision, seed, duration, command line, …); the
    /// versions and the protocol's schema hash are added to it. `parameters` are the values at the start.
    pub fn create(path: &Path, run: &BTreeMap<String, String>, parameters: &Values<f64>) -> Result<Self, LogError> {
        let file =
            File::create(path).map_err(|error| LogError::Write { path: path.into(), reason: error.to_string() })?;
        Writer::new(BufWriter::new(file), path, run, parameters)
    }
}

impl<W: Write> Writer<W> {
    /// Writes into `out`; `path` is for messages only.
    pub fn new(
        out: W,
        path: &Path,
        run: &BTreeMap<String, String>,
        parameters: &Values<f64>,
    ) -> Result<Self, LogError> {
        let error = |error| write_error(path, error);
        // Seeking is off, so that a chunk gathers in memory and goes out whole, with a header that is right at once.
        let mut mcap = WriteOptions::new()
            // A run is written at a thousand times real time: compression would take a third of that, and the C compiler
            // that builds it as long as everything else.
            .compression(None)
            .chunk_size(None)
            .disable_seeking(true)
            .library(concat!("barrel/", env!("CARGO_PKG_VERSION")))
            .create(NoSeek::new(out))
            .map_err(error)?;
        for (name, metadata) in [("run", run_metadata(run)), ("parameters", parameter_metadata(parameters))] {
            mcap.write_metadata(&Metadata { name: name.into(), metadata }).map_err(error)?;
        }
        let channels = add_channels(&mut mcap).map_err(error)?;
        // The channels' own small chunk: no data is lost with them, and damage to a data chunk does not touch them.
        mcap.flush().map_err(error)?;
        Ok(Writer {
            mcap,
            path: path.into(),
            channels,
            sequence: [0; CHANNELS],
            latest: 0,
            chunk_start: None,
            chunk_bytes: 0,
            json: Vec::with_capacity(1024),
        })
    }

    /// Adds a frame as it went over the wire at virtual time `time`, ns.
    pub fn frame(&mut self, time: u64, direction: Direction, bytes: &[u8]) -> Result<(), LogError> {
        let channel = match direction {
            Direction::ToRobot => self.channels.wire_host,
            Direction::ToHost => self.channels.wire_robot,
        };
        self.message(channel, time, bytes)
    }

    /// Adds one control step: the brain and, on a simulated body, the plant.
    pub fn record<T: Number>(&mut self, brain: &BrainRecord<T>, plant: Option<&PlantRecord>) -> Result<(), LogError> {
        let t = grid_time(brain.t);
        let mut json = std::mem::take(&mut self.json);
        json.clear();
        json_time(t, &mut json);
        for (column, number) in BRAIN_COLUMNS[1..].iter().zip(brain_row(brain)) {
            json_field(column, number, &mut json);
        }
        json.push(b'}');
        let mut result = self.message(self.channels.brain, nanoseconds(t), &json);
        if let (Ok(()), Some(plant)) = (&result, plant) {
            json.clear();
            json_time(t, &mut json);
            let numbers = plant_row(plant).into_iter().chain(plant.orientation);
            for (column, number) in PLANT_COLUMNS.iter().chain(&ATTITUDE_COLUMNS).zip(numbers) {
                json_field(column, number, &mut json);
            }
            json.push(b'}');
            result = self.message(self.channels.plant, nanoseconds(t), &json);
        }
        self.json = json;
        result
    }

    /// Adds an event at virtual time `t`, s: `kind` is one word, `text` says what happened.
    pub fn event(&mut self, t: f64, kind: &str, text: &str) -> Result<(), LogError> {
        let t = grid_time(t);
        let json = json!({ "t": t, "kind": kind, "text": text }).to_string();
        self.message(self.channels.events, nanoseconds(t), json.as_bytes())
    }

    /// Adds what a robot says of itself at time `t`, s.
    pub fn vitals(&mut self, t: f64, vitals: &Vitals) -> Result<(), LogError> {
        let channel = match self.channels.vitals {
            Some(channel) => channel,
            None => {
                let added = add_vitals(&mut self.mcap).map_err(|error| write_error(&self.path, error))?;
                *self.channels.vitals.insert(added)
            }
        };
        let mut json = json!(vitals);
        json["t"] = json!(t);
        self.message(channel, nanoseconds(t), json.to_string().as_bytes())
    }

    /// Closes the open chunk and hands it to the operating system: for a pause, or before something risky.
    pub fn flush(&mut self) -> Result<(), LogError> {
        self.chunk_start = None;
        self.chunk_bytes = 0;
        self.mcap.flush().map_err(|error| write_error(&self.path, error))
    }

    /// Closes the log: the last chunk, then the index that lets other tools jump in time. Gives the inner writer back.
    pub fn finish(mut self) -> Result<W, LogError> {
        self.mcap.finish().map_err(|error| write_error(&self.path, error))?;
        let mut out = self.mcap.into_inner().into_inner();
        out.flush().map_err(|error| write_error(&self.path, error.into()))?;
        Ok(out)
    }

    fn message(&mut self, channel: u16, time: u64, data: &[u8]) -> Result<(), LogError> {
        let time = time.max(self.latest);
        self.latest = time;
        let start = *self.chunk_start.get_or_insert(time);
        if time.saturating_sub(start) >= CHUNK_SPAN || self.chunk_bytes >= CHUNK_BYTES {
            self.flush()?;
            self.chunk_start = Some(time);
        }
        self.chunk_bytes += data.len();
        let sequence = &mut self.sequence[usize::from(channel) % CHANNELS];
        let header = MessageHeader { channel_id: channel, sequence: *sequence, log_time: time, publish_time: time };
        *sequence = sequence.wrapping_add(1);
        self.mcap.write_to_known_channel(&header, data).map_err(|error| write_error(&self.path, error))
    }
}

fn write_error(path: &Path, error: McapError) -> LogError {
    let reason = match error {
        McapError::Io(error) => error.to_string(),
        error => error.to_string(),
    };
    LogError::Write { path: path.into(), reason }
}

fn nanoseconds(t: f64) -> u64 {
    // A negative time saturates to zero.
    (t * 1e9).round() as u64
}

fn json_time(t: f64, json: &mut Vec<u8>) {
    json.extend_from_slice(b"{\"t\":");
    t.write(json);
}

fn json_field<T: Number>(column: &Column, number: T, json: &mut Vec<u8>) {
    json.extend_from_slice(b",\"");
    json.extend_from_slice(column.name.as_bytes());
    json.extend_from_slice(b"\":");
    if number.finite() {
        number.write(json);
    } else {
        // JSON has no NaN.
        json.extend_from_slice(b"null");
    }
}

fn run_metadata(run: &BTreeMap<String, String>) -> BTreeMap<String, String> {
    let mut metadata = run.clone();
    for (key, value) in [
        ("barrel_version", env!("CARGO_PKG_VERSION").to_string()),
        ("protocol_version", protocol::VERSION.to_string()),
        ("schema_hash", schema_hash()),
    ] {
        metadata.entry(key.into()).or_insert(value);
    }
    metadata
}

fn parameter_metadata(parameters: &Values<f64>) -> BTreeMap<String, String> {
    Id::ALL.iter().map(|&id| (id.name().to_string(), shortest(parameters.get(id)))).collect()
}

fn schema_hash() -> String {
    format!("{:016x}", protocol::SCHEMA)
}

fn add_channels<W: Write>(mcap: &mut mcap::Writer<NoSeek<W>>) -> Result<Channels, McapError> {
    let mut wire = |topic, message: &str, way: &str| {
        let schema = mcap.add_schema(&format!("barrel.{message}"), "text", wire_schema(message, way).as_bytes())?;
        let metadata = BTreeMap::from([("schema_hash".to_string(), schema_hash())]);
        mcap.add_channel(schema, topic, "postcard-cobs", &metadata)
    };
    let wire_host = wire(WIRE_HOST, "HostMessage", "from host to robot")?;
    let wire_robot = wire(WIRE_ROBOT, "RobotMessage", "from robot to host")?;

    let mut json = |topic, name, schema: serde_json::Value| {
        let schema = mcap.add_schema(name, "jsonschema", schema.to_string().as_bytes())?;
        mcap.add_channel(schema, topic, "json", &BTreeMap::new())
    };
    let brain = json(BRAIN, "barrel.Brain", number_schema("the brain after a control step", &BRAIN_COLUMNS))?;
    let plant_columns: Vec<Column> =
        [BRAIN_COLUMNS[0]].into_iter().chain(PLANT_COLUMNS).chain(ATTITUDE_COLUMNS).collect();
    let plant = json(PLANT, "barrel.Plant", number_schema("the simulated barrel", &plant_columns))?;
    let events = json(
        EVENTS,
        "barrel.Event",
        json!({
            "type": "object",
            "description": "something happened",
            "properties": {
                "t": { "type": "number", "description": "virtual time [s]" },
                "kind": { "type": "string", "description": "sort of event, one word" },
                "text": { "type": "string", "description": "what happened" },
            },
            "required": ["t", "kind", "text"],
        }),
    )?;
    Ok(Channels { wire_host, wire_robot, brain, plant, events, vitals: None })
}

fn add_vitals<W: Write>(mcap: &mut mcap::Writer<NoSeek<W>>) -> Result<u16, McapError> {
    let properties: serde_json::Map<String, serde_json::Value> = [
        ("t", "number", "time [s]"),
        ("ticks", "number", "servo ticks since the robot's start"),
        ("homed", "boolean", "the middle of both axes is known"),
        ("simulated_sensors", "boolean", "the sensors are the host's"),
        ("load", "number", "part of the last second that the core was awake [1/10000]"),
        ("servo_ns", "number", "longest servo tick without a control step [ns]"),
        ("brain_ns", "number", "longest servo tick with a control step [ns]"),
        ("jitter_ns", "number", "largest distance of a servo tick's start from its period [ns]"),
        ("overruns", "number", "servo ticks that missed their deadline"),
        ("imu_missed", "number", "servo ticks without a new reading of the inertial sensor"),
        ("battery_mv", "number", "supply of the motors [mV]"),
        ("encoder", "array", "where the encoders of the two axes stand, counts since the robot's start"),
        ("unsent", "number", "frames that found this line busy"),
        ("garbled", "number", "frames that the robot received garbled"),
    ]
    .map(|(name, kind, help)| {
        let mut property = json!({ "type": kind, "description": help });
        if kind == "array" {
            property["items"] = json!({ "type": "number" });
        }
        (name.to_string(), property)
    })
    .into_iter()
    .collect();
    let schema = json!({ "type": "object", "description": "how the robot is", "properties": properties });
    let schema = mcap.add_schema("barrel.Vitals", "jsonschema", schema.to_string().as_bytes())?;
    mcap.add_channel(schema, VITALS, "json", &BTreeMap::new())
}

fn wire_schema(message: &str, way: &str) -> String {
    let mut text = format!(
        "barrel protocol, version {}, schema hash {}\n\n\
         Each message of this channel is one frame {way}:\n\n\
         frame    = COBS( sequence | message | crc ) 00\n\
         sequence   u16, little endian: counts every frame of one direction, wraps\n\
         message    postcard form of {message}\n\
         crc        CRC-32/ISO-HDLC of sequence and message, little endian\n\n\
         A parameter's index on the wire is its place in this list:\n",
        protocol::VERSION,
        schema_hash(),
    );
    for (i, parameter) in protocol::parameter::TABLE.iter().enumerate() {
        let separator = if i == 0 { "" } else { " " };
        let _ = write!(text, "{separator}{}", parameter.name);
    }
    text.push('\n');
    text
}

fn number_schema(description: &str, columns: &[Column]) -> serde_json::Value {
    let properties: serde_json::Map<String, serde_json::Value> = columns
        .iter()
        .map(|column| {
            let unit = if column.unit.is_empty() { String::new() } else { format!(" [{}]", column.unit) };
            let description = format!("{}{unit}", column.help);
            (column.name.to_string(), json!({ "type": "number", "description": description }))
        })
        .collect();
    let required: Vec<&str> = columns.iter().map(|column| column.name).collect();
    json!({ "type": "object", "description": description, "properties": properties, "required": required })
}
