//! The budget file, `firmware/budget.toml`: lines of `name = bytes` and comments.

use std::fs;

use crate::command::root;

const FILE: &str = "firmware/budget.toml";

/// What an image may take, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    /// Flash.
    pub flash: u64,
    /// RAM, without the stack.
    pub ram: u64,
}

/// The budget of a kind of image: `f32` or `fixed`, with `-log` if it has logs.
///
/// # Errors
/// When the file or a name is missing, or a value is not a number.
pub fn budget(kind: &str) -> Result<Budget, String> {
    let text = fs::read_to_string(root().join(FILE)).map_err(|why| format!("{FILE}: {why}"))?;
    Ok(Budget { flash: value(&text, &format!("flash-{kind}"))?, ram: value(&text, "static-ram")? })
}

fn value(text: &str, name: &str) -> Result<u64, String> {
    let mut lines = text.lines().map(|line| line.split('#').next().unwrap_or_default());
    let value = lines.find_map(|line| {
        let (key, value) = line.split_once('=')?;
        (key.trim() == name).then(|| value.trim().replace('_', ""))
    });
    let value = value.ok_or_else(|| format!("{FILE} has no '{name}'"))?;
    value.parse().map_err(|_| format!("{FILE}: '{name}' is not a number of bytes: {value}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_found_by_its_whole_name() {
        let text = "# flash-f32 = 1\nflash-f32-log = 2 # more\n\n  flash-f32 = 65_536\n";
        assert_eq!(value(text, "flash-f32"), Ok(65_536));
        assert_eq!(value(text, "flash-f32-log"), Ok(2));
    }

    #[test]
    fn what_is_missing_or_no_number_is_named() {
        assert_eq!(value("flash-f32 = 1", "static-ram"), Err("firmware/budget.toml has no 'static-ram'".into()));
        assert!(value("flash-f32 = 64 KiB", "flash-f32").unwrap_err().contains("64 KiB"));
    }

    #[test]
    fn the_committed_file_is_complete() {
        for kind in ["f32", "f32-log", "fixed", "fixed-log"] {
            budget(kind).expect("a budget");
        }
    }
}
