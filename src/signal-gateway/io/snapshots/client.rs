//! The other end of the status socket: reads snapshots of a running gateway.

use std::io::{self, BufRead as _, BufReader, ErrorKind, Read as _, Write as _};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

use super::socket::{BUSY, HistoryAnswer};
use crate::process_status::snapshot::Snapshot;
use gateway_core::gateway::history::{HistoryPage, HistoryRequest};

/// Longest wait for a line.
const PATIENCE: Duration = Duration::from_secs(5);
/// Longest line that is read, bytes.
const MAX_LINE: u64 = 64 * 1024 * 1024;

/// Begin of the line that answers a request for changes.
const HISTORY: &str = "{\"history\":";
/// Snapshots that may come before the answer.
const MOST_SNAPSHOTS_BEFORE: usize = 5;

/// A connection to a running gateway.
#[derive(Debug)]
pub struct StatusClient(BufReader<UnixStream>);

/// Why no snapshot was received.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// No process serves the socket, or it may not be used, or it did not answer in time.
    #[error("{0}")]
    Socket(#[from] io::Error),
    /// It serves too many clients already.
    #[error("it has too many clients")]
    Busy,
    /// It does not answer a request for changes, as an older version.
    #[error("it keeps no history: it is an older version")]
    NoHistory,
    /// It does not send a snapshot that this version can read.
    #[error("it does not send a status that this version can read: {0}")]
    Unreadable(serde_json::Error),
}

impl StatusClient {
    /// Connects to a socket.
    ///
    /// # Errors
    /// No process serves it, or it may not be used.
    pub fn connect(path: &Path) -> Result<Self, ClientError> {
        let stream = UnixStream::connect(path)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        Ok(Self(BufReader::new(stream)))
    }

    /// The next snapshot, and its line as it was received.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub fn receive(&mut self) -> Result<(Snapshot, String), ClientError> {
        let line = self.line()?;
        let snapshot = parse(&line)?;
        Ok((snapshot, line))
    }

    /// Changes that the gateway has kept.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub fn history(&mut self, request: HistoryRequest) -> Result<HistoryPage, ClientError> {
        let request = serde_json::to_string(&request).map_err(ClientError::Unreadable)?;
        self.0.get_mut().write_all(format!("{request}\n").as_bytes())?;
        for _ in 0..MOST_SNAPSHOTS_BEFORE {
            let line = self.line()?;
            if line.starts_with(HISTORY) {
                let answer: HistoryAnswer = serde_json::from_str(&line).map_err(ClientError::Unreadable)?;
                return Ok(answer.history);
            }
        }
        Err(ClientError::NoHistory)
    }

    fn line(&mut self) -> Result<String, ClientError> {
        let mut line = String::new();
        match self.0.by_ref().take(MAX_LINE).read_line(&mut line) {
            Ok(0) => return Err(io::Error::new(ErrorKind::UnexpectedEof, "the connection was closed").into()),
            Ok(_) => {}
            Err(error) if error.kind() == ErrorKind::WouldBlock => {
                return Err(io::Error::new(ErrorKind::TimedOut, "no answer within 5 s").into());
            }
            Err(error) => return Err(error.into()),
        }
        if line == BUSY {
            return Err(ClientError::Busy);
        }
        Ok(line)
    }
}

/// Reads a line of the socket.
///
/// # Errors
/// A line that is not a snapshot.
pub fn parse(line: &str) -> Result<Snapshot, ClientError> {
    serde_json::from_str(line).map_err(ClientError::Unreadable)
}
