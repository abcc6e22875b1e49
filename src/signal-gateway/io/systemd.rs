//! The service manager: readiness, a status line and the watchdog, by `sd_notify(3)`'s protocol.
//!
//! Our own code, because of three requirements: abstract sockets (for a gateway in a container), a send that
//! never blocks the frame loop, and addresses that tests can pass as arguments.

use std::ffi::{OsStr, OsString};
use std::io;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::path::PathBuf;
use std::time::Duration;

/// The service manager that started this process, if there is one.
#[derive(Debug, Default)]
pub struct Supervisor {
    socket: Option<(UnixDatagram, SocketAddr)>,
    /// Interval at which to feed the watchdog, half of its timeout; `None` without a watchdog.
    pub watchdog_period: Option<Duration>,
}

impl Supervisor {
    /// Reads `NOTIFY_SOCKET`, `WATCHDOG_USEC` and `WATCHDOG_PID`. Without them all methods do nothing.
    ///
    /// Fails if `NOTIFY_SOCKET` is not an address that this process can use (neither an absolute path nor
    /// `@name`, or too long), since the unit would otherwise wait for readiness until its timeout.
    pub fn from_env() -> io::Result<Self> {
        Self::from_variables(|name| std::env::var_os(name), std::process::id())
    }

    fn from_variables(variable: impl Fn(&str) -> Option<OsString>, own_pid: u32) -> io::Result<Self> {
        let number = |name| variable(name)?.to_str()?.parse::<u64>().ok();
        let meant_for_us = match variable("WATCHDOG_PID") {
            Some(_) => number("WATCHDOG_PID") == Some(u64::from(own_pid)),
            None => true,
        };
        let timeout_us = number("WATCHDOG_USEC").filter(|&us| us > 0 && meant_for_us);
        let socket = variable("NOTIFY_SOCKET").map(|address| open(&address)).transpose()?;
        Ok(Self { socket, watchdog_period: timeout_us.map(|us| Duration::from_micros(us) / 2) })
    }

    /// Returns true if there is a service manager.
    pub fn is_present(&self) -> bool {
        self.socket.is_some()
    }

    /// Announces that start-up is done; `systemctl status` shows `status`.
    pub fn ready(&self, status: &str) {
        self.send(&format!("READY=1\n{}", status_line(status)));
    }

    /// Announces that the configuration is being reloaded; [`Self::ready`] ends this.
    pub fn reloading(&self) {
        self.send(&format!("RELOADING=1\nMONOTONIC_USEC={}", monotonic_micros()));
    }

    /// Sets the line of `systemctl status`. Line breaks become spaces.
    pub fn status(&self, text: &str) {
        self.send(&status_line(text));
    }

    /// Feeds the watchdog. Call it every [`Self::watchdog_period`].
    pub fn feed_watchdog(&self) {
        if self.watchdog_period.is_some() {
            self.send("WATCHDOG=1");
        }
    }

    /// Announces that the gateway is stopping.
    pub fn stopping(&self) {
        self.send("STOPPING=1");
    }

    /// Sends a message. Returns false if it is lost: the service manager is gone, or its queue is full.
    fn send(&self, message: &str) -> bool {
        let sent =
            self.socket.as_ref().map(|(socket, address)| socket.send_to_addr(message.as_bytes(), address));
        sent.is_none_or(|sent| sent.is_ok())
    }
}

/// Returns a folder of the service, such as systemd's `STATE_DIRECTORY`; `None` outside a service.
pub fn service_folder(variable: &str) -> Option<PathBuf> {
    first_folder(&std::env::var_os(variable)?)
}

fn first_folder(folders: &OsStr) -> Option<PathBuf> {
    // A colon-separated list; ours has one entry.
    let first = folders.to_str()?.split(':').next()?;
    (!first.is_empty()).then(|| PathBuf::from(first))
}

/// Opens an unconnected socket, which also reaches a service manager that was restarted at the same address.
fn open(address: &OsString) -> io::Result<(UnixDatagram, SocketAddr)> {
    let address = match address.as_bytes() {
        [b'@', name @ ..] => SocketAddr::from_abstract_name(name)?,
        [b'/', ..] => SocketAddr::from_pathname(address)?,
        _ => return Err(io::Error::other("NOTIFY_SOCKET is neither an absolute path nor @name")),
    };
    let socket = UnixDatagram::unbound()?;
    socket.set_nonblocking(true)?;
    Ok((socket, address))
}

/// Returns the time of the clock by which systemd orders a reload after its request, µs since boot.
#[allow(unsafe_code)] // rustix wants a vDSO for this, which not every kernel gives
fn monotonic_micros() -> i64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is to a timespec of our own. This clock always exists.
    unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &raw mut time) };
    time.tv_sec.saturating_mul(1_000_000).saturating_add(time.tv_nsec / 1_000)
}

/// Returns a single assignment for any `text`: a line break, which would start another one, becomes a space.
fn status_line(text: &str) -> String {
    format!("STATUS={}", text.replace(['\n', '\r'], " "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::waiting::DEADLINE;
    use std::path::Path;

    const OWN_PID: u32 = 4711;

    fn supervisor(variables: &[(&str, &str)]) -> io::Result<Supervisor> {
        let value =
            |name: &str| variables.iter().find(|(key, _)| *key == name).map(|(_, value)| value.into());
        Supervisor::from_variables(value, OWN_PID)
    }

    fn listen(path: &Path) -> UnixDatagram {
        let socket = UnixDatagram::bind(path).unwrap();
        socket.set_read_timeout(Some(DEADLINE)).unwrap();
        socket
    }

    fn received(socket: &UnixDatagram) -> String {
        let mut buffer = [0; 512];
        let len = socket.recv(&mut buffer).unwrap();
        String::from_utf8(buffer[..len].to_vec()).unwrap()
    }

    #[test]
    fn folder_is_the_first_of_the_service_managers_list() {
        let folder = |folders: &str| first_folder(folders.as_ref());
        assert_eq!(folder("/var/lib/one:/var/lib/other"), Some(PathBuf::from("/var/lib/one")));
        assert_eq!(folder(""), None);
    }

    #[test]
    fn each_message_moves_the_state() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("notify");
        let manager = listen(&path);
        let own =
            supervisor(&[("NOTIFY_SOCKET", path.to_str().unwrap()), ("WATCHDOG_USEC", "4000000")]).unwrap();
        own.ready("can0: 12 signals");
        own.feed_watchdog();
        own.status("can0 down\nREADY=0");
        own.reloading();
        own.stopping();
        assert_eq!(received(&manager), "READY=1\nSTATUS=can0: 12 signals");
        assert_eq!(received(&manager), "WATCHDOG=1");
        assert_eq!(received(&manager), "STATUS=can0 down READY=0");
        let reloading = received(&manager);
        let micros = reloading.strip_prefix("RELOADING=1\nMONOTONIC_USEC=").unwrap();
        assert!(micros.parse::<u64>().unwrap() > 0, "{reloading}");
        assert_eq!(received(&manager), "STOPPING=1");
    }

    #[test]
    fn an_abstract_socket_is_reached_as_in_containers() {
        let name = format!("signal-gateway-test-{}", std::process::id());
        let address = SocketAddr::from_abstract_name(&name).unwrap();
        let manager = UnixDatagram::bind_addr(&address).unwrap();
        manager.set_read_timeout(Some(DEADLINE)).unwrap();
        supervisor(&[("NOTIFY_SOCKET", &format!("@{name}"))]).unwrap().ready("up");
        assert_eq!(received(&manager), "READY=1\nSTATUS=up");
    }

    #[test]
    fn outside_systemd_nothing_is_sent_and_nothing_is_lost() {
        let own = supervisor(&[]).unwrap();
        own.ready("up");
        own.feed_watchdog();
        assert_eq!(own.watchdog_period, None);
        assert!(own.send("STATUS=up"));
    }

    #[test]
    fn a_manager_that_left_is_found_again_when_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("notify");
        let own = supervisor(&[("NOTIFY_SOCKET", path.to_str().unwrap())]).unwrap();
        assert!(!own.send("STATUS=lost"));
        let manager = listen(&path);
        own.status("back");
        assert_eq!(received(&manager), "STATUS=back");
    }

    #[test]
    fn a_manager_that_does_not_read_never_blocks_the_loop() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("notify");
        let _unread = listen(&path);
        let own = supervisor(&[("NOTIFY_SOCKET", path.to_str().unwrap())]).unwrap();
        let lost = (0..100_000).filter(|_| !own.send("STATUS=again")).count();
        assert!(lost > 0, "the queue never filled");
    }

    #[test]
    fn the_watchdog_is_fed_at_half_its_time() {
        let period = |variables: &[_]| supervisor(variables).unwrap().watchdog_period;
        let half = Some(Duration::from_secs(2));
        assert_eq!(period(&[("WATCHDOG_USEC", "4000000")]), half);
        assert_eq!(period(&[("WATCHDOG_USEC", "4000000"), ("WATCHDOG_PID", "4711")]), half);
        assert_eq!(period(&[("WATCHDOG_USEC", "4000000"), ("WATCHDOG_PID", "1")]), None, "another's");
        assert_eq!(period(&[("WATCHDOG_USEC", "4000000"), ("WATCHDOG_PID", "x")]), None, "invalid");
        assert_eq!(period(&[("WATCHDOG_USEC", "0")]), None);
        assert_eq!(period(&[("WATCHDOG_USEC", "-1")]), None);
    }

    #[test]
    fn an_invalid_address_is_refused() {
        for address in ["", "relative", "vsock:2:1", &format!("/{}", "x".repeat(200))] {
            assert!(supervisor(&[("NOTIFY_SOCKET", address)]).is_err(), "{address}");
        }
    }
}
