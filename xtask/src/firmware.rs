//! Builds the image for the board and shows what it takes of flash and RAM.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::budget::{Budget, budget};
use crate::command::{run, target_folder};
use crate::elf::{self, Sizes};
use crate::setup;
use crate::toolchain::{TARGETS, Toolchain};

/// Which image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Image {
    /// With logs over RTT.
    pub log: bool,
    /// The brain in fixed point, otherwise in f32.
    pub fixed: bool,
    /// For which core.
    pub target: &'static str,
}

impl Default for Image {
    fn default() -> Self {
        Self { log: true, fixed: false, target: TARGETS[0] }
    }
}

impl Image {
    /// Its name in messages and of its file.
    pub fn name(&self) -> String {
        format!("{}-{}", self.kind(), self.target)
    }

    /// What its budget goes by.
    fn kind(&self) -> &'static str {
        match (self.fixed, self.log) {
            (false, false) => "f32",
            (false, true) => "f32-log",
            (true, false) => "fixed",
            (true, true) => "fixed-log",
        }
    }

    /// A command of cargo for it: build or clippy.
    pub fn command(&self, toolchain: &Toolchain, subcommand: &str) -> Command {
        let mut features = vec!["board"];
        features.extend(self.log.then_some("log"));
        features.extend(self.fixed.then_some("fixed"));
        let mut cargo = toolchain.cargo(subcommand);
        cargo.args(["--package", "firmware", "--bin", "barrel-firmware", "--profile", "firmware"]);
        cargo.args(["--target", self.target, "--features", &features.join(",")]);
        cargo.arg("--target-dir").arg(folder());
        cargo
    }

    /// Builds it and returns where it is. Every kind of image has a file of its own.
    ///
    /// # Errors
    /// When it does not compile or cannot be copied.
    pub fn build(&self) -> Result<PathBuf, String> {
        run(&format!("image {}", self.name()), &mut self.command(&self.toolchain()?, "build"))?;
        let built = folder().join(self.target).join("firmware/barrel-firmware");
        let images = folder().join("images");
        fs::create_dir_all(&images).map_err(|why| format!("{}: {why}", images.display()))?;
        let image = images.join(format!("barrel-{}.elf", self.name()));
        fs::copy(&built, &image).map_err(|why| format!("cannot copy {}: {why}", built.display()))?;
        Ok(image)
    }

    /// A compiler for it.
    ///
    /// # Errors
    /// When the machine has none.
    pub fn toolchain(&self) -> Result<Toolchain, String> {
        Toolchain::find(self.target).ok_or_else(|| format!("no compiler for {}: run `cargo xtask setup`", self.target))
    }

    /// Shows what it takes of its budget.
    ///
    /// # Errors
    /// When it takes more, or is no image.
    pub fn check(&self, file: &Path) -> Result<(), String> {
        let bytes = fs::read(file).map_err(|why| format!("{}: {why}", file.display()))?;
        let sizes = elf::sizes(&bytes).map_err(|why| format!("{}: {why}", file.display()))?;
        let budget = budget(self.kind())?;
        eprint!("{}", table(sizes, budget));
        if sizes.flash > budget.flash || sizes.ram > budget.ram {
            return Err(format!("image {} takes more than firmware/budget.toml allows", self.name()));
        }
        Ok(())
    }
}

/// What `cargo xtask firmware` was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Order {
    image: Image,
    print_path: bool,
}

impl Order {
    /// Reads the words after `firmware`.
    ///
    /// # Errors
    /// Names the word that is not understood.
    pub fn parse(words: &[&str]) -> Result<Self, String> {
        let mut order = Self { image: Image::default(), print_path: false };
        let mut words = words.iter().copied();
        while let Some(word) = words.next() {
            match word {
                "--no-log" => order.image.log = false,
                "--fixed" => order.image.fixed = true,
                "--print-path" => order.print_path = true,
                "--target" => order.image.target = target(words.next().unwrap_or_default())?,
                _ if word.starts_with("--target=") => order.image.target = target(&word["--target=".len()..])?,
                _ => return Err(format!("firmware: '{word}' is not understood, see cargo xtask help")),
            }
        }
        Ok(order)
    }

    /// Builds, shows and, if asked to, prints the path.
    ///
    /// # Errors
    /// When it cannot be built or takes more than it may.
    pub fn execute(&self) -> Result<(), String> {
        if self.image.toolchain().is_err() {
            setup::targets()?;
        }
        let file = self.image.build()?;
        self.image.check(&file)?;
        if self.print_path {
            println!("{}", file.display());
        }
        Ok(())
    }
}

/// Where images are built: apart from everything else, as their compiler may be another.
fn folder() -> PathBuf {
    target_folder().join("firmware")
}

fn target(name: &str) -> Result<&'static str, String> {
    let known = TARGETS.into_iter().find(|target| *target == name);
    known.ok_or_else(|| format!("firmware: there is no target '{name}', only {}", TARGETS.join(" and ")))
}

fn table(sizes: Sizes, budget: Budget) -> String {
    let row = |what: &str, bytes: u64, most: u64| {
        let over = if bytes > most { "  OVER" } else { "" };
        format!("    {what:<12}{bytes:>9}{most:>9}{:>6} %{over}\n", 100 * bytes / most.max(1))
    };
    let head = format!("    {:<12}{:>9}{:>9}{:>8}\n", "", "bytes", "budget", "used");
    head + &row("flash", sizes.flash, budget.flash) + &row("static RAM", sizes.ram, budget.ram)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_itself_an_image_has_logs_f32_and_the_board_s_core() {
        let order = Order::parse(&[]).expect("understood");
        assert_eq!(order.image.name(), "f32-log-thumbv7em-none-eabihf");
        assert!(!order.print_path);
    }

    #[test]
    fn options_choose_the_image() {
        let order = Order::parse(&["--fixed", "--no-log", "--target", "thumbv7m-none-eabi", "--print-path"]);
        let order = order.expect("understood");
        assert_eq!(order.image.name(), "fixed-thumbv7m-none-eabi");
        assert!(order.print_path);
        assert_eq!(Order::parse(&["--target=thumbv7m-none-eabi"]).map(|order| order.image.target), Ok(TARGETS[1]));
    }

    #[test]
    fn what_is_not_understood_is_named() {
        for words in [&["--fast"][..], &["--target", "avr"], &["--target"], &["image"]] {
            let why = Order::parse(words).expect_err("not understood");
            assert!(why.contains(words.last().expect("a word")) || why.contains("''"), "{why}");
        }
    }

    #[test]
    fn the_table_marks_what_is_over() {
        let budget = Budget { flash: 1000, ram: 100 };
        assert!(!table(Sizes { flash: 1000, ram: 100 }, budget).contains("OVER"));
        let over = table(Sizes { flash: 1000, ram: 101 }, budget);
        assert!(over.lines().any(|line| line.contains("static RAM") && line.contains("OVER")), "{over}");
    }
}
