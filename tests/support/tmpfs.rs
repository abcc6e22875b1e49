//! A file system that can be full.

use std::path::Path;
use std::process::Command;

use super::prerequisite::{Missing, Prerequisite};

/// A file system of a test's own, mounted until it ends.
pub(crate) struct Tmpfs(std::path::PathBuf);

impl Tmpfs {
    /// Makes the folder and mounts it.
    pub(crate) fn new(folder: &Path, options: &str) -> Result<Self, Missing> {
        std::fs::create_dir(folder).unwrap();
        let mut mount = Command::new("mount");
        let mounted = mount.args(["-t", "tmpfs", "-o", options, "tmpfs"]).arg(folder).output().unwrap();
        let why = String::from_utf8_lossy(&mounted.stderr).into_owned();
        let tmpfs = Self(folder.to_owned());
        if mounted.status.success() { Ok(tmpfs) } else { Err(Prerequisite::Tmpfs.missing(why)) }
    }

    pub(crate) fn remount(&self, options: &str) {
        let mut mount = Command::new("mount");
        mount.args(["-o", &format!("remount,{options}")]).arg(&self.0);
        assert!(mount.status().unwrap().success());
    }
}

impl Drop for Tmpfs {
    fn drop(&mut self) {
        let _gone = Command::new("umount").arg("--lazy").arg(&self.0).output();
    }
}
