//! Reads TOML as values with their locations.

use std::ops::Range;
use std::rc::Rc;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::location::{KeyPath, Location, MAX_DEPTH, Text};
use super::problem::{Position, Problem};
use super::value::{Entry, Kind, Value};

/// Maximum number of tokens in a document, counted by the characters that begin or end them.
const MAX_TOKENS: usize = 600_000;

/// Reads a TOML document; `see` names the document that explains its keys.
///
/// # Errors
/// Fails for the first violation of TOML, or for too deep nesting.
pub(crate) fn from_toml(text: &Text, see: &str) -> Result<Value, Problem> {
    if let Some(offset) = too_many_tokens(&text.content) {
        let reason = format!("more than {MAX_TOKENS} lines, values and tables");
        return Err(text.problem(text.position(offset), &reason, "split the file"));
    }
    let table = DeTable::parse(&text.content).map_err(|error| {
        let span = error.span().unwrap_or_default();
        let (reason, remedy) = breach(text, error.message(), span.clone());
        let remedy = remedy.map_or_else(|| format!("see {see} for every key"), str::to_owned);
        text.problem(text.position(span.start), &reason, &remedy)
    })?;
    let key = KeyPath::root();
    let kind = map(text, table.get_ref(), &key, 1)?;
    Ok(Value { location: Location { position: Position::START, key }, kind })
}

/// Returns the byte of the first token beyond the limit; the parser uses a few hundred bytes of memory for
/// each.
fn too_many_tokens(content: &str) -> Option<usize> {
    let of = |tokens: &'static [u8]| {
        content.bytes().enumerate().filter(move |(_, byte)| tokens.contains(byte)).map(|(offset, _)| offset)
    };
    // Numbers also contain points.
    of(b"\n=,[{").nth(MAX_TOKENS).or_else(|| of(b".").nth(2 * MAX_TOKENS))
}

/// Returns the reason and the remedy for a violation of TOML; no remedy if the reason is sufficient.
fn breach(text: &Text, message: &str, span: Range<usize>) -> (String, Option<&'static str>) {
    if message == "duplicate key" {
        let name = text.content.get(span.clone()).unwrap_or_default();
        let line_of = |line: &str| line.split(['=', '#']).next().unwrap_or_default().trim().to_owned();
        let line = text.position(span.start).line;
        let lines: Vec<_> = text.content.lines().take(line).map(line_of).collect();
        let same =
            lines.split_last().and_then(|(last, before)| before.iter().rposition(|other| other == last));
        let first = same.map_or(String::new(), |index| format!(", first on line {}", index + 1));
        return (format!("{name} is given twice{first}"), Some("put both together, or remove one"));
    }
    if let Some(word) = unquoted(text, span.clone()) {
        return (format!("expected a value, found {word}"), Some("write a text in quotes: \"…\""));
    }
    let known = [
        ("must be quoted", "write it in quotes: \"…\""),
        ("basic string", "close the text with a quote on the same line"),
        ("literal string", "close the text with a quote on the same line"),
        ("expected `=`", "write KEY = VALUE, and a table as [NAME]"),
        ("invalid boolean", "write true or false, in small letters"),
    ];
    let remedy = known.into_iter().find(|(part, _)| message.contains(part)).map(|(_, remedy)| remedy);
    (message.to_owned(), remedy)
}

/// Returns the unquoted text of a value around a violation. The reader treats a text that begins like `true`,
/// `nan` or a number as such, with the violation somewhere inside.
fn unquoted(text: &Text, span: Range<usize>) -> Option<&str> {
    let (_, line) =
        text.content.get(..span.start)?.rsplit_once('\n').unwrap_or(("", &text.content[..span.start]));
    let start = span.start - line.len() + line.find('=')? + 1;
    let value = text.content.get(start..)?.lines().next()?.split('#').next()?.trim();
    let is_word = |char: char| char.is_ascii_alphanumeric() || "_-./".contains(char);
    let is_boolean = value.eq_ignore_ascii_case("true") || value.eq_ignore_ascii_case("false");
    (value.starts_with(|first: char| first.is_ascii_alphabetic())
        && value.chars().all(is_word)
        && !is_boolean)
        .then_some(value)
}

fn map(text: &Text, table: &DeTable<'_>, key: &Rc<KeyPath>, depth: usize) -> Result<Kind, Problem> {
    let mut pairs: Vec<_> = table.iter().collect();
    // The table is sorted by name; phases are set in the order they were written.
    pairs.sort_by_key(|(name, _)| name.span().start);
    let mut entries = Vec::new();
    for (name, content) in pairs {
        let key = KeyPath::below(key, ".", &spelled(name.get_ref()));
        let location = Location { position: text.position(name.span().start), key: Rc::clone(&key) };
        let value = value(text, content, key, depth)?;
        entries.push(Entry { key: name.get_ref().to_string(), location, value });
    }
    Ok(Kind::Map(entries))
}

fn value(
    text: &Text,
    given: &Spanned<DeValue<'_>>,
    key: Rc<KeyPath>,
    depth: usize,
) -> Result<Value, Problem> {
    let position = text.position(given.span().start);
    if depth >= MAX_DEPTH {
        return Err(text.problem(position, "nested too deeply", "nest less deeply"));
    }
    let plain = |text: &str| Kind::Scalar { text: text.to_owned(), is_quoted: false };
    let kind = match given.get_ref() {
        DeValue::String(content) => Kind::Scalar { text: content.to_string(), is_quoted: true },
        DeValue::Integer(number) => {
            let decimal = i128::from_str_radix(number.as_str(), number.radix());
            plain(&decimal.map_or_else(|_| number.as_str().to_owned(), |decimal| decimal.to_string()))
        }
        DeValue::Float(number) => plain(number.as_str()),
        DeValue::Boolean(truth) => plain(if *truth { "true" } else { "false" }),
        DeValue::Datetime(time) => plain(&time.to_string()),
        DeValue::Array(items) => {
            let item = |(index, item): (usize, &Spanned<DeValue<'_>>)| {
                value(text, item, KeyPath::below(&key, "", &format!("[{}]", index + 1)), depth + 1)
            };
            Kind::List(items.iter().enumerate().map(item).collect::<Result<_, _>>()?)
        }
        DeValue::Table(table) => map(text, table, &key, depth + 1)?,
    };
    Ok(Value { location: Location { position, key }, kind })
}

/// Returns a key in TOML notation: quoted unless it is a bare key.
fn spelled(key: &str) -> String {
    let is_bare = |char: char| char.is_ascii_alphanumeric() || char == '_' || char == '-';
    if key.chars().all(is_bare) && !key.is_empty() { key.to_owned() } else { format!("{key:?}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn keys_keep_their_order_and_locations() {
        let text =
            Text::new(Path::new("a"), b"z = 0x1F\n[b]\na = [1.5, \"x\"]\n[[c]]\n[[c]]\nd = true".to_vec());
        let Kind::Map(entries) = from_toml(&text.unwrap(), "b").unwrap().kind else { panic!() };
        let keys: Vec<_> = entries.iter().map(|entry| entry.key.as_str()).collect();
        assert_eq!(keys, ["z", "b", "c"]);
        assert!(matches!(&entries[0].value.kind, Kind::Scalar { text, is_quoted: false } if text == "31"));
        let Kind::List(items) = &entries[2].value.kind else { panic!() };
        let Kind::Map(second) = &items[1].kind else { panic!() };
        assert_eq!(second[0].location.key.to_string(), "c[2].d");
        let positions = [second[0].location.position, second[0].value.location.position];
        assert_eq!(positions.map(|position| position.to_string()), ["6:1", "6:5"]);
    }

    #[test]
    fn a_key_with_a_line_break_is_shown_on_one_line() {
        let text = Text::new(Path::new("a"), b"a = { \"b\\nc\" = 1 }\n".to_vec()).unwrap();
        let Kind::Map(entries) = from_toml(&text, "b").unwrap().kind else { panic!() };
        let Kind::Map(inner) = &entries[0].value.kind else { panic!() };
        assert_eq!(inner[0].location.key.to_string(), "a.\"b\\nc\"");
    }

    #[test]
    fn broken_toml_is_refused_at_its_location_on_one_line() {
        let refused = |text: &str| {
            from_toml(&Text::new(Path::new("a"), text.as_bytes().to_vec()).unwrap(), "b").unwrap_err()
        };
        assert_eq!(refused("a = 1\nb = = 2\n").position.map(|position| position.line), Some(2));
        let twice = refused("[a]\nb = 1\n[c]\nb = 1\n[a] # again\n").to_string();
        assert_eq!(twice, "a:5:2: a is given twice, first on line 1; put both together, or remove one");
        for word in ["b.c", "ford_falcon_fg", "nissan_leaf_aze0", "toyota", "hyundai_kia"] {
            let bare = refused(&format!("z = 1\na = {word} # a word\n"));
            assert_eq!(bare.reason, format!("expected a value, found {word}"));
            assert_eq!(
                (bare.position.map(|position| position.line), bare.remedy.as_str()),
                (Some(2), "write a text in quotes: \"…\"")
            );
        }
        let crowded = refused(&format!("a = 1\nb = [{}]", "1,".repeat(600_000)));
        assert_eq!(crowded.reason, "more than 600000 lines, values and tables");
        assert_eq!(
            (crowded.position.map(|position| position.line), crowded.remedy.as_str()),
            (Some(2), "split the file")
        );
        assert_eq!(refused(&"a.".repeat(1_200_001)).reason, crowded.reason);
        assert_eq!(refused("a = True\n").remedy, "write true or false, in small letters");
        let torn = refused("0pronal = { signal = \"BLINK.LEF\n'''s.body]\n$lb");
        assert!(!torn.to_string().contains('\n'));
    }
}
