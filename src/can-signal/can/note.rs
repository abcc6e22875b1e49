//! Notes in a candump log: changes of links and controllers, lost frames, and marks of the driver's actions.
//!
//! The black box and `discover` write each note after a `#`, which other tools treat as a comment, and a
//! replay reads the notes: `# (1436509052.249713) can0 link down`.

use std::fmt;

use crate::can::controller::ControllerReport;
use crate::can::error_frame::ErrorCounters;
use crate::can::input::CanInput;
use crate::can::link::{BusIndex, LinkState};
use crate::can::mark::DriverMark;
use gateway_base::names::variant;

/// An event on a bus for which candump has no line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogNote {
    /// The link changed to this state.
    Link(LinkState),
    /// The kernel reported the state of the controller.
    Controller(ControllerReport),
    /// The kernel dropped this many frames.
    Drops(u32),
    /// The driver's action changed.
    Mark(DriverMark),
}

impl LogNote {
    /// Returns the bus and note of an input; `None` for an input that has a candump line or is not recorded.
    pub fn of(input: &CanInput) -> Option<(BusIndex, Self)> {
        match *input {
            CanInput::Link { bus, state } => Some((bus, Self::Link(state))),
            CanInput::Controller { bus, report } => Some((bus, Self::Controller(report))),
            CanInput::Drops { bus, lost } => Some((bus, Self::Drops(lost))),
            CanInput::Frame { .. } | CanInput::ErrorFrame { .. } | CanInput::BadRecords { .. } => None,
        }
    }

    /// Returns the input that the note records; `None` for a mark, which is not an event on the bus.
    pub fn input(self, bus: BusIndex) -> Option<CanInput> {
        match self {
            Self::Link(state) => Some(CanInput::Link { bus, state }),
            Self::Controller(report) => Some(CanInput::Controller { bus, report }),
            Self::Drops(lost) => Some(CanInput::Drops { bus, lost }),
            Self::Mark(_) => None,
        }
    }

    /// Parses the fields of a note; `None` when they do not form a note.
    pub fn parse<'a>(fields: impl Iterator<Item = &'a str>) -> Option<Self> {
        let fields: Vec<_> = fields.take(9).collect();
        Some(match fields.as_slice() {
            ["link", "failed", errno] => Self::Link(LinkState::Failed(errno.parse().ok()?)),
            ["link", name] => Self::Link(variant(name)?),
            ["drops", lost] => Self::Drops(lost.parse().ok()?),
            ["mark", name] => Self::Mark(DriverMark::from_name(name)?),
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

impl fmt::Display for LogNote {
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
    use crate::can::error_frame::ControllerState;
    use proptest::prelude::*;

    fn note() -> impl Strategy<Value = LogNote> {
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
        let states = &["error-active", "error-warning", "error-passive", "bus-off", "restarted", "stopped"];
        let state = prop::sample::select(states).prop_map(|name| variant::<ControllerState>(name).unwrap());
        let controller = (state, counters, any::<Option<u32>>());
        prop_oneof![
            link.prop_map(LogNote::Link),
            any::<u32>().prop_map(LogNote::Drops),
            prop::sample::select(&["quiet", "left", "right", "hazard", "off"])
                .prop_map(|name| LogNote::Mark(variant(name).unwrap())),
            controller.prop_map(|(state, counters, restart_ms)| {
                LogNote::Controller(ControllerReport { state, counters, restart_ms })
            }),
        ]
    }

    proptest! {
        #[test]
        fn written_note_is_read_back(note in note()) {
            prop_assert_eq!(LogNote::parse(note.to_string().split(' ')), Some(note));
            let of_input = note.input(BusIndex(3)).map(|input| LogNote::of(&input));
            prop_assert_eq!(of_input.is_none(), matches!(note, LogNote::Mark(_)));
            prop_assert!(of_input.is_none_or(|read| read == Some((BusIndex(3), note))));
        }

        #[test]
        fn any_fields_are_parsed_without_panic(text in "[a-z0-9 -]{0,60}") {
            let _outcome = LogNote::parse(text.split(' '));
        }
    }
}
