//! Formats records for systemd's journal in its native protocol: one datagram per record, with a priority and
//! named fields.
//!
//! Like the notifications of the service manager, this is our own code: existing libraries send from the
//! logging thread, which would block if the journal does not read.

use std::io;
use std::os::fd::AsFd as _;
use std::os::unix::fs::MetadataExt as _;
use std::os::unix::net::UnixDatagram;

use tracing::Level;

const SOCKET: &str = "/run/systemd/journal/socket";
/// Maximum length of a field's text, bytes; a datagram has room for several such fields.
const MAX_TEXT: usize = 16 * 1024;

/// A field of a record.
#[derive(Debug, Clone, Copy)]
pub struct JournalField<'a> {
    /// Name of the field, in capitals.
    pub name: &'static str,
    /// Text of the field; a field without text is omitted.
    pub text: &'a str,
}

/// Opens a socket to the journal if standard error goes there.
pub(super) fn open() -> Option<UnixDatagram> {
    let stream = std::env::var("JOURNAL_STREAM").ok()?;
    let error = std::fs::File::from(io::stderr().as_fd().try_clone_to_owned().ok()?).metadata().ok()?;
    is_stream(&stream, error.dev(), error.ino()).then_some(())?;
    let socket = UnixDatagram::unbound().ok()?;
    socket.connect(SOCKET).ok()?;
    Some(socket)
}

/// Returns true if `JOURNAL_STREAM` names this file.
fn is_stream(variable: &str, device: u64, inode: u64) -> bool {
    variable == format!("{device}:{inode}")
}

/// Returns the syslog priority: 3 for errors, 4 for warnings, 6 for information, 7 for debugging.
fn priority(level: Level) -> &'static str {
    match level {
        Level::ERROR => "3",
        Level::WARN => "4",
        Level::INFO => "6",
        Level::DEBUG | Level::TRACE => "7",
    }
}

/// Formats lines for standard error as records of the journal, with their priority.
pub(super) fn with_priority(level: Level, text: &str) -> String {
    text.lines().map(|line| format!("<{}>{line}\n", priority(level))).collect()
}

/// Formats a record as a datagram.
pub(super) fn datagram(level: Level, message: &str, fields: &[JournalField<'_>]) -> Vec<u8> {
    let mut datagram = Vec::new();
    field(&mut datagram, "MESSAGE", message);
    field(&mut datagram, "PRIORITY", priority(level));
    field(&mut datagram, "SYSLOG_IDENTIFIER", "signal-gateway");
    for JournalField { name, text } in fields.iter().filter(|field| !field.text.is_empty()) {
        field(&mut datagram, name, text);
    }
    datagram
}

/// Writes a field with its length, so that its text may contain anything.
fn field(datagram: &mut Vec<u8>, name: &str, text: &str) {
    let text = &text.as_bytes()[..text.len().min(MAX_TEXT)];
    datagram.extend_from_slice(name.as_bytes());
    datagram.push(b'\n');
    datagram.extend_from_slice(&u64::try_from(text.len()).unwrap_or_default().to_le_bytes());
    datagram.extend_from_slice(text);
    datagram.push(b'\n');
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn record_has_each_field_with_its_length_and_no_empty_one() {
        let datagram = datagram(
            Level::ERROR,
            "a\nb",
            &[("TASK", "can0"), ("CAUSE", "")].map(|(name, text)| JournalField { name, text }),
        );
        let expected = [
            &b"MESSAGE\n\x03\0\0\0\0\0\0\0a\nb\n"[..],
            b"PRIORITY\n\x01\0\0\0\0\0\0\x003\n",
            b"SYSLOG_IDENTIFIER\n\x0e\0\0\0\0\0\0\0signal-gateway\n",
            b"TASK\n\x04\0\0\0\0\0\0\0can0\n",
        ];
        assert_eq!(datagram, expected.concat());
    }

    #[test]
    fn each_line_has_its_priority() {
        assert_eq!(with_priority(Level::ERROR, "a\n | b"), "<3>a\n<3> | b\n");
        assert_eq!(with_priority(Level::WARN, ""), "");
    }

    #[test]
    fn stream_is_known_by_device_and_inode() {
        assert!(is_stream("8:12345", 8, 12_345));
        for other in ["", "8:1234", "12345:8", "8:12345 "] {
            assert!(!is_stream(other, 8, 12_345), "{other}");
        }
    }
}
