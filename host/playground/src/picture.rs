//! Pictures of the window.

use barrel::draft::Draft;
use eframe::egui;
use egui::{ColorImage, Context, ScreenshotCallback, ViewportCommand};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Takes a picture of the whole window into this folder, and tells where it is, or why it is not.
pub fn take(context: &Context, folder: PathBuf, told: impl FnOnce(Result<String, String>) + Send + 'static) {
    let taken = ScreenshotCallback::new(move |image| {
        // What is written waits for the disk, and no window should.
        std::thread::spawn(move || {
            let path = free(&folder, "view", ".png");
            told(write(&path, &image).map(|()| format!("picture: {}", path.display())));
        });
    });
    context.send_viewport_cmd(ViewportCommand::Screenshot(taken));
}

/// Writes a PNG, whole or not at all.
///
/// # Errors
/// A sentence that says what is wrong.
pub fn write(path: &Path, image: &ColorImage) -> Result<(), String> {
    let error = |error: &dyn std::fmt::Display| {
        format!("cannot write {}: {error}; start in a folder that may be written", path.display())
    };
    let draft = Draft::beside(path).map_err(|why| error(&why))?;
    let file = std::fs::File::create(draft.path()).map_err(|why| error(&why))?;
    let [width, height] = image.size;
    let mut encoder = png::Encoder::new(std::io::BufWriter::new(file), width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().map_err(|why| error(&why))?;
    writer.write_image_data(image.as_raw()).map_err(|why| error(&why))?;
    writer.finish().map_err(|why| error(&why))?;
    draft.commit().map_err(|why| error(&why))
}

/// A name in this folder that is neither taken nor given to a picture or film that is still being made: `view-1.png`,
/// `view-2.png`, …
pub fn free(folder: &Path, stem: &str, ending: &str) -> PathBuf {
    static GIVEN: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    let mut given = GIVEN.lock().unwrap_or_else(PoisonError::into_inner);
    let path = (1_u32..)
        .map(|n| folder.join(format!("{stem}-{n}{ending}")))
        .find(|path| !path.exists() && !given.contains(path))
        .unwrap_or_else(|| folder.join(format!("{stem}{ending}")));
    given.insert(path.clone());
    path
}
