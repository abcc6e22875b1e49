//! Replaces the network side in builds without it: every attempt to join a network fails.

use std::io;
use std::net::IpAddr;
use std::os::unix::net::UnixStream;
use std::time::Duration;

use crate::error::TransportError;
use crate::link::LostLines;
use crate::settings::Transport;
use crate::survey::DomainSurvey;

/// Fails.
///
/// # Errors
/// Always fails.
pub fn serve(
    _socket: UnixStream,
    _lost_lines: fn() -> LostLines,
    _confine: impl FnOnce(&Transport) -> io::Result<()>,
) -> io::Result<()> {
    Err(io::Error::new(io::ErrorKind::Unsupported, TransportError::NotBuiltIn))
}

/// Fails.
///
/// # Errors
/// Always fails.
pub fn survey(
    _domain_id: u16,
    _only_networks: &[IpAddr],
    _topics: &[String],
    _time: Duration,
) -> Result<DomainSurvey, TransportError> {
    Err(TransportError::NotBuiltIn)
}

/// Returns no names, since no call is refused.
pub fn system_call_name(_number: usize) -> Option<&'static str> {
    None
}

/// There is no network process.
pub mod process {
    use std::io;

    use crate::error::TransportError;
    use crate::link::LostLines;

    /// Does nothing.
    ///
    /// # Errors
    /// Never fails.
    pub fn close_inherited() -> io::Result<()> {
        Ok(())
    }

    /// Fails.
    ///
    /// # Errors
    /// Always fails.
    pub fn run(_memory_mb: u32, _lost_lines: fn() -> LostLines, _confined: impl FnOnce()) -> io::Result<()> {
        Err(io::Error::new(io::ErrorKind::Unsupported, TransportError::NotBuiltIn))
    }
}
