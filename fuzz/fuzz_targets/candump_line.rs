//! Any bytes are read as a line, a log or a request to a simulated vehicle, or refused, and what was read of
//! a log can be written and read again.

#![no_main]

use std::io::Cursor;

use libfuzzer_sys::fuzz_target;
use vehicle_bringup::simulated_vehicle::request;
use can_log::{EntryContent, begins_like_binary};
use can_log::candump::parse_line;
use can_log::Log;

fuzz_target!(|bytes: &[u8]| {
    if let Err(error) = str::from_utf8(bytes).map_or(Ok(None), request::line) {
        assert!(!error.to_string().is_empty());
    }
    if let Ok(line) = parse_line(bytes) {
        let interface = line.interface.to_string();
        assert!(!interface.is_empty() && !interface.contains(' '));
        if let EntryContent::Data(frame) = line.content {
            let nanos = line.stamp.as_nanos();
            let sign = if nanos < 0 { "-" } else { "" };
            let (sec, fraction) = (nanos.unsigned_abs() / 1_000_000_000, nanos.unsigned_abs() % 1_000_000_000);
            let again = format!("({sign}{sec}.{fraction:09}) {interface} {frame}");
            assert_eq!(parse_line(again.as_bytes()), Ok(line));
        }
    }
    let lines = bytes.split(|byte| *byte == b'\n').count() as u64;
    // Packed: the content may be much larger. Binary formats: no lines, and they may end within a record.
    let zstd = bytes.get(1..4) == Some(&[0xB5, 0x2F, 0xFD]) || bytes.get(1..4) == Some(&[0x2A, 0x4D, 0x18]);
    let packed = [&[0x1F, 0x8B][..], b"\xFD7zXZ", b"BZh", &[0x04, 0x22, 0x4D, 0x18]];
    // The beginning is looked at piece by piece.
    let begins_like_binary = |length: usize| begins_like_binary(&bytes[..bytes.len().min(length)]);
    if zstd
        || packed.iter().any(|mark| bytes.starts_with(mark))
        || (512..=4096).step_by(512).any(begins_like_binary)
    {
        return;
    }
    // An error: not a recording.
    let Ok(mut log) = Log::new(Box::new(Cursor::new(bytes.to_vec()))) else { return };
    let mut records = 0;
    while let Some(record) = log.next_record().expect("memory can be read") {
        assert!(record.interface.0 < log.interfaces().len());
        records += 1;
    }
    assert!(records + log.bad_lines() <= lines);
    assert_eq!(log.first_bad().is_some(), log.bad_lines() > 0);
});
