//! Colours of the scene in the dark and the light theme, and the light that falls on it.

use eframe::egui::{Color32, Visuals};
use nalgebra::Vector3;

/// A colour: red, green, blue as in sRGB, and opacity, 0 to 1 each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Paint {
    pub rgb: [f32; 3],
    pub alpha: f32,
}

impl Paint {
    const fn of(red: u8, green: u8, blue: u8) -> Self {
        Paint { rgb: [red as f32 / 255.0, green as f32 / 255.0, blue as f32 / 255.0], alpha: 1.0 }
    }

    /// The same, less opaque.
    pub fn faded(self, by: f32) -> Self {
        Paint { alpha: self.alpha * by.clamp(0.0, 1.0), ..self }
    }

    /// A part of the way to another colour, opacity too.
    pub fn towards(self, other: Paint, part: f32) -> Self {
        let mix = |a: f32, b: f32| a + (b - a) * part;
        let rgb = core::array::from_fn(|i| mix(self.rgb[i], other.rgb[i]));
        Paint { rgb, alpha: mix(self.alpha, other.alpha) }
    }

    /// What a barrel looks like that is not heard of any more.
    pub fn greyed(self) -> Self {
        let [r, g, b] = self.rgb;
        let grey = 0.3 * r + 0.55 * g + 0.15 * b;
        let rgb = self.rgb.map(|part| part + (grey - part) * 0.85);
        Paint { rgb, alpha: self.alpha * 0.75 }
    }

    /// For egui.
    pub fn color(self) -> Color32 {
        let [r, g, b] = self.rgb.map(|part| (part.clamp(0.0, 1.0) * 255.0).round() as u8);
        Color32::from_rgba_unmultiplied(r, g, b, (self.alpha.clamp(0.0, 1.0) * 255.0).round() as u8)
    }
}

/// The colours of a theme.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Palette {
    /// Above the horizon: high, and at it.
    pub sky: [Paint; 2],
    /// The floor near the barrel.
    pub floor: Paint,
    pub grid: Paint,
    pub shadow: Paint,
    /// The shell where one looks through it, and where one looks along it.
    pub glass: [Paint; 2],
    /// Rims and lines on the shell.
    pub wire: Paint,
    /// Axis and weight 1, then 2.
    pub weights: [Paint; 2],
    pub trail: Paint,
    pub contact: Paint,
    /// What pushes.
    pub force: Paint,
    /// Ground of what is written over the scene.
    pub plate: Paint,
}

impl Palette {
    /// The colours for a theme.
    pub fn of(visuals: &Visuals) -> Palette {
        if visuals.dark_mode { DARK } else { LIGHT }
    }
}

const DARK: Palette = Palette {
    sky: [Paint::of(16, 18, 22), Paint::of(38, 42, 49)],
    floor: Paint::of(52, 57, 65),
    grid: Paint { alpha: 0.40, ..Paint::of(190, 205, 225) },
    shadow: Paint { alpha: 0.55, ..Paint::of(0, 0, 0) },
    glass: [Paint { alpha: 0.05, ..Paint::of(170, 200, 235) }, Paint { alpha: 0.55, ..Paint::of(200, 222, 248) }],
    wire: Paint { alpha: 0.75, ..Paint::of(205, 220, 240) },
    weights: [Paint::of(236, 72, 66), Paint::of(58, 190, 92)],
    trail: Paint { alpha: 0.8, ..Paint::of(110, 170, 245) },
    contact: Paint::of(255, 196, 84),
    force: Paint::of(255, 176, 40),
    plate: Paint { alpha: 0.78, ..Paint::of(24, 26, 30) },
};

const LIGHT: Palette = Palette {
    sky: [Paint::of(214, 225, 238), Paint::of(240, 243, 247)],
    floor: Paint::of(226, 230, 235),
    grid: Paint { alpha: 0.50, ..Paint::of(90, 105, 125) },
    shadow: Paint { alpha: 0.34, ..Paint::of(20, 30, 50) },
    glass: [Paint { alpha: 0.07, ..Paint::of(120, 155, 195) }, Paint { alpha: 0.55, ..Paint::of(84, 116, 156) }],
    wire: Paint { alpha: 0.75, ..Paint::of(62, 84, 112) },
    weights: [Paint::of(214, 48, 44), Paint::of(30, 150, 66)],
    trail: Paint { alpha: 0.8, ..Paint::of(36, 104, 196) },
    contact: Paint::of(214, 122, 0),
    force: Paint::of(206, 96, 0),
    plate: Paint { alpha: 0.82, ..Paint::of(252, 252, 253) },
};

/// Where the sun stands, fixed in the world.
pub(super) fn sun() -> Vector3<f32> {
    Vector3::new(-0.30, -0.38, 0.87).normalize()
}

/// A surface of colour `base` and normal `normal` in the light, seen from the direction `to_eye`; all directions unit.
pub(super) fn lit(base: Paint, normal: Vector3<f32>, to_eye: Vector3<f32>) -> Paint {
    let ambient = 0.50 + 0.14 * normal.z;
    let direct = 0.46 * normal.dot(&sun()).max(0.0);
    // A weak lamp at the eye keeps form in the shade.
    let lamp = 0.16 * normal.dot(&to_eye).max(0.0);
    let rgb = base.rgb.map(|part| part * (ambient + direct + lamp));
    gleaming(Paint { rgb, ..base }, 0.75 * gloss(normal, to_eye, 48.0))
}

/// How much of the sun is mirrored by a surface.
pub(super) fn gloss(normal: Vector3<f32>, to_eye: Vector3<f32>, sharpness: f32) -> f32 {
    let half = sun() + to_eye;
    let size = half.norm();
    if size < 1e-6 { 0.0 } else { (normal.dot(&half) / size).max(0.0).powf(sharpness) }
}

/// With a highlight: whiter and, if one could look through, more opaque.
pub(super) fn gleaming(paint: Paint, gleam: f32) -> Paint {
    let rgb = paint.rgb.map(|part| part + (1.0 - part).max(0.0) * gleam);
    Paint { rgb, alpha: paint.alpha + (1.0 - paint.alpha) * gleam }
}
