//! A reason to refuse a configuration: file, line, column, key, reason and remedy.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use derive_more::Display;

use crate::config::built_in::display;
use can_signal::can::IdMatch;

/// A location in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Display)]
#[display("{line}:{column}")]
pub struct Position {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

impl Position {
    pub(crate) const START: Self = Self { line: 1, column: 1 };
}

/// The reason why something is refused, and the remedy, before its location is known.
#[derive(Debug, Clone, PartialEq, Eq, Display)]
#[display("{reason}; {remedy}")]
pub struct Refusal {
    /// The problem, in plain text without a full stop.
    pub reason: String,
    /// The remedy, in plain text without a full stop.
    pub remedy: String,
}

impl Refusal {
    pub(crate) fn new(reason: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { reason: reason.into(), remedy: remedy.into() }
    }
}

/// One reason to refuse a configuration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    /// Path of the file, as it was named.
    pub file: PathBuf,
    /// Location in the file; `None` if the file cannot be read at all.
    pub position: Option<Position>,
    /// Path of the key, e.g. `turn.left` or `event[2].do[1].set`; empty for the whole file.
    pub key: Box<str>,
    /// The problem, in plain text without a full stop.
    pub reason: String,
    /// The remedy, in plain text without a full stop; may be empty.
    pub remedy: String,
    /// The message without a timeout, if that is the problem.
    pub missing_timeout: Option<Box<MissingTimeout>>,
}

/// A message for which a vehicle profile needs a timeout, which can be determined from a recording of the
/// vehicle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MissingTimeout {
    /// Key of the profile's table in the file; empty for a profile that is a file of its own.
    pub profile_key: String,
    /// Name of the message.
    pub message: String,
    /// Identifiers of the message.
    pub ids: IdMatch,
}

impl Problem {
    /// Creates a problem of a whole file, without a position.
    pub(crate) fn whole_file(file: &Path, reason: impl Into<String>, remedy: impl Into<String>) -> Self {
        let (file, reason, remedy) = (file.to_owned(), reason.into(), remedy.into());
        Self { file, position: None, key: Box::default(), reason, remedy, missing_timeout: None }
    }

    /// Returns the problem; if it concerns the file as a whole, with this remedy.
    pub(crate) fn or_remedy(self, remedy: &str) -> Self {
        if self.position.is_some() { self } else { Self { remedy: remedy.to_owned(), ..self } }
    }

    /// Returns the problem of a file that cannot be read; `remedy` is for a file that does not exist.
    pub(crate) fn unreadable(file: &Path, error: &io::Error, remedy: &str) -> Self {
        Self::whole_file(file, cannot_read(error), remedy_of(error, remedy))
    }
}

/// Returns the reason why a file could not be read, in our own words if the system's are unsuitable for
/// users.
pub(crate) fn cannot_read(error: &io::Error) -> String {
    let known = [
        (io::ErrorKind::NotFound, "there is no such file"),
        (io::ErrorKind::IsADirectory, "this is a folder, not a file"),
        (io::ErrorKind::PermissionDenied, "cannot read it: permission denied"),
    ];
    let text = known.iter().find(|(kind, _)| *kind == error.kind());
    text.map_or_else(|| format!("cannot read it: {error}"), |(_, text)| (*text).to_owned())
}

/// Returns the remedy for a file that could not be read; `missing` is the remedy for a file that does not
/// exist.
pub(crate) fn remedy_of<'a>(error: &io::Error, missing: &'a str) -> &'a str {
    let is = |kinds: &[io::ErrorKind]| kinds.contains(&error.kind());
    if is(&[io::ErrorKind::PermissionDenied]) {
        "let this user read it, e.g. with chmod a+r"
    } else if is(&[io::ErrorKind::NotFound, io::ErrorKind::NotADirectory, io::ErrorKind::IsADirectory]) {
        missing
    } else {
        ""
    }
}

/// Returns at most `max` names joined by `, `; `none` if there are none.
pub(crate) fn joined(names: impl Iterator<Item = String>, max: usize) -> String {
    let mut names: Vec<_> = names.take(max + 1).collect();
    if names.len() > max {
        names.truncate(max);
        names.push("…".to_owned());
    }
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // The parts that come from the file itself have no control characters; its path may.
        for char in display(&self.file).chars() {
            if char.is_control() { write!(f, "{}", char.escape_default())? } else { write!(f, "{char}")? }
        }
        if let Some(position) = self.position {
            write!(f, ":{position}")?;
        }
        write!(f, ": ")?;
        if !self.key.is_empty() {
            write!(f, "{}: ", self.key)?;
        }
        write!(f, "{}", self.reason)?;
        if !self.remedy.is_empty() {
            write!(f, "; {}", self.remedy)?;
        }
        Ok(())
    }
}

/// An unusable configuration, with every problem found.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}", list(.0))]
pub struct Refused(pub Vec<Problem>);

impl From<Problem> for Refused {
    fn from(problem: Problem) -> Self {
        Self(vec![problem])
    }
}

/// Returns one problem per line. A remedy equal to the previous line's, such as a list of all keys, is not
/// repeated.
fn list(problems: &[Problem]) -> String {
    let mut lines = Vec::new();
    let mut before = "";
    for problem in problems {
        let is_repeated = problem.remedy == before;
        before = &problem.remedy;
        lines.push(if is_repeated {
            Problem { remedy: String::new(), ..problem.clone() }.to_string()
        } else {
            problem.to_string()
        });
    }
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn advice_that_the_line_before_gives_is_not_repeated() {
        let problem = |reason: &str, remedy: &str| Problem::whole_file(Path::new("a\u{1b}"), reason, remedy);
        let problems =
            vec![problem("x", "do this"), problem("y", "do this"), problem("z", "do that"), problem("x", "")];
        let expected = "a\\u{1b}: x; do this\na\\u{1b}: y\na\\u{1b}: z; do that\na\\u{1b}: x";
        assert_eq!(Refused(problems).to_string(), expected);
    }

    #[test]
    fn advice_fits_the_reason_why_a_file_cannot_be_read() {
        let remedy = |kind: io::ErrorKind| remedy_of(&kind.into(), "give the path");
        assert_eq!(remedy(io::ErrorKind::NotFound), "give the path");
        assert_eq!(remedy(io::ErrorKind::PermissionDenied), "let this user read it, e.g. with chmod a+r");
        assert_eq!(remedy(io::ErrorKind::StorageFull), "");
    }
}
