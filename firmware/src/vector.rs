//! Vectors of three, for what runs a thousand times a second: written out, as a compiler that optimises for size leaves a matrix
//! library's loops over three elements as loops. Results are those of `nalgebra`, bit for bit.

use core::ops::{Add, Div, Mul, Sub};

use nalgebra::Vector3;

/// Three numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Vec3 {
    pub x: f32,
    pub y: f32,
    pub z: f32,
}

impl Vec3 {
    pub const ZERO: Vec3 = Vec3 { x: 0.0, y: 0.0, z: 0.0 };

    pub fn cross(self, b: Vec3) -> Vec3 {
        Vec3 { x: self.y * b.z - self.z * b.y, y: self.z * b.x - self.x * b.z, z: self.x * b.y - self.y * b.x }
    }

    pub fn norm_squared(self) -> f32 {
        self.x * self.x + self.y * self.y + self.z * self.z
    }

    pub fn clamp(self, low: f32, high: f32) -> Vec3 {
        Vec3 { x: self.x.clamp(low, high), y: self.y.clamp(low, high), z: self.z.clamp(low, high) }
    }

    pub fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.z.is_finite()
    }
}

impl Add for Vec3 {
    type Output = Vec3;
    fn add(self, b: Vec3) -> Vec3 {
        Vec3 { x: self.x + b.x, y: self.y + b.y, z: self.z + b.z }
    }
}

impl Sub for Vec3 {
    type Output = Vec3;
    fn sub(self, b: Vec3) -> Vec3 {
        Vec3 { x: self.x - b.x, y: self.y - b.y, z: self.z - b.z }
    }
}

impl Mul<f32> for Vec3 {
    type Output = Vec3;
    fn mul(self, b: f32) -> Vec3 {
        Vec3 { x: self.x * b, y: self.y * b, z: self.z * b }
    }
}

impl Div<f32> for Vec3 {
    type Output = Vec3;
    fn div(self, b: f32) -> Vec3 {
        Vec3 { x: self.x / b, y: self.y / b, z: self.z / b }
    }
}

impl From<Vector3<f32>> for Vec3 {
    fn from(v: Vector3<f32>) -> Vec3 {
        Vec3 { x: v.x, y: v.y, z: v.z }
    }
}

impl From<Vec3> for Vector3<f32> {
    fn from(v: Vec3) -> Vector3<f32> {
        Vector3::new(v.x, v.y, v.z)
    }
}
