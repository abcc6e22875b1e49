//! New files in a folder, which replace existing files only on request.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write as _};
use std::path::{Path, PathBuf};

/// A folder for new files.
#[derive(Debug, Clone)]
pub struct NewFiles {
    folder: PathBuf,
    overwrite: bool,
}

impl NewFiles {
    /// Creates the folder if it is missing. Fails if it cannot be created, or if it contains files and
    /// `overwrite` is false.
    pub fn in_folder(folder: &Path, overwrite: bool) -> io::Result<Self> {
        fs::create_dir_all(folder)?;
        if !overwrite && fs::read_dir(folder)?.next().is_some() {
            let text = "the folder is not empty, and nothing is overwritten unasked";
            return Err(io::Error::new(io::ErrorKind::AlreadyExists, text));
        }
        Ok(Self { folder: folder.to_owned(), overwrite })
    }

    /// Creates a file for writing. Fails if it exists and must not be overwritten.
    pub fn create(&self, name: &str) -> io::Result<BufWriter<File>> {
        create(&self.folder.join(name), self.overwrite).map(BufWriter::new)
    }

    /// Returns the path of a file in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }
}

/// Writes a file completely or not at all: if the disk is full, no partial file remains and no existing file
/// is replaced. Fails if the file exists and `overwrite` is false.
pub fn write_new(path: &Path, text: &str, overwrite: bool) -> io::Result<()> {
    let old = fs::metadata(path).ok();
    let write = |to: &Path| {
        let mut file = create(to, overwrite)?;
        file.write_all(text.as_bytes()).inspect_err(|_| drop(fs::remove_file(to)))
    };
    match &old {
        // A terminal or a pipe.
        Some(old) if overwrite && !old.is_file() => create(path, true)?.write_all(text.as_bytes()),
        Some(old) if overwrite => {
            let path = fs::canonicalize(path)?;
            let mut draft = path.clone().into_os_string();
            draft.push(".part");
            let draft = Path::new(&draft);
            let written = write(draft)
                .and_then(|()| fs::set_permissions(draft, old.permissions()))
                .and_then(|()| fs::rename(draft, &path));
            written.inspect_err(|_| drop(fs::remove_file(draft)))
        }
        Some(_) => Err(io::ErrorKind::AlreadyExists.into()),
        None => write(path),
    }
}

/// Creates a file for writing. Fails if it exists and `overwrite` is false.
pub(super) fn create(path: &Path, overwrite: bool) -> io::Result<File> {
    File::options().write(true).create(overwrite).truncate(overwrite).create_new(!overwrite).open(path)
}

/// Writes a file so that `path` has it completely, even after a power cut, or as it was before. `draft` is
/// another name in the same folder.
pub(super) fn write_whole(
    draft: &Path,
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    let written = (|| {
        let mut file = BufWriter::new(File::create(draft)?);
        write(&mut file)?;
        file.into_inner()?.sync_all()?;
        fs::rename(draft, path)
    })();
    written.inspect_err(|_| drop(fs::remove_file(draft)))
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
        assert_eq!(fs::read_dir(folder.path().join("car")).unwrap().count(), 1, "a draft is left");
    }

    #[test]
    fn what_does_not_fit_on_the_disk_leaves_no_part_and_replaces_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("link");
        fs::write(folder.path().join("a"), "good").unwrap();
        std::os::unix::fs::symlink("a", &link).unwrap();
        write_new(&link, "better", true).unwrap();
        assert_eq!(fs::read(folder.path().join("a")).unwrap(), b"better");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink(), "the link was replaced, not its file");
        let full = write_new(Path::new("/dev/full"), "text", true).unwrap_err();
        assert_eq!(full.kind(), io::ErrorKind::StorageFull);
        assert!(Path::new("/dev/full").exists());
    }
}
