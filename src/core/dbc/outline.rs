//! First pass: messages with their signals, in the order of the file, and loose remarks about them.

use std::collections::{BTreeMap, BTreeSet};

use super::codec::{ByteOrder, Layout};
use super::finding::{Findings, Place};
use super::grammar::{self, Detail, Parsed, Values};
use super::mend;
use super::statement::{self, Statement};
use crate::core::can::frame::{CanId, MAX_DATA};

/// Signals that belong to no message are gathered under one of this name.
const INDEPENDENT: &str = "VECTOR__INDEPENDENT_SIG_MSG";

/// Set in a DBC's number of a 29-bit identifier.
const EXTENDED: u32 = 0x8000_0000;

/// A file's statements, sorted out but not yet joined.
#[derive(Debug, Default)]
pub(super) struct Outline {
    pub(super) messages: Vec<MessageOutline>,
    pub(super) remarks: Vec<Remark>,
    pub(super) tables: BTreeMap<String, Values>,
    pub(super) default_cycle: Option<u32>,
    /// Messages left out, by their number in the file: remarks about them are no further findings.
    pub(super) lost_messages: BTreeSet<u32>,
    pub(super) findings: Findings,
}

/// A `BO_` statement with the `SG_` statements below it.
#[derive(Debug)]
pub(super) struct MessageOutline {
    pub(super) place: Place,
    /// Its number in the file, flag bit included.
    pub(super) number: u32,
    pub(super) id: CanId,
    pub(super) name: String,
    pub(super) length: usize,
    pub(super) signals: Vec<SignalOutline>,
    /// Names of signals left out.
    pub(super) lost_signals: BTreeSet<String>,
    /// Whether one of them may have been a multiplexor.
    pub(super) lost_multiplexor: bool,
}

/// An `SG_` statement.
#[derive(Debug)]
pub(super) struct SignalOutline {
    pub(super) place: Place,
    pub(super) layout: Layout,
    pub(super) parsed: can_dbc::Signal,
}

/// A statement about a message or signal that stands elsewhere in the file.
#[derive(Debug)]
pub(super) struct Remark {
    pub(super) place: Place,
    pub(super) number: u32,
    pub(super) detail: Detail,
}

/// Where `SG_` statements go.
#[derive(Debug)]
enum Above {
    Nothing,
    /// The last message.
    Message,
    /// A message that was left out, with what to say when its signals are counted.
    Lost {
        place: Place,
        reason: String,
        is_note: bool,
        signals: usize,
    },
}

/// Reads all statements of `text`.
pub(super) fn read(text: &str) -> Outline {
    let mut reader = Reader {
        outline: Outline::default(),
        above: Above::Nothing,
        names: BTreeSet::new(),
        ids: BTreeSet::new(),
    };
    for statement in statement::split(text) {
        reader.statement(&statement);
    }
    reader.close();
    reader.outline
}

struct Reader {
    outline: Outline,
    above: Above,
    names: BTreeSet<String>,
    ids: BTreeSet<CanId>,
}

impl Reader {
    fn statement(&mut self, statement: &Statement<'_>) {
        let place = Place::new(statement.line, &statement.text);
        let keyword = statement.keyword();
        // A broken line in the middle of a message, if it is indented, is one of its lines; any
        // other may have been a message of its own, and what follows must not go to the wrong one.
        if keyword != "SG_" && (statement::is_keyword(keyword) || !statement.indented) {
            self.close();
        }
        if keyword == "SG_" {
            self.signal(place, statement);
            return;
        }
        let reading = match grammar::read(statement) {
            Ok(reading) => reading,
            Err(reason) => return self.unreadable(place, statement, reason),
        };
        if let Some(oddity) = reading.oddity {
            self.outline.findings.note(&place, oddity);
        }
        match reading.parsed {
            Parsed::Message { id, name, length } => self.message(place, id, name, length),
            Parsed::Table { name, values } => {
                self.outline.tables.entry(name).or_insert(values);
            }
            Parsed::DefaultCycle(default) => self.outline.default_cycle = default,
            Parsed::Detail { id, detail } => self.outline.remarks.push(Remark { place, number: id, detail }),
            Parsed::Signal(_) | Parsed::Nothing => {}
        }
    }

    fn unreadable(&mut self, place: Place, statement: &Statement<'_>, reason: String) {
        let words: Vec<_> = statement.text.split_ascii_whitespace().take(3).collect();
        if let ["BO_", number, ..] = words[..] {
            self.outline.lost_messages.extend(number.parse::<u32>());
            return self.lose(place, reason, false);
        }
        self.outline.findings.rejected(&place, reason);
        // Without its rule the signal would seem to be there when it is not.
        if let ["SG_MUL_VAL_", number, signal] = words[..]
            && let Ok(number) = number.parse()
        {
            let detail = Detail::MultiplexedSomehow { signal: signal.to_owned() };
            self.outline.remarks.push(Remark { place, number, detail });
        }
    }

    fn message(&mut self, place: Place, number: u32, name: String, length: u64) {
        if name == INDEPENDENT {
            self.outline.lost_messages.insert(number);
            return self.lose(place, "no message: signals without one are kept here".to_owned(), true);
        }
        match self.checked(number, &name, length) {
            Ok((id, length)) => {
                self.names.insert(name.clone());
                self.ids.insert(id);
                let (signals, lost_signals, lost_multiplexor) = (Vec::new(), BTreeSet::new(), false);
                let message = MessageOutline {
                    place,
                    number,
                    id,
                    name,
                    length,
                    signals,
                    lost_signals,
                    lost_multiplexor,
                };
                self.outline.messages.push(message);
                self.above = Above::Message;
            }
            Err(reason) => {
                self.outline.lost_messages.insert(number);
                self.lose(place, reason, false);
            }
        }
    }

    fn checked(&self, number: u32, name: &str, length: u64) -> Result<(CanId, usize), String> {
        let id =
            if number & EXTENDED == 0 { CanId::standard(number) } else { CanId::extended(number ^ EXTENDED) };
        let id = id.ok_or_else(|| {
            if number & EXTENDED == 0 {
                format!("id {number} has more than 11 bits, and not the flag 0x80000000 of a 29-bit id")
            } else {
                format!("id {number} has more than 29 bits")
            }
        })?;
        let bytes = usize::try_from(length).ok().filter(|bytes| *bytes <= MAX_DATA);
        let bytes = bytes.ok_or_else(|| format!("{length} bytes: a frame carries {MAX_DATA} at most"))?;
        if self.ids.contains(&id) {
            return Err(format!("id {number} is taken by a message above"));
        }
        if self.names.contains(name) {
            return Err(format!("the name {name} is taken by a message above"));
        }
        Ok((id, bytes))
    }

    fn signal(&mut self, place: Place, statement: &Statement<'_>) {
        let message = match &mut self.above {
            Above::Nothing => return self.outline.findings.rejected(&place, "a signal without a message"),
            Above::Lost { signals, .. } => {
                *signals += 1;
                return;
            }
            Above::Message => self.outline.messages.last_mut(),
        };
        let Some(message) = message else { return };
        let (parsed, oddity) = match grammar::read(statement).map(|reading| (reading.parsed, reading.oddity))
        {
            Ok((Parsed::Signal(signal), oddity)) => (Ok(*signal), oddity),
            Ok(_) => (Err("not a signal".to_owned()), None),
            Err(reason) => (Err(reason), None),
        };
        let name = statement.text.split_ascii_whitespace().nth(1).unwrap_or_default().trim_end_matches(':');
        let checked = parsed.and_then(|signal| {
            let taken = message.signals.iter().any(|other| other.parsed.name == signal.name);
            let layout = layout(&signal)?;
            if taken { Err("a signal above has the same name".to_owned()) } else { Ok((signal, layout)) }
        });
        match checked {
            Ok((parsed, layout)) => {
                if let Some(oddity) = oddity {
                    self.outline.findings.note(&place, oddity);
                }
                message.signals.push(SignalOutline { place, layout, parsed });
            }
            Err(reason) => {
                message.lost_signals.insert(name.to_owned());
                message.lost_multiplexor |= mend::may_be_multiplexor(&statement.text);
                self.outline.findings.rejected(&place, reason);
            }
        }
    }

    fn lose(&mut self, place: Place, reason: String, is_note: bool) {
        self.above = Above::Lost { place, reason, is_note, signals: 0 };
    }

    /// Ends the message above, and says what a lost one takes with it.
    fn close(&mut self) {
        let Above::Lost { place, mut reason, is_note, signals } =
            std::mem::replace(&mut self.above, Above::Nothing)
        else {
            return;
        };
        if signals > 0 {
            reason = format!("{reason} (with its signals: {signals})");
        }
        if is_note {
            self.outline.findings.note(&place, reason);
        } else {
            self.outline.findings.rejected(&place, reason);
        }
    }
}

fn layout(signal: &can_dbc::Signal) -> Result<Layout, String> {
    let start = u16::try_from(signal.start_bit).map_err(|_| "the start bit lies beyond every frame")?;
    let length = u16::try_from(signal.size).map_err(|_| "longer than every frame")?;
    let order = match signal.byte_order {
        can_dbc::ByteOrder::LittleEndian => ByteOrder::Intel,
        can_dbc::ByteOrder::BigEndian => ByteOrder::Motorola,
    };
    if !(signal.factor.is_finite() && signal.offset.is_finite()) {
        return Err("factor or offset is not a finite number".to_owned());
    }
    Ok(Layout { start, length, order, signed: signal.value_type == can_dbc::ValueType::Signed })
}
