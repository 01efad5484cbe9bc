//! Which stretch of time is in sight: the same for every plot.

use serde::{Deserialize, Serialize};

/// The shortest window, s: five control steps.
pub(super) const SHORTEST: f64 = 0.1;
/// The longest window that can be set, s; all there is may be longer.
pub(super) const LONGEST: f64 = 7200.0;
/// What the menu offers, s; `None` is all there is.
pub(super) const PRESETS: [(&str, Option<f64>); 9] = [
    ("5 s", Some(5.0)),
    ("10 s", Some(10.0)),
    ("30 s", Some(30.0)),
    ("1 min", Some(60.0)),
    ("2 min", Some(120.0)),
    ("5 min", Some(300.0)),
    ("10 min", Some(600.0)),
    ("1 h", Some(3600.0)),
    ("all", None),
];

/// The window of time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct View {
    /// Length while it follows the newest row, s; `None` for all there is.
    length: Option<f64>,
    /// Where it stands still, s.
    #[serde(skip)]
    still: Option<[f64; 2]>,
}

impl Default for View {
    fn default() -> Self {
        View { length: Some(30.0), still: None }
    }
}

impl View {
    /// From when to when, s; `span` is that of the history.
    pub(super) fn window(&self, span: Option<(f64, f64)>) -> [f64; 2] {
        let (oldest, newest) = span.unwrap_or_default();
        match (self.still, self.length) {
            (Some(still), _) => still,
            (None, None) => [oldest, newest.max(oldest + SHORTEST)],
            (None, Some(length)) => {
                // A young session fills the window from the left.
                let length = if length.is_finite() { length.clamp(SHORTEST, LONGEST) } else { LONGEST };
                let end = newest.max(oldest + length);
                [end - length, end]
            }
        }
    }

    pub(super) fn follows(&self) -> bool {
        self.still.is_none()
    }

    pub(super) fn follow(&mut self) {
        self.still = None;
    }

    pub(super) fn length(&self) -> Option<f64> {
        self.length
    }

    /// Sets the length; a window that stands still keeps its middle.
    pub(super) fn set_length(&mut self, length: Option<f64>) {
        self.length = length;
        match (&mut self.still, length) {
            (Some([from, to]), Some(length)) => {
                let middle = (*from + *to) / 2.0;
                [*from, *to] = [middle - length / 2.0, middle + length / 2.0];
            }
            (still, None) => *still = None,
            (None, Some(_)) => {}
        }
    }

    /// Stands still there.
    pub(super) fn hold(&mut self, [from, to]: [f64; 2]) {
        let middle = (from + to) / 2.0;
        let half = (to - from).abs().max(SHORTEST) / 2.0;
        self.still = Some([middle - half, middle + half]);
    }

    /// Shifts what is in sight by a time, s.
    pub(super) fn pan(&mut self, span: Option<(f64, f64)>, by: f64) {
        let [from, to] = self.window(span);
        self.hold([from + by, to + by]);
    }

    /// Shows `factor` times less: around `at` where it stands still, up to the newest row where it follows.
    pub(super) fn zoom(&mut self, span: Option<(f64, f64)>, factor: f64, at: f64) {
        let [from, to] = self.window(span);
        let factor = factor.clamp((to - from) / LONGEST.max(to - from), (to - from) / SHORTEST);
        if self.follows() {
            self.length = Some((to - from) / factor);
        } else {
            self.hold([at - (at - from) / factor, at + (to - at) / factor]);
        }
    }

    /// Brings `t` into sight, if it is not, and stands still there.
    pub(super) fn keep_in_sight(&mut self, span: Option<(f64, f64)>, t: f64) {
        let [from, to] = self.window(span);
        let length = to - from;
        if t < from {
            self.hold([t - 0.1 * length, t + 0.9 * length]);
        } else if t > to {
            self.hold([t - 0.9 * length, t + 0.1 * length]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPAN: Option<(f64, f64)> = Some((5.0, 100.0));

    fn of(length: Option<f64>) -> View {
        View { length, still: None }
    }

    #[test]
    fn it_follows_the_newest_row_and_a_young_session_fills_it_from_the_left() {
        assert_eq!(of(Some(30.0)).window(SPAN), [70.0, 100.0]);
        assert_eq!(of(Some(30.0)).window(Some((5.0, 7.0))), [5.0, 35.0]);
        assert_eq!(of(None).window(SPAN), [5.0, 100.0]);
        assert_eq!(of(None).window(None), [0.0, SHORTEST]);
    }

    #[test]
    fn zooming_keeps_the_time_under_the_pointer_where_it_stands_still_and_the_newest_where_it_follows() {
        let mut view = of(Some(20.0));
        view.zoom(SPAN, 2.0, 85.0);
        assert_eq!((view.window(SPAN), view.follows()), ([90.0, 100.0], true));
        view.hold([10.0, 20.0]);
        view.zoom(SPAN, 2.0, 12.0);
        assert_eq!(view.window(SPAN), [11.0, 16.0]);
        view.zoom(SPAN, 1e9, 12.0);
        let [from, to] = view.window(SPAN);
        assert!((to - from - SHORTEST).abs() < 1e-9);
        view.follow();
        assert_eq!(view.window(SPAN), [90.0, 100.0]);
    }

    #[test]
    fn panning_stops_following_and_goes_on_from_where_it_was() {
        let mut view = of(Some(20.0));
        view.pan(SPAN, -5.0);
        view.pan(SPAN, -5.0);
        assert_eq!((view.window(SPAN), view.follows()), ([70.0, 90.0], false));
    }

    #[test]
    fn a_cursor_that_leaves_the_window_takes_it_along() {
        let mut view = of(Some(20.0));
        view.keep_in_sight(SPAN, 90.0);
        assert_eq!((view.window(SPAN), view.follows()), ([80.0, 100.0], true));
        view.keep_in_sight(SPAN, 50.0);
        assert_eq!((view.window(SPAN), view.follows()), ([48.0, 68.0], false));
        view.keep_in_sight(SPAN, 70.0);
        assert_eq!(view.window(SPAN), [52.0, 72.0]);
    }

    #[test]
    fn a_length_from_a_broken_file_makes_no_broken_window() {
        for length in [f64::NAN, f64::INFINITY, -3.0, 0.0] {
            let [from, to] = of(Some(length)).window(SPAN);
            assert!(from.is_finite() && to - from >= SHORTEST / 2.0, "{length}");
        }
    }
}
