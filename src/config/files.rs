//! Where configuration files come from: the disk, or the copies built into the binary.

use std::io;
use std::path::{Component, Path, PathBuf};

/// A place to read files from.
pub trait Files {
    /// The whole file.
    ///
    /// # Errors
    /// As the place says, e.g. not found.
    fn read(&self, path: &Path) -> io::Result<Vec<u8>>;
}

/// The file system.
#[derive(Debug, Clone, Copy)]
pub struct Disk;

impl Files for Disk {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        std::fs::read(path)
    }
}

/// What the binary carries so that the demo needs nothing beside it.
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

impl Files for Embedded {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let wanted = without_dots(path);
        let found = EMBEDDED.iter().find(|(name, _)| Path::new(name) == wanted);
        found.map(|(_, bytes)| bytes.to_vec()).ok_or_else(|| io::ErrorKind::NotFound.into())
    }
}

/// `a/b/../c` as `a/c`.
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
    fn embedded_files_are_found_by_relative_paths() {
        let path = Path::new("config/vehicles/../../dbc/demo_vehicle.dbc");
        assert!(Embedded.read(path).unwrap().starts_with(b"VERSION"));
        let missing = Embedded.read(Path::new("config/none.toml")).unwrap_err();
        assert_eq!(missing.kind(), io::ErrorKind::NotFound);
    }
}
