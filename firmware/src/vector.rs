//! Vectors of three, for what runs a thousand times a second: written out, as a compiler that optimises for size leaves a matrix
//! library's loops over three elements as loops. Results are those of `nalgebra`, bit for bit.

use core::ops::{Add, Div, Mul, Sub};

use nalgebra::Vector3;

use crate::scalar::Scalar;

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

    pub fn clamp_to(self, low: f32, high: f32) -> Vec3 {
        Vec3 { x: self.x.clamp_to(low, high), y: self.y.clamp_to(low, high), z: self.z.clamp_to(low, high) }
    }

    pub fn is_finite(self) -> bool {
        are_finite([self.x, self.y, self.z])
    }
}

/// Whether all of them are finite, with one comparison: nothing times a finite number is nothing, times anything else not a number.
pub(crate) fn are_finite<const N: usize>(numbers: [f32; N]) -> bool {
    numbers.into_iter().fold(0.0, |sum, number| sum + 0.0 * number) == 0.0
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
