//! Collects the problems of one file, and reads single values: an unusable value is refused at its location,
//! and reading continues.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fmt::Display;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;

use super::key::KeyRow;
use super::location::{Location, SourceLocation, line};
use super::problem::Problem;
use super::value::{Entry, Kind, Value};
use gateway_base::near_miss::did_you_mean;

/// Keywords with their values, in the order in which a refusal lists them.
pub(crate) type Keywords<T> = &'static [(&'static str, T)];

/// Maximum length of the end of a range that is written out, digits.
const MAX_DIGITS: usize = 20;

/// A text with its location, for refusals.
#[derive(Debug, Clone)]
pub(crate) struct LocatedText {
    pub(crate) text: String,
    pub(crate) location: Location,
}

pub(crate) struct Checker {
    file: Arc<Path>,
    /// Document that explains the keys.
    see: &'static str,
    problems: RefCell<Vec<Problem>>,
    record: RefCell<Vec<RecordedKey>>,
}

/// A key that was read through its row.
#[derive(Debug, Clone)]
pub(crate) struct RecordedKey {
    /// Path of its section; empty at the top.
    pub(crate) section: String,
    pub(crate) row: &'static dyn KeyRow,
    /// The value in effect, as written by a user.
    pub(crate) value: String,
}

impl Checker {
    /// Creates a checker without problems; `see` names the document that explains the keys of the file.
    pub(crate) fn new(file: &Arc<Path>, see: &'static str) -> Self {
        Self { file: Arc::clone(file), see, problems: RefCell::default(), record: RefCell::default() }
    }

    /// Returns the folder of the file, to which its paths are relative.
    pub(crate) fn folder(&self) -> &Path {
        self.file.parent().unwrap_or(Path::new(""))
    }

    pub(crate) fn beside(&self, named: &str) -> PathBuf {
        self.folder().join(named)
    }

    pub(crate) fn source_location(&self, at: &Location) -> SourceLocation {
        at.in_file(&self.file)
    }

    pub(crate) fn refuse(&self, at: &Location, reason: impl AsRef<str>, remedy: &str) {
        let problem = self.source_location(at).problem(line(reason.as_ref()), line(remedy));
        self.problems.borrow_mut().push(problem);
    }

    /// Records a problem, and returns `None` for the caller's convenience.
    pub(crate) fn refused<T>(&self, at: &Location, reason: impl AsRef<str>, remedy: &str) -> Option<T> {
        self.refuse(at, reason, remedy);
        None
    }

    /// Records a problem whose remedy is in the document that explains the keys.
    pub(crate) fn refuse_and_explain(&self, at: &Location, reason: impl AsRef<str>) {
        self.refuse(at, reason, &format!("see {}", self.see));
    }

    /// Adds problems of another file or of this one.
    pub(crate) fn adopt(&self, problems: Vec<Problem>) {
        self.problems.borrow_mut().extend(problems);
    }

    /// Returns the value; an error is recorded at `at`.
    pub(crate) fn accept<T, E: Display>(
        &self,
        at: &Location,
        result: Result<T, E>,
        remedy: &str,
    ) -> Option<T> {
        result.map_err(|error| self.refuse(at, error.to_string(), remedy)).ok()
    }

    /// Records a key's value in effect; the last value of a key counts.
    pub(crate) fn record(&self, section: &str, row: &'static dyn KeyRow, value: String) {
        self.record.borrow_mut().push(RecordedKey { section: section.to_owned(), row, value });
    }

    /// Removes the recorded keys, except those for which `keeps` returns true.
    pub(crate) fn keep_recorded(&self, keeps: impl Fn(&RecordedKey) -> bool) {
        self.record.borrow_mut().retain(keeps);
    }

    /// Returns the keys that were read through their rows, in order.
    pub(crate) fn recorded(&self) -> Vec<RecordedKey> {
        self.record.borrow().clone()
    }

    pub(crate) fn count(&self) -> usize {
        self.problems.borrow().len()
    }

    /// Returns the value, which must exist if no problem was recorded.
    ///
    /// # Errors
    /// Returns every problem: first of other files, then of this file in the order of their locations.
    pub(crate) fn finish<T>(self, value: Option<T>) -> Result<T, Vec<Problem>> {
        let problems = self.problems.into_inner();
        match value {
            Some(value) if problems.is_empty() => Ok(value),
            Some(_) | None => {
                let (mut own, mut all): (Vec<_>, Vec<_>) =
                    problems.into_iter().partition(|problem| problem.file == *self.file);
                own.sort_by_key(|problem| problem.position);
                // A value that is read twice is refused twice.
                let mut known = BTreeSet::new();
                own.retain(|problem| known.insert((problem.position, problem.reason.clone())));
                all.extend(own);
                Err(all)
            }
        }
    }

    /// Returns a single value as text, quoted or not; refuses anything else.
    pub(crate) fn text(&self, value: &Value) -> Option<LocatedText> {
        let Some((text, _)) = value.scalar() else {
            self.refuse_kind(value, "a single value");
            return None;
        };
        Some(LocatedText { text: text.to_owned(), location: value.location.clone() })
    }

    /// Returns a text in quotes; refuses anything else.
    pub(crate) fn string(&self, value: &Value) -> Option<LocatedText> {
        match value.scalar() {
            Some((_, true)) => return self.text(value),
            Some((text, false)) => {
                let reason = format!("expected a text in quotes, found {}", value.described());
                self.refuse(&value.location, reason, &format!("write {text:?}"));
            }
            None => self.refuse_kind(value, "a text in quotes"),
        }
        None
    }

    /// Returns a number in a range; `unit` is for refusals, empty for a plain number.
    pub(crate) fn number<T: FromStr + Display + PartialOrd>(
        &self,
        value: &Value,
        range: &RangeInclusive<T>,
        unit: &str,
    ) -> Option<T> {
        let (first, last) = (range.start().to_string(), range.end().to_string());
        // The largest number of a type is not a readable limit.
        let remedy = if last.len() > MAX_DIGITS {
            format!("give {} or more", with_unit(&first, unit))
        } else {
            format!("give {first} to {}", with_unit(&last, unit))
        };
        self.number_that(value, |number| range.contains(number), unit, &remedy)
    }

    pub(crate) fn whole<T: FromStr>(&self, value: &Value) -> Option<T> {
        self.number_that(value, |_| true, "", "give a whole number")
    }

    fn number_that<T: FromStr>(
        &self,
        value: &Value,
        is_allowed: impl Fn(&T) -> bool,
        unit: &str,
        remedy: &str,
    ) -> Option<T> {
        let (given, is_quoted) = value.scalar().map_or(("", false), |(given, quoted)| (given.trim(), quoted));
        let text = if is_quoted { "" } else { given };
        let is_whole = text.trim_start_matches('-').bytes().all(|byte| byte.is_ascii_digit());
        let reason = match text.parse() {
            Ok(number) if is_allowed(&number) => return Some(number),
            Err(_) if text.parse::<f64>().is_err() => {
                format!("expected a number, found {}", value.described())
            }
            Err(_) if !is_whole => format!("expected a whole number, found {text}"),
            Ok(_) | Err(_) => format!("{} is out of range", with_unit(text, unit)),
        };
        let unquoted = given.parse().ok().filter(|number| is_quoted && is_allowed(number));
        let unquoted = unquoted.map(|_| format!("write {given} without quotes"));
        self.refuse(&value.location, reason, unquoted.as_deref().unwrap_or(remedy));
        None
    }

    pub(crate) fn flag(&self, value: &Value) -> Option<bool> {
        match value.scalar() {
            Some((text @ ("true" | "false"), true)) => {
                let reason = format!("expected true or false, found {}", value.described());
                self.refuse(&value.location, reason, &format!("write {text} without quotes"));
            }
            Some((text @ ("true" | "false"), false)) => return Some(text == "true"),
            Some(_) | None => self.refuse_kind(value, "true or false"),
        }
        None
    }

    pub(crate) fn keyword<T: Copy>(&self, given: &LocatedText, keywords: &[(&str, T)]) -> Option<T> {
        let found = keywords.iter().find(|(keyword, _)| *keyword == given.text);
        if found.is_none() {
            let known: Vec<_> = keywords.iter().map(|(keyword, _)| *keyword).collect();
            let reason = format!("unknown value {:?}", given.text);
            let all = format!("give one of {}", known.join(", "));
            self.refuse(&given.location, reason, &did_you_mean(&given.text, known, all));
        }
        found.map(|(_, value)| *value)
    }

    /// Returns the values of a list; `example` is part of the remedy if the value is not a list.
    pub(crate) fn list<'v>(&self, value: &'v Value, example: &str) -> &'v [Value] {
        if let Kind::List(items) = &value.kind {
            return items;
        }
        self.refuse(&value.location, format!("expected a list, found {}", value.described()), example);
        &[]
    }

    /// Returns the entries of a table; `example` is part of the remedy if the value is not a table.
    pub(crate) fn entries<'v>(&self, value: &'v Value, example: &str) -> &'v [Entry] {
        if let Kind::Map(entries) = &value.kind {
            return entries;
        }
        self.refuse(&value.location, format!("expected a table, found {}", value.described()), example);
        &[]
    }

    /// Refuses a value of another kind than expected.
    pub(crate) fn refuse_kind(&self, value: &Value, expected: &str) {
        self.refuse_and_explain(&value.location, format!("expected {expected}, found {}", value.described()));
    }
}

fn with_unit(number: &str, unit: &str) -> String {
    if unit.is_empty() { number.to_owned() } else { format!("{number} {unit}") }
}
