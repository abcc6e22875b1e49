//! Replaces the network side in builds without it: every attempt to join a network fails.

use std::io;
use std::net::IpAddr;
use std::os::unix::net::UnixStream;
use std::time::Duration;

use crate::link::LostLines;
use crate::settings::Transport;
use crate::survey::DomainSurvey;

const NOT_BUILT_IN: &str = "this build has no ROS 2";

/// Fails.
///
/// # Errors
/// Always fails.
pub fn serve(
    _socket: UnixStream,
    _lost_lines: fn() -> LostLines,
    _confine: impl FnOnce(&Transport) -> io::Result<()>,
) -> io::Result<()> {
    Err(io::Error::new(io::ErrorKind::Unsupported, NOT_BUILT_IN))
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
) -> Result<DomainSurvey, String> {
    Err(NOT_BUILT_IN.to_owned())
}

/// Returns no names, since no call is refused.
pub fn system_call_name(_number: usize) -> Option<&'static str> {
    None
}

/// Names are not checked, since they are not used.
pub mod names {
    /// Accepts every node.
    ///
    /// # Errors
    /// Never fails.
    pub fn check_node(_namespace: &str, _node: &str) -> Result<(), String> {
        Ok(())
    }

    /// Accepts every topic.
    ///
    /// # Errors
    /// Never fails.
    pub fn check_topic(_name: &str) -> Result<(), String> {
        Ok(())
    }
}

/// There is no network process.
pub mod process {
    use std::io;

    use super::NOT_BUILT_IN;
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
        Err(io::Error::new(io::ErrorKind::Unsupported, NOT_BUILT_IN))
    }
}
