//! A reason to refuse a configuration: file, line, column, key, reason and remedy.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// One reason to refuse a configuration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    /// Path of the file, as it was named.
    pub file: PathBuf,
    /// Line and column (characters), both from 1; `None` when the file cannot be read at all.
    pub position: Option<(usize, usize)>,
    /// Path of the key, e.g. `turn.left` or `event[2].do[1].set`; empty for the whole file.
    pub key: String,
    /// The problem, in plain text without a full stop.
    pub reason: String,
    /// The remedy, likewise; may be empty.
    pub remedy: String,
}

impl Problem {
    /// A problem of a whole file, without a position.
    pub(crate) fn whole_file(file: &Path, reason: impl Into<String>, remedy: impl Into<String>) -> Self {
        let (file, reason, remedy) = (file.to_owned(), reason.into(), remedy.into());
        Self { file, position: None, key: String::new(), reason, remedy }
    }

    /// The problem of a file that cannot be read.
    pub(crate) fn unreadable(file: &Path, error: &io::Error, remedy: &str) -> Self {
        Self::whole_file(file, format!("cannot read it: {error}"), remedy)
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if let Some((line, column)) = self.position {
            write!(f, ":{line}:{column}")?;
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

/// A configuration that cannot be used, with every reason found.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}", list(.0))]
pub struct Refused(pub Vec<Problem>);

impl From<Problem> for Refused {
    fn from(problem: Problem) -> Self {
        Self(vec![problem])
    }
}

fn list(problems: &[Problem]) -> String {
    problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}
