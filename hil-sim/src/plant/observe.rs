//! What can be read from a plant: pose, motion, energy, momentum, and what ideal instruments would say.

use super::drive::Sliders;
use super::free::rotation;
use super::{Body, Motion, Plant, Regime, about};
use nalgebra::{Matrix3, Vector3};

/// Pose and motion, whatever the regime.
struct Pose {
    position: Vector3<f64>,
    rotation: Matrix3<f64>,
    velocity: Vector3<f64>,
    /// Body axes.
    angular: Vector3<f64>,
    sliders: Sliders,
}

impl Plant {
    /// What it is made of.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// Which equations move it at present.
    pub fn regime(&self) -> Regime {
        match self.motion {
            Motion::Rolling(line) if line.loose.on_line() => Regime::Rolling,
            Motion::Rolling(_) => Regime::Plane,
            Motion::Free(_) => Regime::Free,
        }
    }

    /// World-z components of the two slider axes, in ±1: what an ideal inclination sensor gives.
    pub fn inclination(&self) -> [f64; 2] {
        match &self.motion {
            Motion::Rolling(line) => {
                let (sin, cos) = libm::sincos(line.loose.roll.angle);
                [-sin, cos]
            }
            Motion::Free(at) => {
                let turned = rotation(&at.orientation);
                [turned.m31, turned.m33]
            }
        }
    }

    /// Angular velocity about the cylinder axis, rad/s, positive rolling towards the heading.
    pub fn omega(&self) -> f64 {
        match &self.motion {
            Motion::Rolling(line) => line.loose.roll.omega,
            Motion::Free(at) => at.angular.y,
        }
    }

    /// Integral of [`omega`](Self::omega) from the start's roll, rad.
    pub fn phi(&self) -> f64 {
        match &self.motion {
            Motion::Rolling(line) => line.loose.roll.angle - line.offset,
            Motion::Free(at) => at.phi,
        }
    }

    /// Positions of the weights on their axes, m.
    pub fn weights(&self) -> [f64; 2] {
        self.sliders().s
    }

    /// Velocities of the weights along their axes, m/s.
    pub fn weight_rates(&self) -> [f64; 2] {
        self.sliders().v
    }

    /// What the drives are told: where the weights shall be, m, for a servo; duties for motors.
    pub fn command(&self) -> [f64; 2] {
        self.told.value
    }

    /// Position of the middle of the cylinder, world axes, m.
    pub fn position(&self) -> [f64; 3] {
        self.pose().position.into()
    }

    /// Velocity of the middle of the cylinder, world axes, m/s.
    pub fn velocity(&self) -> [f64; 3] {
        self.pose().velocity.into()
    }

    /// Angular velocity, world axes, rad/s.
    pub fn angular_velocity(&self) -> [f64; 3] {
        let pose = self.pose();
        (pose.rotation * pose.angular).into()
    }

    /// Angular velocity, body axes, rad/s: what an ideal gyroscope gives.
    pub fn angular_velocity_body(&self) -> [f64; 3] {
        self.pose().angular.into()
    }

    /// The body's axes X (first slider), Y (cylinder), Z (second slider) in world axes.
    pub fn axes(&self) -> [[f64; 3]; 3] {
        let r = self.pose().rotation;
        [r.column(0).into_owned().into(), r.column(1).into_owned().into(), r.column(2).into_owned().into()]
    }

    /// Quaternion (w, x, y, z) from body to world axes.
    pub fn orientation(&self) -> [f64; 4] {
        let q = match &self.motion {
            Motion::Rolling(line) => {
                let heading = libm::atan2(line.heading[1], line.heading[0]);
                about(Vector3::z(), heading) * about(Vector3::y(), line.loose.roll.angle)
            }
            Motion::Free(at) => at.orientation,
        };
        [q.w, q.i, q.j, q.k]
    }

    /// Angle of the cylinder axis from the horizontal, rad, in ±π/2; positive with +Y up.
    pub fn tilt(&self) -> f64 {
        match &self.motion {
            Motion::Rolling(_) => 0.0,
            Motion::Free(at) => {
                let axis = rotation(&at.orientation).column(1).into_owned();
                libm::atan2(axis.z, (axis.x * axis.x + axis.y * axis.y).sqrt())
            }
        }
    }

    /// Kinetic, potential (zero with everything at ground level) and elastic energy of ground, friction and end stops, J. The servo's
    /// spring is an input and not part of it.
    pub fn energy(&self) -> f64 {
        let pose = self.pose();
        let (n, w, g) = (&self.inertia, &pose.angular, self.inertia.gravity);
        let mut sum = 0.5 * n.shell * pose.velocity.norm_squared() + n.shell * g * pose.position.z;
        sum += 0.5 * (n.axial * w.y * w.y + n.transverse * (w.x * w.x + w.z * w.z));
        for i in 0..2 {
            let (at, velocity) = self.weight_motion(&pose, i);
            sum += 0.5 * n.weight * velocity.norm_squared() + n.weight * g * at.z;
            sum += 0.5 * n.rotor * pose.sliders.v[i] * pose.sliders.v[i];
            sum += self.axis.energy(pose.sliders.s[i], pose.sliders.memory[i]);
        }
        sum + match &self.motion {
            Motion::Rolling(line) => line.stored,
            Motion::Free(at) => self.ground_energy(at),
        }
    }

    /// Angular momentum about the common centre of mass, world axes, N·m·s.
    pub fn angular_momentum(&self) -> [f64; 3] {
        let pose = self.pose();
        let (n, w) = (&self.inertia, &pose.angular);
        let parts = [
            (n.shell, pose.position, pose.velocity),
            {
                let (p, v) = self.weight_motion(&pose, 0);
                (n.weight, p, v)
            },
            {
                let (p, v) = self.weight_motion(&pose, 1);
                (n.weight, p, v)
            },
        ];
        let total = n.total();
        let centre = parts.iter().map(|(m, p, _)| p * *m).sum::<Vector3<f64>>() / total;
        let mut sum = pose.rotation * Vector3::new(n.transverse * w.x, n.axial * w.y, n.transverse * w.z);
        for (m, p, v) in parts {
            sum += (p - centre).cross(&(v * m));
        }
        sum.into()
    }

    /// Deepest any rim has been below ground since the start, m.
    pub fn max_penetration(&self) -> f64 {
        self.deepest
    }

    /// Acceleration less gravity of a point fixed in the shell (body axes, m), in body axes, m/s²: what an ideal
    /// accelerometer there gives.
    pub fn specific_force(&self, point: [f64; 3]) -> [f64; 3] {
        let (linear, alpha, down) = match &self.motion {
            Motion::Rolling(line) => {
                let (sin, cos) = libm::sincos(line.loose.roll.angle);
                let push = self.push(line);
                let given = self.given(&self.told, &push, self.body.step);
                let (ahead, up, alpha) = if line.loose.on_line() {
                    let a = self.line.instant(&given, &line.loose.roll, (sin, cos)).omega_dot;
                    (self.body.radius * a, 0.0, a)
                } else {
                    let course = self.line.riding(&given, &line.loose);
                    (course.ahead, course.up, course.alpha)
                };
                let linear = Vector3::new(ahead * cos - up * sin, 0.0, ahead * sin + up * cos);
                (linear, Vector3::new(0.0, alpha, 0.0), [-sin, 0.0, cos])
            }
            Motion::Free(at) => {
                let (_, a, _) = self.laws().rate(at, &self.told, &self.load);
                let turned = rotation(&at.orientation);
                (a.linear, a.angular, [turned.m31, turned.m32, turned.m33])
            }
        };
        let (r, w) = (Vector3::from(point), Vector3::from(self.angular_velocity_body()));
        let up = Vector3::from(down) * self.inertia.gravity;
        (linear + alpha.cross(&r) + w.cross(&w.cross(&r)) + up).into()
    }

    /// As [`specific_force`](Self::specific_force), where somebody sees to it that the barrel turns evenly.
    pub fn specific_force_in_hand(&self, point: [f64; 3]) -> [f64; 3] {
        let (r, w) = (Vector3::from(point), Vector3::from(self.angular_velocity_body()));
        let up = Vector3::from(self.axes().map(|axis| axis[2]));
        (w.cross(&w.cross(&r)) + up * self.inertia.gravity).into()
    }

    fn weight_motion(&self, pose: &Pose, i: usize) -> (Vector3<f64>, Vector3<f64>) {
        let e = if i == 0 { Vector3::x() } else { Vector3::z() };
        let r = e * pose.sliders.s[i] + Vector3::y() * self.inertia.shift[i];
        let inside = pose.angular.cross(&r) + e * pose.sliders.v[i];
        (pose.position + pose.rotation * r, pose.velocity + pose.rotation * inside)
    }

    fn pose(&self) -> Pose {
        match &self.motion {
            Motion::Rolling(line) => {
                let (sin, cos) = libm::sincos(line.loose.roll.angle);
                let [c, s] = line.heading;
                Pose {
                    position: self.line_position(line),
                    rotation: Matrix3::new(cos * c, -s, sin * c, cos * s, c, sin * s, -sin, 0.0, cos),
                    velocity: self.line_velocity(line),
                    angular: Vector3::new(0.0, line.loose.roll.omega, 0.0),
                    sliders: line.loose.roll.sliders,
                }
            }
            Motion::Free(at) => Pose {
                position: at.position,
                rotation: rotation(&at.orientation),
                velocity: at.velocity,
                angular: at.angular,
                sliders: at.sliders,
            },
        }
    }
}
