//! How fast the whole loop is: one simulated second of homeokinetic control on each body, with and without the wire. Divide
//! 1 s by the time for the multiple of real time. `cargo bench -p hil-sim --bench loop`.

use criterion::{Criterion, criterion_group, criterion_main};
use firmware::Robot;
use hil_sim::experiment::Experiment;
use hil_sim::link::{Direct, InProcess, Line, Link};
use hil_sim::run::Run;
use hil_sim::setup::{BodyKind, Setup};

/// A run that has left rest.
fn rolling<L: Link>(body: BodyKind, link: L) -> Run<L> {
    let experiment = Experiment::find("homeokinetic").expect("an experiment of the table");
    let mut run = Run::start(Setup::new(experiment, body), link).expect("starts");
    second(&mut run, 60);
    run
}

fn second<L: Link>(run: &mut Run<L>, seconds: u32) {
    for _ in 0..50 * seconds {
        run.step().expect("goes on");
        // What a recorder would take away.
        run.link_mut().drain_frames(&mut |_, _| {});
    }
}

fn bench(c: &mut Criterion) {
    for body in BodyKind::ALL {
        let mut run = rolling(body, Direct(Robot::<f32>::default()));
        c.bench_function(&format!("one second of {}, library", body.name()), |b| b.iter(|| second(&mut run, 1)));
        let mut run = rolling(body, Line::new(InProcess::new(Robot::<f32>::default())));
        c.bench_function(&format!("one second of {}, over the wire", body.name()), |b| b.iter(|| second(&mut run, 1)));
    }
}

criterion_group!(benches, bench);
criterion_main!(benches);
