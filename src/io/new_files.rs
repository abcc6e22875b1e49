//! New files in a folder, which replace nothing unless that is wanted.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write as _};
use std::path::{Path, PathBuf};

/// A folder for new files.
#[derive(Debug, Clone)]
pub struct NewFiles {
    folder: PathBuf,
    overwrite: bool,
}

impl NewFiles {
    /// Makes the folder if it is not there.
    ///
    /// # Errors
    /// One that cannot be made, or that has files and must not be overwritten.
    pub fn in_folder(folder: &Path, overwrite: bool) -> io::Result<Self> {
        fs::create_dir_all(folder)?;
        if !overwrite && fs::read_dir(folder)?.next().is_some() {
            let text = "the folder is not empty, and nothing is overwritten unasked";
            return Err(io::Error::new(io::ErrorKind::AlreadyExists, text));
        }
        Ok(Self { folder: folder.to_owned(), overwrite })
    }

    /// Creates a file for writing.
    ///
    /// # Errors
    /// One that exists and must not be overwritten, or an error of the system.
    pub fn create(&self, name: &str) -> io::Result<BufWriter<File>> {
        create(&self.folder.join(name), self.overwrite).map(BufWriter::new)
    }

    /// Path of a file in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }
}

/// Writes a new file.
///
/// # Errors
/// One that exists and must not be overwritten, or an error of the system.
pub fn write_new(path: &Path, text: &str, overwrite: bool) -> io::Result<()> {
    create(path, overwrite)?.write_all(text.as_bytes())
}

fn create(path: &Path, overwrite: bool) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.write(true);
    if overwrite {
        options.create(true).truncate(true)
    } else {
        options.create_new(true)
    };
    options.open(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_overwritten_unasked() {
        let folder = tempfile::tempdir().unwrap();
        let new = NewFiles::in_folder(&folder.path().join("car"), false).unwrap();
        new.create("a").unwrap().write_all(b"first").unwrap();
        assert_eq!(new.create("a").unwrap_err().kind(), io::ErrorKind::AlreadyExists);
        let refused = NewFiles::in_folder(&folder.path().join("car"), false).unwrap_err();
        assert_eq!(refused.kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(write_new(&new.path("a"), "no", false).unwrap_err().kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(fs::read(new.path("a")).unwrap(), b"first");
        write_new(&new.path("a"), "yes", true).unwrap();
        assert_eq!(fs::read(new.path("a")).unwrap(), b"yes");
    }
}
