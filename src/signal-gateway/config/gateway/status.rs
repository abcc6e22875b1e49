//! `[status]`: the socket on which the present state is served.

use std::path::PathBuf;

use crate::config::reading::{Fields, flag, key_rows, path};

key_rows! {
    ENABLED: bool = flag("enabled", true).restart().doc("false: no socket");
    SOCKET: PathBuf = path("socket").example("\"status.sock\"").restart()
        .doc("default: status.sock in systemd's runtime directory; nothing without either");
}

/// The socket that serves the current state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StatusConfig {
    /// False for no socket at all.
    pub enabled: bool,
    /// Path of the socket; by default `status.sock` in systemd's `RUNTIME_DIRECTORY`, if it is set.
    pub socket: Option<PathBuf>,
}

pub(super) fn status(fields: &Fields<'_>) -> StatusConfig {
    StatusConfig { enabled: fields.read(&ENABLED), socket: fields.given(&SOCKET) }
}
