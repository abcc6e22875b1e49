//! Splits DBC text into statements, so that a malformed statement affects no other.
//!
//! The format has no reliable separator: some statements end with the line, some with `;`, some continue on
//! indented lines, and texts may span lines. A statement with an unterminated text ends with its line.

use std::borrow::Cow;

/// Statements that end with a semicolon and may span several lines.
const SEMICOLON: [&str; 26] = [
    "BA_",
    "BA_DEF_",
    "BA_DEF_DEF_",
    "BA_DEF_DEF_REL_",
    "BA_DEF_REL_",
    "BA_DEF_SGTYPE_",
    "BA_REL_",
    "BA_SGTYPE_",
    "BO_TX_BU_",
    "BU_BO_REL_",
    "BU_EV_REL_",
    "BU_SG_REL_",
    "CAT_",
    "CAT_DEF_",
    "CM_",
    "ENVVAR_DATA_",
    "EV_",
    "EV_DATA_",
    "SGTYPE_",
    "SGTYPE_VAL_",
    "SG_MUL_VAL_",
    "SIGTYPE_VALTYPE_",
    "SIG_GROUP_",
    "SIG_VALTYPE_",
    "VAL_",
    "VAL_TABLE_",
];

/// Statements that end with their line.
const LINE: [&str; 4] = ["BO_", "BS_", "SG_", "VERSION"];

/// Statements that continue while lines hold only names.
const LISTING: [&str; 2] = ["BU_", "NS_"];

/// Largest text in bytes, which bounds the search for the end of an unterminated text.
const MAX_TEXT: usize = 1 << 16;

/// One statement, with line ends outside texts replaced by blanks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Statement<'a> {
    /// Line of the first character, from 1.
    pub(super) line: usize,
    pub(super) indented: bool,
    /// Trimmed text of the statement; never empty.
    pub(super) text: Cow<'a, str>,
}

impl Statement<'_> {
    pub(super) fn keyword(&self) -> &str {
        first_word(&self.text)
    }
}

/// Returns true if `word` is a keyword of the format.
pub(super) fn is_keyword(word: &str) -> bool {
    SEMICOLON.contains(&word) || LINE.contains(&word) || LISTING.contains(&word)
}

/// Returns the statements of `text` (lines end with `\n`) in order, without blank lines and `//` comments.
pub(super) fn split(text: &str) -> impl Iterator<Item = Statement<'_>> {
    let (mut rest, mut line, mut indented) = (text, 1, false);
    std::iter::from_fn(move || {
        loop {
            let trimmed = rest.trim_start();
            let blank = &rest[..rest.len() - trimmed.len()];
            line += line_ends(blank);
            indented = if blank.contains('\n') || rest.len() == text.len() {
                !blank.is_empty() && !blank.ends_with('\n')
            } else {
                indented
            };
            if trimmed.is_empty() {
                return None;
            }
            let (own, after) = trimmed.split_at(extent(trimmed));
            let first_line = line;
            line += line_ends(own);
            rest = after;
            if !own.starts_with("//") {
                return Some(Statement { line: first_line, indented, text: on_one_line(own.trim_end()) });
            }
        }
    })
}

/// Returns the length in bytes of the statement at the start of `text`, at least one character.
fn extent(text: &str) -> usize {
    let word = first_word(text);
    if SEMICOLON.contains(&word) {
        semicolon_extent(text)
    } else if LISTING.contains(&word) && text[word.len()..].trim_start().starts_with(':') {
        listing_extent(text)
    } else {
        line_extent(text)
    }
}

fn line_extent(text: &str) -> usize {
    text.find('\n').unwrap_or(text.len())
}

/// Returns the length of the first line and the lines that continue its list.
fn listing_extent(text: &str) -> usize {
    let mut end = line_extent(text);
    while let Some(next) = text[end..].strip_prefix('\n') {
        let line = &next[..line_extent(next)];
        if !continues_listing(first_word(text), line) {
            break;
        }
        end += 1 + line.len();
    }
    end
}

/// Returns true if `line` holds only names: node names (indented) or section names, which are keywords.
fn continues_listing(listing: &str, line: &str) -> bool {
    let indented = line.starts_with([' ', '\t']);
    let mut words = line.split_ascii_whitespace().peekable();
    let only_names = words.clone().all(|word| first_word(word) == word);
    let fits = match (listing, words.peek()) {
        (_, None) => false,
        ("NS_", Some(_)) => indented || words.count() == 1,
        (_, Some(first)) => indented && !is_keyword(first),
    };
    only_names && fits
}

/// Returns the length up to and including the semicolon, up to the line before the next statement or, with an
/// unterminated text, of the first line.
fn semicolon_extent(text: &str) -> usize {
    let mut at = 0;
    while let Some(found) = text[at..].find(['"', ';', '\n']) {
        let position = at + found;
        match text.as_bytes()[position] {
            b';' => return position + 1,
            b'"' => match text_end(&text[position + 1..]) {
                Some(length) => at = position + 1 + length,
                None => return position + line_extent(&text[position..]),
            },
            _ if ends_before(&text[position + 1..]) => return position,
            _ => at = position + 1,
        }
    }
    text.len()
}

/// Returns true if the line at the start of `text` cannot continue an unfinished statement.
fn ends_before(text: &str) -> bool {
    let line = text[..line_extent(text)].trim_start();
    line.is_empty() || is_keyword(first_word(line))
}

/// Returns the length up to and including the closing quote of a text, given the text after its opening
/// quote; `None` for an unterminated text.
///
/// A text over several lines must be followed by a valid separator. Otherwise its own closing quote is
/// missing, and this quote opens the text of another statement.
fn text_end(text: &str) -> Option<usize> {
    let mut escaped = false;
    let close = text.char_indices().take_while(|(at, _)| *at < MAX_TEXT).find_map(|(at, c)| {
        let closes = c == '"' && !escaped;
        escaped = c == '\\';
        closes.then_some(at)
    })?;
    let after = text[close + 1..].trim_start_matches([' ', '\t']);
    let ends_a_text = after.is_empty() || after.starts_with([';', ',', '\n']);
    (ends_a_text || !text[..close].contains('\n')).then_some(close + 1)
}

/// Replaces line ends outside texts by blanks for the grammar, which accepts one line.
fn on_one_line(text: &str) -> Cow<'_, str> {
    if !text.contains('\n') {
        return Cow::Borrowed(text);
    }
    let (mut quoted, mut escaped) = (false, false);
    let blank_ends = text.chars().map(|c| {
        quoted ^= c == '"' && !escaped;
        escaped = c == '\\';
        if c == '\n' && !quoted { ' ' } else { c }
    });
    Cow::Owned(blank_ends.collect())
}

fn first_word(text: &str) -> &str {
    let end = text.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
    &text[..end.unwrap_or(text.len())]
}

fn line_ends(text: &str) -> usize {
    text.bytes().filter(|byte| *byte == b'\n').count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn texts(text: &str) -> Vec<(usize, String)> {
        split(text).map(|statement| (statement.line, statement.text.into_owned())).collect()
    }

    #[test]
    fn lists_end_with_their_last_line() {
        let text = "NS_ :\n\tCM_\nVAL_\n NS_DESC_ FILTER\nBS_:\nBU_: A\n B C\n CM_ \"x\";\nBU_:\nBO_ 1 M: 8 X\n SG_ S";
        let expected = [
            (1, "NS_ : \tCM_ VAL_  NS_DESC_ FILTER"),
            (5, "BS_:"),
            (6, "BU_: A  B C"),
            (8, "CM_ \"x\";"),
            (9, "BU_:"),
            (10, "BO_ 1 M: 8 X"),
            (11, "SG_ S"),
        ];
        assert_eq!(texts(text), expected.map(|(line, text)| (line, text.to_owned())));
        let indented: Vec<_> = split(text).filter(|s| s.indented).map(|s| s.line).collect();
        assert_eq!(indented, [8, 11]);
    }

    #[test]
    fn semicolons_in_texts_and_comments_do_not_separate() {
        let text = "// BO_ 1;\nCM_ \"a;\nb\\\";\"; VAL_ 1\n S 0 \";\" ;;\nVAL_ 2 S\n\nfoo";
        let expected =
            [(2, "CM_ \"a;\nb\\\";\";"), (3, "VAL_ 1  S 0 \";\" ;"), (4, ";"), (5, "VAL_ 2 S"), (7, "foo")];
        assert_eq!(texts(text), expected.map(|(line, text)| (line, text.to_owned())));
    }

    proptest! {
        #[test]
        fn every_statement_begins_on_its_line(
            text in prop::collection::vec(
                prop_oneof![
                    Just("\n"), Just(" "), Just("\""), Just(";"), Just("\\"), Just("CM_ "), Just("BO_ 1"), Just("NS_ :"),
                    Just("SG_ S"), Just("//"), Just("é"), Just("x"),
                ],
                0..40,
            ),
        ) {
            let text = text.concat();
            for statement in split(&text) {
                let line = text.split('\n').nth(statement.line - 1).unwrap();
                let first = statement.text.split(['\n', ' ']).next().unwrap();
                prop_assert!(line.contains(first), "{statement:?} in {text:?}");
            }
        }
    }
}
