//! One axis of one panel: where its numbers lie, and its ticks.

use super::lettering::{number, width, wrap};
use super::{Axis, FigureError, Layer, Panel, Scale};
use crate::plot::panel::{Span, ticks};

/// Size of the ticks' labels.
pub const TICK: f64 = 13.0;
/// Height of one line of a tick's label.
pub const TICK_LINE: f64 = 15.0;
/// How far labels may reach beyond the ends of a horizontal axis.
pub const OVERHANG: f64 = 24.0;
/// Room between two labels side by side.
const APART: f64 = 10.0;
/// A label beside a vertical axis gets another line beyond this width.
const LABEL_WIDTH: f64 = 150.0;

/// How an axis runs, and how long it is.
#[derive(Clone, Copy)]
pub enum Run {
    /// From left to right.
    Across(f64),
    /// From the bottom up.
    Up(f64),
}

impl Run {
    fn length(self) -> f64 {
        match self {
            Run::Across(length) | Run::Up(length) => length,
        }
    }
}

/// A place on the axis with a line of the grid and a label; a label that would not fit has no lines.
pub struct Tick {
    /// 0 at the low end of the axis, 1 at the high one.
    pub place: f64,
    pub label: Vec<String>,
}

/// An axis with its span: of numbers, or of their powers of ten.
pub struct Ruler {
    pub span: Span,
    pub log: bool,
    pub ticks: Vec<Tick>,
}

impl Ruler {
    /// Without a span, as nothing is known to show, there are no ticks.
    pub fn new(axis: &Axis, span: Option<Span>, run: Run) -> Ruler {
        let log = axis.scale == Scale::Log;
        let mut ruler = Ruler { span: span.unwrap_or(Span { low: 0.0, high: 1.0 }), log, ticks: Vec::new() };
        if span.is_some() {
            ruler.ticks = ruler.choose(axis, run);
        }
        ruler
    }

    /// Where a number lies, 0 at the low end and 1 at the high one; NaN if the axis has no place for it.
    pub fn place(&self, value: f64) -> f64 {
        self.span.place(scaled(value, self.log))
    }

    /// Where bars stand: at zero, on a logarithmic axis at its low end.
    pub fn ground(&self) -> f64 {
        if self.log { 0.0 } else { self.place(0.0).clamp(0.0, 1.0) }
    }

    fn choose(&self, axis: &Axis, run: Run) -> Vec<Tick> {
        if !axis.ticks.is_empty() {
            return thin(self.given(&axis.ticks, run), run).0;
        }
        let mut best = None;
        for candidate in self.candidates(run) {
            let (ticks, whole) = thin(self.given(&candidate, run), run);
            if ticks.len() >= 2 && whole {
                return ticks;
            }
            if best.as_ref().is_none_or(|best: &Vec<Tick>| best.len() < 2) {
                best = Some(ticks);
            }
        }
        best.unwrap_or_default()
    }

    fn given(&self, labels: &[(f64, String)], run: Run) -> Vec<Tick> {
        let placed = labels.iter().map(|(value, label)| (self.place(*value), label));
        let mut placed: Vec<(f64, &String)> =
            placed.filter(|(place, _)| (-1e-9..=1.0 + 1e-9).contains(place)).collect();
        placed.sort_by(|a, b| a.0.total_cmp(&b.0));
        let room = match run {
            Run::Across(length) => {
                let pitch = placed.windows(2).map(|pair| pair[1].0 - pair[0].0).fold(1.0, f64::min);
                (pitch * length - APART).max(2.0 * TICK)
            }
            Run::Up(_) => LABEL_WIDTH,
        };
        placed.into_iter().map(|(place, label)| Tick { place, label: wrap(label, TICK, room) }).collect()
    }

    /// Ways to put ticks on the axis, the best first: as dense as is easily read, then sparser.
    fn candidates(&self, run: Run) -> Vec<Vec<(f64, String)>> {
        let Span { low, high } = self.span;
        let most = match run {
            Run::Across(length) => (length / 45.0).clamp(2.0, 12.0),
            Run::Up(length) => (length / 20.0).clamp(3.0, 8.0),
        };
        let most = most as u32;
        // Where no count gives two ticks, as around zero, more than are wanted do.
        let counts = (1..=most).rev().chain(most + 1..=2 * most).map(f64::from);
        if !self.log {
            return counts.map(|count| round_numbers(self.span, count)).collect();
        }
        let mut candidates = Vec::new();
        if high - low < 2.5 {
            candidates.push(powers(self.span, &[1, 2, 5], 1));
        }
        candidates.extend([1, 2, 3, 5, 10, 20, 50, 100].map(|every| powers(self.span, &[1], every)));
        candidates.retain(|candidate| candidate.len() >= 2);
        if high - low < 1.0 {
            let numbers = Span { low: 10_f64.powf(low), high: 10_f64.powf(high) };
            candidates.extend(counts.map(|count| round_numbers(numbers, count)));
        }
        candidates
    }
}

/// A number in the unit of its axis: itself, or its power of ten, NaN if it has none.
fn scaled(value: f64, log: bool) -> f64 {
    match log {
        false => value,
        true if value > 0.0 => value.log10(),
        true => f64::NAN,
    }
}

/// About `count` round numbers, with as many decimals as tell them apart.
fn round_numbers(span: Span, count: f64) -> Vec<(f64, String)> {
    let (values, decimals) = ticks(span, count);
    let step = values.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    let long = decimals > 4 || values.iter().any(|value| value.abs() >= 1e6);
    let label = |value: f64| match value {
        0.0 if long => "0".into(),
        0.0 => format!("{:.decimals$}", 0.0),
        _ if long => {
            let digits = (value.abs().log10().floor() - step.log10().floor()).clamp(0.0, 15.0);
            format!("{value:.*e}", digits as usize)
        }
        _ => format!("{value:.decimals$}"),
    };
    values.iter().map(|&value| (value, label(value))).collect()
}

/// These multiples of every `every`th power of ten.
fn powers(span: Span, multiples: &[u8], every: i32) -> Vec<(f64, String)> {
    let exponents = span.low.floor() as i32..=span.high.ceil() as i32;
    let within = |multiple: u8, exponent: i32| {
        let place = f64::from(multiple).log10() + f64::from(exponent);
        (span.low - 1e-9..=span.high + 1e-9).contains(&place)
    };
    let all: Vec<(u8, i32)> = exponents
        .filter(|exponent| exponent % every == 0)
        .flat_map(|exponent| multiples.iter().map(move |&multiple| (multiple, exponent)))
        .filter(|&(multiple, exponent)| within(multiple, exponent))
        .collect();
    let short = all.iter().all(|(_, exponent)| (-3..=4).contains(exponent));
    let label = |multiple: u8, exponent: i32| match (short, multiple) {
        (true, _) => number(f64::from(multiple) * 10_f64.powi(exponent)),
        (false, 1) => format!("10{}", superscript(exponent)),
        (false, _) => format!("{multiple}·10{}", superscript(exponent)),
    };
    all.iter().map(|&(m, exponent)| (f64::from(m) * 10_f64.powi(exponent), label(m, exponent))).collect()
}

fn superscript(exponent: i32) -> String {
    let raised = |character| match character {
        '-' => '⁻',
        '0' => '⁰',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '4' => '⁴',
        '5' => '⁵',
        '6' => '⁶',
        '7' => '⁷',
        '8' => '⁸',
        _ => '⁹',
    };
    exponent.to_string().chars().map(raised).collect()
}

/// Takes labels away that would run into the one before or too far beyond the axis; and says whether all could stay.
fn thin(mut ticks: Vec<Tick>, run: Run) -> (Vec<Tick>, bool) {
    let mut free = f64::NEG_INFINITY;
    let mut whole = true;
    for tick in &mut ticks {
        let middle = tick.place * run.length();
        let (half, apart, ends) = match run {
            Run::Across(length) => (across(&tick.label) / 2.0, APART, (-OVERHANG, length + OVERHANG)),
            Run::Up(_) => (TICK_LINE * tick.label.len() as f64 / 2.0, 2.0, (f64::NEG_INFINITY, f64::INFINITY)),
        };
        if middle - half < (free + apart).max(ends.0) || middle + half > ends.1 {
            tick.label.clear();
            whole = false;
        } else {
            free = middle + half;
        }
    }
    (ticks, whole)
}

/// Width of a label.
pub fn across(label: &[String]) -> f64 {
    label.iter().map(|line| width(line, TICK)).fold(0.0, f64::max)
}

/// The span of a panel's axis, 0 for x and 1 for y: the one that was asked for, else one around all that is drawn.
///
/// # Errors
/// A range that is empty, not finite, or not positive where the axis is logarithmic.
pub fn span(panel: &Panel, dimension: usize) -> Result<Option<Span>, FigureError> {
    let axis = if dimension == 0 { &panel.x } else { &panel.y };
    let log = axis.scale == Scale::Log;
    if let Some((low, high)) = axis.range {
        let span = Span { low: scaled(low, log), high: scaled(high, log) };
        let good = span.low.is_finite() && span.high.is_finite() && span.low < span.high;
        return if good { Ok(Some(span)) } else { Err(FigureError::Range { axis: axis.label.clone(), low, high }) };
    }
    let numbers: Vec<f64> =
        panel.layers.iter().flat_map(|layer| numbers(layer, dimension)).map(|value| scaled(value, log)).collect();
    let has = |kind: fn(&Layer) -> bool| panel.layers.iter().any(kind);
    let bars = dimension == 1 && has(|layer| matches!(layer, Layer::Bars { .. }));
    let share = match dimension {
        _ if has(|layer| matches!(layer, Layer::Cells { .. })) => 0.0,
        0 if has(|layer| matches!(layer, Layer::Points { .. })) => 0.03,
        0 => 0.0,
        _ => 0.07,
    };
    Ok(Span::around(&numbers).map(|data| {
        let mut span = if share == 0.0 && data.high > data.low { data } else { data.padded(share) };
        if bars && log {
            // The shortest bar is seen, too.
            span.low = data.low - 0.3;
        } else if bars {
            // Bars stand on the axis.
            span.low = if data.low == 0.0 { 0.0 } else { span.low };
            span.high = if data.high == 0.0 { data.high.max(span.low + 1.0) } else { span.high };
        }
        span
    }))
}

/// Everything that an axis has to show of a layer.
fn numbers(layer: &Layer, dimension: usize) -> Vec<f64> {
    match layer {
        Layer::Line { points, .. } | Layer::Points { points, .. } => {
            points.iter().map(|point| point[dimension]).collect()
        }
        Layer::Spans { spans, .. } if dimension == 0 => spans.concat(),
        Layer::Marks { at, upright, .. } if *upright == (dimension == 0) => at.clone(),
        Layer::Spans { .. } | Layer::Marks { .. } => Vec::new(),
        Layer::Bars { bars, .. } if dimension == 0 => bars.iter().flat_map(|bar| [bar[0], bar[1]]).collect(),
        Layer::Bars { bars, .. } => bars.iter().flat_map(|bar| [0.0, bar[2]]).collect(),
        Layer::Cells { cells, .. } if dimension == 0 => cells.iter().flat_map(|cell| cell.x).collect(),
        Layer::Cells { cells, .. } => cells.iter().flat_map(|cell| cell.y).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis, low: f64, high: f64, run: Run) -> Vec<String> {
        let ruler = Ruler::new(axis, Some(Span { low, high }), run);
        ruler.ticks.into_iter().map(|tick| tick.label.join(" ")).collect()
    }

    #[test]
    fn ticks_are_round_numbers_with_the_decimals_they_need_and_zero_has_no_sign() {
        let axis = Axis::linear("x");
        assert_eq!(labels(&axis, -1.1, 1.1, Run::Up(120.0)), ["-1.0", "-0.5", "0.0", "0.5", "1.0"]);
        assert_eq!(labels(&axis, -42.0, 42.0, Run::Up(80.0)), ["-40", "-20", "0", "20", "40"]);
        assert_eq!(labels(&axis, 0.0, 120.0, Run::Across(300.0)), ["0", "20", "40", "60", "80", "100", "120"]);
        assert_eq!(
            labels(&axis, 1e6, 1.1e6, Run::Across(400.0)),
            ["1.00e6", "1.02e6", "1.04e6", "1.06e6", "1.08e6", "1.10e6"]
        );
    }

    #[test]
    fn a_logarithmic_axis_has_its_ticks_at_decades() {
        let axis = Axis::log("E");
        assert_eq!(labels(&axis, -2.1, 2.1, Run::Up(200.0)), ["0.01", "0.1", "1", "10", "100"]);
        assert_eq!(labels(&axis, -6.5, 0.0, Run::Up(80.0)), ["10⁻⁶", "10⁻⁴", "10⁻²", "10⁰"]);
        assert_eq!(labels(&axis, 0.0, 1.0, Run::Up(200.0)), ["1", "2", "5", "10"]);
        assert!(labels(&axis, 0.35, 0.6, Run::Up(200.0)).len() >= 2, "within a decade");
    }

    #[test]
    fn numbers_without_a_logarithm_have_no_place() {
        let ruler = Ruler::new(&Axis::log("E"), Some(Span { low: -1.0, high: 1.0 }), Run::Up(100.0));
        assert!([0.0, -1.0, f64::NAN].into_iter().all(|value| ruler.place(value).is_nan()));
        assert_eq!(ruler.place(1.0), 0.5);
    }

    #[test]
    fn labels_never_overlap() {
        let names: Vec<(f64, String)> = (0..40).map(|i| (f64::from(i), format!("experiment {i}"))).collect();
        let given = Axis { ticks: names, ..Axis::linear("") };
        let long = Axis::linear("");
        for (axis, low, high) in [(&given, 0.0, 39.0), (&long, 1e5, 1e5 + 1e-3), (&long, -3e-9, 7e300)] {
            for length in [30.0, 110.0, 800.0] {
                let ruler = Ruler::new(axis, Some(Span { low, high }), Run::Across(length));
                let mut free = f64::NEG_INFINITY;
                for tick in ruler.ticks.iter().filter(|tick| !tick.label.is_empty()) {
                    let (middle, half) = (tick.place * length, across(&tick.label) / 2.0);
                    assert!(middle - half > free, "{:?} at {length}", tick.label);
                    free = middle + half;
                }
            }
        }
    }
}
