//! Checks whether this process may write into a folder.

use std::io;
use std::path::Path;

use rustix::fs::{Access, access};

/// Checks with the kernel whether files can be created in a folder, which need not exist yet. Creates
/// nothing. Fails with the reason: `NotADirectory`, `PermissionDenied`, `ReadOnlyFilesystem`, …
pub fn check_writable(folder: &Path) -> io::Result<()> {
    // The nearest existing ancestor; the gateway creates the folders below it.
    let mut existing = folder.ancestors().filter(|folder| folder.symlink_metadata().is_ok());
    let here = Path::new(".");
    let existing = existing.next().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(here);
    if !existing.is_dir() {
        return Err(io::ErrorKind::NotADirectory.into());
    }
    Ok(access(existing, Access::WRITE_OK | Access::EXEC_OK)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folder_is_writable_if_it_or_the_first_one_above_is() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, "").unwrap();
        assert!(check_writable(folder.path()).is_ok());
        assert!(check_writable(&folder.path().join("new/black-box")).is_ok());
        for path in [file.clone(), file.join("black-box")] {
            assert_eq!(check_writable(&path).unwrap_err().kind(), io::ErrorKind::NotADirectory);
        }
        assert!(check_writable(Path::new("/proc/1/black-box")).is_err());
    }
}
