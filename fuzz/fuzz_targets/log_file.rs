//! Any bytes are read to their end as a recording, in whatever format they look like.
//!
//! Containers of BLF and compressed files unpack to more than they are, so entries are bounded by a factor.

#![no_main]

use std::io::Cursor;

use libfuzzer_sys::fuzz_target;
use can_log::Log;

/// zlib packs at most 1:1032, Zstandard has blocks of 128 KiB in four bytes, xz packs at most 1:7100; bzip2
/// has blocks of 900 kB in 40 bytes; the smallest object has 16 bytes, and the shortest line 8. A compressed
/// file may hold a BLF file, whose containers are compressed again.
const MAX_A_BYTE: usize = 128 * 1024 / 4 * 1100 / 8;

fuzz_target!(|bytes: &[u8]| {
    let Ok(mut log) = Log::new(Box::new(Cursor::new(bytes.to_vec()))) else { return };
    let mut records = 0_usize;
    // An error is the end as well.
    while let Ok(Some(record)) = log.next_record() {
        records += 1;
        assert!(record.interface.0 < log.interfaces().len());
        assert!(records <= bytes.len() * MAX_A_BYTE, "no end");
    }
    assert!(log.interfaces().len() <= 64);
    assert_eq!(log.first_bad().is_some(), log.bad_lines() > 0);
    assert!(log.first_bad().is_none_or(|(number, _)| number > 0));
});
