//! `barrel-play`: the playground's window, what `barrel play` starts.

use barrel::cli::PlayArgs;
use clap::Parser;
use eframe::egui::ViewportBuilder;
use eframe::{NativeOptions, Renderer};
use playground::app::App;
use playground::theme::Desktop;
use std::process::ExitCode;
use std::sync::atomic::Ordering;

/// Opens the playground: a window on a simulated barrel or a robot, to see it, push it and turn its knobs.
#[derive(Parser)]
#[command(name = "barrel-play", version)]
struct Cli {
    #[command(flatten)]
    play: PlayArgs,
}

fn main() -> ExitCode {
    let args = Cli::parse().play;
    if let Err(failure) = args.check() {
        eprintln!("barrel-play: {failure}");
        return failure.exit_code();
    }
    let options = NativeOptions {
        viewport: ViewportBuilder::default()
            .with_title("Barrel playground")
            .with_app_id("barrel-play")
            .with_inner_size([1560.0, 940.0])
            .with_min_inner_size([800.0, 560.0]),
        renderer: Renderer::Glow,
        // The scene's edges are smooth.
        multisampling: 4,
        ..NativeOptions::default()
    };
    let interrupted = match barrel::interrupt::flag() {
        Ok(interrupted) => interrupted,
        Err(failure) => {
            eprintln!("barrel-play: {failure}");
            return failure.exit_code();
        }
    };
    let was_interrupted = interrupted.clone();
    let typed = barrel::console::history();
    let open: eframe::AppCreator<'_> = Box::new(move |context| {
        let app = App::new(&args, typed, context.storage, &context.egui_ctx).until(interrupted);
        Ok(Box::new(app.as_light_as(Desktop::watch(&context.egui_ctx))))
    });
    let opened = eframe::run_native("barrel-play", options, open);
    match opened {
        // As every command of `barrel` ends after Ctrl-C.
        Ok(()) if was_interrupted.load(Ordering::Relaxed) => ExitCode::from(130),
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!(
                "barrel-play: no window can be opened: {error}; a screen with OpenGL is needed (over ssh there is none; \
                 `barrel console` and `barrel monitor` need no window)"
            );
            ExitCode::FAILURE
        }
    }
}
