//! Short ways to say what a figure is made of.

use super::{Axis, Cell, Figure, Ink, Layer, Marker, Panel, Row, Scale, ruler};

impl Figure {
    /// One panel of this height.
    pub fn one(panel: Panel, height: f64) -> Figure {
        Figure { rows: vec![Row { height, panels: vec![panel] }] }
    }

    /// Panels of this height above each other, over one x axis: those without a range in x get one that has room for
    /// all of their data, and a label that they share stands below the last one only.
    pub fn stacked(mut panels: Vec<Panel>, height: f64) -> Figure {
        let all = panels.iter().filter(|panel| panel.x.range.is_none());
        let spans = all.filter_map(|panel| {
            let span = ruler::span(panel, 0).ok().flatten()?;
            Some(if panel.x.scale == Scale::Log {
                (10_f64.powf(span.low), 10_f64.powf(span.high))
            } else {
                (span.low, span.high)
            })
        });
        let range = spans.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        let below = panels.last().map(|panel| panel.x.label.clone());
        let count = panels.len();
        for (i, panel) in panels.iter_mut().enumerate() {
            panel.x.range = panel.x.range.or(range);
            if i + 1 < count && below.as_ref() == Some(&panel.x.label) {
                panel.x.label.clear();
            }
        }
        Figure { rows: panels.into_iter().map(|panel| Row { height, panels: vec![panel] }).collect() }
    }

    /// Rows of so many panels each, all of this height; the last row may have fewer.
    pub fn grid(panels: Vec<Panel>, columns: usize, height: f64) -> Figure {
        let rows = panels.chunks(columns.max(1)).map(|panels| Row { height, panels: panels.to_vec() });
        Figure { rows: rows.collect() }
    }
}

impl Axis {
    /// A linear axis with room for all data.
    pub fn linear(label: impl Into<String>) -> Axis {
        Axis { label: label.into(), scale: Scale::Linear, range: None, ticks: Vec::new() }
    }

    /// A logarithmic axis with room for all data that are positive.
    pub fn log(label: impl Into<String>) -> Axis {
        Axis { scale: Scale::Log, ..Axis::linear(label) }
    }

    /// From the first to the last number.
    pub fn within(self, low: f64, high: f64) -> Axis {
        Axis { range: Some((low, high)), ..self }
    }

    /// With these words at these numbers.
    pub fn ticks<T: Into<String>>(self, ticks: impl IntoIterator<Item = (f64, T)>) -> Axis {
        Axis { ticks: ticks.into_iter().map(|(value, label)| (value, label.into())).collect(), ..self }
    }
}

impl Panel {
    /// A panel without data.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Panel {
        Panel { title: title.into(), x, y, layers: Vec::new() }
    }

    /// With one layer more, above the others.
    pub fn layer(mut self, layer: Layer) -> Panel {
        self.layers.push(layer);
        self
    }

    /// With a line.
    pub fn line(self, label: impl Into<String>, ink: Ink, points: Vec<[f64; 2]>) -> Panel {
        self.layer(Layer::Line { label: label.into(), points, ink, dashed: false })
    }

    /// With a dashed line.
    pub fn dashed(self, label: impl Into<String>, ink: Ink, points: Vec<[f64; 2]>) -> Panel {
        self.layer(Layer::Line { label: label.into(), points, ink, dashed: true })
    }

    /// With points.
    pub fn points(self, label: impl Into<String>, ink: Ink, marker: Marker, points: Vec<[f64; 2]>) -> Panel {
        self.layer(Layer::Points { label: label.into(), points, ink, marker })
    }

    /// With grey bars over intervals of x.
    pub fn spans(self, label: impl Into<String>, spans: Vec<[f64; 2]>) -> Panel {
        self.layer(Layer::Spans { label: label.into(), spans })
    }

    /// With upright lines at these x.
    pub fn marks(self, label: impl Into<String>, at: Vec<f64>) -> Panel {
        self.layer(Layer::Marks { label: label.into(), at, upright: true })
    }

    /// With level lines at these y.
    pub fn levels(self, label: impl Into<String>, at: Vec<f64>) -> Panel {
        self.layer(Layer::Marks { label: label.into(), at, upright: false })
    }

    /// With bars: left edge, right edge, height.
    pub fn bars(self, label: impl Into<String>, ink: Ink, bars: Vec<[f64; 3]>) -> Panel {
        self.layer(Layer::Bars { label: label.into(), bars, ink })
    }

    /// With coloured cells, from the value of the first colour to that of the last one.
    pub fn cells(self, cells: Vec<Cell>, low: f64, high: f64) -> Panel {
        self.layer(Layer::Cells { cells, low, high })
    }
}

impl Ink {
    /// All of them, in the order in which they are best used.
    pub const ALL: [Ink; 8] =
        [Ink::Blue, Ink::Vermillion, Ink::Green, Ink::Orange, Ink::Purple, Ink::Sky, Ink::Black, Ink::Grey];
}

impl Marker {
    /// All of them, in the order in which they are best used.
    pub const ALL: [Marker; 6] =
        [Marker::Disc, Marker::Ring, Marker::Cross, Marker::Square, Marker::Triangle, Marker::Diamond];
}
