//! Sources of configuration files: the disk, or the copies built into the binary.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};

/// The largest file that is read, bytes: a file named by mistake must not fill memory.
const MAX_BYTES: u64 = 1 << 30;

/// A source of files, by path.
pub trait Files {
    /// Reads a whole file.
    ///
    /// # Errors
    /// An error of the source, such as a missing file.
    fn read(&self, path: &Path) -> io::Result<Vec<u8>>;
}

/// The file system of the machine.
#[derive(Debug, Clone, Copy)]
pub struct Disk;

impl Files for Disk {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        read_at_most(File::open(path)?, MAX_BYTES)
    }
}

fn read_at_most(file: impl Read, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    file.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, format!("it has more than {most} bytes")));
    }
    Ok(bytes)
}

/// The files in the binary, so that the demo and the rules of countries need nothing beside it.
#[derive(Debug, Clone, Copy)]
pub struct Embedded;

/// Path of the embedded demo configuration.
pub const DEMO_CONFIG: &str = "config/demo.toml";

const EMBEDDED: [(&str, &[u8]); 4] = [
    (DEMO_CONFIG, include_bytes!("../../config/demo.toml")),
    ("config/demo.log.gz", include_bytes!("../../config/demo.log.gz")),
    ("config/vehicles/demo_vehicle.toml", include_bytes!("../../config/vehicles/demo_vehicle.toml")),
    ("dbc/demo_vehicle.dbc", include_bytes!("../../dbc/demo_vehicle.dbc")),
];

/// The rules of countries by path, ascending; `build.rs` lists them.
const COUNTRIES: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/countries.rs"));

/// Paths of the rules of countries, ascending.
pub(super) fn countries() -> impl Iterator<Item = &'static Path> {
    COUNTRIES.iter().map(|(path, _)| Path::new(path))
}

impl Files for Embedded {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let path = without_dots(path);
        let found = EMBEDDED.iter().chain(COUNTRIES).find(|(name, _)| Path::new(name) == path);
        found.map(|(_, bytes)| bytes.to_vec()).ok_or_else(|| io::ErrorKind::NotFound.into())
    }
}

/// A path without `.` and `..`: `a/c` of `a/b/../c`.
fn without_dots(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for component in path.components() {
        match component {
            Component::ParentDir => {
                plain.pop();
            }
            Component::CurDir => {}
            Component::Prefix(_) | Component::RootDir | Component::Normal(_) => plain.push(component),
        }
    }
    plain
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
    fn embedded_files_are_found_by_relative_paths() {
        let path = Path::new("config/vehicles/../../dbc/demo_vehicle.dbc");
        assert!(Embedded.read(path).unwrap().starts_with(b"VERSION"));
        let missing = Embedded.read(Path::new("config/none.toml")).unwrap_err();
        assert_eq!(missing.kind(), io::ErrorKind::NotFound);
    }
}
