//! A discovery as a state machine: frames and times in, requests to the driver and findings out.

use std::collections::VecDeque;

use super::capture::{Capture, MessageKey};
use super::findings::Findings;
use super::search::seen;
use super::session::{Session, SessionSettings, Step};
use super::timeline::{Action, Timeline};
use crate::core::can::frame::Frame;
use crate::core::can::link::BusIndex;
use crate::core::can::mark::Mark;
use crate::core::time::MonoTime;

/// An event for the driver.
#[derive(Debug, Clone)]
pub enum DiscoveryEvent {
    /// Something is to be done from now on.
    Request {
        /// What to do.
        mark: Mark,
        /// The action that comes next, if it is known.
        next: Option<Action>,
        /// Time of the next event.
        until: MonoTime,
    },
    /// The messages that responded to the latest action, and the number of their bits.
    Seen {
        /// The action.
        action: Action,
        /// The messages, ascending.
        messages: Vec<MessageKey>,
        /// Number of bits.
        bits: usize,
    },
    /// These actions are to be repeated, since their signals are not sure.
    Repeats(Vec<Action>),
    /// The end.
    Finished(Box<Findings>),
}

/// A session with a driver. Call [`Self::poll_event`] until it gives nothing more, then again at
/// [`Self::next_deadline`].
#[derive(Debug, Clone)]
pub struct Discovery {
    session: Session,
    capture: Capture,
    marks: Vec<(MonoTime, Mark)>,
    events: VecDeque<DiscoveryEvent>,
    /// Number of requests whose responses were reported.
    reviewed: usize,
}

impl Discovery {
    /// A session that begins with the first call of [`Self::poll_event`].
    pub fn new(settings: SessionSettings) -> Self {
        Self {
            session: Session::new(settings),
            capture: Capture::default(),
            marks: Vec::new(),
            events: VecDeque::new(),
            reviewed: 0,
        }
    }

    /// Takes a frame. Times do not run backwards.
    pub fn frame_arrived(&mut self, bus: BusIndex, frame: &Frame, now: MonoTime) {
        self.capture.add(bus, frame, now);
    }

    /// The next event; `None` until [`Self::next_deadline`].
    pub fn poll_event(&mut self, now: MonoTime) -> Option<DiscoveryEvent> {
        if self.events.is_empty() {
            match self.session.poll(now)? {
                Step::Request { mark, next, until } => {
                    if mark != Mark::Off {
                        self.look_back(now);
                    }
                    self.marks.push((now, mark));
                    self.events.push_back(DiscoveryEvent::Request { mark, next, until });
                }
                Step::Evaluate => {
                    self.look_back(now);
                    self.evaluate(now);
                }
            }
        }
        self.events.pop_front()
    }

    /// Time of the next event; `None` at the end.
    pub fn next_deadline(&self) -> Option<MonoTime> {
        if self.events.is_empty() { self.session.next_deadline() } else { Some(MonoTime::ZERO) }
    }

    /// The frames so far.
    pub fn capture(&self) -> &Capture {
        &self.capture
    }

    /// Number of requests so far, and of those known to follow.
    pub fn progress(&self) -> (usize, usize) {
        self.session.progress()
    }

    /// The requests so far, in a session that lasts until `now`.
    fn timeline(&self, now: MonoTime) -> Timeline {
        let start = self.marks.first().map_or(now, |(start, _)| *start);
        Timeline::new(&self.marks, (start, now))
    }

    /// Reports what responded to the action that has ended.
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
        let findings = Findings::new(&self.capture, &self.timeline(now));
        let repeats = self.session.evaluated(&findings.unsure(), now);
        self.events.push_back(if repeats.is_empty() {
            DiscoveryEvent::Finished(Box::new(findings))
        } else {
            DiscoveryEvent::Repeats(repeats)
        });
    }
}
