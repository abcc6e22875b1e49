//! Second pass: remarks to their signals, layouts to codecs, and the checks that need both.

use std::collections::BTreeMap;

use super::codec::SignalCodec;
use super::finding::{Findings, Place};
use super::grammar::{Detail, Values};
use super::model::{Database, Message, Number, Signal};
use super::multiplex::{Multiplexing, Placed, Rule};
use super::outline::{MessageOutline, Outline, Remark, SignalOutline};

/// The database, with every finding.
pub(super) fn database(outline: Outline) -> Database {
    let Outline { messages, remarks, tables, default_cycle, lost_messages, mut findings } = outline;
    let by_number: BTreeMap<_, _> =
        messages.iter().enumerate().map(|(at, message)| (message.number, at)).collect();
    let mut details: Vec<_> = messages.iter().map(|_| Details::default()).collect();
    for remark in remarks {
        match by_number.get(&remark.number) {
            Some(at) => details[*at].take(&messages[*at], remark, &tables, &mut findings),
            None if lost_messages.contains(&remark.number) || is_reported(&remark.detail) => {}
            None => findings.rejected(&remark.place, format!("no message with id {}", remark.number)),
        }
    }
    let joined = messages.into_iter().zip(details);
    let messages =
        joined.map(|(message, details)| details.join(message, default_cycle, &mut findings)).collect();
    Database { messages, findings: findings.sorted() }
}

/// A message's own period in milliseconds; `None` overrides the file's default too.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Cycle(Option<u32>);

/// What remarks say about one message and its signals.
#[derive(Debug, Default)]
struct Details {
    cycle: Option<Cycle>,
    rules: BTreeMap<String, Rule>,
    numbers: BTreeMap<String, Number>,
    values: BTreeMap<String, (Place, Values)>,
}

impl Details {
    fn take(
        &mut self,
        message: &MessageOutline,
        remark: Remark,
        tables: &BTreeMap<String, Values>,
        findings: &mut Findings,
    ) {
        let Remark { place, detail, .. } = remark;
        if let Some(signal) = signal_of(&detail)
            && !message.signals.iter().any(|known| known.parsed.name == signal)
        {
            if !message.lost_signals.contains(signal) && !is_reported(&detail) {
                findings.rejected(&place, format!("{} has no signal {signal}", message.name));
            }
            return;
        }
        let first = match detail {
            Detail::Cycle(cycle) => *self.cycle.get_or_insert(Cycle(cycle)) == Cycle(cycle),
            Detail::Multiplexed { signal, multiplexor, ranges } => {
                let rule = Rule { multiplexor, ranges };
                let kept = self.rules.entry(signal).or_insert_with(|| rule.clone());
                let same = *kept == rule;
                if !same {
                    kept.ranges.clear();
                }
                same
            }
            Detail::MultiplexedSomehow { signal } => {
                self.rules.insert(signal, Rule { multiplexor: String::new(), ranges: Vec::new() });
                true
            }
            Detail::Number { signal, number } => *self.numbers.entry(signal).or_insert(number) == number,
            Detail::Values { signal, values } => self.take_values(signal, &place, &values),
            Detail::ValuesByTable { signal, table } => match tables.get(&table) {
                Some(values) => self.take_values(signal, &place, values),
                None => return findings.rejected(&place, format!("no VAL_TABLE_ {table}")),
            },
        };
        if !first {
            findings.rejected(&place, "says otherwise than a statement above");
        }
    }

    /// `false` when the signal has other names already.
    fn take_values(&mut self, signal: String, place: &Place, values: &Values) -> bool {
        let kept = self.values.entry(signal).or_insert_with(|| (place.clone(), values.clone()));
        kept.1 == *values
    }

    fn join(
        mut self,
        outline: MessageOutline,
        default_cycle: Option<u32>,
        findings: &mut Findings,
    ) -> Message {
        let MessageOutline { place, id, name, length, signals, lost_multiplexor, .. } = outline;
        let placed: Vec<_> = signals.iter().map(|signal| self.placed(signal)).collect();
        let multiplexing = Multiplexing::new(&placed, length, lost_multiplexor);
        let codecs: Vec<_> = (0..placed.len()).map(|index| multiplexing.codec(index)).collect();
        let mut joined: Vec<Signal> = Vec::new();
        for (signal, codec) in signals.into_iter().zip(codecs) {
            let place = signal.place.clone();
            match codec.and_then(|codec| self.signal(signal, codec, findings)) {
                Ok(signal) => {
                    if let Some(other) = joined.iter().find(|other| other.codec.overlaps(&signal.codec)) {
                        findings.note(&place, format!("shares bits with {}", other.name));
                    }
                    joined.push(signal);
                }
                Err(reason) => findings.rejected(&place, reason),
            }
        }
        let cycle_ms = self.cycle.unwrap_or(Cycle(default_cycle)).0;
        Message { name, id, length, cycle_ms, line: place.line, signals: joined }
    }

    fn placed<'a>(&'a self, signal: &'a SignalOutline) -> Placed<'a> {
        let name = signal.parsed.name.as_str();
        let indicator = signal.parsed.multiplexer_indicator;
        Placed { name, layout: signal.layout, indicator, rule: self.rules.get(name) }
    }

    fn signal(
        &mut self,
        outline: SignalOutline,
        codec: SignalCodec,
        findings: &mut Findings,
    ) -> Result<Signal, String> {
        let SignalOutline { place, parsed, .. } = outline;
        let number = self.numbers.get(&parsed.name).copied().unwrap_or(Number::Integer);
        let bits = codec.bit_length();
        match number {
            Number::Float32 if bits != 32 => {
                return Err(format!("SIG_VALTYPE_ wants 32 bits, it has {bits}"));
            }
            Number::Float64 if bits != 64 => {
                return Err(format!("SIG_VALTYPE_ wants 64 bits, it has {bits}"));
            }
            Number::Integer | Number::Float32 | Number::Float64 => {}
        }
        let values = self.values.remove(&parsed.name);
        if let Some((place, values)) = &values {
            note_odd_values(place, values, &codec, findings);
        }
        Ok(Signal {
            name: parsed.name,
            line: place.line,
            codec,
            number,
            factor: parsed.factor,
            offset: parsed.offset,
            unit: parsed.unit.replace("\\\"", "\""),
            values: values.map(|(_, values)| values).unwrap_or_default(),
        })
    }
}

/// Says which names no frame can carry.
fn note_odd_values(place: &Place, values: &Values, codec: &SignalCodec, findings: &mut Findings) {
    let (lowest, highest) = codec.range();
    if let Some((value, _)) = values.iter().find(|(value, _)| !(lowest..=highest).contains(value)) {
        findings.note(place, format!("{value} does not fit in the signal's {} bits", codec.bit_length()));
    }
}

fn signal_of(detail: &Detail) -> Option<&str> {
    match detail {
        Detail::Cycle(_) => None,
        Detail::Values { signal, .. }
        | Detail::ValuesByTable { signal, .. }
        | Detail::Number { signal, .. }
        | Detail::Multiplexed { signal, .. }
        | Detail::MultiplexedSomehow { signal } => Some(signal),
    }
}

/// Whether the statement has its finding already.
fn is_reported(detail: &Detail) -> bool {
    matches!(detail, Detail::MultiplexedSomehow { .. })
}
