//! A shipped vehicle as the campaign reads it from profile and DBC, with readers of its own.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::Path;

use toml::{Table, Value};

use super::wire::{Field, Sum};

/// Nanoseconds in a millisecond.
pub(crate) const MS: u64 = 1_000_000;

/// What a raw value means by the profile; a value that is not named is undefined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Meaning {
    Off,
    Left,
    Right,
    Both,
    On,
    NotAvailable,
    Fault,
}

/// A signal that the profile binds.
#[derive(Debug, Clone)]
pub(crate) struct Role {
    pub(crate) message: usize,
    pub(crate) field: Field,
    pub(crate) values: Vec<(RangeInclusive<i64>, Meaning)>,
}

#[derive(Debug, Clone)]
pub(crate) enum Turn {
    /// One enumerated signal.
    One(Role),
    /// One signal a side; `hold_ns` of lamps that flash.
    Sides { left: Role, right: Role, both_is_hazard: bool, hold_ns: Option<u64> },
}

#[derive(Debug, Clone)]
pub(crate) enum Hazard {
    Signal(Role),
    BothSides,
    NotVisible,
}

/// A message that is bound or proves the bus alive.
#[derive(Debug, Clone)]
pub(crate) struct Message {
    pub(crate) name: String,
    pub(crate) id: u32,
    pub(crate) extended: bool,
    pub(crate) length: usize,
    /// Short in a DBC with messages of CAN FD, which says nothing of its format: both are right.
    pub(crate) has_any_format: bool,
    /// The only right length, where the profile names one.
    pub(crate) right_length: Option<usize>,
    /// The longest believed silence; `None` for an event message.
    pub(crate) timeout_ns: Option<u64>,
    pub(crate) checksum: Option<(Sum, Field)>,
    /// The counter and its largest step.
    pub(crate) counter: Option<(Field, i64)>,
}

impl Message {
    /// Sent in CAN FD, since it is longer than a classic frame.
    pub(crate) fn is_fd(&self) -> bool {
        self.length > 8
    }

    pub(crate) fn accepts_format(&self, fd: bool) -> bool {
        self.has_any_format || fd == self.is_fd()
    }
}

#[derive(Debug, Clone)]
pub(crate) struct Vehicle {
    /// The profile's file name without its end.
    pub(crate) name: String,
    pub(crate) messages: Vec<Message>,
    pub(crate) turn: Turn,
    pub(crate) hazard: Hazard,
    pub(crate) turn_faults: Vec<Role>,
    pub(crate) hazard_faults: Vec<Role>,
    /// Whether a fault signal withholds the report: turn, hazard.
    pub(crate) fault_withholds: [bool; 2],
    pub(crate) alive_ns: u64,
}

impl Message {
    /// Puts the right checksum in.
    pub(crate) fn seal(&self, data: &mut [u8]) {
        if let Some((sum, field)) =
            self.checksum.as_ref().filter(|(_, field)| field.needed_bytes() <= data.len())
        {
            field.set(data, 0);
            field.set(data, sum.of(self.id, data));
        }
    }
}

impl Role {
    pub(crate) fn meaning(&self, data: &[u8]) -> Option<Meaning> {
        let raw = self.field.get(data);
        self.values.iter().find(|(values, _)| values.contains(&raw)).map(|(_, meaning)| *meaning)
    }
}

impl Vehicle {
    /// Every signal that is bound.
    pub(crate) fn roles(&self) -> Vec<&Role> {
        let turn = match &self.turn {
            Turn::One(role) => vec![role],
            Turn::Sides { left, right, .. } => vec![left, right],
        };
        let hazard = if let Hazard::Signal(role) = &self.hazard { Some(role) } else { None };
        turn.into_iter().chain(hazard).chain(&self.turn_faults).chain(&self.hazard_faults).collect()
    }

    /// Reads a profile; `None` when it reports no lights of the vehicle, or has several sources of a turn,
    /// which the oracle does not know.
    pub(crate) fn read(profile: &Path) -> Option<Self> {
        let table: Table = std::fs::read_to_string(profile).unwrap().parse().unwrap();
        let turn = table.get("turn")?.as_table().filter(|turn| !turn.contains_key("source"))?;
        let buses = table["bus"].as_table().unwrap();
        assert_eq!(buses.len(), 1, "{}: the campaign knows vehicles of one bus", profile.display());
        let bus = buses.values().next()?.as_table()?;
        let dbc = Dbc::read(&profile.parent()?.join(bus["dbc"].as_str()?));
        let mut reader = Reader { table: &table, dbc: &dbc, messages: Vec::new() };
        let sections = ["turn", "hazard"].map(|name| table[name].as_table().unwrap());
        let hazard = sections[1];
        let faults = sections.map(|section| {
            let signals =
                section.get("fault_signal").and_then(Value::as_array).map_or(&[][..], |array| array);
            signals.iter().map(|signal| reader.role(signal.as_table().unwrap())).collect::<Vec<_>>()
        });
        let [turn_faults, hazard_faults] = faults;
        let turn = reader.turn(turn);
        let hazard = match hazard["from"].as_str().unwrap() {
            "signal" | "reason" => Hazard::Signal(reader.role(hazard)),
            "both_sides" => Hazard::BothSides,
            "not_visible" => Hazard::NotVisible,
            other => panic!("{}: the campaign does not know hazard from {other}", profile.display()),
        };
        for name in bus.get("heartbeat_messages").and_then(Value::as_array).into_iter().flatten() {
            reader.message(name.as_str().unwrap());
        }
        let shortest = reader.messages.iter().filter_map(|message| message.timeout_ns).min().unwrap_or(0);
        let alive = bus.get("alive_timeout_ms").and_then(Value::as_integer);
        Some(Self {
            name: profile.file_stem()?.to_str()?.to_owned(),
            turn,
            hazard,
            turn_faults,
            hazard_faults,
            fault_withholds: sections
                .map(|section| section.get("on_fault").is_some_and(|is| is.as_str() == Some("withhold"))),
            alive_ns: alive.map_or(shortest.max(1000 * MS), |ms| ms.cast_unsigned() * MS),
            messages: reader.messages,
        })
    }
}

/// Collects the messages of a profile.
struct Reader<'a> {
    table: &'a Table,
    dbc: &'a Dbc,
    messages: Vec<Message>,
}

impl Reader<'_> {
    fn turn(&mut self, turn: &Table) -> Turn {
        if turn.contains_key("signal") {
            return Turn::One(self.role(turn));
        }
        let side = |reader: &mut Self, name: &str| reader.role(turn[name].as_table().unwrap());
        let (left, right) = (side(self, "left_signal"), side(self, "right_signal"));
        let is_lamp = turn.get("kind").is_some_and(|kind| kind.as_str() == Some("lamp"));
        let given = turn.get("lamp").and_then(|lamp| lamp.get("period_ms")).and_then(Value::as_integer);
        let period_ms = || {
            given.or(self.dbc.messages[&self.messages[left.message].name].cycle_ms).unwrap().cast_unsigned()
        };
        // A message up to 136 ms apart: legal darkness and three spacings.
        let hold_ns = is_lamp.then(|| 700 * MS + 3 * (period_ms() * MS * 11 / 10));
        let both_is_hazard = turn["both_on"].as_str() == Some("hazard");
        Turn::Sides { left, right, both_is_hazard, hold_ns }
    }

    fn role(&mut self, keys: &Table) -> Role {
        let signal = keys["signal"].as_str().unwrap();
        let (message, name) =
            signal.rsplit_once(':').map_or(signal, |(_, name)| name).split_once('.').unwrap();
        let field = self.dbc.messages[message].fields[name].clone();
        let named = [
            ("off", Meaning::Off),
            ("left", Meaning::Left),
            ("right", Meaning::Right),
            ("both", Meaning::Both),
            ("on", Meaning::On),
            ("not_available", Meaning::NotAvailable),
            ("fault", Meaning::Fault),
        ];
        let mut values: Vec<_> = named
            .into_iter()
            .flat_map(|(key, meaning)| raw_values(keys.get(key)).map(move |raw| (raw, meaning)))
            .collect();
        for reason in keys.get("reasons").and_then(Value::as_table).into_iter().flatten() {
            values.extend(raw_values(Some(reason.1)).map(|raw| (raw, Meaning::On)));
        }
        Role { message: self.message(message), field, values }
    }

    /// The position of a message, which is read when it is met first.
    fn message(&mut self, name: &str) -> usize {
        if let Some(known) = self.messages.iter().position(|message| message.name == name) {
            return known;
        }
        let dbc = &self.dbc.messages[name];
        let keys = self.table.get("message").and_then(|messages| messages.get(name));
        let key = |name: &str| keys.and_then(|keys| keys.get(name));
        let field = |keys: &Value| dbc.fields[keys["signal"].as_str().unwrap()].clone();
        let is_event = key("timing").is_some_and(|timing| timing.as_str() == Some("event"));
        let by_cycle = || dbc.cycle_ms.map(|ms| (5 * ms).max(200));
        let timeout_ms = key("timeout_ms").and_then(Value::as_integer).or_else(by_cycle);
        self.messages.push(Message {
            name: name.to_owned(),
            id: dbc.id & 0x1FFF_FFFF,
            extended: dbc.id & 0x8000_0000 != 0,
            length: dbc.length,
            has_any_format: dbc.length <= 8 && self.dbc.messages.values().any(|other| other.length > 8),
            right_length: key("length")
                .and_then(Value::as_integer)
                .map(|length| usize::try_from(length).unwrap()),
            timeout_ns: timeout_ms.filter(|_| !is_event).map(|ms| ms.cast_unsigned() * MS),
            checksum: key("checksum").map(|keys| (sum(keys), field(keys))),
            counter: key("counter")
                .map(|keys| (field(keys), keys.get("max_step").and_then(Value::as_integer).unwrap_or(1))),
        });
        self.messages.len() - 1
    }
}

fn sum(keys: &Value) -> Sum {
    match keys["kind"].as_str().unwrap() {
        "honda" => Sum::Honda,
        "psa" => Sum::Psa(u32::try_from(keys["start"].as_integer().unwrap()).unwrap()),
        "subaru" | "tesla" => Sum::Identifier,
        "mazda" => Sum::Mazda,
        other => panic!("the campaign does not know the checksum {other}"),
    }
}

/// Raw values of a key: numbers, and ranges or hexadecimal numbers as text.
fn raw_values(key: Option<&Value>) -> impl Iterator<Item = RangeInclusive<i64>> {
    let number = |text: &str| {
        text.strip_prefix("0x")
            .map_or_else(|| text.parse(), |digits| i64::from_str_radix(digits, 16))
            .unwrap()
    };
    let range = move |value: &Value| match value {
        Value::Integer(raw) => *raw..=*raw,
        Value::String(text) => match text.split_once("..=") {
            Some((low, high)) => number(low)..=number(high),
            None => number(text)..=number(text),
        },
        Value::Float(_) | Value::Boolean(_) | Value::Datetime(_) | Value::Array(_) | Value::Table(_) => {
            panic!("{value} is not a raw value")
        }
    };
    key.and_then(Value::as_array).into_iter().flatten().map(range).collect::<Vec<_>>().into_iter()
}

/// As much of a DBC file as a profile needs.
struct Dbc {
    messages: BTreeMap<String, DbcMessage>,
}

struct DbcMessage {
    id: u32,
    length: usize,
    fields: BTreeMap<String, Field>,
    cycle_ms: Option<i64>,
}

impl Dbc {
    fn read(path: &Path) -> Self {
        let bytes = std::fs::read(path).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        let (mut messages, mut last) = (BTreeMap::new(), String::new());
        for line in text.lines() {
            let words: Vec<_> = line.split([' ', '\t', ':', ';']).filter(|word| !word.is_empty()).collect();
            match words.as_slice() {
                ["BO_", id, name, length, ..] => {
                    (*name).clone_into(&mut last);
                    let (id, length) = (id.parse().unwrap(), length.parse().unwrap());
                    let message = DbcMessage { id, length, fields: BTreeMap::new(), cycle_ms: None };
                    messages.insert(last.clone(), message);
                }
                ["SG_", name, layout, ..] if layout.contains('@') => {
                    let fields = &mut messages.get_mut(&last).unwrap().fields;
                    fields.insert((*name).to_owned(), field(layout));
                }
                ["BA_", "\"GenMsgCycleTime\"", "BO_", id, ms] => {
                    let (id, ms): (u32, i64) = (id.parse().unwrap(), ms.parse().unwrap());
                    let named = messages.values_mut().filter(|message| message.id == id);
                    named.for_each(|message| message.cycle_ms = Some(ms).filter(|ms| *ms > 0));
                }
                _ => {}
            }
        }
        Self { messages }
    }
}

/// `START|LENGTH@ORDER SIGN`
fn field(layout: &str) -> Field {
    let numbers: Vec<usize> =
        layout.split(['|', '@', '+', '-']).filter_map(|part| part.parse().ok()).collect();
    Field::new(numbers[0], numbers[1], numbers[2] == 1, layout.ends_with('-'))
}
