//! Pictures of a run, PNG or SVG.
//!
//! [`run`] draws a whole run: stacked panels over one time axis, and below them the path on the ground. [`columns`]
//! draws chosen columns over time. What is drawn comes from a [`Table`], whatever it was read from; panels whose columns
//! are missing are left out. Colours are Okabe and Ito's, which colour-blind eyes tell apart.

pub(crate) mod canvas;
pub(crate) mod panel;

use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::csv::{CsvError, Table, known};
use crate::draft::Draft;
use canvas::{Canvas, Color, paint};
use panel::{Panel, Scale, Series, ground, over_time};

/// Width of every picture, pixels.
const WIDTH: f64 = 1600.0;
/// Where panels begin and end; the axes' labels are left of it, the legends right of it.
const LEFT: f64 = 110.0;
const RIGHT: f64 = 1450.0;
/// Height of the title, of the gap between panels, of the time axis.
const TITLE: f64 = 100.0;
const GAP: f64 = 22.0;
const TIME_AXIS: f64 = 62.0;
/// Side of the square panel with the path, and the height of the row it stands in.
const GROUND: f64 = 440.0;
const GROUND_ROW: f64 = GROUND + 96.0;
const MARGIN: f64 = 20.0;

pub(crate) const BLUE: Color = Color(0, 114, 178);
pub(crate) const ORANGE: Color = Color(230, 159, 0);
pub(crate) const GREEN: Color = Color(0, 158, 115);
pub(crate) const PURPLE: Color = Color(204, 121, 167);
pub(crate) const VERMILLION: Color = Color(213, 94, 0);
pub(crate) const SKY: Color = Color(86, 180, 233);
pub(crate) const BLACK: Color = Color(40, 40, 40);
const PALETTE: [Color; 7] = [BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK];

/// What stands over a picture.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Title {
    /// The first line: the experiment.
    pub heading: String,
    /// The second line: body, seed, duration, what was changed.
    pub details: String,
}

/// Why there is no picture.
#[derive(Debug, Error)]
pub enum PlotError {
    /// The file's ending says neither PNG nor SVG.
    #[error("cannot draw {}: a picture is .png or .svg; name it {}", path.display(), path.with_extension("png").display())]
    Ending {
        /// The file.
        path: PathBuf,
    },
    /// The file cannot be written.
    #[error("cannot write {}: {reason}; choose a folder that exists, may be written and has room", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// There is nothing to draw.
    #[error("{source_name} has nothing to draw: {reason}")]
    Nothing {
        /// Where the table came from.
        source_name: String,
        /// What is missing.
        reason: String,
    },
    /// A column is not there.
    #[error(transparent)]
    Column(#[from] CsvError),
}

/// Which picture a file's ending asks for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Png,
    Svg,
}

fn kind(path: &Path) -> Result<Kind, PlotError> {
    match path.extension().and_then(|ending| ending.to_str()).map(str::to_lowercase).as_deref() {
        Some("png") => Ok(Kind::Png),
        Some("svg") => Ok(Kind::Svg),
        _ => Err(PlotError::Ending { path: path.into() }),
    }
}

/// Checks that a picture can be written here, before the work is done: its ending, and that its folder takes a file.
pub fn check_target(path: &Path) -> Result<(), PlotError> {
    kind(path)?;
    draft(path).map(drop)
}

fn draft(path: &Path) -> Result<Draft, PlotError> {
    Draft::beside(path).map_err(|error| PlotError::Write { path: path.into(), reason: error.to_string() })
}

/// One panel of the whole picture: its label, scale, share of the height, and columns.
struct Row {
    label: &'static str,
    scale: Scale,
    share: f64,
    columns: &'static [(&'static str, Color)],
}

/// Height of a panel with share 1, pixels.
const SHARE: f64 = 138.0;

const ROWS: [Row; 7] = [
    Row { label: "inclination x", scale: Scale::Unit, share: 1.0, columns: &[("x1", BLUE), ("x2", VERMILLION)] },
    Row { label: "motor value y", scale: Scale::Unit, share: 1.0, columns: &[("y1", BLUE), ("y2", VERMILLION)] },
    Row {
        label: "controller C",
        scale: Scale::Linear,
        share: 1.3,
        columns: &[("C11", BLUE), ("C12", ORANGE), ("C21", GREEN), ("C22", PURPLE)],
    },
    Row { label: "bias h", scale: Scale::Linear, share: 0.8, columns: &[("h1", BLUE), ("h2", VERMILLION)] },
    Row {
        label: "self-model A",
        scale: Scale::Linear,
        share: 1.3,
        columns: &[("A11", BLUE), ("A12", ORANGE), ("A21", GREEN), ("A22", PURPLE)],
    },
    Row { label: "errors", scale: Scale::Log, share: 1.3, columns: &[("E_tle", ORANGE), ("E", BLUE)] },
    Row { label: "omega (rad/s)", scale: Scale::Linear, share: 1.0, columns: &[("omega", BLACK)] },
];

/// What a column is called in a legend.
fn legend(column: &str) -> String {
    match column {
        "E" => "E prediction".into(),
        "E_tle" => "E time loop".into(),
        name => name.into(),
    }
}

/// Draws a whole run. The picture appears whole or not at all.
///
/// # Errors
/// An ending that is not a picture's, a place that cannot be written, a table without one column of a run.
pub fn run(table: &Table, title: &Title, path: &Path) -> Result<(), PlotError> {
    let time = table.time();
    let mut panels = Vec::new();
    let mut top = TITLE;
    for row in &ROWS {
        let series: Vec<Series> = row
            .columns
            .iter()
            .filter_map(|&(name, color)| Some(Series { label: legend(name), numbers: table.get(name)?, color }))
            .collect();
        if !series.is_empty() {
            let bottom = top + row.share * SHARE;
            panels.push(Panel { label: row.label.into(), scale: row.scale, top, bottom, series });
            top = bottom + GAP;
        }
    }
    let position = table.get("px").zip(table.get("py"));
    if panels.is_empty() && position.is_none() || table.rows() == 0 {
        return Err(nothing(table));
    }
    let below = if panels.is_empty() { TITLE } else { top - GAP + TIME_AXIS };
    let height = below + if position.is_some() { GROUND_ROW } else { MARGIN };
    draw(path, height, title, &|canvas| {
        over_time(canvas, &time, &panels);
        if let Some((px, py)) = position {
            ground(canvas, px, py, below + 16.0);
            facts(canvas, table, &time, below + 16.0);
        }
    })
}

/// Draws the chosen columns over time: one panel for each unit, errors on a logarithmic scale of their own.
///
/// # Errors
/// As [`run`], and a column that the table does not have; the nearest one is named.
pub fn columns(table: &Table, names: &[String], title: &Title, path: &Path) -> Result<(), PlotError> {
    let mut groups: Vec<(String, Vec<Series>)> = Vec::new();
    for (i, name) in names.iter().enumerate() {
        let numbers = table.column(name)?;
        let unit = match name.as_str() {
            "E" | "E_tle" => "errors",
            name => known(name).map_or("", |column| column.unit),
        };
        let series = Series { label: name.clone(), numbers, color: PALETTE[i % PALETTE.len()] };
        match groups.iter_mut().find(|(group, _)| group == unit) {
            Some((_, group)) => group.push(series),
            None => groups.push((unit.into(), vec![series])),
        }
    }
    if groups.is_empty() || table.rows() == 0 {
        return Err(nothing(table));
    }
    let panel_height = if groups.len() == 1 { 560.0 } else { 340.0 };
    let mut top = TITLE;
    let mut panels = Vec::new();
    for (unit, series) in groups {
        let names: Vec<&str> = series.iter().map(|series| series.label.as_str()).collect();
        let names = if names.len() > 4 { "value".into() } else { names.join(", ") };
        let (label, scale) = match unit.as_str() {
            "errors" => (names, Scale::Log),
            "" => (names, Scale::Linear),
            unit => (format!("{names} ({unit})"), Scale::Linear),
        };
        panels.push(Panel { label, scale, top, bottom: top + panel_height, series });
        top += panel_height + GAP;
    }
    let time = table.time();
    draw(path, top - GAP + TIME_AXIS + MARGIN, title, &|canvas| over_time(canvas, &time, &panels))
}

fn nothing(table: &Table) -> PlotError {
    let reason =
        if table.rows() == 0 { "it has no rows" } else { "it has none of a run's columns, such as x1, C11, E" };
    PlotError::Nothing { source_name: table.source.clone(), reason: reason.into() }
}

fn draw(path: &Path, height: f64, title: &Title, content: &dyn Fn(&mut dyn Canvas)) -> Result<(), PlotError> {
    let svg = kind(path)? == Kind::Svg;
    let draft = draft(path)?;
    let write_error = |reason: String| PlotError::Write { path: path.into(), reason };
    paint(draft.path(), svg, WIDTH, height, &|canvas| {
        canvas.text(MARGIN + 10.0, 36.0, &shorten(&title.heading, 95), 32.0, canvas::Anchor::Left, BLACK);
        canvas.text(MARGIN + 10.0, 70.0, &shorten(&title.details, 170), 19.0, canvas::Anchor::Left, Color(90, 90, 90));
        content(canvas);
    })
    .map_err(write_error)?;
    draft.commit().map_err(|error| write_error(error.to_string()))
}

fn shorten(text: &str, characters: usize) -> String {
    if text.chars().count() <= characters {
        text.into()
    } else {
        text.chars().take(characters - 1).chain(['…']).collect()
    }
}

/// A number for people: so many decimals, an exponent where it would be long, no negative zero.
fn figure(number: f64, decimals: usize) -> String {
    let text = if number.abs() < 1e5 { format!("{number:.decimals$}") } else { format!("{number:.2e}") };
    if text.trim_start_matches(['-', '0', '.']).is_empty() { text.trim_start_matches('-').into() } else { text }
}

/// The run in figures, beside the path.
fn facts(canvas: &mut dyn Canvas, table: &Table, time: &[f64], top: f64) {
    let last = |name: &str| table.get(name).and_then(|column| column.last().copied());
    let mut lines: Vec<(&str, String)> = Vec::new();
    if let (Some(&first), Some(&end)) = (time.first(), time.last()) {
        lines.push(("time", format!("{:.2} s in {} control steps", end - first, table.rows())));
    }
    if let Some((px, py)) = table.get("px").zip(table.get("py")) {
        let steps = px.windows(2).zip(py.windows(2));
        let length: f64 = steps.map(|(x, y)| (x[1] - x[0]).hypot(y[1] - y[0])).filter(|d| d.is_finite()).sum();
        lines.push(("length of the path", format!("{} m", figure(length, 2))));
        if let (Some(x0), Some(y0), Some(x1), Some(y1)) = (px.first(), py.first(), px.last(), py.last()) {
            lines.push(("start to end", format!("{} m", figure((x1 - x0).hypot(y1 - y0), 2))));
        }
    }
    if let Some(omega) = table.get("omega") {
        let tail = &omega[omega.len() - omega.len().min(500)..];
        let mean = tail.iter().sum::<f64>() / tail.len().max(1) as f64;
        let seconds = tail.len() as f64 / 50.0;
        lines.push(("omega, mean", format!("{} rad/s over the last {seconds:.0} s", figure(mean, 3))));
    }
    for name in ["C", "A"] {
        let entries = ["11", "12", "21", "22"].map(|index| last(&format!("{name}{index}")));
        if let [Some(a), Some(b), Some(c), Some(d)] = entries {
            let label = if name == "C" { "C at the end" } else { "A at the end" };
            let [a, b, c, d] = [a, b, c, d].map(|entry| figure(entry, 3));
            lines.push((label, format!("[[{a}, {b}], [{c}, {d}]]")));
        }
    }
    if let Some(h) = last("h1").zip(last("h2")) {
        lines.push(("h at the end", format!("[{}, {}]", figure(h.0, 3), figure(h.1, 3))));
    }
    if let Some(tilt) = last("tilt") {
        lines.push(("tilt at the end", format!("{:.1}° from the horizontal", tilt.to_degrees())));
    }
    let left = LEFT + GROUND + 150.0;
    for ((label, value), i) in lines.iter().zip(0_u32..) {
        let y = top + 28.0 + 38.0 * f64::from(i);
        canvas.text(left, y, label, 20.0, canvas::Anchor::Left, Color(90, 90, 90));
        canvas.text(left + 220.0, y, value, 20.0, canvas::Anchor::Left, BLACK);
    }
}
