//! Where the scene is seen from, and what of it is shown.

use super::hand::Hand;
use super::lens::Lens;
use eframe::egui::{Rect, Vec2};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Distances that one can zoom to, radii of the barrel.
const NEAREST: f32 = 0.3;
const FARTHEST: f32 = 50.0;
/// How high the camera may go: from straight above, left and right would not be known, rad.
const HIGHEST: f32 = 1.55;
/// The camera follows within about this time, s.
const LAG: f32 = 0.12;
/// It is never farther behind than this, radii.
const LEASH: f64 = 0.7;
/// A barrel farther off than this was put there: the camera does not travel, radii.
const JUMP: f64 = 30.0;
/// How far the middle may be moved from the barrel, radii.
const PAN: f32 = 30.0;

/// How the camera moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// It stands, and looks at a fixed point.
    Orbit,
    /// It goes with the barrel.
    #[default]
    Follow,
    /// It stands, and turns to look at the barrel.
    Fixed,
}

/// Where the scene is seen from, and what of it is shown. What is remembered from one window to the next are the mode, the
/// angles, the distance and the switches; the camera begins at the barrel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct View {
    /// How the camera moves.
    pub mode: Mode,
    /// Direction of the camera from what it looks at, about Z, from X, rad.
    pub azimuth: f32,
    /// Its elevation above the horizontal, rad, 0 to 1.55.
    pub elevation: f32,
    /// Its distance from what it looks at, radii of the barrel.
    pub distance: f32,
    /// Whether a hand on the barrel twists it instead of pulling.
    pub twist: bool,
    /// Whether rings show where the servo wants the weights.
    pub targets: bool,
    /// What the camera looks at, but for `offset`, world axes, m; `None` until there is a barrel to look at.
    #[serde(skip)]
    anchor: Option<[f64; 3]>,
    /// By how much the middle of the window was moved, world axes, radii.
    #[serde(skip)]
    offset: Vector3<f32>,
    /// The radius that distances were measured with, m.
    #[serde(skip)]
    radius: f32,
    /// The hand on the barrel.
    #[serde(skip)]
    pub(super) hand: Option<Hand>,
    /// Time since a hand let go of it, s.
    #[serde(skip)]
    pub(super) let_go: f32,
    /// Width of the row of buttons as it was last drawn.
    #[serde(skip)]
    pub(super) bar_width: f32,
}

impl Default for View {
    fn default() -> Self {
        View {
            mode: Mode::default(),
            azimuth: -1.1,
            elevation: 0.36,
            distance: 7.2,
            twist: false,
            targets: true,
            anchor: None,
            offset: Vector3::zeros(),
            radius: 0.0,
            hand: None,
            let_go: f32::MAX,
            bar_width: 0.0,
        }
    }
}

impl View {
    /// Back to the first view of the barrel, in the same mode.
    pub fn reset(&mut self) {
        let View { azimuth, elevation, distance, .. } = View::default();
        (self.azimuth, self.elevation, self.distance) = (azimuth, elevation, distance);
        self.recentre();
    }

    /// Looks at the barrel, wherever it is, from the next picture on. To be called when a session begins.
    pub fn recentre(&mut self) {
        self.anchor = None;
        self.offset = Vector3::zeros();
    }

    /// Turns the camera about what it looks at, rad.
    pub fn orbit(&mut self, azimuth: f32, elevation: f32) {
        self.azimuth = (self.azimuth + azimuth).rem_euclid(core::f32::consts::TAU);
        self.elevation = (self.elevation + elevation).clamp(0.0, HIGHEST);
    }

    /// Multiplies the distance.
    pub fn zoom(&mut self, factor: f32) {
        self.distance = (self.distance * factor).clamp(NEAREST, FARTHEST);
    }

    /// Moves the scene in the window by as many points as `by` says.
    pub(super) fn pan(&mut self, by: Vec2, lens: &Lens) {
        let scale = self.distance / lens.focal;
        self.offset += (lens.up * by.y - lens.right * by.x) * scale;
        let size = self.offset.norm();
        if size > PAN {
            self.offset *= PAN / size;
        }
    }

    /// Lets `dt` seconds pass with the barrel at `barrel`, m; whether the camera is still on its way.
    pub(super) fn advance(&mut self, barrel: [f64; 3], radius: f32, dt: f32) -> bool {
        let sane = View::default();
        for (number, otherwise) in [
            (&mut self.azimuth, sane.azimuth),
            (&mut self.elevation, sane.elevation),
            (&mut self.distance, sane.distance),
        ] {
            if !number.is_finite() {
                *number = otherwise;
            }
        }
        self.elevation = self.elevation.clamp(0.0, HIGHEST);
        // Only a fixed camera may be left behind farther.
        let farthest = if self.mode == Mode::Fixed { f32::MAX } else { FARTHEST };
        self.distance = self.distance.clamp(NEAREST, farthest);
        if self.radius != radius {
            self.radius = radius;
            self.anchor = None;
        }
        let anchor = self.anchor.get_or_insert(barrel);
        let way: [f64; 3] = core::array::from_fn(|i| barrel[i] - anchor[i]);
        let far = way.iter().map(|part| part * part).sum::<f64>().sqrt();
        if self.mode == Mode::Orbit {
            return false;
        }
        let before = *anchor;
        let part = if far > JUMP * f64::from(radius) {
            1.0
        } else {
            // However fast the time goes, the barrel does not run out of the picture.
            (1.0 - f64::from(-dt / LAG).exp()).max(1.0 - LEASH * f64::from(radius) / far)
        };
        *anchor = core::array::from_fn(|i| before[i] + way[i] * part);
        if self.mode == Mode::Fixed && part < 1.0 {
            let moved: [f64; 3] = core::array::from_fn(|i| before[i] - anchor[i]);
            self.look_from(self.arm() * radius + Vector3::from(moved).cast::<f32>(), radius);
        }
        far * (1.0 - part) > 1e-3 * f64::from(radius)
    }

    /// From what is looked at to the camera, radii.
    fn arm(&self) -> Vector3<f32> {
        let (sin_a, cos_a) = self.azimuth.sin_cos();
        let (sin_e, cos_e) = self.elevation.sin_cos();
        Vector3::new(cos_e * cos_a, cos_e * sin_a, sin_e) * self.distance
    }

    /// Sets angles and distance so that the camera is `arm` from what it looks at, m.
    fn look_from(&mut self, arm: Vector3<f32>, radius: f32) {
        let flat = arm.xy().norm();
        self.distance = (arm.norm() / radius).max(NEAREST);
        if flat > 1e-6 * radius {
            self.azimuth = f32::atan2(arm.y, arm.x).rem_euclid(core::f32::consts::TAU);
        }
        self.elevation = f32::atan2(arm.z, flat).clamp(0.0, HIGHEST);
    }

    /// The perspective, seen from the point of the ground at `origin`, m.
    pub(super) fn lens(&self, rect: Rect, origin: [f64; 2]) -> Lens {
        let anchor = self.anchor.unwrap_or([origin[0], origin[1], f64::from(self.radius)]);
        let mut target = Vector3::new(anchor[0] - origin[0], anchor[1] - origin[1], anchor[2]).cast::<f32>();
        target += self.offset * self.radius;
        // Not below the ground, so that the camera is not either.
        target.z = target.z.max(0.05 * self.radius);
        Lens::new(rect, target, [self.azimuth, self.elevation], self.distance * self.radius)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::{Pos2, pos2, vec2};

    const RECT: Rect = Rect::from_min_max(pos2(0.0, 0.0), pos2(800.0, 600.0));

    fn place_of(view: &View, barrel: [f64; 3]) -> Pos2 {
        let point = Vector3::new(0.0, 0.0, barrel[2] as f32);
        view.lens(RECT, [barrel[0], barrel[1]]).project(point).expect("it is in front")
    }

    fn roll(view: &mut View, to: f64) -> [f64; 3] {
        let mut barrel = [0.0; 3];
        for step in 0..=100 {
            barrel = [to * f64::from(step) / 100.0, 0.0, 0.5];
            view.advance(barrel, 0.5, 0.02);
        }
        for _ in 0..200 {
            view.advance(barrel, 0.5, 0.02);
        }
        barrel
    }

    #[test]
    fn following_and_fixed_cameras_end_with_the_barrel_in_the_middle() {
        for mode in [Mode::Follow, Mode::Fixed] {
            let mut view = View { mode, ..View::default() };
            let barrel = roll(&mut view, 8.0);
            assert!((place_of(&view, barrel) - RECT.center()).length() < 1.0, "{mode:?}");
        }
    }

    #[test]
    fn a_barrel_that_is_fast_does_not_run_out_of_the_picture() {
        let mut view = View::default();
        for step in 0..50 {
            // 10 x real time at 60 frames a second, and more.
            let barrel = [2.0 * f64::from(step), 0.0, 0.5];
            view.advance(barrel, 0.5, 0.016);
            assert!(RECT.shrink(50.0).contains(place_of(&view, barrel)), "{:?}", place_of(&view, barrel));
        }
    }

    #[test]
    fn an_orbiting_and_a_fixed_camera_stay_where_they_are() {
        for mode in [Mode::Orbit, Mode::Fixed] {
            let mut view = View { mode, ..View::default() };
            view.advance([0.0, 0.0, 0.5], 0.5, 0.02);
            let before = view.lens(RECT, [0.0; 2]).eye;
            roll(&mut view, 8.0);
            let after = view.lens(RECT, [0.0; 2]).eye;
            assert!((after - before).norm() < 1e-3, "{mode:?} {before} {after}");
        }
    }

    #[test]
    fn a_barrel_that_was_put_elsewhere_is_in_the_middle_at_once() {
        let mut view = View::default();
        view.advance([0.0, 0.0, 0.5], 0.5, 0.02);
        let far = [10_000.0, -5.0, 0.5];
        assert!(!view.advance(far, 0.5, 0.02));
        assert!((place_of(&view, far) - RECT.center()).length() < 1.0);
    }

    #[test]
    fn numbers_that_no_camera_has_are_put_right() {
        let mut view = View { azimuth: f32::NAN, elevation: 7.0, distance: -1.0, ..View::default() };
        view.advance([0.0, 0.0, 0.5], 0.5, 0.02);
        assert_eq!((view.azimuth, view.elevation, view.distance), (View::default().azimuth, HIGHEST, NEAREST));
    }

    #[test]
    fn panning_moves_the_scene_with_the_mouse() {
        let mut view = View::default();
        let barrel = [3.0, 0.0, 0.5];
        view.advance(barrel, 0.5, 0.02);
        let before = place_of(&view, barrel);
        view.pan(vec2(40.0, -25.0), &view.lens(RECT, [3.0, 0.0]));
        let moved = place_of(&view, barrel) - before;
        assert!((moved - vec2(40.0, -25.0)).length() < 5.0, "{moved:?}");
    }

    #[test]
    fn zoom_and_elevation_have_ends() {
        let mut view = View::default();
        for _ in 0..100 {
            view.zoom(1.5);
            view.orbit(1.0, 0.3);
        }
        assert_eq!((view.distance, view.elevation), (FARTHEST, HIGHEST));
        for _ in 0..100 {
            view.zoom(0.5);
            view.orbit(1.0, -0.3);
        }
        assert_eq!((view.distance, view.elevation), (NEAREST, 0.0));
    }
}
