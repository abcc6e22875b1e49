//! States as text: `red flashing, green right` (docs/spec/traffic-lights.md, "State text").
//!
//! A bulb consists of colour, status and shape in this order, each optional: a missing colour is green, a
//! missing status solidOn, a missing shape circle. Blanks between these parts are optional as well, so the
//! parts are removed from the front of the text one after the other. Bulbs in a list are separated by commas.

use std::fmt;
use std::str::FromStr;

use super::bulb::{Bulb, BulbSet, BulbShape, BulbStatus, Color};
use super::scenario::StateText;

#[cfg(test)]
mod properties;

/// Spellings of the colours; the first one of a colour is its name.
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
/// Spellings of the statuses; the first one of a status is its name.
const STATUSES: &[(&str, BulbStatus)] = &[
    ("solidOn", BulbStatus::SolidOn),
    ("solidOff", BulbStatus::SolidOff),
    ("Blank", BulbStatus::SolidOff),
    ("none", BulbStatus::SolidOff),
    ("flashing", BulbStatus::Flashing),
    ("unknown", BulbStatus::Unknown),
];
/// Spellings of the shapes; the first one of a shape is its name.
const SHAPES: &[(&str, BulbShape)] = &[
    ("circle", BulbShape::Circle),
    ("cross", BulbShape::Cross),
    ("left", BulbShape::Left),
    ("right", BulbShape::Right),
    ("up", BulbShape::Up),
    ("straight", BulbShape::Up),
    ("upperLeft", BulbShape::UpperLeft),
    ("upperRight", BulbShape::UpperRight),
    ("down", BulbShape::Down),
    ("lowerLeft", BulbShape::LowerLeft),
    ("lowerRight", BulbShape::LowerRight),
    ("unknown", BulbShape::Unknown),
];

/// Maximum length of a faulty text in an error, characters.
const MAX_EXCERPT: usize = 40;

/// A mistake in a state text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TextError {
    /// The unexpected part of the text, shortened if it is very long.
    pub found: String,
    /// Its position in the whole text, in characters, from 1.
    pub column: usize,
    /// The kind of mistake.
    pub kind: TextErrorKind,
}

/// The kind of a mistake in a state text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TextErrorKind {
    /// The text is not exactly a colour.
    NotAColor,
    /// The text is not exactly a status.
    NotAStatus,
    /// The text is not exactly a shape.
    NotAShape,
    /// Not a spelling of a colour, status or shape.
    NotAPart,
    /// A part of a bulb that is out of order or repeated.
    Misplaced,
    /// In a list, a bulb does not begin with a letter.
    NotABulb,
    /// In a list, a bulb has only one character.
    TooShort,
}

impl fmt::Display for TextError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { found, column, kind } = self;
        let found = found.escape_debug();
        let (colors, statuses, shapes) = (spellings(COLORS), spellings(STATUSES), spellings(SHAPES));
        match kind {
            TextErrorKind::NotAColor => write!(f, "`{found}` is not a colour; colours are {colors}"),
            TextErrorKind::NotAStatus => write!(f, "`{found}` is not a status; statuses are {statuses}"),
            TextErrorKind::NotAShape => write!(f, "`{found}` is not a shape; shapes are {shapes}"),
            TextErrorKind::NotAPart | TextErrorKind::TooShort => write!(
                f,
                "`{found}` at column {column} is not a part of a bulb; colours are {colors}; statuses are {statuses}; \
                 shapes are {shapes}"
            ),
            TextErrorKind::Misplaced => write!(
                f,
                "`{found}` at column {column} is out of place: a bulb is colour, status, shape in this order, \
                 each at most once, and begins without a blank"
            ),
            TextErrorKind::NotABulb => write!(
                f,
                "`{found}` at column {column}: a bulb must begin here; one comma stands between two bulbs, and \
                 the text begins without a blank"
            ),
        }
    }
}

impl std::error::Error for TextError {}

/// Defines the name and the parser of a part of a bulb by the table of its spellings.
macro_rules! spelled_part {
    ($part:ty, $spellings:ident, $mistake:ident) => {
        impl $part {
            /// Returns the name in state texts.
            pub fn name(self) -> &'static str {
                $spellings.iter().find(|(_, known)| *known == self).map_or("", |(name, _)| name)
            }
        }

        impl FromStr for $part {
            type Err = TextError;

            fn from_str(text: &str) -> Result<Self, TextError> {
                let found = $spellings.iter().find(|(name, _)| *name == text).map(|(_, part)| *part);
                let kind = TextErrorKind::$mistake;
                found.ok_or_else(|| TextError { found: excerpt(text), column: 1, kind })
            }
        }
    };
}

spelled_part!(Color, COLORS, NotAColor);
spelled_part!(BulbStatus, STATUSES, NotAStatus);
spelled_part!(BulbShape, SHAPES, NotAShape);

/// Parses one bulb. Empty text is a bulb with all defaults.
pub fn parse_bulb(text: &str) -> Result<Bulb, TextError> {
    let (color, rest) = take(COLORS, text, Color::Green);
    let (status, rest) = take(STATUSES, rest.trim_start_matches(is_blank), BulbStatus::SolidOn);
    let (shape, rest) = take(SHAPES, rest.trim_start_matches(is_blank), BulbShape::Circle);
    let rest = rest.trim_start_matches(is_blank);
    if rest.is_empty() { Ok(Bulb { color, status, shape }) } else { Err(unexpected_token(text, rest)) }
}

/// Parses a list of bulbs, all or none of them. Empty text is the empty set.
pub fn parse_bulbs(text: &str) -> Result<BulbSet, TextError> {
    match read_bulbs(text) {
        (bulbs, None) => Ok(bulbs),
        (_, Some(mistake)) => Err(mistake),
    }
}

/// Parses a list of bulbs up to its first mistake, and returns the mistake: upstream applies the bulbs before
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
    /// Parses a state as a list and as a single bulb. A text with a mistake is kept; `check_state` refuses
    /// it.
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

/// Returns whether a character is ASCII white space in C.
pub(super) fn is_blank(char: char) -> bool {
    matches!(char, ' ' | '\t'..='\r')
}

/// Returns the beginning of a text, which may be very long.
pub(super) fn excerpt(text: &str) -> String {
    let mut cut: String = text.chars().take(MAX_EXCERPT).collect();
    if cut.len() < text.len() {
        cut.push('…');
    }
    cut
}

/// Returns the beginning of a text, as one line.
pub(super) fn printable(text: &str) -> String {
    excerpt(text).escape_debug().to_string()
}

/// Parses the first bulb of a list that is not empty. Also returns the rest after it and its comma.
fn next_bulb(text: &str) -> Result<(Bulb, &str), TextError> {
    let end = text.find(|char| !is_token(char) && !is_blank(char)).unwrap_or(text.len());
    let (item, after) = text.split_at(end);
    let wrong = |kind| {
        let found = text.chars().take(1).collect();
        Err(TextError { found, column: 1, kind })
    };
    if !item.starts_with(is_token) {
        return wrong(TextErrorKind::NotABulb);
    }
    if item.len() < 2 {
        return wrong(TextErrorKind::TooShort);
    }
    let bulb = parse_bulb(item)?;
    Ok((bulb, after.strip_prefix(',').unwrap_or(after).trim_start_matches(is_blank)))
}

/// Returns the mistake if a bulb cannot continue with `rest`, the end of `text`.
fn unexpected_token(text: &str, rest: &str) -> TextError {
    let token = leading_token(rest);
    let known = COLORS.iter().map(|(name, _)| *name).chain(STATUSES.iter().map(|(name, _)| *name));
    let is_known = known.chain(SHAPES.iter().map(|(name, _)| *name)).any(|name| name == token);
    let (before, _) = text.split_at(text.len() - rest.len());
    // A token that only begins like a known token is shown whole.
    let is_end_of_token = !is_known && !token.is_empty();
    let start = if is_end_of_token { before.trim_end_matches(is_token).len() } else { before.len() };
    let (before, from_token) = text.split_at(start);
    let whole = leading_token(from_token);
    let found = if whole.is_empty() { from_token.chars().take(1).collect() } else { excerpt(whole) };
    let kind = if is_known { TextErrorKind::Misplaced } else { TextErrorKind::NotAPart };
    TextError { found, column: before.chars().count() + 1, kind }
}

fn leading_token(text: &str) -> &str {
    text.split(|char| !is_token(char)).next().unwrap_or_default()
}

/// Returns whether a character can be in the name of a colour, status or shape.
fn is_token(char: char) -> bool {
    char.is_ascii_alphanumeric() || char == '_'
}

/// Removes the longest spelling from the front; leaves the text unchanged if there is none.
fn take<'a, T: Copy>(parts: &[(&str, T)], text: &'a str, default: T) -> (T, &'a str) {
    let found = parts.iter().filter_map(|(name, value)| Some((*value, text.strip_prefix(name)?)));
    found.min_by_key(|(_, rest)| rest.len()).unwrap_or((default, text))
}

fn spellings<T>(parts: &[(&str, T)]) -> String {
    parts.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mistake_names_its_token_and_column() {
        use TextErrorKind::{Misplaced, NotABulb, NotAPart, TooShort};
        let cases = [
            ("blue", "blue", 1, NotAPart),
            ("redd", "redd", 1, NotAPart),
            ("red, green left2", "left2", 12, NotAPart),
            ("red flashing wrong_shape", "wrong_shape", 14, NotAPart),
            ("right red", "red", 7, Misplaced),
            ("red, rightred", "red", 11, Misplaced),
            ("green right left", "left", 13, Misplaced),
            (" red", " ", 1, NotABulb),
            ("red,,green", ",", 5, NotABulb),
            ("red;green", ";", 4, NotABulb),
            ("red, grün", "gr", 6, NotAPart),
            ("red, ü", "ü", 6, NotABulb),
            ("red, r", "r", 6, TooShort),
        ];
        for (text, found, column, kind) in cases {
            let expected = TextError { found: found.to_owned(), column, kind };
            assert_eq!(parse_bulbs(text), Err(expected), "{text:?}");
        }
        let error = parse_bulb("red;").unwrap_err();
        assert_eq!((error.found.as_str(), error.column, error.kind), (";", 4, NotAPart));
        assert_eq!(parse_bulb(" red").map_err(|error| error.kind), Err(Misplaced));
    }

    #[test]
    fn a_mistake_prints_as_one_line_with_the_valid_spellings() {
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
    fn a_state_is_read_as_a_list_and_as_a_single_bulb() {
        let state = StateText::new("red, blue, green");
        assert_eq!(state.bulbs.to_string(), "red solidOn circle");
        assert!(state.mistake.is_some_and(|mistake| mistake.starts_with("`blue` at column 6")));
        assert_eq!((state.text.as_str(), state.single), ("red, blue, green", None));
        let empty = StateText::new("");
        assert_eq!((empty.bulbs, empty.mistake), (BulbSet::EMPTY, None));
        assert_eq!(empty.single.map(|bulb| bulb.to_string()).as_deref(), Some("green solidOn circle"));
    }
}
