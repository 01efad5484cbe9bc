//! A sheet to draw on, in pixels, the same for PNG and SVG.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::sync::OnceLock;

use plotters::backend::{BitMapBackend, DrawingBackend, SVGBackend};
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, IntoDrawingArea};
use plotters::element::{Circle, PathElement, Rectangle, Text};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontTransform, IntoFont, RGBColor, ShapeStyle, TextStyle, register_font};

/// A PNG is drawn this many times larger and averaged down: the library's thick lines have hard edges.
const OVERSAMPLING: u32 = 2;
const FONT: &str = "sans-serif";

/// Red, green, blue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Color(pub u8, pub u8, pub u8);

/// Which point of a text its position is; vertically it is always the middle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    Left,
    Middle,
    Right,
    /// The middle of a text that runs upwards.
    Upwards,
}

/// What can be drawn. Errors are kept and reported at the end, by [`paint`].
pub trait Canvas {
    /// Lines from point to point.
    fn polyline(&mut self, points: &[(f64, f64)], color: Color, width: f64);
    /// A filled rectangle.
    fn rectangle(&mut self, from: (f64, f64), to: (f64, f64), color: Color);
    /// A filled disc.
    fn disc(&mut self, center: (f64, f64), radius: f64, color: Color);
    /// A line of text, `size` pixels high.
    fn text(&mut self, x: f64, y: f64, text: &str, size: f64, anchor: Anchor, color: Color);
}

struct Sheet<'a, DB: DrawingBackend> {
    area: &'a DrawingArea<DB, Shift>,
    scale: f64,
    svg: bool,
    error: Option<String>,
}

impl<DB: DrawingBackend> Sheet<'_, DB> {
    fn at(&self, point: (f64, f64)) -> (i32, i32) {
        // Far off the sheet is off the sheet.
        let pixel = |length: f64| (length * self.scale).round().clamp(-20_000.0, 20_000.0) as i32;
        (pixel(point.0), pixel(point.1))
    }

    /// A line of so many pixels across its steeper axis. The library's own lose pixels in short flat pieces, and fill
    /// polygons where they are wide, which is slow and tears at sharp turns.
    fn segment(&mut self, from: (i32, i32), to: (i32, i32), color: Color, width: i32) {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let steep = dx.abs() < dy.abs();
        let steps = dx.abs().max(dy.abs()).max(1);
        // Rounded to the nearest pixel, for either sign.
        let part = |length: i32, i: i32| (2 * length * i + steps).div_euclid(2 * steps);
        for i in 0..=steps {
            let (x, y) = (from.0 + part(dx, i), from.1 + part(dy, i));
            for across in -(width / 2)..(width + 1) / 2 {
                let pixel = if steep { (x + across, y) } else { (x, y + across) };
                let result = self.area.draw_pixel(pixel, &rgb(color));
                self.keep(result);
            }
        }
    }

    fn keep<T, E: std::fmt::Display>(&mut self, result: Result<T, E>) {
        if let Err(error) = result {
            self.error.get_or_insert(error.to_string());
        }
    }
}

fn rgb(Color(red, green, blue): Color) -> RGBColor {
    RGBColor(red, green, blue)
}

impl<DB: DrawingBackend> Canvas for Sheet<'_, DB> {
    fn polyline(&mut self, points: &[(f64, f64)], color: Color, width: f64) {
        let width = (width * self.scale).round().max(1.0) as i32;
        let points: Vec<(i32, i32)> = points.iter().map(|&point| self.at(point)).collect();
        if self.svg {
            let style = ShapeStyle { color: rgb(color).into(), filled: false, stroke_width: width as u32 };
            let result = self.area.draw(&PathElement::new(points, style));
            self.keep(result);
        } else {
            for segment in points.windows(2) {
                self.segment(segment[0], segment[1], color, width);
            }
        }
    }

    fn rectangle(&mut self, from: (f64, f64), to: (f64, f64), color: Color) {
        let corners = [self.at(from), self.at(to)];
        let result = self.area.draw(&Rectangle::new(corners, ShapeStyle::from(rgb(color)).filled()));
        self.keep(result);
    }

    fn disc(&mut self, center: (f64, f64), radius: f64, color: Color) {
        let radius = (radius * self.scale).round() as i32;
        let result = self.area.draw(&Circle::new(self.at(center), radius, ShapeStyle::from(rgb(color)).filled()));
        self.keep(result);
    }

    fn text(&mut self, x: f64, y: f64, text: &str, size: f64, anchor: Anchor, color: Color) {
        let horizontal = match anchor {
            Anchor::Left => HPos::Left,
            Anchor::Middle | Anchor::Upwards => HPos::Center,
            Anchor::Right => HPos::Right,
        };
        let mut font = (FONT, size * self.scale).into_font();
        if anchor == Anchor::Upwards {
            font = font.transform(FontTransform::Rotate270);
        }
        let color = rgb(color);
        // The library sets bitmap text a little above the middle.
        let y = if self.svg || anchor == Anchor::Upwards { y } else { y + 0.1 * size };
        let style = TextStyle::from(font).color(&color).pos(Pos::new(horizontal, VPos::Center));
        let result = self.area.draw(&Text::new(text.to_string(), self.at((x, y)), style));
        self.keep(result);
    }
}

/// Draws a picture of `width` by `height` pixels into a file.
pub fn paint(path: &Path, svg: bool, width: f64, height: f64, content: &dyn Fn(&mut dyn Canvas)) -> Result<(), String> {
    static FONT_IS_THERE: OnceLock<bool> = OnceLock::new();
    let register = || {
        let bytes = epaint_default_fonts::UBUNTU_LIGHT;
        register_font(FONT, plotters::style::FontStyle::Normal, bytes).is_ok()
    };
    if !FONT_IS_THERE.get_or_init(register) {
        return Err("the built-in font cannot be read".into());
    }
    let size = (width.round() as u32, height.round() as u32);
    if svg {
        return fill(&SVGBackend::new(path, size).into_drawing_area(), 1.0, true, content);
    }
    let large = (size.0 * OVERSAMPLING, size.1 * OVERSAMPLING);
    let mut pixels = vec![0; large.0 as usize * large.1 as usize * 3];
    fill(&BitMapBackend::with_buffer(&mut pixels, large).into_drawing_area(), f64::from(OVERSAMPLING), false, content)?;
    let small = average(&pixels, size);
    write_png(path, size, &small).map_err(|error| error.to_string())
}

fn write_png(path: &Path, (width, height): (u32, u32), rgb: &[u8]) -> Result<(), png::EncodingError> {
    let mut encoder = png::Encoder::new(BufWriter::new(File::create(path)?), width, height);
    encoder.set_color(png::ColorType::Rgb);
    // Smaller files would take as long as the simulated run.
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgb)?;
    writer.finish()
}

fn fill<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    scale: f64,
    svg: bool,
    content: &dyn Fn(&mut dyn Canvas),
) -> Result<(), String> {
    area.fill(&RGBColor(255, 255, 255)).map_err(|error| error.to_string())?;
    let mut sheet = Sheet { area, scale, svg, error: None };
    content(&mut sheet);
    let error = sheet.error;
    area.present().map_err(|error| error.to_string())?;
    error.map_or(Ok(()), Err)
}

/// Averages squares of pixels, rows of red, green, blue, down to `size`.
fn average(pixels: &[u8], (width, height): (u32, u32)) -> Vec<u8> {
    let n = OVERSAMPLING as usize;
    let stride = width as usize * n * 3;
    let mut small = Vec::with_capacity((width * height) as usize * 3);
    let mut sums = vec![0_u16; stride];
    for rows in pixels.chunks_exact(stride * n).take(height as usize) {
        sums.fill(0);
        for row in rows.chunks_exact(stride) {
            sums.iter_mut().zip(row).for_each(|(sum, &value)| *sum += u16::from(value));
        }
        for square in sums.chunks_exact(3 * n) {
            for channel in 0..3 {
                let sum: u16 = square.iter().skip(channel).step_by(3).sum();
                small.push((sum / (n * n) as u16) as u8);
            }
        }
    }
    small
}
