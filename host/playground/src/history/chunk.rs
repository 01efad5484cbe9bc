//! A stretch of the history: its rows by column, and where the least and the greatest number of each block of rows is.

use crate::channel::{COUNT, Frame};

/// Rows of a block, whose extremes are known without looking at its rows.
pub(super) const BLOCK: usize = 64;
/// Rows of a chunk, whose extremes are known without looking at its blocks; the history forgets chunk by chunk.
pub(super) const CHUNK: usize = 64 * BLOCK;

/// Rows of the least and of the greatest number of a stretch, counted within a chunk; `None` where no number is known.
pub(super) type Extremes = Option<(u16, u16)>;

/// At most [`CHUNK`] rows.
#[derive(Clone, Debug)]
pub(super) struct Chunk {
    /// Time, s, by row.
    pub(super) t: Vec<f64>,
    columns: Vec<Column>,
}

/// The numbers of a channel. It holds nothing until the first number comes: most sessions know half of the channels
/// only.
#[derive(Clone, Debug, Default)]
struct Column {
    /// By row, NaN where unknown.
    numbers: Vec<f32>,
    /// By block.
    blocks: Vec<Extremes>,
    /// Of the whole chunk.
    whole: Extremes,
}

impl Chunk {
    pub(super) fn new() -> Self {
        Chunk { t: Vec::with_capacity(CHUNK), columns: vec![Column::default(); COUNT] }
    }

    pub(super) fn len(&self) -> usize {
        self.t.len()
    }

    pub(super) fn push(&mut self, frame: &Frame) {
        let row = self.t.len();
        self.t.push(frame.t);
        for (column, &number) in self.columns.iter_mut().zip(&frame.values) {
            column.push(row, number);
        }
    }

    pub(super) fn number(&self, channel: usize, row: usize) -> f32 {
        self.columns[channel].number(row)
    }

    /// Where the least and the greatest number of rows `first..end` are.
    pub(super) fn extremes(&self, channel: usize, first: usize, end: usize) -> Extremes {
        let column = &self.columns[channel];
        if column.numbers.is_empty() || (first == 0 && end >= self.len()) {
            return column.whole;
        }
        let mut search = Search::new(&column.numbers);
        let whole = first.next_multiple_of(BLOCK)..end - end % BLOCK;
        if whole.is_empty() {
            search.rows(first, end);
        } else {
            search.rows(first, whole.start);
            for &block in &column.blocks[whole.start / BLOCK..whole.end / BLOCK] {
                search.block(block);
            }
            search.rows(whole.end, end);
        }
        search.found()
    }
}

impl Column {
    fn number(&self, row: usize) -> f32 {
        self.numbers.get(row).copied().unwrap_or(f32::NAN)
    }

    fn push(&mut self, row: usize, number: f32) {
        if self.numbers.is_empty() {
            if !number.is_finite() {
                return;
            }
            self.numbers.reserve_exact(CHUNK);
            self.numbers.resize(row, f32::NAN);
            self.blocks.resize(row / BLOCK, None);
        }
        // What is not finite can neither be drawn nor scale a plot.
        self.numbers.push(if number.is_finite() { number } else { f32::NAN });
        if self.blocks.len() <= row / BLOCK {
            self.blocks.push(None);
        }
        for found in [&mut self.blocks[row / BLOCK], &mut self.whole] {
            let mut search = Search::new(&self.numbers);
            search.block(*found);
            search.rows(row, row + 1);
            *found = search.found();
        }
    }
}

/// A search for the extremes, which keeps the numbers at hand.
struct Search<'a> {
    numbers: &'a [f32],
    least: (f32, usize),
    greatest: (f32, usize),
}

impl<'a> Search<'a> {
    fn new(numbers: &'a [f32]) -> Self {
        Search { numbers, least: (f32::INFINITY, 0), greatest: (f32::NEG_INFINITY, 0) }
    }

    fn rows(&mut self, first: usize, end: usize) {
        for (row, &number) in self.numbers[first..end].iter().enumerate() {
            // NaN is neither.
            if number < self.least.0 {
                self.least = (number, first + row);
            }
            if number > self.greatest.0 {
                self.greatest = (number, first + row);
            }
        }
    }

    fn block(&mut self, block: Extremes) {
        if let Some((least, greatest)) = block {
            self.rows(least.into(), usize::from(least) + 1);
            self.rows(greatest.into(), usize::from(greatest) + 1);
        }
    }

    fn found(self) -> Extremes {
        (self.least.0 <= self.greatest.0).then_some((self.least.1 as u16, self.greatest.1 as u16))
    }
}
