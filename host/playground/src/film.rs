//! A film of the scene: what the window shows, 25 times a second, as an animated GIF or as PNG pictures in a folder.

use crate::picture;
use barrel::draft::Draft;
use eframe::egui;
use egui::{Color32, ColorImage, Context, Rect, ScreenshotCallback, ViewportCommand};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, SyncSender};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Time between two pictures of a film.
const PERIOD: Duration = Duration::from_millis(40);
/// A film ends by itself after this.
const LONGEST: Duration = Duration::from_secs(120);
/// A film is no wider than this, pixels: twice as sharp a screen does not make it four times as large.
const WIDEST: usize = 900;
/// Pictures that wait for their writer, at most: a machine that is too slow leaves some out, and keeps its memory.
const WAITING: usize = 25;
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

/// A picture of a film, and when it was taken.
type Shot = (ColorImage, Instant);

/// A film that is being made. It is written in a thread of its own.
pub struct Film {
    shots: Option<SyncSender<Shot>>,
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
        let (send, shots) = mpsc::sync_channel(WAITING);
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
        let now = Instant::now();
        self.taken = Some(now);
        let (pixels, shots) = (context.pixels_per_point(), self.shots.clone());
        let shot = ScreenshotCallback::new(move |image: Arc<ColorImage>| {
            // A writer that has failed says so at the end; one that is behind gets the next picture.
            let _ = shots.map(|shots| shots.try_send((cut(&image, part, pixels), now)));
        });
        context.send_viewport_cmd(ViewportCommand::Screenshot(shot));
    }

    /// How long it is so far.
    pub fn length(&self) -> Duration {
        self.begun.elapsed()
    }

    /// Whether it has come to its greatest length, or cannot be written any more.
    pub fn is_over(&self) -> bool {
        self.length() > LONGEST || self.writer.is_finished()
    }

    /// Ends the film, and tells where it is once it has been written. A process that ends before the thread that is returned
    /// takes the film with it.
    pub fn finish(mut self, told: impl FnOnce(Result<String, String>) + Send + 'static) -> JoinHandle<()> {
        self.shots = None;
        std::thread::spawn(move || {
            let written = self.writer.join().unwrap_or_else(|_| Err("the film could not be written".to_owned()));
            told(written.map(|path| format!("film: {}", path.display())));
        })
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
            pixels.push(Color32::from_rgb(r, g, b));
        }
    }
    ColorImage::new([width, height], pixels)
}

/// The same picture in another size: its middle, or itself with black around it.
fn fit(image: ColorImage, size: [usize; 2]) -> ColorImage {
    if image.size == size {
        return image;
    }
    let mut fitted = ColorImage::filled(size, Color32::BLACK);
    let [columns, rows] = [0, 1].map(|axis| image.size[axis].min(size[axis]));
    let [from, to] = [image.size, size].map(|[width, height]| [(width - columns) / 2, (height - rows) / 2]);
    for row in 0..rows {
        let source = (from[1] + row) * image.size[0] + from[0];
        let target = (to[1] + row) * size[0] + to[0];
        fitted.pixels[target..target + columns].copy_from_slice(&image.pixels[source..source + columns]);
    }
    fitted
}

/// The first picture in which there is something to see: it decides the film's size, whatever becomes of the window's.
fn first(shots: &Receiver<Shot>) -> Result<Shot, String> {
    let found = shots.iter().find(|(image, _)| !image.pixels.is_empty());
    found.ok_or_else(|| "the film ended before it had a picture".to_owned())
}

fn write_gif(draft: Draft, path: PathBuf, shots: &Receiver<Shot>) -> Result<PathBuf, String> {
    let error = |why: &dyn std::fmt::Display| format!("cannot write {}: {why}", path.display());
    let (mut last, begun) = first(shots)?;
    let size = last.size;
    let [width, height] = size.map(|size| size as u16);
    let file = BufWriter::new(File::create(draft.path()).map_err(|why| error(&why))?);
    let mut encoder = gif::Encoder::new(file, width, height, &[]).map_err(|why| error(&why))?;
    encoder.set_repeat(gif::Repeat::Infinite).map_err(|why| error(&why))?;
    let (mut taken, mut shown) = (begun, 0);
    loop {
        let next = shots.recv();
        let until = next.as_ref().map_or_else(|_| taken + PERIOD, |(_, taken)| *taken);
        let mut frame = gif::Frame::from_rgba_speed(width, height, last.as_raw_mut(), HASTE);
        frame.delay = delay(until.duration_since(begun), shown);
        shown += u64::from(frame.delay);
        encoder.write_frame(&frame).map_err(|why| error(&why))?;
        let Ok((image, at)) = next else { break };
        (last, taken) = (fit(image, size), at);
    }
    drop(encoder);
    draft.commit().map_err(|why| error(&why))?;
    Ok(path)
}

/// How long a picture is to be seen that the next one follows at this time of the film, in a GIF's hundredths of a second, after
/// so many of them: what is rounded away of one picture is given to the next. Viewers slow down what is faster than 2.
fn delay(until: Duration, shown: u64) -> u16 {
    let hundredths = (until.as_secs_f64() * 100.0).round() as u64;
    hundredths.saturating_sub(shown).clamp(2, u16::MAX.into()) as u16
}

fn write_pictures(path: PathBuf, shots: &Receiver<Shot>) -> Result<PathBuf, String> {
    let (first, _) = first(shots).inspect_err(|_| {
        // Nothing has come to stand in it.
        let _ = std::fs::remove_dir(&path);
    })?;
    let size = first.size;
    let rest = shots.iter().map(|(image, _)| fit(image, size));
    for (n, image) in std::iter::once(first).chain(rest).enumerate() {
        picture::write(&path.join(format!("{:05}.png", n + 1)), &image)?;
    }
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_film_lasts_as_long_as_what_it_shows_whatever_is_rounded() {
        for period in [40.0, 49.9, 50.1, 54.9, 66.6] {
            let at = |n: u32| Duration::from_secs_f64(f64::from(n) * period * 1e-3);
            let shown = (1..=100).fold(0, |shown, n| shown + u64::from(delay(at(n), shown)));
            assert!((shown as f64 - 10.0 * period).abs() <= 1.0, "{period} ms: {shown} hundredths");
        }
    }

    #[test]
    fn a_sharp_screen_makes_the_same_film_as_another() {
        let colour = |x: usize, y: usize| Color32::from_rgb((x / 40) as u8, (y / 40) as u8, 7);
        let of = |scale: usize| {
            let size = [1000 * scale, 600 * scale];
            let pixels = (0..size[0] * size[1]).map(|i| colour(i % size[0] / scale, i / size[0] / scale)).collect();
            cut(
                &ColorImage::new(size, pixels),
                Rect::from_min_max([100.0, 40.0].into(), [700.0, 440.0].into()),
                scale as f32,
            )
        };
        assert_eq!(of(1).size, [600, 400]);
        assert_eq!(of(2), of(1));
    }

    #[test]
    fn a_picture_of_another_size_keeps_its_middle() {
        for (from, to) in [([8, 6], [4, 4]), ([4, 4], [8, 6]), ([8, 4], [4, 8])] {
            let mut image = ColorImage::filled(from, Color32::GRAY);
            image[(from[0] / 2, from[1] / 2)] = Color32::RED;
            let fitted = fit(image, to);
            assert_eq!(fitted.size, to);
            assert_eq!(fitted[(to[0] / 2, to[1] / 2)], Color32::RED, "{from:?} in {to:?}");
        }
        assert_eq!(fit(ColorImage::new([0, 0], Vec::new()), [2, 1]).pixels, [Color32::BLACK; 2]);
    }
}
