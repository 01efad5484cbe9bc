//! The history: the rows of a session or a recording, kept so that any stretch of time is drawn in a time that
//! depends on its pixels and not on its rows.
//!
//! Rows are stored by column in chunks of 4096, each with the extremes of its blocks of 64 rows and of the whole. A
//! window of time is cut into stretches of 2ᵏ rows, counted from the chunk's first and not from the window's, so that
//! a curve that moves through the window keeps its shape.

mod chunk;

use crate::channel::{COUNT, Frame, Id};
use chunk::{CHUNK, Chunk};
use std::collections::VecDeque;

/// Rows that a live session keeps: two hours of control steps.
pub const LIVE: usize = 360_000;
/// For recordings, which are kept whole.
pub const UNLIMITED: usize = usize::MAX;

/// The rows so far, in the order of time.
#[derive(Clone, Debug)]
pub struct History {
    /// Full, but for the last; none is empty.
    chunks: VecDeque<Chunk>,
    limit: usize,
    known: [bool; COUNT],
}

impl Default for History {
    fn default() -> Self {
        History::new(LIVE)
    }
}

impl History {
    /// Keeps at least the newest `limit` rows; older ones are dropped 4096 at a time.
    pub fn new(limit: usize) -> Self {
        History { chunks: VecDeque::new(), limit, known: [false; COUNT] }
    }

    /// Forgets everything: another session begins, whose time begins anew.
    pub fn clear(&mut self) {
        *self = History::new(self.limit);
    }

    /// Takes a row; a number of it that is not finite counts as unknown. A row whose time is not a number or before
    /// the last row's is not taken: a time that goes back is another session, and [`History::clear`] its owner's
    /// matter.
    pub fn push(&mut self, frame: &Frame) {
        if !frame.t.is_finite() || self.span().is_some_and(|(_, newest)| frame.t < newest) {
            return;
        }
        if self.chunks.back().is_none_or(|chunk| chunk.len() == CHUNK) {
            self.chunks.push_back(Chunk::new());
        }
        if let Some(chunk) = self.chunks.back_mut() {
            chunk.push(frame);
        }
        for (known, number) in self.known.iter_mut().zip(&frame.values) {
            *known |= number.is_finite();
        }
        if self.len() - CHUNK.min(self.len()) >= self.limit.max(1) {
            self.chunks.pop_front();
        }
    }

    /// Takes rows.
    pub fn extend(&mut self, frames: &[Frame]) {
        for frame in frames {
            self.push(frame);
        }
    }

    /// How many rows there are.
    pub fn len(&self) -> usize {
        self.chunks.back().map_or(0, |last| (self.chunks.len() - 1) * CHUNK + last.len())
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.chunks.is_empty()
    }

    /// Times of the oldest and of the newest row, s.
    pub fn span(&self) -> Option<(f64, f64)> {
        Some((*self.chunks.front()?.t.first()?, *self.chunks.back()?.t.last()?))
    }

    /// The newest row that is not after `t`, s, counted from the oldest row that is kept.
    pub fn at_or_before(&self, t: f64) -> Option<usize> {
        self.rows_until(t).checked_sub(1)
    }

    /// A row, counted from the oldest that is kept.
    pub fn frame(&self, row: usize) -> Option<Frame> {
        let chunk = self.chunks.get(row / CHUNK)?;
        let t = *chunk.t.get(row % CHUNK)?;
        Some(Frame { t, values: std::array::from_fn(|channel| chunk.number(channel, row % CHUNK)) })
    }

    /// The newest row that is not after `t`, s; the newest of all for `None`.
    pub fn frame_at(&self, t: Option<f64>) -> Option<Frame> {
        let row = t.map_or(self.len().checked_sub(1), |t| self.at_or_before(t));
        row.and_then(|row| self.frame(row))
    }

    /// A number at a time, as [`History::frame_at`] has it; NaN where there is none.
    pub fn number_at(&self, channel: Id, t: Option<f64>) -> f32 {
        let row = t.map_or(self.len().checked_sub(1), |t| self.at_or_before(t));
        row.map_or(f32::NAN, |row| self.chunks[row / CHUNK].number(channel as usize, row % CHUNK))
    }

    /// Whether the channel ever had a number.
    pub fn knows(&self, channel: Id) -> bool {
        self.known[channel as usize]
    }

    /// The curve of a channel from `t0` to `t1`, s, for so many pixels: points [t, number] in the order of time, and
    /// one row more on either side, so that the curve reaches the edges. If no more rows than pixels are in sight,
    /// every row is a point; else at most two for each pixel, the least and the greatest number of a stretch. A gap
    /// is a point with NaN.
    pub fn window(&self, channel: Id, t0: f64, t1: f64, pixels: usize) -> Vec<[f64; 2]> {
        let first = self.rows_before(t0).saturating_sub(1);
        let end = (self.rows_until(t1) + 1).min(self.len());
        let rows = end.saturating_sub(first);
        let mut points = Points::default();
        if !self.knows(channel) || rows == 0 {
            return points.0;
        }
        let stretch = if rows <= pixels + 2 { 1 } else { rows.div_ceil(pixels.max(1)).next_power_of_two().min(CHUNK) };
        let mut row = first;
        while row < end {
            let next = (row - row % stretch + stretch).min(end);
            let chunk = &self.chunks[row / CHUNK];
            let (from, to) = (row % CHUNK, row % CHUNK + next - row);
            let point = |row: u16| [chunk.t[usize::from(row)], f64::from(chunk.number(channel as usize, row.into()))];
            match chunk.extremes(channel as usize, from, to) {
                None => points.gap(chunk.t[from]),
                Some((least, greatest)) if least == greatest => points.0.push(point(least)),
                Some((least, greatest)) => {
                    points.0.extend([point(least.min(greatest)), point(least.max(greatest))]);
                }
            }
            row = next;
        }
        points.0
    }

    /// The least and the greatest number of a channel from `t0` to `t1`, s.
    pub fn extremes(&self, channel: Id, t0: f64, t1: f64) -> Option<(f32, f32)> {
        let (mut row, end) = (self.rows_before(t0), self.rows_until(t1));
        let mut found: Option<(f32, f32)> = None;
        while self.knows(channel) && row < end {
            let next = (row - row % CHUNK + CHUNK).min(end);
            let chunk = &self.chunks[row / CHUNK];
            if let Some(rows) = chunk.extremes(channel as usize, row % CHUNK, row % CHUNK + next - row) {
                let (least, greatest) =
                    (chunk.number(channel as usize, rows.0.into()), chunk.number(channel as usize, rows.1.into()));
                found = Some(found.map_or((least, greatest), |(low, high)| (low.min(least), high.max(greatest))));
            }
            row = next;
        }
        found
    }

    /// How many rows are before `t`.
    fn rows_before(&self, t: f64) -> usize {
        self.rows_while(|time| time < t)
    }

    /// How many rows are not after `t`.
    fn rows_until(&self, t: f64) -> usize {
        self.rows_while(|time| time <= t)
    }

    fn rows_while(&self, early: impl Fn(f64) -> bool) -> usize {
        let chunks = self.chunks.partition_point(|chunk| chunk.t.last().is_some_and(|&t| early(t)));
        let rows = self.chunks.get(chunks).map_or(0, |chunk| chunk.t.partition_point(|&t| early(t)));
        (chunks * CHUNK + rows).min(self.len())
    }
}

#[derive(Default)]
struct Points(Vec<[f64; 2]>);

impl Points {
    /// One point for a gap, however long, and none before the first number.
    fn gap(&mut self, t: f64) {
        if self.0.last().is_some_and(|[_, number]| !number.is_nan()) {
            self.0.push([t, f64::NAN]);
        }
    }
}

#[cfg(test)]
mod tests;
