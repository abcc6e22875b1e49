//! Times at which the whole computer stood still, which are nobody's fault.

use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::support::vcan::wall;

const STEP: Duration = Duration::from_millis(2);

/// When it stood still and for how long, as a thread sees it that is preferred to all others where the system lets it.
pub(super) struct Stalls {
    seen: Arc<Mutex<Vec<(Duration, Duration)>>>,
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Stalls {
    /// Looks from now on.
    pub(super) fn watch() -> Self {
        let (seen, over) = (Arc::<Mutex<Vec<_>>>::default(), Arc::<AtomicBool>::default());
        let (noted, is_over) = (Arc::clone(&seen), Arc::clone(&over));
        let thread = std::thread::spawn(move || {
            let own = rustix::thread::gettid().as_raw_nonzero().to_string();
            let preferred = Command::new("chrt").args(["-f", "-p", "50", &own]).status();
            println!("the watching thread is preferred: {}", preferred.is_ok_and(|status| status.success()));
            while !is_over.load(Ordering::Relaxed) {
                let before = Instant::now();
                std::thread::sleep(STEP);
                let late = before.elapsed().saturating_sub(STEP);
                if late > STEP {
                    let now = Duration::from_nanos(wall().cast_unsigned());
                    noted.lock().unwrap().push((now.saturating_sub(late), now));
                }
            }
        });
        Self { seen, over, thread: Some(thread) }
    }

    /// How long it stood still between two times of day.
    pub(super) fn between(&self, from: Duration, to: Duration) -> Duration {
        let seen = self.seen.lock().unwrap();
        let common = |(begin, end): &(Duration, Duration)| to.min(*end).saturating_sub(from.max(*begin));
        seen.iter().map(common).sum()
    }
}

impl Drop for Stalls {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        let _ended = self.thread.take().map(JoinHandle::join);
    }
}
