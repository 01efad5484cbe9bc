//! The brain against the four reference traces of `data/` (its README tells where they are from), in
//! each scalar, and the bits of the `f32` brain.

use firmware::brain::{Brain, Controller, Entry, Model, Rule, Settings};
use firmware::scalar::{Fixed16, Scalar};
use nalgebra::{Matrix2, Vector2};

/// A reference trace and the brain that has to repeat it.
struct Trace {
    name: &'static str,
    csv: &'static str,
    rule: Rule,
    /// εA, εC, λA, λb, λC = λh, ridge
    rates: [f64; 6],
    /// Of ΔA and Δb, ΔC, Δh, ζ, v; 0 = none.
    clips: [f64; 5],
    controller: Controller<f64, 2, 2>,
    model: Model<f64, 2, 2>,
}

fn traces() -> [Trace; 4] {
    let turn = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        Matrix2::new(cos, -sin, sin, cos)
    };
    let none = [0.0; 5];
    [
        Trace {
            name: "closed_eq3",
            csv: include_str!("data/closed_eq3.csv"),
            rule: Rule::Fixed,
            rates: [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            clips: none,
            controller: Controller::new(Matrix2::new(2.0, -1.5, 0.7, -0.4), Vector2::new(0.3, -0.2)),
            model: Model::default(),
        },
        Trace {
            name: "model_eq7_8",
            csv: include_str!("data/model_eq7_8.csv"),
            rule: Rule::Fixed,
            rates: [0.1, 0.0, 0.001, 0.001, 0.0, 0.0],
            clips: none,
            controller: Controller::new(turn(0.4), Vector2::new(0.1, -0.05)),
            model: Model::new(Matrix2::zeros(), Vector2::zeros()),
        },
        Trace {
            name: "controller_eq9_10",
            csv: include_str!("data/controller_eq9_10.csv"),
            rule: Rule::Homeostatic,
            rates: [0.0, 0.1, 0.0, 0.0, 0.001, 0.0],
            clips: none,
            controller: Controller::default(),
            model: Model::new(turn(-0.3), Vector2::new(0.02, -0.01)),
        },
        Trace {
            name: "homeokinetic_eq12",
            csv: include_str!("data/homeokinetic_eq12.csv"),
            rule: Rule::Homeokinetic,
            rates: [0.1, 0.1, 0.003, 0.001, 0.0, 1e-8],
            clips: [0.1, 0.05, 0.1, 1.0, 1.0],
            controller: Controller::default(),
            model: Model::default(),
        },
    ]
}

/// The columns after `t,x1,x2,y1,y2`.
const STATE: [Entry; 12] = [
    Entry::C(0, 0),
    Entry::C(0, 1),
    Entry::C(1, 0),
    Entry::C(1, 1),
    Entry::H(0),
    Entry::H(1),
    Entry::A(0, 0),
    Entry::A(0, 1),
    Entry::A(1, 0),
    Entry::A(1, 1),
    Entry::B(0),
    Entry::B(1),
];

fn brain_of<S: Scalar>(trace: &Trace) -> Brain<S, 2, 2> {
    let number = S::Wide::from_f64;
    let [eps_a, eps_c, lambda_a, lambda_b, lambda_c, ridge] = trace.rates.map(number);
    let [clip_a, clip_c, clip_h, clip_zeta, clip_v] = trace.clips.map(number);
    let settings = Settings {
        rule: trace.rule,
        eps_a,
        eps_c,
        lambda_a,
        lambda_b,
        lambda_c,
        lambda_h: lambda_c,
        clip_a,
        clip_c,
        clip_h,
        clip_zeta,
        clip_v,
        ridge,
        ..Settings::default()
    };
    let mut brain = Brain::new(settings).expect("the settings are in range");
    let (controller, model) = (&trace.controller, &trace.model);
    let controller = Controller::new(controller.c.map(S::from_f64), controller.h.map(S::from_f64));
    let model = Model::new(model.a.map(S::from_f64), model.b.map(S::from_f64));
    brain.set_controller(controller).expect("all is finite");
    brain.set_model(model).expect("all is finite");
    brain
}

/// Runs the brain over the prescribed sensor values and hands each row and the brain's own
/// `y1,y2,C11,…,b2` to `row`.
fn replay<S: Scalar>(trace: &Trace, mut row: impl FnMut(&[f64], [S; 14])) {
    let mut brain = brain_of::<S>(trace);
    let mut rows = 0;
    for line in trace.csv.lines().skip(1) {
        let expected: Vec<f64> = line.split(',').map(|field| field.parse().expect("a number")).collect();
        let x = Vector2::new(S::from_f64(expected[1]), S::from_f64(expected[2]));
        assert_eq!(x[0].to_f64(), expected[1], "the sensor values are exact");
        let step = brain.step(&x).expect("all is finite");
        let mut own = [S::zero(); 14];
        own[0] = step.y[0];
        own[1] = step.y[1];
        for (value, entry) in own[2..].iter_mut().zip(STATE) {
            *value = brain.get(entry).expect("the entry exists");
        }
        row(&expected, own);
        rows += 1;
    }
    assert_eq!(rows, 2000);
}

fn all_traces_agree<S: Scalar>(scalar: &str, tolerance: f64) {
    for trace in traces() {
        let mut deviation = 0.0_f64;
        replay::<S>(&trace, |expected, own| {
            for (own, expected) in own.iter().zip(&expected[3..]) {
                deviation = deviation.max((own.to_f64() - expected).abs());
            }
        });
        println!("{scalar} {}: largest deviation {deviation:.2e}", trace.name);
        assert!(
            deviation <= tolerance,
            "{scalar} {}: largest deviation {deviation:e}, allowed {tolerance:e}",
            trace.name
        );
    }
}

#[test]
fn f64_repeats_the_traces_to_1e_12() {
    all_traces_agree::<f64>("f64", 1e-12);
}

#[test]
fn f32_repeats_the_traces_to_1e_5() {
    all_traces_agree::<f32>("f32", 1e-5);
}

#[test]
fn fixed_point_repeats_the_traces_to_4e_3() {
    all_traces_agree::<Fixed16>("Fixed16", 4e-3);
}

/// FNV-1a over the bits of everything that the `f32` brain computes in a trace.
fn fingerprint(trace: &Trace) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    replay::<f32>(trace, |_, own| {
        for byte in own.iter().flat_map(|value| value.to_bits().to_le_bytes()) {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    });
    hash
}

#[test]
fn the_bits_of_the_f32_brain_are_these_on_every_machine() {
    let fingerprints = traces().map(|trace| (trace.name, fingerprint(&trace)));
    assert_eq!(
        fingerprints,
        [
            ("closed_eq3", 0x993b_172a_f7f1_d3eb),
            ("model_eq7_8", 0x5a3a_4e34_6104_9ee0),
            ("controller_eq9_10", 0x2457_8bd8_f594_79d6),
            ("homeokinetic_eq12", 0x04c8_52b2_b89c_6fe6),
        ]
    );
}
