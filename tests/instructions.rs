//! probe
use barrel_tests::board::{Bench, image_in_fixed_point, image_without_logs};
use protocol::Id;

#[test]
fn probe() {
    for (name, image) in [("f32", image_without_logs()), ("fixed", image_in_fixed_point())] {
        let mut bench = Bench::start(&image, "homeokinetic", 1, &[("omega0", 2.0)]);
        let _ = Id::Rule;
        for _ in 0..50 {
            bench.control_step();
        }
        for _ in 0..45 {
            bench.pass(1);
            let p = &bench.board().pins;
            eprint!("{}/{:?} ", p.instructions, p.servo_instructions);
        }
        bench.pass(1000);
        eprintln!("\n{name} {:?}", bench.robot.vitals());
    }
}
