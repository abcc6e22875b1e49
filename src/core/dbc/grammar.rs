//! One statement at a time through the `can-dbc` grammar, and mended where only one reading is left.

use std::ops::RangeInclusive;

use can_dbc::{
    AttributeValue, Dbc, DbcError, MessageId, SignalExtendedValueType, ValDescription, ValueDescription,
};

use super::mend;
use super::model::Number;
use super::statement::{Statement, is_keyword};

/// The attribute that carries a message's period in milliseconds.
const CYCLE_TIME: &str = "GenMsgCycleTime";

/// Names of raw values.
pub(super) type Values = Vec<(i128, String)>;

/// What a statement says, as far as it matters here.
#[derive(Debug)]
pub(super) enum Parsed {
    /// A message begins.
    Message { id: u32, name: String, length: u64 },
    /// A signal of the message above.
    Signal(Box<can_dbc::Signal>),
    /// A value table to refer to.
    Table { name: String, values: Values },
    /// The file's default period; `None` when it is 0.
    DefaultCycle(Option<u32>),
    /// Something about a message or a signal of it.
    Detail { id: u32, detail: Detail },
    /// Nothing that is needed.
    Nothing,
}

/// Something about a message or a signal of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Detail {
    /// Period in milliseconds; `None` when it is 0.
    Cycle(Option<u32>),
    /// Names of a signal's values.
    Values { signal: String, values: Values },
    /// The same, by the name of a table.
    ValuesByTable { signal: String, table: String },
    /// What a signal's bits are.
    Number { signal: String, number: Number },
    /// When a signal is present.
    Multiplexed { signal: String, multiplexor: String, ranges: Vec<RangeInclusive<u64>> },
    /// The same, unreadable.
    MultiplexedSomehow { signal: String },
}

/// A statement that could be read, with what was odd about it.
#[derive(Debug)]
pub(super) struct Reading {
    pub(super) parsed: Parsed,
    pub(super) oddity: Option<String>,
}

/// Reads one statement; the error is the reason for people.
pub(super) fn read(statement: &Statement<'_>) -> Result<Reading, String> {
    let text = statement.text.as_ref();
    let plain = |parsed: Result<Parsed, String>| parsed.map(|parsed| Reading { parsed, oddity: None });
    match statement.keyword() {
        "BO_" => mended(text, mend::message, read_message),
        "SG_" => mended(text, mend::signal, read_signal),
        "VAL_TABLE_" => plain(read_table(text)),
        "VAL_" => plain(read_values(text)),
        "SIG_VALTYPE_" => plain(read_number(text)),
        "SG_MUL_VAL_" => plain(read_multiplexing(text)),
        "BA_" => plain(read_attribute(text)),
        "BA_DEF_DEF_" => plain(read_default(text)),
        // Only names: read here as a list, not by the grammar.
        "NS_" => plain(Ok(Parsed::Nothing)),
        keyword if is_keyword(keyword) => plain(read_unneeded(text)),
        _ => Err("no DBC statement begins like this".to_owned()),
    }
}

/// Reads the text as it stands, or else as `mend` would have it.
fn mended(
    text: &str,
    mend: fn(&str) -> Option<String>,
    read: fn(&str) -> Result<Parsed, String>,
) -> Result<Reading, String> {
    match read(text) {
        Ok(parsed) => Ok(Reading { oddity: mend::oddity(text), parsed }),
        Err(reason) => match mend(text).map(|text| read(&text)) {
            Some(Ok(parsed)) => {
                Ok(Reading { parsed, oddity: Some(format!("{reason}; its meaning is plain")) })
            }
            Some(Err(_)) | None => Err(reason),
        },
    }
}

fn read_message(text: &str) -> Result<Parsed, String> {
    let message = one(parse(text)?.messages)?;
    let id = checked_id(text, message.id)?;
    Ok(Parsed::Message { id, name: message.name, length: message.size })
}

fn read_signal(text: &str) -> Result<Parsed, String> {
    // The grammar knows signals only inside a message.
    let message = one(parse(&format!("BO_ 0 M: 8 N\n{text}"))?.messages)?;
    if mend::has_bare_multiplex_mark(text) {
        return Err("the multiplexer value after `m` is missing".to_owned());
    }
    Ok(Parsed::Signal(Box::new(one(message.signals)?)))
}

fn read_table(text: &str) -> Result<Parsed, String> {
    let table = one(parse(text)?.value_tables)?;
    Ok(Parsed::Table { name: table.name, values: named(table.descriptions) })
}

fn read_values(text: &str) -> Result<Parsed, String> {
    let parsed = parse(text);
    if parsed.is_err()
        && let Some((id, signal, table)) = mend::table_reference(text)
    {
        let detail = Detail::ValuesByTable { signal: signal.to_owned(), table: table.to_owned() };
        return Ok(Parsed::Detail { id, detail });
    }
    match one(parsed?.value_descriptions)? {
        ValueDescription::Signal { message_id, name, value_descriptions } => {
            let detail = Detail::Values { signal: name, values: named(value_descriptions) };
            Ok(Parsed::Detail { id: checked_id(text, message_id)?, detail })
        }
        ValueDescription::EnvironmentVariable { .. } => Ok(Parsed::Nothing),
    }
}

fn read_number(text: &str) -> Result<Parsed, String> {
    let types = one(parse(text)?.signal_extended_value_type_list)?;
    let number = match types.signal_extended_value_type {
        SignalExtendedValueType::SignedOrUnsignedInteger => Number::Integer,
        SignalExtendedValueType::IEEEfloat32Bit => Number::Float32,
        SignalExtendedValueType::IEEEdouble64bit => Number::Float64,
    };
    let detail = Detail::Number { signal: types.signal_name, number };
    Ok(Parsed::Detail { id: checked_id(text, types.message_id)?, detail })
}

fn read_multiplexing(text: &str) -> Result<Parsed, String> {
    let multiplex = one(parse(text)?.extended_multiplex)?;
    let ranges: Vec<_> = multiplex.mappings.iter().map(|range| range.min_value..=range.max_value).collect();
    if ranges.iter().any(RangeInclusive::is_empty) {
        return Err("a range ends before it begins".to_owned());
    }
    let (signal, multiplexor) = (multiplex.signal_name, multiplex.multiplexor_signal_name);
    let detail = Detail::Multiplexed { signal, multiplexor, ranges };
    Ok(Parsed::Detail { id: checked_id(text, multiplex.message_id)?, detail })
}

fn read_attribute(text: &str) -> Result<Parsed, String> {
    let attributes = parse(text)?.attribute_values_message;
    match attributes.into_iter().find(|attribute| attribute.name == CYCLE_TIME) {
        Some(attribute) => {
            let detail = Detail::Cycle(milliseconds(&attribute.value)?);
            Ok(Parsed::Detail { id: checked_id(text, attribute.message_id)?, detail })
        }
        None => Ok(Parsed::Nothing),
    }
}

fn read_default(text: &str) -> Result<Parsed, String> {
    let defaults = parse(text)?.attribute_defaults;
    match defaults.iter().find(|default| default.name == CYCLE_TIME) {
        Some(default) => milliseconds(&default.value).map(Parsed::DefaultCycle),
        None => Ok(Parsed::Nothing),
    }
}

fn read_unneeded(text: &str) -> Result<Parsed, String> {
    match needed(&parse(text)?) {
        0 => Ok(Parsed::Nothing),
        _ => Err("goes on with another statement".to_owned()),
    }
}

/// A period; `None` for 0, which says that there is none.
fn milliseconds(value: &AttributeValue) -> Result<Option<u32>, String> {
    let whole = match value {
        AttributeValue::Uint(value) => u32::try_from(*value).ok(),
        AttributeValue::Int(value) => u32::try_from(*value).ok(),
        // Exact for every u32, and the text of a whole number has no point.
        AttributeValue::Double(value) => {
            format!("{value:.0}").parse().ok().filter(|n| (f64::from(*n) - value).abs() < 1e-9)
        }
        AttributeValue::String(text) => text.parse().ok(),
    };
    whole.map(|ms| (ms > 0).then_some(ms)).ok_or_else(|| "not a whole number of milliseconds".to_owned())
}

fn named(descriptions: Vec<ValDescription>) -> Values {
    let unescaped = |text: String| text.replace("\\\"", "\"");
    descriptions.into_iter().map(|value| (i128::from(value.id), unescaped(value.description))).collect()
}

/// The id as the file has it. The grammar's own drops bits that do not fit, so the two are compared.
fn checked_id(text: &str, parsed: MessageId) -> Result<u32, String> {
    let mut words = text.split('"').step_by(2).flat_map(str::split_ascii_whitespace).skip(1);
    let id = words.find(|word| *word != "BO_").and_then(|word| word.parse().ok());
    let id: u32 = id.ok_or("no 32-bit message id")?;
    match MessageId::try_from(id) {
        Ok(same) if same == parsed => Ok(id),
        Ok(_) | Err(_) => Err("the message id is not clear".to_owned()),
    }
}

/// Exactly one: the statement was not what it seemed otherwise.
fn one<T>(mut items: Vec<T>) -> Result<T, String> {
    match (items.pop(), items.is_empty()) {
        (Some(item), true) => Ok(item),
        _ => Err("not one statement of its kind".to_owned()),
    }
}

fn parse(text: &str) -> Result<Dbc, String> {
    let parsed = Dbc::try_from(format!("{text}\n").as_str()).map_err(|error| reason(&error))?;
    if needed(&parsed) > 1 { Err("goes on with another statement".to_owned()) } else { Ok(parsed) }
}

/// How many statements of the kinds that matter here: the grammar takes several on one line.
fn needed(parsed: &Dbc) -> usize {
    parsed.messages.len()
        + parsed.value_tables.len()
        + parsed.value_descriptions.len()
        + parsed.signal_extended_value_type_list.len()
        + parsed.extended_multiplex.len()
        + parsed.attribute_values_message.len()
        + parsed.attribute_defaults.len()
}

/// The grammar's complaint in one short line.
fn reason(error: &DbcError) -> String {
    let DbcError::Pest(error) = error else {
        return error.to_string();
    };
    let message = error.variant.message();
    if message.contains("EOI") || message.len() > 100 {
        "not DBC syntax".to_owned()
    } else {
        message.into_owned()
    }
}
