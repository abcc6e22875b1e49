//! Checks of a TOML document's values: what is wrong is noted, and checking goes on.

use std::fmt::Display;
use std::ops::{Range, RangeInclusive};
use std::path::{Path, PathBuf};
use std::time::Duration;

use toml::Spanned;

use super::document::Document;
use super::problem::Problem;

/// No limit is longer than an hour, ms.
pub(in crate::config) const MAX_LIMIT_MS: u64 = 3_600_000;

/// Collects the problems of one document.
#[derive(Debug)]
pub(in crate::config) struct Checker<'a> {
    document: &'a Document,
    pub(in crate::config) problems: Vec<Problem>,
}

impl<'a> Checker<'a> {
    /// A checker without any problem so far.
    pub(in crate::config) fn new(document: &'a Document) -> Self {
        Self { document, problems: Vec::new() }
    }

    /// The folder of the document, to which its paths are relative.
    pub(in crate::config) fn folder(&self) -> &'a Path {
        self.document.path().parent().unwrap_or(Path::new(""))
    }

    /// A path that the document names.
    pub(in crate::config) fn beside(&self, path: &Spanned<String>) -> PathBuf {
        self.folder().join(path.get_ref())
    }

    /// Notes a problem at a place; `0..0` is the whole file.
    pub(in crate::config) fn refuse_at(&mut self, at: Range<usize>, reason: impl Into<String>, remedy: &str) {
        self.problems.push(self.document.problem(at, reason, remedy));
    }

    /// Notes a problem with a value.
    pub(in crate::config) fn refuse<T>(
        &mut self,
        value: &Spanned<T>,
        reason: impl Into<String>,
        remedy: &str,
    ) {
        self.refuse_at(value.span(), reason, remedy);
    }

    /// The value, refused for `reason`, in which `{}` stands for it, when it is out of range; `None` without a
    /// value.
    pub(in crate::config) fn in_range<T: Copy + Display + PartialOrd>(
        &mut self,
        given: Option<&Spanned<T>>,
        range: &RangeInclusive<T>,
        reason: &str,
        remedy: &str,
    ) -> Option<T> {
        let given = given?;
        let value = *given.get_ref();
        if !range.contains(&value) {
            self.refuse(given, reason.replace("{}", &value.to_string()), remedy);
        }
        Some(value)
    }

    /// A time within a range of milliseconds; `None` without a value.
    pub(in crate::config) fn millis(
        &mut self,
        given: Option<&Spanned<u64>>,
        range: &RangeInclusive<u64>,
        reason: &str,
    ) -> Option<Duration> {
        let remedy = format!("give {} to {} ms", range.start(), range.end());
        self.in_range(given, range, reason, &remedy).map(Duration::from_millis)
    }

    /// How long something is believed or waited for: 1 ms to an hour.
    pub(in crate::config) fn limit(&mut self, given: Option<&Spanned<u64>>) -> Option<Duration> {
        self.millis(given, &(1..=MAX_LIMIT_MS), "invalid time limit {} ms")
    }

    /// A ROS name: letters, digits and underscores, not beginning with a digit.
    pub(in crate::config) fn ros_name(&mut self, given: Option<&Spanned<String>>, default: &str) -> String {
        if let Some(name) = given.filter(|name| !is_ros_name(name.get_ref())) {
            let reason = format!("{:?} is not a ROS name", name.get_ref());
            self.refuse(name, reason, "use letters, digits and _, no digit first");
        }
        given.map_or(default, |name| name.get_ref()).to_owned()
    }

    /// An absolute topic: `/a/b`.
    pub(in crate::config) fn topic(&mut self, given: Option<&Spanned<String>>, default: &str) -> String {
        if let Some(topic) = given.filter(|topic| !is_topic(topic.get_ref())) {
            self.refuse(topic, format!("{:?} is not an absolute topic", topic.get_ref()), "write it as /a/b");
        }
        given.map_or(default, |topic| topic.get_ref()).to_owned()
    }

    /// An absolute topic, or nothing at all: `""`.
    pub(in crate::config) fn optional_topic(
        &mut self,
        given: Option<&Spanned<String>>,
        default: &str,
    ) -> String {
        if given.is_some_and(|topic| topic.get_ref().is_empty()) {
            return String::new();
        }
        self.topic(given, default)
    }
}

fn is_topic(topic: &str) -> bool {
    topic.strip_prefix('/').is_some_and(|rest| rest.split('/').all(is_ros_name))
}

fn is_ros_name(name: &str) -> bool {
    name.chars().next().is_some_and(|first| first.is_ascii_alphabetic() || first == '_')
        && name.chars().all(|char| char.is_ascii_alphanumeric() || char == '_')
}
