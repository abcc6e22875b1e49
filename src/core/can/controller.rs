//! The CAN controller below a bus: one state machine, fed by error frames and by the kernel.
//!
//! Error frames come in order with data frames, but not every driver sends one on the way back to
//! error-active. The kernel always knows, but is asked only now and then. The last word counts.

use std::time::Duration;

use crate::core::can::error_frame::{ControllerState, ErrorCounters, ErrorFrame};
use crate::core::time::{MonoTime, deadline_after};

/// How long a state is shown at least, unless a worse one follows: flapping is told once, and a
/// bus-off of a few milliseconds is not overlooked.
pub const HOLD: Duration = Duration::from_secs(1);

/// What the kernel says of a controller when asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ControllerReport {
    /// Its state; never [`ControllerState::Restarted`], which the kernel calls error-active.
    pub state: ControllerState,
    /// Its error counters, if the driver can read them.
    pub counters: Option<ErrorCounters>,
    /// Milliseconds from bus-off to an automatic restart; 0: none. `None`: not told.
    pub restart_ms: Option<u32>,
}

/// What is known of one controller.
#[derive(Debug, Clone, Copy, Default)]
pub struct Controller {
    /// The state and since when; `None` until something was told.
    state: Option<(ControllerState, MonoTime)>,
    /// The worst state of late and when it was told last.
    held: Option<(ControllerState, MonoTime)>,
    /// The kernel was asked and answered: then its word, not a frame, ends a bus-off.
    kernel_tells: bool,
    /// As told last.
    pub counters: Option<ErrorCounters>,
    /// Milliseconds from bus-off to an automatic restart; 0: none. `None`: not told.
    pub restart_ms: Option<u32>,
    /// Times it went bus-off since start.
    pub bus_offs: u64,
    /// The last error frame that announced more than a recovery.
    pub last_error: Option<(ErrorFrame, MonoTime)>,
}

impl Controller {
    /// Takes an error frame.
    pub fn error_frame(&mut self, error: ErrorFrame, now: MonoTime) {
        let news = error.state();
        let recovery = matches!(news, Some(ControllerState::ErrorActive | ControllerState::Restarted));
        if !(recovery && error.is_state_alone()) {
            self.last_error = Some((error, now));
        }
        match news {
            Some(state) => self.enter(state, error.counters(), now),
            None => self.counters = error.counters().or(self.counters),
        }
    }

    /// Takes the kernel's word.
    pub fn report(&mut self, report: ControllerReport, now: MonoTime) {
        self.kernel_tells = true;
        self.restart_ms = report.restart_ms.or(self.restart_ms);
        self.enter(report.state, report.counters, now);
    }

    /// A data frame arrived: a restart has succeeded. Where the kernel is not asked, as in a
    /// recording, it also proves that a bus-off is over.
    pub fn frame_arrived(&mut self, now: MonoTime) {
        match self.state() {
            Some(ControllerState::Restarted) => self.enter(ControllerState::ErrorActive, self.counters, now),
            Some(ControllerState::BusOff) if !self.kernel_tells => {
                self.enter(ControllerState::ErrorActive, None, now);
            }
            _ => {}
        }
    }

    /// The link below is gone: nothing is known of the controller until it is told anew. What was
    /// counted stays.
    pub fn forget(&mut self) {
        let Self { bus_offs, last_error, .. } = *self;
        *self = Self { bus_offs, last_error, ..Self::default() };
    }

    /// The state as told last; `None` when nothing was told, as with a virtual interface.
    pub fn state(&self) -> Option<ControllerState> {
        self.state.map(|(state, _)| state)
    }

    /// How long it has been in that state.
    pub fn time_in_state(&self, now: MonoTime) -> Option<Duration> {
        self.state.map(|(_, since)| now.since(since))
    }

    /// The state to show: the last one, or a worse one within [`HOLD`].
    pub fn shown(&self, now: MonoTime) -> Option<ControllerState> {
        let held = self.held.filter(|(_, at)| now.since(*at) <= HOLD).map(|(state, _)| state);
        if severity(held) > severity(self.state()) { held } else { self.state() }
    }

    /// When the shown state changes with nothing happening.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        let (held, at) = self.held?;
        (severity(Some(held)) > severity(self.state()))
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
            self.held = Some((state, now));
        }
        self.bus_offs = self.bus_offs.saturating_add(u64::from(state == ControllerState::BusOff));
        self.state = Some((state, now));
        self.counters = counters; // those of another state say nothing of this one
    }
}

/// Whether a state, or knowing none, gives no reason to worry.
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

    fn told(state: ControllerState) -> ControllerReport {
        ControllerReport { state, counters: None, restart_ms: Some(0) }
    }

    #[test]
    fn the_way_down_and_back_is_followed_with_the_time_in_each_state() {
        let mut it = Controller::default();
        assert_eq!((it.state(), it.time_in_state(at(0))), (None, None));
        for (ms, class, bits, state) in [
            (0, 0x204, 0x08, Warning),
            (2000, 0x204, 0x20, Passive),
            (4000, 0x40, 0, BusOff),
            (6000, 0x100, 0, Restarted),
        ] {
            it.error_frame(frame(class, bits), at(ms));
            assert_eq!((it.state(), it.shown(at(ms + 1001))), (Some(state), Some(state)));
            assert_eq!(it.time_in_state(at(ms + 500)), Some(Duration::from_millis(500)));
        }
        it.frame_arrived(at(8000));
        assert_eq!((it.shown(at(8000)), it.bus_offs), (Some(ErrorActive), 1));
    }

    #[test]
    fn a_short_bus_off_is_shown_for_a_second_and_counted() {
        let mut it = Controller::default();
        it.error_frame(frame(0x40, 0), at(100));
        it.error_frame(frame(0x100, 0), at(103));
        it.frame_arrived(at(104));
        assert_eq!((it.state(), it.shown(at(1100))), (Some(ErrorActive), Some(BusOff)));
        let deadline = it.next_deadline(at(104)).unwrap();
        assert_eq!(it.shown(deadline), Some(ErrorActive));
        assert_eq!((it.next_deadline(deadline), it.bus_offs), (None, 1));
    }

    #[test]
    fn the_kernels_word_brings_back_what_no_error_frame_does() {
        let mut it = Controller::default();
        it.error_frame(frame(0x204, 0x20), at(0));
        it.report(told(ErrorActive), at(5000));
        assert_eq!(it.shown(at(5000)), Some(ErrorActive));
        it.report(told(BusOff), at(6000));
        it.frame_arrived(at(9000));
        assert_eq!(it.state(), Some(BusOff), "a frame from before the bus-off may still be queued");
        it.report(told(ErrorActive), at(9000));
        assert_eq!(it.state(), Some(ErrorActive));
    }

    #[test]
    fn in_a_recording_a_frame_ends_a_bus_off() {
        let mut it = Controller::default();
        it.error_frame(frame(0x40, 0), at(0));
        it.frame_arrived(at(3000));
        assert_eq!(it.shown(at(3000)), Some(ErrorActive));
    }

    #[test]
    fn counters_belong_to_the_state_they_were_told_in() {
        let mut it = Controller::default();
        it.error_frame(ErrorFrame::new(0x204, &[0, 8, 0, 0, 0, 0, 96, 3]), at(0));
        assert_eq!(it.counters, Some(ErrorCounters { tx: 96, rx: 3 }));
        it.report(told(Warning), at(1));
        assert_eq!(it.counters, Some(ErrorCounters { tx: 96, rx: 3 }), "nothing newer is told");
        it.report(told(ErrorActive), at(2));
        assert_eq!(it.counters, None);
        let (error, when) = it.last_error.unwrap();
        assert_eq!((error.to_string().as_str(), when), ("controller (tx warning), tx 96, rx 3", at(0)));
    }

    #[test]
    fn a_lost_link_leaves_only_what_was_counted() {
        let mut it = Controller::default();
        it.report(told(BusOff), at(0));
        it.forget();
        assert_eq!((it.state(), it.shown(at(0)), it.restart_ms), (None, None, None));
        assert_eq!(it.bus_offs, 1);
    }

    #[derive(Debug, Clone, Copy)]
    enum Event {
        Error(u32, [u8; 8]),
        Told(ControllerReport),
        Frame,
        Lost,
    }

    fn any_event() -> impl Strategy<Value = Event> {
        let class = prop_oneof![Just(0x4), Just(0x204), Just(0x40), Just(0x100), Just(0x88), any::<u32>()];
        let state = prop::sample::select(vec![ErrorActive, Warning, Passive, BusOff, Stopped]);
        let counters = prop::option::of(any::<(u16, u16)>().prop_map(|(tx, rx)| ErrorCounters { tx, rx }));
        let told = (state, counters, any::<Option<u32>>())
            .prop_map(|(state, counters, restart_ms)| ControllerReport { state, counters, restart_ms });
        prop_oneof![
            4 => (class, any::<[u8; 8]>()).prop_map(|(class, data)| Event::Error(class, data)),
            2 => told.prop_map(Event::Told),
            2 => Just(Event::Frame),
            1 => Just(Event::Lost),
        ]
    }

    /// The state after all of it, by looking at the whole past.
    fn reference(past: &[(u64, Event)]) -> (Option<ControllerState>, u64) {
        let (mut state, mut bus_offs, mut asked) = (None, 0, false);
        for (_, event) in past {
            let next = match *event {
                Event::Error(class, _) if class & 0x40 != 0 => Some(BusOff),
                Event::Error(class, _) if class & 0x100 != 0 => Some(Restarted),
                Event::Error(class, [_, bits, ..]) if class & 0x4 != 0 => match bits {
                    bits if bits & 0x30 != 0 => Some(Passive),
                    bits if bits & 0x0C != 0 => Some(Warning),
                    bits if bits & 0x40 != 0 => Some(ErrorActive),
                    _ => state,
                },
                Event::Told(report) => Some(report.state),
                Event::Frame if state == Some(Restarted) => Some(ErrorActive),
                Event::Frame if state == Some(BusOff) && !asked => Some(ErrorActive),
                Event::Error(..) | Event::Frame => state,
                Event::Lost => None,
            };
            asked = match event {
                Event::Told(_) => true,
                Event::Lost => false,
                Event::Error(..) | Event::Frame => asked,
            };
            bus_offs += u64::from(next == Some(BusOff) && state != next);
            state = next;
        }
        (state, bus_offs)
    }

    proptest! {
        #[test]
        fn any_story_is_followed_and_every_state_can_be_left(
            story in prop::collection::vec((0..1_500_u64, any_event()), 0..40),
        ) {
            let mut it = Controller::default();
            let mut now = 0;
            for (index, (pause, event)) in story.iter().enumerate() {
                // What is shown changes at the deadline, and not before.
                let deadline = it.next_deadline(at(now));
                let shown = it.shown(at(now));
                now += pause;
                match deadline {
                    Some(end) if end <= at(now) => prop_assert_ne!(it.shown(end), shown),
                    _ => prop_assert_eq!(it.shown(at(now)), shown),
                }
                match *event {
                    Event::Error(class, data) => it.error_frame(ErrorFrame::new(class, &data), at(now)),
                    Event::Told(report) => it.report(report, at(now)),
                    Event::Frame => it.frame_arrived(at(now)),
                    Event::Lost => it.forget(),
                }
                prop_assert_eq!((it.state(), it.bus_offs), reference(&story[..=index]));
                prop_assert!(severity(it.shown(at(now))) >= severity(it.state()));
                prop_assert!(it.time_in_state(at(now)).is_none_or(|time| time <= Duration::from_millis(now)));
                prop_assert!(it.last_error.is_none_or(|(error, _)| !error.to_string().is_empty()));
            }
            it.report(told(ErrorActive), at(now));
            let end = it.next_deadline(at(now)).unwrap_or(at(now));
            prop_assert_eq!((it.state(), it.shown(end)), (Some(ErrorActive), Some(ErrorActive)));
        }
    }
}
