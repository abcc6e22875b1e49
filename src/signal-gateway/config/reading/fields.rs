//! Reads a table key by key; keys that were not read are refused at the end.

use std::cell::{Cell, RefCell};
use std::fmt::Display;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::rc::Rc;
use std::str::FromStr;
use std::time::Duration;

use super::checker::{Checker, LocatedText};
use super::key::KeyRow;
use super::location::{KeyPath, Location};
use super::value::{Entry, Kind, Value};
use gateway_base::near_miss::did_you_mean;

/// Maximum time limit, an hour in ms.
pub(crate) const MAX_LIMIT_MS: u64 = 3_600_000;

/// The keys of a table. Each reading method takes a key and returns `None` if it is absent or its value was
/// refused.
pub(crate) struct Fields<'c> {
    pub(crate) checker: &'c Checker,
    location: &'c Location,
    /// The path of the table, even if the table is absent.
    path: Rc<KeyPath>,
    entries: &'c [Entry],
    known: RefCell<Vec<&'static str>>,
    /// The form of the table, for refusals: `with kind = "lamp"`; empty if it has only one form.
    form: Cell<&'static str>,
    /// True while the form is unknown, so that any key may be right.
    is_open: Cell<bool>,
}

impl<'c> Fields<'c> {
    /// Returns the keys of a table; any other value is refused.
    pub(crate) fn of(checker: &'c Checker, value: &'c Value) -> Option<Self> {
        let fields = Self::of_table(checker, value);
        if fields.is_none() {
            let key = value.location.key.to_string();
            // A table in a list has no header.
            if key.is_empty() || key.contains('[') {
                checker.refuse_kind(value, "a table");
            } else {
                let reason = format!("expected a table, found {}", value.described());
                checker.refuse(&value.location, reason, &format!("write [{key}] and its keys below it"));
            }
        }
        fields
    }

    /// Returns the keys of a table; `None` for any other value.
    pub(crate) fn of_table(checker: &'c Checker, value: &'c Value) -> Option<Self> {
        let Kind::Map(entries) = &value.kind else { return None };
        Some(Self::new(checker, &value.location, Rc::clone(&value.location.key), entries))
    }

    fn new(checker: &'c Checker, location: &'c Location, path: Rc<KeyPath>, entries: &'c [Entry]) -> Self {
        Self {
            checker,
            location,
            path,
            entries,
            known: RefCell::default(),
            form: Cell::default(),
            is_open: Cell::default(),
        }
    }

    /// Records a problem at the value of a key, or at the table if the key is absent.
    pub(crate) fn refuse(&self, key: &str, reason: impl AsRef<str>, remedy: &str) {
        self.checker.refuse(self.at(key), reason, remedy);
    }

    /// Refuses like [`Self::refuse`], and returns `None` for the caller's convenience.
    pub(crate) fn refused<T>(&self, key: &str, reason: impl AsRef<str>, remedy: &str) -> Option<T> {
        self.checker.refused(self.at(key), reason, remedy)
    }

    /// Returns the value of a key, which is known from now on; `None` if it is absent.
    pub(crate) fn value(&self, key: &'static str) -> Option<&'c Value> {
        let mut known = self.known.borrow_mut();
        if !known.contains(&key) {
            known.push(key);
        }
        self.entries.iter().find(|entry| entry.key == key).map(|entry| &entry.value)
    }

    /// Returns all keys in file order, without marking them as known.
    pub(crate) fn keys(&self) -> impl Iterator<Item = &'c str> + use<'c> {
        self.entries.iter().map(|entry| entry.key.as_str())
    }

    /// Returns all entries in file order, without marking them as known.
    pub(crate) fn all(&self) -> &'c [Entry] {
        self.entries
    }

    pub(crate) fn has(&self, key: &str) -> bool {
        self.entries.iter().any(|entry| entry.key == key)
    }

    /// Returns true if the key has this text. Does not mark the key as known, so it must be read elsewhere.
    pub(crate) fn is(&self, key: &str, expected: &str) -> bool {
        let has_text = |value: &Value| matches!(&value.kind, Kind::Scalar { text, .. } if text == expected);
        self.entries.iter().any(|entry| entry.key == key && has_text(&entry.value))
    }

    /// Returns the only one of several keys that is present; none or more than one is refused for `reason`.
    pub(crate) fn only_one_of(&self, keys: &[&'static str], reason: &str) -> Option<&'static str> {
        let mut given = keys.iter().filter(|key| self.has(key));
        let (Some(key), None) = (given.next(), given.next()) else {
            return self.checker.refused(self.location, reason, &format!("give one of {}", keys.join(", ")));
        };
        Some(key)
    }

    /// Returns the path of the table, even if the table is absent.
    pub(crate) fn table_path(&self) -> String {
        self.path.to_string()
    }

    pub(crate) fn location(&self) -> &'c Location {
        self.location
    }

    /// Returns the location of a key's value, or of the table if the key is absent.
    pub(crate) fn at(&self, key: &str) -> &'c Location {
        let entry = self.entries.iter().find(|entry| entry.key == key);
        entry.map_or(self.location, |entry| &entry.value.location)
    }

    /// Refuses the table if any of these keys are missing; `remedy` is empty if the document that explains
    /// the keys is sufficient.
    pub(crate) fn require(&self, keys: &[&'static str], remedy: &str) -> Option<()> {
        let missing: Vec<_> = keys.iter().filter(|key| !self.has(key)).copied().collect();
        let reason = match missing.as_slice() {
            [] => return Some(()),
            [key] => format!("missing key: {key}"),
            keys => format!("missing keys: {}", keys.join(", ")),
        };
        match remedy {
            "" => self.checker.refuse_and_explain(self.location, reason),
            remedy => self.checker.refuse(self.location, reason, remedy),
        }
        None
    }

    /// Reads a single value as text, quoted or not.
    pub(crate) fn text(&self, key: &'static str) -> Option<LocatedText> {
        self.checker.text(self.value(key)?)
    }

    /// Reads a text in quotes; anything else is refused.
    pub(crate) fn string(&self, key: &'static str) -> Option<LocatedText> {
        self.checker.string(self.value(key)?)
    }

    /// Reads a single unquoted value, which the caller converts to a number.
    pub(crate) fn unquoted(&self, key: &'static str) -> Option<LocatedText> {
        let value = self.value(key)?;
        if let Kind::Scalar { text, is_quoted: true } = &value.kind {
            let reason = format!("expected a number, found {}", value.described());
            let is_of_number = |char: char| char.is_ascii_digit() || ".-+".contains(char);
            let number = text.trim().split(|char| !is_of_number(char)).next().unwrap_or_default();
            let remedy = match number.parse::<f64>() {
                Ok(_) => format!("write {number}, without quotes and without a unit"),
                Err(_) => "give a number, without quotes".to_owned(),
            };
            return self.checker.refused(&value.location, reason, &remedy);
        }
        self.checker.text(value)
    }

    /// Reads a single value, quoted or not, that must be present.
    pub(crate) fn required_text(&self, key: &'static str) -> Option<LocatedText> {
        self.require(&[key], "")?;
        self.text(key)
    }

    /// Reads a text in quotes that must be present.
    pub(crate) fn required_string(&self, key: &'static str) -> Option<LocatedText> {
        self.require(&[key], "")?;
        self.string(key)
    }

    /// Reads a number within a range; `unit` is for refusals, empty for a plain number.
    pub(crate) fn number<T: FromStr + Display + PartialOrd>(
        &self,
        key: &'static str,
        range: RangeInclusive<T>,
        unit: &str,
    ) -> Option<T> {
        self.checker.number(self.value(key)?, &range, unit)
    }

    /// Reads a number within a range that must be present.
    pub(crate) fn required_number<T: FromStr + Display + PartialOrd>(
        &self,
        key: &'static str,
        range: RangeInclusive<T>,
        unit: &str,
    ) -> Option<T> {
        self.require(&[key], "")?;
        self.number(key, range, unit)
    }

    /// Reads a whole number of any size that fits its type.
    pub(crate) fn whole<T: FromStr>(&self, key: &'static str) -> Option<T> {
        self.checker.whole(self.value(key)?)
    }

    /// Reads a time within a range of milliseconds.
    pub(crate) fn millis(&self, key: &'static str, range: RangeInclusive<u64>) -> Option<Duration> {
        self.number(key, range, "ms").map(Duration::from_millis)
    }

    /// Reads a time limit: 1 ms to an hour.
    pub(crate) fn limit(&self, key: &'static str) -> Option<Duration> {
        self.millis(key, 1..=MAX_LIMIT_MS)
    }

    pub(crate) fn flag(&self, key: &'static str) -> Option<bool> {
        self.checker.flag(self.value(key)?)
    }

    /// Returns the value of a keyword; an unknown keyword is refused with the list of known keywords.
    pub(crate) fn keyword<T: Copy>(&self, key: &'static str, keywords: &[(&str, T)]) -> Option<T> {
        self.checker.keyword(&self.text(key)?, keywords)
    }

    /// Reads a path, relative to the file.
    pub(crate) fn path(&self, key: &'static str) -> Option<PathBuf> {
        Some(self.checker.beside(&self.string(key)?.text))
    }

    /// Records a key's value in effect, instead of the value that was read.
    pub(crate) fn record(&self, row: &'static dyn KeyRow, value: impl Into<String>) {
        self.checker.record(&self.path.to_string(), row, value.into());
    }

    /// Returns the keys of a table within the table.
    pub(crate) fn table(&self, key: &'static str) -> Option<Self> {
        Self::of(self.checker, self.value(key)?)
    }

    /// Like [`Self::table`], but treats an absent table as empty.
    pub(crate) fn section(&self, key: &'static str) -> Self {
        let absent = || Self::new(self.checker, self.location, KeyPath::below(&self.path, ".", key), &[]);
        self.table(key).unwrap_or_else(absent)
    }

    /// Returns the values of a list; empty if it is absent.
    pub(crate) fn list(&self, key: &'static str, example: &str) -> &'c [Value] {
        self.value(key).map(|value| self.checker.list(value, example)).unwrap_or_default()
    }

    /// Returns a list of tables, `[[key]]`; empty if it is absent.
    pub(crate) fn tables(&self, key: &'static str) -> impl Iterator<Item = Self> + use<'c> {
        let checker = self.checker;
        self.list(key, &format!("write [[{key}]]")).iter().filter_map(|value| Self::of(checker, value))
    }

    /// Returns the entries of a table whose keys are names; empty if it is absent.
    pub(crate) fn entries(&self, key: &'static str, example: &str) -> &'c [Entry] {
        self.value(key).map(|value| self.checker.entries(value, example)).unwrap_or_default()
    }

    /// Names the form of the table on which its known keys depend, such as `with kind = "lamp"`.
    pub(crate) fn set_form(&self, form: &'static str) {
        self.form.set(form);
    }

    /// Accepts all unread keys, since the form of the table was refused.
    pub(crate) fn accept_rest(&self) {
        self.is_open.set(true);
    }

    /// Reads the keyword on which the form of the table depends; without it, all keys are accepted.
    pub(crate) fn form<T: Copy>(&self, key: &'static str, keywords: &[(&str, T)]) -> Option<T> {
        let form = self.keyword(key, keywords);
        if form.is_none() {
            self.accept_rest();
        }
        form
    }

    /// Reads a table within the table with `read`, and refuses its keys that were not read.
    pub(crate) fn read_table<T>(
        &self,
        key: &'static str,
        read: impl FnOnce(&Self) -> Option<T>,
    ) -> Option<T> {
        self.table(key)?.read_all(read)
    }

    /// Reads each table of a list like [`Self::read_table`]; refused ones are left out.
    pub(crate) fn read_tables<T>(
        &self,
        key: &'static str,
        mut read: impl FnMut(&Self) -> Option<T>,
    ) -> Vec<T> {
        self.tables(key).filter_map(|fields| fields.read_all(&mut read)).collect()
    }

    /// Reads the table with `read`, and refuses every key that was not read.
    pub(crate) fn read_all<T>(self, read: impl FnOnce(&Self) -> T) -> T {
        let value = read(&self);
        self.done();
        value
    }

    /// Refuses every key that was not read.
    pub(crate) fn done(self) {
        if self.is_open.get() {
            return;
        }
        let known = self.known.borrow();
        let all = match known.as_slice() {
            [] => "remove it".to_owned(),
            known => format!("valid keys: {}", known.join(", ")),
        };
        let missing: Vec<_> = known.iter().copied().filter(|key| !self.has(key)).collect();
        for entry in self.entries.iter().filter(|entry| !known.contains(&entry.key.as_str())) {
            let reason = format!("unknown key {:?} {}", entry.key, self.form.get());
            let remedy = did_you_mean(&entry.key, missing.iter().copied(), all.as_str());
            self.checker.refuse(&entry.location, reason.trim_end(), &remedy);
        }
    }
}
