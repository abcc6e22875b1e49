//! First pass: messages with their signals in the order of the file, and properties from other statements.

use std::collections::{BTreeMap, BTreeSet};

use super::codec::{ByteOrder, Layout};
use super::finding::{DbcFindings, Reason, StatementLocation};
use super::grammar::{self, Detail, EnumValue, Parsed, ParsedStatement, Property, Values};
use super::model::MAX_ENTRIES;
use super::repair;
use super::statement::{self, Statement};
use crate::can::{CanId, MAX_DATA};

/// Name of the pseudo-message that collects signals without a message.
const INDEPENDENT: &str = "VECTOR__INDEPENDENT_SIG_MSG";

/// Flag of a 29-bit identifier in the message number of a DBC.
const EXTENDED: u32 = 0x8000_0000;

/// Largest number of signals of a message, since the search for shared bits takes quadratic time.
const MAX_SIGNALS: usize = 4_000;

/// The statements of a file before messages and properties are joined.
#[derive(Debug, Default)]
pub(super) struct Outline {
    pub(super) messages: Vec<MessageOutline>,
    /// Statements about messages and signals elsewhere in the file.
    pub(super) properties: Vec<(StatementLocation, Property)>,
    pub(super) tables: BTreeMap<String, Values>,
    pub(super) default_cycle: Option<u32>,
    pub(super) frame_formats: Vec<String>,
    pub(super) default_frame_format: Option<EnumValue>,
    /// Numbers of rejected messages, whose properties cause no further findings.
    pub(super) lost_messages: BTreeSet<u32>,
    pub(super) findings: DbcFindings,
    /// Messages by position, and their signals by name, that have a second, different definition, with the
    /// line of the second definition.
    pub(super) redefined: Vec<(usize, Option<String>, usize)>,
    /// Number of entries so far; reading stops above [`MAX_ENTRIES`].
    pub(super) entries: usize,
}

/// A `BO_` statement with the `SG_` statements that follow.
#[derive(Debug)]
pub(super) struct MessageOutline {
    pub(super) location: StatementLocation,
    /// Number in the file, including the flag bit.
    pub(super) number: u32,
    pub(super) id: CanId,
    pub(super) name: String,
    pub(super) length: usize,
    pub(super) signals: Vec<SignalOutline>,
    /// Positions of the signals by name.
    pub(super) signal_names: BTreeMap<String, usize>,
    pub(super) lost_signals: BTreeSet<String>,
    /// True if a rejected signal may be a multiplexor.
    pub(super) lost_multiplexor: bool,
}

#[derive(Debug)]
pub(super) struct SignalOutline {
    pub(super) location: StatementLocation,
    pub(super) layout: Layout,
    pub(super) parsed: can_dbc::Signal,
}

/// The message to which `SG_` statements belong.
#[derive(Debug)]
enum Current {
    Nothing,
    /// The last message of the outline.
    Message,
    /// A rejected message, whose finding is added once its signals are counted.
    Rejected {
        location: StatementLocation,
        reason: Reason,
        is_note: bool,
        signals: usize,
        /// Set if the rejected message is a second definition of an earlier message.
        again: Option<Again>,
    },
}

/// A second definition of an earlier message.
#[derive(Debug)]
struct Again {
    number: u32,
    name: String,
    length: u64,
    /// Positions of earlier messages with its identifier or its name.
    first: Vec<usize>,
    signals: Vec<can_dbc::Signal>,
    unreadable: BTreeSet<String>,
}

impl Again {
    /// Returns true if both definitions have the same content, in any order.
    fn is_same(&self, first: &MessageOutline) -> bool {
        let mut seen = BTreeSet::new();
        let mut is_known = |signal: &can_dbc::Signal| {
            let known = first.signal_names.get(&signal.name).filter(|known| seen.insert(**known));
            known.is_some_and(|known| is_same_signal(&first.signals[*known].parsed, signal))
        };
        (self.number, &self.name) == (first.number, &first.name)
            && usize::try_from(self.length) == Ok(first.length)
            && self.unreadable == first.lost_signals
            && self.signals.len() == first.signals.len()
            && self.signals.iter().all(&mut is_known)
    }
}

/// Returns true if two signals have the same bits with the same meaning.
fn is_same_signal(a: &can_dbc::Signal, b: &can_dbc::Signal) -> bool {
    let layout = |signal: &can_dbc::Signal| {
        (signal.start_bit, signal.size, signal.byte_order, signal.value_type, signal.multiplexer_indicator)
    };
    let scale = |signal: &can_dbc::Signal| [signal.factor, signal.offset].map(f64::to_bits);
    layout(a) == layout(b) && scale(a) == scale(b) && a.unit == b.unit
}

/// Parses all statements of `text`.
pub(super) fn read(text: &str) -> Outline {
    let mut reader = OutlineReader {
        outline: Outline::default(),
        current: Current::Nothing,
        names: BTreeSet::new(),
        ids: BTreeSet::new(),
    };
    for statement in statement::split(text) {
        let findings = reader.outline.findings.count();
        reader.statement(&statement);
        reader.outline.entries += reader.outline.findings.count() - findings;
        if reader.outline.entries > MAX_ENTRIES {
            break;
        }
    }
    reader.close();
    reader.outline
}

struct OutlineReader {
    outline: Outline,
    current: Current,
    names: BTreeSet<String>,
    ids: BTreeSet<CanId>,
}

impl OutlineReader {
    fn statement(&mut self, statement: &Statement<'_>) {
        let location = StatementLocation::new(statement.line, &statement.text);
        let keyword = statement.keyword();
        // An indented malformed line within a message belongs to it. Any other malformed line may have
        // started a message, whose signals must not be added to the previous message.
        if keyword != "SG_" && (statement::is_keyword(keyword) || !statement.indented) {
            self.close();
        }
        if keyword == "SG_" {
            self.signal(location, statement);
            return;
        }
        let ParsedStatement { parsed, irregularity } = match grammar::read(statement) {
            Ok(statement) => statement,
            Err(reason) => return self.unreadable(location, statement, reason),
        };
        if let Some(irregularity) = irregularity {
            self.outline.findings.note(&location, irregularity);
        }
        match parsed {
            Parsed::Message { id, name, length } => self.message(location, id, name, length),
            Parsed::Table { name, values } => {
                self.outline.entries += 1 + values.len();
                self.outline.tables.entry(name).or_insert(values);
            }
            Parsed::DefaultCycle(default) => self.outline.default_cycle = default,
            Parsed::FrameFormats(names) => self.outline.frame_formats = names,
            Parsed::DefaultFrameFormat(default) => self.outline.default_frame_format = Some(default),
            Parsed::Detail(property) => {
                self.outline.entries += property.detail.entries();
                self.outline.properties.push((location, property));
            }
            Parsed::Signal(_) | Parsed::Nothing => {}
        }
    }

    fn unreadable(&mut self, location: StatementLocation, statement: &Statement<'_>, reason: Reason) {
        let fields: Vec<_> = statement.text.split_ascii_whitespace().take(3).collect();
        if let ["BO_", number, ..] = fields[..] {
            self.outline.lost_messages.extend(number.parse::<u32>());
            return self.reject_message(location, reason, false, None);
        }
        self.outline.findings.rejected(&location, reason);
        // Without its rule, the signal would appear in frames that do not carry it.
        if let ["SG_MUL_VAL_", number, signal] = fields[..]
            && let Ok(number) = number.parse()
        {
            let (signal, detail) = (Some(signal.to_owned()), Detail::UnreadableMultiplexing);
            self.outline.properties.push((location, Property { number, signal, detail }));
        }
    }

    fn message(&mut self, location: StatementLocation, number: u32, name: String, length: u64) {
        if name == INDEPENDENT {
            self.outline.lost_messages.insert(number);
            return self.reject_message(
                location,
                "pseudo-message of signals without a message".into(),
                true,
                None,
            );
        }
        match self.checked(number, &name, length) {
            Ok((id, length)) => {
                self.names.insert(name.clone());
                self.ids.insert(id);
                self.outline.messages.push(MessageOutline {
                    location,
                    number,
                    id,
                    name,
                    length,
                    signals: Vec::new(),
                    signal_names: BTreeMap::new(),
                    lost_signals: BTreeSet::new(),
                    lost_multiplexor: false,
                });
                self.outline.entries += 1;
                self.current = Current::Message;
            }
            Err(reason) => {
                let again = self.again(number, name, length);
                self.outline.lost_messages.insert(number);
                self.reject_message(location, reason, false, again);
            }
        }
    }

    /// Returns the second definition of an earlier message; `None` for a message that is rejected for another
    /// reason.
    fn again(&self, number: u32, name: String, length: u64) -> Option<Again> {
        let messages = self.outline.messages.iter().enumerate();
        let first = messages.filter(|(_, known)| known.number == number || known.name == name);
        let first: Vec<_> = first.map(|(position, _)| position).collect();
        let (signals, unreadable) = (Vec::new(), BTreeSet::new());
        (!first.is_empty()).then_some(Again { number, name, length, first, signals, unreadable })
    }

    fn checked(&self, number: u32, name: &str, length: u64) -> Result<(CanId, usize), Reason> {
        let id =
            if number & EXTENDED == 0 { CanId::standard(number) } else { CanId::extended(number ^ EXTENDED) };
        let id = id.ok_or_else(|| {
            if number & EXTENDED == 0 {
                format!("id {number} has more than 11 bits but not the flag 0x80000000 of a 29-bit id")
            } else {
                format!("id {number} has more than 29 bits")
            }
        })?;
        let bytes = usize::try_from(length).ok().filter(|bytes| *bytes <= MAX_DATA);
        let bytes = bytes.ok_or_else(|| format!("{length} bytes: a frame has at most {MAX_DATA}"))?;
        if self.ids.contains(&id) {
            return Err(format!("id {number} is taken by a message above").into());
        }
        if self.names.contains(name) {
            return Err(format!("the name {name} is taken by a message above").into());
        }
        Ok((id, bytes))
    }

    fn signal(&mut self, location: StatementLocation, statement: &Statement<'_>) {
        let position = self.outline.messages.len().saturating_sub(1);
        let message = match &mut self.current {
            Current::Nothing => return self.outline.findings.rejected(&location, "signal without a message"),
            Current::Rejected { signals, again, .. } => {
                *signals += 1;
                if let Some(again) = again {
                    match grammar::read(statement) {
                        Ok(ParsedStatement { parsed: Parsed::Signal(signal), .. })
                            if layout(&signal).is_ok() =>
                        {
                            again.signals.push(*signal);
                            self.outline.entries += 1;
                        }
                        Ok(_) | Err(_) => _ = again.unreadable.insert(signal_name(statement).to_owned()),
                    }
                }
                return;
            }
            Current::Message => self.outline.messages.last_mut(),
        };
        let Some(message) = message else { return };
        let parsed = grammar::read(statement).and_then(|ParsedStatement { parsed, irregularity }| {
            let Parsed::Signal(signal) = parsed else { return Err("not a signal".into()) };
            Ok((*signal, irregularity))
        });
        let name = signal_name(statement);
        let redefined = &mut self.outline.redefined;
        let checked = parsed.and_then(|(signal, irregularity)| {
            let layout = layout(&signal)?;
            if message.signals.len() == MAX_SIGNALS {
                return Err(format!("more than {MAX_SIGNALS} signals in one message").into());
            }
            let Some(known) = message.signal_names.get(&signal.name) else {
                return Ok((signal, layout, irregularity));
            };
            if !is_same_signal(&message.signals[*known].parsed, &signal) {
                redefined.push((position, Some(signal.name.clone()), location.line));
            }
            Err("a signal above has the same name".into())
        });
        match checked {
            Ok((parsed, layout, irregularity)) => {
                if let Some(irregularity) = irregularity {
                    self.outline.findings.note(&location, irregularity);
                }
                message.signal_names.insert(parsed.name.clone(), message.signals.len());
                message.signals.push(SignalOutline { location, layout, parsed });
                self.outline.entries += 1;
            }
            Err(reason) => {
                message.lost_signals.insert(name.to_owned());
                message.lost_multiplexor |= repair::may_be_multiplexor(&statement.text);
                self.outline.findings.rejected(&location, reason);
            }
        }
    }

    fn reject_message(
        &mut self,
        location: StatementLocation,
        reason: Reason,
        is_note: bool,
        again: Option<Again>,
    ) {
        self.current = Current::Rejected { location, reason, is_note, signals: 0, again };
    }

    /// Ends the current message; if it was rejected, adds its finding.
    fn close(&mut self) {
        let Current::Rejected { location, mut reason, is_note, signals, again } =
            std::mem::replace(&mut self.current, Current::Nothing)
        else {
            return;
        };
        if let Some(again) = again {
            let outline = &mut self.outline;
            let other = again.first.iter().filter(|first| !again.is_same(&outline.messages[**first]));
            outline.redefined.extend(other.map(|first| (*first, None, location.line)));
        }
        if signals > 0 {
            reason = format!("{reason} (with its signals: {signals})").into();
        }
        if is_note {
            self.outline.findings.note(&location, reason);
        } else {
            self.outline.findings.rejected(&location, reason);
        }
    }
}

/// Returns the name in a signal statement, as far as it can be recognised.
fn signal_name<'a>(statement: &'a Statement<'_>) -> &'a str {
    statement.text.split_ascii_whitespace().nth(1).unwrap_or_default().trim_end_matches(':')
}

fn layout(signal: &can_dbc::Signal) -> Result<Layout, Reason> {
    let start = u16::try_from(signal.start_bit).map_err(|_| "the start bit lies beyond every frame")?;
    let length = u16::try_from(signal.size).map_err(|_| "longer than every frame")?;
    let order = match signal.byte_order {
        can_dbc::ByteOrder::LittleEndian => ByteOrder::Intel,
        can_dbc::ByteOrder::BigEndian => ByteOrder::Motorola,
    };
    if !(signal.factor.is_finite() && signal.offset.is_finite()) {
        return Err("factor or offset is not a finite number".into());
    }
    Ok(Layout { start, length, order, signed: signal.value_type == can_dbc::ValueType::Signed })
}
