//! Where nothing may be written the barrel goes on, and that nobody records it is said. A file of its own: the tests of a file
//! share the folder that they run in.

mod bench;

use bench::{folder, frames, open, until};
use egui_kittest::kittest::Queryable;
use playground::order::Order;

#[test]
fn a_session_that_cannot_be_recorded_says_so_and_goes_on() {
    // Permissions stop nobody who is root; a file in the way does.
    std::fs::write(folder().join("runs"), b"in the way").expect("written");
    let mut window = open(&["homeokinetic"]);
    until(&mut window, "it is said", |window| window.query_by_label_contains("not recorded: ").is_some());
    until(&mut window, "it rolls", |window| window.state().history().len() > 20);
    assert_eq!(window.state().status().log, None);
    let rows = window.state().history().len();
    window.state().order(Order::Line("speed 10".to_owned()));
    until(&mut window, "it goes on", |window| window.state().history().len() > rows + 100);
    frames(&mut window, 3);
    window.get_by_label("Experiment").click();
    frames(&mut window, 3);
    window.get_by_label("open-loop (Experiment 1.1)").click();
    until(&mut window, "so does the next", |window| {
        window.state().status().session == 2 && window.state().history().len() > 5
    });
    assert_eq!(std::fs::read(folder().join("runs")).expect("read"), b"in the way");
}
