//! What stands in the scene: how large a barrel is, and where and how it is at one instant.

use crate::channel::{Frame, Id};
use hil_sim::plant::{Body, Load};
use nalgebra::{Quaternion, UnitQuaternion};

/// Sizes of a barrel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// Radius of the cylinder, m.
    pub radius: f32,
    /// Its length, m.
    pub length: f32,
    /// Largest commanded distance of a weight from the middle, m.
    pub range: f32,
    /// Distance between the two slider axes along the cylinder axis, m: the first lies at −shift/2, the second at +shift/2.
    pub axes_shift: f32,
    /// Radius of a weight, m; 0 for a point, which is drawn as the chapter's sphere of a seventh of the radius.
    pub weight_radius: f32,
    /// What the whole barrel weighs, N. A hand's pull and the arrows are measured by it.
    pub weight: f32,
}

impl From<&Body> for Shape {
    fn from(body: &Body) -> Self {
        Shape {
            radius: body.radius as f32,
            length: body.length as f32,
            range: body.range as f32,
            axes_shift: body.axes_shift as f32,
            weight_radius: body.weight_radius as f32,
            weight: ((body.shell_mass + 2.0 * body.weight_mass) * body.gravity) as f32,
        }
    }
}

impl Shape {
    /// Where the two slider axes cross the cylinder axis, m from the middle.
    pub(super) fn shifts(&self) -> [f32; 2] {
        [-0.5 * self.axes_shift, 0.5 * self.axes_shift]
    }

    /// Radius that a weight is drawn with, m.
    pub(super) fn ball(&self) -> f32 {
        if self.weight_radius > 0.0 { self.weight_radius.max(0.08 * self.radius) } else { self.radius / 7.0 }
    }
}

/// Where and how a barrel is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Middle of the cylinder, world axes, m.
    pub position: [f32; 3],
    /// Quaternion (w, x, y, z) from body to world axes; it need not be of unit length.
    pub orientation: [f32; 4],
    /// Positions of the weights on their axes, m.
    pub weights: [f32; 2],
    /// Where the servo wants them, m, if known.
    pub targets: Option<[f32; 2]>,
    /// What pushes it.
    pub load: Load,
}

impl Pose {
    /// The pose that a frame tells of; `None` if neither an attitude nor both inclinations are known.
    ///
    /// A robot tells its inclinations only. From them follow tilt and roll; the heading is not observable and taken as 0,
    /// of the two tilts that fit, the one with the positive end of the cylinder axis up. The robot is put on the ground, as
    /// far along X as `phi` says, and its weights, if no position is known, where the motor values want them.
    pub fn of(frame: &Frame, shape: &Shape) -> Option<Pose> {
        let known = |id: Id| Some(frame.get(id)).filter(|number| number.is_finite());
        let two = |first: Id, second: Id| Some([known(first)?, known(second)?]);
        let attitude = || Some([known(Id::Qw)?, known(Id::Qx)?, known(Id::Qy)?, known(Id::Qz)?]);
        let position = || Some([known(Id::Px)?, known(Id::Py)?, known(Id::Pz)?]);
        let (position, orientation) = match attitude().zip(position()) {
            Some((orientation, position)) => (position, orientation),
            None => standing(two(Id::X1, Id::X2)?, known(Id::Phi), shape),
        };
        let commanded = || two(Id::Y1, Id::Y2).map(|y| y.map(|y| -shape.range * y));
        let force = |id: Id| f64::from(known(id).unwrap_or(0.0));
        Some(Pose {
            position,
            orientation,
            weights: two(Id::S1, Id::S2).or_else(commanded).unwrap_or([0.0; 2]),
            targets: two(Id::Target1, Id::Target2),
            load: Load {
                axis_torque: force(Id::Torque),
                force_world: [Id::ForceX, Id::ForceY, Id::ForceZ].map(force),
                torque_world: [0.0; 3],
            },
        })
    }

    /// Between two poses, `a` at u = 0 and `b` at u = 1: positions on a line, orientations by normalised linear interpolation
    /// on the shorter way. What pushes is that of `b`, as a push is held until the next step.
    pub fn between(a: &Pose, b: &Pose, u: f32) -> Pose {
        let mix = |a: f32, b: f32| a + (b - a) * u;
        let dot: f32 = a.orientation.iter().zip(&b.orientation).map(|(a, b)| a * b).sum();
        let side = if dot < 0.0 { -1.0 } else { 1.0 };
        let mixed: [f32; 4] = core::array::from_fn(|i| mix(a.orientation[i], side * b.orientation[i]));
        let size = mixed.iter().map(|part| part * part).sum::<f32>().sqrt();
        Pose {
            position: core::array::from_fn(|i| mix(a.position[i], b.position[i])),
            orientation: if size > 1e-6 { mixed.map(|part| part / size) } else { b.orientation },
            weights: core::array::from_fn(|i| mix(a.weights[i], b.weights[i])),
            targets: a.targets.zip(b.targets).map(|(a, b)| core::array::from_fn(|i| mix(a[i], b[i]))).or(b.targets),
            load: b.load,
        }
    }

    /// From body to world axes.
    pub(super) fn rotation(&self) -> UnitQuaternion<f32> {
        let [w, x, y, z] = self.orientation;
        UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-6).unwrap_or_default()
    }

    /// Whether every number of it can be drawn.
    pub(super) fn is_finite(&self) -> bool {
        let all = |numbers: &[f32]| numbers.iter().all(|number| number.is_finite());
        let pushes = [self.load.force_world, self.load.torque_world];
        all(&self.position)
            && all(&self.orientation)
            && all(&self.weights)
            && self.targets.is_none_or(|targets| all(&targets))
            && self.load.axis_torque.is_finite()
            && pushes.as_flattened().iter().all(|number| number.is_finite())
    }
}

/// Of a barrel whose attitude is not known but by x: below this tilt it is taken to lie, beyond that the tilt counts whole, rad.
const LIES: f32 = 0.3;
const STANDS: f32 = 0.5;

/// Position and orientation of a barrel on the ground with inclinations `x`, heading 0.
fn standing(x: [f32; 2], phi: Option<f32>, shape: &Shape) -> ([f32; 3], [f32; 4]) {
    let [x1, x2] = x;
    let up = (1.0 - x1 * x1 - x2 * x2).max(0.0).sqrt();
    // A lying robot's x is noisy, and a little less than 1 of length looks like a large tilt: it lies until it clearly does not.
    let tilt = up.min(1.0).asin();
    let tilt = tilt * ((tilt - LIES) / (STANDS - LIES)).clamp(0.0, 1.0);
    let roll = f32::atan2(-x1, x2);
    let (sin_tilt, cos_tilt) = (0.5 * tilt).sin_cos();
    let (sin_roll, cos_roll) = (0.5 * roll).sin_cos();
    let height = shape.radius * tilt.cos() + 0.5 * shape.length * tilt.sin();
    // First the roll about Y, then the tilt about X.
    let orientation = [cos_tilt * cos_roll, sin_tilt * cos_roll, cos_tilt * sin_roll, sin_tilt * sin_roll];
    ([shape.radius * phi.unwrap_or(0.0), 0.0, height], orientation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use hil_sim::plant::{Plant, Start};
    use hil_sim::record::PlantRecord;
    use nalgebra::Vector3;

    fn shape() -> Shape {
        Shape::from(&Body::chapter())
    }

    #[test]
    fn a_pose_from_the_inclinations_alone_reproduces_them() {
        for x in [[0.0, 1.0], [-0.6, 0.8], [1.0, 0.0], [0.3, -0.2], [0.0, 0.0], [-0.5, 0.5]] {
            let mut frame = Frame::at(0.0);
            frame.set_all(Id::X1, &x);
            let pose = Pose::of(&frame, &shape()).expect("inclinations are enough");
            let turned = pose.rotation();
            let seen = [turned * Vector3::x(), turned * Vector3::z()].map(|axis| axis.z);
            assert!(seen.iter().zip(x).all(|(seen, x)| (seen - x).abs() < 1e-6), "{seen:?} {x:?}");
            assert!((turned * Vector3::y()).z > -1e-6);
        }
    }

    #[test]
    fn a_pose_from_the_inclinations_alone_touches_the_ground_with_its_lowest_rim() {
        let mut frame = Frame::at(0.0);
        frame.set_all(Id::X1, &[-0.4, 0.5]);
        frame.set(Id::Phi, 7.0);
        let pose = Pose::of(&frame, &shape()).expect("inclinations are enough");
        let turned = pose.rotation();
        let rim = |degree: f32| turned * Vector3::new(0.5 * degree.cos(), -0.5, 0.5 * degree.sin());
        let lowest = (0..3600).map(|i| rim(i as f32 * 0.1_f32.to_radians()).z).fold(f32::MAX, f32::min);
        assert!((pose.position[2] + lowest).abs() < 1e-4, "{lowest}");
        assert_eq!(pose.position[0], 3.5);
    }

    #[test]
    fn without_positions_the_weights_are_where_the_motor_values_want_them() {
        let mut frame = Frame::at(0.0);
        frame.set_all(Id::X1, &[0.0, 1.0, 0.5, -1.0]);
        assert_eq!(Pose::of(&frame, &shape()).map(|pose| pose.weights), Some([-0.15, 0.3]));
        frame.set_all(Id::S1, &[0.1, 0.2]);
        assert_eq!(Pose::of(&frame, &shape()).map(|pose| pose.weights), Some([0.1, 0.2]));
    }

    #[test]
    fn inclinations_and_attitude_of_the_simulated_barrel_give_the_same_rotation_at_heading_0() {
        let plant = Plant::new(Body::chapter(), Start::Lying { phi: 2.5, omega: 0.0 }).expect("a sound start");
        let mut told = Frame::at(0.0);
        told.set_plant(&PlantRecord::of(&plant));
        let mut sensed = Frame::at(0.0);
        sensed.set_all(Id::X1, &[-(2.5_f32.sin()), 2.5_f32.cos()]);
        let [a, b] = [told, sensed].map(|frame| Pose::of(&frame, &shape()).expect("enough is known"));
        assert!(a.rotation().angle_to(&b.rotation()) < 1e-3);
    }

    #[test]
    fn nothing_is_drawn_of_a_frame_that_knows_one_inclination() {
        let mut frame = Frame::at(0.0);
        frame.set(Id::X1, 0.5);
        assert_eq!(Pose::of(&frame, &shape()), None);
    }

    #[test]
    fn interpolation_ends_at_both_poses_and_takes_the_shorter_way() {
        let pose = |turn: f32, x: f32| Pose {
            position: [x, 0.0, 0.5],
            orientation: [(0.5 * turn).cos(), 0.0, (0.5 * turn).sin(), 0.0],
            weights: [0.1 * x, -0.1 * x],
            targets: Some([x, x]),
            load: Load::default(),
        };
        // Past half a turn the second quaternion lies on the other side of the sphere.
        let (a, b) = (pose(6.0, 1.0), pose(6.4, 2.0));
        let far = Pose { orientation: b.orientation.map(|part| -part), ..b };
        let ends = [Pose::between(&a, &far, 0.0), Pose::between(&a, &far, 1.0)];
        for (end, given) in ends.iter().zip([&a, &b]) {
            assert!(end.rotation().angle_to(&given.rotation()) < 1e-3);
            assert_eq!((end.position, end.weights, end.targets), (given.position, given.weights, given.targets));
        }
        let half = Pose::between(&a, &far, 0.5);
        assert!(half.rotation().angle_to(&pose(6.2, 1.5).rotation()) < 1e-3);
        assert_eq!(half.position[0], 1.5);
    }
}
