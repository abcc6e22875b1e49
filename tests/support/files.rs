//! Files in memory, for everything that reads its files through [`Files`].

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use signal_gateway::config::files::{Disk, Files};
use signal_gateway::config::{Overrides, Settings, load};

/// Files by path. A path that is not among them is not found, or read from the disk after
/// [`MemoryFiles::or_disk`].
#[derive(Debug, Clone, Default)]
pub(crate) struct MemoryFiles {
    files: BTreeMap<PathBuf, Vec<u8>>,
    has_disk: bool,
}

impl MemoryFiles {
    pub(crate) fn new<'a, T: Into<Vec<u8>>>(files: impl IntoIterator<Item = (&'a str, T)>) -> Self {
        let files = files.into_iter().map(|(path, contents)| (path.into(), contents.into()));
        Self { files: files.collect(), has_disk: false }
    }

    /// A configuration of one bus on `can0`, whose vehicle has this profile and this DBC.
    pub(crate) fn vehicle(profile: &str, dbc: &str) -> Self {
        let gateway = "profile = \"car.toml\"\n[can.body]\ninterface = \"can0\"\n";
        Self::new([("gateway.toml", gateway), ("car.toml", profile), ("car.dbc", dbc)])
    }

    /// One more file, or other contents of a file.
    pub(crate) fn with(mut self, path: &str, contents: impl Into<Vec<u8>>) -> Self {
        self.insert(path, contents);
        self
    }

    /// Everything else is read from the disk.
    pub(crate) fn or_disk(self) -> Self {
        Self { has_disk: true, ..self }
    }

    pub(crate) fn insert(&mut self, path: &str, contents: impl Into<Vec<u8>>) {
        self.files.insert(path.into(), contents.into());
    }

    pub(crate) fn text(&self, path: &str) -> &str {
        self.get(path).unwrap_or_else(|| panic!("no file {path}"))
    }

    pub(crate) fn get(&self, path: &str) -> Option<&str> {
        self.files.get(Path::new(path)).map(|contents| str::from_utf8(contents).unwrap())
    }

    /// The files of a folder, without its subfolders.
    pub(crate) fn of_folder(folder: &Path) -> Self {
        let mut files = Self::default();
        for entry in std::fs::read_dir(folder).unwrap().map(Result::unwrap) {
            if entry.file_type().unwrap().is_file() {
                files.insert(entry.file_name().to_str().unwrap(), std::fs::read(entry.path()).unwrap());
            }
        }
        files
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = (&Path, &[u8])> {
        self.files.iter().map(|(path, contents)| (path.as_path(), contents.as_slice()))
    }

    /// Writes the files into a folder on the disk.
    pub(crate) fn write_into(&self, folder: &Path) {
        self.iter().for_each(|(path, contents)| std::fs::write(folder.join(path), contents).unwrap());
    }

    pub(crate) fn bytes_mut(&mut self, path: &str) -> &mut Vec<u8> {
        self.files.get_mut(Path::new(path)).unwrap()
    }

    /// The configuration `gateway.toml` among them, which must be accepted.
    pub(crate) fn settings(&self) -> Settings {
        let settings = load(self, Path::new("gateway.toml"), &Overrides::default());
        settings.unwrap_or_else(|refused| {
            let texts =
                self.files.iter().filter(|(path, _)| path.extension().is_some_and(|end| end == "toml"));
            let texts =
                texts.map(|(path, text)| format!("{}:\n{}", path.display(), String::from_utf8_lossy(text)));
            panic!("{refused}\n{}", texts.collect::<Vec<_>>().join("\n"))
        })
    }
}

impl Files for MemoryFiles {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        match self.files.get(path) {
            Some(contents) => Ok(contents.clone()),
            None if self.has_disk => Disk.read(path),
            None => Err(io::ErrorKind::NotFound.into()),
        }
    }
}
