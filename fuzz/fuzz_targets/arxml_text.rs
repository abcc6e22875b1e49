//! Any text as an ARXML gives a database without contradictions, or a reason.

#![no_main]

use std::collections::BTreeSet;
use std::io;
use std::path::Path;

use libfuzzer_sys::fuzz_target;
use signal_gateway::config::files::Files;
use signal_gateway::config::load_profile;
use can_signal::can::frame::MAX_DATA;

const PROFILE: &str = "name = \"Car\"\n[bus.body]\ndbc = \"car.arxml\"\ncluster = \"Body\"\n[turn]\nfitted = false\n\
                       [hazard]\nfrom = \"not_fitted\"\n";

struct Car<'a>(&'a [u8]);

impl Files for Car<'_> {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        Ok(if path == Path::new("car.toml") { PROFILE.as_bytes().to_vec() } else { self.0.to_vec() })
    }
}

fuzz_target!(|bytes: &[u8]| {
    let Ok(settings) = load_profile(&Car(bytes), Path::new("car.toml")) else { return };
    let database = &settings.dbcs[0].database;
    let (mut names, mut ids) = (BTreeSet::new(), BTreeSet::new());
    for message in &database.messages {
        assert!(names.insert(&message.name) && ids.insert(message.id), "{} twice", message.name);
        assert!(message.length <= MAX_DATA);
        assert_ne!(message.cycle_ms, Some(0));
        let mut signals = BTreeSet::new();
        for signal in &message.signals {
            assert!(signals.insert(&signal.name), "{} twice", signal.name);
            assert!(signal.codec.needed_length() <= message.length);
            let (lowest, _) = signal.codec.range();
            let mut data = [0xA5; MAX_DATA];
            signal.codec.write(lowest, &mut data).expect("in range");
            assert_eq!(signal.codec.value(&data), lowest);
        }
    }
    assert!(database.findings.is_sorted_by_key(|finding| finding.line));
});
