//! Every learning rule against finite differences of the error that it is said to descend.
//!
//! The errors are written out here from the chapter's definitions, with
//! nalgebra's inverses in double precision; nothing of the library's own elimination is in them. The
//! rules carry ½ of the true gradient, so each error is taken as ½E.

use firmware::brain::rule::{TimeLoop, homeostatic};
use firmware::brain::{Controller, Model, Rule, Settings};
use nalgebra::{SMatrix, SVector};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

/// One situation: a controller, a model, sensor values and a prediction error.
struct Case<const N: usize, const M: usize> {
    controller: Controller<f64, N, M>,
    model: Model<f64, N, M>,
    x: SVector<f64, N>,
    xi: SVector<f64, N>,
}

impl<const N: usize, const M: usize> Case<N, M> {
    /// Entries in ±1.5, drawn again until neither `A` nor `C` is close to singular: there the
    /// differences, not the rules, lose their digits.
    fn random(random: &mut Pcg32) -> Self {
        let mut number = || f64::from(random.next_u32()) / f64::from(u32::MAX) * 3.0 - 1.5;
        loop {
            let case = Self {
                controller: Controller::new(SMatrix::from_fn(|_, _| number()), SVector::from_fn(|_, _| 0.3 * number())),
                model: Model::new(SMatrix::from_fn(|_, _| number()), SVector::from_fn(|_, _| number())),
                x: SVector::from_fn(|_, _| 0.7 * number()),
                xi: SVector::from_fn(|_, _| 0.3 * number()),
            };
            if regularity(&case.controller.c) > 0.3 && regularity(&case.model.a) > 0.3 {
                return case;
            }
        }
    }

    fn slope(&self) -> SVector<f64, M> {
        self.controller.slope(&self.x, 0.0)
    }

    fn y(&self) -> SVector<f64, M> {
        self.controller.act(&self.x)
    }

    fn time_loop(&self, settings: &Settings<f64>) -> TimeLoop<f64, N, M> {
        let c = &self.controller.c;
        TimeLoop::new(c, &self.model.a, &self.slope(), &self.xi, settings)
    }
}

fn inverse<const K: usize>(matrix: &SMatrix<f64, K, K>) -> SMatrix<f64, K, K> {
    matrix.try_inverse().unwrap_or_else(|| SMatrix::repeat(f64::INFINITY))
}

/// The Moore–Penrose inverse of a matrix of full rank.
fn pseudo_inverse<const R: usize, const C: usize>(matrix: &SMatrix<f64, R, C>) -> SMatrix<f64, C, R> {
    let transposed = matrix.transpose();
    if R >= C { inverse(&(transposed * matrix)) * transposed } else { transposed * inverse(&(matrix * transposed)) }
}

/// A lower bound of the least singular value.
fn regularity<const R: usize, const C: usize>(matrix: &SMatrix<f64, R, C>) -> f64 {
    1.0 / pseudo_inverse(matrix).norm()
}

/// No clips, no decay, no ridge: the bare equations.
fn bare() -> Settings<f64> {
    Settings {
        rule: Rule::Homeokinetic,
        eps_a: 1.0,
        eps_c: 1.0,
        lambda_a: 0.0,
        lambda_b: 0.0,
        lambda_c: 0.0,
        lambda_h: 0.0,
        clip_a: 0.0,
        clip_c: 0.0,
        clip_h: 0.0,
        clip_zeta: 0.0,
        clip_v: 0.0,
        ridge: 0.0,
        gain_floor: 0.0,
        pivot_floor: 0.0,
    }
}

/// The negative gradient of `error` with respect to the matrix and the vector, by central
/// differences.
fn descent<const R: usize, const C: usize>(
    matrix: &SMatrix<f64, R, C>,
    vector: &SVector<f64, R>,
    error: impl Fn(&SMatrix<f64, R, C>, &SVector<f64, R>) -> f64,
) -> (SMatrix<f64, R, C>, SVector<f64, R>) {
    let d = 1e-5;
    let slope = |plus: f64, minus: f64| -(plus - minus) / (2.0 * d);
    let of_matrix = SMatrix::from_fn(|i, j| {
        let moved = |by: f64| {
            let mut m = *matrix;
            m[(i, j)] += by;
            error(&m, vector)
        };
        slope(moved(d), moved(-d))
    });
    let of_vector = SVector::from_fn(|i, _| {
        let moved = |by: f64| {
            let mut v = *vector;
            v[i] += by;
            error(matrix, &v)
        };
        slope(moved(d), moved(-d))
    });
    (of_matrix, of_vector)
}

/// Distance of a rule's direction from the descent, relative to the larger of the two.
fn relative_error<const R: usize, const C: usize>(
    rule: (&SMatrix<f64, R, C>, &SVector<f64, R>),
    descent: &(SMatrix<f64, R, C>, SVector<f64, R>),
) -> f64 {
    let norm = |m: &SMatrix<f64, R, C>, v: &SVector<f64, R>| m.norm().hypot(v.norm());
    norm(&(rule.0 - descent.0), &(rule.1 - descent.1)) / norm(&descent.0, &descent.1)
}

/// `½ξᵀξ` as a function of `C` and `h`: the motor values change, the sensor values that followed and
/// the model do not.
fn prediction_error_of_controller<const N: usize, const M: usize>(
    case: &Case<N, M>,
) -> impl Fn(&SMatrix<f64, M, N>, &SVector<f64, M>) -> f64 {
    let (a, b, x) = (case.model.a, case.model.b, case.x);
    let x_after = a * case.y() + b + case.xi;
    move |c, h| {
        let y = (c * x + h).map(f64::tanh);
        0.5 * (x_after - (a * y + b)).norm_squared()
    }
}

/// `½E_TLE` as a function of `C` and `h` at fixed ξ and `A`. With a ridge it is the error that the
/// docs of the rule say is descended.
fn time_loop_error<const N: usize, const M: usize>(
    case: &Case<N, M>,
    ridge: f64,
) -> impl Fn(&SMatrix<f64, M, N>, &SVector<f64, M>) -> f64 {
    let (a, x, xi) = (case.model.a, case.x, case.xi);
    move |c, h| {
        let slope = (c * x + h).map(|z| 1.0 - z.tanh() * z.tanh());
        let l = a * SMatrix::from_diagonal(&slope);
        let zeta = pseudo_inverse(&l) * xi;
        if N >= M {
            let k = c * c.transpose() + SMatrix::identity() * ridge;
            0.5 * zeta.dot(&(inverse(&k) * zeta))
        } else {
            let p = c.transpose() * c + SMatrix::identity() * ridge;
            0.5 * (inverse(&p) * c.transpose() * zeta).norm_squared()
        }
    }
}

/// The worst error of Eq. 7/8, 9/10 and 12 (without and with a ridge) over so many random cases.
fn worst_errors<const N: usize, const M: usize>(cases: usize) -> [f64; 4] {
    let mut random = Pcg32::seed_from_u64(7);
    let mut worst = [0.0_f64; 4];
    for _ in 0..cases {
        let case = Case::<N, M>::random(&mut random);
        let y = case.y();

        let x_after = case.model.predict(&y) + case.xi;
        let down = descent(&case.model.a, &case.model.b, |a, b| 0.5 * (x_after - (a * y + b)).norm_squared());
        let learned = case.model.learned(&y, &case.xi, &bare());
        let step = (learned.a - case.model.a, learned.b - case.model.b);
        worst[0] = worst[0].max(relative_error((&step.0, &step.1), &down));

        let Controller { c, h } = case.controller;
        let down = descent(&c, &h, prediction_error_of_controller(&case));
        let step = homeostatic(&case.model.a, &case.slope(), &case.x, &case.xi);
        worst[1] = worst[1].max(relative_error((&step.c, &step.h), &down));

        for (k, ridge) in [(2, 0.0), (3, 0.05)] {
            let down = descent(&c, &h, time_loop_error(&case, ridge));
            let settings = Settings { ridge, ..bare() };
            let step = case.time_loop(&settings).direction(&case.x, &y);
            worst[k] = worst[k].max(relative_error((&step.c, &step.h), &down));
        }
    }
    worst
}

fn each_rule_is_a_gradient<const N: usize, const M: usize>(cases: usize) {
    let worst = worst_errors::<N, M>(cases);
    println!("{N} sensors, {M} motors, {cases} cases: Eq. 7/8, 9/10, 12, 12 with ridge: {worst:?}");
    assert!(worst.iter().all(|w| *w < 1e-6), "{N}x{M}: {worst:?}");
}

#[test]
fn each_rule_is_the_gradient_of_its_error_2x2() {
    each_rule_is_a_gradient::<2, 2>(500);
}

#[test]
fn each_rule_is_the_gradient_of_its_error_1x1() {
    each_rule_is_a_gradient::<1, 1>(100);
}

#[test]
fn each_rule_is_the_gradient_of_its_error_with_more_sensors_than_motors() {
    each_rule_is_a_gradient::<3, 2>(100);
    each_rule_is_a_gradient::<4, 2>(100);
    each_rule_is_a_gradient::<3, 1>(100);
}

#[test]
fn each_rule_is_the_gradient_of_its_error_with_more_motors_than_sensors() {
    each_rule_is_a_gradient::<2, 3>(100);
    each_rule_is_a_gradient::<1, 2>(100);
    each_rule_is_a_gradient::<2, 5>(100);
}

#[test]
fn each_rule_is_the_gradient_of_its_error_at_larger_sizes() {
    each_rule_is_a_gradient::<3, 3>(50);
    each_rule_is_a_gradient::<4, 4>(50);
    each_rule_is_a_gradient::<6, 4>(50);
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn eq_10_as_printed_is_not_the_gradient() {
    let mut random = Pcg32::seed_from_u64(7);
    let errors: Vec<f64> = (0..140)
        .map(|_| {
            let case = Case::<2, 2>::random(&mut random);
            let Controller { c, h } = case.controller;
            let down = descent(&c, &h, prediction_error_of_controller(&case));
            let a = case.model.a;
            // Σ_j A_ji g'(z_j) ξ_i
            let eta = a.tr_mul(&case.slope()).component_mul(&case.xi);
            relative_error((&(eta * case.x.transpose()), &eta), &down)
        })
        .collect();
    let median = median(errors);
    println!("Eq. 10 as printed: median relative error {median:.2}");
    assert!(median > 0.3, "median relative error {median}");
}

#[test]
fn v_as_printed_is_neither_the_gradient_nor_the_time_loop_error() {
    let mut random = Pcg32::seed_from_u64(7);
    let (mut of_gradient, mut of_error) = (vec![], vec![]);
    for _ in 0..140 {
        let case = Case::<2, 2>::random(&mut random);
        let Controller { c, h } = case.controller;
        let error = time_loop_error(&case, 0.0);
        let down = descent(&c, &h, &error);
        let time_loop = case.time_loop(&bare());
        let right = time_loop.direction(&case.x, &case.y());
        let printed_v = c * time_loop.mu;
        let printed = right.c + time_loop.mu * (printed_v - time_loop.v).transpose();
        of_gradient.push(relative_error((&printed, &right.h), &down));

        let e = 2.0 * error(&c, &h);
        assert!((time_loop.error() / e - 1.0).abs() < 1e-9);
        of_error.push((printed_v.norm_squared() / e - 1.0).abs());
    }
    let (of_gradient, of_error) = (median(of_gradient), median(of_error));
    println!("v as printed: median relative error of the gradient {of_gradient:.2}, of E_TLE {of_error:.2}");
    assert!(of_gradient > 0.3, "median relative error {of_gradient}");
    assert!(of_error > 0.3, "median relative error {of_error}");
}
