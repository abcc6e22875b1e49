//! Parses single statements with the `can-dbc` grammar and repairs statements that allow only one
//! interpretation.

use std::ops::RangeInclusive;
use std::sync::Arc;

use can_dbc::{
    AttributeDefinition, AttributeValue, AttributeValueType, Dbc, DbcError, MessageId,
    SignalExtendedValueType, ValDescription, ValueDescription,
};

use super::finding::Reason;
use super::model::Number;
use super::repair;
use super::statement::{Statement, is_keyword};

/// Attribute with the period of a message in milliseconds.
const CYCLE_TIME: &str = "GenMsgCycleTime";

/// Attribute with the format of the frames of a message, an index into the list of its definition.
const FRAME_FORMAT: &str = "VFrameFormat";

/// Attributes with the full name of a message or signal whose name in the file is cut to 32 characters.
const LONG_NAME: [&str; 2] = ["SystemMessageLongSymbol", "SystemSignalLongSymbol"];

/// Largest length of a statement in bytes. The grammar needs 25 times as much memory to parse it.
const MAX_STATEMENT: usize = 1 << 20;

/// Names of raw values in file order; shared by the signals of a table.
pub(super) type Values = Arc<[(i128, String)]>;

/// Parsed content of a statement, as far as the gateway uses it.
#[derive(Debug)]
pub(super) enum Parsed {
    Message {
        id: u32,
        name: String,
        length: u64,
    },
    /// A signal of the preceding message.
    Signal(Box<can_dbc::Signal>),
    Table {
        name: String,
        values: Values,
    },
    /// Default period in ms for all messages of the file; `None` for 0.
    DefaultCycle(Option<u32>),
    FrameFormats(Vec<String>),
    DefaultFrameFormat(EnumValue),
    Detail(Property),
    Nothing,
}

/// A property of a message or of one of its signals.
#[derive(Debug)]
pub(super) struct Property {
    /// Number of the message in the file, including the flag bit.
    pub(super) number: u32,
    /// Name of the signal; `None` for a property of the message.
    pub(super) signal: Option<String>,
    pub(super) detail: Detail,
}

/// The content of a property.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Detail {
    /// Period of the message in ms; `None` for 0.
    Cycle(Option<u32>),
    FrameFormat(EnumValue),
    LongName(String),
    /// Names of the values of a signal.
    Values(Values),
    /// The same as the name of a table.
    ValuesByTable(String),
    Number(Number),
    Multiplexed(MultiplexRule),
    /// An unreadable statement about the multiplexor of a signal.
    UnreadableMultiplexing,
}

/// Content of an `SG_MUL_VAL_` statement for one signal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct MultiplexRule {
    pub(super) multiplexor: String,
    /// Multiplexor values for which the signal is present; empty when unreadable.
    pub(super) ranges: Vec<RangeInclusive<u64>>,
}

impl Detail {
    /// Returns the number of entries that count towards [`MAX_ENTRIES`](super::model::MAX_ENTRIES).
    pub(super) fn entries(&self) -> usize {
        1 + match self {
            Self::Values(values) => values.len(),
            Self::Multiplexed(rule) => rule.ranges.len(),
            Self::Cycle(_)
            | Self::FrameFormat(_)
            | Self::LongName(_)
            | Self::ValuesByTable(_)
            | Self::Number(_)
            | Self::UnreadableMultiplexing => 0,
        }
    }
}

/// A value of an enumerated attribute.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum EnumValue {
    /// Position in the list of the definition.
    Index(usize),
    /// Name of the value, as in defaults.
    Name(String),
}

/// A parsed statement, with the irregularity that was repaired or accepted, if any.
#[derive(Debug)]
pub(super) struct ParsedStatement {
    pub(super) parsed: Parsed,
    pub(super) irregularity: Option<String>,
}

/// Parses one statement; the error is the text of the finding.
pub(super) fn read(statement: &Statement<'_>) -> Result<ParsedStatement, Reason> {
    let text = statement.text.as_ref();
    if text.len() > MAX_STATEMENT {
        return Err(format!("longer than {} MiB", MAX_STATEMENT >> 20).into());
    }
    let plain =
        |parsed: Result<Parsed, Reason>| parsed.map(|parsed| ParsedStatement { parsed, irregularity: None });
    check_colon(statement.keyword(), text)?;
    match statement.keyword() {
        "BO_" => repaired(text, repair::message, read_message),
        "SG_" => repaired(text, repair::signal, read_signal),
        "VAL_TABLE_" => plain(read_table(text)),
        "VAL_" => plain(read_values(text)),
        "SIG_VALTYPE_" => plain(read_number(text)),
        "SG_MUL_VAL_" => plain(read_multiplexing(text)),
        "BA_" => plain(read_attribute(text)),
        "BA_DEF_" => plain(read_definition(text)),
        "BA_DEF_DEF_" => plain(read_default(text)),
        // A list of names, which the grammar need not parse.
        "NS_" => plain(Ok(Parsed::Nothing)),
        keyword if is_keyword(keyword) => plain(read_unused(text)),
        _ => Err("not a DBC statement".into()),
    }
}

/// Fails if the colon of a statement that needs one is missing.
fn check_colon(keyword: &str, text: &str) -> Result<(), Reason> {
    let words = match keyword {
        "BO_" => 3,
        "SG_" => 2,
        _ => return Ok(()),
    };
    if text.split('"').next().unwrap_or_default().contains(':') {
        return Ok(());
    }
    let head: Vec<_> = text.split_ascii_whitespace().take(words).collect();
    Err(format!("expected \":\" after {:?}", head.join(" ")).into())
}

/// Parses the text as it is or, when that fails, as repaired.
fn repaired(
    text: &str,
    repair: fn(&str) -> Option<String>,
    read: fn(&str) -> Result<Parsed, Reason>,
) -> Result<ParsedStatement, Reason> {
    match read(text) {
        Ok(parsed) => Ok(ParsedStatement { irregularity: repair::irregularity(text), parsed }),
        Err(reason) => match repair(text).map(|text| read(&text)) {
            Some(Ok(parsed)) => {
                Ok(ParsedStatement { parsed, irregularity: Some(format!("{reason}; repaired")) })
            }
            Some(Err(_)) | None => Err(reason),
        },
    }
}

fn read_message(text: &str) -> Result<Parsed, Reason> {
    let message = one(parse(text)?.messages)?;
    let id = checked_id(text, message.id)?;
    Ok(Parsed::Message { id, name: message.name, length: message.size })
}

fn read_signal(text: &str) -> Result<Parsed, Reason> {
    // The grammar accepts signals only inside a message.
    let message = one(parse(&format!("BO_ 0 M: 8 N\n{text}"))?.messages)?;
    if repair::has_bare_multiplex_mark(text) {
        return Err("the multiplexer value after `m` is missing".into());
    }
    Ok(Parsed::Signal(Box::new(one(message.signals)?)))
}

fn read_table(text: &str) -> Result<Parsed, Reason> {
    let table = one(parse(text)?.value_tables)?;
    Ok(Parsed::Table { name: table.name, values: named(table.descriptions) })
}

fn read_values(text: &str) -> Result<Parsed, Reason> {
    let parsed = parse(text);
    if parsed.is_err()
        && let Some((number, signal, table)) = repair::table_reference(text)
    {
        let detail = Detail::ValuesByTable(table.to_owned());
        return Ok(Parsed::Detail(Property { number, signal: Some(signal.to_owned()), detail }));
    }
    match one(parsed?.value_descriptions)? {
        ValueDescription::Signal { message_id, name, value_descriptions } => {
            property(text, message_id, Some(name), Detail::Values(named(value_descriptions)))
        }
        ValueDescription::EnvironmentVariable { .. } => Ok(Parsed::Nothing),
    }
}

fn read_number(text: &str) -> Result<Parsed, Reason> {
    let types = one(parse(text)?.signal_extended_value_type_list)?;
    let number = match types.signal_extended_value_type {
        SignalExtendedValueType::SignedOrUnsignedInteger => Number::Integer,
        SignalExtendedValueType::IEEEfloat32Bit => Number::Float32,
        SignalExtendedValueType::IEEEdouble64bit => Number::Float64,
    };
    property(text, types.message_id, Some(types.signal_name), Detail::Number(number))
}

fn read_multiplexing(text: &str) -> Result<Parsed, Reason> {
    let multiplex = one(parse(text)?.extended_multiplex)?;
    let ranges: Vec<_> = multiplex.mappings.iter().map(|range| range.min_value..=range.max_value).collect();
    if ranges.iter().any(RangeInclusive::is_empty) {
        return Err("a range ends before it begins".into());
    }
    let rule = MultiplexRule { multiplexor: multiplex.multiplexor_signal_name, ranges };
    property(text, multiplex.message_id, Some(multiplex.signal_name), Detail::Multiplexed(rule))
}

fn read_attribute(text: &str) -> Result<Parsed, Reason> {
    let parsed = parse(text)?;
    if let Some(attribute) = parsed.attribute_values_signal.into_iter().next() {
        let Some(name) = long_name(&attribute.name, LONG_NAME[1], attribute.value)? else {
            return Ok(Parsed::Nothing);
        };
        return property(text, attribute.message_id, Some(attribute.signal_name), Detail::LongName(name));
    }
    let Some(attribute) = parsed.attribute_values_message.into_iter().next() else {
        return Ok(Parsed::Nothing);
    };
    let detail = match attribute.name.as_str() {
        CYCLE_TIME => Detail::Cycle(milliseconds(&attribute.value)?),
        FRAME_FORMAT => Detail::FrameFormat(enum_value(attribute.value)?),
        name => match long_name(name, LONG_NAME[0], attribute.value)? {
            Some(name) => Detail::LongName(name),
            None => return Ok(Parsed::Nothing),
        },
    };
    property(text, attribute.message_id, None, detail)
}

/// Returns the long name in the value of an attribute; `None` for another attribute, and for an empty name.
fn long_name(attribute: &str, wanted: &str, value: AttributeValue) -> Result<Option<String>, Reason> {
    match value {
        _ if attribute != wanted => Ok(None),
        AttributeValue::String(name) if name.is_empty() => Ok(None),
        // Excludes the separators of profiles, `BUS:MESSAGE.SIGNAL`, among others.
        AttributeValue::String(name) if name.chars().all(|char| char.is_alphanumeric() || char == '_') => {
            Ok(Some(name))
        }
        AttributeValue::String(_)
        | AttributeValue::Uint(_)
        | AttributeValue::Int(_)
        | AttributeValue::Double(_) => Err("a name has only letters, digits and underscores".into()),
    }
}

fn read_definition(text: &str) -> Result<Parsed, Reason> {
    let parsed = parse(text)?;
    if used(&parsed) > 0 {
        return Err("followed by another statement on the same line".into());
    }
    Ok(match parsed.attribute_definitions.into_iter().next() {
        Some(AttributeDefinition::Message(name, AttributeValueType::Enum(names))) if name == FRAME_FORMAT => {
            Parsed::FrameFormats(names)
        }
        _ => Parsed::Nothing,
    })
}

fn read_default(text: &str) -> Result<Parsed, Reason> {
    let Some(default) = parse(text)?.attribute_defaults.into_iter().next() else {
        return Ok(Parsed::Nothing);
    };
    match default.name.as_str() {
        CYCLE_TIME => milliseconds(&default.value).map(Parsed::DefaultCycle),
        FRAME_FORMAT => enum_value(default.value).map(Parsed::DefaultFrameFormat),
        _ => Ok(Parsed::Nothing),
    }
}

fn enum_value(value: AttributeValue) -> Result<EnumValue, Reason> {
    let index = match value {
        AttributeValue::String(name) => return Ok(EnumValue::Name(name)),
        AttributeValue::Uint(index) => usize::try_from(index).ok(),
        AttributeValue::Int(index) => usize::try_from(index).ok(),
        AttributeValue::Double(_) => None,
    };
    index.map(EnumValue::Index).ok_or_else(|| "not a position in a list".into())
}

fn read_unused(text: &str) -> Result<Parsed, Reason> {
    match used(&parse(text)?) {
        0 => Ok(Parsed::Nothing),
        _ => Err("followed by another statement on the same line".into()),
    }
}

/// Returns a period in ms; `None` for 0, which means no period.
fn milliseconds(value: &AttributeValue) -> Result<Option<u32>, Reason> {
    let whole = match value {
        AttributeValue::Uint(value) => u32::try_from(*value).ok(),
        AttributeValue::Int(value) => u32::try_from(*value).ok(),
        // Exact for every u32: the text of a whole number has no decimal point.
        AttributeValue::Double(value) => {
            format!("{value:.0}").parse().ok().filter(|n| (f64::from(*n) - value).abs() < 1e-9)
        }
        AttributeValue::String(text) => text.parse().ok(),
    };
    whole.map(|ms| (ms > 0).then_some(ms)).ok_or_else(|| "not a whole number of milliseconds".into())
}

fn named(descriptions: Vec<ValDescription>) -> Values {
    let unescaped = |text: String| text.replace("\\\"", "\"");
    descriptions.into_iter().map(|value| (i128::from(value.id), unescaped(value.description))).collect()
}

fn property(text: &str, id: MessageId, signal: Option<String>, detail: Detail) -> Result<Parsed, Reason> {
    Ok(Parsed::Detail(Property { number: checked_id(text, id)?, signal, detail }))
}

/// Returns the identifier in the file, checked against the identifier that the grammar returns, since the
/// grammar drops bits that do not fit.
fn checked_id(text: &str, parsed: MessageId) -> Result<u32, Reason> {
    let mut fields = text.split('"').step_by(2).flat_map(str::split_ascii_whitespace).skip(1);
    let id = fields.find(|field| !matches!(*field, "BO_" | "SG_")).and_then(|field| field.parse().ok());
    let id: u32 = id.ok_or("no 32-bit message id")?;
    match MessageId::try_from(id) {
        Ok(same) if same == parsed => Ok(id),
        Ok(_) | Err(_) => Err("ambiguous message id".into()),
    }
}

/// Returns the only item; fails when the statement was parsed as no item or several.
fn one<T>(mut items: Vec<T>) -> Result<T, Reason> {
    match (items.pop(), items.is_empty()) {
        (Some(item), true) => Ok(item),
        _ => Err("not one statement of its kind".into()),
    }
}

fn parse(text: &str) -> Result<Dbc, Reason> {
    let parsed = Dbc::try_from(format!("{text}\n").as_str()).map_err(|error| reason(&error))?;
    if used(&parsed) > 1 { Err("followed by another statement on the same line".into()) } else { Ok(parsed) }
}

/// Returns the number of statements of used kinds, since the grammar accepts several on one line.
fn used(parsed: &Dbc) -> usize {
    parsed.messages.len()
        + parsed.value_tables.len()
        + parsed.value_descriptions.len()
        + parsed.signal_extended_value_type_list.len()
        + parsed.extended_multiplex.len()
        + parsed.attribute_values_message.len()
        + parsed.attribute_values_signal.len()
        + parsed.attribute_defaults.len()
}

/// Returns the error of the grammar as one short line.
fn reason(error: &DbcError) -> String {
    let DbcError::Pest(error) = error else {
        return error.to_string();
    };
    let message = error.variant.message();
    // The name of the grammar's first rule means nothing to a reader.
    if message.contains("EOI") || message.contains("file") || message.len() > 100 {
        "not DBC syntax".to_owned()
    } else {
        message.into_owned()
    }
}
