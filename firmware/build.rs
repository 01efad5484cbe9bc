//! Where the linker finds its scripts, for the image only.

use std::path::Path;
use std::{env, fs};

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=../memory.x");
    if env::var_os("CARGO_FEATURE_BOARD").is_none() {
        return;
    }
    let out = env::var("OUT_DIR").expect("cargo sets OUT_DIR");
    // Beside the workspace, as every tool expects it; the linker looks for it where it is told.
    fs::copy("../memory.x", Path::new(&out).join("memory.x")).expect("memory.x stands at the top of the repository");
    println!("cargo:rustc-link-search={out}");
    for argument in ["--nmagic", "-Tlink.x"] {
        println!("cargo:rustc-link-arg-bin=barrel-firmware={argument}");
    }
    if env::var_os("CARGO_FEATURE_LOG").is_some() {
        println!("cargo:rustc-link-arg-bin=barrel-firmware=-Tdefmt.x");
    }
}
