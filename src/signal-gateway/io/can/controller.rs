//! Queries the kernel's state of a CAN controller: bit rate, state, restart (`IFLA_CAN_*` by netlink).

use std::io;
use std::time::Duration;

use socketcan::CanInterface;
use socketcan::nl::{CanState, InterfaceCanParams};
use tokio::time::{Instant, sleep_until};

use super::link;
use crate::io::optional_future::or_never;
use can_signal::can::{ControllerReport, ControllerState, ErrorCounters};

const POLL_INTERVAL: Duration = Duration::from_secs(1);

/// Shortest interval between queries, regardless of the number of error frames.
const MIN_INTERVAL: Duration = Duration::from_millis(100);

pub(super) struct ControllerWatch {
    interface: String,
    last_query: Instant,
    /// `None` for an interface without a controller.
    next_query: Option<Instant>,
}

impl ControllerWatch {
    /// Starts watching; the first query is due at once.
    pub(super) fn new(interface: &str) -> Self {
        let now = Instant::now();
        Self { interface: interface.to_owned(), last_query: now, next_query: Some(now) }
    }

    /// Waits until the next query is due.
    pub(super) async fn due(&self) {
        or_never(self.next_query.map(sleep_until)).await;
    }

    /// Makes the next query due soon. Call it when something has happened.
    pub(super) fn hurry(&mut self) {
        let soon = self.last_query + MIN_INTERVAL;
        self.next_query = self.next_query.map(|at| at.min(soon));
    }

    /// Queries the controller; returns `None` without a controller, or if the query fails.
    pub(super) fn look(&mut self) -> Option<ControllerReport> {
        self.last_query = Instant::now();
        let params = params(&self.interface);
        let has_none = params.as_ref().is_ok_and(|params| params.state.is_none());
        self.next_query = (!has_none).then(|| self.last_query + POLL_INTERVAL);
        params.ok().as_ref().and_then(report)
    }
}

/// Returns true if there is a controller below an interface, and so perhaps a real vehicle; virtual
/// interfaces have none. Fails if the interface does not exist, is not a CAN interface, or cannot be queried.
pub fn has_controller(interface: &str) -> io::Result<bool> {
    let params = params(interface)?;
    let none_of_can = || io::Error::new(io::ErrorKind::InvalidInput, "not a CAN interface");
    link::is_can(interface).then_some(params.state.is_some()).ok_or_else(none_of_can)
}

/// Describes bit rate, controller state and automatic restart in one line, as far as the kernel reports them.
pub(super) fn describe(interface: &str) -> String {
    params(interface).map_or_else(|error| format!("unknown: {error}"), |params| text(&params))
}

/// Returns the nominal bit rate of an interface, bit/s; `None` without a controller or interface.
pub(super) fn bitrate(interface: &str) -> Option<u32> {
    params(interface).ok()?.bit_timing.map(|timing| timing.bitrate)
}

fn params(interface: &str) -> io::Result<InterfaceCanParams> {
    let details = CanInterface::open(interface).and_then(|interface| interface.details());
    details.map(|details| details.can).map_err(io::Error::other)
}

pub(super) fn report(params: &InterfaceCanParams) -> Option<ControllerReport> {
    let state = match params.state? {
        CanState::ErrorActive => ControllerState::ErrorActive,
        CanState::ErrorWarning => ControllerState::Warning,
        CanState::ErrorPassive => ControllerState::Passive,
        CanState::BusOff => ControllerState::BusOff,
        CanState::Stopped | CanState::Sleeping => ControllerState::Stopped,
    };
    let counters = params.berr_counter.map(|counted| ErrorCounters { tx: counted.txerr, rx: counted.rxerr });
    Some(ControllerReport { state, counters, restart_ms: params.restart_ms })
}

fn text(params: &InterfaceCanParams) -> String {
    let restart = params.restart_ms.map(|ms| match ms {
        0 => "no automatic restart after bus-off".to_owned(),
        ms => format!("restart {ms} ms after bus-off"),
    });
    let parts = [
        params.bit_timing.map(|timing| format!("{} bit/s", timing.bitrate)),
        params.data_bit_timing.map(|timing| format!("data {} bit/s", timing.bitrate)),
        params.state.map(|state| format!("{state:?}")),
        restart,
    ];
    let parts: Vec<_> = parts.into_iter().flatten().collect();
    if parts.is_empty() { "no controller".to_owned() } else { parts.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_controller_is_described_in_one_line() {
        let params = InterfaceCanParams {
            state: Some(CanState::ErrorPassive),
            restart_ms: Some(0),
            ..InterfaceCanParams::default()
        };
        assert_eq!(text(&params), "ErrorPassive, no automatic restart after bus-off");
        assert_eq!(text(&InterfaceCanParams::default()), "no controller");
    }

    #[test]
    fn a_missing_interface_is_described_without_failure() {
        assert!(describe("nosuchcan7").starts_with("unknown: "));
    }

    #[test]
    fn state_counters_and_restart_are_reported_and_a_virtual_interface_reports_nothing() {
        let params = InterfaceCanParams {
            state: Some(CanState::BusOff),
            restart_ms: Some(100),
            berr_counter: Some(socketcan::nl::CanBerrCounter { txerr: 256, rxerr: 3 }),
            ..InterfaceCanParams::default()
        };
        let counters = Some(ErrorCounters { tx: 256, rx: 3 });
        let expected = ControllerReport { state: ControllerState::BusOff, counters, restart_ms: Some(100) };
        assert_eq!(report(&params), Some(expected));
        assert_eq!(report(&InterfaceCanParams::default()), None);
    }

    #[tokio::test(start_paused = true)]
    async fn the_kernel_is_queried_each_second_and_soon_but_not_at_once_when_something_happens() {
        let mut watch = ControllerWatch::new("nosuchcan7");
        let start = Instant::now();
        watch.due().await;
        assert_eq!((watch.look(), start.elapsed()), (None, Duration::ZERO));
        watch.due().await;
        watch.look();
        assert_eq!(start.elapsed(), POLL_INTERVAL);
        for _error_frame in 0..1000 {
            watch.hurry();
        }
        watch.due().await;
        assert_eq!(start.elapsed(), POLL_INTERVAL + MIN_INTERVAL);
        watch.look();
        watch.due().await;
        assert_eq!(start.elapsed(), POLL_INTERVAL * 2 + MIN_INTERVAL);
    }
}
