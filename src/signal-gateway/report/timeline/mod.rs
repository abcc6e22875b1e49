//! The timeline of a recording: raw values, reports, commands, diagnostics, traffic lights and links, each
//! with the frame behind it. It is shown as a chart ([`Timeline::chart`]) or as a page
//! ([`Timeline::to_html`]).

mod chart;
mod curve;
mod page;

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use crate::report::gateway_view::{DOORS, report_place};
use gateway_base::diagnostics::Level;

pub(crate) use curve::{Column, Curve};

/// Maximum number of spans in a lane; beyond it, short spans are folded.
const MAX_SPANS: usize = 1_500;
/// A lane is folded when it has this many times [`MAX_SPANS`].
const SLACK: usize = 4;

/// The events of a recording over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Timeline {
    /// Name of the recording.
    pub title: String,
    /// The vehicle and other circumstances.
    pub subtitle: String,
    /// Time of the last frame, seconds after the first.
    pub length_s: f64,
    /// Published measured values, from top to bottom above the lanes.
    pub curves: Vec<Curve>,
    pub lanes: Vec<Lane>,
    /// Frames to which spans refer.
    pub frames: Vec<CausingFrame>,
    /// Omitted parts, in sentences.
    pub remarks: Vec<String>,
}

/// A position in a timeline.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OpenedAt {
    /// Group of the lane.
    pub group: Group,
    pub label: String,
    /// Time, seconds after the first frame.
    pub at_s: f64,
}

/// The subject of a lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Group {
    /// Raw values of bound signals, with their meaning.
    Raw,
    Reports,
    /// Commands of the decider, and frames to the vehicle.
    Commands,
    Diagnostics,
    TrafficLights,
    /// State of the buses.
    Links,
}

/// Appearance of a span.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Tone {
    Left,
    Right,
    Hazard,
    Off,
    Ok,
    Warn,
    Error,
    /// Nothing is published, or nothing is known.
    Nothing,
    /// Any other state.
    Plain,
    /// Several short spans folded into one.
    Folded,
}

impl From<Level> for Tone {
    fn from(level: Level) -> Self {
        match level {
            Level::Ok => Self::Ok,
            Level::Warn => Self::Warn,
            Level::Error | Level::Stale => Self::Error,
        }
    }
}

/// The successive states of one item.
#[derive(Debug, Clone, PartialEq)]
pub struct Lane {
    /// The subject.
    pub group: Group,
    pub label: String,
    /// Spans in ascending order; the last one extends to the end of the timeline.
    pub spans: Vec<Span>,
    /// Number of states that are folded into others.
    pub folded: u64,
}

/// One state.
#[derive(Debug, Clone, PartialEq)]
pub struct Span {
    /// Start, seconds after the first frame.
    pub from_s: f64,
    /// End, seconds after the first frame; not before the start.
    pub to_s: f64,
    pub tone: Tone,
    /// The state in words.
    pub text: String,
    /// Position of its frame in the timeline's frames; `None` without a frame.
    pub frame: Option<usize>,
    /// Number of states, more than 1 for a folded span.
    pub states: u64,
}

/// A frame that led to an event.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CausingFrame {
    /// Time, seconds after the first frame.
    pub at_s: f64,
    /// Stamp of the recording: seconds since 1970.
    pub stamp: String,
    /// Interface it was received on.
    pub interface: String,
    /// Identifier in candump notation.
    pub id: String,
    pub message: String,
    /// Data bytes in hexadecimal.
    pub bytes: String,
    /// Its bound signals (name, raw value and meaning), or the reason why the gateway does not use the frame.
    pub signals: Vec<String>,
}

impl Lane {
    pub fn new(group: Group, label: impl Into<String>) -> Self {
        Self { group, label: label.into(), spans: Vec::new(), folded: 0 }
    }

    /// Begins a state, unless it is the current one, and ends the previous state.
    pub fn begin(&mut self, at_s: f64, tone: Tone, text: &str, frame: Option<usize>) {
        if let Some(last) = self.spans.last_mut() {
            if last.text == text && last.tone == tone && last.states == 1 {
                return;
            }
            last.to_s = at_s;
        }
        self.spans.push(Span { from_s: at_s, to_s: at_s, tone, text: text.to_owned(), frame, states: 1 });
        if self.spans.len() > MAX_SPANS * SLACK {
            self.fold(at_s);
        }
    }

    /// Ends the last state at `end_s`, and folds surplus spans.
    pub fn finish(&mut self, end_s: f64) {
        if let Some(last) = self.spans.last_mut() {
            last.to_s = end_s.max(last.from_s);
        }
        if self.spans.len() > MAX_SPANS {
            self.fold(end_s);
        }
    }

    /// Joins adjacent spans that are shorter than the average space per span in the lane. The last state
    /// stays separate, since it continues.
    fn fold(&mut self, end_s: f64) {
        let Some(present) = self.spans.pop() else { return };
        let begin_s = self.spans.first().map_or(0.0, |first| first.from_s);
        #[allow(clippy::cast_precision_loss)] // some thousands
        let least_s = 2.0 * (end_s - begin_s) / MAX_SPANS as f64;
        let mut kept: Vec<Span> = Vec::with_capacity(MAX_SPANS);
        for span in std::mem::take(&mut self.spans) {
            let is_short = |span: &Span| span.to_s - span.from_s < least_s;
            match kept.last_mut().filter(|last| is_short(&span) && is_short(last)) {
                Some(last) => {
                    self.folded += u64::from(last.states == 1) + u64::from(span.states == 1);
                    last.states += span.states;
                    last.to_s = span.to_s;
                    last.tone = Tone::Folded;
                    last.text = format!("{} states", last.states);
                }
                None => kept.push(span),
            }
        }
        kept.push(present);
        self.spans = kept;
    }
}

/// Heading of the raw values without a change: constant ones, and measured ones, whose state is their name.
const CONSTANT: &str = "raw values in a single state";

impl Group {
    /// Returns the heading of its lanes, and their place below the reports.
    const fn heading(self) -> (u8, &'static str) {
        match self {
            Self::Reports => (0, "reports"),
            Self::Commands => (1, "commands"),
            Self::TrafficLights => (2, "traffic lights"),
            Self::Diagnostics => (3, "other diagnostics"),
            Self::Links => (4, "buses"),
            Self::Raw => (5, "raw values"),
        }
    }
}

impl Lane {
    /// Returns the section of the lane: its place, and its heading. The lanes of a report and of its status
    /// are one section.
    pub fn section(&self) -> (u8, usize, &'static str) {
        let is_door = self.group == Group::Reports && self.label.starts_with(DOOR);
        let of_report = matches!(self.group, Group::Reports | Group::Diagnostics)
            .then(|| report_place(if is_door { DOORS } else { &self.label }))
            .flatten();
        match of_report {
            Some((place, title)) => (0, place, title),
            None if self.is_constant() => (6, 0, CONSTANT),
            None => {
                let (place, heading) = self.group.heading();
                (place, 0, heading)
            }
        }
    }

    /// Returns the name of the lane within its section.
    fn name(&self) -> &str {
        let (place, _, heading) = self.section();
        match self.group {
            _ if place > 0 || heading == Group::Reports.heading().1 => &self.label,
            Group::Diagnostics => "diagnostics",
            Group::Reports => self.label.strip_prefix(DOOR).unwrap_or("published"),
            Group::Raw | Group::Commands | Group::TrafficLights | Group::Links => &self.label,
        }
    }

    /// Returns true for a raw value that never changes.
    fn is_constant(&self) -> bool {
        self.group == Group::Raw && self.spans.len() < 2
    }
}

/// Beginning of the label of a door's lane.
pub(crate) const DOOR: &str = "door ";

impl Timeline {
    /// Returns the raw values that never change, in a sentence; `None` without one.
    fn constants(&self) -> Option<String> {
        let names = self.lanes.iter().filter(|lane| lane.is_constant()).map(|lane| lane.label.as_str());
        let names = names.collect::<Vec<_>>().join(", ");
        (!names.is_empty()).then(|| format!("{CONSTANT}: {names}"))
    }

    /// Removes frames to which no span refers, and adds remarks on folded lanes. Call it once, at the end.
    pub fn close(&mut self) {
        let spans = self.lanes.iter().flat_map(|lane| &lane.spans);
        let used: BTreeSet<usize> = spans.filter_map(|span| span.frame).collect();
        let moved: BTreeMap<usize, usize> = used.into_iter().zip(0..).collect();
        let mut positions = 0..;
        self.frames.retain(|_| positions.next().is_some_and(|position| moved.contains_key(&position)));
        for span in self.lanes.iter_mut().flat_map(|lane| &mut lane.spans) {
            span.frame = span.frame.and_then(|frame| moved.get(&frame).copied());
        }
        let folded: u64 = self.lanes.iter().map(|lane| lane.folded).sum();
        if folded > 0 {
            self.remarks.push(format!(
                "{folded} short states are folded into others, since a lane has at most {MAX_SPANS} or so: they are marked"
            ));
        }
    }
}

#[cfg(test)]
mod tests;
