//! Time of the plots: one frame of 30 channels in six plots over ten minutes, as it is built and as it becomes
//! triangles, and the curve of one channel alone. `cargo bench -p barrel-playground --bench plots`.

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use eframe::egui::{Context, Pos2, RawInput, Rect, vec2};
use playground::channel::{Frame, Id};
use playground::history::{History, UNLIMITED};
use playground::plots::{self, Plots};
use std::hint::black_box;

/// Rows of ten minutes of control steps.
const ROWS: usize = 30_000;

fn frame(row: usize) -> Frame {
    let mut frame = Frame::at(row as f64 * 0.02);
    for (channel, value) in frame.values.iter_mut().enumerate() {
        *value = (row as f32 * 0.01 * (1.0 + channel as f32 * 0.37)).sin() * (1.0 + channel as f32);
    }
    frame
}

fn history(rows: usize) -> History {
    let mut history = History::new(UNLIMITED);
    (0..rows).for_each(|row| history.push(&frame(row)));
    history
}

fn window(c: &mut Criterion) {
    for (name, rows) in [("10 min", ROWS), ("2 h", 12 * ROWS)] {
        let history = history(rows);
        let end = rows as f64 * 0.02;
        c.bench_function(&format!("curve of {name}, 1000 pixels"), |b| {
            b.iter(|| history.window(black_box(Id::X1), 0.0, end, 1000));
        });
        c.bench_function(&format!("extremes of {name}"), |b| {
            b.iter(|| history.extremes(black_box(Id::X1), 1.0, end - 1.0));
        });
    }
    c.bench_function("taking 50 rows", |b| {
        let rows: Vec<Frame> = (0..50).map(frame).collect();
        b.iter_batched_ref(History::default, |history| history.extend(&rows), BatchSize::SmallInput);
    });
}

fn show(c: &mut Criterion) {
    let history = history(ROWS);
    let mut plots = Plots::empty();
    for channels in Id::ALL[..30].chunks(5) {
        plots.add(channels);
    }
    plots.show_all();
    let input =
        RawInput { screen_rect: Some(Rect::from_min_size(Pos2::ZERO, vec2(1200.0, 1000.0))), ..RawInput::default() };
    let context = Context::default();
    let mut frame = || {
        let mut output = context.run_ui(input.clone(), |ui| {
            plots::show(ui, &mut plots, &history, Some(100.0));
        });
        // There is no screen that would take the letters.
        output.textures_delta.clear();
        context.tessellate(output.shapes, output.pixels_per_point)
    };
    // The first frames measure text.
    (0..5).for_each(|_| drop(frame()));
    c.bench_function("a frame of 30 curves", |b| b.iter(|| black_box(frame())));
}

criterion_group!(benches, window, show);
criterion_main!(benches);
