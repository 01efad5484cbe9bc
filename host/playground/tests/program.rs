//! The program itself, where there is no screen.

#![cfg(target_os = "linux")]

use std::process::{Command, Output};

fn play(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_barrel-play"));
    for variable in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(variable);
    }
    command.args(args).output().expect("it starts")
}

#[test]
fn without_a_screen_it_says_what_can_be_done_there() {
    let output = play(&["homeokinetic"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("no window can be opened") && said.contains("`barrel console`"), "{said}");
}

#[test]
fn bad_input_is_refused_before_a_window_is_tried() {
    for (args, word) in [(["--open", "no.mcap"], "no.mcap"), (["--set", "epsC=99"], "epsC")] {
        let output = play(&args);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(word), "{said}");
    }
}
