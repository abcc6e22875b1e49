//! Black-box files on disk: few, and written whole or not at all.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// A folder of black-box files.
#[derive(Debug, Clone)]
pub struct Recorder {
    folder: PathBuf,
    keep: usize,
}

const PREFIX: &str = "fault-";

impl Recorder {
    /// A recorder that keeps the newest `keep` recordings in `folder`, which it creates if necessary.
    ///
    /// # Errors
    /// A folder that cannot be created.
    pub fn new(folder: &Path, keep: usize) -> io::Result<Self> {
        fs::create_dir_all(folder)?;
        Ok(Self { folder: folder.to_owned(), keep })
    }

    /// Writes `fault-<name>.log` and `fault-<name>.decisions`, and removes the oldest recordings
    /// beyond those to keep. `name` must grow with time. Returns the path of the log.
    ///
    /// # Errors
    /// A file that cannot be written; existing files stay as they were.
    pub fn save(&self, name: &str, log: &str, decisions: &str) -> io::Result<PathBuf> {
        let path = self.folder.join(format!("{PREFIX}{name}.log"));
        // The log last: where it exists, its decisions exist.
        write_whole(&path.with_extension("decisions"), decisions)?;
        write_whole(&path, log)?;
        self.prune()?;
        Ok(path)
    }

    fn prune(&self) -> io::Result<()> {
        let mut logs: Vec<_> = fs::read_dir(&self.folder)?
            .filter_map(|entry| Some(entry.ok()?.path()))
            .filter(|path| {
                let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
                name.starts_with(PREFIX) && path.extension().is_some_and(|extension| extension == "log")
            })
            .collect();
        logs.sort();
        for old in logs.iter().take(logs.len().saturating_sub(self.keep)) {
            fs::remove_file(old)?;
            fs::remove_file(old.with_extension("decisions"))?;
        }
        Ok(())
    }
}

fn write_whole(path: &Path, text: &str) -> io::Result<()> {
    let draft = path.with_extension("draft");
    fs::write(&draft, text)?;
    fs::rename(&draft, path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_recordings_are_kept_and_other_files_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("notes.log"), "mine").unwrap();
        let recorder = Recorder::new(&folder.path().join("box"), 2).unwrap();
        fs::write(folder.path().join("box/notes.log"), "mine").unwrap();
        for name in ["1001.5", "1002.0", "1003.0"] {
            recorder.save(name, "log", "decisions").unwrap();
        }
        let mut names: Vec<_> = fs::read_dir(folder.path().join("box"))
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        assert_eq!(
            names,
            [
                "fault-1002.0.decisions",
                "fault-1002.0.log",
                "fault-1003.0.decisions",
                "fault-1003.0.log",
                "notes.log"
            ]
        );
    }

    #[test]
    fn a_folder_that_cannot_be_written_is_an_error() {
        assert!(Recorder::new(Path::new("/proc/nowhere"), 2).is_err());
    }
}
