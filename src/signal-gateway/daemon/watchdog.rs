//! The service manager's watchdog.

use std::future::pending;
use std::time::Duration;

use tokio::time::{Interval, MissedTickBehavior, interval};

/// The times at which the service manager expects a sign of life, in real time.
pub(super) struct Watchdog(Option<Interval>);

impl Watchdog {
    /// Creates the timer. Must be called within a runtime.
    pub(super) fn new(period: Option<Duration>) -> Self {
        Self(period.filter(|period| !period.is_zero()).map(|period| {
            let mut ping_interval = interval(period);
            ping_interval.set_missed_tick_behavior(MissedTickBehavior::Delay);
            ping_interval
        }))
    }

    pub(super) async fn ping_due(&mut self) {
        match &mut self.0 {
            Some(ping_interval) => drop(ping_interval.tick().await),
            None => pending().await,
        }
    }
}
