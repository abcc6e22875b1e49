//! The status socket: each client receives the current snapshot as a line of JSON at once, and then one every
//! [`INTERVAL`] until it disconnects. A client that sends a line with a [`HistoryRequest`] receives a
//! [`HistoryAnswer`] between snapshots; a client that sends anything else is disconnected.

use std::fs::{self, File, Permissions, TryLockError};
use std::io::{self, ErrorKind};
use std::os::unix::fs::{FileTypeExt as _, MetadataExt as _, PermissionsExt as _};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::sync::Semaphore;
use tokio::time::{Instant, sleep, sleep_until, timeout};

use super::feed::SnapshotSource;
use gateway_core::gateway::history::{HistoryPage, HistoryRequest};

/// Interval between lines.
pub const INTERVAL: Duration = Duration::from_millis(500);
/// Maximum number of simultaneous clients.
pub const MAX_CLIENTS: usize = 64;
/// The line for a client beyond [`MAX_CLIENTS`].
pub const BUSY: &str = "{\"error\":\"too many clients\"}\n";
/// Maximum time that a client may leave a line unread.
const WRITE_TIMEOUT: Duration = Duration::from_secs(1);
/// Maximum length of a client's request, bytes.
const MAX_REQUEST: usize = 256;
/// Pause after an answer, so that a client that sends requests constantly does not delay the others.
const ANSWER_PAUSE: Duration = Duration::from_millis(5);
/// Pause before the next client if there are too many clients, or no file descriptors left.
const BUSY_PAUSE: Duration = Duration::from_millis(10);
/// File mode of a socket that the group may also connect to.
pub const GROUP_MODE: u32 = 0o660;

/// Reason why there is no status socket.
#[derive(Debug, thiserror::Error)]
pub enum SocketError {
    /// Another process serves the socket of this path.
    #[error("{} is in use by another process", .0.display())]
    InUse(PathBuf),
    /// The path exists but is not a socket.
    #[error("{} exists and is not a socket", .0.display())]
    NotASocket(PathBuf),
    /// The system refuses to create the socket of this path.
    #[error("{path}: {1}", path = .0.display())]
    System(PathBuf, io::Error),
}

/// A bound socket. Dropping it removes its file, unless another process has replaced the file.
#[derive(Debug)]
pub struct StatusSocket {
    path: PathBuf,
    inode: u64,
    listener: UnixListener,
    /// Held as long as the socket, so that two processes never replace each other's socket.
    _lock: File,
}

impl StatusSocket {
    /// Binds the path with a file mode. Replaces a stale socket, but not a socket that a process serves.
    pub fn bind(path: &Path, mode: u32) -> Result<Self, SocketError> {
        let system = |error| SocketError::System(path.to_owned(), error);
        let in_use = || SocketError::InUse(path.to_owned());
        let mut lock_name = path.as_os_str().to_owned();
        lock_name.push(".lock");
        let lock =
            File::options().create(true).truncate(false).write(true).open(lock_name).map_err(system)?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(in_use()),
            Err(TryLockError::Error(error)) => return Err(system(error)),
        }
        match fs::symlink_metadata(path) {
            Ok(found) if !found.file_type().is_socket() => {
                return Err(SocketError::NotASocket(path.to_owned()));
            }
            // Served by a process that holds no lock, such as another program.
            Ok(_) if UnixStream::connect(path).is_ok() => return Err(in_use()),
            Ok(_) => fs::remove_file(path).map_err(system)?,
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) => return Err(system(error)),
        }
        let listener = UnixListener::bind(path).map_err(system)?;
        fs::set_permissions(path, Permissions::from_mode(mode)).map_err(system)?;
        listener.set_nonblocking(true).map_err(system)?;
        let inode = fs::symlink_metadata(path).map_err(system)?.ino();
        Ok(Self { path: path.to_owned(), inode, listener, _lock: lock })
    }

    /// Returns the path of the socket.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns a listener on the socket. Fails if the listener cannot be duplicated.
    pub fn listener(&self) -> io::Result<UnixListener> {
        self.listener.try_clone()
    }
}

impl Drop for StatusSocket {
    fn drop(&mut self) {
        if fs::symlink_metadata(&self.path).is_ok_and(|found| found.ino() == self.inode) {
            // If the file cannot be removed, the next start replaces it.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Answer to a request for changes, sent as one line.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HistoryAnswer {
    /// The changes.
    pub history: HistoryPage,
}

/// Serves clients forever; `history` answers their requests for changes. Fails if the runtime does not accept
/// the listener.
pub async fn serve(
    listener: UnixListener,
    source: SnapshotSource,
    history: impl Fn(HistoryRequest) -> HistoryPage + Clone + Send + 'static,
) -> io::Result<()> {
    let listener = tokio::net::UnixListener::from_std(listener)?;
    let places = Arc::new(Semaphore::new(MAX_CLIENTS));
    loop {
        let Ok((client, _)) = listener.accept().await else {
            sleep(BUSY_PAUSE).await;
            continue;
        };
        let Ok(place) = Arc::clone(&places).try_acquire_owned() else {
            // A socket without previous writes has room for it.
            let _ = client.try_write(BUSY.as_bytes());
            sleep(BUSY_PAUSE).await;
            continue;
        };
        let (source, history) = (source.clone(), history.clone());
        tokio::spawn(async move {
            serve_client(client, source, history).await;
            drop(place);
        });
    }
}

/// Writes lines until the client disconnects, leaves a line unread for too long, or sends an invalid request.
async fn serve_client(
    client: tokio::net::UnixStream,
    mut source: SnapshotSource,
    history: impl Fn(HistoryRequest) -> HistoryPage,
) {
    let (mut reader, mut writer) = client.into_split();
    let (mut requests, mut is_asking) = (Vec::with_capacity(MAX_REQUEST), true);
    let mut next = Instant::now();
    loop {
        let line: Arc<str> = if let Some(end) = requests.iter().position(|byte| *byte == b'\n') {
            let Ok(request) = serde_json::from_slice(&requests[..end]) else { return };
            requests.drain(..=end);
            sleep(ANSWER_PAUSE).await;
            // Plain structs of numbers and strings: this cannot fail.
            let answer = serde_json::to_string(&HistoryAnswer { history: history(request) });
            (answer.unwrap_or_default() + "\n").into()
        } else if requests.len() >= MAX_REQUEST {
            return;
        } else {
            tokio::select! {
                read = reader.read_buf(&mut requests), if is_asking => {
                    // One that has ended its side listens on.
                    is_asking = read.is_ok_and(|length| length > 0);
                    continue;
                }
                () = sleep_until(next) => {
                    next = Instant::now() + INTERVAL;
                    let Some(taken) = source.next().await else { return };
                    taken.json_line()
                }
            }
        };
        match timeout(WRITE_TIMEOUT, writer.write_all(line.as_bytes())).await {
            Ok(Ok(())) => {}
            Ok(Err(_)) | Err(_) => return,
        }
    }
}
