//! Recordings as readers of other makes find them, and as writers of other makes write them.

use std::ffi::OsStr;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::prerequisite::{Missing, mcap_python};

/// The readers of `tests/peer/mcap_reader.py`, and the writers beside them.
pub(crate) struct McapReaders(std::path::PathBuf);

impl McapReaders {
    pub(crate) fn find() -> Result<Self, Missing> {
        mcap_python().map(Self)
    }

    /// The messages of a bag in the order of their log times, on which both readers agree.
    pub(crate) fn messages(&self, bag: &Path) -> Vec<Value> {
        self.lines("both", &[bag])
    }

    /// What can be read of files that may have been cut.
    pub(crate) fn prefixes(&self, files: &[&Path]) -> Vec<Value> {
        self.lines("prefix", files)
    }

    /// Names of the bags that writers of other makes write into `folder` of the frames of a candump log.
    pub(crate) fn write_bags(&self, log: &Path, folder: &Path) -> Vec<String> {
        let text = self.run("bag_writer.py", &[log.as_os_str(), folder.as_os_str()]);
        text.lines().map(str::to_owned).collect()
    }

    /// Writes what Autoware publishes on a drive (`tests/support/drive_script.rs`) as `drive.mcap` and as the
    /// bag `rosbags_sqlite3`.
    pub(crate) fn write_drive(&self, script: &Path, folder: &Path) {
        self.run("drive_bag_writer.py", &[script.as_os_str(), folder.as_os_str()]);
    }

    fn lines(&self, mode: &str, paths: &[&Path]) -> Vec<Value> {
        let arguments: Vec<_> =
            std::iter::once(OsStr::new(mode)).chain(paths.iter().map(|path| path.as_os_str())).collect();
        let text = self.run("mcap_reader.py", &arguments);
        text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    }

    fn run(&self, script: &str, arguments: &[&OsStr]) -> String {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peer").join(script);
        let output = Command::new(&self.0).arg(script).args(arguments).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    }
}

/// The only entry of a folder.
pub(crate) fn only_entry(folder: &Path) -> std::path::PathBuf {
    let entries: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    let [entry] = entries.as_slice() else { panic!("{entries:?}") };
    entry.clone()
}
