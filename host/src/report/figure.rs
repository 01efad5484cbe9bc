//! Figures for a report: panels of lines, points, bars and cells, as SVG that stands in a page of HTML.
//!
//! A [`Figure`] is rows of [`Panel`]s; a panel has two [`Axis`]es and [`Layer`]s, the later ones above the earlier
//! ones. All lengths are pixels at a width of [`WIDTH`]; the figure takes whatever width the page gives it. The same
//! figure gives the same bytes. Colours are Okabe and Ito's and viridis, which colour-blind eyes tell apart.

mod build;
mod colour;
mod frame;
mod legend;
mod lettering;
mod pen;
mod ruler;

use thiserror::Error;

use frame::{BESIDE, Frame, Laid, NAME, NAME_LINE};
use legend::Header;
use lettering::wrap;
use pen::Sheet;
use ruler::{OVERHANG, Ruler, Run, across};

/// Width for which heights and the sizes of letters and lines are given, pixels.
pub const WIDTH: f64 = 960.0;
/// Between two rows, and above and below all of them.
const GAP: f64 = 14.0;
const MARGIN: f64 = 4.0;
/// No frame is smaller, in either direction.
const SMALLEST: f64 = 24.0;

/// Rows of panels, from the top down.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figure {
    /// The rows; each has at least one panel.
    pub rows: Vec<Row>,
}

/// Panels side by side, which share the width equally.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Height of the panels' frames, pixels at [`WIDTH`]; titles, legends and the labels of the axes come on top of it.
    pub height: f64,
    /// The panels, from the left.
    pub panels: Vec<Panel>,
}

/// Data between two axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// What stands above; it may be empty.
    pub title: String,
    /// The horizontal axis. Without a label it leaves the labels of its ticks, too, to the panel below, if that one
    /// shows the same range.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// What is drawn. Labels that are not empty make up the legend, each one once.
    pub layers: Vec<Layer>,
}

/// One axis of a panel.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// What is shown, with its unit.
    pub label: String,
    /// How numbers become lengths.
    pub scale: Scale,
    /// The first and the last number; what lies beyond is not drawn. Without it, there is room for all data.
    pub range: Option<(f64, f64)>,
    /// Numbers that are marked, with what is said there; round numbers if there are none. Labels without room are left
    /// out.
    pub ticks: Vec<(f64, String)>,
}

/// How numbers become lengths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences are equal lengths.
    Linear,
    /// Equal ratios are equal lengths; zero and below have no place and are gaps.
    Log,
}

/// One kind of mark for a set of data.
#[derive(Clone, Debug, PartialEq)]
pub enum Layer {
    /// Points joined in their order; one that is not finite, or has no place on an axis, is a gap.
    Line {
        /// What the legend says.
        label: String,
        /// x and y.
        points: Vec<[f64; 2]>,
        /// Its colour.
        ink: Ink,
        /// Whether it is dashed.
        dashed: bool,
    },
    /// A marker at each point.
    Points {
        /// What the legend says.
        label: String,
        /// x and y.
        points: Vec<[f64; 2]>,
        /// Their colour.
        ink: Ink,
        /// Their shape.
        marker: Marker,
    },
    /// Grey bars over the panel's full height, behind everything.
    Spans {
        /// What the legend says.
        label: String,
        /// From and to, in x; they may be infinite.
        spans: Vec<[f64; 2]>,
    },
    /// Thin dashed lines across the panel; the dashes differ between a panel's first three layers of this kind.
    Marks {
        /// What the legend says.
        label: String,
        /// Where, in x if upright, else in y.
        at: Vec<f64>,
        /// Whether they run upwards.
        upright: bool,
    },
    /// Bars that stand on zero, or on the end of a logarithmic axis.
    Bars {
        /// What the legend says.
        label: String,
        /// Left edge, right edge, height.
        bars: Vec<[f64; 3]>,
        /// Their colour.
        ink: Ink,
    },
    /// Coloured rectangles; a bar above the panel shows what the colours mean.
    Cells {
        /// The rectangles.
        cells: Vec<Cell>,
        /// The value of the first colour, dark blue; smaller ones look the same.
        low: f64,
        /// The value of the last colour, yellow; larger ones look the same.
        high: f64,
    },
}

/// One rectangle of a map.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// Its edges in x.
    pub x: [f64; 2],
    /// Its edges in y.
    pub y: [f64; 2],
    /// What its colour says; NaN is grey.
    pub value: f64,
    /// What stands in it, in one or more lines, black or white, whichever is easier to read; nothing if it is too
    /// small.
    pub text: String,
}

/// The colour of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ink {
    /// Dark blue.
    Blue,
    /// Red with some orange.
    Vermillion,
    /// Bluish green.
    Green,
    /// Light orange.
    Orange,
    /// Reddish purple.
    Purple,
    /// Light blue.
    Sky,
    /// Almost black.
    Black,
    /// For what matters less.
    Grey,
}

/// The shape of a point: classes are told apart without colours, too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    /// A filled circle.
    Disc,
    /// A circle.
    Ring,
    /// Two lines that cross, as in an x.
    Cross,
    /// A filled square.
    Square,
    /// A filled triangle, its tip up.
    Triangle,
    /// A filled square on its corner.
    Diamond,
}

/// Why a figure cannot be drawn.
#[derive(Debug, Error, PartialEq)]
pub enum FigureError {
    /// There are no rows, or one is empty.
    #[error("a figure needs at least one panel in each row")]
    Empty,
    /// A panel would be too small to show anything.
    #[error(
        "row {row} leaves frames of {width:.0} x {height:.0} pixels, the smallest is {SMALLEST} x {SMALLEST}: \
         make it higher, or put fewer panels into it"
    )]
    Small {
        /// The row, counted from 1.
        row: usize,
        /// Width of a frame.
        width: f64,
        /// Height of a frame.
        height: f64,
    },
    /// A range that no axis can show.
    #[error(
        "the axis \"{axis}\" cannot run from {low} to {high}: both must be finite, the first one smaller, and positive \
         if the axis is logarithmic"
    )]
    Range {
        /// The axis's label.
        axis: String,
        /// Its low end.
        low: f64,
        /// Its high end.
        high: f64,
    },
    /// The drawing library failed.
    #[error("the figure cannot be drawn: {0}")]
    Draw(String),
}

impl Figure {
    /// The figure as an `<svg>` element, without a prolog, as wide as the element it stands in.
    ///
    /// # Errors
    /// A figure or a row without panels, frames that would be too small, a range that its axis cannot show.
    pub fn svg(&self) -> Result<String, FigureError> {
        if self.rows.is_empty() || self.rows.iter().any(|row| row.panels.is_empty()) {
            return Err(FigureError::Empty);
        }
        let Margin { left, names_end } = self.margin()?;
        let mut rows = Vec::new();
        for (i, row) in self.rows.iter().enumerate() {
            let width = row.frame_width(left);
            if !(width >= SMALLEST && row.height >= SMALLEST && row.height.is_finite()) {
                return Err(FigureError::Small { row: i + 1, width, height: row.height });
            }
            rows.push(row.panels.iter().map(|panel| lay(panel, width, row.height)).collect::<Result<Vec<_>, _>>()?);
        }
        leave_labels_to_panels_below(&mut rows);

        let mut frames = Vec::new();
        let mut top = MARGIN;
        for (row, laid) in self.rows.iter().zip(&rows) {
            let highest = |rooms: &mut dyn Iterator<Item = f64>| rooms.fold(0.0, f64::max);
            top += highest(&mut laid.iter().map(|laid| laid.header.height()));
            let (width, bottom) = (row.frame_width(left), top + row.height);
            for (i, laid) in laid.iter().enumerate() {
                let left = left + (left + width + OVERHANG) * i as f64;
                frames.push((laid, Frame { left, top, right: left + width, bottom }));
            }
            top = bottom + highest(&mut laid.iter().map(Laid::below)) + GAP;
        }
        let mut sheet = Sheet::new(WIDTH, top - GAP + MARGIN);
        sheet
            .group(&[], |pen| pen.rectangle((0.0, 0.0), (WIDTH, top), colour::cover(colour::WHITE, 1.0)))
            .and_then(|()| frames.iter().try_for_each(|(laid, at)| frame::draw(&mut sheet, laid, *at, names_end)))
            .map_err(FigureError::Draw)?;
        Ok(sheet.svg())
    }

    fn margin(&self) -> Result<Margin, FigureError> {
        let (mut labels, mut names) = (0.0_f64, 0.0_f64);
        for row in &self.rows {
            for panel in &row.panels {
                let y = Ruler::new(&panel.y, ruler::span(panel, 1)?, Run::Up(row.height));
                labels = y.ticks.iter().map(|tick| across(&tick.label)).fold(labels, f64::max);
                names = names.max(wrap(&panel.y.label, NAME, row.height).len() as f64 * NAME_LINE);
            }
        }
        let names_end = labels + 1.5 * BESIDE;
        Ok(Margin { left: (names_end + names + MARGIN).max(OVERHANG), names_end })
    }
}

/// Room at the left of every frame, the same for all, so that frames above each other align.
struct Margin {
    /// All of it.
    left: f64,
    /// The part of it between the y axis's label and the frame.
    names_end: f64,
}

impl Row {
    fn frame_width(&self, left: f64) -> f64 {
        let panels = self.panels.len() as f64;
        WIDTH / panels - left - OVERHANG
    }
}

/// Everything about a panel whose frame has this size.
fn lay(panel: &Panel, width: f64, height: f64) -> Result<Laid<'_>, FigureError> {
    Ok(Laid {
        panel,
        x: Ruler::new(&panel.x, ruler::span(panel, 0)?, Run::Across(width)),
        y: Ruler::new(&panel.y, ruler::span(panel, 1)?, Run::Up(height)),
        header: Header::new(panel, width),
        x_name: wrap(&panel.x.label, NAME, width),
        y_name: wrap(&panel.y.label, NAME, height),
        x_labelled: true,
    })
}

/// An axis without a label, above one with the same range and ticks, is read from there.
fn leave_labels_to_panels_below(rows: &mut [Vec<Laid>]) {
    for i in 1..rows.len() {
        let (above, below) = rows.split_at_mut(i);
        let (above, below) = (&mut above[i - 1], &below[0]);
        if above.len() == below.len() {
            for (above, below) in above.iter_mut().zip(below) {
                let same = above.x.span == below.x.span && above.x.log == below.x.log;
                let same = same && above.panel.x.ticks == below.panel.x.ticks;
                above.x_labelled = !(same && above.panel.x.label.is_empty());
            }
        }
    }
}

#[cfg(test)]
mod tests;
