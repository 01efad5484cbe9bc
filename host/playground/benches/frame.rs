//! Time of a frame of the whole window: session, scene, knobs, 30 channels in six plots over ten minutes, as it is built and as
//! it becomes triangles. What is left to the graphics is to draw them. `cargo bench -p barrel-playground --bench frame`.

use barrel::cli::PlayArgs;
use clap::Parser;
use criterion::{Criterion, criterion_group, criterion_main};
use eframe::egui::{Context, Event, Key, Modifiers, Pos2, RawInput, Rect, vec2};
use playground::app::App;
use playground::channel::Id;
use playground::order::Order;
use std::hint::black_box;
use std::time::Duration;

/// Rows of ten minutes of control steps.
const ROWS: usize = 30_000;

#[derive(Parser)]
struct Cli {
    #[command(flatten)]
    play: PlayArgs,
}

/// A frame of the window with these events; returns how many triangles it has.
fn frame(app: &mut App, context: &Context, events: Vec<Event>) -> usize {
    let screen = Rect::from_min_size(Pos2::ZERO, vec2(1560.0, 940.0));
    let input = RawInput { screen_rect: Some(screen), events, ..RawInput::default() };
    let mut output = context.run_ui(input, |ui| app.show_window(ui));
    // There is no screen that would take the letters.
    output.textures_delta.clear();
    context.tessellate(output.shapes, output.pixels_per_point).len()
}

fn window(c: &mut Criterion) {
    let folder = tempfile::tempdir().expect("a folder");
    std::env::set_current_dir(folder.path()).expect("it is there");
    let context = Context::default();
    let args = Cli::parse_from(["barrel-play", "homeokinetic"]).play;
    let mut app = App::new(&args, None, None, &context);
    app.order(Order::Line("speed max".to_owned()));
    while app.history().len() < ROWS {
        frame(&mut app, &context, Vec::new());
        std::thread::sleep(Duration::from_millis(5));
    }
    app.order(Order::Line("speed 1".to_owned()));
    for channels in Id::ALL[..30].chunks(5) {
        app.plots_mut().add(channels);
    }
    app.plots_mut().show_all();
    // The first frames measure text.
    for _ in 0..20 {
        frame(&mut app, &context, Vec::new());
    }
    c.bench_function("a frame, experiments, 10 min of 30 channels", |b| {
        b.iter(|| black_box(frame(&mut app, &context, Vec::new())));
    });
    let key =
        Event::Key { key: Key::K, physical_key: None, pressed: true, repeat: false, modifiers: Modifiers::COMMAND };
    frame(&mut app, &context, vec![key]);
    for _ in 0..60 {
        frame(&mut app, &context, Vec::new());
    }
    c.bench_function("a frame, with the console", |b| {
        b.iter(|| black_box(frame(&mut app, &context, Vec::new())));
    });
}

criterion_group!(benches, window);
criterion_main!(benches);
