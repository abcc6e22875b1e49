//! Diagnostics of a report: its signals, and its finding with its history.

use super::failure::FailureHistory;
use super::snapshot::{ReportSnapshot, ReportState};
use can_signal::validation::display::raw_text;
use can_signal::validation::integrity::IntegrityCounts;
use can_signal::validation::observation::MessageCounts;
use can_signal::validation::snapshot::Received;
use can_signal::validation::table::{MessageIndex, SignalIndex, SignalTable};
use can_signal::validation::unusable::FaultKind;
use gateway_base::diagnostics::{RateMeter, Status};
use gateway_base::time::{MonoTime, WallStamp};

/// Condition of a report for diagnostics.
pub trait ReportFinding: Copy + Default + PartialEq {
    /// Returns the kind of failure; `None` without a failure.
    fn failure(&self) -> Option<FaultKind>;

    /// Returns the state of the report: its failure, or why it is withheld without one.
    fn state(&self) -> ReportState;
}

/// Diagnostic task of a report.
#[derive(Debug, Clone)]
pub struct ReportTask<F> {
    /// Signals on which the report depends.
    signals: Vec<SignalIndex>,
    /// Rate of the frames that carry them.
    rate: RateMeter,
    /// Current finding; `None` before the first.
    pub(crate) finding: Option<F>,
    failures: FailureHistory,
}

impl<F: ReportFinding> ReportTask<F> {
    /// Creates the task of a report before any frame.
    pub fn new(signals: Vec<SignalIndex>) -> Self {
        Self { signals, rate: RateMeter::default(), finding: None, failures: FailureHistory::default() }
    }

    /// Replaces the signals; rate and history are kept.
    pub fn reconfigure(&mut self, signals: Vec<SignalIndex>) {
        self.signals = signals;
    }

    /// Updates the finding and returns whether it has changed. `text` describes a failure.
    pub fn update(&mut self, finding: F, text: impl FnOnce() -> String, now: MonoTime) -> bool {
        if self.finding == Some(finding) {
            return false;
        }
        let before = self.finding.replace(finding).and_then(|before| before.failure());
        self.failures.changed(before, finding.failure(), text, now);
        true
    }

    /// Samples the frame count from which the rate is computed; call it at every refresh.
    pub fn sample_rate(&mut self, received: Received<'_>, now: MonoTime) {
        self.rate.sample(frames(&self.messages(received.table), received), now);
    }

    /// Adds the signals and failures to the status of the report.
    pub fn add_to(&self, status: &mut Status, received: Received<'_>, now: MonoTime) {
        let names = self.signals.iter().map(|signal| received.table.signals[signal.0].name.clone());
        status.signals = names.collect();
        if !self.signals.is_empty() {
            self.add_signal_values(status, received, now);
        }
        let is_bad = self.finding.is_some_and(|finding| finding.failure().is_some());
        status.values.extend(self.failures.status_values(is_bad, now));
    }

    /// Returns the state of a report with this status; `source` is empty for the only source.
    pub fn snapshot<T>(
        &self,
        current: Option<(T, WallStamp)>,
        status: Status,
        source: &str,
        now: MonoTime,
    ) -> ReportSnapshot<T> {
        let (published, stamp) = current.unzip();
        ReportSnapshot {
            withheld: published.is_none().then(|| status.message.clone()),
            published,
            state: self.finding.map_or(ReportState::Unknown, |finding| finding.state()),
            failure: self.finding.and_then(|finding| finding.failure()),
            level: status.level,
            message: status.message,
            source: (!source.is_empty()).then(|| source.to_owned()),
            reason: None,
            stamp_ns: stamp.map(WallStamp::as_nanos),
            signals: status.signals,
            failures: self.failures.counts,
            last_failure: self.failures.last(now),
        }
    }

    fn add_signal_values(&self, status: &mut Status, received: Received<'_>, now: MonoTime) {
        let observations = received.observations;
        let age = |signal: &SignalIndex| observations.last(*signal).map(|last| now.since(last.received.at));
        let raw = |signal: &SignalIndex| {
            observations.last(*signal).map_or("none".into(), |last| raw_text(last.raw))
        };
        let oldest = self.signals.iter().map(age).max().flatten();
        let any_never = self.signals.iter().any(|signal| age(signal).is_none());
        let messages = self.messages(received.table);
        let frames = frames(&messages, received);
        let total = |count: fn(MessageCounts) -> u64| -> u64 {
            messages.iter().map(|message| count(observations.counts(*message))).sum()
        };
        let raw_values: Vec<_> = self.signals.iter().map(raw).collect();
        let age_ms = oldest.filter(|_| !any_never).map_or("never".into(), |age| age.as_millis().to_string());
        status.values.extend([
            ("signal", status.signals.join(", ")),
            ("raw_value", raw_values.join(", ")),
            ("age_ms", age_ms),
            ("frames", frames.to_string()),
            ("rate_hz", format!("{:.1}", self.rate.rate_hz(frames, now))),
            ("too_short_frames", total(|counts| counts.too_short).to_string()),
        ]);
        let wrong_format = total(|counts| counts.wrong_format);
        status.values.extend((wrong_format > 0).then(|| ("wrong_format_frames", wrong_format.to_string())));
        add_integrity_values(status, received, &messages);
    }

    fn messages(&self, table: &SignalTable) -> Vec<MessageIndex> {
        let mut messages: Vec<_> =
            self.signals.iter().map(|signal| table.signals[signal.0].message).collect();
        messages.sort_unstable();
        messages.dedup();
        messages
    }
}

fn frames(messages: &[MessageIndex], received: Received<'_>) -> u64 {
    messages.iter().map(|message| received.observations.counts(*message).frames).sum()
}

/// Adds the integrity counts of messages, unless no message has integrity rules.
fn add_integrity_values(status: &mut Status, received: Received<'_>, messages: &[MessageIndex]) {
    let observations = received.observations;
    let counts: Vec<_> =
        messages.iter().filter_map(|message| observations.integrity_counts(*message)).collect();
    if counts.is_empty() {
        return;
    }
    let last = messages.iter().filter_map(|message| {
        let name = &received.table.messages[message.0].name;
        observations.last_reject(*message).map(|reject| format!("{name}: {reject}"))
    });
    let last = last.collect::<Vec<_>>().join("; ");
    status.values.extend([
        ("rejected_frames", counts.iter().map(IntegrityCounts::rejected).sum::<u64>().to_string()),
        ("wrong_checksums", counts.iter().map(|counts| counts.wrong_checksum).sum::<u64>().to_string()),
        ("lost_frames", counts.iter().map(|counts| counts.lost).sum::<u64>().to_string()),
        ("last_reject", if last.is_empty() { "none".to_owned() } else { last }),
    ]);
}
