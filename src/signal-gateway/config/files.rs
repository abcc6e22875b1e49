//! Sources of configuration files: the disk, or the copies built into the binary.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::io::{self, Cursor, Read};
use std::path::{Path, PathBuf};

use super::built_in;
use can_log::{regular_file, standard_input};

/// Maximum size of a file that is read as a whole (configurations, profiles and DBC files), bytes: a file
/// named by mistake must not fill memory.
const MAX_WHOLE: u64 = 64 << 20;
/// Maximum size of a file that is read piece by piece (maps), bytes.
const MAX_PIECES: u64 = 1 << 30;

/// A source of files, by path.
pub trait Files {
    /// Reads a whole file.
    ///
    /// # Errors
    /// Returns an error of the source, such as a missing file.
    fn read(&self, path: &Path) -> io::Result<Vec<u8>>;

    /// Opens a file for reading piece by piece, if the source supports it.
    fn open(&self, path: &Path) -> io::Result<Box<dyn Read>> {
        Ok(Box::new(Cursor::new(self.read(path)?)))
    }

    /// Looks up a file without reading it, if the source supports it; returns true for a folder.
    fn is_folder(&self, path: &Path) -> io::Result<bool> {
        match self.read(path) {
            Ok(_) => Ok(false),
            Err(error) if error.kind() == io::ErrorKind::IsADirectory => Ok(true),
            Err(error) => Err(error),
        }
    }
}

/// The file system of the machine, with standard input as `-`, and the built-in files, by the paths of
/// [`BuiltIn::path`](built_in::BuiltIn::path).
#[derive(Debug, Clone, Copy)]
pub struct Disk;

impl Files for Disk {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        open_limited(path, MAX_WHOLE)?.read_to_end(&mut bytes)?;
        Ok(bytes)
    }

    fn open(&self, path: &Path) -> io::Result<Box<dyn Read>> {
        open_limited(path, MAX_PIECES)
    }

    fn is_folder(&self, path: &Path) -> io::Result<bool> {
        if built_in::project_path(path).is_some() || standard_input::is_named(path) {
            return Ok(false);
        }
        Ok(path.metadata()?.is_dir())
    }
}

/// Opens a file whose reader fails after more than `most` bytes.
fn open_limited(path: &Path, most: u64) -> io::Result<Box<dyn Read>> {
    if let Some(path) = built_in::project_path(path) {
        return Embedded.open(&path);
    }
    if standard_input::is_named(path) {
        let content = Cursor::new(standard_input::content(most)?);
        return Ok(Box::new(Limited::new(content, most)));
    }
    Ok(Box::new(Limited::new(regular_file::open(path)?, most)))
}

/// Reads a whole text from the disk or standard input.
///
/// # Errors
/// Fails for an error of the disk, or if the file is too large or not UTF-8.
pub fn read_text(path: &Path) -> io::Result<String> {
    String::from_utf8(Disk.read(path)?).map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "not UTF-8"))
}

/// [`Disk`], with a list of the files read from it.
#[derive(Debug, Default)]
pub struct ListedDisk(RefCell<BTreeSet<PathBuf>>);

impl ListedDisk {
    /// Returns the absolute paths of the files read, without standard input and built-in files.
    pub fn paths(&self) -> Vec<PathBuf> {
        self.0.borrow().iter().cloned().collect()
    }

    fn list(&self, path: &Path) {
        if built_in::project_path(path).is_none() && !standard_input::is_named(path) {
            self.0.borrow_mut().extend(std::path::absolute(path));
        }
    }
}

impl Files for ListedDisk {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let bytes = Disk.read(path)?;
        self.list(path);
        Ok(bytes)
    }

    fn open(&self, path: &Path) -> io::Result<Box<dyn Read>> {
        let file = Disk.open(path)?;
        self.list(path);
        Ok(file)
    }

    fn is_folder(&self, path: &Path) -> io::Result<bool> {
        Disk.is_folder(path)
    }
}

/// A reader that fails when the maximum number of bytes is exceeded.
struct Limited<R> {
    file: R,
    most: u64,
    left: u64,
}

impl<R> Limited<R> {
    fn new(file: R, most: u64) -> Self {
        Self { file, most, left: most }
    }
}

impl<R: Read> Read for Limited<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.file.read(buffer)?;
        let too_large = || {
            let text = format!("it has more than {} bytes, the most that are read of such a file", self.most);
            io::Error::new(io::ErrorKind::FileTooLarge, text)
        };
        self.left = self.left.checked_sub(read as u64).ok_or_else(too_large)?;
        Ok(read)
    }
}

/// The files in the binary, by their paths in the project, so that the demo and the rules of countries need
/// no other files.
#[derive(Debug, Clone, Copy)]
pub struct Embedded;

/// Path of the embedded demo configuration.
pub const DEMO_CONFIG: &str = "config/demo.toml";

impl Files for Embedded {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        built_in::contents(path).map(<[u8]>::to_vec).ok_or_else(|| io::ErrorKind::NotFound.into())
    }
}

/// Files of a test: paths and texts; all other files are absent.
#[cfg(test)]
pub(crate) struct TestFiles<'a>(pub(crate) &'a [(&'a str, &'a str)]);

#[cfg(test)]
impl Files for TestFiles<'_> {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let found = self.0.iter().find(|(name, _)| Path::new(name) == path);
        found.map(|(_, text)| text.as_bytes().to_vec()).ok_or_else(|| io::ErrorKind::NotFound.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_above_the_limit_is_refused() {
        let read = |bytes: u64| {
            let file = io::repeat(b'x').take(bytes);
            Limited::new(file, 100).read_to_end(&mut Vec::new())
        };
        assert_eq!(read(100).unwrap(), 100);
        assert_eq!(read(u64::MAX).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
    }

    #[test]
    fn files_on_the_disk_are_listed_and_built_in_ones_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        std::fs::write(&path, "a").unwrap();
        let disk = ListedDisk::default();
        let built_in = built_in::BuiltIn::Profile.path("demo_vehicle").unwrap();
        for read in [&path, &path, &built_in] {
            assert!(disk.read(read).is_ok());
        }
        let opened = folder.path().join("b.osm");
        std::fs::write(&opened, "b").unwrap();
        assert!(disk.open(&opened).is_ok());
        assert!(disk.read(&folder.path().join("missing")).is_err());
        for unread in [disk.read(folder.path()).err(), disk.open(folder.path()).err()] {
            assert_eq!(unread.unwrap().kind(), io::ErrorKind::IsADirectory);
        }
        assert_eq!(disk.paths(), [path, opened]);
    }

    #[test]
    fn embedded_files_are_found_by_relative_paths() {
        let path = Path::new("config/vehicles/../../dbc/demo_vehicle.dbc");
        assert!(Embedded.read(path).unwrap().starts_with(b"VERSION"));
        let missing = Embedded.read(Path::new("config/none.toml")).unwrap_err();
        assert_eq!(missing.kind(), io::ErrorKind::NotFound);
    }
}
