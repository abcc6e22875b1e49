//! The service manager of a gateway: the socket that it notifies.

use std::io::ErrorKind;
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::waiting::{DEADLINE, wait_for};

/// The socket, and its place. Its queue holds few messages: those that find it full are lost.
pub(crate) struct ServiceManager {
    socket: UnixDatagram,
    path: PathBuf,
}

impl ServiceManager {
    /// Listens in a folder.
    pub(crate) fn in_folder(folder: &Path) -> Self {
        let path = folder.join("notify");
        let socket = UnixDatagram::bind(&path).unwrap();
        socket.set_read_timeout(Some(DEADLINE)).unwrap();
        Self { socket, path }
    }

    /// Has a gateway notify it.
    pub(crate) fn supervise(&self, command: &mut Command) {
        command.env("NOTIFY_SOCKET", &self.path);
    }

    /// Has a gateway notify it, and feed a watchdog of this time.
    pub(crate) fn watch(&self, command: &mut Command, watchdog_us: u32) {
        self.supervise(command);
        command.env("WATCHDOG_USEC", watchdog_us.to_string());
    }

    /// Waits for the next message.
    pub(crate) fn next(&self) -> String {
        let mut buffer = [0; 4096];
        // A process that was stopped for a moment finds its wait interrupted.
        let received = std::iter::repeat_with(|| self.socket.recv(&mut buffer))
            .find(|received| !received.as_ref().is_err_and(|error| error.kind() == ErrorKind::Interrupted));
        let length = received.unwrap().unwrap();
        String::from_utf8(buffer[..length].to_vec()).unwrap()
    }

    /// Waits for a message that begins so, and passes those before it.
    pub(crate) fn wait_for(&self, beginning: &str) -> String {
        wait_for(format_args!("a message {beginning:?}"), || {
            Some(self.next()).filter(|message| message.starts_with(beginning))
        })
    }

    /// Drops the messages that have come.
    pub(crate) fn drain(&self) {
        self.socket.set_nonblocking(true).unwrap();
        while self.socket.recv(&mut [0; 4096]).is_ok() {}
        self.socket.set_nonblocking(false).unwrap();
    }
}
