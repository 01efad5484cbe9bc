//! The floor: grid, trail, shadows, and where the barrel touches it.

use super::barrel::{Placed, Touch};
use super::canvas::Canvas;
use super::paint::{Paint, Palette, sun};
use eframe::egui::{Pos2, pos2};
use nalgebra::{Vector2, Vector3};

/// Points of the trail that are drawn at most.
const TRAIL: usize = 500;
/// How far apart they are at least, radii.
const TRAIL_STEP: f32 = 0.15;
/// Points of a round shadow's edge.
const EDGE: usize = 40;
/// Length of the finest cells of the grid at least, and how far its lines reach at most, of the camera's distance.
const FINEST: f32 = 0.06;
const FARTHEST: f32 = 8.0;
/// How shadows fade out across their edge: where, of its width, and how dark.
const FADE: [(f32, f32); 5] = [(-1.0, 1.0), (-0.4, 0.85), (0.0, 0.5), (0.4, 0.15), (1.0, 0.0)];

/// Where the floor fades and how fine its grid is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Floor {
    /// The point of the world's ground that scene coordinates begin at, m.
    pub origin: [f64; 2],
    /// What the camera looks at, on the ground, m from the origin.
    pub middle: Vector2<f32>,
    /// Distance of the camera, m.
    pub distance: f32,
}

impl Floor {
    /// The finest cells are of the series 1, 5, 10, 50… and 0.06 to 0.3 of the camera's distance: which of the series, and how
    /// long, m.
    fn finest(&self) -> (i32, f32) {
        let least = FINEST * self.distance;
        let power = least.log10().floor() as i32;
        let rank = (2 * power..).find(|&rank| series(rank) >= least).unwrap_or(2 * power);
        (rank, series(rank))
    }

    /// Length of the finest cells, m.
    pub fn cell(&self) -> f32 {
        self.finest().1
    }

    /// Sky and floor.
    pub fn ground(&self, canvas: &mut Canvas, palette: &Palette, [min, max]: [Pos2; 2]) {
        let [high, low] = palette.sky;
        let horizon = canvas.lens.horizon().clamp(min.y, max.y);
        let level = |y: f32, paint: Paint| [(pos2(min.x, y), paint), (pos2(max.x, y), paint)];
        for [(y0, above), (y1, below)] in [[(min.y, high), (horizon, low)], [(horizon, low), (max.y, low)]] {
            let ([a, b], [c, d]) = (level(y0, above), level(y1, below));
            canvas.flat([a, b, d, c]);
        }
        let reach = [0.0, 1.0, 2.0, 3.5, 6.0, 10.0, 18.0, 40.0];
        let sectors = 40;
        canvas.sheet(
            reach.len() - 1,
            sectors,
            |ring, sector| {
                let (sin, cos) = (core::f32::consts::TAU * sector as f32 / sectors as f32).sin_cos();
                let at = self.middle + Vector2::new(cos, sin) * (reach[ring] * self.distance);
                let fade = 1.0 / (1.0 + 0.12 * reach[ring] * reach[ring]);
                (at.push(0.0), palette.floor.faded(if ring + 1 == reach.len() { 0.0 } else { fade }))
            },
            |_, _| true,
        );
    }

    /// Lines of the grid, fixed in the world; the finest ones fade in as the camera comes near.
    pub fn grid(&self, canvas: &mut Canvas, palette: &Palette) {
        let (finest, cell) = self.finest();
        for across in 0..2 {
            let along = 1 - across;
            let middle = self.origin[across] + f64::from(self.middle[across]);
            let [first, last] =
                [-FARTHEST, FARTHEST].map(|end| (middle + f64::from(end * self.distance)) / f64::from(cell));
            for number in first.ceil() as i64..=last.floor() as i64 {
                let spacing = series(finest + rank(number, finest));
                let strength = self.strength(spacing);
                // The coarser, the farther, without a jump where one of the series takes the place of the next.
                let reach = self.distance * (2.5 + 8.0 * strength).min(FARTHEST);
                let place = (number as f64 * f64::from(cell) - self.origin[across]) as f32;
                let off = place - self.middle[across];
                if off.abs() >= reach {
                    continue;
                }
                let half = (reach * reach - off * off).sqrt();
                let points = (0..=6).map(|step| {
                    let to = (step as f32 / 3.0 - 1.0) * half;
                    let mut point = Vector3::zeros();
                    point[across] = place;
                    point[along] = self.middle[along] + to;
                    let near = 1.0 - (off * off + to * to) / (reach * reach);
                    (point, palette.grid.faded(strength * near * near))
                });
                canvas.stroke(points, 1.0);
            }
        }
    }

    /// How visible lines of this spacing are: 0 for the finest that are drawn, 1 for a hundred times that.
    fn strength(&self, spacing: f32) -> f32 {
        (0.5 * (spacing / (FINEST * self.distance)).log10()).clamp(0.0, 1.0)
    }

    /// The way of the middle, the newest point last; it fades towards its beginning.
    pub fn trail(&self, canvas: &mut Canvas, palette: &Palette, trail: &[[f32; 2]], radius: f32) {
        let place =
            |at: &[f32; 2]| Vector2::new(f64::from(at[0]) - self.origin[0], f64::from(at[1]) - self.origin[1]).cast();
        let mut kept: Vec<Vector2<f32>> = Vec::new();
        for at in trail.iter().rev().filter(|at| at.iter().all(|part| part.is_finite())).map(place) {
            if kept.last().is_none_or(|last| (at - last).norm() > TRAIL_STEP * radius) {
                kept.push(at);
            }
            if kept.len() == TRAIL {
                break;
            }
        }
        let count = kept.len().max(100) as f32;
        let fading = kept.iter().enumerate().map(|(i, at)| {
            let age = i as f32 / count;
            (at.push(0.0), palette.trail.faded((1.0 - age) * (1.0 - age)))
        });
        canvas.stroke(fading, 2.5);
    }

    /// The shadows of shell and weights.
    pub fn shadow(&self, canvas: &mut Canvas, palette: &Palette, barrel: &Placed) {
        let radius = barrel.shape.radius;
        let fall = |point: Vector3<f32>| (point - sun() * (point.z / sun().z)).xy();
        let rims: Vec<Vector2<f32>> = (0..2 * EDGE)
            .map(|i| fall(barrel.rim(i % 2, core::f32::consts::TAU * (i / 2) as f32 / EDGE as f32)))
            .collect();
        let soft = 0.10 * radius + 0.12 * (barrel.middle.z - radius).max(0.0);
        blot(canvas, &hull(rims), soft, palette.shadow.faded(0.75));
        // Where shell and floor are near each other little light comes in.
        let close = 0.11 * radius;
        match barrel.touch() {
            Touch::Nothing => {}
            Touch::Face(end) => {
                let rim: Vec<Vector2<f32>> = round(|angle| barrel.rim(end, angle).xy());
                blot(canvas, &hull(rim), close, palette.shadow.faded(0.9));
            }
            Touch::Line([from, to]) => {
                let out = (to - from).xy().try_normalize(1e-3 * radius).unwrap_or(Vector2::x()) * close;
                let capsule = round(|angle| {
                    let (sin, cos) = angle.sin_cos();
                    let end = if cos > 0.0 { to } else { from };
                    end.xy() + out * cos + Vector2::new(-out.y, out.x) * sin
                });
                blot(canvas, &hull(capsule), close, palette.shadow.faded(0.9));
            }
        }
        for ball in barrel.balls() {
            let (middle, size) = (fall(ball), barrel.shape.ball());
            let round = round(|angle| middle + Vector2::new(angle.cos(), angle.sin()) * size);
            blot(canvas, &round, 0.25 * size + 0.12 * ball.z.max(0.0), palette.shadow.faded(0.55));
        }
    }

    /// Marks where the barrel touches.
    pub fn contact(&self, canvas: &mut Canvas, palette: &Palette, barrel: &Placed) {
        let radius = barrel.shape.radius;
        let circle = |canvas: &mut Canvas, point: &dyn Fn(f32) -> Vector3<f32>| {
            let turn = core::f32::consts::TAU;
            canvas.stroke((0..=48).map(|i| (point(turn * i as f32 / 48.0), palette.contact)), 2.5);
        };
        match barrel.touch() {
            Touch::Nothing => {}
            Touch::Face(end) => circle(canvas, &|angle| barrel.rim(end, angle)),
            Touch::Line(ends) => {
                canvas.stroke(ends.map(|at| (at, palette.contact)), 3.5);
                if (ends[1] - ends[0]).norm() < 1e-3 * radius {
                    for size in [0.015, 0.06] {
                        circle(canvas, &|angle| {
                            ends[0] + Vector3::new(angle.cos(), angle.sin(), 0.0) * (size * radius)
                        });
                    }
                }
            }
        }
    }
}

/// Points of a closed line for angles all around.
fn round(point: impl Fn(f32) -> Vector2<f32>) -> Vec<Vector2<f32>> {
    (0..EDGE).map(|i| point(core::f32::consts::TAU * i as f32 / EDGE as f32)).collect()
}

/// The lengths 1, 5, 10, 50… m and 0.5, 0.1, 0.05… m, 1 m being number 0.
fn series(rank: i32) -> f32 {
    10_f32.powi(rank.div_euclid(2)) * if rank.rem_euclid(2) == 1 { 5.0 } else { 1.0 }
}

/// How much farther in the series the spacing is that grid line `number` of the cells `finest` belongs to, at most five.
fn rank(number: i64, finest: i32) -> i32 {
    let mut spacing = 1;
    let mut up = 0;
    while up < 5 {
        spacing *= if (finest + up).rem_euclid(2) == 0 { 5 } else { 2 };
        if number % spacing != 0 {
            break;
        }
        up += 1;
    }
    up
}

/// A dark area with a convex edge that fades out across `soft` on either side of it.
fn blot(canvas: &mut Canvas, edge: &[Vector2<f32>], soft: f32, paint: Paint) {
    let count = edge.len();
    if count < 3 {
        return;
    }
    let middle = edge.iter().sum::<Vector2<f32>>() / count as f32;
    let outward = |i: usize| {
        let along = edge[(i + 1) % count] - edge[(i + count - 1) % count];
        Vector2::new(along.y, -along.x).try_normalize(1e-12).unwrap_or_default()
    };
    let normals: Vec<Vector2<f32>> = (0..count).map(outward).collect();
    let depths: Vec<f32> = (0..count).map(|i| (edge[i] - middle).dot(&normals[i])).collect();
    // A shadow narrower than its edge is fainter, not turned inside out.
    let inner = soft.min(0.9 * depths.iter().copied().fold(f32::MAX, f32::min).max(0.0));
    let fade = if soft > 0.0 { (0.5 + 0.5 * inner / soft).min(1.0) } else { 1.0 };
    canvas.sheet(
        FADE.len(),
        count,
        |ring, i| {
            let i = i % count;
            let Some(ring) = ring.checked_sub(1) else { return (middle.push(0.0), paint.faded(fade)) };
            let (offset, dark) = FADE[ring];
            // Inwards towards the middle and not along the normals, which cross where the edge is sharp.
            let shift = if offset < 0.0 && inner > 0.0 {
                (edge[i] - middle) * (offset * inner / depths[i])
            } else {
                normals[i] * (offset.max(0.0) * soft)
            };
            ((edge[i] + shift).push(0.0), paint.faded(fade * dark))
        },
        |_, _| true,
    );
}

/// The convex hull, counter-clockwise (Andrew's monotone chain).
fn hull(mut points: Vec<Vector2<f32>>) -> Vec<Vector2<f32>> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let mut chain: Vec<Vector2<f32>> = Vec::new();
    let mut half = |points: &mut dyn Iterator<Item = Vector2<f32>>| {
        let begin = chain.len();
        for point in points {
            while let [.., a, b] = chain[begin..]
                && (b - a).perp(&(point - b)) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
    };
    half(&mut points.iter().copied());
    half(&mut points.iter().rev().copied());
    chain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hull_goes_around_everything() {
        let points: Vec<Vector2<f32>> =
            (0..200).map(|i| Vector2::new((i * 37 % 101) as f32, (i * 53 % 89) as f32)).collect();
        let hull = hull(points.clone());
        for (i, a) in hull.iter().enumerate() {
            let b = hull[(i + 1) % hull.len()];
            assert!(points.iter().all(|point| (b - a).perp(&(point - a)) >= -1e-3));
        }
    }

    fn floor(distance: f32) -> Floor {
        Floor { origin: [0.0; 2], middle: Vector2::zeros(), distance }
    }

    #[test]
    fn the_grid_is_never_finer_than_the_eye_and_never_coarse() {
        for exponent in -30..30 {
            let floor = floor(10_f32.powf(exponent as f32 / 10.0));
            let part = floor.cell() / floor.distance;
            assert!((0.0599..0.301).contains(&part), "{part}");
        }
    }

    #[test]
    fn every_line_has_the_widest_spacing_that_it_belongs_to() {
        // Cells of 0.5 m: lines at 0, 0.5, 1, 1.5 … 5 … 10 m.
        let widest = |number: i64| series(-1 + rank(number, -1));
        for (number, spacing) in
            [(1, 0.5), (2, 1.0), (3, 0.5), (10, 5.0), (20, 10.0), (-20, 10.0), (4, 1.0), (100, 50.0)]
        {
            assert!((widest(number) - spacing).abs() < 1e-4 * spacing, "{number}: {}", widest(number));
        }
    }

    #[test]
    fn lines_come_and_go_without_a_jump_as_the_camera_moves_away() {
        let strengths = |distance: f32| {
            let floor = floor(distance);
            let (finest, _) = floor.finest();
            [-3, -2, -1, 0, 1, 2].map(|rank| if rank >= finest { floor.strength(series(rank)) } else { 0.0 })
        };
        let mut distance = 0.1;
        while distance < 20.0 {
            let (now, next) = (strengths(distance), strengths(distance * 1.01));
            assert!(now.iter().zip(next).all(|(a, b)| (a - b).abs() < 0.01), "{distance}: {now:?} {next:?}");
            distance *= 1.01;
        }
    }
}
