//! Reasons why a command failed.

use std::io;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use crate::config::Refused;
use crate::daemon::DaemonError;

#[derive(Debug, thiserror::Error)]
pub(super) enum Failure {
    #[error("{0}")]
    Refused(#[from] Refused),
    #[error("{0}")]
    Usage(String),
    #[error("{0}")]
    Daemon(#[from] DaemonError),
    #[error("{0}")]
    Environment(String),
    #[error("{}: {_1}", _0.display())]
    File(PathBuf, io::Error),
    #[error("{}: {_1}", _0.display())]
    Written(PathBuf, io::Error),
    #[error("{_0}: {_1}")]
    PageAddress(SocketAddr, io::Error),
    #[error("{0}")]
    System(#[from] io::Error),
}

impl Failure {
    /// Returns a function that adds `path` to an error of reading.
    pub(super) fn file(path: &Path) -> impl Fn(io::Error) -> Self {
        move |error| Self::File(path.to_owned(), error)
    }

    /// Returns a function that adds `path` to an error of writing.
    pub(super) fn written(path: &Path) -> impl Fn(io::Error) -> Self {
        move |error| Self::Written(path.to_owned(), error)
    }
}
