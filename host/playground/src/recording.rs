//! A recording that is shown: a log or a CSV, read in a thread of its own.

use crate::channel::{Frame, Id as Channel};
use crate::history::History;
use barrel::csv;
use barrel::failure::Failure;
use barrel::log::{self, Entry, Event, LogError, Reader};
use hil_sim::link::Direction;
use hil_sim::record::BrainRecord;
use hil_sim::setup::{BodyKind, defaults};
use protocol::{Decoder, HostMessage, Id, RobotMessage, Values};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, TryRecvError};

/// A recording, whole.
#[derive(Debug)]
pub struct Recording {
    /// Where it is.
    pub path: PathBuf,
    /// Its control steps.
    pub history: History,
    /// What happened, in time order.
    pub events: Vec<Event>,
    /// The barrel in it.
    pub body: BodyKind,
    /// The parameters at its start; the body's defaults where it does not say.
    pub values: Values<f64>,
    /// What it is of, in one line.
    pub title: String,
    /// What is wrong with it: cut off, damaged behind some point.
    pub problem: Option<String>,
}

/// A recording that is being read.
#[derive(Debug)]
pub struct Loading {
    /// Where it is.
    pub path: PathBuf,
    result: Receiver<Result<Recording, String>>,
}

impl Loading {
    /// Begins to read; `wake` is called when it is done.
    pub fn begin(path: PathBuf, wake: impl FnOnce() + Send + 'static) -> Self {
        let (send, result) = mpsc::channel();
        let place = path.clone();
        std::thread::spawn(move || {
            // A window that has lost its interest does not hear of it.
            let _ = send.send(read(&place));
            wake();
        });
        Loading { path, result }
    }

    /// The recording, or a sentence that says why there is none, once it has been read.
    pub fn done(&self) -> Option<Result<Recording, String>> {
        match self.result.try_recv() {
            Ok(result) => Some(result),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err(format!("{} could not be read", self.path.display()))),
        }
    }
}

/// Reads a log or a CSV. Of a log that is damaged, what stands before the damage is taken.
///
/// # Errors
/// A sentence that says what is wrong and what to do.
pub fn read(path: &Path) -> Result<Recording, String> {
    Failure::unless_there(path).map_err(|failure| failure.to_string())?;
    let recording = if log::is_log(path) { read_log(path) } else { read_csv(path) };
    recording.map_err(|error| error.to_string())
}

fn read_csv(path: &Path) -> Result<Recording, LogError> {
    let table = csv::read(path)?;
    if !table.names().iter().any(|name| Channel::from_name(name).is_some()) {
        // The least that makes a table a recording; what is missing is said.
        table.column(Channel::X1.channel().name)?;
    }
    let mut history = History::new(usize::MAX);
    let columns: Vec<(Channel, &[f64])> =
        Channel::ALL.iter().filter_map(|&id| Some((id, table.get(id.channel().name)?))).collect();
    for (row, t) in table.time().into_iter().enumerate() {
        let mut frame = Frame::at(t);
        columns.iter().for_each(|(id, numbers)| frame.set(*id, numbers[row] as f32));
        frame.derive();
        history.push(&frame);
    }
    let (rows, left_out) = (table.rows(), table.rows() - history.len());
    let problem = (left_out > 0)
        .then(|| format!("{left_out} of its {rows} rows are left out: their time is before that of others"));
    Ok(Recording {
        path: path.to_owned(),
        history,
        events: Vec::new(),
        body: BodyKind::Chapter,
        values: defaults(BodyKind::Chapter),
        title: path.display().to_string(),
        problem,
    })
}

fn read_log(path: &Path) -> Result<Recording, LogError> {
    let mut reader = Reader::open(path)?;
    let run = reader.run();
    let told = |name: &str| run.get(name).map(String::as_str);
    // A log without a body is of a robot that stood before somebody.
    let body = match told("body") {
        Some(name) if name == BodyKind::Chapter.name() => BodyKind::Chapter,
        _ => BodyKind::Tabletop,
    };
    let mut values = defaults(body);
    for (name, value) in reader.parameters() {
        if let (Some(id), Ok(value)) = (Id::from_name(&name), value.parse()) {
            values.set(id, value);
        }
    }
    let mut rows = Rows::new(values.get(Id::Range) as f32);
    let mut events = Vec::new();
    let mut damage = None;
    for entry in reader.by_ref() {
        match entry {
            Ok(Entry::Event(event)) => events.push(event),
            Ok(entry) => rows.take(entry),
            Err(error) => damage = Some(error),
        }
    }
    let truncated = reader.truncated();
    let history = rows.finish();
    if history.is_empty() {
        let missing = LogError::Missing { path: path.to_owned(), topic: log::BRAIN, truncated };
        return Err(damage.unwrap_or(missing));
    }
    let torn = || "its end is missing: the program that wrote it was ended by force".to_owned();
    let problem = damage.map(|error| error.to_string()).or_else(|| truncated.then(torn));
    Ok(Recording {
        path: path.to_owned(),
        history,
        events,
        body,
        values,
        title: told("command").map_or_else(|| path.display().to_string(), str::to_owned),
        problem,
    })
}

/// Puts the entries of a log together to control steps.
struct Rows {
    history: History,
    /// The step whose plant may still come.
    open: Option<Frame>,
    /// What stays until it is said anew: the chips' readings, duties, vitals.
    standing: Frame,
    robot: Decoder,
    host: Decoder,
    /// Reach of the weights, m.
    range: f32,
}

impl Rows {
    fn new(range: f32) -> Self {
        let (robot, host) = (Decoder::new(), Decoder::new());
        Rows { history: History::new(usize::MAX), open: None, standing: Frame::at(0.0), robot, host, range }
    }

    fn take(&mut self, entry: Entry) {
        match entry {
            Entry::Brain(brain) => self.step(&brain),
            Entry::Plant { plant, .. } => {
                if let Some(open) = &mut self.open {
                    open.set_plant(&plant);
                }
            }
            Entry::Vitals { vitals, .. } => self.standing.set_vitals(&vitals),
            Entry::Frame { direction, bytes, .. } => bytes.iter().for_each(|&byte| self.byte(direction, byte)),
            Entry::Event(_) => {}
        }
    }

    fn step(&mut self, brain: &BrainRecord<f64>) {
        self.close();
        let mut frame = Frame { t: csv::grid_time(brain.t), ..self.standing };
        frame.set_brain(&brain.map(|number| number as f32));
        frame.set_all(Channel::Target1, &brain.y.map(|y| -self.range * y as f32));
        self.open = Some(frame);
    }

    fn close(&mut self) {
        if let Some(frame) = self.open.take() {
            self.history.push(&frame);
        }
    }

    /// A byte as it went over the wire.
    fn byte(&mut self, direction: Direction, byte: u8) {
        match direction {
            Direction::ToRobot => {
                if let Some(Ok((_, HostMessage::Transducers(read)))) = self.host.push(byte) {
                    self.standing.set_transducers(&read);
                }
            }
            Direction::ToHost => {
                if let Some(Ok((_, RobotMessage::Actuators { duty }))) = self.robot.push(byte) {
                    self.standing.set_all(Channel::Duty1, &duty);
                }
            }
        }
    }

    fn finish(mut self) -> History {
        self.close();
        self.history
    }
}
