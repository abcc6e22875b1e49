//! Diagnostics of received traffic-light states.

use super::v2i_reception::{GroupFinding, InvalidReason, V2iReception, ValidState};
use crate::core::can::Bus;
use crate::core::diagnostics::{Level, Status};
use crate::core::time::MonoTime;
use crate::core::validation::display::{missing_reason_text, raw_text};
use crate::core::validation::integrity::IntegrityCounts;
use crate::core::validation::table::{MessageIndex, SignalIndex};

impl V2iReception {
    /// Returns a finding as text, for example `34806: red solidOn circle` or `34806: V2X.GROUP1 is stale, …`.
    pub fn finding_text(&self, finding: GroupFinding, buses: &[Bus]) -> String {
        let text = match finding.state {
            Ok(ValidState { bulbs, .. }) => bulbs.to_string(),
            Err(reason) => self.invalid_text(reason, buses),
        };
        format!("{}: {text}", finding.id)
    }

    /// Returns the diagnostic status of the reception.
    pub fn status(&self, buses: &[Bus], now: MonoTime) -> Status {
        let findings: Vec<_> = self.findings().collect();
        let known = findings.iter().filter(|finding| finding.state.is_ok()).count();
        let is_bad = |state: Result<_, InvalidReason>| state.is_err_and(|reason| reason.level() > Level::Ok);
        let bad: Vec<_> = findings.iter().filter(|finding| is_bad(finding.state)).collect();
        let message = match bad.first() {
            None => format!("{known} of {} known", findings.len()),
            Some(first) => {
                let others = match bad.len() - 1 {
                    0 => String::new(),
                    others => format!(" (and {others} more)"),
                };
                format!("{}{others}", self.finding_text(**first, buses))
            }
        };
        let (_, observations) = self.received();
        let messages = (0..self.binding().table.messages.len()).map(MessageIndex);
        let frames: u64 = messages.clone().map(|message| observations.counts(message).frames).sum();
        let too_short: u64 = messages.clone().map(|message| observations.counts(message).too_short).sum();
        let checkers = messages.filter_map(|message| observations.integrity_counts(message));
        let newest = self.valid_states().map(|(_, state)| now.since(state.received.at)).min();
        let all: Vec<_> = findings.iter().map(|finding| self.finding_text(*finding, buses)).collect();
        let rejected: u64 = checkers.map(|counts| IntegrityCounts::rejected(&counts)).sum();
        let values = vec![
            ("groups", all.join("; ")),
            ("known_groups", known.to_string()),
            ("age_ms", newest.map_or("never".to_owned(), |age| age.as_millis().to_string())),
            ("frames", frames.to_string()),
            ("too_short_frames", too_short.to_string()),
            ("rejected_frames", rejected.to_string()),
            ("unmapped_count", self.counts().unmapped.to_string()),
            ("undefined_count", self.counts().undefined.to_string()),
        ];
        let level = if bad.is_empty() { Level::Ok } else { Level::Warn };
        Status::new("v2i_traffic_lights", level, message, values)
    }

    fn invalid_text(&self, reason: InvalidReason, buses: &[Bus]) -> String {
        let table = &self.binding().table;
        let value =
            |signal: SignalIndex, raw| format!("{} = {}", table.signals[signal.0].name, raw_text(raw));
        match reason {
            InvalidReason::Absent(signal, why) => missing_reason_text(table, buses, signal, why),
            InvalidReason::NotReceived => "not received yet".to_owned(),
            InvalidReason::NotReceivedAgain => "not received again".to_owned(),
            InvalidReason::Unusable(signal, raw) => {
                format!("{} reports that states cannot be used", value(signal, raw))
            }
            InvalidReason::NotAvailable(signal, raw) => format!("{} means not available", value(signal, raw)),
            InvalidReason::Fault(signal, raw) => format!("{} means fault", value(signal, raw)),
            InvalidReason::Undefined(signal, raw) => format!("{} is not a defined value", value(signal, raw)),
        }
    }
}
