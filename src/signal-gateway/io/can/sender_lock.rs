//! Ensures that at most one process sends commands on a CAN interface.
//!
//! The lock is the name of an abstract socket. It belongs to the network namespace like the interface, so it
//! also works between containers on one bus. It needs no file, and the kernel releases it when the process
//! ends.

use std::io;
use std::os::linux::net::SocketAddrExt as _;
use std::os::unix::net::{SocketAddr, UnixListener};

use tokio::net::UnixStream;

/// The right to send commands on some interfaces. Dropping it releases the right.
#[derive(Debug)]
pub struct SenderLock(#[allow(dead_code)] Vec<UnixListener>); // held, never accepted on

/// Reasons for refusing the right to send commands.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // see the texts
pub enum SenderLockError {
    #[error("commands are already sent on {interface} by {}", holder(*.pid))]
    Held {
        interface: String,
        /// Process that holds the lock; `None` if it is not visible, e.g. in another container.
        pid: Option<i32>,
    },
    /// The kernel refuses the socket for another reason.
    #[error("the lock for sending commands on {interface}: {error}")]
    System { interface: String, error: io::Error },
}

fn holder(pid: Option<i32>) -> String {
    pid.map_or("another process".to_owned(), |pid| format!("process {pid}"))
}

impl SenderLock {
    /// Takes the lock of each interface by its name. Must be called within a runtime.
    pub async fn take<'a>(interfaces: impl IntoIterator<Item = &'a str>) -> Result<Self, SenderLockError> {
        let mut held = Vec::new();
        for interface in interfaces {
            let name = lock_name(interface);
            let bound = SocketAddr::from_abstract_name(&name).and_then(|name| UnixListener::bind_addr(&name));
            let interface = interface.to_owned();
            held.push(match bound {
                Ok(listener) => listener,
                Err(error) if error.kind() == io::ErrorKind::AddrInUse => {
                    return Err(SenderLockError::Held { interface, pid: pid_of_listener(&name).await });
                }
                Err(error) => return Err(SenderLockError::System { interface, error }),
            });
        }
        Ok(Self(held))
    }
}

fn lock_name(interface: &str) -> String {
    format!("signal-gateway/commands/{interface}")
}

/// Returns true if a process sends commands on an interface. Does not take the lock: the kernel lists the
/// names of sockets.
pub fn is_locked(interface: &str) -> bool {
    let sockets = std::fs::read_to_string("/proc/net/unix").unwrap_or_default();
    let name = format!("@{}", lock_name(interface));
    sockets.lines().any(|line| line.split_whitespace().next_back() == Some(&name))
}

/// Returns the process that listens on an abstract name; `None` if it is not visible or has just ended.
async fn pid_of_listener(name: &str) -> Option<i32> {
    let stream = UnixStream::connect(format!("\0{name}")).await.ok()?;
    stream.peer_cred().ok()?.pid().filter(|pid| *pid > 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_lock_is_held_once_for_each_interface_until_it_is_dropped() {
        let names = ["lock-test-0", "lock-test-1"];
        assert!(!is_locked("lock-test-0"));
        let first = SenderLock::take(names).await.unwrap();
        assert!(is_locked("lock-test-0") && !is_locked("lock-test"));
        let refused = SenderLock::take(["lock-test-2", "lock-test-1"]).await.unwrap_err();
        let own = std::process::id();
        let expected = format!("commands are already sent on lock-test-1 by process {own}");
        assert_eq!(refused.to_string(), expected);
        assert!(SenderLock::take(["lock-test-2"]).await.is_ok(), "a refusal leaves nothing locked");
        drop(first);
        assert!(SenderLock::take(names).await.is_ok());
    }
}
