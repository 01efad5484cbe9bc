//! The unmodified flash image on the virtual board.

use barrel_tests::setup;
use hil_sim::link::Embodied;
use hil_sim::measure::Measures;
use hil_sim::run::Run;
use hil_sim::setup::BodyKind;
use hil_sim::virtual_board::VirtualBoard;
use std::path::PathBuf;

fn image() -> PathBuf {
    std::env::var_os("BARREL_FIRMWARE").expect("`cargo xtask test` builds the image and says where it is").into()
}

#[test]
fn it_boots_homes_arms_leaves_rest_and_sweeps() {
    let board = VirtualBoard::power_on(&image()).expect("an image");
    let mut run = Run::start(setup("homeokinetic", BodyKind::Tabletop, 1, &[]), Embodied::new(board)).expect("starts");
    let mut measures = Measures::default();
    while run.time() < 60.0 {
        let record = run.step().expect("goes on");
        measures.add(&record);
    }
    let left = measures.left_rest().unwrap_or(f64::INFINITY);
    assert!(left < 60.0, "left rest at {left} s");
    assert!(measures.turns() > 1.0, "{} turns", measures.turns());
    assert_eq!(run.link_mut().lost(), 0);
    assert_eq!(run.link_mut().board_mut().gaps().expect("goes on"), Vec::<String>::new());
}
