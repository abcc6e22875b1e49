//! Sources of configuration files: the disk, or the copies built into the binary.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::built_in;
use crate::io::standard_input;

/// The largest file that is read, bytes: a file named by mistake must not fill memory.
const MAX_BYTES: u64 = 1 << 30;

/// A source of files, by path.
pub trait Files {
    /// Reads a whole file.
    ///
    /// # Errors
    /// An error of the source, such as a missing file.
    fn read(&self, path: &Path) -> io::Result<Vec<u8>>;

    /// Looks for a file without reading it, where the source can; true for a folder.
    ///
    /// # Errors
    /// An error of the source, such as a missing file.
    fn is_folder(&self, path: &Path) -> io::Result<bool> {
        match self.read(path) {
            Ok(_) => Ok(false),
            Err(error) if error.kind() == io::ErrorKind::IsADirectory => Ok(true),
            Err(error) => Err(error),
        }
    }
}

/// The file system of the machine, with standard input as `-`; and the built-in files, by the paths that
/// [`BuiltIn::path`](built_in::BuiltIn::path) gives.
#[derive(Debug, Clone, Copy)]
pub struct Disk;

impl Files for Disk {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        if let Some(path) = built_in::project_path(path) {
            return Embedded.read(&path);
        }
        if standard_input::is_named(path) {
            return at_most(standard_input::content(MAX_BYTES)?, MAX_BYTES);
        }
        read_at_most(File::open(path)?, MAX_BYTES)
    }

    fn is_folder(&self, path: &Path) -> io::Result<bool> {
        if built_in::project_path(path).is_some() || standard_input::is_named(path) {
            return Ok(false);
        }
        Ok(path.metadata()?.is_dir())
    }
}

/// [`Disk`], with a list of the files that were read there.
#[derive(Debug, Default)]
pub struct ListedDisk(RefCell<BTreeSet<PathBuf>>);

impl ListedDisk {
    /// The absolute paths of what was read, without standard input and what is built in.
    pub fn paths(&self) -> Vec<PathBuf> {
        self.0.borrow().iter().cloned().collect()
    }
}

impl Files for ListedDisk {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let bytes = Disk.read(path)?;
        if built_in::project_path(path).is_none() && !standard_input::is_named(path) {
            self.0.borrow_mut().extend(std::path::absolute(path));
        }
        Ok(bytes)
    }

    fn is_folder(&self, path: &Path) -> io::Result<bool> {
        Disk.is_folder(path)
    }
}

fn read_at_most(file: impl Read, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    file.take(most + 1).read_to_end(&mut bytes)?;
    at_most(bytes, most)
}

fn at_most(bytes: Vec<u8>, most: u64) -> io::Result<Vec<u8>> {
    if bytes.len() as u64 > most {
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, format!("it has more than {most} bytes")));
    }
    Ok(bytes)
}

/// The files in the binary, by their paths in the project, so that the demo and the rules of countries need nothing beside it.
#[derive(Debug, Clone, Copy)]
pub struct Embedded;

/// Path of the embedded demo configuration.
pub const DEMO_CONFIG: &str = "config/demo.toml";

impl Files for Embedded {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        built_in::contents(path).map(<[u8]>::to_vec).ok_or_else(|| io::ErrorKind::NotFound.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_above_the_limit_is_refused() {
        let read = |bytes: u64| read_at_most(io::repeat(b'x').take(bytes), 100).map(|bytes| bytes.len());
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
        assert!(disk.read(&folder.path().join("missing")).is_err());
        assert_eq!(disk.paths(), [path]);
    }

    #[test]
    fn embedded_files_are_found_by_relative_paths() {
        let path = Path::new("config/vehicles/../../dbc/demo_vehicle.dbc");
        assert!(Embedded.read(path).unwrap().starts_with(b"VERSION"));
        let missing = Embedded.read(Path::new("config/none.toml")).unwrap_err();
        assert_eq!(missing.kind(), io::ErrorKind::NotFound);
    }
}
