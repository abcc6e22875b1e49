//! Service duties of the process: service manager, signals, and clients.

use std::io;
use std::time::{Duration, Instant};

use tokio::time::{Interval, MissedTickBehavior, interval};

use super::signals::{ReloadSignal, StopSignals};
use super::watching::Clients;
use crate::io::optional_future::or_never;
use crate::io::precise_timer::PreciseTimer;
use crate::io::ros::inbox::Arrival;
use crate::io::systemd::Supervisor;
use crate::process_status::snapshot::Snapshot;
use crate::report::gateway_view::GatewayView;

/// Minimum interval between two status lines for the service manager.
const LINE_INTERVAL: Duration = Duration::from_secs(1);

/// Signals, service manager and clients of the process.
pub(super) struct Service {
    stop: StopSignals,
    pub(super) reload: ReloadSignal,
    pub(super) supervisor: Supervisor,
    ping_interval: Option<Interval>,
    clients: Clients,
    /// Last status line for the service manager.
    line: String,
    next_line: Instant,
}

/// Request to the process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Woken {
    Stop,
    Reload,
    /// Take a snapshot for a client, see [`Service::is_due`].
    Show,
}

/// Reason for the end of a wait.
pub(super) enum Waited {
    Woken(Woken),
    Received(Arrival),
    Due,
}

impl Service {
    pub(super) fn new(
        stop: StopSignals,
        reload: ReloadSignal,
        supervisor: Supervisor,
        clients: Clients,
    ) -> Self {
        let period = supervisor.watchdog_period.filter(|period| !period.is_zero());
        let (line, next_line) = (String::new(), Instant::now());
        let ping_interval = period.map(ping_interval);
        Self { stop, reload, supervisor, ping_interval, clients, line, next_line }
    }

    /// Waits for a request, and feeds the watchdog until then. Cancel safe.
    pub(super) async fn woken(&mut self) -> Woken {
        loop {
            tokio::select! {
                biased;
                () = self.stop.requested() => return Woken::Stop,
                _ = or_never(self.ping_interval.as_mut().map(Interval::tick)) => self.supervisor.feed_watchdog(),
                () = self.reload.requested() => return Woken::Reload,
                () = self.clients.feed.due() => return Woken::Show,
            }
        }
    }

    /// Waits until `wake`, a request or a sample, and feeds the watchdog until then. Fails if the timer does.
    pub(super) async fn wait_until(
        &mut self,
        wake: Instant,
        timer: &mut PreciseTimer,
        received: impl Future<Output = Arrival>,
    ) -> io::Result<Waited> {
        // Signals and timers are only polled here, even if `wake` has passed.
        tokio::task::yield_now().await;
        tokio::select! {
            biased;
            woken = self.woken() => Ok(Waited::Woken(woken)),
            arrival = received => Ok(Waited::Received(arrival)),
            due = timer.sleep_until(wake) => due.map(|()| Waited::Due),
        }
    }

    /// Announces that start-up or a reload is done, with a status line.
    pub(super) fn ready(&mut self, snapshot: &Snapshot) {
        self.line = GatewayView::of(snapshot).headline();
        self.next_line = Instant::now() + LINE_INTERVAL;
        self.supervisor.ready(&self.line);
    }

    /// Returns true if a snapshot is to be taken now, for clients or for the status line.
    pub(super) fn is_due(&self) -> bool {
        self.is_line_due() || self.clients.feed.is_due()
    }

    /// Passes a snapshot to the service manager and the clients, if it is due.
    pub(super) fn show(&mut self, snapshot: &Snapshot) {
        if self.is_line_due() {
            self.next_line = Instant::now() + LINE_INTERVAL;
            let line = GatewayView::of(snapshot).headline();
            if line != self.line {
                self.supervisor.status(&line);
                self.line = line;
            }
        }
        if self.clients.feed.is_due() {
            self.clients.feed.hand_out(snapshot.clone());
        }
    }

    fn is_line_due(&self) -> bool {
        self.supervisor.is_present() && Instant::now() >= self.next_line
    }
}

/// Creates the timer for signs of life to the service manager, in real time. Must be called within a runtime.
fn ping_interval(period: Duration) -> Interval {
    let mut ping_interval = interval(period);
    ping_interval.set_missed_tick_behavior(MissedTickBehavior::Delay);
    ping_interval
}
