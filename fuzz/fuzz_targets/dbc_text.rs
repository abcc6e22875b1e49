//! Any bytes make a database without contradictions, and its signals can be read and written.

#![no_main]

use std::collections::BTreeSet;

use libfuzzer_sys::fuzz_target;
use can_signal::can::frame::MAX_DATA;
use can_signal::dbc;

fuzz_target!(|bytes: &[u8]| {
    let database = dbc::parse(bytes);
    let (mut names, mut ids) = (BTreeSet::new(), BTreeSet::new());
    for message in &database.messages {
        assert!(names.insert(&message.name) && ids.insert(message.id), "{} twice", message.name);
        assert!(message.length <= MAX_DATA);
        assert_ne!(message.cycle_ms, Some(0));
        let mut signals = BTreeSet::new();
        for signal in &message.signals {
            assert!(signals.insert(&signal.name), "{} twice", signal.name);
            assert!(signal.codec.needed_length() <= message.length);
            let (lowest, highest) = signal.codec.range();
            for raw in [lowest, highest, 0.clamp(lowest, highest)] {
                let mut data = [0xA5; MAX_DATA];
                signal.codec.write(raw, &mut data).expect("in range");
                assert_eq!(signal.codec.value(&data), raw);
            }
            assert!(signal.codec.write(highest + 1, &mut [0; MAX_DATA]).is_err());
        }
    }
    assert!(database.findings.is_sorted_by_key(|finding| finding.line));
    for finding in &database.findings {
        assert!(finding.line > 0 && !finding.reason.is_empty() && !finding.excerpt.contains('\n'));
    }
});
