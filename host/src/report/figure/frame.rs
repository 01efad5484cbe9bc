//! One panel on the sheet: grid, layers, frame, the labels of its axes.

use super::colour::{self, FRAME, LABEL, MARK, TEXT, cover};
use super::legend::{CURVE, DASHES, Header, Look, MARK_WIDTH, SPAN, bar, looks};
use super::lettering::width;
use super::pen::{Anchor, Letters, MARKER, Pen, Point, Sheet};
use super::ruler::{Ruler, TICK, TICK_LINE};
use super::{Cell, Layer, Marker, Panel};
use crate::plot::panel::curves;
use std::collections::HashSet;

/// Size and height of a line of an axis's label.
pub const NAME: f64 = 14.0;
pub const NAME_LINE: f64 = 18.0;
/// Room between a frame and its ticks' labels.
pub const BESIDE: f64 = 7.0;
/// Text in cells is as large as fits, within these sizes.
const CELL_SIZES: [f64; 4] = [14.0, 13.0, 12.0, 11.0];
const CELL_LINE: f64 = 1.2;
/// Markers that are nearer to each other than this look like one.
const NEAR: f64 = MARKER / 2.0;
/// Half the gap between cells, where they are large enough for one.
const CELL_GAP: f64 = 0.5;

/// A panel with all that was decided about it but where its frame is.
pub struct Laid<'a> {
    pub panel: &'a Panel,
    pub x: Ruler,
    pub y: Ruler,
    pub header: Header,
    /// Lines of the axes' labels.
    pub x_name: Vec<String>,
    pub y_name: Vec<String>,
    /// Whether the ticks of x are labelled: a panel below may do it for this one.
    pub x_labelled: bool,
}

impl Laid<'_> {
    /// Room that is needed below the frame.
    pub fn below(&self) -> f64 {
        let ticks =
            if self.x_labelled { self.x.ticks.iter().map(|tick| tick.label.len()).max().unwrap_or(0) } else { 0 };
        let name = self.x_name.len() as f64 * NAME_LINE;
        TICK_LINE * ticks as f64 + if ticks > 0 { BESIDE } else { 0.0 } + if name > 0.0 { name + 4.0 } else { 0.0 }
    }
}

/// A frame in the sheet.
#[derive(Clone, Copy)]
pub struct Frame {
    pub left: f64,
    pub top: f64,
    pub right: f64,
    pub bottom: f64,
}

impl Frame {
    fn x(&self, place: f64) -> f64 {
        self.left + place * (self.right - self.left)
    }

    fn y(&self, place: f64) -> f64 {
        self.bottom - place * (self.bottom - self.top)
    }

    fn middle(&self) -> Point {
        ((self.left + self.right) / 2.0, (self.top + self.bottom) / 2.0)
    }

    /// The part of a straight line that lies within, if any (Liang and Barsky's).
    fn clip(&self, from: Point, to: Point) -> Option<(Point, Point)> {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let mut part = (0.0_f64, 1.0_f64);
        let edges = [
            (-dx, from.0 - self.left),
            (dx, self.right - from.0),
            (-dy, from.1 - self.top),
            (dy, self.bottom - from.1),
        ];
        for (outwards, room) in edges {
            if outwards == 0.0 && room < 0.0 {
                return None;
            } else if outwards < 0.0 {
                part.0 = part.0.max(room / outwards);
            } else if outwards > 0.0 {
                part.1 = part.1.min(room / outwards);
            }
        }
        let at = |t: f64| (from.0 + t * dx, from.1 + t * dy);
        (part.0 <= part.1).then(|| (at(part.0), at(part.1)))
    }
}

/// Draws a panel, its header above the frame and the labels of its axes outside; that of y ends so far left of the
/// frame.
pub fn draw(sheet: &mut Sheet, laid: &Laid, frame: Frame, names_end: f64) -> Result<(), String> {
    let layers = || laid.panel.layers.iter().zip(looks(&laid.panel.layers));
    sheet.group(&[], |pen| {
        for (layer, _) in layers() {
            if let Layer::Spans { spans, .. } = layer {
                draw_spans(pen, laid, frame, spans);
            }
        }
        grid(pen, laid, frame);
    })?;
    let mut drawn = false;
    for (layer, look) in layers() {
        drawn |= draw_layer(sheet, laid, frame, layer, look)?;
    }
    sheet.group(&[], |pen| {
        let corners = [(frame.left, frame.top), (frame.right, frame.top), (frame.right, frame.bottom)];
        let [a, b, c] = corners;
        pen.line(&[a, b, c, (frame.left, frame.bottom), a], cover(FRAME, 1.0), 1.0);
        if !drawn {
            pen.text(frame.middle(), "no data", Anchor::Middle, label(NAME));
        }
        axes(pen, laid, frame, names_end);
    })?;
    laid.header.draw(sheet, (frame.left, frame.top))
}

fn label(size: f64) -> Letters {
    Letters { color: cover(LABEL, 1.0), ..Letters::plain(size) }
}

fn grid(pen: &mut Pen, laid: &Laid, frame: Frame) {
    let line = |pen: &mut Pen, ends: [Point; 2], opacity| pen.line(&ends, cover(TEXT, opacity), 1.0);
    for tick in &laid.x.ticks {
        let x = frame.x(tick.place);
        line(pen, [(x, frame.top), (x, frame.bottom)], 0.12);
    }
    for tick in &laid.y.ticks {
        let y = frame.y(tick.place);
        let zero = !laid.y.log && tick.place == laid.y.place(0.0);
        line(pen, [(frame.left, y), (frame.right, y)], if zero { 0.4 } else { 0.12 });
    }
}

fn axes(pen: &mut Pen, laid: &Laid, frame: Frame, names_end: f64) {
    for tick in laid.y.ticks.iter().filter(|tick| !tick.label.is_empty()) {
        let y = frame.y(tick.place);
        pen.line(&[(frame.left - 4.0, y), (frame.left, y)], cover(FRAME, 1.0), 1.0);
        let first = y - TICK_LINE * (tick.label.len() as f64 - 1.0) / 2.0;
        for (i, line) in tick.label.iter().enumerate() {
            let at = (frame.left - BESIDE, first + TICK_LINE * i as f64);
            pen.text(at, line, Anchor::Right, label(TICK));
        }
    }
    for (i, line) in laid.y_name.iter().enumerate() {
        let x = frame.left - names_end - NAME_LINE * (laid.y_name.len() as f64 - i as f64 - 0.5);
        pen.text((x, frame.middle().1), line, Anchor::Upwards, label(NAME));
    }
    let mut below = frame.bottom;
    if laid.x_labelled {
        for tick in laid.x.ticks.iter().filter(|tick| !tick.label.is_empty()) {
            let x = frame.x(tick.place);
            pen.line(&[(x, frame.bottom), (x, frame.bottom + 4.0)], cover(FRAME, 1.0), 1.0);
            for (i, line) in tick.label.iter().enumerate() {
                let at = (x, frame.bottom + BESIDE + TICK_LINE * (i as f64 + 0.5));
                pen.text(at, line, Anchor::Middle, label(TICK));
            }
        }
        below += laid.below() - laid.x_name.len() as f64 * NAME_LINE;
    }
    for (i, line) in laid.x_name.iter().enumerate() {
        pen.text((frame.middle().0, below + NAME_LINE * (i as f64 + 0.5)), line, Anchor::Middle, label(NAME));
    }
}

/// Draws a layer, and says whether any data were seen.
fn draw_layer(sheet: &mut Sheet, laid: &Laid, frame: Frame, layer: &Layer, look: Look) -> Result<bool, String> {
    let mut seen = false;
    match (layer, look) {
        (Layer::Line { points, ink, dashed, .. }, _) => {
            let pieces = pieces(laid, frame, points);
            seen = !pieces.is_empty();
            let color = cover(colour::of(*ink), 1.0);
            sheet.group(if *dashed { &DASHES } else { &[] }, |pen| {
                for piece in pieces {
                    match piece[..] {
                        [point] => pen.circle(point, 2.0, color, true),
                        _ => pen.line(&piece, color, CURVE),
                    }
                }
            })?;
        }
        (Layer::Points { points, ink, marker, .. }, _) => {
            sheet.group(&[], |pen| {
                seen = draw_points(pen, laid, frame, points, *marker, cover(colour::of(*ink), 0.85))
            })?;
        }
        (Layer::Marks { at, upright, .. }, Look::Mark { dashes, .. }) => {
            let ruler = if *upright { &laid.x } else { &laid.y };
            sheet.group(dashes, |pen| {
                for place in at.iter().map(|&value| ruler.place(value)).filter(|place| (0.0..=1.0).contains(place)) {
                    let (x, y) = (frame.x(place), frame.y(place));
                    let ends = if *upright {
                        [(x, frame.bottom), (x, frame.top)]
                    } else {
                        [(frame.left, y), (frame.right, y)]
                    };
                    pen.line(&ends, cover(MARK, 1.0), MARK_WIDTH);
                }
            })?;
        }
        (Layer::Bars { bars, ink, .. }, _) => sheet.group(&[], |pen| {
            for &[left, right, height] in bars {
                if let Some((left, right)) = interval(&laid.x, left, right)
                    && laid.y.place(height).is_finite()
                {
                    let place = laid.y.place(height).clamp(0.0, 1.0);
                    let (top, ground) = (frame.y(place), frame.y(laid.y.ground()));
                    if top != ground {
                        bar(pen, (frame.x(left), top), (frame.x(right), ground), *ink);
                    }
                    seen = true;
                }
            }
        })?,
        (Layer::Cells { cells, low, high }, _) => sheet.group(&[], |pen| {
            for cell in cells {
                // Where the map has no length, all values are its middle.
                let share = if low < high { (cell.value - low) / (high - low) } else { 0.5 + 0.0 * cell.value };
                seen |= draw_cell(pen, laid, frame, cell, share);
            }
        })?,
        (Layer::Spans { .. } | Layer::Marks { .. }, _) => {}
    }
    Ok(seen)
}

/// The part of an interval that lies on the axis; what is zero or below is before the beginning of a logarithmic one.
fn interval(ruler: &Ruler, from: f64, to: f64) -> Option<(f64, f64)> {
    let place = |value: f64| if ruler.log && value <= 0.0 { f64::NEG_INFINITY } else { ruler.place(value) };
    let (from, to) = (place(from), place(to));
    (from <= to && from < 1.0 && to > 0.0).then(|| (from.max(0.0), to.min(1.0)))
}

fn draw_spans(pen: &mut Pen, laid: &Laid, frame: Frame, spans: &[[f64; 2]]) {
    for &[from, to] in spans {
        if let Some((from, to)) = interval(&laid.x, from, to) {
            // However short, it is seen.
            let (left, right) = (frame.x(from), frame.x(to).max(frame.x(from) + 1.0));
            pen.rectangle((left, frame.top), (right, frame.bottom), cover(colour::GREY, SPAN));
        }
    }
}

/// A line as it is drawn: cut at its gaps and at the frame, with the extremes of each column of pixels.
fn pieces(laid: &Laid, frame: Frame, points: &[[f64; 2]]) -> Vec<Vec<Point>> {
    let x: Vec<f64> = points.iter().map(|point| frame.x(laid.x.place(point[0]))).collect();
    // Without a place on one axis, the point has none on the other.
    let y = points.iter().zip(&x);
    let y: Vec<f64> =
        y.map(|(point, x)| if x.is_finite() { frame.y(laid.y.place(point[1])) } else { f64::NAN }).collect();
    let mut pieces: Vec<Vec<Point>> = Vec::new();
    for curve in curves(&x, &y, &|x| x) {
        if let [point] = curve[..] {
            pieces.extend(frame.clip(point, point).map(|_| vec![point]));
        }
        let mut open: Vec<Point> = Vec::new();
        for pair in curve.windows(2) {
            let Some((from, to)) = frame.clip(pair[0], pair[1]) else { continue };
            if open.last() != Some(&from) {
                pieces.push(std::mem::take(&mut open));
                open.push(from);
            }
            open.push(to);
        }
        pieces.push(open);
    }
    pieces.retain(|piece| !piece.is_empty());
    pieces
}

/// Draws markers; those of one layer that all but cover each other are one.
fn draw_points(
    pen: &mut Pen,
    laid: &Laid,
    frame: Frame,
    points: &[[f64; 2]],
    marker: Marker,
    color: plotters::style::RGBAColor,
) -> bool {
    let mut there = HashSet::new();
    let within = |place: f64| (-1e-9..=1.0 + 1e-9).contains(&place);
    let spot = |(x, y): Point| ((x / NEAR).round() as i32, (y / NEAR).round() as i32);
    for &[x, y] in points {
        let (x, y) = (laid.x.place(x), laid.y.place(y));
        let at = (frame.x(x), frame.y(y));
        if within(x) && within(y) && there.insert(spot(at)) {
            pen.marker(at, marker, color);
        }
    }
    !there.is_empty()
}

fn draw_cell(pen: &mut Pen, laid: &Laid, frame: Frame, cell: &Cell, share: f64) -> bool {
    let x = interval(&laid.x, cell.x[0].min(cell.x[1]), cell.x[0].max(cell.x[1]));
    let y = interval(&laid.y, cell.y[0].min(cell.y[1]), cell.y[0].max(cell.y[1]));
    let Some(((left, right), (low, high))) = x.zip(y) else { return false };
    let (left, right, top, bottom) = (frame.x(left), frame.x(right), frame.y(high), frame.y(low));
    let color = colour::map(share);
    let gap = if (right - left).min(bottom - top) >= 16.0 * CELL_GAP { CELL_GAP } else { 0.0 };
    pen.rectangle((left + gap, top + gap), (right - gap, bottom - gap), cover(color, 1.0));
    let lines: Vec<&str> = cell.text.lines().collect();
    let longest = |size| lines.iter().map(|line| width(line, size)).fold(0.0, f64::max);
    let fits = |size: &f64| {
        longest(*size) <= right - left - 4.0 && CELL_LINE * size * lines.len() as f64 <= bottom - top - 2.0
    };
    if let Some(size) = CELL_SIZES.into_iter().find(fits) {
        let first = (top + bottom) / 2.0 - CELL_LINE * size * (lines.len() as f64 - 1.0) / 2.0;
        let letters = Letters { color: cover(colour::on(color), 1.0), ..Letters::plain(size) };
        for (i, line) in lines.iter().enumerate() {
            pen.text(((left + right) / 2.0, first + CELL_LINE * size * i as f64), line, Anchor::Middle, letters);
        }
    }
    true
}
