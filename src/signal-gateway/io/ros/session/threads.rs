//! Determines from two readings of `/proc` how long the threads of a process waited for a processor or
//! memory.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::time::Duration;

use serde::{Deserialize, Serialize};

/// The threads of a process by id.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(super) struct Threads(BTreeMap<u32, ThreadReading>);

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
struct ThreadReading {
    state: ThreadState,
    /// `None` if the kernel does not measure them.
    times: Option<ProcessorTimes>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
enum ThreadState {
    /// Runs, or waits for a processor.
    Runnable,
    /// Waits for a disk or for memory.
    Uninterruptible,
    /// Sleeps, or is stopped.
    AtRest,
}

/// Sums since the thread's start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
struct ProcessorTimes {
    ran: Duration,
    /// Updated when a wait ends.
    waited: Duration,
}

impl Threads {
    /// Reads the current threads of a process; returns `None` if they cannot be read.
    pub(super) fn read(process: u32) -> Option<Self> {
        let tasks = fs::read_dir(format!("/proc/{process}/task")).ok()?;
        // The files of a thread that ends meanwhile are gone.
        let threads = tasks.filter_map(|task| {
            let task = task.ok()?;
            let id = task.file_name().to_str()?.parse().ok()?;
            Some((id, ThreadReading::read(&task.path())?))
        });
        let threads: BTreeMap<_, _> = threads.collect();
        (!threads.is_empty()).then_some(Self(threads))
    }

    /// Returns the processor time that the threads have used since an earlier reading; `None` if the kernel
    /// does not measure it.
    pub(super) fn ran_since(&self, earlier: &Self) -> Option<Duration> {
        let ran = |(id, now): (&u32, &ThreadReading)| {
            let before =
                earlier.0.get(id).and_then(|then| then.times).map_or(Duration::ZERO, |times| times.ran);
            Some(now.times?.ran.saturating_sub(before))
        };
        self.0.iter().map(ran).sum()
    }

    /// Returns for how much of `span`, the time since an earlier reading, threads may have been held up.
    /// Since threads wait for each other, their times are added.
    pub(super) fn held_up(&self, earlier: &Self, span: Duration) -> Duration {
        let pairs = self.0.iter().filter_map(|(id, now)| Some((earlier.0.get(id)?, now)));
        pairs.map(|(then, now)| now.held_up(then, span)).sum::<Duration>().min(span)
    }
}

impl ThreadReading {
    fn read(task: &Path) -> Option<Self> {
        let text = |name| fs::read_to_string(task.join(name)).ok();
        let state = state(&text("stat")?)?;
        Some(Self { state, times: text("schedstat").and_then(|text| times(&text)) })
    }

    fn held_up(&self, earlier: &Self, span: Duration) -> Duration {
        let times = self.times.zip(earlier.times);
        let has_run = times.is_some_and(|(now, then)| now.ran > then.ran);
        match self.state {
            ThreadState::Uninterruptible => span,
            ThreadState::Runnable if !has_run => span,
            ThreadState::Runnable | ThreadState::AtRest => {
                times.map_or(Duration::ZERO, |(now, then)| now.waited.saturating_sub(then.waited))
            }
        }
    }
}

/// Parses the third field of `stat`, which follows a name that may contain any characters.
fn state(stat: &str) -> Option<ThreadState> {
    match stat.rsplit_once(')')?.1.split_whitespace().next()? {
        "R" => Some(ThreadState::Runnable),
        "D" => Some(ThreadState::Uninterruptible),
        _ => Some(ThreadState::AtRest),
    }
}

/// Parses the first two fields of `schedstat`, ns, which are zero if the kernel does not measure them.
fn times(schedstat: &str) -> Option<ProcessorTimes> {
    let mut fields = schedstat.split_whitespace().map(str::parse).map_while(Result::ok);
    let (ran, waited) = (fields.next()?, fields.next()?);
    let times = ProcessorTimes { ran: Duration::from_nanos(ran), waited: Duration::from_nanos(waited) };
    (ran > 0).then_some(times)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    const SPAN: Duration = Duration::from_millis(100);

    fn reading(stat: &str, schedstat: &str) -> ThreadReading {
        let state = state(&format!("7 (a) R (b) {stat} 1 2")).unwrap();
        ThreadReading { state, times: times(schedstat) }
    }

    /// Creates threads with these states and `schedstat` lines.
    pub(in super::super) fn threads(readings: &[(&str, &str)]) -> Threads {
        let readings = readings.iter().map(|(stat, schedstat)| reading(stat, schedstat));
        Threads((1..).zip(readings).collect())
    }

    fn held_up(before: &[(&str, &str)], after: &[(&str, &str)]) -> u128 {
        threads(after).held_up(&threads(before), SPAN).as_millis()
    }

    #[test]
    fn waits_for_a_processor_hold_up() {
        assert_eq!(held_up(&[("S", "1000000 5000000 3")], &[("S", "2000000 65000000 4")]), 60);
        let both = [("S", "1 30000000 1"), ("R", "2 40000000 1")];
        assert_eq!(held_up(&[("S", "1 0 1"), ("S", "1 0 1")], &both), 70, "one after the other");
        assert_eq!(
            held_up(&[("S", "1 0 1")], &[("S", "2 900000000 1")]),
            100,
            "no more than the time there was"
        );
    }

    #[test]
    fn a_wait_that_is_not_over_holds_up_and_a_thread_that_runs_does_not() {
        assert_eq!(held_up(&[("R", "5 6 1")], &[("R", "5 6 1")]), 100, "waits all the time");
        assert_eq!(held_up(&[("R", "5 6 1")], &[("R", "95000005 6 1")]), 0, "runs, perhaps for ever");
        assert_eq!(held_up(&[("S", "5 6 1")], &[("D", "5 6 1")]), 100);
        for rest in ["S", "T", "t", "I", "Z"] {
            assert_eq!(held_up(&[(rest, "5 6 1")], &[(rest, "5 6 1")]), 0, "{rest}");
        }
    }

    #[test]
    fn without_measured_times_only_a_thread_at_rest_is_not_held_up() {
        for unmeasured in ["", "0 0 0", "x"] {
            assert_eq!(held_up(&[("R", unmeasured)], &[("R", unmeasured)]), 100, "{unmeasured:?}");
            assert_eq!(held_up(&[("S", unmeasured)], &[("T", unmeasured)]), 0, "{unmeasured:?}");
        }
    }

    #[test]
    fn a_thread_that_is_new_or_gone_is_left_out() {
        assert_eq!(held_up(&[("S", "1 0 1")], &[("S", "1 0 1"), ("R", "1 50000000 1")]), 0);
        assert_eq!(held_up(&[("S", "1 0 1"), ("R", "1 0 1")], &[("S", "1 20000000 1")]), 20);
    }

    #[test]
    fn the_time_that_threads_ran_adds_up_new_ones_included() {
        let ran = |before: &[(&str, &str)], after: &[(&str, &str)]| {
            threads(after).ran_since(&threads(before)).map(|ran| ran.as_millis())
        };
        let two = [("S", "31000000 0 1"), ("R", "5000000 0 1")];
        assert_eq!(ran(&[("S", "1000000 0 1")], &two), Some(35));
        assert_eq!(ran(&two, &two[..1]), Some(0));
        assert_eq!(ran(&[("S", "1 0 1")], &[("S", "")]), None);
    }

    #[test]
    fn this_process_has_threads_and_no_process_has_none() {
        assert!(Threads::read(std::process::id()).is_some_and(|threads| !threads.0.is_empty()));
        assert_eq!(Threads::read(u32::MAX), None);
    }
}
