//! The recorder's CSV: one row per control step, every number in the shortest form that reads back exactly.
//!
//! [`BRAIN_COLUMNS`] and [`PLANT_COLUMNS`] are the one list of what is recorded; the log's channels and the plots use
//! them too. [`Writer`] writes them, [`read`] reads any CSV with a header into a [`Table`].

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use hil_sim::record::{BrainRecord, PlantRecord};
use thiserror::Error;

use crate::suggest::did_you_mean;

/// Control steps per second: row `k` is at `t = k / 50` s.
const STEPS_PER_SECOND: f64 = 50.0;

/// What one recorded column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Column {
    /// Name in the header, in the log's JSON and in plots.
    pub name: &'static str,
    /// Unit, empty for a pure number.
    pub unit: &'static str,
    /// What it is, in a few words.
    pub help: &'static str,
}

const fn column(name: &'static str, unit: &'static str, help: &'static str) -> Column {
    Column { name, unit, help }
}

/// What is recorded of the brain, after learning; `t` is the time of the control step.
pub const BRAIN_COLUMNS: [Column; 21] = [
    column("t", "s", "virtual time of the control step"),
    column("x1", "", "inclination of sliding axis 1: its vertical component"),
    column("x2", "", "inclination of sliding axis 2: its vertical component"),
    column("y1", "", "motor value 1, -1 to 1"),
    column("y2", "", "motor value 2, -1 to 1"),
    column("C11", "", "controller: weight from x1 to motor 1"),
    column("C12", "", "controller: weight from x2 to motor 1"),
    column("C21", "", "controller: weight from x1 to motor 2"),
    column("C22", "", "controller: weight from x2 to motor 2"),
    column("h1", "", "controller: bias of motor 1"),
    column("h2", "", "controller: bias of motor 2"),
    column("A11", "", "self-model: effect of motor 1 on x1"),
    column("A12", "", "self-model: effect of motor 2 on x1"),
    column("A21", "", "self-model: effect of motor 1 on x2"),
    column("A22", "", "self-model: effect of motor 2 on x2"),
    column("b1", "", "self-model: bias of x1"),
    column("b2", "", "self-model: bias of x2"),
    column("xi1", "", "prediction error of x1"),
    column("xi2", "", "prediction error of x2"),
    column("E", "", "prediction error, xi squared"),
    column("E_tle", "", "time loop error, v squared; 0 in the open loop"),
];

/// What is recorded of the simulated barrel, as it stands at `t`.
pub const PLANT_COLUMNS: [Column; 8] = [
    column("omega", "rad/s", "angular velocity about the cylinder axis, positive when x turns by U(+chi)"),
    column("phi", "rad", "rotation about the cylinder axis: the integral of omega"),
    column("s1", "m", "position of weight 1 on its axis"),
    column("s2", "m", "position of weight 2 on its axis"),
    column("px", "m", "centre of the cylinder, along the ground"),
    column("py", "m", "centre of the cylinder, along the ground"),
    column("pz", "m", "centre of the cylinder, height"),
    column("tilt", "rad", "tilt of the cylinder axis from the horizontal"),
];

/// What a log has of the simulated barrel beyond the CSV: its attitude.
pub const ATTITUDE_COLUMNS: [Column; 4] = [
    column("qw", "", "quaternion from body to world axes, real part"),
    column("qx", "", "quaternion from body to world axes, X"),
    column("qy", "", "quaternion from body to world axes, Y"),
    column("qz", "", "quaternion from body to world axes, Z"),
];

/// The recorded column with this name, if it is one of ours.
pub fn known(name: &str) -> Option<&'static Column> {
    BRAIN_COLUMNS.iter().chain(&PLANT_COLUMNS).find(|column| column.name == name)
}

/// A number as the recorder writes it: `f32` or `f64`.
///
/// A fixed-point brain is recorded through `f64`, which holds its numbers exactly.
pub trait Number: Copy {
    /// Appends the shortest decimal that reads back as this very number: `0.06`, `1e-20`, `-0`, `NaN`, `inf`.
    fn write(self, out: &mut Vec<u8>);

    /// Whether it is neither NaN nor infinite.
    fn finite(self) -> bool;

    /// The `f64` that a reader gets from the written text. For an `f32` it is not the widened number (0.1 as `f32` is
    /// 0.100000001…, its text reads as 0.1), but rounds back to it.
    fn as_read(self) -> f64;
}

/// The shortest digits, laid out alike for `f32` and `f64`: plain from 1e-4 to 1e13, with an exponent outside.
fn write_shortest<F: zmij::Float>(number: F, out: &mut Vec<u8>) {
    let mut buffer = zmij::Buffer::new();
    let text = buffer.format(number);
    let unsigned = text.strip_prefix('-').unwrap_or(text);
    if unsigned.len() < text.len() {
        out.push(b'-');
    }
    // Looked for by bytes and where they can be only: this runs millions of times in a simulated hour.
    let bytes = unsigned.as_bytes();
    let has_exponent = bytes[bytes.len().saturating_sub(5)..].contains(&b'e');
    let is_long = bytes.len() > 14 && !bytes[..14].contains(&b'.');
    if has_exponent {
        // 1e-07 and 1e+16 are written 1e-7 and 1e16.
        let (digits, exponent) = unsigned.split_once('e').unwrap_or((unsigned, ""));
        out.extend_from_slice(digits.as_bytes());
        out.extend_from_slice(if exponent.starts_with('-') { b"e-" } else { b"e" });
        out.extend_from_slice(exponent.trim_start_matches(['+', '-', '0']).as_bytes());
    } else if let Some(fraction) = unsigned.strip_prefix("0.0000") {
        let digits = fraction.trim_start_matches('0');
        write_exponent(digits, -5 - (fraction.len() - digits.len()) as isize, out);
    } else if is_long {
        let (whole, fraction) = unsigned.split_once('.').unwrap_or((unsigned, ""));
        let digits = [whole, fraction].concat();
        write_exponent(digits.trim_end_matches('0'), whole.len() as isize - 1, out);
    } else {
        out.extend_from_slice(bytes.strip_suffix(b".0").unwrap_or(bytes));
    }
}

fn write_exponent(digits: &str, exponent: isize, out: &mut Vec<u8>) {
    let (first, rest) = digits.split_at(1);
    out.extend_from_slice(first.as_bytes());
    if !rest.is_empty() {
        out.push(b'.');
        out.extend_from_slice(rest.as_bytes());
    }
    out.push(b'e');
    out.extend_from_slice(exponent.to_string().as_bytes());
}

impl Number for f64 {
    fn write(self, out: &mut Vec<u8>) {
        write_shortest(self, out);
    }

    fn finite(self) -> bool {
        self.is_finite()
    }

    fn as_read(self) -> f64 {
        self
    }
}

impl Number for f32 {
    fn write(self, out: &mut Vec<u8>) {
        write_shortest(self, out);
    }

    fn finite(self) -> bool {
        self.is_finite()
    }

    fn as_read(self) -> f64 {
        let mut buffer = zmij::Buffer::new();
        buffer.format(self).parse().unwrap_or(f64::NAN)
    }
}

/// A number in the shortest form that reads back exactly.
pub fn shortest(number: impl Number) -> String {
    let mut text = Vec::new();
    number.write(&mut text);
    String::from_utf8_lossy(&text).into_owned()
}

/// `t` on the grid of control steps, as the number nearest to the decimal `0.02 k`: 0.06 and not 0.06000…05, which is
/// what a sum or a product of binary 0.02 gives. Times off the grid stay as they are.
pub fn grid_time(t: f64) -> f64 {
    let on_grid = (t * STEPS_PER_SECOND).round() / STEPS_PER_SECOND;
    if (on_grid - t).abs() < 1e-6 { on_grid } else { t }
}

/// The numbers of a brain record in the order of [`BRAIN_COLUMNS`], without `t`.
pub fn brain_row<T: Copy>(brain: &BrainRecord<T>) -> [T; 20] {
    let BrainRecord { t: _, x, y, c, h, a, b, xi, error, time_loop_error } = *brain;
    #[rustfmt::skip]
    let row = [
        x[0], x[1], y[0], y[1],
        c[0], c[1], c[2], c[3], h[0], h[1],
        a[0], a[1], a[2], a[3], b[0], b[1],
        xi[0], xi[1], error, time_loop_error,
    ];
    row
}

/// The numbers of a plant record in the order of [`PLANT_COLUMNS`].
pub fn plant_row(plant: &PlantRecord) -> [f64; 8] {
    let PlantRecord { omega, phi, weights: s, position: p, tilt, orientation: _ } = *plant;
    [omega, phi, s[0], s[1], p[0], p[1], p[2], tilt]
}

/// What can be wrong with a CSV. Lines count from 1, the header included.
#[derive(Debug, Error)]
pub enum CsvError {
    /// The file cannot be opened or read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The file cannot be created or written.
    #[error("cannot write {}: {source}; choose a folder that exists, may be written and has room", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The file holds no byte, or blank lines only.
    #[error("{} is empty: a CSV starts with a header such as t,x1,x2", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The file is not text.
    #[error("{} is not a CSV: byte {at} is not text{hint}", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// Offset of the first byte that is not UTF-8.
        at: usize,
        /// What it is instead, if known.
        hint: &'static str,
    },
    /// The first line holds numbers.
    #[error("{} has no header: its first line is '{line}'; put the columns' names there, such as t,x1,x2", path.display())]
    NoHeader {
        /// The file.
        path: PathBuf,
        /// The first line.
        line: String,
    },
    /// Two columns have one name.
    #[error("{}: column '{name}' occurs twice in the header; rename or remove one", path.display())]
    DuplicateColumn {
        /// The file.
        path: PathBuf,
        /// The name.
        name: String,
    },
    /// There is a header, but no row.
    #[error("{} has a header but no rows: nothing was recorded", path.display())]
    NoRows {
        /// The file.
        path: PathBuf,
    },
    /// A row is shorter or longer than the header.
    #[error("{}, line {line}: {found} fields, but the header has {expected}", path.display())]
    FieldCount {
        /// The file.
        path: PathBuf,
        /// The line.
        line: usize,
        /// Fields in this line.
        found: usize,
        /// Columns in the header.
        expected: usize,
    },
    /// The last line ends in its middle: whoever wrote it was interrupted.
    #[error("{}, line {line}: the last line is cut off ('{text}'); delete it to use the {} rows before it", path.display(), line - 2)]
    Torn {
        /// The file.
        path: PathBuf,
        /// The line.
        line: usize,
        /// The line's text.
        text: String,
    },
    /// A field is not a number.
    #[error("{}, line {line}, column {column}: '{text}' is not a number", path.display())]
    NotANumber {
        /// The file.
        path: PathBuf,
        /// The line.
        line: usize,
        /// The column's name.
        column: String,
        /// The field.
        text: String,
    },
    /// A field is NaN or infinite.
    #[error("{}, line {line}, column {column}: '{text}' is not finite; a recording holds finite numbers only", path.display())]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// The line.
        line: usize,
        /// The column's name.
        column: String,
        /// The field.
        text: String,
    },
    /// A column is not there.
    #[error("{source_name} has no column '{name}'{suggestion}")]
    UnknownColumn {
        /// Where it was looked for.
        source_name: String,
        /// The column asked for.
        name: String,
        /// The nearest column that is there, as a question.
        suggestion: String,
    },
}

/// Writes the recorder's CSV. Bytes leave in whole rows, so that even a killed run leaves whole rows behind.
pub struct Writer<W: Write = File> {
    out: W,
    path: PathBuf,
    buffer: Vec<u8>,
    plant: bool,
}

/// Rows gather until this many bytes are there.
const BUFFER_BYTES: usize = 64 * 1024;

impl Writer<File> {
    /// Creates (or replaces) the file and starts it with the header; with `plant`, also the plant's columns.
    pub fn create(path: &Path, plant: bool) -> Result<Self, CsvError> {
        let file = File::create(path).map_err(|source| CsvError::Write { path: path.into(), source })?;
        Ok(Writer { path: path.into(), ..Writer::new(file, plant) })
    }
}

impl<W: Write> Writer<W> {
    /// Writes into `out`, which needs no buffer of its own.
    pub fn new(out: W, plant: bool) -> Self {
        let mut buffer = Vec::with_capacity(BUFFER_BYTES + 1024);
        let plant_columns = if plant { &PLANT_COLUMNS[..] } else { &[] };
        for (i, column) in BRAIN_COLUMNS.iter().chain(plant_columns).enumerate() {
            if i > 0 {
                buffer.push(b',');
            }
            buffer.extend_from_slice(column.name.as_bytes());
        }
        buffer.push(b'\n');
        Writer { out, path: PathBuf::from("CSV"), buffer, plant }
    }

    /// Adds one row. `plant` is left out, or written as zeros when missing, as the header has it.
    pub fn write<T: Number>(&mut self, brain: &BrainRecord<T>, plant: Option<&PlantRecord>) -> Result<(), CsvError> {
        grid_time(brain.t).write(&mut self.buffer);
        for number in brain_row(brain) {
            self.buffer.push(b',');
            number.write(&mut self.buffer);
        }
        if self.plant {
            for number in plant_row(plant.unwrap_or(&PlantRecord::default())) {
                self.buffer.push(b',');
                number.write(&mut self.buffer);
            }
        }
        self.buffer.push(b'\n');
        if self.buffer.len() >= BUFFER_BYTES { self.flush() } else { Ok(()) }
    }

    /// Hands all rows so far to the operating system.
    pub fn flush(&mut self) -> Result<(), CsvError> {
        let result = self.out.write_all(&self.buffer).and_then(|()| self.out.flush());
        self.buffer.clear();
        result.map_err(|source| CsvError::Write { path: self.path.clone(), source })
    }

    /// Writes what is left and gives the inner writer back.
    pub fn finish(mut self) -> Result<W, CsvError> {
        self.flush()?;
        Ok(self.out)
    }
}

/// Columns of numbers by name, one row per control step: what a CSV or a log holds, for plots and replay.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Where it came from, for messages.
    pub source: String,
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
}

impl Table {
    /// An empty table.
    pub fn new(source: impl Into<String>) -> Self {
        Table { source: source.into(), ..Table::default() }
    }

    /// Adds a column, or replaces the one with this name.
    pub fn insert(&mut self, name: impl Into<String>, column: Vec<f64>) {
        let name = name.into();
        match self.names.iter().position(|n| *n == name) {
            Some(i) => self.columns[i] = column,
            None => {
                self.names.push(name);
                self.columns.push(column);
            }
        }
    }

    /// The columns' names, in order.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// How many rows there are.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    /// The column with this name, if there is one.
    pub fn get(&self, name: &str) -> Option<&[f64]> {
        let i = self.names.iter().position(|n| n == name)?;
        Some(&self.columns[i])
    }

    /// The column with this name.
    ///
    /// # Errors
    /// [`CsvError::UnknownColumn`], which names the nearest column there is.
    pub fn column(&self, name: &str) -> Result<&[f64], CsvError> {
        self.get(name).ok_or_else(|| CsvError::UnknownColumn {
            source_name: self.source.clone(),
            name: name.into(),
            suggestion: did_you_mean(name, self.names.iter().map(String::as_str)),
        })
    }

    /// The times of the rows, s: column `t`, or 0.02 k without one.
    pub fn time(&self) -> Vec<f64> {
        match self.get("t") {
            Some(t) => t.to_vec(),
            None => (0..self.rows()).map(|k| k as f64 / STEPS_PER_SECOND).collect(),
        }
    }

    /// The recorded inclinations `[x1, x2]`, row by row.
    ///
    /// # Errors
    /// [`CsvError::UnknownColumn`] without `x1` or `x2`.
    pub fn sensors(&self) -> Result<Vec<[f64; 2]>, CsvError> {
        let (x1, x2) = (self.column("x1")?, self.column("x2")?);
        Ok(x1.iter().zip(x2).map(|(&x1, &x2)| [x1, x2]).collect())
    }

    /// The first column of `row` where the recording and `brain` are not the same number, bit for bit, among the
    /// columns that the recording has. A row beyond the recording differs in nothing.
    pub fn difference<T: Number>(&self, row: usize, brain: &BrainRecord<T>) -> Option<Difference> {
        BRAIN_COLUMNS[1..].iter().zip(brain_row(brain)).find_map(|(column, number)| {
            let recorded = *self.get(column.name)?.get(row)?;
            let computed = number.as_read();
            (recorded.to_bits() != computed.to_bits()).then_some(Difference { column: column.name, recorded, computed })
        })
    }
}

/// A recorded number that was not reproduced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// The column.
    pub column: &'static str,
    /// What the recording has.
    pub recorded: f64,
    /// What was computed.
    pub computed: f64,
}

/// Reads a CSV with a header.
///
/// Columns may come in any order; spaces around a field, quotes around a name, CRLF, a byte order mark and a missing
/// last line end are taken. Every field of a recorded column ([`known`]) must be a finite number; a foreign column that
/// holds anything else is left out of the table.
pub fn read(path: &Path) -> Result<Table, CsvError> {
    let bytes = std::fs::read(path).map_err(|source| CsvError::Read { path: path.into(), source })?;
    parse(path, &bytes)
}

/// Reads a recording: a CSV that has at least the sensors, columns `x1` and `x2`.
pub fn read_recording(path: &Path) -> Result<Table, CsvError> {
    let table = read(path)?;
    table.column("x1")?;
    table.column("x2")?;
    Ok(table)
}

/// Reads the bytes of a CSV; `path` is for messages only.
pub fn parse(path: &Path, bytes: &[u8]) -> Result<Table, CsvError> {
    let text = std::str::from_utf8(bytes).map_err(|error| CsvError::NotText {
        path: path.into(),
        at: error.valid_up_to(),
        hint: if bytes.starts_with(mcap::MAGIC) { "; it is an MCAP log: give it the ending .mcap" } else { "" },
    })?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = text.lines().enumerate().map(|(i, line)| (i + 1, line)).filter(|(_, line)| !line.trim().is_empty());
    let (_, header) = lines.next().ok_or_else(|| CsvError::Empty { path: path.into() })?;
    let names = parse_header(path, header)?;

    let mut columns: Vec<Option<Vec<f64>>> = vec![Some(Vec::new()); names.len()];
    let mut rows = 0;
    let mut lines = lines.peekable();
    while let Some((number, line)) = lines.next() {
        let cut_off = lines.peek().is_none() && !text.ends_with('\n');
        parse_row(path, number, line, &names, &mut columns).map_err(|error| match error {
            CsvError::FieldCount { .. } | CsvError::NotANumber { .. } if cut_off => {
                CsvError::Torn { path: path.into(), line: number, text: line.into() }
            }
            error => error,
        })?;
        rows += 1;
    }
    if rows == 0 {
        return Err(CsvError::NoRows { path: path.into() });
    }
    let mut table = Table::new(path.display().to_string());
    for (name, column) in names.into_iter().zip(columns) {
        if let Some(column) = column {
            table.insert(name, column);
        }
    }
    Ok(table)
}

fn parse_header(path: &Path, header: &str) -> Result<Vec<String>, CsvError> {
    let names: Vec<String> = header.split(',').map(|name| name.trim().trim_matches('"').to_string()).collect();
    if names.iter().any(|name| name.parse::<f64>().is_ok()) {
        return Err(CsvError::NoHeader { path: path.into(), line: header.into() });
    }
    for (i, name) in names.iter().enumerate() {
        if names[..i].contains(name) {
            return Err(CsvError::DuplicateColumn { path: path.into(), name: name.clone() });
        }
    }
    Ok(names)
}

/// Adds the line's numbers to the columns; a foreign column that turns out not to hold numbers becomes `None`.
fn parse_row(
    path: &Path,
    line: usize,
    text: &str,
    names: &[String],
    columns: &mut [Option<Vec<f64>>],
) -> Result<(), CsvError> {
    let found = text.split(',').count();
    if found != names.len() {
        return Err(CsvError::FieldCount { path: path.into(), line, found, expected: names.len() });
    }
    for ((field, name), slot) in text.split(',').zip(names).zip(columns) {
        let Some(column) = slot else { continue };
        let field = field.trim();
        match field.parse::<f64>() {
            Ok(number) if number.is_finite() => column.push(number),
            _ if known(name).is_none() => *slot = None,
            Ok(_) => {
                return Err(CsvError::NotFinite { path: path.into(), line, column: name.clone(), text: field.into() });
            }
            Err(_) => {
                return Err(CsvError::NotANumber { path: path.into(), line, column: name.clone(), text: field.into() });
            }
        }
    }
    Ok(())
}
