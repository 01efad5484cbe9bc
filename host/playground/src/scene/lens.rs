//! From the world to the window and back: a camera's perspective.
//!
//! Lengths are metres, seen from a moving origin on the ground near the barrel: f32 stays exact however far it rolled.

use eframe::egui::{Pos2, Rect, pos2};
use nalgebra::Vector3;

/// Half of the angle of view, over the shorter side of the window, rad.
const HALF_ANGLE: f32 = 0.3;

/// A perspective.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lens {
    /// Where the camera is.
    pub eye: Vector3<f32>,
    /// To the right in the window, unit.
    pub right: Vector3<f32>,
    /// Up in the window, unit.
    pub up: Vector3<f32>,
    /// Into the window, unit.
    pub ahead: Vector3<f32>,
    /// Points in the window per tangent of the angle from the middle.
    pub focal: f32,
    /// The middle of the window.
    middle: Pos2,
    /// Distance of what is looked at, m.
    pub distance: f32,
    /// Nothing nearer is drawn, m.
    pub near: f32,
}

impl Lens {
    /// Looks at `target` from `distance` away, from the direction of azimuth (about Z, from X) and elevation, rad.
    pub fn new(rect: Rect, target: Vector3<f32>, [azimuth, elevation]: [f32; 2], distance: f32) -> Self {
        let (sin_a, cos_a) = azimuth.sin_cos();
        let (sin_e, cos_e) = elevation.sin_cos();
        let back = Vector3::new(cos_e * cos_a, cos_e * sin_a, sin_e);
        let right = Vector3::new(-sin_a, cos_a, 0.0);
        let side = rect.height().min(1.2 * rect.width()).max(1.0);
        Lens {
            eye: target + back * distance,
            right,
            up: back.cross(&right),
            ahead: -back,
            focal: 0.5 * side / HALF_ANGLE.tan(),
            middle: rect.center(),
            distance,
            near: 0.02 * distance,
        }
    }

    /// What is looked at.
    pub fn target(&self) -> Vector3<f32> {
        self.eye + self.ahead * self.distance
    }

    /// Right, up and depth of a point, m.
    pub fn seen(&self, point: Vector3<f32>) -> Vector3<f32> {
        let d = point - self.eye;
        Vector3::new(d.dot(&self.right), d.dot(&self.up), d.dot(&self.ahead))
    }

    /// Where what is seen there falls in the window; its depth must not be below `near`.
    pub fn fall(&self, seen: Vector3<f32>) -> Pos2 {
        let scale = self.focal / seen.z;
        pos2(self.middle.x + seen.x * scale, self.middle.y - seen.y * scale)
    }

    /// Where a point falls in the window, unless it is behind the camera or too near.
    pub fn project(&self, point: Vector3<f32>) -> Option<Pos2> {
        let seen = self.seen(point);
        (seen.z >= self.near).then(|| self.fall(seen))
    }

    /// Direction in which a place in the window is seen, of depth 1.
    fn slope(&self, at: Pos2) -> Vector3<f32> {
        let d = (at - self.middle) / self.focal;
        self.right * d.x - self.up * d.y + self.ahead
    }

    /// Direction in which a place in the window is seen, unit.
    pub fn ray(&self, at: Pos2) -> Vector3<f32> {
        self.slope(at).normalize()
    }

    /// The point seen at a place in the window in the plane through `point` that faces the camera.
    pub fn beside(&self, point: Vector3<f32>, at: Pos2) -> Vector3<f32> {
        self.eye + self.slope(at) * self.seen(point).z.max(self.near)
    }

    /// Height of the horizon in the window.
    pub fn horizon(&self) -> f32 {
        // Directly from above the horizon is nowhere.
        let level = (self.up.z * self.up.z).max(1e-6).sqrt();
        self.middle.y + self.focal * (self.ahead.z / level).clamp(-50.0, 50.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lens(angles: [f32; 2]) -> Lens {
        let rect = Rect::from_min_max(pos2(100.0, 50.0), pos2(900.0, 650.0));
        Lens::new(rect, Vector3::new(0.3, -0.2, 0.5), angles, 4.0)
    }

    #[test]
    fn what_is_projected_is_found_again_at_its_depth() {
        for angles in [[-1.0, 0.4], [2.5, 0.0], [0.0, 1.55]] {
            let lens = lens(angles);
            for point in [[0.0, 0.0, 0.0], [1.0, -0.5, 0.7], [0.3, -0.2, 0.5]].map(Vector3::from) {
                let at = lens.project(point).expect("it is in front");
                assert!((lens.beside(point, at) - point).norm() < 1e-4);
                let along = (point - lens.eye).normalize();
                assert!((lens.ray(at) - along).norm() < 1e-4);
            }
        }
    }

    #[test]
    fn the_target_falls_in_the_middle_and_up_is_up() {
        let lens = lens([-1.0, 0.4]);
        let target = Vector3::new(0.3, -0.2, 0.5);
        let at = lens.project(target).expect("it is in front");
        assert!((at - pos2(500.0, 350.0)).length() < 1e-2);
        let above = lens.project(target + Vector3::z() * 0.1).expect("it is in front");
        assert!(above.y < at.y && (above.x - at.x).abs() < 1e-2);
        let right = lens.project(target + lens.right).expect("it is in front");
        assert!(right.x > at.x);
    }

    #[test]
    fn what_is_behind_the_camera_is_not_projected() {
        let lens = lens([-1.0, 0.4]);
        assert_eq!(lens.project(lens.eye - lens.ahead), None);
    }

    #[test]
    fn far_ground_falls_on_the_horizon() {
        let lens = lens([-1.0, 0.4]);
        let far = Vector3::new(lens.ahead.x, lens.ahead.y, 0.0) * 1e5;
        let at = lens.project(far).expect("it is in front");
        assert!((at.y - lens.horizon()).abs() < 0.1, "{} {}", at.y, lens.horizon());
    }
}
