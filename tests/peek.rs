use barrel_tests::*;
use hil_sim::setup::*;
use hil_sim::link::*;
use hil_sim::run::*;
use firmware::Robot;
#[test]
fn peek() {
    for exp in ["homeokinetic","closed-loop"] { for seed in 1..=3 {
        let mut run = Run::start(setup(exp, BodyKind::Tabletop, seed, &[]), Direct(Robot::<f32>::default())).unwrap();
        let mut m = hil_sim::measure::Measures::default();
        let mut err:f64=0.0; let mut serr: f64=0.0;
        for k in 0..6000 { 
            let truth=run.plant().inclination();
            let r = run.step().unwrap(); m.add(&r);
            let e=((truth[0]-r.brain.x[0] as f64).powi(2)+(truth[1]-r.brain.x[1] as f64).powi(2)).sqrt(); if e>err {err=e;} serr+=e*e;
            if k%500==0 { println!("{k} {:?} om {:.2} s {:.3?} x {:.2?} y {:.2?} e {e:.3} tilt {:.3} st {:?}", r.brain.t, r.plant.omega, r.plant.weights, r.brain.x, r.brain.y, r.plant.tilt, run.link_mut().0.safety_state()); }
        }
        println!("{exp} {seed} {:?} {:?} n {} maxerr {err:.3} rms {:.4}", m.left_rest(), m.speed(), m.reversals().len(), (serr/6000.0).sqrt());
    }}
}
