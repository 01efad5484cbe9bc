//! What stands above a panel: its title, and at the right of it, or below, what its lines and markers mean.

use super::colour::{self, LABEL, MARK, TEXT, cover};
use super::lettering::{number, shorten, width, wrap};
use super::pen::{Anchor, Letters, MARKER, Pen, Sheet};
use super::{Ink, Layer, Marker, Panel};

pub const TITLE: f64 = 14.0;
pub const LINE: f64 = 20.0;
const ENTRY: f64 = 13.0;
/// Length of the sample of a line and of anything else, room between it and its label, and between entries.
const LONG: f64 = 26.0;
const SHORT: f64 = 14.0;
const BESIDE: f64 = 6.0;
const BETWEEN: f64 = 18.0;
/// Length of the colours' bar.
const MAP: f64 = 110.0;
/// Lengths drawn and left out, of a line that is dashed, and of marks: the first, second, third of a panel.
pub const DASHES: [f64; 2] = [7.0, 4.0];
const MARKS: [&[f64]; 3] = [&[4.0, 3.0], &[1.5, 3.0], &[9.0, 3.0, 1.5, 3.0]];
/// Widths of lines.
pub const CURVE: f64 = 1.5;
pub const MARK_WIDTH: f64 = 1.5;

/// How a layer looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Look {
    Line { ink: Ink, dashed: bool },
    Points { ink: Ink, marker: Marker },
    Span,
    Mark { upright: bool, dashes: &'static [f64] },
    Bar { ink: Ink },
    Map { low: f64, high: f64 },
}

/// How each layer looks.
pub fn looks(layers: &[Layer]) -> Vec<Look> {
    let mut marks = MARKS.iter().cycle();
    let look = |layer: &Layer| match *layer {
        Layer::Line { ink, dashed, .. } => Look::Line { ink, dashed },
        Layer::Points { ink, marker, .. } => Look::Points { ink, marker },
        Layer::Spans { .. } => Look::Span,
        Layer::Marks { upright, .. } => Look::Mark { upright, dashes: marks.next().copied().unwrap_or_default() },
        Layer::Bars { ink, .. } => Look::Bar { ink },
        Layer::Cells { low, high, .. } => Look::Map { low, high },
    };
    layers.iter().map(look).collect()
}

fn label(layer: &Layer) -> &str {
    match layer {
        Layer::Line { label, .. }
        | Layer::Points { label, .. }
        | Layer::Spans { label, .. }
        | Layer::Marks { label, .. }
        | Layer::Bars { label, .. } => label,
        Layer::Cells { .. } => "",
    }
}

/// One label, and all that it stands for.
struct Entry {
    label: String,
    looks: Vec<Look>,
    /// From the panel's left edge, and in which line.
    left: f64,
    line: usize,
}

impl Entry {
    fn sample(&self) -> f64 {
        let long = |look: &Look| matches!(look, Look::Line { .. } | Look::Mark { upright: false, .. });
        if self.looks.iter().any(long) { LONG } else { SHORT }
    }

    fn width(&self) -> f64 {
        match self.looks[..] {
            [Look::Map { low, high }] => MAP + 2.0 * BESIDE + width(&number(low), ENTRY) + width(&number(high), ENTRY),
            _ => self.sample() + BESIDE + width(&self.label, ENTRY),
        }
    }
}

/// Title and legend of one panel.
pub struct Header {
    title: Vec<String>,
    entries: Vec<Entry>,
    lines: usize,
}

impl Header {
    /// Within so much room from left to right.
    pub fn new(panel: &Panel, room: f64) -> Header {
        let bold = 1.1 * TITLE;
        let title = wrap(&panel.title, bold, room);
        let mut entries: Vec<Entry> = Vec::new();
        for (layer, look) in panel.layers.iter().zip(looks(&panel.layers)) {
            let text = label(layer);
            let map = matches!(look, Look::Map { .. });
            let label = shorten(text, ENTRY, room - LONG - BESIDE);
            match entries.iter_mut().find(|entry| entry.label == label && !label.is_empty()) {
                Some(entry) if entry.looks.contains(&look) => {}
                Some(entry) => entry.looks.push(look),
                None if map || !label.is_empty() => {
                    entries.push(Entry { label, looks: vec![look], left: 0.0, line: 0 });
                }
                None => {}
            }
        }
        let length: f64 = entries.iter().map(|entry| entry.width() + BETWEEN).sum::<f64>() - BETWEEN;
        let beside = title.len() < 2 && width(&panel.title, bold) + 2.0 * BETWEEN + length <= room;
        let mut left = if beside { room - length } else { 0.0 };
        let mut line = if beside { 0 } else { title.len() };
        let lines = |entries: &[Entry], line: usize| if entries.is_empty() { 0 } else { line + 1 };
        for entry in &mut entries {
            if !beside && left > 0.0 && left + entry.width() > room {
                (left, line) = (0.0, line + 1);
            }
            (entry.left, entry.line) = (left, line);
            left += entry.width() + BETWEEN;
        }
        let lines = lines(&entries, line).max(title.len());
        Header { title, entries, lines }
    }

    /// Height, pixels.
    pub fn height(&self) -> f64 {
        LINE * self.lines as f64 + if self.lines > 0 { 4.0 } else { 0.0 }
    }

    /// Draws it above this point, the upper left corner of the panel's frame.
    pub fn draw(&self, sheet: &mut Sheet, (left, bottom): (f64, f64)) -> Result<(), String> {
        let middle = |line: usize| bottom - self.height() + LINE * (line as f64 + 0.5);
        sheet.group(&[], |pen| {
            for (i, line) in self.title.iter().enumerate() {
                let letters = Letters { bold: true, ..Letters::plain(TITLE) };
                pen.text((left, middle(i)), line, Anchor::Left, letters);
            }
        })?;
        for entry in &self.entries {
            let at = (left + entry.left, middle(entry.line));
            for &look in &entry.looks {
                let dashes: &[f64] = match look {
                    Look::Line { dashed: true, .. } => &DASHES,
                    Look::Mark { dashes, .. } => dashes,
                    _ => &[],
                };
                sheet.group(dashes, |pen| sample(pen, at, entry.sample(), look))?;
            }
            let letters = Letters { color: cover(LABEL, 1.0), ..Letters::plain(ENTRY) };
            sheet.group(&[], |pen| {
                pen.text((at.0 + entry.sample() + BESIDE, at.1), &entry.label, Anchor::Left, letters)
            })?;
        }
        Ok(())
    }
}

/// Draws what a layer looks like, from this point so far to the right.
fn sample(pen: &mut Pen, (left, y): (f64, f64), length: f64, look: Look) {
    let right = left + length;
    let middle = (left + right) / 2.0;
    match look {
        Look::Line { ink, .. } => pen.line(&[(left, y), (right, y)], cover(colour::of(ink), 1.0), 2.0),
        Look::Points { ink, marker } => pen.marker((middle, y), marker, cover(colour::of(ink), 1.0)),
        Look::Span => pen.rectangle((left, y - 6.0), (right, y + 6.0), cover(colour::GREY, SPAN)),
        Look::Mark { upright: false, .. } => pen.line(&[(left, y), (right, y)], cover(MARK, 1.0), MARK_WIDTH),
        Look::Mark { .. } => {
            pen.line(&[(middle, y - 2.2 * MARKER), (middle, y + 2.2 * MARKER)], cover(MARK, 1.0), MARK_WIDTH);
        }
        Look::Bar { ink } => bar(pen, (left, y - 6.0), (right, y + 6.0), ink),
        Look::Map { low, high } => {
            let letters = Letters { color: cover(TEXT, 1.0), ..Letters::plain(ENTRY) };
            let start = left + width(&number(low), ENTRY) + BESIDE;
            pen.text((start - BESIDE, y), &number(low), Anchor::Right, letters);
            let steps = 22;
            for i in 0..steps {
                // Each reaches to the end, below the next one, so that nothing shines through between them.
                let from = start + MAP * f64::from(i) / f64::from(steps);
                let color = colour::map((f64::from(i) + 0.5) / f64::from(steps));
                pen.rectangle((from, y - 6.0), (start + MAP, y + 6.0), cover(color, 1.0));
            }
            pen.text((start + MAP + BESIDE, y), &number(high), Anchor::Left, letters);
        }
    }
}

/// How much a grey bar over an interval covers.
pub const SPAN: f64 = 0.28;

/// A bar: what stands behind it is seen.
pub fn bar(pen: &mut Pen, from: (f64, f64), to: (f64, f64), ink: Ink) {
    let color = colour::of(ink);
    pen.rectangle((from.0, from.1.min(to.1)), (to.0, from.1.max(to.1)), cover(color, 0.5));
    pen.line(&[(from.0, to.1), (from.0, from.1), (to.0, from.1), (to.0, to.1)], cover(color, 1.0), 1.0);
}
