//! Any recipe makes a recording in containers in compressed files, with blocks repeated, overlapping and cut,
//! and that is read within bounds of memory and of steps.

#![no_main]

use std::io::Cursor;

use libfuzzer_sys::fuzz_target;
use can_log::Log;

#[path = "../../tests/support/counting_allocator.rs"]
mod counting_allocator;
#[path = "../../tests/hostile_files/mod.rs"]
mod hostile_files;

/// Most bytes that are held of a file.
const MOST_HELD: u64 = 208 << 20;
/// Most frames and bad lines of a file that is smaller than 10 MB.
const MOST_STEPS: u64 = 25_000_000;

fuzz_target!(|recipe: &[u8]| {
    let nest = hostile_files::nests::nest(&mut hostile_files::choices::Choices::Recipe(recipe));
    let mut steps = 0;
    let name = nest.name;
    let held = counting_allocator::most_held(|| {
        let Ok(mut log) = Log::new(Box::new(Cursor::new(nest.content))) else { return };
        while let Ok(Some(record)) = log.next_record() {
            assert!(record.interface.0 < log.interfaces().len());
            steps += 1;
        }
        steps += log.bad_lines();
        assert!(log.interfaces().len() <= 64);
    });
    assert!(held <= MOST_HELD, "{name}: {held} bytes");
    assert!(steps <= MOST_STEPS, "{name}: {steps} steps");
});
