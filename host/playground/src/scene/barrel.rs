//! The barrel: a glass shell, and in it two axes with their weights.

use super::canvas::Canvas;
use super::paint::{Paint, Palette, gleaming, gloss, lit};
use super::pose::{Pose, Shape};
use core::f32::consts::TAU;
use nalgebra::{Rotation3, Vector3};

/// Quadrangles around the shell, and sides of a rod.
const SECTORS: usize = 64;
const SIDES: usize = 12;
/// Rings and sectors of what is seen of a weight.
const BALL: (usize, usize) = (7, 30);
/// Lines along the shell. The axes end at two of them.
const LINES: usize = 8;

/// Radius of a rod, and of the hub that joins rods that cross, radii.
const ROD: f32 = 0.026;
const HUB: f32 = 0.05;
const STEEL: Paint = Paint { rgb: [0.62, 0.64, 0.67], alpha: 1.0 };

/// How the barrel stands on the floor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Touch {
    /// It does not.
    Nothing,
    /// On a line of its side, from rim to rim; of no length: on a point of a rim.
    Line([Vector3<f32>; 2]),
    /// On one of its ends: 0 at −Y, 1 at +Y of the body.
    Face(usize),
}

/// A barrel in its place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed<'a> {
    pub shape: &'a Shape,
    pub pose: &'a Pose,
    /// Middle of the cylinder, m from the scene's origin.
    pub middle: Vector3<f32>,
    turned: Rotation3<f32>,
}

/// Whether a part of a surface faces the camera.
fn faces(eye: Vector3<f32>, point: Vector3<f32>, normal: Vector3<f32>) -> bool {
    normal.dot(&(eye - point)) > 0.0
}

impl<'a> Placed<'a> {
    /// With its middle at `middle`, m from the scene's origin.
    pub fn new(shape: &'a Shape, pose: &'a Pose, middle: Vector3<f32>) -> Self {
        Placed { shape, pose, middle, turned: pose.rotation().to_rotation_matrix() }
    }

    fn direction(&self, x: f32, y: f32, z: f32) -> Vector3<f32> {
        self.turned * Vector3::new(x, y, z)
    }

    /// The cylinder axis, unit.
    pub fn axis(&self) -> Vector3<f32> {
        self.direction(0.0, 1.0, 0.0)
    }

    /// Outwards from the cylinder axis, `angle` from body X towards Z, unit.
    pub fn outward(&self, angle: f32) -> Vector3<f32> {
        self.direction(angle.cos(), 0.0, angle.sin())
    }

    /// From the middle to a point, body axes, m.
    pub fn in_body(&self, point: Vector3<f32>) -> Vector3<f32> {
        self.turned.inverse() * (point - self.middle)
    }

    /// A point of the side, `along` from the middle, m.
    fn side(&self, angle: f32, along: f32) -> Vector3<f32> {
        self.middle + self.axis() * along + self.outward(angle) * self.shape.radius
    }

    /// A point of the rim at an end: 0 at −Y, 1 at +Y of the body.
    pub fn rim(&self, end: usize, angle: f32) -> Vector3<f32> {
        self.side(angle, (end as f32 - 0.5) * self.shape.length)
    }

    /// Slider axis `i`: where it crosses the cylinder axis, and its direction.
    fn slider(&self, i: usize) -> (Vector3<f32>, Vector3<f32>) {
        let direction = if i == 0 { self.direction(1.0, 0.0, 0.0) } else { self.direction(0.0, 0.0, 1.0) };
        (self.middle + self.axis() * self.shape.shifts()[i], direction)
    }

    /// A point of slider axis `i`, `s` from the middle, m.
    fn on_slider(&self, i: usize, s: f32) -> Vector3<f32> {
        let (middle, direction) = self.slider(i);
        middle + direction * s
    }

    /// The middles of the weights.
    pub fn balls(&self) -> [Vector3<f32>; 2] {
        [0, 1].map(|i| self.on_slider(i, self.pose.weights[i]))
    }

    /// Where it touches the floor.
    pub fn touch(&self) -> Touch {
        let axis = self.axis();
        let radius = self.shape.radius;
        let down = (axis * axis.z - Vector3::z()).try_normalize(1e-4);
        let lowest = [0, 1].map(|end| {
            let middle = self.middle + axis * ((end as f32 - 0.5) * self.shape.length);
            down.map_or(middle, |down| middle + down * radius)
        });
        let touches = lowest.map(|point| point.z < 0.012 * radius);
        let on_floor = |point: Vector3<f32>| Vector3::new(point.x, point.y, 0.0);
        match touches {
            [false, false] => Touch::Nothing,
            [true, true] => Touch::Line(lowest.map(on_floor)),
            [first, _] if axis.z.abs() > 0.999_95 => Touch::Face(usize::from(!first)),
            [first, _] => Touch::Line([on_floor(lowest[usize::from(!first)]); 2]),
        }
    }

    /// Draws it: what is seen through the glass between the back and the front of the shell.
    pub fn draw(&self, canvas: &mut Canvas, palette: &Palette, targets: bool) {
        self.glass(canvas, palette, false);
        for i in 0..2 {
            self.rod(canvas, palette, i);
            self.ball(canvas, palette.weights[i], self.balls()[i], self.shape.ball());
            if let Some(targets) = self.pose.targets.filter(|_| targets) {
                self.ring(canvas, palette.weights[i], i, targets[i]);
            }
        }
        if let Some((middle, size)) = self.hub() {
            self.ball(canvas, STEEL, middle, size);
        }
        canvas.settle();
        self.glass(canvas, palette, true);
    }

    /// The glass, seen at `point`: clear where one looks through, dense where one looks along it.
    fn sheen(&self, eye: Vector3<f32>, palette: &Palette, point: Vector3<f32>, normal: Vector3<f32>) -> Paint {
        let to_eye = (eye - point).normalize();
        let cosine = normal.dot(&to_eye);
        let [clear, dense] = palette.glass;
        let paint = clear.towards(dense, (1.0 - cosine.abs()).powi(3));
        // The inner side of the back mirrors less.
        if cosine > 0.0 { gleaming(paint, 0.5 * gloss(normal, to_eye, 60.0)) } else { paint.faded(0.7) }
    }

    /// Whether the side faces the camera at this angle.
    fn side_faces(&self, eye: Vector3<f32>, angle: f32) -> bool {
        faces(eye, self.side(angle, 0.0), self.outward(angle))
    }

    /// The half of the shell that faces the camera, or the other, and the lines on it.
    fn glass(&self, canvas: &mut Canvas, palette: &Palette, front: bool) {
        let half = 0.5 * self.shape.length;
        let angle = |sector: usize| TAU * sector as f32 / SECTORS as f32;
        let eye = canvas.lens.eye;
        let ends = [0, 1].map(|end| {
            let outward = self.axis() * (2.0 * end as f32 - 1.0);
            faces(eye, self.middle + outward * half, outward)
        });
        if !front {
            self.ends(canvas, palette, ends.map(|faces| !faces));
        }
        // A band at each rim is denser: it is what the barrel rolls on.
        let band = (0.05 * self.shape.radius).min(0.2 * half);
        let along = [-half, band - half, band - half, -0.4 * half, 0.0, 0.4 * half, half - band, half - band, half];
        let paints: Vec<(Vector3<f32>, Paint)> = (0..along.len() * (SECTORS + 1))
            .map(|at| {
                let (row, sector) = (at / (SECTORS + 1), at % (SECTORS + 1));
                let point = self.side(angle(sector), along[row]);
                let paint = self.sheen(eye, palette, point, self.outward(angle(sector)));
                let banded = row < 2 || row + 2 >= along.len();
                (point, if banded { Paint { alpha: paint.alpha + 0.3 * (1.0 - paint.alpha), ..paint } } else { paint })
            })
            .collect();
        canvas.sheet(
            along.len() - 1,
            SECTORS,
            |row, sector| paints[row * (SECTORS + 1) + sector],
            |_, sector| self.side_faces(eye, angle(sector) + 0.5 * angle(1)) == front,
        );
        if front {
            self.ends(canvas, palette, ends);
        }
        self.wires(canvas, palette, front, ends);
    }

    /// The ends for which `shown` says so.
    fn ends(&self, canvas: &mut Canvas, palette: &Palette, shown: [bool; 2]) {
        for end in (0..2).filter(|&end| shown[end]) {
            let normal = self.axis() * (2.0 * end as f32 - 1.0);
            let middle = self.middle + normal * (0.5 * self.shape.length);
            let rows = 3;
            let paints: Vec<(Vector3<f32>, Paint)> = (0..(rows + 1) * (SECTORS + 1))
                .map(|at| {
                    let (row, sector) = (at / (SECTORS + 1), at % (SECTORS + 1));
                    let outward = self.outward(TAU * sector as f32 / SECTORS as f32);
                    let point = middle + outward * (self.shape.radius * row as f32 / rows as f32);
                    (point, self.sheen(canvas.lens.eye, palette, point, normal).faded(0.6))
                })
                .collect();
            canvas.sheet(rows, SECTORS, |row, sector| paints[row * (SECTORS + 1) + sector], |_, _| true);
        }
    }

    /// Rims, lines along the shell, and its outline.
    fn wires(&self, canvas: &mut Canvas, palette: &Palette, front: bool, ends: [bool; 2]) {
        let half = 0.5 * self.shape.length;
        let dim = if front { 1.0 } else { 0.45 };
        let eye = canvas.lens.eye;
        let side = |angle: f32| self.side_faces(eye, angle);
        for (end, end_faces) in ends.into_iter().enumerate() {
            let points = (0..=SECTORS).map(|sector| {
                let angle = TAU * sector as f32 / SECTORS as f32;
                // A rim is in front if one of the two faces that meet there is.
                let shown = (end_faces || side(angle)) == front;
                (self.rim(end, angle), if shown { palette.wire.faded(dim) } else { palette.wire.faded(0.0) })
            });
            canvas.stroke(points, 1.8);
        }
        for line in 0..LINES {
            let angle = TAU * line as f32 / LINES as f32;
            if side(angle) != front {
                continue;
            }
            // Where the positive ends of the axes meet the shell.
            let (paint, width) = match line {
                0 => (palette.weights[0].faded(0.8), 2.2),
                2 => (palette.weights[1].faded(0.8), 2.2),
                _ => (palette.wire.faded(0.42), 1.2),
            };
            canvas.stroke([-half, half].map(|along| (self.side(angle, along), paint.faded(dim))), width);
        }
        let to_eye = self.in_body(eye);
        let away = to_eye.xz().norm();
        if front && away > self.shape.radius {
            let (towards, open) = (f32::atan2(to_eye.z, to_eye.x), (self.shape.radius / away).acos());
            for angle in [towards - open, towards + open] {
                canvas.stroke([-half, half].map(|along| (self.side(angle, along), palette.wire)), 1.4);
            }
        }
    }

    /// A slider axis: a rod, whose positive end has a bright cap.
    fn rod(&self, canvas: &mut Canvas, palette: &Palette, i: usize) {
        let radius = self.shape.radius;
        let (middle, direction) = self.slider(i);
        let paint = palette.weights[i];
        let steel = paint.towards(STEEL, 0.45);
        let [begin, end] = [-0.985 * radius, 0.985 * radius];
        let (cap, foot) = (0.05 * radius, 0.025 * radius);
        // What is inside of a weight or of the hub is not there.
        let mut free = vec![[begin + foot, end - cap]];
        let balls = self.balls().map(|ball| (ball, self.shape.ball()));
        for (ball, size) in balls.into_iter().chain(self.hub()) {
            let along = (ball - middle).dot(&direction);
            let off = (ball - middle - direction * along).norm();
            if off < size {
                // Up to where the rod's own surface comes out, so that no gap is seen.
                let rod = ROD * radius;
                let half = (size * size - off * off - rod * rod).max(0.0).sqrt();
                free = free
                    .into_iter()
                    .flat_map(|[from, to]| [[from, to.min(along - half)], [from.max(along + half), to]])
                    .filter(|[from, to]| from < to)
                    .collect();
            }
        }
        for [from, to] in free {
            // Short pieces are sorted rightly among the other things.
            let pieces = ((to - from) / (0.1 * radius)).ceil().max(1.0) as usize;
            let cuts: Vec<f32> = (0..=pieces).map(|cut| from + (to - from) * cut as f32 / pieces as f32).collect();
            self.tube(canvas, i, &cuts, ROD * radius, steel);
        }
        self.tube(canvas, i, &[end - cap, end], 0.085 * radius, paint);
        self.disc(canvas, i, end - cap, -1.0, 0.085 * radius, paint);
        self.disc(canvas, i, end, 1.0, 0.085 * radius, paint);
        self.tube(canvas, i, &[begin, begin + foot], 0.05 * radius, steel);
        self.disc(canvas, i, begin + foot, 1.0, 0.05 * radius, steel);
        self.disc(canvas, i, begin, -1.0, 0.05 * radius, steel);
    }

    /// Across slider axis `i`, `angle` from the cylinder axis, unit.
    fn across(&self, i: usize, angle: f32) -> Vector3<f32> {
        let (_, direction) = self.slider(i);
        self.axis() * angle.cos() + direction.cross(&self.axis()) * angle.sin()
    }

    /// A tube around slider axis `i`, in pieces between `cuts`.
    fn tube(&self, canvas: &mut Canvas, i: usize, cuts: &[f32], size: f32, paint: Paint) {
        for side in 0..SIDES {
            let [a, b] = [side, side + 1].map(|side| self.across(i, TAU * side as f32 / SIDES as f32));
            let normal = (a + b).normalize();
            for pair in cuts.windows(2) {
                let [from, to] = [pair[0], pair[1]].map(|s| self.on_slider(i, s));
                if !faces(canvas.lens.eye, from + normal * size, normal) {
                    continue;
                }
                let shaded = |middle: Vector3<f32>, normal: Vector3<f32>| {
                    let point = middle + normal * size;
                    (point, lit(paint, normal, (canvas.lens.eye - point).normalize()))
                };
                let corners = [shaded(from, a), shaded(from, b), shaded(to, b), shaded(to, a)];
                canvas.solid([corners[0], corners[1], corners[2]]);
                canvas.solid([corners[0], corners[2], corners[3]]);
            }
        }
    }

    /// A disc across slider axis `i` at `s`, facing along it (`sense` = 1) or back.
    fn disc(&self, canvas: &mut Canvas, i: usize, s: f32, sense: f32, size: f32, paint: Paint) {
        let (middle, normal) = (self.on_slider(i, s), self.slider(i).1 * sense);
        if !faces(canvas.lens.eye, middle, normal) {
            return;
        }
        let paint = lit(paint, normal, (canvas.lens.eye - middle).normalize());
        for side in 0..SIDES {
            let [a, b] = [side, side + 1].map(|side| middle + self.across(i, TAU * side as f32 / SIDES as f32) * size);
            canvas.solid([(middle, paint), (a, paint), (b, paint)]);
        }
    }

    /// Middle and radius of the hub where the rods join, if they cross.
    fn hub(&self) -> Option<(Vector3<f32>, f32)> {
        let crossing = self.shape.axes_shift < 2.0 * ROD * self.shape.radius;
        crossing.then_some((self.middle, HUB * self.shape.radius))
    }

    /// A ball: the cap of it that is seen.
    fn ball(&self, canvas: &mut Canvas, paint: Paint, middle: Vector3<f32>, size: f32) {
        let to_eye = canvas.lens.eye - middle;
        let far = to_eye.norm();
        if far <= 1.001 * size {
            return;
        }
        let pole = to_eye / far;
        let right = pole.cross(&canvas.lens.up).try_normalize(1e-3).unwrap_or(canvas.lens.right);
        let up = right.cross(&pole);
        let open = (size / far).acos();
        let (rings, sectors) = BALL;
        let at = |ring: usize, sector: usize| {
            let (sin_ring, cos_ring) = (open * ring as f32 / rings as f32).sin_cos();
            let (sin, cos) = (TAU * sector as f32 / sectors as f32).sin_cos();
            let normal = pole * cos_ring + (right * cos + up * sin) * sin_ring;
            let point = middle + normal * size;
            (point, lit(paint, normal, (canvas.lens.eye - point).normalize()))
        };
        let corners: Vec<_> =
            (0..(rings + 1) * (sectors + 1)).map(|n| at(n / (sectors + 1), n % (sectors + 1))).collect();
        for ring in 0..rings {
            for sector in 0..sectors {
                let first = ring * (sectors + 1) + sector;
                let [a, b, c, d] = [first, first + 1, first + sectors + 2, first + sectors + 1].map(|n| corners[n]);
                canvas.solid([a, c, d]);
                if ring > 0 {
                    canvas.solid([a, b, c]);
                }
            }
        }
    }

    /// A thin ring around where the servo wants a weight.
    fn ring(&self, canvas: &mut Canvas, paint: Paint, i: usize, s: f32) {
        let limit = 2.0 * self.shape.radius;
        let middle = s.clamp(-limit, limit);
        let (size, half) = (1.25 * self.shape.ball(), 0.016 * self.shape.radius);
        let sides = 36;
        let paint = paint.towards(Paint { rgb: [1.0; 3], alpha: 1.0 }, 0.25);
        for side in 0..sides {
            let [a, b] = [side, side + 1].map(|side| self.across(i, TAU * side as f32 / sides as f32));
            let [from, to] = [middle - half, middle + half].map(|s| self.on_slider(i, s));
            let shaded = |middle: Vector3<f32>, outward: Vector3<f32>| {
                let point = middle + outward * size;
                let to_eye = (canvas.lens.eye - point).normalize();
                let normal = if outward.dot(&to_eye) > 0.0 { outward } else { -outward };
                (point, lit(paint, normal, to_eye))
            };
            let corners = [shaded(from, a), shaded(from, b), shaded(to, b), shaded(to, a)];
            canvas.solid([corners[0], corners[1], corners[2]]);
            canvas.solid([corners[0], corners[2], corners[3]]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hil_sim::plant::{Body, Load};

    fn touch(position: [f32; 3], tilt: f32) -> Touch {
        let shape = Shape::from(&Body::chapter());
        let (sin, cos) = (0.5 * tilt).sin_cos();
        let orientation = [cos, sin, 0.0, 0.0];
        let pose = Pose { position, orientation, weights: [0.0; 2], targets: None, load: Load::default() };
        Placed::new(&shape, &pose, Vector3::from(position)).touch()
    }

    fn near(a: Vector3<f32>, b: [f32; 3]) -> bool {
        (a - Vector3::from(b)).norm() < 1e-4
    }

    #[test]
    fn a_lying_barrel_touches_along_its_side() {
        let Touch::Line([from, to]) = touch([0.2, 0.0, 0.5], 0.0) else { panic!("it lies") };
        assert!(near(from, [0.2, -0.5, 0.0]) && near(to, [0.2, 0.5, 0.0]));
    }

    #[test]
    fn a_tilted_barrel_touches_with_a_point_of_its_lower_rim() {
        for tilt in [0.5_f32, -0.5] {
            let height = 0.5 * (tilt.cos() + tilt.abs().sin());
            let Touch::Line([from, to]) = touch([0.0, 0.0, height], tilt) else { panic!("it leans") };
            let y = tilt.signum() * 0.5 * (tilt.abs().sin() - tilt.cos());
            assert_eq!(from, to);
            assert!(near(from, [0.0, y, 0.0]), "{from} {y}");
        }
    }

    #[test]
    fn a_standing_barrel_touches_with_the_end_that_is_below_and_a_hopping_one_not_at_all() {
        let right = core::f32::consts::FRAC_PI_2;
        assert_eq!(touch([0.0, 0.0, 0.5], right), Touch::Face(0));
        assert_eq!(touch([0.0, 0.0, 0.5], -right), Touch::Face(1));
        assert_eq!(touch([0.0, 0.0, 0.6], 0.0), Touch::Nothing);
    }

    #[test]
    fn the_axes_pass_each_other_where_the_body_says() {
        let shape = Shape::from(&Body::tabletop());
        let pose = Pose {
            position: [0.0, 0.0, 0.12],
            orientation: [1.0, 0.0, 0.0, 0.0],
            weights: [0.05, -0.03],
            targets: None,
            load: Load::default(),
        };
        let [first, second] = Placed::new(&shape, &pose, Vector3::new(0.0, 0.0, 0.12)).balls();
        assert!(near(first, [0.05, -0.035, 0.12]) && near(second, [0.0, 0.035, 0.09]), "{first} {second}");
    }
}
