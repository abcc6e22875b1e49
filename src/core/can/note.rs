//! What candump has no line for: words that tell of links, controllers and losses in a log.
//!
//! The black box writes them behind a `#`, which other tools take for a comment, and a replay
//! reads them back: `# (1436509052.249713) can0 link down`.

use std::fmt;

use crate::core::can::controller::ControllerReport;
use crate::core::can::error_frame::{ControllerState, ErrorCounters};
use crate::core::can::input::CanInput;
use crate::core::can::link::{BusIndex, LinkState};

/// One note about a bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Note {
    /// The link changed.
    Link(LinkState),
    /// The kernel told the state of the controller.
    Controller(ControllerReport),
    /// The kernel dropped this many frames.
    Drops(u32),
}

const STATES: [(ControllerState, &str); 6] = [
    (ControllerState::ErrorActive, "error-active"),
    (ControllerState::Warning, "error-warning"),
    (ControllerState::Passive, "error-passive"),
    (ControllerState::BusOff, "bus-off"),
    (ControllerState::Restarted, "restarted"),
    (ControllerState::Stopped, "stopped"),
];

impl Note {
    /// The note for an input, and its bus; `None` for what has a line of its own, or none.
    pub fn of(input: &CanInput) -> Option<(BusIndex, Self)> {
        match *input {
            CanInput::Link { bus, state } => Some((bus, Self::Link(state))),
            CanInput::Controller { bus, report } => Some((bus, Self::Controller(report))),
            CanInput::Drops { bus, lost } => Some((bus, Self::Drops(lost))),
            CanInput::Frame { .. } | CanInput::ErrorFrame { .. } | CanInput::BadRecords { .. } => None,
        }
    }

    /// The input that a note stands for.
    pub fn input(self, bus: BusIndex) -> CanInput {
        match self {
            Self::Link(state) => CanInput::Link { bus, state },
            Self::Controller(report) => CanInput::Controller { bus, report },
            Self::Drops(lost) => CanInput::Drops { bus, lost },
        }
    }

    /// Reads the words of a note.
    pub fn parse<'a>(words: impl Iterator<Item = &'a str>) -> Option<Self> {
        let words: Vec<_> = words.take(9).collect();
        Some(match words.as_slice() {
            ["link", "up"] => Self::Link(LinkState::Up),
            ["link", "down"] => Self::Link(LinkState::Down),
            ["link", "missing"] => Self::Link(LinkState::Missing),
            ["link", "ended"] => Self::Link(LinkState::Ended),
            ["link", "failed", errno] => Self::Link(LinkState::Failed(errno.parse().ok()?)),
            ["drops", lost] => Self::Drops(lost.parse().ok()?),
            ["controller", state, rest @ ..] => {
                let state = STATES.iter().find(|(_, name)| name == state)?.0;
                let number = |key: &str| rest.windows(2).find(|pair| pair[0] == key).map(|pair| pair[1]);
                let counter = |key: &str| number(key).and_then(|text| text.parse().ok());
                let counters = counter("tx").zip(counter("rx")).map(|(tx, rx)| ErrorCounters { tx, rx });
                let restart_ms = number("restart_ms").and_then(|text| text.parse().ok());
                Self::Controller(ControllerReport { state, counters, restart_ms })
            }
            _ => return None,
        })
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Link(LinkState::Up) => f.write_str("link up"),
            Self::Link(LinkState::Down) => f.write_str("link down"),
            Self::Link(LinkState::Missing) => f.write_str("link missing"),
            Self::Link(LinkState::Ended) => f.write_str("link ended"),
            Self::Link(LinkState::Failed(errno)) => write!(f, "link failed {errno}"),
            Self::Drops(lost) => write!(f, "drops {lost}"),
            Self::Controller(report) => {
                let name =
                    STATES.iter().find(|(state, _)| *state == report.state).map_or("", |(_, name)| name);
                write!(f, "controller {name}")?;
                if let Some(ErrorCounters { tx, rx }) = report.counters {
                    write!(f, " tx {tx} rx {rx}")?;
                }
                report.restart_ms.map_or(Ok(()), |ms| write!(f, " restart_ms {ms}"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn note() -> impl Strategy<Value = Note> {
        let link = prop_oneof![
            Just(LinkState::Up),
            Just(LinkState::Down),
            Just(LinkState::Missing),
            Just(LinkState::Ended),
            any::<i32>().prop_map(LinkState::Failed),
        ];
        let counters =
            proptest::option::of(any::<(u16, u16)>().prop_map(|(tx, rx)| ErrorCounters { tx, rx }));
        let controller = (0..STATES.len(), counters, any::<Option<u32>>());
        prop_oneof![
            link.prop_map(Note::Link),
            any::<u32>().prop_map(Note::Drops),
            controller.prop_map(|(state, counters, restart_ms)| {
                Note::Controller(ControllerReport { state: STATES[state].0, counters, restart_ms })
            }),
        ]
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_back(note in note()) {
            prop_assert_eq!(Note::parse(note.to_string().split(' ')), Some(note));
            prop_assert_eq!(Note::of(&note.input(BusIndex(3))), Some((BusIndex(3), note)));
        }

        #[test]
        fn any_words_are_read_or_refused(text in "[a-z0-9 -]{0,60}") {
            let _outcome = Note::parse(text.split(' '));
        }
    }
}
