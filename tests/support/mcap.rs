//! Recordings as readers of other makes find them.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::prerequisite::{Missing, mcap_python};

/// The readers of `tests/peer/mcap_reader.py`.
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

    fn lines(&self, mode: &str, paths: &[&Path]) -> Vec<Value> {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peer/mcap_reader.py");
        let output = Command::new(&self.0).arg(script).arg(mode).args(paths).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8(output.stdout).unwrap();
        text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    }
}

/// The only entry of a folder.
pub(crate) fn only_entry(folder: &Path) -> std::path::PathBuf {
    let entries: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    let [entry] = entries.as_slice() else { panic!("{entries:?}") };
    entry.clone()
}
