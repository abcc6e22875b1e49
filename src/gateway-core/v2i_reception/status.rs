//! Diagnostics of received traffic-light states.

use super::catalogue::{self, V2I_TRAFFIC_LIGHTS};
use super::{GroupFinding, InvalidReason, V2iReception, ValidState};
use can_signal::can::Bus;
use can_signal::validation::display::raw_text;
use can_signal::validation::integrity::IntegrityCounts;
use can_signal::validation::table::MessageIndex;
use gateway_base::diagnostics::{MessagePart, Status};
use gateway_base::time::MonoTime;

impl V2iReception {
    /// Returns a finding as text, for example `34806: red solidOn circle` or `34806: V2X.GROUP1 is stale, …`.
    pub fn finding_text(&self, finding: GroupFinding, buses: &[Bus]) -> String {
        let text = match finding.state {
            Ok(ValidState { bulbs, .. }) => bulbs.to_string(),
            Err(reason) => self.invalid_message(reason, buses).text,
        };
        format!("{}: {text}", finding.id)
    }

    /// Returns the diagnostic status of the reception.
    pub fn status(&self, buses: &[Bus], now: MonoTime) -> Status {
        let findings: Vec<_> = self.findings().collect();
        let known = findings.iter().filter(|finding| finding.state.is_ok()).count();
        let mut bad = findings.iter().filter_map(|finding| {
            let reason = finding.state.err().filter(|reason| reason.is_bad())?;
            Some((finding.id, reason))
        });
        let message = match bad.next() {
            None => catalogue::known(known, findings.len()),
            Some((id, reason)) => {
                let others = match bad.count() {
                    0 => String::new(),
                    others => format!(" (and {others} more)"),
                };
                let message =
                    self.invalid_message(reason, buses).within(|reason| catalogue::group(id, reason));
                message.with_text(|text| text + &others)
            }
        };
        let Self { binding, observations, .. } = self;
        let messages = (0..binding.table.messages.len()).map(MessageIndex);
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
        Status::new(&V2I_TRAFFIC_LIGHTS, "v2i_traffic_lights", &[message], values)
    }

    fn invalid_message(&self, reason: InvalidReason, buses: &[Bus]) -> MessagePart {
        let table = &self.binding().table;
        match reason {
            InvalidReason::Signal(reason) => reason.message(table, buses),
            InvalidReason::NotReceived => catalogue::not_received(),
            InvalidReason::NotReceivedAgain => catalogue::not_received_again(),
            InvalidReason::StatesUnusable(signal, raw) => {
                catalogue::states_unusable(&table.signals[signal.0].name, raw_text(raw))
            }
        }
    }
}
