//! The whole test run.

use std::path::PathBuf;

use crate::command::{cargo, run};
use crate::firmware::Image;
use crate::setup;
use crate::toolchain::TARGETS;

/// What plain commands leave out, as the emulator builds for minutes. It declares a newer compiler than it needs.
const VIRTUAL_BOARD: [&str; 3] = ["--features", "virtual-board", "--ignore-rust-version"];

/// Every image, and the variable by which the tests on the virtual board find it.
const IMAGES: [(Image, Option<&str>); 4] = [
    (Image { log: true, fixed: false, target: TARGETS[0] }, Some("BARREL_FIRMWARE")),
    (Image { log: false, fixed: false, target: TARGETS[0] }, Some("BARREL_FIRMWARE_NO_LOG")),
    (Image { log: false, fixed: true, target: TARGETS[0] }, Some("BARREL_FIRMWARE_FIXED")),
    (Image { log: false, fixed: true, target: TARGETS[1] }, None),
];

/// Packages with tests on the virtual board. One command runs all of their tests, those that need no board once more, optimised:
/// two commands would resolve features differently and compile the emulator twice.
const ON_BOARD: [&str; 2] = ["barrel-tests", "barrel-host"];

/// Set-up, then everything that can be checked on this machine.
///
/// # Errors
/// At the first step that fails; at the end, if no images can be built or one is too large.
pub fn everything() -> Result<(), String> {
    setup::components()?;
    let targets = setup::targets();
    run("formatting", cargo("fmt").args(["--all", "--check"]))?;
    run("lints", cargo("clippy").args(["--workspace", "--all-targets", "--", "-D", "warnings"]))?;
    let mut lints = cargo("clippy");
    lints.args(
        ["hil-sim", "barrel-host", "barrel-playground", "barrel-tests"].iter().flat_map(|name| ["--package", name]),
    );
    run("lints, virtual board", lints.arg("--all-targets").args(VIRTUAL_BOARD).args(["--", "-D", "warnings"]))?;
    run("documentation", cargo("doc").args(["--workspace", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings"))?;
    let built = targets.and_then(|()| images());
    run("tests", cargo("test").args(["--workspace", "--no-fail-fast"]))?;
    let built = built.map_err(|why| format!("neither the image nor the virtual board was tested: {why}"))?;
    let mut tests = cargo("test");
    tests.args(["--release", "--no-fail-fast"]).args(VIRTUAL_BOARD);
    tests.args(ON_BOARD.iter().flat_map(|package| ["--package", package]));
    run("tests, virtual board", tests.envs(built.files))?;
    match built.over.is_empty() {
        true => Ok(()),
        false => Err(built.over.join("\n")),
    }
}

/// The images that were built.
struct Built {
    /// By the variables that tell the tests.
    files: Vec<(&'static str, PathBuf)>,
    /// Budgets that are not kept. What else there is to find is worth knowing too, so they are told last.
    over: Vec<String>,
}

/// Lints the image and builds all of its kinds.
fn images() -> Result<Built, String> {
    // These two see every line: with and without logs, f32 and fixed point.
    for (image, _) in [&IMAGES[0], &IMAGES[2]] {
        let mut lints = image.command(&image.toolchain()?, "clippy");
        run(&format!("lints, image {}", image.name()), lints.args(["--", "-D", "warnings"]))?;
    }
    let mut built = Built { files: Vec::new(), over: Vec::new() };
    for (image, variable) in &IMAGES {
        let file = image.build()?;
        built.over.extend(image.check(&file).err());
        built.files.extend(variable.map(|variable| (variable, file)));
    }
    Ok(built)
}
