//! States as text: `red flashing, green right` (docs/spec/traffic-lights.md, "State text").
//!
//! One bulb is colour, status and shape in this order, each optional: a missing colour is green, a
//! missing status solidOn, a missing shape circle. Blanks between the words are optional as well, so
//! the words are taken off the front of the text one after the other. A list of bulbs has commas
//! between them.

use std::fmt;
use std::str::FromStr;

use super::bulb::{Bulb, BulbSet, Color, Shape, Status};
use super::scenario::StateText;

#[cfg(test)]
mod properties;

const COLORS: &[(&str, Color)] = &[
    ("green", Color::Green),
    ("Green", Color::Green),
    ("yellow", Color::Yellow),
    ("Yellow", Color::Yellow),
    ("amber", Color::Yellow),
    ("red", Color::Red),
    ("Red", Color::Red),
    ("white", Color::White),
    ("unknown", Color::Unknown),
];
const STATUSES: &[(&str, Status)] = &[
    ("solidOn", Status::SolidOn),
    ("solidOff", Status::SolidOff),
    ("Blank", Status::SolidOff),
    ("none", Status::SolidOff),
    ("flashing", Status::Flashing),
    ("unknown", Status::Unknown),
];
const SHAPES: &[(&str, Shape)] = &[
    ("circle", Shape::Circle),
    ("cross", Shape::Cross),
    ("left", Shape::Left),
    ("right", Shape::Right),
    ("up", Shape::Up),
    ("straight", Shape::Up),
    ("upperLeft", Shape::UpperLeft),
    ("upperRight", Shape::UpperRight),
    ("down", Shape::Down),
    ("lowerLeft", Shape::LowerLeft),
    ("lowerRight", Shape::LowerRight),
    ("unknown", Shape::Unknown),
];

/// The longest piece of a wrong text that is repeated, characters.
const MAX_EXCERPT: usize = 40;

/// What is wrong with a text, where, and what would be right.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TextError {
    /// The word or character that does not fit; a very long one is cut.
    pub found: String,
    /// Where it stands in the whole text, in characters, from 1.
    pub column: usize,
    /// Why it does not fit.
    pub kind: TextErrorKind,
}

/// Why a word or character does not fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TextErrorKind {
    /// A colour was asked for.
    NoColor,
    /// A status was asked for.
    NoStatus,
    /// A shape was asked for.
    NoShape,
    /// No spelling of anything, or not even a word.
    NoWord,
    /// A known word, but out of order or the second of its kind.
    Misplaced,
    /// In a list: a bulb must begin here, with a letter.
    NoBulb,
    /// In a list: a bulb of one character.
    TooShort,
}

impl fmt::Display for TextError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { found, column, kind } = self;
        let found = found.escape_debug();
        match kind {
            TextErrorKind::NoColor => {
                write!(f, "`{found}` is not a colour; colours are {}", spellings(COLORS))
            }
            TextErrorKind::NoStatus => {
                write!(f, "`{found}` is not a status; statuses are {}", spellings(STATUSES))
            }
            TextErrorKind::NoShape => write!(f, "`{found}` is not a shape; shapes are {}", spellings(SHAPES)),
            TextErrorKind::NoWord | TextErrorKind::TooShort => write!(
                f,
                "`{found}` at column {column} is not a part of a bulb; colours are {}; statuses are {}; shapes \
                 are {}",
                spellings(COLORS),
                spellings(STATUSES),
                spellings(SHAPES)
            ),
            TextErrorKind::Misplaced => write!(
                f,
                "`{found}` at column {column} is out of place: a bulb is colour, status, shape in this order, \
                 each at most once, and begins without a blank"
            ),
            TextErrorKind::NoBulb => write!(
                f,
                "`{found}` at column {column}: a bulb must begin here; one comma stands between two bulbs, and \
                 the text begins without a blank"
            ),
        }
    }
}

impl std::error::Error for TextError {}

impl FromStr for Color {
    type Err = TextError;

    fn from_str(word: &str) -> Result<Self, TextError> {
        named(COLORS, word, TextErrorKind::NoColor)
    }
}

impl FromStr for Status {
    type Err = TextError;

    fn from_str(word: &str) -> Result<Self, TextError> {
        named(STATUSES, word, TextErrorKind::NoStatus)
    }
}

impl FromStr for Shape {
    type Err = TextError;

    fn from_str(word: &str) -> Result<Self, TextError> {
        named(SHAPES, word, TextErrorKind::NoShape)
    }
}

/// One bulb. Empty text is one too: all defaults.
pub fn parse_bulb(text: &str) -> Result<Bulb, TextError> {
    let (color, rest) = take(COLORS, text, Color::Green);
    let (status, rest) = take(STATUSES, rest.trim_start_matches(is_blank), Status::SolidOn);
    let (shape, rest) = take(SHAPES, rest.trim_start_matches(is_blank), Shape::Circle);
    let rest = rest.trim_start_matches(is_blank);
    if rest.is_empty() { Ok(Bulb { color, status, shape }) } else { Err(wrong_word(text, rest)) }
}

/// A list of bulbs, all or none of them. Empty text is the empty set.
pub fn parse_bulbs(text: &str) -> Result<BulbSet, TextError> {
    match read_bulbs(text) {
        (bulbs, None) => Ok(bulbs),
        (_, Some(mistake)) => Err(mistake),
    }
}

/// A list of bulbs up to its first mistake, and that mistake: upstream applies what stands before
/// it (Q20).
pub fn read_bulbs(text: &str) -> (BulbSet, Option<TextError>) {
    let mut bulbs = BulbSet::EMPTY;
    let mut rest = text;
    while !rest.is_empty() {
        match next_bulb(rest) {
            Ok((bulb, after)) => {
                bulbs.insert(bulb);
                rest = after;
            }
            Err(mistake) => {
                let before = text.chars().count() - rest.chars().count();
                return (bulbs, Some(TextError { column: mistake.column + before, ..mistake }));
            }
        }
    }
    (bulbs, None)
}

impl StateText {
    /// Reads a state in both ways. It keeps a text with a mistake; `check_state` refuses it.
    pub fn new(text: &str) -> Self {
        let (bulbs, mistake) = read_bulbs(text);
        Self {
            text: text.to_owned(),
            bulbs,
            mistake: mistake.map(|mistake| mistake.to_string()),
            single: parse_bulb(text).ok(),
        }
    }
}

/// What counts as white space: that of C, in ASCII.
pub(super) fn is_blank(char: char) -> bool {
    matches!(char, ' ' | '\t'..='\r')
}

/// The beginning of a text that may be very long, fit for one line.
pub(super) fn excerpt(text: &str) -> String {
    let mut cut: String = text.chars().take(MAX_EXCERPT).collect();
    if cut.len() < text.len() {
        cut.push('…');
    }
    cut
}

/// The first bulb of a list that is not empty, and what stands after it and its comma.
fn next_bulb(text: &str) -> Result<(Bulb, &str), TextError> {
    let end = text.find(|char| !is_word(char) && !is_blank(char)).unwrap_or(text.len());
    let (item, after) = text.split_at(end);
    let wrong = |kind| {
        let found = text.chars().take(1).collect();
        Err(TextError { found, column: 1, kind })
    };
    if !item.starts_with(is_word) {
        return wrong(TextErrorKind::NoBulb);
    }
    if item.len() < 2 {
        return wrong(TextErrorKind::TooShort);
    }
    let bulb = parse_bulb(item)?;
    Ok((bulb, after.strip_prefix(',').unwrap_or(after).trim_start_matches(is_blank)))
}

/// Why no bulb goes on with `rest`, the end of `text`.
fn wrong_word(text: &str, rest: &str) -> TextError {
    let word = leading_word(rest);
    let known = COLORS.iter().map(|(name, _)| *name).chain(STATUSES.iter().map(|(name, _)| *name));
    let is_known = known.chain(SHAPES.iter().map(|(name, _)| *name)).any(|name| name == word);
    let (before, _) = text.split_at(text.len() - rest.len());
    // A word that only begins like a known one is shown whole.
    let is_end_of_word = !is_known && !word.is_empty();
    let start = if is_end_of_word { before.trim_end_matches(is_word).len() } else { before.len() };
    let (before, from_word) = text.split_at(start);
    let whole = leading_word(from_word);
    let found = if whole.is_empty() { from_word.chars().take(1).collect() } else { excerpt(whole) };
    let kind = if is_known { TextErrorKind::Misplaced } else { TextErrorKind::NoWord };
    TextError { found, column: before.chars().count() + 1, kind }
}

fn leading_word(text: &str) -> &str {
    text.split(|char| !is_word(char)).next().unwrap_or_default()
}

fn is_word(char: char) -> bool {
    char.is_ascii_alphanumeric() || char == '_'
}

/// Takes the longest spelling off the front; leaves the text as it is when there is none.
fn take<'a, T: Copy>(words: &[(&str, T)], text: &'a str, default: T) -> (T, &'a str) {
    let found = words.iter().filter_map(|(name, value)| Some((*value, text.strip_prefix(name)?)));
    found.min_by_key(|(_, rest)| rest.len()).unwrap_or((default, text))
}

fn named<T: Copy>(words: &[(&str, T)], word: &str, kind: TextErrorKind) -> Result<T, TextError> {
    let found = words.iter().find(|(name, _)| *name == word);
    let error = || TextError { found: excerpt(word), column: 1, kind };
    found.map(|(_, value)| *value).ok_or_else(error)
}

fn spellings<T>(words: &[(&str, T)]) -> String {
    words.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mistake_names_its_word_and_its_place_in_the_whole_text() {
        use TextErrorKind::{Misplaced, NoBulb, NoWord, TooShort};
        let cases = [
            ("blue", "blue", 1, NoWord),
            ("redd", "redd", 1, NoWord),
            ("red, green left2", "left2", 12, NoWord),
            ("red flashing wrong_shape", "wrong_shape", 14, NoWord),
            ("right red", "red", 7, Misplaced),
            ("red, rightred", "red", 11, Misplaced),
            ("green right left", "left", 13, Misplaced),
            (" red", " ", 1, NoBulb),
            ("red,,green", ",", 5, NoBulb),
            ("red;green", ";", 4, NoBulb),
            ("red, grün", "gr", 6, NoWord),
            ("red, ü", "ü", 6, NoBulb),
            ("red, r", "r", 6, TooShort),
        ];
        for (text, found, column, kind) in cases {
            let expected = TextError { found: found.to_owned(), column, kind };
            assert_eq!(parse_bulbs(text), Err(expected), "{text:?}");
        }
        let error = parse_bulb("red;").unwrap_err();
        assert_eq!((error.found.as_str(), error.column, error.kind), (";", 4, NoWord));
        assert_eq!(parse_bulb(" red").map_err(|error| error.kind), Err(Misplaced));
    }

    #[test]
    fn a_mistake_reads_as_one_line_that_says_what_is_allowed() {
        let text = "\u{7}".to_owned() + &"long".repeat(100);
        for text in ["blue", "red red", "red,,", "r", &text, &text[1..]] {
            let line = parse_bulbs(text).unwrap_err().to_string();
            assert!(!line.contains(char::is_control) && line.len() < 400, "{line}");
        }
        assert_eq!(
            "RED".parse::<Color>().unwrap_err().to_string(),
            "`RED` is not a colour; colours are green, Green, yellow, Yellow, amber, red, Red, white, unknown"
        );
    }

    #[test]
    fn a_state_keeps_what_it_says_in_both_ways_and_what_is_wrong() {
        let state = StateText::new("red, blue, green");
        assert_eq!(state.bulbs.to_string(), "red solidOn circle");
        assert!(state.mistake.is_some_and(|mistake| mistake.starts_with("`blue` at column 6")));
        assert_eq!((state.text.as_str(), state.single), ("red, blue, green", None));
        let empty = StateText::new("");
        assert_eq!((empty.bulbs, empty.mistake), (BulbSet::EMPTY, None));
        assert_eq!(empty.single.map(|bulb| bulb.to_string()).as_deref(), Some("green solidOn circle"));
    }
}
