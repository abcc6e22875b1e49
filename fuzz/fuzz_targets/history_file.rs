//! Any bytes are read as a history, or refused; what is read goes on in a bounded history whose pages are in
//! order, and is read again as it was.

#![no_main]

use libfuzzer_sys::fuzz_target;
use gateway_core::gateway::history::{History, HistoryRequest};
use signal_gateway::io::history_file::parse;
use signal_gateway::report::history::entry_text;

const MAX_BYTES: usize = 20_000;

fuzz_target!(|bytes: &[u8]| {
    let mut history = History::new(MAX_BYTES);
    if let Ok(read) = parse(bytes) {
        let lines = read.entries.len() as u64;
        let unusable = history.restore(read.entries);
        assert!(unusable <= lines);
    }
    let entries = history.entries();
    assert!(entries.is_sorted_by(|one, other| one.number < other.number));
    for entry in &entries {
        assert_eq!(history.entry(entry.number), Some(entry));
        assert!(entry_text(entry).chars().all(|character| character == '\n' || !character.is_control()));
    }
    let mut again = History::new(MAX_BYTES);
    assert_eq!(again.restore(entries.clone()), 0);
    assert_eq!(again.entries(), entries);
    for number in [0, bytes.len() as u64, u64::MAX] {
        let request = HistoryRequest { after: Some(number), count: Some(3), ..HistoryRequest::default() };
        let page = history.page(request);
        assert!(page.entries.len() <= 3 && page.entries.iter().all(|entry| entry.number > number));
    }
});
