//! Client of the status socket: reads snapshots of a running gateway.

use std::io::{self, BufRead as _, BufReader, ErrorKind, Read as _, Write as _};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

use super::socket::{BUSY, HistoryAnswer};
use crate::process_status::snapshot::Snapshot;
use gateway_core::gateway::history::{HistoryPage, HistoryRequest};

/// Maximum wait for a line.
const PATIENCE: Duration = Duration::from_secs(5);
/// Maximum length of a line, bytes.
const MAX_LINE: u64 = 64 * 1024 * 1024;

/// Beginning of the line that answers a request for changes.
const HISTORY: &str = "{\"history\":";
/// Maximum number of snapshots before the answer.
const MOST_SNAPSHOTS_BEFORE: usize = 5;

/// A connection to a running gateway.
#[derive(Debug)]
pub struct StatusClient(BufReader<UnixStream>);

/// Reason why no snapshot was received.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// No process serves the socket, access to it is denied, or it did not answer in time.
    #[error("{0}")]
    Socket(#[from] io::Error),
    /// The gateway already serves too many clients.
    #[error("it has too many clients")]
    Busy,
    /// The gateway does not answer requests for changes, e.g. because it is an older version.
    #[error("it keeps no history: it is an older version")]
    NoHistory,
    /// The gateway sent a snapshot that this version cannot read.
    #[error("it does not send a status that this version can read: {0}")]
    Unreadable(serde_json::Error),
}

impl StatusClient {
    /// Connects to a socket. Fails if no process serves it, or access is denied.
    pub fn connect(path: &Path) -> Result<Self, ClientError> {
        let stream = UnixStream::connect(path)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        Ok(Self(BufReader::new(stream)))
    }

    /// Returns the next snapshot, and the line that contained it.
    pub fn receive(&mut self) -> Result<(Snapshot, String), ClientError> {
        let line = self.line()?;
        let snapshot = parse(&line)?;
        Ok((snapshot, line))
    }

    /// Requests changes from the gateway's history.
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

/// Parses a line from the socket. Fails if the line is not a snapshot.
pub fn parse(line: &str) -> Result<Snapshot, ClientError> {
    serde_json::from_str(line).map_err(ClientError::Unreadable)
}
