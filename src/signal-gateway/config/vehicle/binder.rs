//! Binds signals by name, and raw values with their meanings.

use std::path::PathBuf;

use super::raw_values::RawValues;
use crate::config::built_in::display;
use crate::config::reading::{Checker, Fields, LocatedText, Location};
use can_signal::can::BusIndex;
use can_signal::dbc::codec::SignalCodec;
use can_signal::dbc::model::{Contradiction, Database, Message, Number, Signal};
use can_signal::validation::meaning::{Meaning, RawRange, ValueMap};
use can_signal::validation::table::{BoundSignal, MessageIndex, Role, SignalIndex};
use gateway_base::near_miss::did_you_mean;
use vehicle_bringup::plausibility::fingerprint::PlatformList;

/// Keys of the raw values that stand for no state: "not available" and "fault".
pub(super) const UNUSABLE: &[&str] = &["not_available", "fault"];
/// The key of raw values for only "not available".
pub(super) const NOT_AVAILABLE: &[&str] = &["not_available"];

/// The DBC of a bus, as read.
#[derive(Debug)]
pub struct LoadedDbc {
    /// Name of its bus in the profile.
    pub bus: String,
    /// Index of its bus in the order of the names.
    pub index: BusIndex,
    /// Path of the DBC.
    pub path: PathBuf,
    /// Its content, with the rejected parts.
    pub database: Database,
    /// Public lists of the identifiers on the bus; empty if the profile names none.
    pub identifier_lists: Vec<&'static PlatformList>,
}

/// Messages and signals bound so far, each once.
pub(super) struct Binder<'a> {
    pub(super) checker: &'a Checker,
    pub(super) buses: &'a [LoadedDbc],
    /// Bus and name of each bound message, in order of first use.
    pub(super) messages: Vec<(usize, &'a Message)>,
    pub(super) signals: Vec<BoundSignal>,
}

/// Raw values with their meaning, e.g. the values of `left`.
pub(super) type Meanings<T> = Vec<(RawValues, Meaning<T>)>;

impl<'a> Binder<'a> {
    pub(super) fn new(checker: &'a Checker, buses: &'a [LoadedDbc]) -> Self {
        Self { checker, buses, messages: Vec::new(), signals: Vec::new() }
    }

    pub(super) fn refuse(&self, at: &Location, reason: impl AsRef<str>, remedy: &str) {
        self.checker.refuse(at, reason, remedy);
    }

    /// Returns the message with this name, on the named bus or the only bus that has it.
    pub(super) fn find_message(
        &self,
        bus: Option<&str>,
        name: &str,
        at: &Location,
    ) -> Option<(usize, &'a Message)> {
        let buses = self.buses.iter().enumerate();
        let named = buses.filter(|(_, known)| bus.is_none_or(|bus| known.bus == bus));
        let found: Vec<_> =
            named.filter_map(|(index, known)| Some((index, known.database.message(name)?))).collect();
        match found.as_slice() {
            [(index, message)] => {
                let known = &self.buses[*index];
                let contradiction = known.database.contradiction(message, name);
                self.refuse_contradiction(at, known, contradiction)?;
                Some((*index, message))
            }
            [] => {
                match bus.filter(|bus| !self.buses.iter().any(|known| known.bus == *bus)) {
                    Some(bus) => self.refuse_bus(at, bus),
                    None => self.refuse_message(at, bus, name),
                }
                None
            }
            _ => {
                self.refuse(at, format!("several buses have a message {name}"), "write BUS:MESSAGE.SIGNAL");
                None
            }
        }
    }

    /// Refuses a name with two definitions in the file of a bus; `None` if there is one.
    fn refuse_contradiction(
        &self,
        at: &Location,
        bus: &LoadedDbc,
        contradiction: Option<&Contradiction>,
    ) -> Option<()> {
        let Some(Contradiction { message, signal, lines: [first, other] }) = contradiction else {
            return Some(());
        };
        let (path, name) = (display(&bus.path), signal.as_ref().unwrap_or(message));
        let reason = format!("{name} has two definitions that differ: {path}:{first} and {path}:{other}");
        self.refuse(at, reason, "leave the right one in the file");
        None
    }

    pub(super) fn refuse_bus(&self, at: &Location, bus: &str) {
        let known: Vec<_> = self.buses.iter().map(|known| known.bus.as_str()).collect();
        let reason = format!("the profile has no bus {bus}");
        self.refuse(at, reason, &did_you_mean(bus, known.clone(), format!("it has {}", known.join(", "))));
    }

    /// Refuses a message that the DBC lacks, or whose definition was rejected.
    fn refuse_message(&self, at: &Location, bus: Option<&str>, name: &str) {
        let buses = self.buses.iter().filter(|known| bus.is_none_or(|bus| known.bus == bus));
        let files: Vec<_> = buses.clone().map(|bus| display(&bus.path)).collect();
        let rejected = buses.clone().find_map(|bus| rejected(bus, name));
        let known = self.buses.iter().flat_map(|bus| &bus.database.messages);
        let known = known.map(|message| message.name.as_str());
        let remedy = match rejected {
            Some(_) => "mend that line of the DBC, or name another message".to_owned(),
            None => did_you_mean(name, known, "name a message of the DBC"),
        };
        let rejected = rejected.unwrap_or_default();
        self.refuse(at, format!("{} has no message {name}{rejected}", files.join(", ")), &remedy);
    }

    /// Binds a signal that is named `[bus:]MESSAGE.SIGNAL`.
    pub(super) fn signal(&mut self, given: &LocatedText) -> Option<(SignalIndex, &'a Signal)> {
        let (bus, message, signal) = self.find_signal(given)?;
        Some((self.intern(bus, message, signal), signal))
    }

    /// Returns the integer signal named `[bus:]MESSAGE.SIGNAL`, with its message and the position of its bus.
    pub(super) fn find_signal(&self, given: &LocatedText) -> Option<(usize, &'a Message, &'a Signal)> {
        let at = &given.location;
        let (bus, rest) = split_bus(&given.text);
        let Some((message_name, signal_name)) = rest.split_once('.') else {
            self.refuse(at, format!("{rest:?} is not a signal"), "write MESSAGE.SIGNAL");
            return None;
        };
        let (bus, message) = self.find_message(bus, message_name, at)?;
        let signal = self.signal_of(message, signal_name, at)?;
        if signal.number != Number::Integer {
            let reason = format!("{} is a floating-point signal", signal.name);
            self.refuse(at, reason, "bind a signal with integer raw values");
            return None;
        }
        Some((bus, message, signal))
    }

    /// Returns the codec of a signal of `message` that is given by its name alone, of any kind.
    pub(super) fn field(&self, message: &Message, given: &LocatedText) -> Option<SignalCodec> {
        self.signal_of(message, &given.text, &given.location).map(|signal| signal.codec.clone())
    }

    /// Returns the signal of `message` with this name, of any kind; refuses a missing one.
    pub(super) fn signal_of<'m>(
        &self,
        message: &'m Message,
        name: &str,
        at: &Location,
    ) -> Option<&'m Signal> {
        let has_message =
            |bus: &&LoadedDbc| bus.database.messages.iter().any(|own| std::ptr::eq(own, message));
        let bus = self.buses.iter().find(has_message)?;
        let Some(signal) = message.signal(name) else {
            let names: Vec<_> = message.signals.iter().map(|signal| signal.name.as_str()).collect();
            let rejected = rejected(bus, name);
            let remedy = if rejected.is_none() {
                let all = format!("it has {}", names.join(", "));
                did_you_mean(name, names, all)
            } else {
                "mend that line of the DBC, or bind another signal".to_owned()
            };
            let reason = format!("{} has no signal {name}{}", message.name, rejected.unwrap_or_default());
            self.refuse(at, reason, &remedy);
            return None;
        };
        self.refuse_contradiction(at, bus, bus.database.signal_contradiction(message, signal, name))?;
        Some(signal)
    }

    /// Returns the message's name for texts: with its bus, if several buses have a message with this name.
    pub(super) fn message_name(&self, bus: usize, message: &Message) -> String {
        let twins = self.buses.iter().filter(|bus| bus.database.message(&message.name).is_some()).count();
        if twins > 1 { format!("{}:{}", self.buses[bus].bus, message.name) } else { message.name.clone() }
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

    /// Binds a signal and its values; `None` if a problem was recorded.
    pub(super) fn role<T: Copy>(&mut self, given: &LocatedText, meanings: &Meanings<T>) -> Option<Role<T>> {
        let bound = self.signal(given);
        let values = self.values(meanings, bound.map(|(_, signal)| signal));
        Some(Role { signal: bound?.0, values: values? })
    }

    /// Binds the key `signal` of a table with its raw values, which are given under one key per state: the
    /// `required` and `optional` keys, and the `unusable` keys, which stand for no state. `remedy` is for
    /// keys that are missing.
    pub(super) fn states<T: Copy>(
        &mut self,
        fields: &Fields<'_>,
        [required, optional]: [&[(&'static str, T)]; 2],
        unusable: &[&'static str],
        remedy: &str,
    ) -> Option<Role<T>> {
        let keys: Vec<_> = required.iter().map(|(key, _)| *key).collect();
        let is_complete = fields.require(&[&["signal"], &*keys].concat(), remedy);
        let given = fields.string("signal");
        let states = required
            .iter()
            .filter_map(|(key, state)| Some((RawValues::some_given(fields, key)?, Meaning::Defined(*state))));
        let mut meanings: Meanings<T> = states.collect();
        let others = optional
            .iter()
            .filter_map(|(key, state)| Some((RawValues::given(fields, key)?, Meaning::Defined(*state))));
        meanings.extend(others);
        meanings.extend(unusable_values(fields, unusable));
        is_complete?;
        self.role(&given?, &meanings)
    }

    /// Binds the key `signal` of a table that has raw values under the keys `on` and `off`.
    pub(super) fn switch(
        &mut self,
        fields: &Fields<'_>,
        [on, off]: [&'static str; 2],
        unusable: &[&'static str],
        remedy: &str,
    ) -> Option<Role<bool>> {
        self.states(fields, [&[(on, true), (off, false)], &[]], unusable, remedy)
    }

    pub(super) fn values<T: Copy>(
        &self,
        meanings: &Meanings<T>,
        signal: Option<&Signal>,
    ) -> Option<ValueMap<T>> {
        let before = self.checker.count();
        let mut taken: Vec<RawRange> = Vec::new();
        let mut entries = Vec::new();
        for (values, meaning) in meanings {
            for (range, at) in &values.0 {
                if let Some(signal) = signal {
                    let (lowest, highest) = signal.codec.range();
                    if range.first < lowest || range.last > highest {
                        let reason = format!("{} cannot hold {range}", signal.name);
                        self.refuse(at, reason, &format!("its raw values are {lowest} to {highest}"));
                    }
                }
                let overlaps = |known: &&RawRange| known.first <= range.last && range.first <= known.last;
                if let Some(twin) = taken.iter().find(overlaps) {
                    let reason = if range == twin {
                        format!("{range} is given twice")
                    } else {
                        format!("{range} overlaps {twin}")
                    };
                    self.refuse(at, reason, "give each raw value one meaning");
                }
                taken.push(*range);
                entries.push((*range, *meaning));
            }
        }
        if self.checker.count() > before { None } else { ValueMap::new(entries).ok() }
    }
}

pub(super) fn unusable_values<T>(fields: &Fields<'_>, keys: &[&'static str]) -> Meanings<T> {
    let meaning = |key| if key == "fault" { Meaning::Fault } else { Meaning::NotAvailable };
    keys.iter().filter_map(|key| Some((RawValues::given(fields, key)?, meaning(*key)))).collect()
}

/// Splits `BUS:REST` or `REST` into the bus and the rest.
pub(super) fn split_bus(name: &str) -> (Option<&str>, &str) {
    name.split_once(':').map_or((None, name), |(bus, rest)| (Some(bus), rest))
}

/// Returns the line and the reason of a rejected DBC statement about a name, as the end of a reason.
fn rejected(bus: &LoadedDbc, name: &str) -> Option<String> {
    let finding = bus.database.findings.iter().find(|finding| finding.excerpt.contains(name))?;
    Some(format!("; rejected at {}:{}: {}", display(&bus.path), finding.line, finding.reason))
}
