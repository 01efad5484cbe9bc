//! The vertical scale of a plot.

use crate::channel::Id;
use crate::history::History;
use egui_plot::GridMark;
use serde::{Deserialize, Serialize};

/// How numbers become heights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) enum Scale {
    /// What is in sight fills the plot.
    #[default]
    Auto,
    /// The same, of the logarithm; what is not positive is not shown.
    Log,
    /// From one number to another.
    Fixed {
        /// The lower edge.
        min: f64,
        /// The upper edge.
        max: f64,
    },
}

/// How far the logarithmic scale goes down below the greatest number if the least is 0: six decades.
const DECADES: f64 = 6.0;
/// Time in which a scale that is too wide shrinks to a third of the way, s.
const SHRINK: f64 = 0.25;
/// The least distance of two labels, points.
const LABELS: f64 = 17.0;
/// More lines than this tell no more.
const LINES: f64 = 9.0;
/// Room above and below the curves.
const ROOM: f64 = 0.06;

impl Scale {
    /// Height of a number on the scale; NaN where it has none.
    pub(super) fn height(self, number: f64) -> f64 {
        match self {
            Scale::Log if number > 0.0 => number.log10(),
            Scale::Log => f64::NAN,
            Scale::Auto | Scale::Fixed { .. } => number,
        }
    }

    /// Lower and upper edge, heights, for channels in a window of time, s.
    pub(super) fn edges(self, history: &History, channels: &[Id], [from, to]: [f64; 2]) -> [f64; 2] {
        if let Scale::Fixed { min, max } = self
            && min < max
            && (max - min).is_finite()
        {
            return [min, max];
        }
        let extremes = channels.iter().filter_map(|&channel| history.extremes(channel, from, to));
        let all = extremes.reduce(|(low, high), (least, greatest)| (low.min(least), high.max(greatest)));
        let (low, high) = all.map_or((0.0, 1.0), |(low, high)| (f64::from(low), f64::from(high)));
        let [low, high] = match self {
            Scale::Log if high <= 0.0 => [-DECADES, 0.0],
            Scale::Log => [if low > 0.0 { low.log10() } else { high.log10() - DECADES }, high.log10()],
            Scale::Auto | Scale::Fixed { .. } => [low, high],
        };
        // A constant is drawn in the middle; rounding of f32 is not blown up to fill the plot.
        let least = if low == 0.0 && high == 0.0 { 1.0 } else { 1e-5 * low.abs().max(high.abs()) };
        let room = (ROOM * (high - low)).max(least);
        [low - room, high + room]
    }
}

/// The edges on their way from `shown` to `target` after `dt`, s, and whether they are still on it: they grow at
/// once, so that nothing is cut off, and shrink slowly, so that they do not follow every wave.
pub(super) fn approach(shown: [f64; 2], target: [f64; 2], dt: f64) -> ([f64; 2], bool) {
    let part = 1.0 - (-dt / SHRINK).exp();
    let near = 0.01 * (target[1] - target[0]);
    let low = shown[0] + part * (target[0] - shown[0]);
    let high = shown[1] + part * (target[1] - shown[1]);
    let edges = [
        if target[0] <= shown[0] || target[0] - low < near { target[0] } else { low },
        if target[1] >= shown[1] || high - target[1] < near { target[1] } else { high },
    ];
    (edges, edges != target)
}

/// The least step of 1, 2 or 5 times a power of ten that is not below `least`.
pub(super) fn round_step(least: f64) -> f64 {
    let decade = 10_f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0].map(|step| step * decade).into_iter().find(|&step| step >= least).unwrap_or(10.0 * decade)
}

/// The multiples of a step within a range, as lines of a grid; none if they would be a grey area.
pub(super) fn multiples(step: f64, [from, to]: [f64; 2]) -> Vec<GridMark> {
    let (first, last) = ((from / step).ceil() as i64, (to / step).floor() as i64);
    let few = step > 0.0 && last.saturating_sub(first) < 1000;
    let numbers = few.then_some(first..=last).into_iter().flatten();
    numbers.map(|n| GridMark { value: n as f64 * step, step_size: step }).collect()
}

impl Scale {
    /// Horizontal lines of the grid between two edges that are so many points apart.
    pub(super) fn marks(self, edges: [f64; 2], points: f32) -> Vec<GridMark> {
        let apart = (LABELS / f64::from(points.max(1.0))).max(1.0 / LINES);
        let step = round_step((edges[1] - edges[0]) * apart);
        // Between two powers of ten there is no label.
        multiples(if self == Scale::Log { step.max(1.0).round() } else { step }, edges)
    }

    /// What stands beside one of them.
    pub(super) fn label(self, mark: GridMark) -> String {
        if self == Scale::Log { format!("1e{:.0}", mark.value) } else { axis_label(mark.value, mark.step_size) }
    }
}

/// A number beside the axis, with the decimals that a step of the grid needs.
fn axis_label(number: f64, step: f64) -> String {
    let magnitude = number.abs().max(step.abs());
    if magnitude >= 1e5 || step.abs() < 1e-4 {
        return if number == 0.0 { "0".into() } else { format!("{number:.1e}") };
    }
    let decimals = (-step.abs().log10()).ceil().clamp(0.0, 4.0) as usize;
    // −0.0 is nobody's number.
    format!("{:.decimals$}", if number.abs() < step.abs() * 1e-6 { 0.0 } else { number })
}

/// A value in a legend: four digits that count.
pub(super) fn value(number: f32) -> String {
    let magnitude = number.abs();
    if !number.is_finite() {
        "–".into()
    } else if magnitude != 0.0 && !(5e-4..1e5).contains(&magnitude) {
        format!("{number:.1e}")
    } else {
        let decimals = if magnitude < 10.0 {
            3
        } else if magnitude < 100.0 {
            2
        } else {
            usize::from(magnitude < 1000.0)
        };
        format!("{number:.decimals$}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::channel::Frame;

    fn history(numbers: &[f32]) -> History {
        let mut history = History::default();
        for (row, &number) in numbers.iter().enumerate() {
            let mut frame = Frame::at(row as f64);
            frame.set(Id::E, number);
            history.push(&frame);
        }
        history
    }

    fn edges(scale: Scale, numbers: &[f32]) -> [f64; 2] {
        scale.edges(&history(numbers), &[Id::E], [0.0, 100.0])
    }

    #[test]
    fn every_scale_is_a_proper_range_that_holds_its_numbers() {
        for numbers in [&[][..], &[0.0], &[5.0, 5.0], &[-1e-9, 1e-9], &[1e30, -1e30], &[f32::NAN], &[3.0, 3.000_000_2]]
        {
            for scale in [Scale::Auto, Scale::Fixed { min: 1.0, max: 1.0 }, Scale::Fixed { min: 0.0, max: f64::NAN }] {
                let [low, high] = edges(scale, numbers);
                assert!(low < high && (high - low).is_finite(), "{scale:?} {numbers:?}");
                assert!(numbers.iter().all(|&x| x.is_nan() || (low..=high).contains(&f64::from(x))), "{numbers:?}");
            }
        }
        assert_eq!(edges(Scale::Fixed { min: -2.0, max: 3.0 }, &[10.0]), [-2.0, 3.0]);
    }

    #[test]
    fn the_logarithmic_scale_holds_what_is_positive() {
        let [low, high] = edges(Scale::Log, &[1e-4, 10.0]);
        assert!(low < -4.0 && high > 1.0 && low > -5.0 && high < 2.0);
        let [low, high] = edges(Scale::Log, &[0.0, 100.0]);
        assert!(low < -4.0 && high > 2.0);
        let [low, high] = edges(Scale::Log, &[0.0]);
        assert!(low < high);
        assert!(Scale::Log.height(0.0).is_nan() && Scale::Log.height(-1.0).is_nan());
    }

    #[test]
    fn a_scale_grows_at_once_and_shrinks_until_it_is_there() {
        assert_eq!(approach([0.0, 1.0], [-2.0, 3.0], 0.02), ([-2.0, 3.0], false));
        let (mut edges, mut moving) = approach([-10.0, 10.0], [0.0, 1.0], 0.02);
        assert!(moving && edges[0] > -10.0 && edges[0] < -8.0);
        let mut frames = 0;
        while moving {
            (edges, moving) = approach(edges, [0.0, 1.0], 0.02);
            frames += 1;
        }
        assert_eq!(edges, [0.0, 1.0]);
        assert!(frames < 150, "{frames}");
    }

    #[test]
    fn every_scale_has_labels_and_they_do_not_touch() {
        for edges in [[-1.1, 1.1], [0.0, 1e-7], [-3e30, 1e30], [999.0, 1000.0]] {
            for points in [50.0, 90.0, 400.0] {
                let marks = Scale::Auto.marks(edges, points);
                assert!(marks.len() >= 2 || points < 60.0 && !marks.is_empty(), "{edges:?} on {points}: {marks:?}");
                assert!(marks.len() as f32 <= points / 17.0 + 1.0, "{edges:?} on {points}");
            }
        }
        assert_eq!(
            Scale::Log.marks([-5.4, 0.3], 90.0).iter().map(|m| Scale::Log.label(*m)).collect::<Vec<_>>(),
            ["1e-4", "1e-2", "1e0"]
        );
    }

    #[test]
    fn labels_are_short_and_tell_neighbours_apart() {
        assert_eq!(axis_label(0.25, 0.05), "0.25");
        assert_eq!(axis_label(-1e-17, 0.5), "0.0");
        assert_eq!(axis_label(30.0, 10.0), "30");
        for number in [0.0, -123_456.79, 1e-12, -3.4e38, 99_999.0, f32::MIN_POSITIVE, f32::NAN, -0.000_499] {
            assert!(value(number).chars().count() <= 8, "{}", value(number));
        }
        assert_eq!((value(0.123_44), value(-12.375), value(f32::NAN)), ("0.123".into(), "-12.38".into(), "–".into()));
    }
}
