//! A film of the scene: what the window shows, 25 times a second, as an animated GIF or as PNG pictures in a folder.

use crate::picture;
use barrel::draft::Draft;
use eframe::egui;
use egui::{ColorImage, Context, Rect, ScreenshotCallback, ViewportCommand};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Time between two pictures of a film.
const PERIOD: Duration = Duration::from_millis(40);
/// A film ends by itself after this.
const LONGEST: Duration = Duration::from_secs(120);
/// A film is no wider than this, pixels: twice as sharp a screen does not make it four times as large.
const WIDEST: usize = 900;
/// How carefully the colours of a GIF are chosen, 1 (best) to 30 (fastest).
const HASTE: i32 = 10;

/// What a film is written as.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Kind {
    /// An animated GIF.
    #[default]
    Gif,
    /// PNG pictures in a folder, numbered.
    Pictures,
}

impl Kind {
    /// Both kinds.
    pub const ALL: [Kind; 2] = [Kind::Gif, Kind::Pictures];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Gif => "Animated GIF",
            Kind::Pictures => "PNG pictures in a folder",
        }
    }
}

/// A picture of a film, and how long it is to be seen.
type Shot = (ColorImage, Duration);

/// A film that is being made. It is written in a thread of its own.
pub struct Film {
    shots: Option<Sender<Shot>>,
    writer: JoinHandle<Result<PathBuf, String>>,
    begun: Instant,
    /// When the last picture was taken.
    taken: Option<Instant>,
}

impl Film {
    /// Begins a film in this folder.
    ///
    /// # Errors
    /// A place that cannot be written; a sentence.
    pub fn begin(folder: &Path, kind: Kind) -> Result<Self, String> {
        let (send, shots) = mpsc::channel();
        let error = |path: &Path, why: &std::io::Error| {
            format!("cannot write {}: {why}; start in a folder that may be written", path.display())
        };
        let writer = match kind {
            Kind::Gif => {
                let path = picture::free(folder, "film", ".gif");
                let draft = Draft::beside(&path).map_err(|why| error(&path, &why))?;
                std::thread::spawn(move || write_gif(draft, path, &shots))
            }
            Kind::Pictures => {
                let path = picture::free(folder, "film", "");
                std::fs::create_dir_all(&path).map_err(|why| error(&path, &why))?;
                std::thread::spawn(move || write_pictures(path, &shots))
            }
        };
        Ok(Film { shots: Some(send), writer, begun: Instant::now(), taken: None })
    }

    /// Takes a picture of this part of the window, if it is time for one.
    pub fn tick(&mut self, context: &Context, part: Rect) {
        let since = self.taken.map_or(PERIOD, |taken| taken.elapsed());
        if since < PERIOD {
            context.request_repaint_after(PERIOD.saturating_sub(since));
            return;
        }
        self.taken = Some(Instant::now());
        let (pixels, shots) = (context.pixels_per_point(), self.shots.clone());
        let taken = ScreenshotCallback::new(move |image: Arc<ColorImage>| {
            // A writer that has failed says so at the end.
            let _ = shots.map(|shots| shots.send((cut(&image, part, pixels), since)));
        });
        context.send_viewport_cmd(ViewportCommand::Screenshot(taken));
    }

    /// How long it is so far.
    pub fn length(&self) -> Duration {
        self.begun.elapsed()
    }

    /// Whether it has come to its greatest length, or cannot be written any more.
    pub fn is_over(&self) -> bool {
        self.length() > LONGEST || self.writer.is_finished()
    }

    /// Ends the film, and tells where it is once it has been written.
    pub fn finish(mut self, told: impl FnOnce(Result<String, String>) + Send + 'static) {
        self.shots = None;
        std::thread::spawn(move || {
            let written = self.writer.join().unwrap_or_else(|_| Err("the film could not be written".to_owned()));
            told(written.map(|path| format!("film: {}", path.display())));
        });
    }
}

/// A part of a picture of the window, in points, made smaller where it is sharper than a film needs.
fn cut(image: &ColorImage, part: Rect, pixels: f32) -> ColorImage {
    let within = |number: f32, limit: usize| ((number * pixels).round().max(0.0) as usize).min(limit);
    let [width, height] = image.size;
    let (left, right) = (within(part.left(), width), within(part.right(), width));
    let (top, bottom) = (within(part.top(), height), within(part.bottom(), height));
    let size = [right.saturating_sub(left), bottom.saturating_sub(top)];
    smaller(&image.region_by_pixels([left, top], size), size[0].div_ceil(WIDEST).max(1))
}

/// The same picture, a mean of `by` × `by` pixels in place of each.
fn smaller(image: &ColorImage, by: usize) -> ColorImage {
    let [width, height] = image.size.map(|size| size / by);
    let count = (by * by) as u32;
    let mut pixels = Vec::with_capacity(width * height);
    for y in 0..height {
        for x in 0..width {
            let mut sum = [0_u32; 3];
            for (dy, dx) in (0..by).flat_map(|dy| (0..by).map(move |dx| (dy, dx))) {
                let [r, g, b, _] = image.pixels[(y * by + dy) * image.size[0] + x * by + dx].to_array();
                sum = [sum[0] + u32::from(r), sum[1] + u32::from(g), sum[2] + u32::from(b)];
            }
            let [r, g, b] = sum.map(|sum| (sum / count) as u8);
            pixels.push(egui::Color32::from_rgb(r, g, b));
        }
    }
    ColorImage::new([width, height], pixels)
}

fn write_gif(draft: Draft, path: PathBuf, shots: &Receiver<Shot>) -> Result<PathBuf, String> {
    let error = |why: &dyn std::fmt::Display| format!("cannot write {}: {why}", path.display());
    let Ok((first, _)) = shots.recv() else { return Err("the film ended before it had a picture".to_owned()) };
    let [width, height] = first.size;
    let size = [width as u16, height as u16];
    let file = BufWriter::new(File::create(draft.path()).map_err(|why| error(&why))?);
    let mut encoder = gif::Encoder::new(file, size[0], size[1], &[]).map_err(|why| error(&why))?;
    encoder.set_repeat(gif::Repeat::Infinite).map_err(|why| error(&why))?;
    let mut last = first;
    loop {
        let next = shots.recv();
        let shown = next.as_ref().map_or(PERIOD, |(_, since)| *since);
        let mut frame = gif::Frame::from_rgba_speed(size[0], size[1], last.as_raw_mut(), HASTE);
        frame.delay = (shown.as_millis() / 10).clamp(2, 1000) as u16;
        encoder.write_frame(&frame).map_err(|why| error(&why))?;
        match next {
            // A window that has changed its size meanwhile has no place in the film.
            Ok((image, _)) if image.size == [width, height] => last = image,
            Ok(_) => {}
            Err(_) => break,
        }
    }
    drop(encoder);
    draft.commit().map_err(|why| error(&why))?;
    Ok(path)
}

fn write_pictures(path: PathBuf, shots: &Receiver<Shot>) -> Result<PathBuf, String> {
    for (n, (image, _)) in shots.iter().enumerate() {
        picture::write(&path.join(format!("{:05}.png", n + 1)), &image)?;
    }
    Ok(path)
}
