//! Signals on which a report depends, with their received values.

use can_signal::validation::display::raw_text;
use can_signal::validation::integrity::IntegrityCounts;
use can_signal::validation::observation::{MessageCounts, Observations};
use can_signal::validation::table::{MessageIndex, SignalIndex, SignalTable};
use gateway_base::diagnostics::RateMeter;
use gateway_base::time::MonoTime;

/// Signals of a report, and the rate of the frames that carry them.
#[derive(Debug, Clone, Default)]
pub struct ReportSignals {
    signals: Vec<SignalIndex>,
    rate: RateMeter,
}

/// Received values of all signals of a flow.
#[derive(Debug, Clone, Copy)]
pub struct ReceivedSignals<'a> {
    /// Messages and signals of the flow.
    pub table: &'a SignalTable,
    /// Last values of the signals in `table`.
    pub observations: &'a Observations,
}

impl ReportSignals {
    /// Creates the signals of a report before any frame.
    pub fn new(signals: Vec<SignalIndex>) -> Self {
        Self { signals, rate: RateMeter::default() }
    }

    /// Replaces the signals; the rate is kept.
    pub fn reconfigure(&mut self, signals: Vec<SignalIndex>) {
        self.signals = signals;
    }

    /// Returns the names of the signals as `MESSAGE.SIGNAL`.
    pub fn names(&self, table: &SignalTable) -> Vec<String> {
        self.signals.iter().map(|signal| table.signals[signal.0].name.clone()).collect()
    }

    /// Samples the frame count from which the rate is computed; call it at every refresh.
    pub fn sample_rate(&mut self, received: ReceivedSignals<'_>, now: MonoTime) {
        let frames = self.frames(received);
        self.rate.sample(frames, now);
    }

    /// Returns the values for a diagnostic status; empty without signals.
    pub fn status_values(&self, received: ReceivedSignals<'_>, now: MonoTime) -> Vec<(&'static str, String)> {
        if self.signals.is_empty() {
            return Vec::new();
        }
        let observations = received.observations;
        let age = |signal: &SignalIndex| observations.last(*signal).map(|last| now.since(last.received.at));
        let raw = |signal: &SignalIndex| {
            observations.last(*signal).map_or("none".into(), |last| raw_text(last.raw))
        };
        let oldest = self.signals.iter().map(age).max().flatten();
        let any_never = self.signals.iter().any(|signal| age(signal).is_none());
        let frames = self.frames(received);
        let messages = self.messages(received.table);
        let total = |count: fn(MessageCounts) -> u64| -> u64 {
            messages.iter().map(|message| count(observations.counts(*message))).sum()
        };
        let raw_values: Vec<_> = self.signals.iter().map(raw).collect();
        let age_ms = oldest.filter(|_| !any_never).map_or("never".into(), |age| age.as_millis().to_string());
        let mut values = vec![
            ("signal", self.names(received.table).join(", ")),
            ("raw_value", raw_values.join(", ")),
            ("age_ms", age_ms),
            ("frames", frames.to_string()),
            ("rate_hz", format!("{:.1}", self.rate.rate_hz(frames, now))),
            ("too_short_frames", total(|counts| counts.too_short).to_string()),
        ];
        let wrong_format = total(|counts| counts.wrong_format);
        values.extend((wrong_format > 0).then(|| ("wrong_format_frames", wrong_format.to_string())));
        values.extend(integrity_values(received, &messages));
        values
    }

    fn messages(&self, table: &SignalTable) -> Vec<MessageIndex> {
        let mut messages: Vec<_> =
            self.signals.iter().map(|signal| table.signals[signal.0].message).collect();
        messages.sort_unstable();
        messages.dedup();
        messages
    }

    fn frames(&self, received: ReceivedSignals<'_>) -> u64 {
        let messages = self.messages(received.table);
        messages.iter().map(|message| received.observations.counts(*message).frames).sum()
    }
}

/// Returns the integrity counts of messages; empty if no message has integrity rules.
fn integrity_values(received: ReceivedSignals<'_>, messages: &[MessageIndex]) -> Vec<(&'static str, String)> {
    let observations = received.observations;
    let counts: Vec<_> =
        messages.iter().filter_map(|message| observations.integrity_counts(*message)).collect();
    if counts.is_empty() {
        return Vec::new();
    }
    let last = messages.iter().filter_map(|message| {
        let name = &received.table.messages[message.0].name;
        observations.last_reject(*message).map(|reject| format!("{name}: {reject}"))
    });
    let last = last.collect::<Vec<_>>().join("; ");
    vec![
        ("rejected_frames", counts.iter().map(IntegrityCounts::rejected).sum::<u64>().to_string()),
        ("wrong_checksums", counts.iter().map(|counts| counts.wrong_checksum).sum::<u64>().to_string()),
        ("lost_frames", counts.iter().map(|counts| counts.lost).sum::<u64>().to_string()),
        ("last_reject", if last.is_empty() { "none".to_owned() } else { last }),
    ]
}
