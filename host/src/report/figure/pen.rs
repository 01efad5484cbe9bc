//! What draws: lines, areas, markers and text on an SVG sheet, in units of a pixel at the nominal width.

use plotters::backend::{DrawingBackend, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontStyle, FontTransform, IntoFont, RGBAColor, ShapeStyle, TextStyle};

use super::Marker;
use super::colour::{TEXT, cover};

/// The backend's whole units in one of ours: what it rounds is not seen.
const FINE: f64 = 2.0;
/// The backend divides the sizes of fonts by this.
const FONT_UNIT: f64 = 1.24;
/// Half the size of a marker.
pub const MARKER: f64 = 4.0;

/// A point, from the sheet's upper left corner.
pub type Point = (f64, f64);

/// Which point of a text its position is; vertically it is always the middle.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    Left,
    Middle,
    Right,
    /// The middle of a text that runs upwards.
    Upwards,
}

/// How a text looks.
#[derive(Clone, Copy)]
pub struct Letters {
    pub size: f64,
    pub bold: bool,
    pub color: RGBAColor,
}

impl Letters {
    /// Upright dark letters.
    pub fn plain(size: f64) -> Letters {
        Letters { size, bold: false, color: cover(TEXT, 1.0) }
    }
}

/// The picture: groups of elements, the later ones above the earlier ones.
pub struct Sheet {
    size: (u32, u32),
    elements: String,
}

impl Sheet {
    pub fn new(width: f64, height: f64) -> Sheet {
        let fine = |length: f64| (length * FINE).round() as u32;
        Sheet { size: (fine(width), fine(height)), elements: String::new() }
    }

    /// Draws a group. The dashes, if any, are lengths drawn and left out in turn, and hold for its lines.
    pub fn group(&mut self, dashes: &[f64], draw: impl FnOnce(&mut Pen)) -> Result<(), String> {
        let mut picture = String::new();
        {
            let mut pen = Pen { backend: SVGBackend::with_string(&mut picture, self.size), error: None };
            draw(&mut pen);
            let ended = pen.backend.present();
            pen.keep(ended);
            pen.error.take().map_or(Ok(()), Err)?;
        }
        // The backend draws whole pictures; what lies between its <svg> and </svg> is the group.
        let elements = picture.split_once('\n').and_then(|(_, rest)| rest.strip_suffix("</svg>\n"));
        let elements = elements.ok_or("the drawing library does not write <svg> and </svg> on lines of their own")?;
        if elements.is_empty() {
            return Ok(());
        }
        let elements = elements.replace(" opacity=\"1\"", "");
        if dashes.is_empty() {
            self.elements.push_str(&elements);
        } else {
            let dashes: Vec<String> = dashes.iter().map(|length| (length * FINE).round().to_string()).collect();
            self.elements.push_str(&format!("<g stroke-dasharray=\"{}\">\n{elements}</g>\n", dashes.join(" ")));
        }
        Ok(())
    }

    /// The whole picture, as an element for a page: as wide as what it stands in.
    pub fn svg(self) -> String {
        let (width, height) = self.size;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"100%\" role=\"img\" \
             stroke-linejoin=\"round\">\n{}</svg>\n",
            self.elements
        )
    }
}

/// Draws one group. The first error is kept and told by [`Sheet::group`].
pub struct Pen<'a> {
    backend: SVGBackend<'a>,
    error: Option<String>,
}

impl Pen<'_> {
    fn keep<E: std::fmt::Display>(&mut self, result: Result<(), E>) {
        if let Err(error) = result {
            self.error.get_or_insert(error.to_string());
        }
    }

    /// Lines from point to point.
    pub fn line(&mut self, points: &[Point], color: RGBAColor, width: f64) {
        let style = ShapeStyle { color, filled: false, stroke_width: (width * FINE).round() as u32 };
        let mut path: Vec<(i32, i32)> = points.iter().map(|&point| fine(point)).collect();
        path.dedup();
        let result = self.backend.draw_path(path, &style);
        self.keep(result);
    }

    /// A filled area between points.
    pub fn area(&mut self, points: &[Point], color: RGBAColor) {
        let result =
            self.backend.fill_polygon(points.iter().map(|&point| fine(point)), &ShapeStyle::from(color).filled());
        self.keep(result);
    }

    /// A filled rectangle.
    pub fn rectangle(&mut self, from: Point, to: Point, color: RGBAColor) {
        let result = self.backend.draw_rect(fine(from), fine(to), &ShapeStyle::from(color), true);
        self.keep(result);
    }

    /// A circle, filled or not.
    pub fn circle(&mut self, center: Point, radius: f64, color: RGBAColor, filled: bool) {
        let style = ShapeStyle { color, filled, stroke_width: if filled { 0 } else { 3 } };
        let result = self.backend.draw_circle(fine(center), (radius * FINE).round() as u32, &style, filled);
        self.keep(result);
    }

    /// A marker. All of them look equally large.
    pub fn marker(&mut self, (x, y): Point, marker: Marker, color: RGBAColor) {
        let r = MARKER;
        match marker {
            Marker::Disc => self.circle((x, y), r, color, true),
            Marker::Ring => self.circle((x, y), r - 0.5, color, false),
            Marker::Cross => {
                let a = r - 0.5;
                self.line(&[(x - a, y - a), (x + a, y + a)], color, 2.0);
                self.line(&[(x - a, y + a), (x + a, y - a)], color, 2.0);
            }
            Marker::Square => self.rectangle((x - r + 0.5, y - r + 0.5), (x + r - 0.5, y + r - 0.5), color),
            Marker::Triangle => {
                self.area(&[(x, y - r - 1.0), (x + r + 0.5, y + r - 0.5), (x - r - 0.5, y + r - 0.5)], color)
            }
            Marker::Diamond => {
                let a = r + 1.0;
                self.area(&[(x, y - a), (x + a, y), (x, y + a), (x - a, y)], color);
            }
        }
    }

    /// A line of text.
    pub fn text(&mut self, at: Point, text: &str, anchor: Anchor, letters: Letters) {
        let horizontal = match anchor {
            Anchor::Left => HPos::Left,
            Anchor::Middle | Anchor::Upwards => HPos::Center,
            Anchor::Right => HPos::Right,
        };
        let mut font = ("sans-serif", letters.size * FINE * FONT_UNIT).into_font();
        if letters.bold {
            font = font.style(FontStyle::Bold);
        }
        if anchor == Anchor::Upwards {
            font = font.transform(FontTransform::Rotate270);
        }
        let style = TextStyle::from(font).color(&letters.color).pos(Pos::new(horizontal, VPos::Center));
        let result = self.backend.draw_text(text, &style, fine(at));
        self.keep(result);
    }
}

/// In the backend's units. Far off the sheet is off the sheet.
fn fine((x, y): Point) -> (i32, i32) {
    let round = |length: f64| (length * FINE).round().clamp(-40_000.0, 40_000.0) as i32;
    (round(x), round(y))
}
