//! A compiler for the microcontroller out of Debian's packages, for machines that reach Debian's servers and not rustup's.
//!
//! Debian packages a recent compiler for its web browser, `rustc-web`, with its source. The packages are unpacked into a
//! folder of their own, nothing is installed; of the standard library the parts for a microcontroller (core, alloc,
//! compiler_builtins) are then compiled from that source. cargo and the linker stay those of the machine's own toolchain.

mod library;
mod packages;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;
use std::{env, fs};

use crate::command;
use crate::toolchain::{TARGETS, Toolchain};

/// Counts the ways in which this file's result has changed: another one is made beside the old.
const RECIPE: u32 = 1;

/// The compiler that was made, if there is one that is whole.
pub fn made() -> Option<PathBuf> {
    let folders = shelf()?.read_dir().ok()?.flatten().map(|entry| entry.path());
    let name = |folder: &Path| folder.file_name().map(|name| name.to_string_lossy().into_owned());
    let ours = |name: String| name.starts_with("arm-toolchain-") && name.ends_with(&format!("-{RECIPE}"));
    folders.filter(|folder| name(folder).is_some_and(ours)).filter(|folder| linker(folder).is_ok()).max()
}

/// Makes one, or does nothing if there is one.
///
/// # Errors
/// When a program or a package is missing, or a step fails; with what to do.
pub fn make() -> Result<(), String> {
    if made().is_some() {
        return Ok(());
    }
    let start = Instant::now();
    packages::tools()?;
    let shelf = shelf().ok_or("neither XDG_CACHE_HOME nor a home folder is known")?;
    // Built beside its place and moved there at the end: an interruption leaves nothing that looks whole.
    let part = shelf.join(format!("part-{}", std::process::id()));
    remove_abandoned(&shelf);
    eprintln!(
        "    installing: a compiler out of Debian's packages in {} (140 MB to download, 530 MB there)",
        shelf.display()
    );
    let version = make_in(&part).inspect_err(|_| {
        let _ = fs::remove_dir_all(&part);
    })?;
    let place = shelf.join(format!("arm-toolchain-{version}-{RECIPE}"));
    // What stands there is not whole, or `made` had found it.
    let _ = fs::remove_dir_all(&place);
    rename(&part, &place)?;
    eprintln!("    installed: {} in {} s", place.display(), start.elapsed().as_secs());
    Ok(())
}

/// Fills a folder and returns the compiler's version.
fn make_in(part: &Path) -> Result<String, String> {
    let work = part.join("work");
    for folder in [&work, &part.join("bin"), &part.join("lib")] {
        fs::create_dir_all(folder).map_err(|why| format!("{}: {why}", folder.display()))?;
    }
    let version = packages::fetch(&work)?;
    assemble(&work.join("unpacked"), part)?;
    let toolchain = Toolchain::Made(part.to_path_buf());
    eprintln!("      compiling the library of {} for {}", toolchain.version()?, TARGETS.join(" and "));
    library::build(&toolchain, part, &work)?;
    eprintln!("      compiling and linking a program with it");
    for target in TARGETS {
        library::prove(&toolchain, target, &work)?;
    }
    fs::remove_dir_all(&work).map_err(|why| format!("{}: {why}", work.display()))?;
    Ok(version)
}

/// Puts compiler, clippy and libraries out of the unpacked packages where a toolchain has them, and links the linker.
fn assemble(unpacked: &Path, part: &Path) -> Result<(), String> {
    for program in ["rustc", "cargo-clippy", "clippy-driver"] {
        rename(&unpacked.join("usr/bin").join(program), &part.join("bin").join(program))?;
    }
    for libraries in [unpacked.join("usr/lib"), unpacked.join("lib")] {
        for folder in entries(&libraries)?.filter(|path| path.is_dir()) {
            for file in entries(&folder)?.filter(|path| is_shared_library(path)) {
                rename(&file, &part.join("lib").join(file.file_name().unwrap_or_default()))?;
            }
        }
    }
    rename(&unpacked.join("usr/lib/rustlib"), &part.join("lib/rustlib"))?;
    // Points to where the source would be installed.
    let _ = fs::remove_file(part.join("lib/rustlib/src"));
    let host = host()?;
    let sysroot = command::read(Command::new("rustc").args(["--print", "sysroot"]))?;
    let tools = Path::new(sysroot.trim()).join("lib/rustlib").join(&host).join("bin");
    let place = part.join("lib/rustlib").join(&host).join("bin");
    symlink(&tools, &place).map_err(|why| format!("{}: {why}", place.display()))?;
    linker(part).map(|_| ())
}

/// The linker of a toolchain that was made.
fn linker(prefix: &Path) -> Result<PathBuf, String> {
    let linker = prefix.join("lib/rustlib").join(host()?).join("bin/rust-lld");
    match linker.exists() {
        true => Ok(linker),
        false => Err("the linker rust-lld is missing: it is part of every toolchain that rustup installs".into()),
    }
}

/// The machine's own target, as the compiler names it.
fn host() -> Result<String, String> {
    let version = command::read(Command::new("rustc").arg("-vV"))?;
    let host = version.lines().find_map(|line| line.strip_prefix("host: "));
    host.map(str::to_owned).ok_or_else(|| "rustc -vV names no host".into())
}

/// Where the toolchains that were made stand.
fn shelf() -> Option<PathBuf> {
    let set = env::var_os("XDG_CACHE_HOME").map(PathBuf::from).filter(|path| path.is_absolute());
    Some(set.or_else(|| Some(env::home_dir()?.join(".cache")))?.join("barrel"))
}

/// Removes what interrupted runs have left.
fn remove_abandoned(shelf: &Path) {
    for folder in entries(shelf).into_iter().flatten() {
        let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let process = name.strip_prefix("part-").filter(|process| process.parse::<u32>().is_ok());
        if process.is_some_and(|process| !Path::new("/proc").join(process).exists()) {
            let _ = fs::remove_dir_all(folder);
        }
    }
}

#[cfg(unix)]
use std::os::unix::fs::symlink;

/// Debian runs nowhere else; here for the sake of the other tasks.
#[cfg(not(unix))]
fn symlink(_: &Path, _: &Path) -> std::io::Result<()> {
    Err(std::io::ErrorKind::Unsupported.into())
}

fn is_shared_library(path: &Path) -> bool {
    path.file_name().is_some_and(|name| {
        let name = name.to_string_lossy();
        name.ends_with(".so") || name.contains(".so.")
    })
}

/// What a folder holds; nothing if there is no such folder.
fn entries(folder: &Path) -> Result<impl Iterator<Item = PathBuf>, String> {
    let entries = match folder.read_dir() {
        Ok(entries) => Some(entries),
        Err(why) if why.kind() == std::io::ErrorKind::NotFound => None,
        Err(why) => return Err(format!("{}: {why}", folder.display())),
    };
    Ok(entries.into_iter().flatten().flatten().map(|entry| entry.path()))
}

fn rename(from: &Path, to: &Path) -> Result<(), String> {
    fs::rename(from, to).map_err(|why| format!("cannot move {} to {}: {why}", from.display(), to.display()))
}
