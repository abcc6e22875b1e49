//! The time for which processes waited for a processor, as the kernel counts it.
//!
//! A thread that only sleeps is let run soon even where one that works has to wait. So a time of a process is
//! compared with this as well.

use std::fs;
use std::time::Duration;

/// The longest time that a thread of a process, or of one that it has started, has waited so far. Zero where
/// the kernel does not count it.
pub(crate) fn waited(process: u32) -> Duration {
    waits(process).into_iter().max().unwrap_or_default()
}

/// The time that all these threads together have waited so far.
pub(crate) fn waited_in_all(process: u32) -> Duration {
    waits(process).into_iter().sum()
}

fn waits(process: u32) -> Vec<Duration> {
    let own = threads(process).map(|thread| {
        let times =
            fs::read_to_string(format!("/proc/{process}/task/{thread}/schedstat")).unwrap_or_default();
        let nanos = times.split_whitespace().nth(1).and_then(|waited| waited.parse().ok());
        Duration::from_nanos(nanos.unwrap_or_default())
    });
    let children = threads(process).flat_map(|thread| {
        let path = format!("/proc/{process}/task/{thread}/children");
        let listed = fs::read_to_string(path).unwrap_or_default();
        listed.split_whitespace().filter_map(|child| child.parse().ok()).collect::<Vec<u32>>()
    });
    own.chain(children.flat_map(waits)).collect()
}

fn threads(process: u32) -> impl Iterator<Item = String> {
    let listed = fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten();
    listed.filter_map(|thread| thread.ok()?.file_name().into_string().ok())
}
