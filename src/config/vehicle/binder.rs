//! Signals by name, and raw values with a meaning: the pieces a binding is made of.

use std::ops::Range;

use toml::Spanned;

use super::raw_values::RawValues;
use crate::config::reading::checker::Checker;
use crate::config::reading::document::Document;
use crate::core::can::link::BusIndex;
use crate::core::dbc::model::{Database, Message, Number, Signal};
use crate::core::validation::meaning::{Meaning, RawRange, ValueMap};
use crate::core::validation::table::{BoundSignal, MessageIndex, Role, SignalIndex};

/// A bus of the profile with its DBC.
#[derive(Debug)]
pub(super) struct ProfileBus {
    pub(super) name: String,
    pub(super) index: BusIndex,
    pub(super) dbc_path: String,
    pub(super) database: Database,
}

/// Messages and signals bound so far, each once, and the problems met on the way.
#[derive(Debug)]
pub(super) struct Binder<'a> {
    pub(super) checker: Checker<'a>,
    pub(super) buses: &'a [ProfileBus],
    /// Bus and name of each bound message, in order of first use.
    pub(super) messages: Vec<(usize, &'a Message)>,
    pub(super) signals: Vec<BoundSignal>,
}

/// Raw values with what they mean, e.g. those of `left`.
pub(super) type Meanings<'a, T> = Vec<(&'a RawValues, Meaning<T>)>;

impl<'a> Binder<'a> {
    pub(super) fn new(document: &'a Document, buses: &'a [ProfileBus]) -> Self {
        Self { checker: Checker::new(document), buses, messages: Vec::new(), signals: Vec::new() }
    }

    /// Notes a problem at a place in the profile.
    pub(super) fn refuse(&mut self, at: Range<usize>, reason: impl Into<String>, remedy: &str) {
        self.checker.refuse_at(at, reason, remedy);
    }

    /// The message of that name, on the named bus or the only one that has it.
    pub(super) fn find_message(
        &mut self,
        bus: Option<&str>,
        name: &str,
        at: Range<usize>,
    ) -> Option<(usize, &'a Message)> {
        let buses = self.buses.iter().enumerate();
        let named = buses.filter(|(_, known)| bus.is_none_or(|bus| known.name == bus));
        let found: Vec<_> =
            named.filter_map(|(index, known)| Some((index, known.database.message(name)?))).collect();
        match found.as_slice() {
            [one] => Some(*one),
            [] => {
                match bus.filter(|bus| !self.buses.iter().any(|known| known.name == *bus)) {
                    Some(bus) => self.refuse_bus(at, bus),
                    None => self.refuse(at, self.missing_message(bus, name), "name a message of the DBC"),
                }
                None
            }
            _ => {
                self.refuse(at, format!("several buses have a message {name}"), "write BUS:MESSAGE.SIGNAL");
                None
            }
        }
    }

    /// Refuses a bus that the profile does not have.
    pub(super) fn refuse_bus(&mut self, at: Range<usize>, bus: &str) {
        let known: Vec<_> = self.buses.iter().map(|bus| bus.name.as_str()).collect();
        self.refuse(at, format!("there is no bus {bus}"), &format!("it has {}", known.join(", ")));
    }

    /// Says whether the DBC lacks the message or has it in a form that was rejected.
    fn missing_message(&self, bus: Option<&str>, name: &str) -> String {
        let buses: Vec<_> =
            self.buses.iter().filter(|known| bus.is_none_or(|bus| known.name == bus)).collect();
        let files = buses.iter().map(|bus| bus.dbc_path.as_str()).collect::<Vec<_>>().join(", ");
        let rejected = buses.iter().find_map(|bus| rejected(bus, name)).unwrap_or_default();
        format!("{files} has no message {name}{rejected}")
    }

    /// Binds `[bus:]MESSAGE.SIGNAL`.
    pub(super) fn signal(&mut self, text: &Spanned<String>) -> Option<(SignalIndex, &'a Signal)> {
        let at = text.span();
        let (bus, rest) = split_bus(text.get_ref());
        let Some((message_name, signal_name)) = rest.split_once('.') else {
            self.refuse(at, format!("{rest:?} names no signal"), "write MESSAGE.SIGNAL");
            return None;
        };
        let (bus, message) = self.find_message(bus, message_name, at.clone())?;
        let Some(signal) = message.signal(signal_name) else {
            let bus = &self.buses[bus];
            let rejected = rejected(bus, signal_name).unwrap_or_default();
            let names: Vec<_> = message.signals.iter().map(|signal| signal.name.as_str()).collect();
            let reason = format!("{} has no signal {signal_name}{rejected}", message.name);
            self.refuse(at, reason, &format!("it has {}", names.join(", ")));
            return None;
        };
        if signal.number != Number::Integer {
            let reason = format!("{} is a floating-point signal", signal.name);
            self.refuse(at, reason, "bind a signal with integer raw values");
            return None;
        }
        Some((self.intern(bus, message, signal), signal))
    }

    /// The message's name for people: with its bus, when several buses have one of that name.
    pub(super) fn message_name(&self, bus: usize, message: &Message) -> String {
        let twins = self.buses.iter().filter(|bus| bus.database.message(&message.name).is_some()).count();
        if twins > 1 { format!("{}:{}", self.buses[bus].name, message.name) } else { message.name.clone() }
    }

    fn intern(&mut self, bus: usize, message: &'a Message, signal: &'a Signal) -> SignalIndex {
        let is_it = |known: &(usize, &Message)| known.0 == bus && known.1.name == message.name;
        let message_index = self.messages.iter().position(is_it).unwrap_or_else(|| {
            self.messages.push((bus, message));
            self.messages.len() - 1
        });
        let name = format!("{}.{}", self.message_name(bus, message), signal.name);
        let same = |known: &BoundSignal| known.message.0 == message_index && known.name == name;
        SignalIndex(self.signals.iter().position(same).unwrap_or_else(|| {
            let message = MessageIndex(message_index);
            self.signals.push(BoundSignal { name, message, codec: signal.codec.clone() });
            self.signals.len() - 1
        }))
    }

    /// Binds a signal and its values; problems are noted and `None` comes out.
    pub(super) fn role<T: Copy>(
        &mut self,
        text: &Spanned<String>,
        meanings: &Meanings<'_, T>,
    ) -> Option<Role<T>> {
        let bound = self.signal(text);
        let values = self.values(meanings, bound.map(|(_, signal)| signal));
        Some(Role { signal: bound?.0, values: values? })
    }

    /// Binds an on/off signal; `others` are its values for anything else.
    pub(super) fn switch<'f>(
        &mut self,
        signal: &Spanned<String>,
        [on, off]: [&'f RawValues; 2],
        others: impl Iterator<Item = (&'f RawValues, Meaning<bool>)>,
    ) -> Option<Role<bool>> {
        self.require_values(&[on, off]);
        let mut meanings = vec![(on, Meaning::Defined(true)), (off, Meaning::Defined(false))];
        meanings.extend(others);
        self.role(signal, &meanings)
    }

    /// Binds a signal with values for each of its states, as far as it has them.
    pub(super) fn state_role<'f, T: Copy>(
        &mut self,
        signal: &Spanned<String>,
        states: impl IntoIterator<Item = (Option<&'f RawValues>, T)>,
        not_available: Option<&'f RawValues>,
        fault: Option<&'f RawValues>,
    ) -> Option<Role<T>> {
        let states = states.into_iter();
        let states = states.filter_map(|(values, state)| Some((values?, Meaning::Defined(state))));
        self.role(signal, &states.chain(no_state(not_available, fault)).collect())
    }

    /// Notes each empty list among those that must not be.
    pub(super) fn require_values(&mut self, lists: &[&RawValues]) {
        for values in lists.iter().filter(|values| values.get_ref().is_empty()) {
            self.refuse(values.span(), "no value is named", "name at least one raw value");
        }
    }

    fn values<T: Copy>(
        &mut self,
        meanings: &Meanings<'_, T>,
        signal: Option<&Signal>,
    ) -> Option<ValueMap<T>> {
        let before = self.checker.problems.len();
        let mut seen: Vec<RawRange> = Vec::new();
        let mut entries = Vec::new();
        for (values, meaning) in meanings {
            for value in values.get_ref() {
                let range = value.get_ref().0;
                if let Some(signal) = signal {
                    let (lowest, highest) = signal.codec.range();
                    if range.first < lowest || range.last > highest {
                        let reason = format!("{} cannot hold {range}", signal.name);
                        let remedy = format!("its raw values are {lowest} to {highest}");
                        self.refuse(value.span(), reason, &remedy);
                    }
                }
                if let Some(twin) =
                    seen.iter().find(|known| known.first <= range.last && range.first <= known.last)
                {
                    let reason = format!("{range} overlaps {twin}");
                    self.refuse(value.span(), reason, "give each raw value one meaning");
                }
                seen.push(range);
                entries.push((range, *meaning));
            }
        }
        if self.checker.problems.len() > before { None } else { ValueMap::new(entries).ok() }
    }
}

/// Bus and rest of `BUS:REST` or `REST`.
pub(super) fn split_bus(name: &str) -> (Option<&str>, &str) {
    name.split_once(':').map_or((None, name), |(bus, rest)| (Some(bus), rest))
}

/// The values for "not available" and "fault", as far as they are given.
pub(super) fn no_state<'f, T>(
    not_available: Option<&'f RawValues>,
    fault: Option<&'f RawValues>,
) -> impl Iterator<Item = (&'f RawValues, Meaning<T>)> {
    let not_available = not_available.map(|values| (values, Meaning::NotAvailable));
    not_available.into_iter().chain(fault.map(|values| (values, Meaning::Fault)))
}

/// Where and why the DBC's statement about a name was rejected, to be put behind a reason.
fn rejected(bus: &ProfileBus, name: &str) -> Option<String> {
    let finding = bus.database.findings.iter().find(|finding| finding.excerpt.contains(name))?;
    Some(format!("; rejected at {}:{}: {}", bus.dbc_path, finding.line, finding.reason))
}
