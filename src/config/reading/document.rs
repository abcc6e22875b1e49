//! A TOML text that becomes Rust types, and the places of its keys.

use std::ops::Range;
use std::path::{Path, PathBuf};

use toml::de::{DeTable, DeValue};

use super::problem::Problem;

/// A TOML text with the name it goes by, to turn spans into positions and keys.
#[derive(Debug, Clone)]
pub(in crate::config) struct Document {
    path: PathBuf,
    text: String,
}

impl Document {
    /// A document from the bytes of a file.
    ///
    /// # Errors
    /// Text that is not UTF-8.
    pub(in crate::config) fn new(path: &Path, bytes: Vec<u8>) -> Result<Self, Problem> {
        match String::from_utf8(bytes) {
            Ok(text) => Ok(Self { path: path.to_owned(), text }),
            Err(error) => {
                let good = error.utf8_error().valid_up_to();
                let before = String::from_utf8_lossy(&error.as_bytes()[..good]).into_owned();
                let document = Self { path: path.to_owned(), text: before };
                Err(document.problem(good..good, "this is not UTF-8", "save the file as UTF-8"))
            }
        }
    }

    /// The file's path.
    pub(in crate::config) fn path(&self) -> &Path {
        &self.path
    }

    /// Reads the text as `T`.
    ///
    /// # Errors
    /// The first thing that is not TOML, not a known key or not of the right type.
    pub(in crate::config) fn parse<T: serde::de::DeserializeOwned>(&self) -> Result<T, Problem> {
        toml::from_str(&self.text).map_err(|error| {
            // A refused value spans just itself; a missing key has the table's span.
            let message = error.message().replace('\n', ", ");
            self.problem(error.span().unwrap_or(0..0), message, "see config/gateway.toml for every key")
        })
    }

    /// A problem at a place in this document.
    pub(in crate::config) fn problem(
        &self,
        span: Range<usize>,
        reason: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Problem {
        // What is about the whole file belongs to no key, not even to the first one.
        let key = if span == (0..0) { String::new() } else { self.key_at(span.start) };
        Problem {
            file: self.path.clone(),
            position: Some(self.position(span.start)),
            key,
            reason: reason.into(),
            remedy: remedy.into(),
        }
    }

    fn position(&self, offset: usize) -> (usize, usize) {
        let before = self.text.get(..offset).unwrap_or(&self.text);
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().map_or(0, |line| line.chars().count()) + 1;
        (line, column)
    }

    fn key_at(&self, offset: usize) -> String {
        // Recoverable: the text may be broken elsewhere.
        let (table, _) = DeTable::parse_recoverable(&self.text);
        let mut path = Vec::new();
        find(table.get_ref(), offset, &mut path);
        path.join(".")
    }
}

/// Appends the deepest key whose name or value spans `offset`; false when there is none.
fn find(table: &DeTable<'_>, offset: usize, path: &mut Vec<String>) -> bool {
    for (key, value) in table {
        path.push(spelled(key.get_ref()));
        if find_in(value.get_ref(), offset, path)
            || key.span().contains(&offset)
            || value.span().contains(&offset)
        {
            return true;
        }
        path.pop();
    }
    false
}

/// A key as TOML spells it: quoted unless it is a bare one.
fn spelled(key: &str) -> String {
    let is_bare = |char: char| char.is_ascii_alphanumeric() || char == '_' || char == '-';
    if key.chars().all(is_bare) && !key.is_empty() { key.to_owned() } else { format!("{key:?}") }
}

fn find_in(value: &DeValue<'_>, offset: usize, path: &mut Vec<String>) -> bool {
    match value {
        DeValue::Table(table) => find(table, offset, path),
        DeValue::Array(items) => items.iter().any(|item| find_in(item.get_ref(), offset, path)),
        DeValue::String(_)
        | DeValue::Integer(_)
        | DeValue::Float(_)
        | DeValue::Boolean(_)
        | DeValue::Datetime(_) => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn document(text: &str) -> Document {
        Document::new(Path::new("g.toml"), text.as_bytes().to_vec()).unwrap()
    }

    #[test]
    fn a_problem_names_line_column_and_key() {
        let text = "name = \"ä\"\n[turn]\nleft = [1]\nright = [1]\n";
        let at = text.find("[1]\nright").unwrap();
        let problem = document(text).problem(at..at + 3, "no", "do");
        assert_eq!(problem.to_string(), "g.toml:3:8: turn.left: no; do");
        let inline = "a = { b = [{ c = 7 }] }";
        assert_eq!(document(inline).problem(17..18, "no", "").to_string(), "g.toml:1:18: a.b.c: no");
    }

    #[test]
    fn columns_count_characters_not_bytes() {
        let text = "a = \"äö\" # x\n";
        let at = text.find('#').unwrap();
        assert_eq!(document(text).problem(at..at, "no", "").position, Some((1, 10)));
    }

    #[test]
    fn text_that_is_not_utf8_is_refused_with_its_line() {
        let problem = Document::new(Path::new("g.toml"), b"a = 1\nb = \"\xFF\"".to_vec()).unwrap_err();
        assert_eq!(problem.position, Some((2, 6)));
    }

    #[test]
    fn a_key_of_many_lines_stays_on_one() {
        let problem = document("a = { \"b\\nc\" = 1 }\n").problem(15..16, "no", "");
        assert_eq!(problem.key, "a.\"b\\nc\"");
        let torn = document("0pronal = { signal = \"BLINK.LEF\n'''s.body]\n$lb").parse::<toml::Table>();
        assert!(!torn.unwrap_err().to_string().contains('\n'));
    }

    #[test]
    fn broken_toml_is_refused_where_it_breaks() {
        let problem = document("a = 1\nb = = 2\n").parse::<toml::Table>().unwrap_err();
        assert_eq!(problem.position.map(|(line, _)| line), Some(2));
    }
}
