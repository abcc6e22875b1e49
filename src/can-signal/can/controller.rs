//! State machine of the CAN controller of a bus, fed by error frames and by the kernel.
//!
//! Error frames arrive in order with data frames, but not every driver sends one on the return to
//! error-active. The kernel always knows the state, but is polled only occasionally. The latest report
//! counts.

use std::fmt;
use std::time::Duration;

use crate::can::error_frame::{ControllerState, ErrorCounters, ErrorFrame};
use gateway_base::time::{MonoTime, deadline_after};

/// Minimum time for which a state is shown unless a worse one follows. A flapping controller is thus reported
/// once, and a bus-off of a few milliseconds is not missed.
pub const HOLD: Duration = Duration::from_secs(1);

/// State of a controller as the kernel reports it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ControllerReport {
    /// State of the controller; never [`ControllerState::Restarted`], which the kernel calls error-active.
    pub state: ControllerState,
    /// Error counters; `None` when the driver cannot read them.
    pub counters: Option<ErrorCounters>,
    /// Time from bus-off to an automatic restart in ms, 0 = manual restart; `None` = unknown.
    pub restart_ms: Option<u32>,
}

impl fmt::Display for ControllerReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.state)?;
        if let Some(ErrorCounters { tx, rx }) =
            self.counters.filter(|counters| counters.tx > 0 || counters.rx > 0)
        {
            write!(f, " (tx {tx}, rx {rx})")?;
        }
        match (self.state, self.restart_ms) {
            (ControllerState::BusOff, Some(0)) => f.write_str(", needs a manual restart"),
            (ControllerState::BusOff, Some(ms)) => write!(f, ", restarts by itself after {ms} ms"),
            _ => Ok(()),
        }
    }
}

/// State, error counters and history of one controller.
#[derive(Debug, Clone, Copy, Default)]
pub struct Controller {
    /// Current state and when it was entered; `None` until it has been reported.
    state: Option<(ControllerState, MonoTime)>,
    /// The worst recent state and when it was last entered.
    worst_recent: Option<(ControllerState, MonoTime)>,
    /// True if the kernel reports states; its report rather than a frame then ends a bus-off.
    kernel_reports: bool,
    /// Error counters of the last report; `None` when the report had none.
    pub counters: Option<ErrorCounters>,
    /// Time from bus-off to an automatic restart in ms, 0 = manual restart; `None` = unknown.
    pub restart_ms: Option<u32>,
    /// Number of times the controller went bus-off since start.
    pub bus_offs: u64,
    /// The last error frame other than a pure recovery, with its receive time.
    pub last_error: Option<(ErrorFrame, MonoTime)>,
}

impl Controller {
    /// Records an error frame.
    pub fn error_frame(&mut self, error: ErrorFrame, now: MonoTime) {
        if !error.is_recovery() {
            self.last_error = Some((error, now));
        }
        match error.state() {
            Some(state) => self.enter(state, error.counters(), now),
            None => self.counters = error.counters().or(self.counters),
        }
    }

    /// Records a report of the kernel.
    pub fn report(&mut self, report: ControllerReport, now: MonoTime) {
        self.kernel_reports = true;
        self.restart_ms = report.restart_ms.or(self.restart_ms);
        self.enter(report.state, report.counters, now);
    }

    /// Records a data frame, which ends a restart. If the kernel reports no states, as in a recording, the
    /// frame also ends a bus-off.
    pub fn frame_arrived(&mut self, now: MonoTime) {
        match self.state() {
            Some(ControllerState::Restarted) => self.enter(ControllerState::ErrorActive, self.counters, now),
            Some(ControllerState::BusOff) if !self.kernel_reports => {
                self.enter(ControllerState::ErrorActive, None, now);
            }
            _ => {}
        }
    }

    /// Resets the state after the link was lost, but keeps the counts and the last error.
    pub fn forget(&mut self) {
        let Self { bus_offs, last_error, .. } = *self;
        *self = Self { bus_offs, last_error, ..Self::default() };
    }

    /// Returns the last reported state; `None` without a report, as with a virtual interface.
    pub fn state(&self) -> Option<ControllerState> {
        self.state.map(|(state, _)| state)
    }

    /// Returns the time in the current state; `None` without a report.
    pub fn time_in_state(&self, now: MonoTime) -> Option<Duration> {
        self.state.map(|(_, since)| now.since(since))
    }

    /// Returns the state to show: the last reported state, or a worse state within [`HOLD`].
    pub fn shown(&self, now: MonoTime) -> Option<ControllerState> {
        let worst_recent = self.worst_recent.filter(|(_, at)| now.since(*at) <= HOLD).map(|(state, _)| state);
        if severity(worst_recent) > severity(self.state()) { worst_recent } else { self.state() }
    }

    /// Returns the next instant at which [`Self::shown`] changes without an event.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        let (worst_recent, at) = self.worst_recent?;
        (severity(Some(worst_recent)) > severity(self.state()))
            .then(|| deadline_after(at, HOLD))
            .filter(|end| *end > now)
    }

    fn enter(&mut self, state: ControllerState, counters: Option<ErrorCounters>, now: MonoTime) {
        let before = self.state();
        if before == Some(state) {
            self.counters = counters.or(self.counters);
            return;
        }
        if severity(Some(state)) >= severity(self.shown(now)) {
            self.worst_recent = Some((state, now));
        }
        self.bus_offs = self.bus_offs.saturating_add(u64::from(state == ControllerState::BusOff));
        self.state = Some((state, now));
        self.counters = counters; // the previous counters belong to another state
    }
}

/// Returns true if `state` is error-active or unknown.
pub fn is_sound(state: Option<ControllerState>) -> bool {
    severity(state) == 0
}

fn severity(state: Option<ControllerState>) -> u8 {
    match state {
        None | Some(ControllerState::ErrorActive) => 0,
        Some(ControllerState::Warning) => 1,
        Some(ControllerState::Restarted) => 2,
        Some(ControllerState::Passive) => 3,
        Some(ControllerState::Stopped) => 4,
        Some(ControllerState::BusOff) => 5,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use ControllerState::{BusOff, ErrorActive, Passive, Restarted, Stopped, Warning};

    fn at(millis: u64) -> MonoTime {
        MonoTime::from_millis(millis)
    }

    fn frame(class: u32, bits: u8) -> ErrorFrame {
        ErrorFrame::new(class, &[0, bits])
    }

    fn report(state: ControllerState) -> ControllerReport {
        ControllerReport { state, counters: None, restart_ms: Some(0) }
    }

    #[test]
    fn states_are_followed_down_to_bus_off_and_back() {
        let mut controller = Controller::default();
        assert_eq!((controller.state(), controller.time_in_state(at(0))), (None, None));
        for (ms, class, bits, state) in [
            (0, 0x204, 0x08, Warning),
            (2000, 0x204, 0x20, Passive),
            (4000, 0x40, 0, BusOff),
            (6000, 0x100, 0, Restarted),
        ] {
            controller.error_frame(frame(class, bits), at(ms));
            assert_eq!((controller.state(), controller.shown(at(ms + 1001))), (Some(state), Some(state)));
            assert_eq!(controller.time_in_state(at(ms + 500)), Some(Duration::from_millis(500)));
        }
        controller.frame_arrived(at(8000));
        assert_eq!((controller.shown(at(8000)), controller.bus_offs), (Some(ErrorActive), 1));
    }

    #[test]
    fn short_bus_off_is_shown_for_hold_and_counted() {
        let mut controller = Controller::default();
        controller.error_frame(frame(0x40, 0), at(100));
        controller.error_frame(frame(0x100, 0), at(103));
        controller.frame_arrived(at(104));
        assert_eq!((controller.state(), controller.shown(at(1100))), (Some(ErrorActive), Some(BusOff)));
        let deadline = controller.next_deadline(at(104)).unwrap();
        assert_eq!(controller.shown(deadline), Some(ErrorActive));
        assert_eq!((controller.next_deadline(deadline), controller.bus_offs), (None, 1));
    }

    #[test]
    fn kernel_report_ends_passive_and_bus_off() {
        let mut controller = Controller::default();
        controller.error_frame(frame(0x204, 0x20), at(0));
        controller.report(report(ErrorActive), at(5000));
        assert_eq!(controller.shown(at(5000)), Some(ErrorActive));
        controller.report(report(BusOff), at(6000));
        controller.frame_arrived(at(9000));
        assert_eq!(controller.state(), Some(BusOff), "a frame from before the bus-off may still be queued");
        controller.report(report(ErrorActive), at(9000));
        assert_eq!(controller.state(), Some(ErrorActive));
    }

    #[test]
    fn frame_ends_bus_off_in_recording() {
        let mut controller = Controller::default();
        controller.error_frame(frame(0x40, 0), at(0));
        controller.frame_arrived(at(3000));
        assert_eq!(controller.shown(at(3000)), Some(ErrorActive));
    }

    #[test]
    fn counters_belong_to_reported_state() {
        let mut controller = Controller::default();
        controller.error_frame(ErrorFrame::new(0x204, &[0, 8, 0, 0, 0, 0, 96, 3]), at(0));
        assert_eq!(controller.counters, Some(ErrorCounters { tx: 96, rx: 3 }));
        controller.report(report(Warning), at(1));
        assert_eq!(controller.counters, Some(ErrorCounters { tx: 96, rx: 3 }), "nothing newer was reported");
        controller.report(report(ErrorActive), at(2));
        assert_eq!(controller.counters, None);
        let (error, when) = controller.last_error.unwrap();
        assert_eq!((error.to_string().as_str(), when), ("controller (tx warning), tx 96, rx 3", at(0)));
    }

    #[test]
    fn report_is_a_text_with_counters_and_the_way_back_from_bus_off() {
        let text = |state, counters, restart_ms| ControllerReport { state, counters, restart_ms }.to_string();
        let counters = Some(ErrorCounters { tx: 130, rx: 12 });
        assert_eq!(text(ErrorActive, Some(ErrorCounters { tx: 0, rx: 0 }), None), "error-active");
        assert_eq!(text(Passive, counters, Some(0)), "error-passive (tx 130, rx 12)");
        assert_eq!(text(BusOff, None, Some(0)), "bus-off, needs a manual restart");
        assert_eq!(text(BusOff, None, Some(100)), "bus-off, restarts by itself after 100 ms");
    }

    #[test]
    fn lost_link_resets_all_but_counts() {
        let mut controller = Controller::default();
        controller.report(report(BusOff), at(0));
        controller.forget();
        assert_eq!((controller.state(), controller.shown(at(0)), controller.restart_ms), (None, None, None));
        assert_eq!(controller.bus_offs, 1);
    }

    #[derive(Debug, Clone, Copy)]
    enum Event {
        Error(u32, [u8; 8]),
        Report(ControllerReport),
        Frame,
        Lost,
    }

    fn any_event() -> impl Strategy<Value = Event> {
        let class = prop_oneof![Just(0x4), Just(0x204), Just(0x40), Just(0x100), Just(0x88), any::<u32>()];
        let state = prop::sample::select(vec![ErrorActive, Warning, Passive, BusOff, Stopped]);
        let counters = prop::option::of(any::<(u16, u16)>().prop_map(|(tx, rx)| ErrorCounters { tx, rx }));
        let report = (state, counters, any::<Option<u32>>())
            .prop_map(|(state, counters, restart_ms)| ControllerReport { state, counters, restart_ms });
        prop_oneof![
            4 => (class, any::<[u8; 8]>()).prop_map(|(class, data)| Event::Error(class, data)),
            2 => report.prop_map(Event::Report),
            2 => Just(Event::Frame),
            1 => Just(Event::Lost),
        ]
    }

    /// Returns the state and number of bus-offs after a history, without any intermediate state.
    fn reference(history: &[(u64, Event)]) -> (Option<ControllerState>, u64) {
        let (mut state, mut bus_offs, mut reported) = (None, 0, false);
        for (_, event) in history {
            let next = match *event {
                Event::Error(class, _) if class & 0x40 != 0 => Some(BusOff),
                Event::Error(class, _) if class & 0x100 != 0 => Some(Restarted),
                Event::Error(class, [_, bits, ..]) if class & 0x4 != 0 => match bits {
                    bits if bits & 0x30 != 0 => Some(Passive),
                    bits if bits & 0x0C != 0 => Some(Warning),
                    bits if bits & 0x40 != 0 => Some(ErrorActive),
                    _ => state,
                },
                Event::Report(report) => Some(report.state),
                Event::Frame if state == Some(Restarted) => Some(ErrorActive),
                Event::Frame if state == Some(BusOff) && !reported => Some(ErrorActive),
                Event::Error(..) | Event::Frame => state,
                Event::Lost => None,
            };
            reported = match event {
                Event::Report(_) => true,
                Event::Lost => false,
                Event::Error(..) | Event::Frame => reported,
            };
            bus_offs += u64::from(next == Some(BusOff) && state != next);
            state = next;
        }
        (state, bus_offs)
    }

    proptest! {
        #[test]
        fn any_history_agrees_with_reference_and_recovers(
            history in prop::collection::vec((0..1_500_u64, any_event()), 0..40),
        ) {
            let mut controller = Controller::default();
            let mut now = 0;
            for (index, (pause, event)) in history.iter().enumerate() {
                // The shown state changes at the deadline and not before.
                let deadline = controller.next_deadline(at(now));
                let shown = controller.shown(at(now));
                now += pause;
                match deadline {
                    Some(end) if end <= at(now) => prop_assert_ne!(controller.shown(end), shown),
                    _ => prop_assert_eq!(controller.shown(at(now)), shown),
                }
                match *event {
                    Event::Error(class, data) => controller.error_frame(ErrorFrame::new(class, &data), at(now)),
                    Event::Report(report) => controller.report(report, at(now)),
                    Event::Frame => controller.frame_arrived(at(now)),
                    Event::Lost => controller.forget(),
                }
                prop_assert_eq!((controller.state(), controller.bus_offs), reference(&history[..=index]));
                prop_assert!(severity(controller.shown(at(now))) >= severity(controller.state()));
                prop_assert!(controller.time_in_state(at(now)).is_none_or(|time| time <= Duration::from_millis(now)));
                prop_assert!(controller.last_error.is_none_or(|(error, _)| !error.to_string().is_empty()));
            }
            controller.report(report(ErrorActive), at(now));
            let end = controller.next_deadline(at(now)).unwrap_or(at(now));
            prop_assert_eq!((controller.state(), controller.shown(end)), (Some(ErrorActive), Some(ErrorActive)));
        }
    }
}
