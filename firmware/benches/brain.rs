//! How long a step of the brain takes, for each rule, scalar and size.
//!
//! `cargo bench -p firmware --bench brain`

use std::hint::black_box;

use criterion::{BenchmarkGroup, Criterion, criterion_group, criterion_main, measurement::WallTime};
use firmware::brain::{Brain, Rule, Settings};
use firmware::scalar::{Fixed16, Scalar};
use nalgebra::SVector;

const RULES: [Rule; 4] = [Rule::OpenLoop, Rule::Fixed, Rule::Homeostatic, Rule::Homeokinetic];

/// Sensor values of a slow roll, so that learning is in its usual regime; the steps between are what
/// is timed.
fn steps<S: Scalar, const N: usize, const M: usize>(group: &mut BenchmarkGroup<'_, WallTime>, scalar: &str) {
    let inputs: Vec<SVector<S, N>> = (0..256_u16)
        .map(|k| {
            SVector::from_fn(|i, _| {
                let angle = f64::from(k) * std::f64::consts::TAU / 128.0 + 1.1 * i as f64;
                S::from_f64(0.9 * angle.sin())
            })
        })
        .collect();
    for rule in RULES {
        let settings = Settings { rule, ..Settings::default() };
        let mut brain = Brain::<S, N, M>::new(settings).expect("the settings are in range");
        let mut k = 0;
        group.bench_function(format!("{scalar}/{N}x{M}/{rule:?}"), |bencher| {
            bencher.iter(|| {
                k = (k + 1) % inputs.len();
                brain.step(black_box(&inputs[k])).expect("all is finite")
            });
        });
    }
}

fn brain(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("step");
    steps::<f32, 2, 2>(&mut group, "f32");
    steps::<f64, 2, 2>(&mut group, "f64");
    steps::<Fixed16, 2, 2>(&mut group, "Fixed16");
    steps::<f32, 6, 4>(&mut group, "f32");
    steps::<f64, 6, 4>(&mut group, "f64");
    steps::<Fixed16, 6, 4>(&mut group, "Fixed16");
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .warm_up_time(std::time::Duration::from_millis(300))
        .measurement_time(std::time::Duration::from_secs(1));
    targets = brain
}
criterion_main!(benches);
