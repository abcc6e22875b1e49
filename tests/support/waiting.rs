//! The ways in which a test waits: for an event, beside a thread that only sleeps, or in a rhythm. No other
//! file of the tests sleeps, sets a deadline or compares a time of the machine; the test
//! `pure::waiting_rules` sees to it.

use std::fmt::{self, Display, Formatter};
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// The longest wait for an event that must come. It is longer than every limit of the gateway and every lease
/// of its peers, so that a machine that is ten times too slow still meets it.
pub(crate) const DEADLINE: Duration = Duration::from_secs(120);

/// The time between two looks at something that has no event to wait for.
const LOOK_INTERVAL: Duration = Duration::from_millis(5);

/// Waits until `look` returns a value, and returns it.
///
/// # Panics
/// If there is none within [`DEADLINE`]; the message names `what`.
pub(crate) fn wait_for<T>(what: impl Display, mut look: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(begun.elapsed() < DEADLINE, "waited {DEADLINE:?} in vain for {what}");
        thread::sleep(LOOK_INTERVAL);
    }
}

/// Waits until `is_there` is true.
///
/// # Panics
/// Like [`wait_for`].
pub(crate) fn wait_until(what: impl Display, mut is_there: impl FnMut() -> bool) {
    wait_for(what, || is_there().then_some(()));
}

/// A text for [`wait_for`] and [`wait_until`] that is made only when the wait was in vain, so that it can
/// have in it what is known by then.
pub(crate) fn described(text: impl Fn() -> String) -> impl Display {
    struct Described<F>(F);
    impl<F: Fn() -> String> Display for Described<F> {
        fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
            formatter.write_str(&self.0())
        }
    }
    Described(text)
}

/// Lets time pass in which something must *not* happen, or a fault must last, so that there is no event to
/// wait for. Whoever calls it may only assert what is true however slow the machine was meanwhile. `purpose`
/// says what the time is for.
pub(crate) fn let_pass(time: Duration, purpose: &str) {
    assert!(!purpose.is_empty());
    thread::sleep(time);
}

/// The rhythm of a sender or of a series of actions.
#[derive(Debug)]
pub(crate) struct Pace {
    period: Duration,
    next: Instant,
}

impl Pace {
    /// Creates a rhythm whose first beat is now.
    pub(crate) fn every(period: Duration) -> Self {
        Self { period, next: Instant::now() }
    }

    /// Waits for the next beat. After a standstill of the machine it continues from now on, without making up
    /// for beats that were missed.
    pub(crate) fn wait(&mut self) {
        self.next = (self.next + self.period).max(Instant::now());
        thread::sleep(self.next.saturating_duration_since(Instant::now()));
    }
}

/// A thread beside the tested program that only sleeps. How late it wakes up tells what the machine takes
/// from everybody, so that a time of the program is compared with it, and not with a limit that a busy
/// machine exceeds.
pub(crate) struct Bystander {
    /// The thread ends when this is dropped.
    is_wanted: Arc<()>,
    thread: JoinHandle<Lateness>,
    begun: Instant,
}

/// How late a [`Bystander`] was.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Lateness {
    /// The longest single delay.
    pub(crate) worst: Duration,
    /// The sum of all delays.
    pub(crate) total: Duration,
}

impl Bystander {
    /// The time that the thread means to sleep each time.
    const STEP: Duration = Duration::from_millis(5);

    /// Starts the thread.
    pub(crate) fn start() -> Self {
        let (is_wanted, begun) = (Arc::new(()), Instant::now());
        let wanted = Arc::downgrade(&is_wanted);
        let thread = thread::spawn(move || {
            let (mut lateness, mut last) = (Lateness::default(), begun);
            loop {
                let is_over = wanted.strong_count() == 0;
                // The first delay is the one of the thread's start.
                let now = Instant::now();
                let late = (now - last).saturating_sub(Self::STEP);
                lateness = Lateness { worst: lateness.worst.max(late), total: lateness.total + late };
                if is_over {
                    return lateness;
                }
                last = now;
                thread::sleep(Self::STEP);
            }
        });
        Self { is_wanted, thread, begun }
    }

    /// Ends the thread, and returns how late it was.
    pub(crate) fn finish(self) -> Lateness {
        drop(self.is_wanted);
        self.thread.join().unwrap()
    }

    /// Ends the thread, and asserts that what was done since its start took no longer than `limit`, beside
    /// what the machine took from everybody. Returns the time.
    pub(crate) fn assert_in_time(self, what: impl Display, limit: Duration) -> Duration {
        let took = self.begun.elapsed();
        let lateness = self.finish();
        lateness.assert_span(what, took, limit);
        took
    }
}

impl Lateness {
    /// Asserts that work which began and ended beside the bystander took no longer than `limit`. Work needs
    /// the processor all the time where a bystander needs it for moments, so that all its delays count,
    /// several times.
    pub(crate) fn assert_span(self, what: impl Display, took: Duration, limit: Duration) {
        let allowed = limit + 10 * self.worst + 4 * self.total;
        assert!(
            took <= allowed,
            "{what} took {took:?}, more than {limit:?}, beside a sleeping thread with {self:?}"
        );
    }

    /// Asserts that the longest gap in a series was no longer than `limit`. Only the bystander's worst delay
    /// counts here, so that a single standstill of the program is noticed in a long series.
    pub(crate) fn assert_gap(self, what: impl Display, gap: Duration, limit: Duration) {
        let allowed = limit + 10 * self.worst;
        assert!(
            gap <= allowed,
            "{what}: a gap of {gap:?}, more than {limit:?}, beside a sleeping thread with {self:?}"
        );
    }
}
