use super::*;

/// A control step, s.
const STEP: f64 = 0.02;

fn history(rows: usize, x1: impl Fn(usize) -> f32) -> History {
    let mut history = History::new(UNLIMITED);
    for row in 0..rows {
        let mut frame = Frame::at(row as f64 * STEP);
        frame.set(Id::X1, x1(row));
        history.push(&frame);
    }
    history
}

/// Something that is nowhere constant and has no period.
fn curve(row: usize) -> f32 {
    (row as f32 * 0.1).sin() + (row as f32 * 0.0173).cos()
}

#[test]
fn a_window_with_fewer_rows_than_pixels_is_the_rows() {
    let history = history(1000, curve);
    let points = history.window(Id::X1, 2.0, 4.0, 400);
    let rows: Vec<[f64; 2]> = (99..=201).map(|row| [row as f64 * STEP, f64::from(curve(row))]).collect();
    assert_eq!(points, rows);
}

#[test]
fn a_window_has_two_points_for_a_pixel_at_most_and_its_time_never_goes_back() {
    let history = history(50_000, curve);
    for (t0, t1) in [(0.0, 1000.0), (3.3, 77.7), (400.0, 500.0), (-50.0, 2000.0)] {
        let points = history.window(Id::X1, t0, t1, 300);
        assert!((150..=2 * 301 + 2).contains(&points.len()), "{}", points.len());
        assert!(points.is_sorted_by(|a, b| a[0] <= b[0]));
    }
}

#[test]
fn a_single_spike_is_seen_in_every_window_that_holds_it() {
    for spike in [0, 63, 64, 4095, 4096, 12_345, 29_999] {
        let history = history(30_000, |row| if row == spike { 7.0 } else { 0.0 });
        for pixels in [1, 10, 333, 1000] {
            let points = history.window(Id::X1, 0.0, 600.0, pixels);
            assert!(points.contains(&[spike as f64 * STEP, 7.0]), "row {spike}, {pixels} pixels");
        }
    }
}

#[test]
fn a_curve_keeps_its_points_while_the_window_moves_over_it() {
    let history = history(30_000, curve);
    let inner = |t0: f64| -> Vec<[f64; 2]> {
        let mut points = history.window(Id::X1, t0, t0 + 200.0, 500);
        points.retain(|[t, _]| (320.0..380.0).contains(t));
        points
    };
    assert_eq!(inner(200.0), inner(201.26));
    assert!(inner(200.0).len() > 100);
}

#[test]
fn extremes_are_those_of_the_rows() {
    let history = history(20_000, curve);
    for (first, last) in [(0, 19_999), (5, 5), (60, 70), (100, 9000), (4095, 4097), (8192, 12_287)] {
        let rows = (first..=last).map(curve);
        let expected = rows.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        // Half a step of room on either side, so that rounding decides nothing.
        let (t0, t1) = ((first as f64 - 0.5) * STEP, (last as f64 + 0.5) * STEP);
        assert_eq!(history.extremes(Id::X1, t0, t1), Some(expected), "{first} to {last}");
    }
    assert_eq!(history.extremes(Id::X1, 500.0, 900.0), None);
    assert_eq!(history.extremes(Id::X2, 0.0, 400.0), None);
}

#[test]
fn what_is_unknown_leaves_a_gap_at_every_scale() {
    let gap = 1000..9000;
    let history = history(20_000, |row| if gap.contains(&row) { f32::NAN } else { 1.0 });
    for pixels in [2, 200, 30_000] {
        let points = history.window(Id::X1, 0.0, 400.0, pixels);
        let unknown: Vec<f64> = points.iter().filter(|[_, x]| x.is_nan()).map(|[t, _]| *t).collect();
        // At two pixels a stretch is a chunk of 4096 rows, and one of them is all unknown.
        assert_eq!(unknown.len(), 1, "{pixels} pixels");
        assert!((20.0..180.0).contains(&unknown[0]));
    }
    assert_eq!(history.extremes(Id::X1, 30.0, 100.0), None);
}

#[test]
fn a_channel_that_becomes_known_late_is_in_the_right_rows() {
    let history = history(6000, |row| if row < 5000 { f32::NAN } else { row as f32 });
    assert_eq!(history.frame(5000).map(|frame| frame.get(Id::X1)), Some(5000.0));
    assert!(history.frame(4999).is_some_and(|frame| frame.get(Id::X1).is_nan()));
    assert_eq!(history.extremes(Id::X1, 0.0, 1000.0), Some((5000.0, 5999.0)));
    assert_eq!(history.window(Id::X1, 0.0, 1000.0, 10_000).first(), Some(&[5000.0 * STEP, 5000.0]));
}

#[test]
fn infinity_counts_as_unknown() {
    let history = history(300, |row| if row % 3 == 0 { f32::INFINITY } else { 2.0 });
    assert_eq!(history.extremes(Id::X1, 0.0, 10.0), Some((2.0, 2.0)));
    assert!(history.window(Id::X1, 0.0, 6.0, 1000).iter().all(|[_, x]| x.is_nan() || *x == 2.0));
}

#[test]
fn an_empty_history_answers_with_nothing() {
    let history = History::default();
    assert_eq!((history.len(), history.span(), history.at_or_before(1.0), history.frame(0)), (0, None, None, None));
    assert!(history.window(Id::X1, 0.0, 10.0, 100).is_empty());
    assert_eq!(history.extremes(Id::X1, 0.0, 10.0), None);
    assert!(history.frame_at(None).is_none() && history.number_at(Id::X1, None).is_nan());
    assert!(!history.knows(Id::X1));
}

#[test]
fn a_single_row_is_a_point() {
    let history = history(1, |_| 3.0);
    assert_eq!(history.span(), Some((0.0, 0.0)));
    assert_eq!(history.window(Id::X1, -1.0, 1.0, 100), [[0.0, 3.0]]);
    assert_eq!((history.at_or_before(-0.1), history.at_or_before(5.0)), (None, Some(0)));
    assert!(history.knows(Id::X1) && !history.knows(Id::X2));
}

#[test]
fn the_oldest_rows_are_dropped_and_at_least_the_limit_is_kept() {
    let mut history = History::new(10_000);
    for row in 0..50_000 {
        history.push(&Frame::at(f64::from(row)));
        assert!(history.len() >= 10_000.min(row as usize + 1) && history.len() < 10_000 + CHUNK);
    }
    assert_eq!(history.span().map(|(_, last)| last), Some(49_999.0));
    assert_eq!(history.frame(history.len() - 1).map(|frame| frame.t), Some(49_999.0));
    assert_eq!(history.at_or_before(45_000.5).and_then(|row| history.frame(row)).map(|frame| frame.t), Some(45_000.0));
    history.clear();
    assert!(history.is_empty() && !history.knows(Id::X1));
}
