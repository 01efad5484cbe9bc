//! The equations of motion, shared by every kind of contact: a rigid shell and two weights that slide in it.
//!
//! Body axes: e1 = X, e2 = Z, the cylinder axis a = Y. Weight i (mass m) sits at r_i = s_i e_i + h_i a. Newton for the
//! weights, their axial motion taken out (F_i is known), leaves six equations for the acceleration A of the middle and
//! the angular acceleration α, all in body axes (Featherstone's articulated inertia of a body with two prismatic joints):
//!
//! ```text
//! (M + Σ m P_i) A − Σ m P_i [r_i]× α          = M g + f − Σ λ F_i e_i − Σ m P_i k_i
//! Σ m [r_i]× P_i A + (I − Σ m [r_i]× P_i [r_i]×) α = τ − ω×Iω − Σ r_i×(λ F_i e_i + m P_i k_i)
//! s̈_i = λ (F_i/m − e_i·(A + α×r_i + k_i))
//! k_i = ω×(ω×r_i) + 2 ω×ṡ_i e_i − g,   P_i = 1 − λ e_i e_iᵀ,   λ = m/(m + rotor)
//! ```
//!
//! `rotor` is the inertia of a motor that takes part in motion along its axis only. Since the P_i are diagonal in body
//! axes, the upper left block is diagonal too, and a 3×3 Schur complement is all there is to solve.

use super::body::Body;
use super::drive::Axis;
use nalgebra::{Matrix3, Vector3};

/// The masses of a body, worked out.
#[derive(Clone, Debug)]
pub(super) struct Inertia {
    /// Mass of the shell, kg.
    pub shell: f64,
    /// Mass of one weight, kg.
    pub weight: f64,
    /// Moment about the cylinder axis of shell and weights' own inertia, kg·m².
    pub axial: f64,
    /// The same about a transverse axis.
    pub transverse: f64,
    /// Where the slider axes cross the cylinder axis, m.
    pub shift: [f64; 2],
    /// λ: the part of an axial force that reaches the weight rather than the rotor.
    pub share: f64,
    /// m(1 − λ), kg.
    pub held: f64,
    /// Inertia of a rotor, kg.
    pub rotor: f64,
    /// Gravity, m/s².
    pub gravity: f64,
}

/// Accelerations that the equations give.
#[derive(Clone, Copy, Debug)]
pub(super) struct Acceleration {
    /// Of the middle, in body axes, m/s².
    pub linear: Vector3<f64>,
    /// Angular, body axes, rad/s².
    pub angular: Vector3<f64>,
    /// Of the weights along their axes, m/s².
    pub slide: [f64; 2],
}

/// The velocities and forces the equations need.
#[derive(Clone, Copy, Debug)]
pub(super) struct Loaded {
    /// Angular velocity, body axes, rad/s.
    pub angular: Vector3<f64>,
    /// Gravity in body axes, m/s².
    pub gravity: Vector3<f64>,
    /// Outer force on the shell at the middle, body axes, N.
    pub force: Vector3<f64>,
    /// Outer torque on the shell about the middle, body axes, N·m.
    pub torque: Vector3<f64>,
    /// Positions of the weights, m.
    pub s: [f64; 2],
    /// Their rates, m/s.
    pub v: [f64; 2],
    /// Axial forces of drive and stops on the weights, N.
    pub drive: [f64; 2],
}

impl Inertia {
    pub fn new(body: &Body, axis: &Axis) -> Self {
        let (m, r) = (body.weight_mass, body.radius);
        let own = 2.0 * 0.4 * m * body.weight_radius * body.weight_radius;
        let share = if m > 0.0 { m / (m + axis.rotor_mass) } else { 0.0 };
        Self {
            shell: body.shell_mass,
            weight: m,
            axial: 0.5 * body.shell_mass * r * r + own,
            transverse: body.shell_mass * (3.0 * r * r + body.length * body.length) / 12.0 + own,
            shift: [-0.5 * body.axes_shift, 0.5 * body.axes_shift],
            share,
            held: m * (1.0 - share),
            rotor: if m > 0.0 { axis.rotor_mass } else { 0.0 },
            gravity: body.gravity,
        }
    }

    /// Mass of everything, kg.
    pub fn total(&self) -> f64 {
        self.shell + 2.0 * self.weight
    }

    /// Solves the equations at the top of this file.
    pub fn accelerate(&self, at: &Loaded) -> Acceleration {
        let (m, held, share) = (self.weight, self.held, self.share);
        let [h1, h2] = self.shift;
        let [s1, s2] = at.s;
        let w = at.angular;
        let r1 = Vector3::new(s1, h1, 0.0);
        let r2 = Vector3::new(0.0, h2, s2);

        // k_i, with the Coriolis terms 2ω×ṡe written out.
        let mut k1 = w * w.dot(&r1) - r1 * w.norm_squared() - at.gravity;
        let mut k2 = w * w.dot(&r2) - r2 * w.norm_squared() - at.gravity;
        k1.y += 2.0 * at.v[0] * w.z;
        k1.z -= 2.0 * at.v[0] * w.y;
        k2.x += 2.0 * at.v[1] * w.y;
        k2.y -= 2.0 * at.v[1] * w.x;

        // What each weight asks of the shell, and the sum about the middle.
        let n1 = Vector3::new(share * at.drive[0] + held * k1.x, m * k1.y, m * k1.z);
        let n2 = Vector3::new(m * k2.x, m * k2.y, share * at.drive[1] + held * k2.z);
        let spin = Vector3::new(self.transverse * w.x, self.axial * w.y, self.transverse * w.z);
        let b1 = at.gravity * self.shell + at.force - n1 - n2;
        let b2 = at.torque - w.cross(&spin) - r1.cross(&n1) - r2.cross(&n2);

        // The six by six: diagonal upper left block, coupling, lower right block.
        let side = 1.0 / (self.shell + m + held);
        let d = Vector3::new(side, 1.0 / (self.shell + 2.0 * m), side);
        let c = Matrix3::new(0.0, m * s2, -m * h2 - held * h1, -m * s2, 0.0, m * s1, m * h1 + held * h2, -m * s1, 0.0);
        let (t, a) = (self.transverse, self.axial);
        let j_xx = t + m * (h1 * h1 + s2 * s2) + held * h2 * h2;
        let j_yy = a + m * (s1 * s1 + s2 * s2);
        let j_zz = t + m * (s1 * s1 + h2 * h2) + held * h1 * h1;
        let (j_xy, j_yz) = (-m * h1 * s1, -m * h2 * s2);

        // Schur complement S = J − Cᵀ D C, symmetric; zeros of C used.
        let (c01, c02, c10, c12, c20, c21) = (c.m12, c.m13, c.m21, c.m23, c.m31, c.m32);
        let xx = j_xx - d.y * c10 * c10 - d.z * c20 * c20;
        let yy = j_yy - d.x * c01 * c01 - d.z * c21 * c21;
        let zz = j_zz - d.x * c02 * c02 - d.y * c12 * c12;
        let xy = j_xy - d.z * c20 * c21;
        let xz = -d.y * c10 * c12;
        let yz = j_yz - d.x * c01 * c02;
        let e = b1.component_mul(&d);
        let rhs = b2 - c.tr_mul(&e);
        let angular = solve_symmetric([xx, yy, zz, xy, xz, yz], rhs);
        let linear = e - (c * angular).component_mul(&d);

        let slide = if m > 0.0 {
            let reach1 = linear.x - angular.z * h1 + k1.x;
            let reach2 = linear.z + angular.x * h2 + k2.z;
            [share * (at.drive[0] / m - reach1), share * (at.drive[1] / m - reach2)]
        } else {
            [0.0, 0.0]
        };
        Acceleration { linear, angular, slide }
    }
}

/// Solves S x = b for a symmetric positive S given as (xx, yy, zz, xy, xz, yz), by its cofactors.
fn solve_symmetric([xx, yy, zz, xy, xz, yz]: [f64; 6], b: Vector3<f64>) -> Vector3<f64> {
    let c_xx = yy * zz - yz * yz;
    let c_xy = xz * yz - xy * zz;
    let c_xz = xy * yz - xz * yy;
    let c_yy = xx * zz - xz * xz;
    let c_yz = xy * xz - xx * yz;
    let c_zz = xx * yy - xy * xy;
    let scale = 1.0 / (xx * c_xx + xy * c_xy + xz * c_xz);
    Vector3::new(
        scale * (c_xx * b.x + c_xy * b.y + c_xz * b.z),
        scale * (c_xy * b.x + c_yy * b.y + c_yz * b.z),
        scale * (c_xz * b.x + c_yz * b.y + c_zz * b.z),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix6, Vector6};

    /// A repeatable spread of numbers in ±1.
    pub fn spread(seed: u32) -> impl FnMut() -> f64 {
        let mut x = seed.wrapping_mul(2_654_435_761).wrapping_add(12345);
        move || {
            x = x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(x >> 8) / f64::from(1 << 23) - 1.0
        }
    }

    #[test]
    fn the_sparse_solution_solves_the_dense_equations_and_newton_for_each_weight() {
        let mut body = Body::tabletop();
        body.axes_shift = 0.1;
        let axis = Axis::new(&body.drive, body.weight_mass, body.stop);
        let inertia = Inertia::new(&body, &axis);
        let mut worst: f64 = 0.0;
        for seed in 0..200 {
            let mut next = spread(seed);
            let mut vector = |scale: f64| Vector3::new(next(), next(), next()) * scale;
            let (angular, gravity, force, torque) = (vector(10.0), vector(10.0), vector(20.0), vector(5.0));
            let (s, v, f) = (vector(0.06), vector(1.0), vector(30.0));
            let at = Loaded { angular, gravity, force, torque, s: [s.x, s.y], v: [v.x, v.y], drive: [f.x, f.y] };
            let got = inertia.accelerate(&at);

            let mut lhs = Matrix6::zeros();
            let mut rhs = Vector6::zeros();
            let i = Matrix3::from_diagonal(&Vector3::new(inertia.transverse, inertia.axial, inertia.transverse));
            let mut add = |row: usize, col: usize, block: Matrix3<f64>| {
                let mut view = lhs.fixed_view_mut::<3, 3>(row, col);
                view += block;
            };
            add(0, 0, Matrix3::identity() * inertia.shell);
            add(3, 3, i);
            let mut b1 = gravity * inertia.shell + force;
            let mut b2 = torque - angular.cross(&(i * angular));
            for (j, e) in [Vector3::x(), Vector3::z()].into_iter().enumerate() {
                let r = e * at.s[j] + Vector3::y() * inertia.shift[j];
                let p = Matrix3::identity() - e * e.transpose() * inertia.share;
                let k = angular.cross(&angular.cross(&r)) + angular.cross(&(e * at.v[j])) * 2.0 - gravity;
                let (m, x) = (inertia.weight, r.cross_matrix());
                add(0, 0, p * m);
                add(0, 3, -p * x * m);
                add(3, 0, x * p * m);
                add(3, 3, -x * p * x * m);
                let n = e * (inertia.share * at.drive[j]) + p * k * m;
                b1 -= n;
                b2 -= r.cross(&n);
            }
            rhs.fixed_rows_mut::<3>(0).copy_from(&b1);
            rhs.fixed_rows_mut::<3>(3).copy_from(&b2);
            let want = lhs.lu().solve(&rhs).unwrap();
            let have =
                Vector6::new(got.linear.x, got.linear.y, got.linear.z, got.angular.x, got.angular.y, got.angular.z);
            worst = worst.max((have - want).norm() / want.norm());

            // Independently of the elimination: momentum and moment of momentum balance, weight by weight.
            let mut momentum = got.linear * inertia.shell - gravity * inertia.shell - force;
            let mut moment = i * got.angular + angular.cross(&(i * angular)) - torque;
            for (j, e) in [Vector3::x(), Vector3::z()].into_iter().enumerate() {
                let r = e * at.s[j] + Vector3::y() * inertia.shift[j];
                let a = got.linear
                    + got.angular.cross(&r)
                    + angular.cross(&angular.cross(&r))
                    + angular.cross(&(e * at.v[j])) * 2.0
                    + e * got.slide[j];
                let push = (a - gravity) * inertia.weight;
                momentum += push;
                moment += r.cross(&push);
                let along = push.dot(&e) + inertia.rotor * got.slide[j] - at.drive[j];
                worst = worst.max(along.abs() / 30.0);
            }
            worst = worst.max(momentum.norm() / 100.0).max(moment.norm() / 10.0);
        }
        assert!(worst < 1e-12, "largest relative residual {worst:.1e}");
    }
}
