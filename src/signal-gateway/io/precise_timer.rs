//! A timer as precise as the kernel's. The runtime's timer has a resolution of a millisecond and is up to 2
//! ms late.

use std::io;
use std::os::fd::OwnedFd;
use std::time::Instant;

use rustix::time::{
    Itimerspec, TimerfdClockId, TimerfdFlags, TimerfdTimerFlags, Timespec, timerfd_create, timerfd_settime,
};
use tokio::io::unix::AsyncFd;
use tokio::io::{Interest, Ready};

/// A timer of the kernel.
#[derive(Debug)]
pub struct PreciseTimer(AsyncFd<OwnedFd>);

impl PreciseTimer {
    /// Creates a timer that is not set. Must be called within a runtime. Fails e.g. if there are no file
    /// descriptors left.
    #[allow(unsafe_code)]
    pub fn new() -> io::Result<Self> {
        let flags = TimerfdFlags::NONBLOCK | TimerfdFlags::CLOEXEC;
        let timer = timerfd_create(TimerfdClockId::Monotonic, flags)?;
        // SAFETY: the timer owns its descriptor and never replaces it.
        Ok(Self(unsafe { AsyncFd::register_with_interest(timer, Interest::READABLE)? }))
    }

    /// Sleeps until `at`; returns at once if that time has passed. Cancel safe.
    pub async fn sleep_until(&mut self, at: Instant) -> io::Result<()> {
        let ahead = at.saturating_duration_since(Instant::now());
        if ahead.is_zero() {
            return Ok(());
        }
        let it_value = Timespec::try_from(ahead).map_err(io::Error::other)?;
        let once = Itimerspec { it_interval: Timespec::default(), it_value };
        timerfd_settime(&self.0, TimerfdTimerFlags::empty(), &once)?;
        loop {
            let mut ready = self.0.readable().await?;
            // It may still be ready from an earlier, cancelled sleep.
            ready.clear_ready_matching(Ready::READABLE);
            if Instant::now() >= at {
                return Ok(());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use rustix::time::timerfd_gettime;
    use tokio::task::yield_now;

    use super::*;
    use crate::waiting::let_pass;

    /// Begins a sleep and cancels it.
    async fn give_up(timer: &mut PreciseTimer, at: Instant) {
        tokio::select! {
            biased;
            slept = timer.sleep_until(at) => slept.unwrap(),
            () = yield_now() => {}
        }
    }

    #[tokio::test]
    async fn a_sleep_ends_at_its_time_also_after_one_that_was_given_up() {
        let mut timer = PreciseTimer::new().unwrap();
        timer.sleep_until(Instant::now()).await.unwrap();
        for _ in 0..3 {
            let pause = Duration::from_millis(20);
            give_up(&mut timer, Instant::now() + pause).await;
            let_pass(pause, "the time of the sleep that was given up is over");
            yield_now().await;
            let at = Instant::now() + Duration::from_millis(5);
            timer.sleep_until(at).await.unwrap();
            assert!(Instant::now() >= at);
        }
    }

    /// The runtime's timer rounds up to whole milliseconds.
    #[tokio::test]
    async fn kernel_is_given_the_time_as_it_is() {
        let mut timer = PreciseTimer::new().unwrap();
        let begun = Instant::now();
        let at = begun + Duration::from_secs(3600) + Duration::from_micros(500);
        give_up(&mut timer, at).await;
        let left = Duration::try_from(timerfd_gettime(&timer.0).unwrap().it_value).unwrap();
        let looked = Instant::now();
        assert!((at - looked..=at - begun).contains(&left), "{left:?}, {:?} after the start", looked - begun);
    }
}
