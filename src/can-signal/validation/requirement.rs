//! Requirements of a vehicle profile: conditions that distinguish its vehicle from variants.
//!
//! Nothing is reported until each requirement is met. A contradicted requirement stays contradicted until a
//! restart, since the profile is for another vehicle. Times are receive times of frames, so there are no
//! deadlines.

use std::fmt;
use std::time::Duration;

use super::catalogue;
use super::display::raw_text;
use super::meaning::{Meaning, RawRange, ValueMap};
use crate::can::{BusIndex, Frame, IdMatch};
use crate::dbc::codec::SignalCodec;
use gateway_base::diagnostics::MessagePart;
use gateway_base::time::MonoTime;

/// A requirement of a vehicle profile.
#[derive(Debug, Clone, PartialEq)]
pub struct Requirement {
    /// Bus of its message.
    pub bus: BusIndex,
    /// Identifiers of the frames of its message.
    pub ids: IdMatch,
    /// Name of its message, or of its signal as `MESSAGE.SIGNAL`.
    pub name: String,
    /// Observation that meets the requirement.
    pub condition: Condition,
    /// Vehicle that contradicts the requirement, e.g. `Peugeot 208`; empty if the profile does not name it.
    pub otherwise: String,
}

/// Observation that meets a requirement.
#[derive(Debug, Clone, PartialEq)]
pub enum Condition {
    /// The message is received.
    Seen,
    /// The message is not received while its bus is observed for `observation`, nor afterwards.
    Unseen {
        /// Time from the first frame on the bus, which must not fall silent in the meantime.
        observation: Duration,
    },
    /// The signal has one of the values that mean `true`, and never another value, except "not available".
    Value {
        /// Codec that reads the signal.
        codec: SignalCodec,
        /// Raw values with their meanings; `true` meets the requirement.
        values: ValueMap<bool>,
    },
}

/// State of a requirement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RequirementState {
    /// Not met yet; for [`Condition::Unseen`] with the time since which the bus is observed.
    Open(Option<MonoTime>),
    /// Met, and not contradicted.
    Met,
    /// Contradicted, by this raw value of its signal.
    Contradicted(Option<i128>),
}

/// A requirement that is not met, by its position in the profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unmet {
    /// Position in the list of requirements.
    pub index: usize,
    /// True if it is contradicted and therefore will not be met.
    pub is_contradicted: bool,
    /// Raw value of the signal that contradicts it.
    pub raw: Option<i128>,
}

impl Requirement {
    /// Returns the state after a frame of its bus at `now`. `was_alive` is false if the bus had been silent
    /// before.
    fn after(
        &self,
        state: RequirementState,
        frame: &Frame,
        was_alive: bool,
        now: MonoTime,
    ) -> RequirementState {
        let is_its_message = self.ids.contains(frame.id());
        match (&self.condition, state) {
            (_, RequirementState::Contradicted(_)) => state,
            (Condition::Seen, _) if is_its_message => RequirementState::Met,
            (Condition::Unseen { .. }, _) if is_its_message => RequirementState::Contradicted(None),
            (Condition::Value { codec, values }, _) if is_its_message => {
                let data = frame.padded();
                if codec.needed_length() > frame.data().len() || !codec.is_present(data) {
                    return state;
                }
                let raw = codec.value(data);
                match values.meaning(raw) {
                    Meaning::Defined(true) => RequirementState::Met,
                    Meaning::NotAvailable => state,
                    Meaning::Defined(false) | Meaning::Fault | Meaning::Undefined => {
                        RequirementState::Contradicted(Some(raw))
                    }
                }
            }
            (Condition::Unseen { observation }, RequirementState::Open(since)) => {
                match since.filter(|_| was_alive) {
                    Some(since) if now.since(since) >= *observation => RequirementState::Met,
                    Some(_) => state,
                    None => RequirementState::Open(Some(now)),
                }
            }
            (Condition::Seen | Condition::Unseen { .. } | Condition::Value { .. }, _) => state,
        }
    }

    /// Describes the missing observation, or the observation that contradicts the requirement.
    pub fn message(&self, unmet: Unmet) -> MessagePart {
        let (name, named_message) = (&self.name, format!("{} ({})", self.name, self.ids));
        if !unmet.is_contradicted {
            return match &self.condition {
                Condition::Seen => catalogue::waiting_for(named_message),
                Condition::Unseen { observation } => {
                    catalogue::observing_absence(observation.as_millis(), named_message)
                }
                Condition::Value { .. } => catalogue::waiting_for(name),
            };
        }
        let other = if self.otherwise.is_empty() { "another vehicle" } else { &self.otherwise };
        match unmet.raw {
            Some(raw) => catalogue::other_value(name, raw_text(raw), other),
            None => catalogue::other_message(named_message, other),
        }
    }
}

/// Formats the requirement as a condition, e.g. `no LIGHTS (123) within 1000 ms`.
impl fmt::Display for Requirement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { ids, name, otherwise, .. } = self;
        match &self.condition {
            Condition::Seen => write!(f, "{name} ({ids})")?,
            Condition::Unseen { observation } => {
                write!(f, "no {name} ({ids}) within {} ms", observation.as_millis())?;
            }
            Condition::Value { values, .. } => {
                let is_required =
                    |(_, meaning): &&(RawRange, Meaning<bool>)| *meaning == Meaning::Defined(true);
                let ranges = values.entries().iter().filter(is_required).map(|(range, _)| range.to_string());
                write!(f, "{name} = {}", ranges.collect::<Vec<_>>().join(" or "))?;
            }
        }
        if otherwise.is_empty() { Ok(()) } else { write!(f, "; otherwise it is {otherwise}") }
    }
}

/// States of the requirements of a profile, in the same order.
#[derive(Debug, Clone, Default)]
pub struct RequirementStates(Vec<RequirementState>);

impl RequirementStates {
    /// Creates the states before any frame.
    pub fn new(requirements: &[Requirement]) -> Self {
        Self(vec![RequirementState::Open(None); requirements.len()])
    }

    /// Returns the states for other requirements; requirements in both lists keep their states.
    #[must_use]
    pub fn carried_over(&self, before: &[Requirement], after: &[Requirement]) -> Self {
        let state = |requirement: &Requirement| {
            let position = before.iter().position(|known| known == requirement);
            position
                .and_then(|position| self.0.get(position).copied())
                .unwrap_or(RequirementState::Open(None))
        };
        Self(after.iter().map(state).collect())
    }

    /// Records any received frame of a bus. Returns true if the state of a requirement changes.
    pub fn frame_arrived(
        &mut self,
        requirements: &[Requirement],
        bus: BusIndex,
        frame: &Frame,
        was_alive: bool,
        now: MonoTime,
    ) -> bool {
        // Most profiles have no requirements, and this runs for each frame.
        if requirements.is_empty() {
            return false;
        }
        let mut has_changed = false;
        for (requirement, state) in requirements.iter().zip(&mut self.0).filter(|(known, _)| known.bus == bus)
        {
            let after = requirement.after(*state, frame, was_alive, now);
            has_changed |= after != *state;
            *state = after;
        }
        has_changed
    }

    /// Forgets what was observed on a bus whose link is lost, except a contradiction.
    pub fn forget_bus(&mut self, requirements: &[Requirement], bus: BusIndex) {
        for (_, state) in requirements.iter().zip(&mut self.0).filter(|(known, _)| known.bus == bus) {
            if !matches!(state, RequirementState::Contradicted(_)) {
                *state = RequirementState::Open(None);
            }
        }
    }

    /// Returns the first contradicted requirement, otherwise the first open one; `None` if all are met.
    pub fn unmet(&self) -> Option<Unmet> {
        let unmet = |(index, state): (usize, &RequirementState)| match *state {
            RequirementState::Met => None,
            RequirementState::Open(_) => Some(Unmet { index, is_contradicted: false, raw: None }),
            RequirementState::Contradicted(raw) => Some(Unmet { index, is_contradicted: true, raw }),
        };
        let all = self.0.iter().enumerate().filter_map(unmet);
        all.clone().find(|unmet| unmet.is_contradicted).or_else(|| all.clone().next())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::can::CanId;
    use crate::dbc::codec::Layout;

    const BUS: BusIndex = BusIndex(1);
    const ALIVE: bool = true;

    fn requirement(id: u16, condition: Condition) -> Requirement {
        let (name, otherwise) = ("M".to_owned(), "a van".to_owned());
        Requirement { bus: BUS, ids: CanId::Standard(id).into(), name, condition, otherwise }
    }

    fn unseen(id: u16) -> Requirement {
        requirement(id, Condition::Unseen { observation: Duration::from_secs(1) })
    }

    /// The first byte must be 4 or 5; 15 means "not available".
    fn value(id: u16) -> Requirement {
        let values = [
            (RawRange { first: 4, last: 5 }, Meaning::Defined(true)),
            (RawRange::single(15), Meaning::NotAvailable),
        ];
        let codec = SignalCodec::new(Layout::unsigned(0, 8), 1).unwrap();
        requirement(id, Condition::Value { codec, values: ValueMap::new(values.to_vec()).unwrap() })
    }

    struct Bench {
        requirements: Vec<Requirement>,
        states: RequirementStates,
    }

    impl Bench {
        fn new(requirements: Vec<Requirement>) -> Self {
            Self { states: RequirementStates::new(&requirements), requirements }
        }

        /// Records a frame on a bus that was alive; returns whether a state has changed, and what is unmet.
        fn frame(&mut self, millis: u64, id: u16, data: &[u8]) -> (bool, Option<Unmet>) {
            self.frame_on(BUS, millis, id, data, ALIVE)
        }

        fn frame_on(
            &mut self,
            bus: BusIndex,
            millis: u64,
            id: u16,
            data: &[u8],
            was_alive: bool,
        ) -> (bool, Option<Unmet>) {
            let frame = Frame::classic(CanId::Standard(id), data).unwrap();
            let now = MonoTime::from_millis(millis);
            let changed = self.states.frame_arrived(&self.requirements, bus, &frame, was_alive, now);
            (changed, self.states.unmet())
        }
    }

    fn open(index: usize) -> Unmet {
        Unmet { index, is_contradicted: false, raw: None }
    }

    fn contradicted(index: usize, raw: Option<i128>) -> Unmet {
        Unmet { index, is_contradicted: true, raw }
    }

    #[test]
    fn message_that_must_come_is_met_by_its_first_frame_on_its_bus() {
        let mut bench = Bench::new(vec![requirement(7, Condition::Seen)]);
        assert_eq!(bench.frame(0, 8, &[]), (false, Some(open(0))));
        assert_eq!(bench.frame_on(BusIndex(0), 1, 7, &[], ALIVE), (false, Some(open(0))), "another bus");
        assert_eq!(bench.frame(2, 7, &[]), (true, None));
        assert_eq!(bench.frame(3, 7, &[]), (false, None));
    }

    #[test]
    fn message_that_must_not_come_is_met_after_the_time_of_observation_by_a_frame() {
        let mut bench = Bench::new(vec![unseen(7)]);
        assert_eq!(bench.frame(10, 8, &[]), (true, Some(open(0))), "observed from now on");
        assert_eq!(bench.frame(1_009, 8, &[]), (false, Some(open(0))));
        assert_eq!(bench.frame(1_010, 8, &[]), (true, None));
        assert_eq!(bench.frame_on(BUS, 90_000, 8, &[], false), (false, None), "met for good");
    }

    #[test]
    fn silence_of_the_bus_is_no_observation() {
        let mut bench = Bench::new(vec![unseen(7)]);
        bench.frame_on(BUS, 0, 8, &[], false);
        assert_eq!(
            bench.frame_on(BUS, 5_000, 8, &[], false),
            (true, Some(open(0))),
            "it was silent until now"
        );
        assert_eq!(bench.frame(5_999, 8, &[]), (false, Some(open(0))));
        assert_eq!(bench.frame(6_000, 8, &[]), (true, None));
    }

    #[test]
    fn message_that_must_not_come_contradicts_for_good_before_and_after_it_was_met() {
        for before in [vec![], vec![0, 500], vec![0, 1_000, 60_000]] {
            let mut bench = Bench::new(vec![requirement(9, Condition::Seen), unseen(7)]);
            for millis in before {
                bench.frame(millis, 8, &[]);
            }
            assert_eq!(
                bench.frame(60_001, 7, &[]),
                (true, Some(contradicted(1, None))),
                "before one that is open"
            );
            bench.states.forget_bus(&bench.requirements, BUS);
            for millis in [70_000, 80_000] {
                assert_eq!(bench.frame(millis, 8, &[]), (false, Some(contradicted(1, None))));
            }
        }
    }

    #[test]
    fn value_is_met_by_one_of_its_values_and_contradicted_by_any_other() {
        let mut bench = Bench::new(vec![value(7)]);
        for says_nothing in [&[][..], &[15]] {
            assert_eq!(bench.frame(0, 7, says_nothing), (false, Some(open(0))), "{says_nothing:?}");
        }
        assert_eq!(bench.frame(1, 7, &[5]), (true, None));
        assert_eq!(bench.frame(2, 7, &[15]), (false, None));
        assert_eq!(bench.frame(3, 7, &[6]), (true, Some(contradicted(0, Some(6)))));
        assert_eq!(bench.frame(4, 7, &[4]), (false, Some(contradicted(0, Some(6)))));
    }

    #[test]
    fn lost_link_takes_back_what_was_met_on_its_bus() {
        let mut bench = Bench::new(vec![requirement(7, Condition::Seen)]);
        bench.frame(0, 7, &[]);
        bench.states.forget_bus(&bench.requirements, BusIndex(0));
        assert_eq!(bench.states.unmet(), None);
        bench.states.forget_bus(&bench.requirements, BUS);
        assert_eq!(bench.states.unmet(), Some(open(0)));
    }

    #[test]
    fn other_requirements_start_anew_and_the_same_ones_keep_their_states() {
        let (seen, other) = (requirement(7, Condition::Seen), unseen(6));
        let mut bench = Bench::new(vec![seen.clone()]);
        bench.frame(0, 7, &[]);
        let after = [other, seen];
        assert_eq!(bench.states.carried_over(&bench.requirements, &after).unmet(), Some(open(0)));
        assert_eq!(bench.states.carried_over(&bench.requirements, &after[1..]).unmet(), None);
    }

    #[test]
    fn texts_name_the_condition_and_what_contradicts_it() {
        let table = [
            (requirement(7, Condition::Seen), "M (007); otherwise it is a van"),
            (unseen(7), "no M (007) within 1000 ms; otherwise it is a van"),
            (value(7), "M = 4..=5; otherwise it is a van"),
        ];
        for (requirement, text) in table {
            assert_eq!(requirement.to_string(), text);
        }
        let text = value(7).message(contradicted(0, Some(12))).text;
        assert_eq!(text, "the profile is for another vehicle: M = 12 (0xC), which belongs to a van");
    }
}
