//! Changes of links and controllers, losses of frames and marks of the driver's actions in a candump log.
//!
//! The black box and `discover` write them after a `#`, which other tools take for a comment, and a replay reads
//! them back: `# (1436509052.249713) can0 link down`.

use std::fmt;

use crate::core::can::controller::ControllerReport;
use crate::core::can::error_frame::ErrorCounters;
use crate::core::can::input::CanInput;
use crate::core::can::link::{BusIndex, LinkState};
use crate::core::can::mark::Mark;
use crate::core::names::variant;

/// An event on a bus for which candump has no line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Note {
    /// The link changed to this state.
    Link(LinkState),
    /// The kernel reported the state of the controller.
    Controller(ControllerReport),
    /// The kernel dropped this many frames.
    Drops(u32),
    /// The driver's action changed.
    Mark(Mark),
}

impl Note {
    /// The bus and note of an input; `None` for an input with a candump line of its own or without one.
    pub fn of(input: &CanInput) -> Option<(BusIndex, Self)> {
        match *input {
            CanInput::Link { bus, state } => Some((bus, Self::Link(state))),
            CanInput::Controller { bus, report } => Some((bus, Self::Controller(report))),
            CanInput::Drops { bus, lost } => Some((bus, Self::Drops(lost))),
            CanInput::Frame { .. } | CanInput::ErrorFrame { .. } | CanInput::BadRecords { .. } => None,
        }
    }

    /// The input that the note records; `None` for a mark, which is not an event on the bus.
    pub fn input(self, bus: BusIndex) -> Option<CanInput> {
        match self {
            Self::Link(state) => Some(CanInput::Link { bus, state }),
            Self::Controller(report) => Some(CanInput::Controller { bus, report }),
            Self::Drops(lost) => Some(CanInput::Drops { bus, lost }),
            Self::Mark(_) => None,
        }
    }

    /// Parses the fields of a note; `None` when they are not one.
    pub fn parse<'a>(fields: impl Iterator<Item = &'a str>) -> Option<Self> {
        let fields: Vec<_> = fields.take(9).collect();
        Some(match fields.as_slice() {
            ["link", "failed", errno] => Self::Link(LinkState::Failed(errno.parse().ok()?)),
            ["link", name] => Self::Link(variant(name)?),
            ["drops", lost] => Self::Drops(lost.parse().ok()?),
            ["mark", name] => Self::Mark(Mark::from_name(name)?),
            ["controller", state, rest @ ..] => {
                let state = variant(state)?;
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
            Self::Link(LinkState::Failed(errno)) => write!(f, "link failed {errno}"),
            Self::Link(state) => write!(f, "link {state}"),
            Self::Drops(lost) => write!(f, "drops {lost}"),
            Self::Mark(mark) => write!(f, "mark {mark}"),
            Self::Controller(report) => {
                write!(f, "controller {}", report.state)?;
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
    use crate::core::can::error_frame::ControllerState;
    use proptest::prelude::*;

    fn note() -> impl Strategy<Value = Note> {
        let link = prop_oneof![
            Just(LinkState::Up),
            Just(LinkState::Down),
            Just(LinkState::Missing),
            Just(LinkState::NotCan),
            Just(LinkState::Ended),
            any::<i32>().prop_map(LinkState::Failed),
        ];
        let counters =
            proptest::option::of(any::<(u16, u16)>().prop_map(|(tx, rx)| ErrorCounters { tx, rx }));
        let controller = (prop::sample::select(&ControllerState::ALL), counters, any::<Option<u32>>());
        prop_oneof![
            link.prop_map(Note::Link),
            any::<u32>().prop_map(Note::Drops),
            prop::sample::select(&Mark::ALL).prop_map(Note::Mark),
            controller.prop_map(|(state, counters, restart_ms)| {
                Note::Controller(ControllerReport { state, counters, restart_ms })
            }),
        ]
    }

    proptest! {
        #[test]
        fn written_note_is_read_back(note in note()) {
            prop_assert_eq!(Note::parse(note.to_string().split(' ')), Some(note));
            let of_input = note.input(BusIndex(3)).map(|input| Note::of(&input));
            prop_assert_eq!(of_input.is_none(), matches!(note, Note::Mark(_)));
            prop_assert!(of_input.is_none_or(|read| read == Some((BusIndex(3), note))));
        }

        #[test]
        fn any_fields_are_parsed_without_panic(text in "[a-z0-9 -]{0,60}") {
            let _outcome = Note::parse(text.split(' '));
        }
    }
}
