//! A Cyclone DDS reader or writer in a process of its own.

use std::path::{Path, PathBuf};

use super::bench::{Side, inside};

/// The Python with `cyclonedds`, or `None` after saying what is skipped.
pub(crate) fn python(test: &str) -> Option<PathBuf> {
    let python = std::env::var_os("SIGNAL_GATEWAY_PEER_PYTHON").map(PathBuf::from);
    if python.is_none() {
        println!("skipped: {test}: SIGNAL_GATEWAY_PEER_PYTHON is not set (a Python with cyclonedds==11.0.1)");
    }
    python
}

/// What a reader asks for.
pub(crate) struct Reader<'a> {
    pub(crate) python: &'a Path,
    pub(crate) domain: u16,
    pub(crate) kind: &'a str,
    pub(crate) topic: &'a str,
    pub(crate) durability: &'a str,
    /// `CYCLONEDDS_URI`; empty for Cyclone's defaults.
    pub(crate) config: &'a str,
    pub(crate) namespace: Option<&'a str>,
}

impl Reader<'_> {
    /// Starts the reader and waits until it reads.
    pub(crate) fn start(&self) -> Side {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/dds_peer/reader.py");
        let mut command = inside(self.namespace, self.python);
        command.arg(script).arg(self.domain.to_string()).args([self.kind, self.topic, self.durability]);
        command.env_remove("CYCLONEDDS_URI");
        if !self.config.is_empty() {
            command.env("CYCLONEDDS_URI", self.config);
        }
        let side = Side::start(&format!("{} reader of {}", self.durability, self.topic), command);
        side.wait_for("its start", |line| line["event"] == "ready");
        side
    }
}

/// What a writer offers.
pub(crate) struct Writer<'a> {
    pub(crate) python: &'a Path,
    pub(crate) domain: u16,
    pub(crate) kind: &'a str,
    pub(crate) topic: &'a str,
    pub(crate) reliability: &'a str,
    pub(crate) durability: &'a str,
    /// `CYCLONEDDS_URI`; empty for Cyclone's defaults.
    pub(crate) config: &'a str,
    pub(crate) namespace: Option<&'a str>,
}

impl Writer<'_> {
    /// Starts the writer and waits until it is read.
    pub(crate) fn start(&self) -> Side {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/dds_peer/writer.py");
        let mut command = inside(self.namespace, self.python);
        command.arg(script).arg(self.domain.to_string());
        command.args([self.kind, self.topic, self.reliability, self.durability]);
        command.env_remove("CYCLONEDDS_URI");
        if !self.config.is_empty() {
            command.env("CYCLONEDDS_URI", self.config);
        }
        let side = Side::start(&format!("{} writer of {}", self.durability, self.topic), command);
        side.wait_for("a reader", |line| line["event"] == "matched");
        side
    }
}
