//! Triangles and lines in space, cut where they come too near, to one mesh for egui.

use super::lens::Lens;
use super::paint::Paint;
use eframe::egui::epaint::{Mesh, Vertex};
use eframe::egui::{Color32, Pos2, Vec2};
use nalgebra::Vector3;

/// A corner: right, up and depth as the lens sees it, and its colour.
#[derive(Clone, Copy, Debug)]
struct Corner {
    seen: Vector3<f32>,
    paint: Paint,
}

/// What is drawn, in the order in which it is drawn: what comes later covers.
#[derive(Debug)]
pub(super) struct Canvas {
    pub lens: Lens,
    mesh: Mesh,
    /// Solid triangles that wait to be sorted, with their distance.
    solid: Vec<(f32, [Corner; 3])>,
    /// Width over which the edge of a line fades: one pixel, in points.
    feather: f32,
    grey: bool,
}

impl Canvas {
    /// An empty one. `pixel` is the size of a pixel in points.
    pub fn new(lens: Lens, pixel: f32) -> Self {
        Canvas { lens, mesh: Mesh::default(), solid: Vec::new(), feather: pixel, grey: false }
    }

    /// Whether what is drawn from now on is greyed.
    pub fn grey(&mut self, grey: bool) {
        self.grey = grey;
    }

    /// Everything that was drawn.
    pub fn finish(mut self) -> Mesh {
        self.settle();
        self.mesh
    }

    fn corner(&self, point: Vector3<f32>, paint: Paint) -> Corner {
        Corner { seen: self.lens.seen(point), paint }
    }

    fn color(&self, paint: Paint) -> Color32 {
        if self.grey { paint.greyed().color() } else { paint.color() }
    }

    fn vertex(&mut self, pos: Pos2, paint: Paint) -> u32 {
        let index = self.mesh.vertices.len() as u32;
        let color = self.color(paint);
        self.mesh.vertices.push(Vertex::untextured(pos, color));
        index
    }

    /// A quadrangle in the window.
    pub fn flat(&mut self, corners: [(Pos2, Paint); 4]) {
        let [a, b, c, d] = corners.map(|(pos, paint)| self.vertex(pos, paint));
        self.mesh.indices.extend([a, b, c, a, c, d]);
    }

    /// A sheet of `rows` × `columns` quadrangles between the points that `point` gives for (0..=rows, 0..=columns); those
    /// for which `keep` says so.
    pub fn sheet(
        &mut self,
        rows: usize,
        columns: usize,
        point: impl Fn(usize, usize) -> (Vector3<f32>, Paint),
        keep: impl Fn(usize, usize) -> bool,
    ) {
        let width = columns + 1;
        let corners: Vec<Corner> = (0..(rows + 1) * width)
            .map(|at| {
                let (point, paint) = point(at / width, at % width);
                self.corner(point, paint)
            })
            .collect();
        // Vertices are made when a quadrangle needs them.
        let mut made: Vec<Option<u32>> = vec![None; corners.len()];
        for row in 0..rows {
            for column in (0..columns).filter(|&column| keep(row, column)) {
                let first = row * width + column;
                let at = [first, first + 1, first + 1 + width, first + width];
                if at.iter().all(|&i| corners[i].paint.alpha <= 0.0) {
                    continue;
                }
                if at.iter().all(|&i| corners[i].seen.z >= self.lens.near) {
                    let [a, b, c, d] = at.map(|i| match made[i] {
                        Some(index) => index,
                        None => {
                            let index = self.vertex(self.lens.fall(corners[i].seen), corners[i].paint);
                            made[i] = Some(index);
                            index
                        }
                    });
                    self.mesh.indices.extend([a, b, c, a, c, d]);
                } else {
                    let [a, b, c, d] = at.map(|i| corners[i]);
                    self.cut([a, b, c]);
                    self.cut([a, c, d]);
                }
            }
        }
    }

    /// A triangle, less what is too near.
    fn cut(&mut self, triangle: [Corner; 3]) {
        let near = self.lens.near;
        let mut kept = [None; 4];
        let mut count = 0;
        let mut keep = |corner: Corner| {
            kept[count] = Some(corner);
            count += 1;
        };
        for i in 0..3 {
            let (from, to) = (triangle[i], triangle[(i + 1) % 3]);
            if from.seen.z >= near {
                keep(from);
            }
            if (from.seen.z >= near) != (to.seen.z >= near) {
                keep(between(from, to, near));
            }
        }
        let fan: Vec<u32> =
            kept.into_iter().flatten().map(|at| self.vertex(self.lens.fall(at.seen), at.paint)).collect();
        for i in 2..fan.len() {
            self.mesh.indices.extend([fan[0], fan[i - 1], fan[i]]);
        }
    }

    /// A solid triangle: drawn when the solid things settle, the far ones first.
    pub fn solid(&mut self, points: [(Vector3<f32>, Paint); 3]) {
        let corners = points.map(|(point, paint)| self.corner(point, paint));
        let distance = corners.iter().map(|corner| corner.seen).sum::<Vector3<f32>>().norm();
        self.solid.push((distance, corners));
    }

    /// Draws the solid triangles that wait.
    pub fn settle(&mut self) {
        let mut solid = core::mem::take(&mut self.solid);
        solid.sort_by(|a, b| b.0.total_cmp(&a.0));
        for (_, triangle) in solid {
            self.cut(triangle);
        }
    }

    /// A line of this width, points, with soft edges. Parts that cannot be seen at all leave a gap.
    pub fn stroke(&mut self, points: impl IntoIterator<Item = (Vector3<f32>, Paint)>, width: f32) {
        let mut run: Vec<(Pos2, Paint)> = Vec::new();
        let mut last: Option<Corner> = None;
        for (point, paint) in points {
            let to = self.corner(point, paint);
            let Some(from) = last.replace(to) else { continue };
            let near = self.lens.near;
            let seen = [from, to].map(|end| end.seen.z >= near);
            if (from.paint.alpha <= 0.0 && to.paint.alpha <= 0.0) || seen == [false; 2] {
                self.ribbon(&mut run, width);
                continue;
            }
            let begin = if seen[0] { from } else { between(from, to, near) };
            let end = if seen[1] { to } else { between(from, to, near) };
            if run.is_empty() {
                run.push((self.lens.fall(begin.seen), begin.paint));
            }
            run.push((self.lens.fall(end.seen), end.paint));
            if !seen[1] {
                self.ribbon(&mut run, width);
            }
        }
        self.ribbon(&mut run, width);
    }

    /// Draws a run of a line and empties it.
    fn ribbon(&mut self, run: &mut Vec<(Pos2, Paint)>, width: f32) {
        // Points that fall on one another have no direction between them.
        run.dedup_by(|b, a| (b.0 - a.0).length() < 0.05);
        let points = core::mem::take(run);
        if points.len() < 2 {
            return;
        }
        // A line thinner than a pixel is a pixel wide and fainter.
        let fade = (width / self.feather).min(1.0);
        let half = 0.5 * (width.max(self.feather) - self.feather).max(0.0);
        let outer = half + self.feather;
        let direction = |i: usize| (points[i + 1].0 - points[i].0).normalized();
        let last = points.len() - 1;
        let mut before: Option<[u32; 4]> = None;
        for (i, &(at, paint)) in points.iter().enumerate() {
            let incoming = direction(i.saturating_sub(1).min(last - 1));
            let outgoing = direction(i.min(last - 1));
            let across = miter(incoming, outgoing);
            let paint = paint.faded(fade);
            let clear = Paint { alpha: 0.0, ..paint };
            let made = [(-outer, clear), (-half, paint), (half, paint), (outer, clear)]
                .map(|(offset, paint)| self.vertex(at + across * offset, paint));
            if let Some(before) = before {
                for side in 0..3 {
                    let [a, b, c, d] = [before[side], before[side + 1], made[side + 1], made[side]];
                    self.mesh.indices.extend([a, b, c, a, c, d]);
                }
            }
            before = Some(made);
        }
    }
}

/// Where the edge between two corners comes to the depth `near`.
fn between(from: Corner, to: Corner, near: f32) -> Corner {
    let part = ((near - from.seen.z) / (to.seen.z - from.seen.z)).clamp(0.0, 1.0);
    let mut seen = from.seen + (to.seen - from.seen) * part;
    seen.z = near;
    Corner { seen, paint: from.paint.towards(to.paint, part) }
}

/// Across a bend, such that the line stays as wide; sharp bends are cut.
fn miter(incoming: Vec2, outgoing: Vec2) -> Vec2 {
    let across = |along: Vec2| Vec2::new(-along.y, along.x);
    let sum = (incoming + outgoing).normalized();
    if sum == Vec2::ZERO {
        return across(incoming);
    }
    across(sum) / sum.dot(incoming).max(0.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::{Rect, pos2};

    fn canvas() -> Canvas {
        let rect = Rect::from_min_max(pos2(0.0, 0.0), pos2(800.0, 600.0));
        Canvas::new(Lens::new(rect, Vector3::zeros(), [0.0, 0.0], 10.0), 1.0)
    }

    const RED: Paint = Paint { rgb: [1.0, 0.0, 0.0], alpha: 1.0 };
    const BLUE: Paint = Paint { rgb: [0.0, 0.0, 1.0], alpha: 1.0 };

    #[test]
    fn the_nearer_solid_covers_the_farther_whatever_came_first() {
        // The camera is on +X.
        let at = |x: f32| [[x, 0.0, 0.0], [x, 1.0, 0.0], [x, 0.0, 1.0]].map(Vector3::from);
        for order in [[(RED, 1.0), (BLUE, -1.0)], [(BLUE, -1.0), (RED, 1.0)]] {
            let mut canvas = canvas();
            for (paint, x) in order {
                canvas.solid(at(x).map(|point| (point, paint)));
            }
            let mesh = canvas.finish();
            assert_eq!(mesh.vertices[mesh.indices[5] as usize].color, RED.color());
        }
    }

    #[test]
    fn what_reaches_behind_the_camera_is_cut_and_finite() {
        let mut canvas = canvas();
        let ends = [-5.0, 25.0].map(|x| (Vector3::new(x, 0.1, 0.2), RED));
        canvas.stroke(ends, 2.0);
        canvas.sheet(1, 1, |i, j| (Vector3::new(30.0 * i as f32 - 5.0, j as f32, -1.0), RED), |_, _| true);
        let mesh = canvas.finish();
        assert!(mesh.is_valid() && mesh.indices.len() >= 18 + 6);
        assert!(mesh.vertices.iter().all(|vertex| vertex.pos.is_finite() && vertex.pos.to_vec2().length() < 1e5));
    }

    #[test]
    fn what_is_behind_the_camera_is_not_drawn() {
        let mut canvas = canvas();
        canvas.stroke([20.0, 30.0].map(|x| (Vector3::new(x, 0.0, 0.0), RED)), 2.0);
        canvas.sheet(1, 1, |i, j| (Vector3::new(20.0, i as f32, j as f32), RED), |_, _| true);
        canvas.solid([[20.0, 0.0, 0.0], [20.0, 1.0, 0.0], [20.0, 0.0, 1.0]].map(|point| (point.into(), RED)));
        assert!(canvas.finish().is_empty());
    }

    #[test]
    fn a_line_is_as_wide_as_asked_for() {
        let mut canvas = canvas();
        canvas.stroke([-1.0, 1.0].map(|y| (Vector3::new(0.0, y, 0.0), RED)), 4.0);
        let opaque: Vec<f32> =
            canvas.finish().vertices.iter().filter(|vertex| vertex.color.a() > 0).map(|vertex| vertex.pos.y).collect();
        let (low, high) = opaque.iter().fold((f32::MAX, f32::MIN), |(low, high), &y| (low.min(y), high.max(y)));
        // The feather of a pixel on each side counts half.
        assert!((high - low + 1.0 - 4.0).abs() < 1e-3);
    }
}
