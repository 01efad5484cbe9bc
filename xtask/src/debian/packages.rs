//! Debian's packages: which, how they are downloaded and unpacked. Nothing is installed and no right is needed.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::command;

/// The compiler's package; its version is that of the others of the same source.
const COMPILER: &str = "rustc-web";
/// The oldest that builds this workspace.
const OLDEST: &str = env!("CARGO_PKG_RUST_VERSION");
/// Libraries that every program needs. A second C library beside the machine's would break them.
const BASE: [&str; 4] = ["libc6", "libgcc-s1", "libstdc++6", "libcrypt1"];

/// Checks that the programs used here are there.
///
/// # Errors
/// Names the one that is missing.
pub fn tools() -> Result<(), String> {
    for tool in ["apt-get", "apt-cache", "dpkg", "dpkg-query"] {
        if !command::succeeds(tool, &["--version"]) {
            return Err(format!("{tool} is missing: this machine has none of Debian's packages"));
        }
    }
    Ok(())
}

/// Downloads the packages into a folder, unpacks them into `unpacked` there, and returns the compiler's version.
///
/// # Errors
/// When the packages cannot be had.
pub fn fetch(work: &Path) -> Result<String, String> {
    let known = Lists::of_the_machine();
    let (version, archives) = download(&known, work).or_else(|why| {
        eprintln!("      the machine's lists of packages do not do ({why}); fetching new ones");
        download(&Lists::fetch(&work.join("apt"))?, work)
    })?;
    eprintln!("      unpacking {} packages", archives.len());
    for archive in archives {
        command::read(Command::new("dpkg").arg("-x").arg(archive).arg(work.join("unpacked")))?;
    }
    Ok(version)
}

fn download(lists: &Lists, work: &Path) -> Result<(String, Vec<PathBuf>), String> {
    let package = lists.newest_compiler()?;
    // 1.96.0+dfsg1-1~deb12u2: the compiler's own version, then Debian's.
    let version = package.split(['+', '-', '~']).next().unwrap_or(&package).to_owned();
    let library = format!("libstd-rust-web-{}", minor(&version).map(|(a, b)| format!("{a}.{b}")).unwrap_or_default());
    let same = [COMPILER, &library, "libstd-rust-web-dev", "rust-web-src", "rust-web-clippy"];
    let mut wanted: Vec<String> = same.iter().map(|name| format!("{name}={package}")).collect();
    wanted.extend(lists.libraries(&library)?);
    let folder = work.join("archives");
    // Of an earlier try with other lists.
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).map_err(|why| format!("{}: {why}", folder.display()))?;
    // One by one: that shows how far it is.
    for (before, package) in wanted.iter().enumerate() {
        eprintln!("      downloading {} of {}: {package}", before + 1, wanted.len());
        command::read(lists.apt("apt-get").args(["download", package]).current_dir(&folder))?;
    }
    let archives = folder.read_dir().map_err(|why| format!("{}: {why}", folder.display()))?;
    Ok((version, archives.flatten().map(|archive| archive.path()).collect()))
}

/// What is known of Debian's packages.
struct Lists {
    /// Options for apt's programs.
    options: Vec<String>,
}

impl Lists {
    /// Those that the machine has.
    fn of_the_machine() -> Self {
        Self { options: Vec::new() }
    }

    /// New ones from the servers that the machine is set up with, kept in a folder: the machine's own need root.
    fn fetch(folder: &Path) -> Result<Self, String> {
        let set = |name: &str, path: &str| {
            let path = folder.join(path);
            fs::create_dir_all(path.join("partial")).map_err(|why| format!("{}: {why}", path.display()))?;
            Ok::<_, String>(format!("-o{name}={}", path.display()))
        };
        let mut options = vec![set("Dir::State::Lists", "lists")?, set("Dir::Cache", "cache")?];
        options.push("-oAPT::Sandbox::User=root".into());
        let lists = Self { options };
        // It fails for any source that does not answer, and that may be one that matters not.
        let update = command::read(lists.apt("apt-get").arg("update"));
        lists.newest_compiler().map_err(|why| match update {
            Ok(_) => why,
            Err(update) => format!("{why}; {update}"),
        })?;
        Ok(lists)
    }

    fn apt(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        command.args(&self.options).args(["-q", "-oAcquire::http::Timeout=30", "-oAcquire::https::Timeout=30"]);
        command.env("LC_ALL", "C");
        command
    }

    /// The version of the newest compiler's package that is new enough.
    fn newest_compiler(&self) -> Result<String, String> {
        // "rustc-web | VERSION | SOURCE", the newest first.
        let table = command::read(self.apt("apt-cache").args(["madison", COMPILER]))?;
        let versions = table.lines().filter_map(|line| line.split('|').nth(1)).map(str::trim);
        let newest = versions.clone().find(|version| minor(version) >= minor(OLDEST)).map(str::to_owned);
        newest.ok_or_else(|| {
            let found: Vec<&str> = versions.collect();
            let found = if found.is_empty() { "none".into() } else { found.join(", ") };
            format!("no {COMPILER} of version {OLDEST} or later, found: {found}")
        })
    }

    /// The packages of shared libraries that the compiler needs and the machine has not. LLVM is always one of them: an
    /// update of the machine's would leave the compiler without.
    fn libraries(&self, package: &str) -> Result<Vec<String>, String> {
        // Names of packages at the left margin, their relations indented below.
        let tree = command::read(self.apt("apt-cache").args(["depends", "--important", "--recurse", package]))?;
        let names = tree.lines().filter(|line| line.starts_with(|first: char| first.is_ascii_alphanumeric()));
        let needed = names.filter(|name| *name != package && !BASE.contains(name) && !name.starts_with("gcc-"));
        let missing = needed.filter(|name| name.starts_with("libllvm") || !is_installed(name));
        Ok(missing.map(str::to_owned).collect())
    }
}

fn is_installed(package: &str) -> bool {
    let status = command::read(Command::new("dpkg-query").args(["-W", "-f=${db:Status-Status}\n", package]));
    status.is_ok_and(|status| status.lines().any(|line| line == "installed"))
}

/// Major and minor version.
fn minor(version: &str) -> Option<(u32, u32)> {
    let mut numbers = version.split('.');
    Some((numbers.next()?.parse().ok()?, numbers.next()?.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_compare_as_numbers() {
        assert!(minor("1.96.0+dfsg1-1~deb12u2") >= minor("1.95"));
        assert!(minor("1.100.0") > minor("1.96"));
        assert!(minor("1.85.0+dfsg3-1~deb12u3") < minor("1.95"));
        assert!(minor("unknown") < minor("1.95"));
    }
}
