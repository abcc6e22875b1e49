//! Changes of the last hours: reports, statuses, new requests to the vehicle, and starts and stops of the
//! process.
//!
//! [`History`] is bounded in bytes. When it is full, the subject that uses the most memory loses its oldest
//! entry, so a status that changes constantly displaces only its own entries.

use std::collections::{BTreeMap, VecDeque};
use std::ops::RangeInclusive;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use gateway_base::diagnostics::Level;
use gateway_base::time::{MonoTime, WallStamp};

/// Longest text of an entry, bytes.
const MAX_TEXT: usize = 2_000;
/// Memory per entry in addition to its texts, bytes.
const OVERHEAD: usize = 240 + MAX_RECORDING;
/// Largest number of an entry, chosen so that JavaScript can still count on from it; a file with a larger
/// number was not written by the gateway.
const MAX_NUMBER: u64 = 1 << 52;
/// Longest name of a recording, bytes.
const MAX_RECORDING: usize = 64;
/// Maximum number of subjects in a restored history.
const MAX_SUBJECTS: usize = 1_000;

/// What a change is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ChangeKind {
    /// A report is published, or has another value, which is the text.
    ReportPublished,
    /// A report is no longer published.
    ReportWithdrawn,
    /// A status has another level or message.
    Status,
    /// A new request goes to the vehicle.
    CommandSent,
    /// The gateway has started.
    Started,
    /// The gateway ends in order.
    Stopped,
    /// Changes before it are missing, such as those of a process that was killed.
    Missing,
}

/// A change to be added to the history.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Change {
    /// Kind of its subject.
    pub kind: ChangeKind,
    /// Severity of a status; WARN where a report ends.
    pub level: Level,
    /// The report, status or other subject that has changed.
    pub subject: String,
    /// Value of the report, message of the status, or event.
    pub text: String,
    /// Remedy; empty if no action is needed.
    pub remedy: String,
}

/// A change that is kept.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HistoryEntry {
    /// Number, which grows from entry to entry, also over a restart. A number that is missing was displaced.
    pub number: u64,
    /// Time of the computer's clock, nanoseconds since 1970.
    pub stamp_ns: i64,
    /// What has changed.
    pub kind: ChangeKind,
    /// Severity of a status; WARN where a report ends.
    pub level: Level,
    /// The report, the status, or whatever else has changed.
    pub subject: String,
    /// Value of the report, message of the status, or what happened.
    pub text: String,
    /// What to do; `None` if nothing is to be done.
    pub remedy: Option<String>,
    /// The black-box file with the frames that led to it; `None` if there is none, or not yet.
    pub black_box: Option<InBlackBox>,
}

impl HistoryEntry {
    /// Returns the time by the computer's clock.
    pub fn stamp(&self) -> WallStamp {
        WallStamp::from_nanos(self.stamp_ns)
    }
}

/// A place in a black-box file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InBlackBox {
    /// Boot and time of the recording, with which the names of its files end.
    pub recording: String,
    /// Time since the first frame of the recording, microseconds.
    pub at_us: u64,
}

/// Changes of the last hours.
#[derive(Debug, Clone)]
pub struct History {
    subjects: BTreeMap<String, Subject>,
    max_bytes: usize,
    bytes: usize,
    next_number: u64,
    revision: u64,
}

/// The entries of a subject, oldest first.
#[derive(Debug, Clone, Default)]
struct Subject {
    entries: VecDeque<Kept>,
    bytes: usize,
}

#[derive(Debug, Clone)]
struct Kept {
    entry: HistoryEntry,
    /// Time of the gateway's decision; `None` for an entry from an earlier process, or about the process
    /// itself.
    at: Option<MonoTime>,
}

/// Selects entries of the history.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HistoryRequest {
    /// Entries after this number, starting with the oldest of them.
    pub after: Option<u64>,
    /// Entries before this number, starting with the newest of them; without a number, the newest of all.
    pub before: Option<u64>,
    /// Maximum number of entries to return.
    pub count: Option<usize>,
    /// Lowest level to return.
    pub level: Level,
}

/// An answer to a [`HistoryRequest`].
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct HistoryPage {
    /// Entries in the order of their numbers.
    pub entries: Vec<HistoryEntry>,
    /// True if the request finds more than these.
    pub has_more: bool,
    /// Number of the next change.
    pub next_number: u64,
}

impl History {
    /// Maximum number of entries in an answer.
    pub const MAX_PAGE: usize = 500;

    /// Creates an empty history that uses at most about `max_bytes` bytes.
    pub fn new(max_bytes: usize) -> Self {
        Self { subjects: BTreeMap::new(), max_bytes, bytes: 0, next_number: 1, revision: 0 }
    }

    /// Returns the number of the next entry.
    pub fn next_number(&self) -> u64 {
        self.next_number
    }

    /// Gives the next entry at least this `number`, so that no number of an earlier process is reused.
    pub fn go_on_from(&mut self, number: u64) {
        self.next_number = self.next_number.max(number.min(MAX_NUMBER));
    }

    /// Returns a number that increases with each change of the contents.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Inserts entries of an earlier process before all later ones. Returns how many could not be used
    /// because their numbers do not increase, they are too long, or they have too many subjects.
    pub fn restore(&mut self, entries: impl IntoIterator<Item = HistoryEntry>) -> u64 {
        let mut unusable = 0;
        for entry in entries {
            let texts = [&entry.subject, &entry.text, entry.remedy.as_ref().unwrap_or(&entry.text)];
            let recording = entry.black_box.as_ref().map_or(0, |place| place.recording.len());
            let is_usable = (self.next_number..MAX_NUMBER).contains(&entry.number)
                && texts.iter().all(|text| text.len() <= MAX_TEXT)
                && recording <= MAX_RECORDING
                && (self.subjects.len() < MAX_SUBJECTS || self.subjects.contains_key(&entry.subject));
            if is_usable {
                self.next_number = entry.number + 1;
                self.keep(Kept { entry, at: None });
            } else {
                unusable += 1;
            }
        }
        unusable
    }

    /// Adds a change. `at` is the time of the gateway's decision, if it made one, and `stamp` the time by the
    /// computer's clock.
    pub fn add(&mut self, change: Change, at: Option<MonoTime>, stamp: WallStamp) {
        let Change { kind, level, subject, text, remedy } = change;
        let [subject, text, remedy] = [subject, text, remedy].map(shortened);
        let entry = HistoryEntry {
            number: self.next_number,
            stamp_ns: stamp.as_nanos(),
            kind,
            level,
            subject,
            text,
            remedy: Some(remedy).filter(|remedy| !remedy.is_empty()),
            black_box: None,
        };
        self.next_number += 1;
        self.keep(Kept { entry, at });
    }

    /// Marks the entries of this time span as covered by the recording with this name.
    pub fn recorded(&mut self, time: &RangeInclusive<MonoTime>, recording: &str) {
        let (start, end) = (*time.start(), *time.end());
        self.revision += 1;
        let entries = self.subjects.values_mut().flat_map(|subject| {
            let is_of_this_time = move |kept: &&mut Kept| kept.at.is_some_and(|at| at >= start);
            subject.entries.iter_mut().rev().take_while(is_of_this_time)
        });
        for Kept { entry, at } in entries {
            let Some(at) = at.filter(|at| *at <= end) else { continue };
            let at_us = u64::try_from(at.since(start).as_micros()).unwrap_or(u64::MAX);
            // The first recording that covers it has more of the preceding time.
            entry.black_box.get_or_insert(InBlackBox { recording: recording.to_owned(), at_us });
        }
    }

    /// Returns an entry by its number.
    pub fn entry(&self, number: u64) -> Option<&HistoryEntry> {
        let find =
            |subject: &Subject| subject.entries.binary_search_by_key(&number, |kept| kept.entry.number).ok();
        self.subjects.values().find_map(|subject| Some(&subject.entries.get(find(subject)?)?.entry))
    }

    /// Returns the entries selected by `request`, at most [`Self::MAX_PAGE`].
    pub fn page(&self, request: HistoryRequest) -> HistoryPage {
        let count = request.count.unwrap_or(Self::MAX_PAGE).clamp(1, Self::MAX_PAGE);
        let after = request.after.unwrap_or(0);
        let before = request.before.unwrap_or(u64::MAX);
        let is_from_oldest = request.after.is_some();
        let mut found: Vec<_> = self
            .subjects
            .values()
            .flat_map(|subject| {
                let first = subject.entries.partition_point(|kept| kept.entry.number <= after);
                let end = subject.entries.partition_point(|kept| kept.entry.number < before).max(first);
                let entries = subject.entries.range(first..end).map(|kept| &kept.entry);
                let wanted = entries.filter(|entry| entry.level >= request.level);
                // One more entry than requested shows whether there are more.
                let part: Vec<_> = if is_from_oldest {
                    wanted.take(count + 1).collect()
                } else {
                    wanted.rev().take(count + 1).collect()
                };
                part
            })
            .collect();
        found.sort_unstable_by_key(|entry| entry.number);
        let has_more = found.len() > count;
        let surplus = found.len().saturating_sub(count);
        let found = if is_from_oldest { &found[..found.len() - surplus] } else { &found[surplus..] };
        HistoryPage {
            entries: found.iter().map(|entry| (*entry).clone()).collect(),
            has_more,
            next_number: self.next_number,
        }
    }

    /// Returns all entries in the order of their numbers.
    pub fn entries(&self) -> Vec<HistoryEntry> {
        let entries = self.subjects.values().flat_map(|subject| &subject.entries);
        let mut entries: Vec<_> = entries.map(|kept| kept.entry.clone()).collect();
        entries.sort_unstable_by_key(|entry| entry.number);
        entries
    }

    fn keep(&mut self, kept: Kept) {
        self.revision += 1;
        let bytes = size(&kept.entry);
        let subject = self.subjects.entry(kept.entry.subject.clone()).or_default();
        subject.entries.push_back(kept);
        subject.bytes += bytes;
        self.bytes += bytes;
        while self.bytes > self.max_bytes && self.drop_one() {}
    }

    /// Drops the oldest entry of the largest subject; returns false if there is none.
    fn drop_one(&mut self) -> bool {
        let largest = self.subjects.iter_mut().max_by_key(|(_, subject)| subject.bytes);
        let Some((name, subject)) = largest else { return false };
        let dropped = subject.entries.pop_front().map_or(0, |kept| size(&kept.entry));
        subject.bytes = subject.bytes.saturating_sub(dropped);
        self.bytes = self.bytes.saturating_sub(dropped);
        if subject.entries.is_empty() {
            let name = name.clone();
            self.subjects.remove(&name);
        }
        true
    }
}

fn size(entry: &HistoryEntry) -> usize {
    OVERHEAD + entry.subject.len() + entry.text.len() + entry.remedy.as_ref().map_or(0, String::len)
}

/// Shortens a text to the length that may be kept.
fn shortened(mut text: String) -> String {
    if text.len() > MAX_TEXT {
        let room = MAX_TEXT - '…'.len_utf8();
        let end = (0..=room).rev().find(|at| text.is_char_boundary(*at)).unwrap_or(0);
        text.truncate(end);
        text.push('…');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn change(subject: &str, text: &str) -> Change {
        Change {
            kind: ChangeKind::Status,
            level: Level::Error,
            subject: subject.to_owned(),
            text: text.to_owned(),
            remedy: String::new(),
        }
    }

    fn add(history: &mut History, subject: &str, millis: u64) {
        let stamp = WallStamp::from_nanos(i64::try_from(millis).unwrap());
        history.add(change(subject, "text"), Some(MonoTime::from_millis(millis)), stamp);
    }

    fn numbers(page: &HistoryPage) -> Vec<u64> {
        page.entries.iter().map(|entry| entry.number).collect()
    }

    /// Adds entries 1 to 9: even numbers belong to `b`, odd numbers to `a`; 3, 6 and 9 are OK.
    fn nine() -> History {
        let mut history = History::new(1_000_000);
        for number in 1..10 {
            let subject = if number % 2 == 0 { "b" } else { "a" };
            let level = if number % 3 == 0 { Level::Ok } else { Level::Error };
            let change = Change { level, ..change(subject, "text") };
            history.add(change, Some(MonoTime::from_millis(number)), WallStamp::from_nanos(0));
        }
        history
    }

    #[test]
    fn pages_follow_each_other_in_both_directions_and_say_whether_there_are_more() {
        let history = nine();
        let page = |after, before, count, level| {
            let page = history.page(HistoryRequest { after, before, count: Some(count), level });
            (numbers(&page), page.has_more)
        };
        let ok = Level::Ok;
        assert_eq!(page(None, None, 4, ok), (vec![6, 7, 8, 9], true));
        assert_eq!(page(None, Some(6), 4, ok), (vec![2, 3, 4, 5], true));
        assert_eq!(page(None, Some(2), 4, ok), (vec![1], false));
        assert_eq!(page(Some(0), None, 4, ok), (vec![1, 2, 3, 4], true));
        assert_eq!(page(Some(4), None, 5, ok), (vec![5, 6, 7, 8, 9], false));
        assert_eq!(page(Some(9), None, 4, ok), (vec![], false));
        assert_eq!(page(Some(7), Some(3), 4, ok), (vec![], false), "an empty range is no panic");
        assert_eq!(page(None, None, 3, Level::Warn), (vec![5, 7, 8], true));
        assert_eq!(page(None, Some(3), 3, Level::Warn), (vec![1, 2], false));
        assert_eq!(page(None, None, 0, ok), (vec![9], true), "at least one");
        assert_eq!(history.page(HistoryRequest::default()).entries.len(), 9);
        assert_eq!(history.entry(4).map(|entry| entry.subject.as_str()), Some("b"));
        assert_eq!(history.entry(10), None);
    }

    #[test]
    fn subject_that_changes_all_the_time_displaces_itself_alone() {
        let mut history = History::new(100 * (OVERHEAD + 10));
        add(&mut history, "calm", 0);
        for millis in 1..10_000 {
            add(&mut history, "flaps", millis);
            assert!(history.bytes <= history.max_bytes);
        }
        let entries = history.entries();
        assert!(entries.len() > 90, "{}", entries.len());
        assert_eq!((entries[0].number, entries[0].subject.as_str()), (1, "calm"));
        assert_eq!(entries.last().unwrap().number, 10_000);
        assert_eq!(history.entry(2), None);
        let sizes: usize = entries.iter().map(size).sum();
        assert_eq!(history.bytes, sizes, "what is counted is what is kept");
    }

    #[test]
    fn frames_are_found_in_the_first_recording_that_covers_a_change() {
        let mut history = History::new(1_000_000);
        let old = nine().entries();
        history.restore(old);
        for millis in [100, 200, 300, 400] {
            add(&mut history, "turn", millis);
        }
        let time = MonoTime::from_millis;
        history.recorded(&(time(150)..=time(300)), "first");
        history.recorded(&(time(250)..=time(900)), "second");
        let found = |number| {
            let place = history.entry(number)?.black_box.clone()?;
            Some((place.recording, place.at_us))
        };
        assert_eq!([1, 9, 10].map(found), [None, None, None], "nor any of an earlier process");
        assert_eq!(found(11), Some(("first".to_owned(), 50_000)));
        assert_eq!(found(12), Some(("first".to_owned(), 150_000)));
        assert_eq!(found(13), Some(("second".to_owned(), 150_000)));
    }

    #[test]
    fn entries_of_an_earlier_process_go_on_and_none_that_is_not_ours_is_taken() {
        let mut history = History::new(1_000_000);
        let mut entries = nine().entries();
        entries[4].number = 2;
        entries[5].text = "x".repeat(MAX_TEXT + 1);
        entries[6].number = MAX_NUMBER;
        entries[7].black_box = Some(InBlackBox { recording: "x".repeat(MAX_RECORDING + 1), at_us: 0 });
        assert_eq!(history.restore(entries), 4);
        add(&mut history, "new", 5);
        assert_eq!(numbers(&history.page(HistoryRequest::default())), [1, 2, 3, 4, 9, 10]);
        history.go_on_from(5);
        add(&mut history, "new", 6);
        history.go_on_from(u64::MAX);
        add(&mut history, "new", 7);
        assert_eq!(numbers(&history.page(HistoryRequest::default()))[5..], [10, 11, MAX_NUMBER]);
    }

    #[test]
    fn history_of_too_many_subjects_is_cut_short() {
        let template = nine().entries().remove(0);
        let of_many = (0..2_000).map(|number| HistoryEntry {
            number: number + 1,
            subject: number.to_string(),
            ..template.clone()
        });
        let mut history = History::new(10_000_000);
        assert_eq!(history.restore(of_many), 1_000);
        assert_eq!(history.entries().len(), MAX_SUBJECTS);
    }

    #[test]
    fn text_of_any_length_is_kept_as_far_as_there_is_room() {
        let mut history = History::new(1_000_000);
        let long = "ä".repeat(MAX_TEXT);
        history.add(change("turn", &long), None, WallStamp::from_nanos(0));
        let text = history.entries()[0].text.clone();
        assert!(text.ends_with("ä…") && (MAX_TEXT - 3..=MAX_TEXT).contains(&text.len()), "{}", text.len());
        let mut small = History::new(10);
        add(&mut small, "turn", 1);
        assert_eq!((small.entries().len(), small.bytes), (0, 0), "an entry that has no room is not kept");
    }
}
