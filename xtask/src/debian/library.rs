//! The parts of the standard library that a microcontroller needs, compiled from their source.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::command;
use crate::toolchain::{TARGETS, Toolchain};

/// A crate that uses a constant, a formatted text and a division of long numbers: core and compiler_builtins must both be
/// there and of this compiler.
const PROOF: &str = r#"
#![no_std]
#![no_main]
use core::fmt::Write;
struct Sum(u64);
impl Write for Sum {
    fn write_str(&mut self, text: &str) -> core::fmt::Result {
        for byte in text.bytes() {
            self.0 = self.0.wrapping_mul(31) / u64::from(byte).max(1);
        }
        Ok(())
    }
}
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {}
}
#[unsafe(no_mangle)]
extern "C" fn _start(x: f32) -> u64 {
    let mut sum = Sum(7);
    let _ = write!(sum, "{}", x);
    sum.0
}
"#;

/// Compiles core, alloc and compiler_builtins for every target and puts them where the compiler looks for them.
///
/// # Errors
/// When the source is not as expected or does not compile.
pub fn build(toolchain: &Toolchain, prefix: &Path, work: &Path) -> Result<(), String> {
    let library = source(&work.join("unpacked/usr/src"))?;
    write(&library.join("Cargo.toml"), &workspace(&library))?;
    // Of the whole workspace; the parts that are left need nothing from a registry.
    fs::remove_file(library.join("Cargo.lock")).map_err(|why| format!("Cargo.lock of the library: {why}"))?;
    without_c(&library.join("compiler-builtins/compiler-builtins/Cargo.toml"))?;

    let target_folder = work.join("target");
    let mut cargo = toolchain.cargo("build");
    cargo.args(["--offline", "--profile", "dist", "--package", "alloc", "--features", "compiler-builtins-mem"]);
    cargo.args(TARGETS.iter().flat_map(|target| ["--target", target]));
    cargo.arg("--target-dir").arg(&target_folder).current_dir(&library);
    // The library of a released compiler uses what is not yet released for others.
    cargo.env("RUSTC_BOOTSTRAP", "1");
    for variable in ["RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS", "CARGO_TARGET_DIR", "RUSTC_WRAPPER"] {
        cargo.env_remove(variable);
    }
    // It says something all the time, which its log shows; where it is, is for the person as well.
    let log = work.join("library.log");
    let mut shown = 0;
    let progress = || {
        let said = fs::read_to_string(&log).unwrap_or_default();
        for part in parts(&said).skip(shown) {
            eprintln!("        {part}");
            shown += 1;
        }
        said.len() as u64
    };
    command::run_watched(&mut cargo, Duration::from_secs(600), progress, &log)?;

    for target in TARGETS {
        let place = prefix.join("lib/rustlib").join(target).join("lib");
        fs::create_dir_all(&place).map_err(|why| format!("{}: {why}", place.display()))?;
        let built = target_folder.join(target).join("dist/deps");
        for file in built.read_dir().map_err(|why| format!("{}: {why}", built.display()))?.flatten() {
            let path = file.path();
            if path.extension().is_some_and(|extension| extension == "rlib") {
                let to = place.join(file.file_name());
                fs::copy(&path, &to).map_err(|why| format!("{}: {why}", to.display()))?;
            }
        }
    }
    Ok(())
}

/// Compiles and links a small crate.
///
/// # Errors
/// When that fails.
pub fn prove(toolchain: &Toolchain, target: &str, work: &Path) -> Result<(), String> {
    let crate_root = work.join("proof.rs");
    write(&crate_root, PROOF)?;
    let mut rustc = toolchain.rustc();
    rustc.args(["--edition", "2024", "-O", "-Cpanic=abort", "--target", target]).arg(&crate_root);
    rustc.arg("-o").arg(work.join(format!("proof-{target}")));
    command::read(&mut rustc).map(|_| ())
}

/// What cargo says that it compiles, without the folder. Its last line may not be whole yet.
fn parts(said: &str) -> impl Iterator<Item = &str> {
    let whole = said.rfind('\n').map_or("", |end| &said[..end]);
    let parts = whole.lines().filter_map(|line| line.trim_start().strip_prefix("Compiling "));
    parts.map(|part| part.split(" (").next().unwrap_or(part))
}

/// The folder `library` of the compiler's source.
fn source(sources: &Path) -> Result<PathBuf, String> {
    let folders = sources.read_dir().map_err(|why| format!("{}: {why}", sources.display()))?.flatten();
    let library = folders.map(|folder| folder.path().join("library")).find(|library| library.join("alloc").is_dir());
    library.ok_or_else(|| "Debian's package of the compiler's source has no folder 'library'".into())
}

/// The library's workspace with nothing in it but what is built, and the profile with which the compiler's makers build it.
/// The paths in its messages are those of every released compiler, not this machine's.
fn workspace(library: &Path) -> String {
    format!(
        r#"cargo-features = ["profile-rustflags"]

[workspace]
resolver = "1"
members = ["alloc"]

[profile.release.package.compiler_builtins]
codegen-units = 10000

[profile.dist]
inherits = "release"
codegen-units = 1
debug = 1
rustflags = [
    "-Cembed-bitcode=yes",
    "-Zunstable-options",
    "-Cforce-frame-pointers=non-leaf",
    '--remap-path-prefix={}=/rustc/library',
]
"#,
        library.display()
    )
}

/// Removes the choice of compiler_builtins' parts in C, for which a crate would have to be downloaded.
fn without_c(manifest: &Path) -> Result<(), String> {
    let mut text = fs::read_to_string(manifest).map_err(|why| format!("{}: {why}", manifest.display()))?;
    for (expected, instead) in [("cc = { version = \"1.2\", optional = true }\n", ""), ("c = [\"dep:cc\"]", "c = []")] {
        if !text.contains(expected) {
            return Err(format!(
                "the compiler's source has changed: '{}' is not in {}",
                expected.trim(),
                manifest.display()
            ));
        }
        text = text.replace(expected, instead);
    }
    write(manifest, &text)
}

fn write(file: &Path, text: &str) -> Result<(), String> {
    fs::write(file, text).map_err(|why| format!("{}: {why}", file.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_shown_once_their_line_is_whole() {
        let said = "warning: x\n   Compiling core v0.0.0 (/library/core)\n   Compiling cfg v1.0.0\n   Compiling al";
        assert_eq!(parts(said).collect::<Vec<_>>(), ["core v0.0.0", "cfg v1.0.0"]);
        assert_eq!(parts("   Compiling co").count(), 0);
    }
}
