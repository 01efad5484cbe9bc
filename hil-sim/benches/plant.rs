//! How fast the plant is: one default step in each kind of motion, and a second of rolling under a trivial controller
//! (divide 1 s by that time for the multiple of real time). `cargo bench -p hil-sim --bench plant`.

use criterion::{Criterion, criterion_group, criterion_main};
use hil_sim::plant::{Body, Plant, Start};
use std::hint::black_box;

/// A barrel that stands on its rim, leaning by 20°.
fn tilted() -> Plant {
    let (s, c) = (35.0_f64.to_radians().sin(), 35.0_f64.to_radians().cos());
    let lean = 70.0_f64.to_radians();
    let start = Start::Free {
        position: [0.0, 0.0, 0.5 * lean.sin() + 0.5 * lean.cos()],
        orientation: [c, s, 0.0, 0.0],
        velocity: [0.0; 3],
        angular_velocity: [0.0, 0.0, 8.0],
    };
    Plant::new(Body::chapter(), start).expect("a valid body")
}

fn step(c: &mut Criterion) {
    let lying = Plant::new(Body::chapter(), Start::Lying { phi: 0.0, omega: 1.0 }).expect("a valid body");
    let upright = Plant::new(Body::chapter(), Start::Upright).expect("a valid body");
    for (name, start) in [("lying", lying), ("upright", upright), ("tilted", tilted())] {
        c.bench_function(&format!("one default step, {name}"), |b| {
            b.iter_batched_ref(|| start.clone(), |p| p.advance(0.01), criterion::BatchSize::SmallInput);
        });
    }
}

fn second(c: &mut Criterion) {
    for (name, gain, angle) in [("slow roll", 0.5, 0.2_f64), ("U(0.5), where it hops", 1.0, 0.5)] {
        let (s, co) = angle.sin_cos();
        let mut plant = Plant::new(Body::chapter(), Start::Lying { phi: 0.3, omega: 0.0 }).expect("a valid body");
        c.bench_function(&format!("one second lying, {name}"), |b| {
            b.iter(|| {
                for _ in 0..50 {
                    let [x1, x2] = plant.inclination();
                    let y = [gain * (co * x1 - s * x2), gain * (s * x1 + co * x2)];
                    plant.set_command(y.map(|z: f64| z / (1.0 + z.abs())));
                    plant.advance(0.02);
                }
                black_box(plant.phi())
            });
        });
    }
}

criterion_group!(benches, step, second);
criterion_main!(benches);
