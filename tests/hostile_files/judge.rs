//! What a run may take, and how it may end.

use std::time::Duration;

use super::child::Taken;
use super::hostile_files::case::Case;

/// Size of a file up to which the limits are the same, bytes.
const FREE: u64 = 10_000_000;
/// Most time of a processor for such a file, and the time behind which a run is ended.
pub(crate) const MOST_TIME: Duration = Duration::from_secs(20);
pub(crate) const END: Duration = Duration::from_secs(25);
/// Most memory for such a file, KiB.
const MOST_MEMORY_KIB: u64 = 256 << 10;
/// Most that is written for such a file, bytes: a packed one may hold millions of frames.
const MOST_WRITTEN: u64 = 1 << 30;
/// Most that is written for a file of a few frames, 3,000 at most, bytes, however far apart they are: 64 MiB,
/// and 8 kB for each.
const MOST_OF_FEW: u64 = 92 << 20;
/// Formats that are held whole may be unpacked to so many times their size, and so much at most, KiB.
const HELD_TIMES: u64 = 50;
const MOST_HELD_KIB: u64 = 1 << 20;
/// Most of standard error, bytes.
const MOST_SAID: usize = 16 << 10;

/// Why a run is wrong; `size` is the size of the file.
pub(crate) fn wrong(case: &Case, command: &str, taken: &Taken, size: u64) -> Option<String> {
    let share = |most: u64| {
        u64::try_from(u128::from(most) * u128::from(size.max(FREE)) / u128::from(FREE)).unwrap_or(u64::MAX)
    };
    let Taken { code, signal, processor, memory_kib, written, lines, error } = taken;
    let time = share(u64::try_from(MOST_TIME.as_micros()).unwrap_or(u64::MAX));
    let held = if case.is_held_whole { (HELD_TIMES * size / 1024).min(share(MOST_HELD_KIB)) } else { 0 };
    let memory = share(MOST_MEMORY_KIB) + held;
    if error.contains("panicked") || error.contains("RUST_BACKTRACE") {
        return Some(format!("a panic: {}", error.lines().next().unwrap_or_default()));
    }
    let Some(code) = code else {
        return Some(format!("signal {} after {:.1} s", signal.unwrap_or(0), processor.as_secs_f64()));
    };
    if processor.as_micros() > time.into() {
        return Some(format!("{:.1} s of a processor", processor.as_secs_f64()));
    }
    if *memory_kib > memory {
        return Some(format!("{} MiB of memory", memory_kib >> 10));
    }
    let most_written = if case.has_few_frames { MOST_OF_FEW } else { share(MOST_WRITTEN) };
    if *written > most_written {
        return Some(format!("{} MiB written", written >> 20));
    }
    let documented: &[i32] = match command {
        "identify" => &[0, 1, 2, 4],
        "check" | "replay" => &[0, 1, 2, 3, 4],
        "decode" => &[0, 1, 2, 3],
        _ => &[0, 1, 2, 3, 5, 6],
    };
    if !documented.contains(code) {
        return Some(format!("exit code {code}"));
    }
    if matches!(code, 1..=3) && !error.contains("error") {
        return Some(format!("exit code {code} without a reason"));
    }
    if error.contains("the limit") && !error.contains("; ") {
        return Some("a limit without what to do".to_owned());
    }
    if error.len() > MOST_SAID {
        return Some("more than 16 KiB on standard error".to_owned());
    }
    if command == "decode" && *lines < case.decoded {
        return Some(format!("{lines} lines are decoded, of {} before the damage", case.decoded));
    }
    None
}
