//! A discovery as a state machine: frames and times in, requests to the driver and findings out.

use std::collections::VecDeque;

use super::capture::{Capture, MessageKey};
use super::findings::DiscoveryFindings;
use super::search::seen;
use super::session::{DriverRequest, Session, SessionSettings, SessionStep};
use super::timeline::{ActionTimeline, DriverAction};
use can_signal::can::{BusIndex, DriverMark, Frame};
use gateway_base::time::MonoTime;

/// An event for the driver.
#[derive(Debug, Clone)]
pub enum DiscoveryEvent {
    /// The driver is asked to do something.
    Request(DriverRequest),
    /// The messages that responded to the latest action, and the number of their bits.
    Seen {
        /// The action that has ended.
        action: DriverAction,
        /// Messages that responded, in ascending order.
        messages: Vec<MessageKey>,
        /// Number of bits that responded.
        bits: usize,
    },
    /// These actions are repeated, because their signals are not sure.
    Repeats(Vec<DriverAction>),
    /// The session has ended with these findings.
    Finished(Box<DiscoveryFindings>),
}

/// A session with a driver. Call [`Self::poll_event`] until it returns `None`, then again at
/// [`Self::next_deadline`].
#[derive(Debug, Clone)]
pub struct Discovery {
    session: Session,
    capture: Capture,
    marks: Vec<(MonoTime, DriverMark)>,
    events: VecDeque<DiscoveryEvent>,
    /// Number of requests whose responses were reported.
    reviewed: usize,
}

impl Discovery {
    /// Creates a session that begins with the first call of [`Self::poll_event`].
    pub fn new(settings: SessionSettings) -> Self {
        Self {
            session: Session::new(settings),
            capture: Capture::default(),
            marks: Vec::new(),
            events: VecDeque::new(),
            reviewed: 0,
        }
    }

    /// Adds a frame. Times must not run backwards.
    pub fn frame_arrived(&mut self, bus: BusIndex, frame: &Frame, now: MonoTime) {
        self.capture.add(bus, frame, now);
    }

    /// Returns the next event; `None` until [`Self::next_deadline`].
    pub fn poll_event(&mut self, now: MonoTime) -> Option<DiscoveryEvent> {
        if self.events.is_empty() {
            match self.session.poll(now)? {
                SessionStep::Request(request) => {
                    if request.mark != DriverMark::Off {
                        self.look_back(now);
                    }
                    self.marks.push((now, request.mark));
                    self.events.push_back(DiscoveryEvent::Request(request));
                }
                SessionStep::Evaluate => {
                    self.look_back(now);
                    self.evaluate(now);
                }
            }
        }
        self.events.pop_front()
    }

    /// Returns the time of the next event; `None` at the end.
    pub fn next_deadline(&self) -> Option<MonoTime> {
        if self.events.is_empty() { self.session.next_deadline() } else { Some(MonoTime::ZERO) }
    }

    /// Returns the frames so far.
    pub fn capture(&self) -> &Capture {
        &self.capture
    }

    /// Returns the number of requests so far, and this number plus the scheduled requests.
    pub fn progress(&self) -> (usize, usize) {
        self.session.progress()
    }

    /// Returns the requests so far, in a session that lasts until `now`.
    pub fn timeline(&self, now: MonoTime) -> ActionTimeline {
        let start = self.marks.first().map_or(now, |(start, _)| *start);
        ActionTimeline::new(&self.marks, start..now)
    }

    /// Reports the messages that responded to the ended action.
    fn look_back(&mut self, now: MonoTime) {
        let timeline = self.timeline(now);
        let Some(window) = timeline.windows.last().filter(|_| self.reviewed < timeline.windows.len()) else {
            return;
        };
        self.reviewed = timeline.windows.len();
        let (messages, bits) = seen(&self.capture, &timeline);
        self.events.push_back(DiscoveryEvent::Seen { action: window.action, messages, bits });
    }

    fn evaluate(&mut self, now: MonoTime) {
        let findings = DiscoveryFindings::new(&self.capture, &self.timeline(now));
        let repeats = self.session.evaluated(&findings.unsure(), now);
        self.events.push_back(if repeats.is_empty() {
            DiscoveryEvent::Finished(Box::new(findings))
        } else {
            DiscoveryEvent::Repeats(repeats)
        });
    }
}
