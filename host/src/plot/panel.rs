//! One panel: axes, grid, curves, legend. And the square one with the path on the ground.

use super::canvas::{Anchor, Canvas, Color};
use super::{GREEN, GROUND, LEFT, RIGHT, VERMILLION};

const FRAME: Color = Color(130, 130, 130);
const GRID: Color = Color(228, 228, 228);
const ZERO: Color = Color(170, 170, 170);
const LABEL: Color = Color(60, 60, 60);
const CURVE: f64 = 1.5;
const TICK_SIZE: f64 = 16.0;
const LABEL_SIZE: f64 = 18.0;
/// A logarithmic axis shows this many decades at most; what is smaller lies on its floor.
const DECADES: f64 = 12.0;

/// How numbers become heights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// From the smallest to the largest.
    Linear,
    /// At least -1 to 1, more if the data go beyond.
    Unit,
    /// By powers of ten; zero and below lie on the floor.
    Log,
}

/// One curve.
pub struct Series<'a> {
    /// What the legend says.
    pub label: String,
    /// One number per row; those that are not finite are gaps.
    pub numbers: &'a [f64],
    /// Its colour.
    pub color: Color,
}

/// One panel over time, the full width of the picture.
pub struct Panel<'a> {
    /// What stands beside the axis.
    pub label: String,
    /// How numbers become heights.
    pub scale: Scale,
    /// Upper edge, pixels.
    pub top: f64,
    /// Lower edge, pixels.
    pub bottom: f64,
    /// The curves; the first ones are drawn below the others.
    pub series: Vec<Series<'a>>,
}

/// An interval of an axis, never empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// The low end.
    pub low: f64,
    /// The high end.
    pub high: f64,
}

impl Span {
    /// Around all finite numbers.
    pub fn around<'n>(numbers: impl IntoIterator<Item = &'n f64>) -> Option<Span> {
        let finite = numbers.into_iter().filter(|number| number.is_finite());
        finite.fold(None, |span, &number| {
            Some(span.map_or(Span { low: number, high: number }, |span: Span| Span {
                low: span.low.min(number),
                high: span.high.max(number),
            }))
        })
    }

    /// With room above and below; a single number gets a span around it.
    pub fn padded(self, share: f64) -> Span {
        let room = (self.high - self.low) * share;
        let room = if room > 1e-12 * self.high.abs().max(self.low.abs()) && room > 0.0 {
            room
        } else {
            (self.high.abs() * 0.5).max(0.5)
        };
        Span { low: self.low - room, high: self.high + room }
    }

    /// Where a number lies, 0 at the low end and 1 at the high one.
    pub fn place(self, number: f64) -> f64 {
        (number - self.low) / (self.high - self.low)
    }
}

/// Round numbers within a span, about `count` of them, and how many decimals tell them apart.
pub fn ticks(span: Span, count: f64) -> (Vec<f64>, usize) {
    let raw = (span.high - span.low) / count;
    let power = raw.log10().floor();
    let unit = 10_f64.powf(power);
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().find(|step| step * unit >= raw * 0.999).unwrap_or(10.0) * unit;
    let first = (span.low / step).ceil() as i64;
    let last = (span.high / step).floor() as i64;
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    // A span far from zero and narrower than its numbers' precision has no ticks worth drawing.
    ((first..=last.min(first + 50)).map(|i| i as f64 * step).collect(), decimals)
}

fn tick_label(value: f64, decimals: usize) -> String {
    let value = if value == 0.0 { 0.0 } else { value };
    if value.abs() >= 1e6 || decimals > 5 { format!("{value:.1e}") } else { format!("{value:.decimals$}") }
}

/// A panel's vertical axis: its span, in powers of ten when logarithmic, and its ticks.
struct Axis {
    span: Span,
    log: bool,
    ticks: Vec<(f64, String)>,
}

impl Axis {
    fn new(panel: &Panel) -> Axis {
        let all = || panel.series.iter().flat_map(|series| series.numbers);
        let height = panel.bottom - panel.top;
        if panel.scale == Scale::Log {
            return Axis::logarithmic(Span::around(all().filter(|number| **number > 0.0)), height);
        }
        let data = Span::around(all()).unwrap_or(Span { low: 0.0, high: 0.0 });
        let span = match panel.scale {
            Scale::Unit => Span { low: data.low.min(-1.0), high: data.high.max(1.0) }.padded(0.06),
            _ => data.padded(0.08),
        };
        let (values, decimals) = ticks(span, (height / 27.0).max(3.0));
        let ticks = values.into_iter().map(|value| (value, tick_label(value, decimals))).collect();
        Axis { span, log: false, ticks }
    }

    fn logarithmic(positive: Option<Span>, height: f64) -> Axis {
        let Some(positive) = positive else {
            // Nothing but zeros: they lie on the floor, and that is all the axis can say.
            return Axis { span: Span { low: -0.1, high: 1.1 }, log: true, ticks: vec![(0.0, "0".into())] };
        };
        let high = positive.high.log10().ceil().max(-307.0);
        let low = positive.low.log10().floor().max(high - DECADES).min(high - 1.0);
        let every = ((high - low) / (height / 30.0).max(2.0)).ceil().max(1.0) as i32;
        let decades = (low as i32..=high as i32).filter(|decade| (high as i32 - decade) % every == 0);
        let ticks = decades.map(|decade| (f64::from(decade), format!("1e{decade}"))).collect();
        Axis { span: Span { low: low - 0.1, high: high + 0.1 }, log: true, ticks }
    }

    /// Height of a number in the panel, 0 at the bottom, 1 at the top.
    fn place(&self, number: f64) -> f64 {
        if self.log {
            // log10 of zero is minus infinity, of less NaN: both end up on the floor.
            let floor = self.span.low + 0.1;
            self.span.place(number.log10().max(floor))
        } else {
            self.span.place(number)
        }
    }
}

/// Draws panels that share the time axis below the last one.
pub fn over_time(canvas: &mut dyn Canvas, time: &[f64], panels: &[Panel]) {
    let Some(lowest) = panels.last() else { return };
    let span = Span::around(time).unwrap_or(Span { low: 0.0, high: 1.0 });
    let span = if span.high > span.low { span } else { span.padded(0.0) };
    let (values, decimals) = ticks(span, 12.0);
    let x = |t: f64| LEFT + span.place(t) * (RIGHT - LEFT);
    for panel in panels {
        draw_panel(canvas, panel, time, &values, &x);
    }
    for value in values {
        canvas.text(x(value), lowest.bottom + 18.0, &tick_label(value, decimals), TICK_SIZE, Anchor::Middle, LABEL);
    }
    canvas.text((LEFT + RIGHT) / 2.0, lowest.bottom + 42.0, "time (s)", LABEL_SIZE, Anchor::Middle, LABEL);
}

fn draw_panel(canvas: &mut dyn Canvas, panel: &Panel, time: &[f64], grid: &[f64], x: &dyn Fn(f64) -> f64) {
    let axis = Axis::new(panel);
    let y = |number: f64| panel.bottom - axis.place(number) * (panel.bottom - panel.top);
    let line = |height: f64| panel.bottom - axis.span.place(height) * (panel.bottom - panel.top);
    for &t in grid {
        canvas.polyline(&[(x(t), panel.top), (x(t), panel.bottom)], GRID, 1.0);
    }
    for (value, label) in &axis.ticks {
        let color = if *value == 0.0 && !axis.log { ZERO } else { GRID };
        canvas.polyline(&[(LEFT, line(*value)), (RIGHT, line(*value))], color, 1.0);
        canvas.text(LEFT - 8.0, line(*value), label, TICK_SIZE, Anchor::Right, LABEL);
    }
    frame(canvas, (LEFT, panel.top), (RIGHT, panel.bottom));
    canvas.text(28.0, (panel.top + panel.bottom) / 2.0, &panel.label, LABEL_SIZE, Anchor::Upwards, LABEL);
    for series in &panel.series {
        for curve in curves(time, series.numbers, x) {
            let points: Vec<(f64, f64)> = curve.iter().map(|&(x, number)| (x, y(number))).collect();
            match points[..] {
                [point] => canvas.disc(point, 3.0, series.color),
                _ => canvas.polyline(&points, series.color, CURVE),
            }
        }
    }
    // The first entry is drawn lowest, so the legend lists from the last one.
    let lines = panel.series.len() as f64;
    let spacing = ((panel.bottom - panel.top) / lines).min(28.0);
    let first = (panel.top + panel.bottom) / 2.0 - spacing * (lines - 1.0) / 2.0;
    for (i, series) in panel.series.iter().enumerate() {
        let y = first + spacing * i as f64;
        canvas.polyline(&[(RIGHT + 12.0, y), (RIGHT + 36.0, y)], series.color, 3.0);
        canvas.text(RIGHT + 42.0, y, &series.label, 17.0, Anchor::Left, LABEL);
    }
}

fn frame(canvas: &mut dyn Canvas, (left, top): (f64, f64), (right, bottom): (f64, f64)) {
    canvas.polyline(&[(left, top), (right, top), (right, bottom), (left, bottom), (left, top)], FRAME, 1.0);
}

/// The curves of one series, cut at gaps, as (pixel, number). Where many rows fall into one column of pixels, its first,
/// smallest, largest and last number stand for them, so that no peak is lost.
pub fn curves(time: &[f64], numbers: &[f64], x: &dyn Fn(f64) -> f64) -> Vec<Vec<(f64, f64)>> {
    let mut curves = vec![Vec::new()];
    let mut column: Vec<(f64, f64)> = Vec::new();
    for (&t, &number) in time.iter().zip(numbers) {
        let point = (x(t), number);
        let same = column.first().is_some_and(|first: &(f64, f64)| first.0.floor() == point.0.floor());
        if !same || !number.is_finite() {
            take_extremes(&mut column, curves.last_mut());
        }
        if number.is_finite() {
            column.push(point);
        } else if curves.last().is_some_and(|curve| !curve.is_empty()) {
            curves.push(Vec::new());
        }
    }
    take_extremes(&mut column, curves.last_mut());
    curves.retain(|curve| !curve.is_empty());
    curves
}

fn take_extremes(column: &mut Vec<(f64, f64)>, curve: Option<&mut Vec<(f64, f64)>>) {
    let by_number = |&(_, a): &(usize, f64), &(_, b): &(usize, f64)| a.total_cmp(&b);
    let numbers = || column.iter().map(|point| point.1).enumerate();
    let (Some((low, _)), Some((high, _))) = (numbers().min_by(by_number), numbers().max_by(by_number)) else { return };
    let mut keep = vec![0, low, high, column.len() - 1];
    keep.sort_unstable();
    keep.dedup();
    if let Some(curve) = curve {
        curve.extend(keep.into_iter().map(|i| column[i]));
    }
    column.clear();
}

/// Draws the path on the ground into a square with equal axes, its upper edge at `top`.
pub fn ground(canvas: &mut dyn Canvas, px: &[f64], py: &[f64], top: f64) {
    let (left, right, bottom) = (LEFT, LEFT + GROUND, top + GROUND);
    let whole = |numbers| Span::around(numbers).unwrap_or(Span { low: 0.0, high: 0.0 });
    let (x, y) = (whole(px), whole(py));
    // Equal axes: both spans are the larger one, around the path's middle.
    let half = ((x.high - x.low).max(y.high - y.low) * 0.55).max(0.1);
    let around = |span: Span| {
        let middle = (span.low + span.high) / 2.0;
        Span { low: middle - half, high: middle + half }
    };
    let (x, y) = (around(x), around(y));
    let at = |px: f64, py: f64| (left + x.place(px) * GROUND, bottom - y.place(py) * GROUND);

    let (values, decimals) = ticks(x, 6.0);
    for value in values {
        let (tick, _) = at(value, y.low);
        canvas.polyline(&[(tick, top), (tick, bottom)], GRID, 1.0);
        canvas.text(tick, bottom + 18.0, &tick_label(value, decimals), TICK_SIZE, Anchor::Middle, LABEL);
    }
    let (values, decimals) = ticks(y, 6.0);
    for value in values {
        let (_, tick) = at(x.low, value);
        canvas.polyline(&[(left, tick), (right, tick)], GRID, 1.0);
        canvas.text(left - 8.0, tick, &tick_label(value, decimals), TICK_SIZE, Anchor::Right, LABEL);
    }
    frame(canvas, (left, top), (right, bottom));
    canvas.text((left + right) / 2.0, bottom + 42.0, "px (m)", LABEL_SIZE, Anchor::Middle, LABEL);
    canvas.text(28.0, (top + bottom) / 2.0, "path on the ground: py (m)", LABEL_SIZE, Anchor::Upwards, LABEL);

    let mut path: Vec<(f64, f64)> = Vec::new();
    for (&px, &py) in px.iter().zip(py).filter(|(px, py)| px.is_finite() && py.is_finite()) {
        let point = at(px, py);
        // Rows that fall on one spot are one point.
        if path.last().is_none_or(|last| (last.0 - point.0).hypot(last.1 - point.1) > 0.4) {
            path.push(point);
        }
    }
    canvas.polyline(&path, super::BLUE, 2.0);
    let mark = right + 24.0;
    let end = px.iter().zip(py).rev().find(|(px, py)| px.is_finite() && py.is_finite());
    if let (Some(&start), Some((&end_x, &end_y))) = (path.first(), end) {
        canvas.disc(start, 8.0, GREEN);
        square(canvas, at(end_x, end_y), VERMILLION);
    }
    canvas.disc((mark, top + 28.0), 8.0, GREEN);
    canvas.text(mark + 18.0, top + 28.0, "start", 17.0, Anchor::Left, LABEL);
    square(canvas, (mark, top + 58.0), VERMILLION);
    canvas.text(mark + 18.0, top + 58.0, "end", 17.0, Anchor::Left, LABEL);
}

fn square(canvas: &mut dyn Canvas, (x, y): (f64, f64), color: Color) {
    canvas.rectangle((x - 6.0, y - 6.0), (x + 6.0, y + 6.0), color);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimation_keeps_every_peak() {
        let time: Vec<f64> = (0..100_000).map(f64::from).collect();
        let mut numbers = vec![0.0; time.len()];
        numbers[12_345] = 7.0;
        numbers[67_890] = -3.0;
        let curves = curves(&time, &numbers, &|t| t / 100.0);
        assert_eq!(curves.len(), 1);
        assert!(curves[0].len() <= 4 * 1000, "{} points", curves[0].len());
        for peak in [7.0, -3.0] {
            assert!(curves[0].iter().any(|point| point.1 == peak), "{peak} is lost");
        }
    }

    #[test]
    fn gaps_cut_a_curve() {
        let curves = curves(&[0.0, 1.0, 2.0, 3.0], &[1.0, f64::NAN, f64::NAN, 2.0], &|t| t);
        assert_eq!(curves, [vec![(0.0, 1.0)], vec![(3.0, 2.0)]]);
    }

    #[test]
    fn ticks_are_round_numbers_within_the_span() {
        assert_eq!(ticks(Span { low: -1.1, high: 1.1 }, 4.0), (vec![-1.0, 0.0, 1.0], 0));
        let (values, decimals) = ticks(Span { low: 0.0, high: 0.05 }, 5.0);
        assert_eq!((values.len(), decimals), (6, 2));
        // Hopeless spans give few ticks, not an endless loop.
        assert!(ticks(Span { low: 1e300, high: 1.1e300 }, 5.0).0.len() <= 51);
        assert!(ticks(Span { low: 1.0, high: 1.0 + 1e-15 }, 5.0).0.len() <= 51);
    }
}
