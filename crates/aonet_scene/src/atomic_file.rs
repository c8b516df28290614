//! Files that are written completely or not at all.

use crate::error::{Error, Result};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Writes `bytes` under a temporary name in the folder of `path`, then renames it to `path`.
/// An existing file is replaced; a device or pipe is written to.
///
/// # Errors
/// When the file cannot be written; no partial file remains, and an older file does not change.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    if path.metadata().is_ok_and(|m| !m.is_file() && !m.is_dir()) {
        let opened = File::options().write(true).open(path);
        return opened.and_then(|mut file| file.write_all(bytes)).map_err(Error::io(path));
    }
    let temporary = temporary_name(path)?;
    let written = File::create(&temporary)
        .and_then(|mut file| file.write_all(bytes).and_then(|()| file.sync_data()))
        .and_then(|()| std::fs::rename(&temporary, path));
    written.map_err(|cause| {
        // The first error is the one worth reporting; the file may not even exist.
        let _ = std::fs::remove_file(&temporary);
        Error::Io { path: path.to_owned(), cause }
    })
}

/// `NAME.PID.tmp` beside `path`: two processes never write the same one.
fn temporary_name(path: &Path) -> Result<PathBuf> {
    let Some(name) = path.file_name() else {
        return Err(Error::file(path, "a file name", "none"));
    };
    let mut name = name.to_owned();
    name.push(format!(".{}.tmp", std::process::id()));
    Ok(path.with_file_name(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn an_older_file_is_replaced_and_nothing_else_remains() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        write(&path, b"old and longer").unwrap();
        write(&path, b"new").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"new");
        assert_eq!(names(folder.path()), ["a"]);
    }

    #[test]
    fn a_failure_is_named_and_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let taken = folder.path().join("taken");
        std::fs::create_dir(&taken).unwrap();
        let message = write(&taken, b"x").unwrap_err().to_string();
        assert!(message.contains("taken"), "{message}");
        assert_eq!(names(folder.path()), ["taken"]);
        assert!(write(&folder.path().join("absent/a"), b"x").is_err());
        assert!(write(Path::new("/"), b"x").is_err());
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn devices_are_written_to_and_stay_devices() {
        write(Path::new("/dev/null"), b"x").unwrap();
        let message = write(Path::new("/dev/full"), b"x").unwrap_err().to_string();
        assert!(message.contains("/dev/full") && message.contains("No space left"), "{message}");
        assert!(!Path::new("/dev/null").is_file());
    }
}
