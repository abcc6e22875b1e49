//! The last inputs and decisions, kept so that a fault on the road can be replayed on a desk.
//!
//! A change to ERROR opens a window; some time later everything from before it until then is handed
//! out as a candump log with the decisions beside it. A replay of the log takes the same decisions,
//! once it has seen as much of the bus as the gateway had.

use std::collections::VecDeque;
use std::fmt::Write as _;
use std::time::Duration;

use super::event::{Input, LinkState};
use super::time::{MonoTime, Now};

/// How much is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BlackBoxSettings {
    /// Time before the change to ERROR.
    pub before: Duration,
    /// Time after it.
    pub after: Duration,
    /// Most inputs kept, whatever time they cover; one needs about 100 bytes.
    pub most_inputs: usize,
}

/// What is kept.
#[derive(Debug, Clone)]
pub struct BlackBox {
    settings: BlackBoxSettings,
    interfaces: Vec<String>,
    inputs: VecDeque<(Input, Now)>,
    /// Link of each bus before the first kept input.
    links: Vec<LinkState>,
    decisions: VecDeque<(MonoTime, String)>,
    /// When the open window closes.
    closes: Option<MonoTime>,
}

/// A window that has closed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recording {
    /// Wall time of its first line, for its name.
    pub start: Now,
    /// A candump log. Lines that begin with `#` tell what candump has no line for.
    pub log: String,
    /// A decision a line, as `replay` prints them.
    pub decisions: String,
}

impl BlackBox {
    /// An empty box for buses on these interfaces, with their links.
    pub fn new(settings: BlackBoxSettings, interfaces: Vec<String>, links: Vec<LinkState>) -> Self {
        let (inputs, decisions) = (VecDeque::new(), VecDeque::new());
        Self { settings, interfaces, inputs, links, decisions, closes: None }
    }

    /// Keeps an input at the time it is handled.
    pub fn keep(&mut self, input: Input, at: Now) {
        if input == Input::Deadline {
            return;
        }
        self.inputs.push_back((input, at));
        let kept = self.settings.before + self.settings.after;
        while self.inputs.len() > self.settings.most_inputs
            || self.inputs.front().is_some_and(|(_, first)| at.mono.since(first.mono) > kept)
        {
            self.drop_first();
        }
    }

    /// Keeps a decision, as a line without its time; `fault` says that it is a change to ERROR.
    pub fn decided(&mut self, line: String, fault: bool, at: MonoTime) {
        if fault && self.closes.is_none() {
            self.closes = Some(at.after(self.settings.after));
        }
        self.decisions.push_back((at, line));
        let kept = self.settings.before + self.settings.after;
        while self.decisions.len() > self.settings.most_inputs
            || self.decisions.front().is_some_and(|(first, _)| at.since(*first) > kept)
        {
            self.decisions.pop_front();
        }
    }

    /// The window that closes now, if one does. `line` writes a decision with its time.
    pub fn take(&mut self, now: MonoTime, line: impl Fn(MonoTime, &str) -> String) -> Option<Recording> {
        if self.closes.is_none_or(|closes| now < closes) {
            return None;
        }
        self.closes = None;
        let start = self.inputs.front()?.1;
        let mut log = String::new();
        for (interface, link) in self.interfaces.iter().zip(&self.links) {
            if *link != LinkState::Up {
                write_event(&mut log, start, start, interface, &link_words(*link));
            }
        }
        for (input, at) in &self.inputs {
            self.write_input(&mut log, start, *input, *at);
        }
        let since = |at: MonoTime| MonoTime::from_nanos(at.as_nanos().saturating_sub(start.mono.as_nanos()));
        let covered = self.decisions.iter().filter(|(at, _)| *at >= start.mono);
        let decisions = covered.map(|(at, text)| line(since(*at), text) + "\n").collect();
        Some(Recording { start, log, decisions })
    }

    fn drop_first(&mut self) {
        if let Some((Input::Link { bus, state }, _)) = self.inputs.pop_front()
            && let Some(link) = self.links.get_mut(usize::from(bus.0))
        {
            *link = state;
        }
    }

    fn write_input(&self, log: &mut String, start: Now, input: Input, at: Now) {
        let interface = |bus: super::event::BusIndex| {
            self.interfaces.get(usize::from(bus.0)).map_or("unknown", String::as_str)
        };
        match input {
            Input::Frame { bus, frame, .. } => {
                // Writing to a String cannot fail.
                let _ = writeln!(log, "({}) {} {frame}", stamp(start, at), interface(bus));
            }
            Input::ErrorFrame { bus, class } => {
                let id = class | 0x2000_0000;
                let _ = writeln!(log, "({}) {} {id:08X}#0000000000000000", stamp(start, at), interface(bus));
            }
            Input::Link { bus, state } => write_event(log, start, at, interface(bus), &link_words(state)),
            Input::Drops { bus, lost } => {
                write_event(log, start, at, interface(bus), &format!("drops {lost}"));
            }
            Input::BadRecords { .. } | Input::Deadline => {}
        }
    }
}

fn write_event(log: &mut String, start: Now, at: Now, interface: &str, words: &str) {
    let _ = writeln!(log, "# ({}) {interface} {words}", stamp(start, at));
}

/// Seconds and microseconds of the time line that decided, which the wall clock's steps leave alone.
fn stamp(start: Now, at: Now) -> String {
    let at = start.wall.after(at.mono.since(start.mono));
    format!("{}.{:06}", at.sec(), at.nanosec() / 1000)
}

fn link_words(link: LinkState) -> String {
    match link {
        LinkState::Up => "link up".to_owned(),
        LinkState::Down => "link down".to_owned(),
        LinkState::Missing => "link missing".to_owned(),
        LinkState::Failed(errno) => format!("link failed {errno}"),
        LinkState::Ended => "link ended".to_owned(),
    }
}
