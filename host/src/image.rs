//! The flash image for a virtual board: the one that was named, or one built from the sources.

use crate::failure::Failure;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Names an image in the environment.
const VARIABLE: &str = "BARREL_FIRMWARE";

/// The image that was given, else the one that the environment names, else one that is built from the sources that this
/// program was built from.
///
/// # Errors
/// A file that is not there; sources that are not there any more, or do not build.
pub fn find(given: Option<&Path>) -> Result<PathBuf, Failure> {
    if let Some(path) = given.map(Path::to_path_buf).or_else(|| std::env::var_os(VARIABLE).map(PathBuf::from)) {
        Failure::unless_there(&path)?;
        return Ok(path);
    }
    build(&Path::new(env!("CARGO_MANIFEST_DIR")).join(".."))
}

/// Has `cargo xtask firmware` build the image in the project's folder; its progress is shown.
fn build(project: &Path) -> Result<PathBuf, Failure> {
    if !project.join("xtask").is_dir() {
        return Err(Failure::bad(format!(
            "the sources that this program was built from are not here any more: give the flash image with --firmware \
             FILE.elf or in {VARIABLE}"
        )));
    }
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["xtask", "firmware", "--print-path"])
        .current_dir(project)
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| Failure::bad(format!("cargo cannot be run to build the flash image: {error}")))?;
    let said = String::from_utf8_lossy(&output.stdout);
    match said.lines().rfind(|line| !line.trim().is_empty()) {
        Some(path) if output.status.success() => Ok(path.trim().into()),
        _ => Err(Failure::bad(
            "the flash image could not be built (see above): `cargo xtask setup` makes this machine ready for it, or give \
             an image with --firmware FILE.elf",
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_that_is_not_there_is_named() {
        let said = find(Some(Path::new("no/such/image.elf"))).expect_err("it is not there").to_string();
        assert!(said.contains("no/such/image.elf"), "{said}");
    }

    #[test]
    fn without_sources_it_is_said_how_to_give_an_image() {
        let said = build(Path::new("no/such/project")).expect_err("it is not there").to_string();
        assert!(said.contains("--firmware") && said.contains(VARIABLE), "{said}");
    }
}
