//! Which compiler makes the images: the one that everything else is built with, if it knows the target, or one that
//! [`debian`] made.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::command::{self, cargo};
use crate::debian;

/// The board's core, and one without a floating-point unit, for which the fixed-point brain is built.
pub const TARGETS: [&str; 2] = ["thumbv7em-none-eabihf", "thumbv7m-none-eabi"];

/// A compiler that can compile for a microcontroller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Toolchain {
    /// The one that `cargo` uses by itself.
    Default,
    /// One in a folder of its own.
    Made(PathBuf),
}

impl Toolchain {
    /// One for a target, if this machine has one.
    pub fn find(target: &str) -> Option<Self> {
        let made = || debian::made().map(Self::Made);
        std::iter::once(Self::Default).chain(made()).find(|toolchain| toolchain.has(target))
    }

    /// Whether it can compile for a target.
    pub fn has(&self, target: &str) -> bool {
        let folder = command::read(self.rustc().args(["--print", "target-libdir", "--target", target]));
        folder.is_ok_and(|folder| has_core(Path::new(folder.trim())))
    }

    /// Its compiler.
    pub fn rustc(&self) -> Command {
        match self {
            Self::Default => Command::new("rustc"),
            Self::Made(prefix) => {
                let mut rustc = Command::new(prefix.join("bin/rustc"));
                rustc.env("LD_LIBRARY_PATH", prefix.join("lib"));
                rustc
            }
        }
    }

    /// A subcommand of cargo that uses it.
    pub fn cargo(&self, subcommand: &str) -> Command {
        let Self::Made(prefix) = self else { return cargo(subcommand) };
        // Clippy finds its driver beside itself, and the driver must be of the compiler's version.
        let mut command = match subcommand {
            "clippy" => Command::new(prefix.join("bin/cargo-clippy")),
            _ => Command::new("cargo"),
        };
        command.arg(subcommand).current_dir(command::root());
        command.env("RUSTC", prefix.join("bin/rustc")).env("LD_LIBRARY_PATH", prefix.join("lib"));
        command
    }

    /// Which compiler it is.
    ///
    /// # Errors
    /// When it does not run.
    pub fn version(&self) -> Result<String, String> {
        Ok(command::read(self.rustc().arg("--version"))?.trim().to_owned())
    }
}

/// Whether a folder holds the core library.
fn has_core(folder: &Path) -> bool {
    let Ok(files) = folder.read_dir() else { return false };
    files.flatten().any(|file| {
        let name = file.file_name().to_string_lossy().into_owned();
        name.starts_with("libcore-") && name.ends_with(".rlib")
    })
}
