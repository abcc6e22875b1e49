//! Second pass: joins properties with their signals and compiles layouts to codecs.

use std::collections::BTreeMap;

use super::codec::SignalCodec;
use super::finding::{DbcFindings, Reason, StatementLocation};
use super::grammar::{Detail, EnumValue, MultiplexRule, Property, Values};
use super::model::{Contradiction, Database, MAX_ENTRIES, Message, Number, Signal};
use super::multiplex::Multiplexing;
use super::outline::{MessageOutline, Outline, SignalOutline};
use crate::can::FrameFormat;

pub(super) fn database(outline: Outline) -> Database {
    if outline.entries > MAX_ENTRIES {
        return Database { is_too_large: true, ..Database::default() };
    }
    let Outline { messages, properties, tables, lost_messages, mut findings, redefined, .. } = outline;
    let defaults = Defaults {
        cycle_ms: outline.default_cycle,
        format: outline.default_frame_format,
        formats: outline.frame_formats,
        has_long_messages: messages.iter().any(|message| message.length > MAX_CLASSIC_DATA),
    };
    let by_number: BTreeMap<_, _> =
        messages.iter().enumerate().map(|(at, message)| (message.number, at)).collect();
    let mut details: Vec<_> = messages.iter().map(|_| Details::default()).collect();
    for (location, property) in properties {
        match by_number.get(&property.number) {
            Some(at) => details[*at].add(&messages[*at], &location, property, &tables, &mut findings),
            None if lost_messages.contains(&property.number) || is_reported(&property.detail) => {}
            None => findings.rejected(&location, format!("no message with id {}", property.number)),
        }
    }
    let named = messages.iter().zip(&mut details);
    let named = named.map(|(message, details)| (message.name.as_str(), details.long_names.remove("")));
    let (names, shared) = names(named, &mut findings);
    let lines = shared.into_iter().map(|(name, [a, b])| (name, [a, b].map(|at| messages[at].location.line)));
    let mut contradictions: Vec<_> =
        lines.map(|(message, lines)| Contradiction { message, signal: None, lines }).collect();
    for (at, signal, line) in redefined {
        match signal {
            Some(signal) => details[at].redefined.push((signal, line)),
            None => contradictions.push(Contradiction {
                message: names[at].name.clone(),
                signal: None,
                lines: [messages[at].location.line, line],
            }),
        }
    }
    let mut joined = Vec::new();
    for ((message, details), names) in messages.into_iter().zip(details).zip(names) {
        joined.push(details.join(message, names, &defaults, &mut findings, &mut contradictions));
    }
    Database { messages: joined, findings: findings.sorted(), contradictions, is_too_large: false }
}

/// Names of a message or signal in the database.
struct Names {
    name: String,
    other: Option<String>,
}

/// Returns the names of messages, or of the signals of one message, from the names in the statements and the
/// long names. A long name replaces the short name if it is unique. Also returns each duplicate name with the
/// positions of two of its owners.
fn names<'a>(
    named: impl Iterator<Item = (&'a str, Option<(StatementLocation, String)>)>,
    findings: &mut DbcFindings,
) -> (Vec<Names>, Vec<(String, [usize; 2])>) {
    let named: Vec<_> = named.collect();
    // Each name with the positions of its owners.
    let mut owners: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (at, (short, long)) in named.iter().enumerate() {
        for name in std::iter::once(*short).chain(long.iter().map(|(_, name)| name.as_str())) {
            let owners = owners.entry(name).or_default();
            if owners.last() != Some(&at) {
                owners.push(at);
            }
        }
    }
    let several = owners.iter().filter_map(|(name, at)| match at[..] {
        [first, second, ..] => Some(((*name).to_owned(), [first, second])),
        _ => None,
    });
    let several: Vec<_> = several.collect();
    let names = named.iter().map(|(short, long)| match long {
        None => Names { name: (*short).to_owned(), other: None },
        Some((_, long)) if long == short => Names { name: long.clone(), other: None },
        Some((_, long)) if owners[long.as_str()].len() == 1 => {
            Names { name: long.clone(), other: Some((*short).to_owned()) }
        }
        Some((location, long)) => {
            findings.rejected(location, format!("the name {long} is not the only one"));
            Names { name: (*short).to_owned(), other: Some(long.clone()) }
        }
    });
    (names.collect(), several)
}

const MAX_CLASSIC_DATA: usize = 8;

struct Defaults {
    cycle_ms: Option<u32>,
    format: Option<EnumValue>,
    formats: Vec<String>,
    /// True if a message is too long for a classic frame, so the bus uses CAN FD.
    has_long_messages: bool,
}

impl Defaults {
    /// Returns the format of the frames of a message of `length` bytes with this value of `VFrameFormat`.
    fn format(&self, length: usize, value: Option<&EnumValue>) -> Option<FrameFormat> {
        if length > MAX_CLASSIC_DATA {
            return Some(FrameFormat::Fd);
        }
        let name = match value.or(self.format.as_ref()) {
            Some(EnumValue::Name(name)) => Some(name),
            Some(EnumValue::Index(index)) => self.formats.get(*index),
            None => None,
        };
        match name.map(String::as_str) {
            Some("StandardCAN_FD" | "ExtendedCAN_FD") => Some(FrameFormat::Fd),
            Some("StandardCAN" | "ExtendedCAN" | "J1939PG") => Some(FrameFormat::Classic),
            Some(_) | None => (!self.has_long_messages).then_some(FrameFormat::Classic),
        }
    }
}

/// Period of a message in ms; `None` also overrides the default of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct MessagePeriod(Option<u32>);

#[derive(Debug, Default)]
struct Details {
    cycle: Option<MessagePeriod>,
    format: Option<EnumValue>,
    /// Long names of signals by their names in the statements; the message's by an empty name.
    long_names: BTreeMap<String, (StatementLocation, String)>,
    /// Names of signals that have a second, different definition, with the line of the second definition.
    redefined: Vec<(String, usize)>,
    rules: BTreeMap<String, MultiplexRule>,
    numbers: BTreeMap<String, Number>,
    values: BTreeMap<String, (StatementLocation, Values)>,
}

impl Details {
    fn add(
        &mut self,
        message: &MessageOutline,
        location: &StatementLocation,
        property: Property,
        tables: &BTreeMap<String, Values>,
        findings: &mut DbcFindings,
    ) {
        let Property { signal, detail, .. } = property;
        if let Some(signal) = &signal
            && !message.signal_names.contains_key(signal)
        {
            if !message.lost_signals.contains(signal) && !is_reported(&detail) {
                findings.rejected(location, format!("{} has no signal {signal}", message.name));
            }
            return;
        }
        let signal = signal.unwrap_or_default();
        let first = match detail {
            Detail::Cycle(cycle) => *self.cycle.get_or_insert(MessagePeriod(cycle)) == MessagePeriod(cycle),
            Detail::FrameFormat(format) => *self.format.get_or_insert_with(|| format.clone()) == format,
            Detail::LongName(name) => {
                let known = self.long_names.entry(signal);
                known.or_insert_with(|| (location.clone(), name.clone())).1 == name
            }
            Detail::Multiplexed(rule) => {
                let known = self.rules.entry(signal).or_insert_with(|| rule.clone());
                let same = *known == rule;
                if !same {
                    known.ranges.clear();
                }
                same
            }
            Detail::UnreadableMultiplexing => {
                self.rules.insert(signal, MultiplexRule { multiplexor: String::new(), ranges: Vec::new() });
                true
            }
            Detail::Number(number) => *self.numbers.entry(signal).or_insert(number) == number,
            Detail::Values(values) => self.add_values(signal, location, &values),
            Detail::ValuesByTable(table) => match tables.get(&table) {
                Some(values) => self.add_values(signal, location, values),
                None => return findings.rejected(location, format!("no VAL_TABLE_ {table}")),
            },
        };
        if !first {
            findings.rejected(location, "contradicts an earlier statement");
        }
    }

    /// Adds names of values. Returns false when the signal already has other names.
    fn add_values(&mut self, signal: String, location: &StatementLocation, values: &Values) -> bool {
        let known = self.values.entry(signal).or_insert_with(|| (location.clone(), values.clone()));
        known.1 == *values
    }

    fn join(
        mut self,
        outline: MessageOutline,
        message: Names,
        defaults: &Defaults,
        findings: &mut DbcFindings,
        contradictions: &mut Vec<Contradiction>,
    ) -> Message {
        let MessageOutline { location, id, length, signals, signal_names, lost_multiplexor, .. } = outline;
        let short = signals.iter().map(|signal| signal.parsed.name.as_str());
        let named = short.map(|name| (name, self.long_names.remove(name)));
        let (names, shared) = names(named, findings);
        let lines =
            shared.into_iter().map(|(name, [a, b])| (name, [a, b].map(|at| signals[at].location.line)));
        let again = self.redefined.iter().filter_map(|(name, line)| {
            let at = *signal_names.get(name)?;
            Some((names[at].name.clone(), [signals[at].location.line, *line]))
        });
        contradictions.extend(lines.chain(again).map(|(signal, lines)| Contradiction {
            message: message.name.clone(),
            signal: Some(signal),
            lines,
        }));
        let multiplexing = Multiplexing::new(&signals, &self.rules, length, lost_multiplexor);
        let codecs: Vec<_> = (0..signals.len()).map(|index| multiplexing.codec(index)).collect();
        let mut joined: Vec<Signal> = Vec::new();
        for ((signal, names), codec) in signals.into_iter().zip(names).zip(codecs) {
            let location = signal.location.clone();
            match codec.and_then(|codec| self.signal(signal, names, codec, findings)) {
                Ok(signal) => {
                    if let Some(other) = joined.iter().find(|other| other.codec.overlaps(&signal.codec)) {
                        findings.note(&location, format!("shares bits with {}", other.name));
                    }
                    joined.push(signal);
                }
                Err(reason) => findings.rejected(&location, reason),
            }
        }
        let cycle_ms = self.cycle.unwrap_or(MessagePeriod(defaults.cycle_ms)).0;
        let format = defaults.format(length, self.format.as_ref());
        let Names { name, other: other_name } = message;
        Message { name, other_name, id, length, format, cycle_ms, line: location.line, signals: joined }
    }

    fn signal(
        &mut self,
        outline: SignalOutline,
        names: Names,
        codec: SignalCodec,
        findings: &mut DbcFindings,
    ) -> Result<Signal, Reason> {
        let SignalOutline { location, parsed, .. } = outline;
        let number = self.numbers.get(&parsed.name).copied().unwrap_or(Number::Integer);
        let bits = codec.bit_length();
        let needed = match number {
            Number::Integer => bits,
            Number::Float32 => 32,
            Number::Float64 => 64,
        };
        if bits != needed {
            return Err(format!("SIG_VALTYPE_ requires {needed} bits, but it has {bits}").into());
        }
        let values = self.values.remove(&parsed.name);
        if let Some((location, values)) = &values {
            check_values(location, values, &codec, findings);
        }
        Ok(Signal {
            name: names.name,
            other_name: names.other,
            line: location.line,
            codec,
            number,
            factor: parsed.factor,
            offset: parsed.offset,
            unit: parsed.unit.replace("\\\"", "\""),
            values: values.map(|(_, values)| values).unwrap_or_default(),
        })
    }
}

/// Adds a finding when a named value does not fit in the bits of the signal.
fn check_values(
    location: &StatementLocation,
    values: &Values,
    codec: &SignalCodec,
    findings: &mut DbcFindings,
) {
    let (lowest, highest) = codec.range();
    if let Some((value, _)) = values.iter().find(|(value, _)| !(lowest..=highest).contains(value)) {
        findings.note(location, format!("{value} does not fit in the signal's {} bits", codec.bit_length()));
    }
}

fn is_reported(detail: &Detail) -> bool {
    matches!(detail, Detail::UnreadableMultiplexing)
}
