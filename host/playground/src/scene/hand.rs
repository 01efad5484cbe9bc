//! A hand on the barrel: the mouse takes hold of a point of it and pulls or twists.

use super::lens::Lens;
use super::pose::{Pose, Shape};
use eframe::egui::{Pos2, Vec2, vec2};
use hil_sim::plant::Load;
use nalgebra::Vector3;

/// The most that a hand pulls, of the barrel's weight.
const STRONGEST: f32 = 1.5;
/// Distance at which it pulls that hard, radii.
const REACH: f32 = 2.0;
/// A hand pulls with all its force after this time, s.
const RAMP: f32 = 0.3;
/// It pulls on the point where the grabbed one will be after this time, s: that makes up for the time that orders take, and
/// damps.
const LEAD: f32 = 0.15;
/// The speed of the grabbed point is known after about this time, s.
const SMOOTH: f32 = 0.05;
/// Distance in the window at which a twist is strongest, points.
const TURN: f32 = 200.0;

/// A hand that holds a point of the barrel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hand {
    /// The point, body axes, m.
    point: Vector3<f32>,
    /// Where the mouse took hold, in the window.
    pressed: Pos2,
    /// The way in the window that twists it in the positive sense, of length 1; `None` if it pulls.
    twist: Option<Vec2>,
    /// For how long it holds, s.
    held: f32,
    /// Where the point was, world axes, m.
    last: Option<Vector3<f64>>,
    /// Its speed, m/s.
    speed: Vector3<f32>,
}

/// What a hand does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pull {
    /// The point that it holds, m from the scene's origin.
    pub point: Vector3<f32>,
    /// Force, N, or torque, N·m.
    pub size: f32,
    /// Whether it is a torque.
    pub twists: bool,
    /// What the barrel feels.
    pub load: Load,
}

impl Hand {
    /// Takes hold where the mouse is, if the barrel is there. `middle` is the middle of the cylinder, m from the scene's
    /// origin.
    pub fn take(shape: &Shape, pose: &Pose, middle: Vector3<f32>, lens: &Lens, at: Pos2, twist: bool) -> Option<Hand> {
        let point = hit(shape, pose, middle, lens.eye, lens.ray(at))?;
        let axis = pose.rotation() * Vector3::y();
        let arm = pose.rotation() * point;
        // Where the grabbed point would go; near the middle of an end, where the top of the barrel would.
        let way = axis.cross(&(arm - axis * axis.dot(&arm)));
        let way = if way.norm() > 0.2 * shape.radius { way } else { axis.cross(&lens.up) };
        let way = vec2(way.dot(&lens.right), -way.dot(&lens.up));
        let way = if way.length() > 1e-6 { way.normalized() } else { vec2(1.0, 0.0) };
        Some(Hand { point, pressed: at, twist: twist.then_some(way), held: 0.0, last: None, speed: Vector3::zeros() })
    }

    /// Pulls for `dt` seconds with the mouse at `at`.
    pub fn pull(&mut self, shape: &Shape, pose: &Pose, middle: Vector3<f32>, lens: &Lens, at: Pos2, dt: f32) -> Pull {
        self.held += dt;
        let ramp = (self.held / RAMP).min(1.0);
        let arm = pose.rotation() * self.point;
        let point = middle + arm;
        if let Some(way) = self.twist {
            let part = ((at - self.pressed).dot(way) / TURN).clamp(-1.0, 1.0);
            let torque = part * ramp * shape.weight * shape.radius;
            let load = Load { axis_torque: f64::from(torque), ..Load::default() };
            return Pull { point, size: torque.abs(), twists: true, load };
        }
        let now = Vector3::from(pose.position.map(f64::from)) + arm.cast::<f64>();
        if let Some(last) = self.last.replace(now)
            && dt > 0.0
        {
            let fresh = ((now - last) / f64::from(dt)).cast::<f32>();
            self.speed += (fresh - self.speed) * (1.0 - (-dt / SMOOTH).exp());
        }
        let most = STRONGEST * shape.weight;
        let stretch = lens.beside(point, at) - point - self.speed * LEAD;
        let mut force = stretch * (most / (REACH * shape.radius));
        let size = force.norm();
        if size > most {
            force *= most / size;
        }
        force *= ramp;
        let torque = arm.cross(&force);
        let load = Load {
            axis_torque: 0.0,
            force_world: force.cast::<f64>().into(),
            torque_world: torque.cast::<f64>().into(),
        };
        Pull { point, size: force.norm(), twists: false, load }
    }
}

/// Where a ray from `eye` along `ray` meets the barrel, body axes, m: its side or an end.
pub(super) fn hit(
    shape: &Shape,
    pose: &Pose,
    middle: Vector3<f32>,
    eye: Vector3<f32>,
    ray: Vector3<f32>,
) -> Option<Vector3<f32>> {
    let back = pose.rotation().inverse();
    let (from, along) = (back * (eye - middle), back * ray);
    let (radius, half) = (shape.radius, 0.5 * shape.length);
    // The ray is inside between these, of its length: of the side, then of the two ends.
    let a = along.x * along.x + along.z * along.z;
    let b = from.x * along.x + from.z * along.z;
    let c = from.x * from.x + from.z * from.z - radius * radius;
    let mut inside = if a > 1e-9 {
        let root = b * b - a * c;
        if root < 0.0 {
            return None;
        }
        [(-b - root.sqrt()) / a, (-b + root.sqrt()) / a]
    } else if c < 0.0 {
        [f32::MIN, f32::MAX]
    } else {
        return None;
    };
    if along.y.abs() > 1e-9 {
        let ends = [(-half - from.y) / along.y, (half - from.y) / along.y];
        inside = [inside[0].max(ends[0].min(ends[1])), inside[1].min(ends[0].max(ends[1]))];
    } else if from.y.abs() > half {
        return None;
    }
    let [enters, leaves] = inside;
    let first = if enters > 0.0 { enters } else { leaves };
    (enters <= leaves && first > 0.0).then(|| from + along * first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::{Rect, pos2, vec2};
    use hil_sim::plant::Body;

    fn shape() -> Shape {
        Shape::from(&Body::chapter())
    }

    /// Lying, heading 0.
    fn lying() -> Pose {
        Pose {
            position: [0.0, 0.0, 0.5],
            orientation: [1.0, 0.0, 0.0, 0.0],
            weights: [0.0; 2],
            targets: None,
            load: Load::default(),
        }
    }

    const MIDDLE: Vector3<f32> = Vector3::new(0.0, 0.0, 0.5);

    /// From −Y: X is to the right, the cylinder axis points into the window.
    fn lens() -> Lens {
        let rect = Rect::from_min_max(pos2(0.0, 0.0), pos2(800.0, 600.0));
        Lens::new(rect, MIDDLE, [-core::f32::consts::FRAC_PI_2, 0.0], 4.0)
    }

    fn meets(from: [f32; 3], along: [f32; 3]) -> Option<[f32; 3]> {
        hit(&shape(), &lying(), MIDDLE, from.into(), Vector3::from(along).normalize()).map(Into::into)
    }

    fn near(a: Option<[f32; 3]>, b: [f32; 3]) -> bool {
        a.is_some_and(|a| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4))
    }

    #[test]
    fn a_ray_meets_the_side_or_an_end_first() {
        assert!(near(meets([0.0, 0.2, 3.0], [0.0, 0.0, -1.0]), [0.0, 0.2, 0.5]));
        assert!(near(meets([0.3, -4.0, 0.6], [0.0, 1.0, 0.0]), [0.3, -0.5, 0.1]));
        assert!(near(meets([0.0, -4.5, 0.5], [0.0, 4.0, 0.25]), [0.0, -0.5, 0.25]));
    }

    #[test]
    fn a_ray_beside_behind_or_past_the_barrel_meets_nothing() {
        assert_eq!(meets([0.0, 0.6, 3.0], [0.0, 0.0, -1.0]), None);
        assert_eq!(meets([0.6, -4.0, 0.5], [0.0, 1.0, 0.0]), None);
        assert_eq!(meets([0.0, -4.0, 0.5], [0.0, -1.0, 0.0]), None);
        // Within the widened slabs of side and ends, but never in both at once.
        assert_eq!(meets([-2.0, 0.0, 0.5], [1.0, 1.0, 0.0]), None);
    }

    #[test]
    fn the_turned_barrel_is_met_where_it_is() {
        let turned = Pose { orientation: [0.5_f32.sqrt(), 0.5_f32.sqrt(), 0.0, 0.0], ..lying() };
        let point = hit(&shape(), &turned, MIDDLE, Vector3::new(0.0, 0.0, 4.0), -Vector3::z()).expect("it is below");
        assert!((point - Vector3::new(0.0, 0.5, 0.0)).norm() < 1e-4, "{point}");
    }

    fn hand(twist: bool) -> (Hand, Lens) {
        let lens = lens();
        let hand = Hand::take(&shape(), &lying(), MIDDLE, &lens, pos2(400.0, 300.0), twist);
        (hand.expect("the barrel is in the middle"), lens)
    }

    fn pull(hand: &mut Hand, lens: &Lens, at: Pos2, dt: f32) -> Pull {
        hand.pull(&shape(), &lying(), MIDDLE, lens, at, dt)
    }

    #[test]
    fn force_ramps_up_towards_the_mouse_and_is_limited() {
        let (mut hand, lens) = hand(false);
        let at = pos2(500.0, 300.0);
        let sizes: Vec<f32> = (0..30).map(|_| pull(&mut hand, &lens, at, 0.02).size).collect();
        assert!(sizes[0] < 0.1 * sizes[29]);
        assert!(sizes[..14].windows(2).all(|pair| pair[0] < pair[1]));
        assert_eq!(sizes[20], sizes[29]);
        let away = pull(&mut hand, &lens, pos2(500_000.0, 300.0), 0.02);
        assert!((away.size - STRONGEST * shape().weight).abs() < 1e-2);
        assert!(away.load.force_world[0] > 0.99 * f64::from(away.size));
    }

    #[test]
    fn force_grows_with_the_distance_of_the_mouse_and_is_nothing_at_the_point() {
        let (mut hand, lens) = hand(false);
        pull(&mut hand, &lens, pos2(400.0, 300.0), 1.0);
        let [none, one, two] = [0.0, 50.0, 100.0].map(|x| pull(&mut hand, &lens, pos2(400.0 + x, 300.0), 0.02).size);
        assert!(none < 1e-3);
        assert!((two - 2.0 * one).abs() < 1e-3 * two, "{one} {two}");
    }

    #[test]
    fn a_force_off_the_middle_turns_too() {
        let lens = lens();
        // At the top of the near end: pulled to the right, it rolls to the right.
        let at = lens.project(Vector3::new(0.0, -0.5, 0.9)).expect("it is in front");
        let mut hand =
            Hand::take(&shape(), &lying(), MIDDLE, &lens, at, false).expect("the end is where it was projected");
        let load = pull(&mut hand, &lens, at + vec2(80.0, 0.0), 1.0).load;
        let [fx, fy, fz] = load.force_world;
        let expected = Vector3::new(0.0, -0.5, 0.4).cross(&Vector3::new(fx, fy, fz));
        assert!((Vector3::from(load.torque_world) - expected).norm() < 1e-3 * expected.norm());
        assert!(load.torque_world[1] > 0.0);
    }

    #[test]
    fn a_point_that_comes_to_the_mouse_is_braked() {
        let (mut hand, lens) = hand(false);
        let at = pos2(460.0, 300.0);
        let still = pull(&mut hand, &lens, at, 1.0).load.force_world[0];
        let mut pose = lying();
        pose.position[0] = 0.02;
        let moving = hand.pull(&shape(), &pose, MIDDLE, &lens, at, 0.02).load.force_world[0];
        assert!(moving < still);
    }

    #[test]
    fn a_twist_is_a_torque_about_the_axis_limited_to_weight_times_radius() {
        let (mut hand, lens) = hand(true);
        let loads = [-1e4, -50.0, 0.0, 50.0, 1e4].map(|x| pull(&mut hand, &lens, pos2(400.0 + x, 300.0), 1.0).load);
        let most = f64::from(shape().weight * shape().radius);
        let torques = loads.map(|load| load.axis_torque);
        for (torque, part) in torques.iter().zip([-1.0, -0.25, 0.0, 0.25, 1.0]) {
            assert!((torque - part * most).abs() < 1e-4 * most, "{torques:?}");
        }
        assert!(loads.iter().all(|load| load.force_world == [0.0; 3] && load.torque_world == [0.0; 3]));
    }
}
