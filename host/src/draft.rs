//! A file that appears whole or not at all: written beside its place under another name, then moved there.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

/// A file in the making. Dropped without [`Draft::commit`], it leaves no trace.
///
/// A pipe or a device has no draft: what is written to it has gone. A link is followed to the file that it names.
#[derive(Debug)]
pub struct Draft {
    /// Where to write; the target itself if that is no regular file.
    draft: PathBuf,
    target: PathBuf,
}

impl Draft {
    /// Reserves a hidden name beside `target`, with the same ending. Creates the file, so that a folder that cannot be
    /// written is noticed before any work is done.
    pub fn beside(target: &Path) -> io::Result<Draft> {
        let name = target.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "not a file name"))?;
        if target.is_dir() {
            return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder"));
        }
        // What is not there yet has no other name than the one given.
        let real = target.canonicalize().unwrap_or_else(|_| target.into());
        if real.exists() && !real.is_file() {
            return Ok(Draft { draft: real.clone(), target: real });
        }
        let draft = real.with_file_name(format!(".{}-{}", std::process::id(), name.to_string_lossy()));
        File::create(&draft)?;
        Ok(Draft { draft, target: real })
    }

    /// Where to write.
    pub fn path(&self) -> &Path {
        &self.draft
    }

    /// Makes the content safe on the disk, then moves it to its place, over whatever stood there.
    pub fn commit(self) -> io::Result<()> {
        if self.draft == self.target {
            return Ok(());
        }
        File::options().append(true).open(&self.draft)?.sync_all()?;
        std::fs::rename(&self.draft, &self.target)
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        if self.draft != self.target {
            // After a commit there is nothing left to remove.
            let _ = std::fs::remove_file(&self.draft);
        }
    }
}
