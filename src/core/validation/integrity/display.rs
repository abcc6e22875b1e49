//! Texts for the integrity rules of a message and for the results of its frames.

use std::fmt;

use super::checksum::{Checksum, Rule};
use super::counter::CounterRule;
use super::e2e::{E2e, Profile};
use super::window::E2eState;
use super::{IntegrityCounts, MessageIntegrity, Protection, Reject};

/// All rules, e.g. `Honda's checksum and a counter of 0 to 3 in steps of at most 2`.
impl fmt::Display for MessageIntegrity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut parts = Vec::new();
        parts.extend(self.length.map(|length| format!("a length of {length} bytes")));
        match &self.protection {
            Protection::Fields { checksum, counter } => {
                parts.extend(checksum.as_ref().map(|checksum| checksum_text(checksum).to_owned()));
                parts.extend(counter.as_ref().map(|counter| counter_text(counter.rule())));
            }
            Protection::E2e { profile, counter } => {
                parts.push(format!("E2E profile {}", profile_name(profile)));
                parts.push(counter_text(counter));
            }
        }
        parts.extend(self.window.map(|_| "enough good frames in a window".to_owned()));
        f.write_str(&parts.join(" and "))
    }
}

fn checksum_text(checksum: &Checksum) -> &'static str {
    match checksum.rule() {
        Rule::Honda => "Honda's checksum",
        Rule::Psa { .. } => "PSA's checksum",
        Rule::Sum(_) => "a sum of bytes",
        Rule::Xor { .. } => "an exclusive or of bytes",
        Rule::Crc(crc) if crc.width() == 8 => "a CRC of 8 bits",
        Rule::Crc(_) => "a CRC of 16 bits",
    }
}

fn counter_text(rule: &CounterRule) -> String {
    let ((first, last), step) = (rule.range(), rule.max_step());
    format!("a counter of {first} to {last} in steps of at most {step}")
}

fn profile_name(profile: &E2e) -> &'static str {
    match profile.profile() {
        Profile::P01 { .. } => "1",
        Profile::P02 { .. } => "2",
        Profile::P04 { .. } => "4",
        Profile::P05 { .. } => "5",
        Profile::P06 { .. } => "6",
        Profile::P07 { .. } => "7",
    }
}

impl IntegrityCounts {
    /// Number of rejected frames for each reason, with the text of [`Reject::reason`]; includes zeros.
    pub fn by_reason(&self) -> [(&'static str, u64); 9] {
        [
            (Reject::Initial, self.initial),
            (Reject::WrongLength(0), self.wrong_length),
            (Reject::WrongChecksum { stored: 0, expected: 0 }, self.wrong_checksum),
            (Reject::WrongDataId { stored: 0, expected: 0 }, self.wrong_data_id),
            (Reject::CounterOutOfRange(0), self.counter_out_of_range),
            (Reject::Repeated, self.repeated),
            (Reject::WrongSequence { from: 0, to: 0 }, self.wrong_sequence),
            (Reject::Syncing(0), self.syncing),
            (Reject::NotValid(E2eState::NoData), self.not_valid),
        ]
        .map(|(reject, count)| (reject.reason(), count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_by_reason_add_up_to_rejected() {
        let counts = IntegrityCounts {
            trusted: 1_000,
            lost: 2_000,
            initial: 1,
            wrong_length: 2,
            wrong_checksum: 4,
            wrong_data_id: 8,
            counter_out_of_range: 16,
            repeated: 32,
            wrong_sequence: 64,
            syncing: 128,
            not_valid: 256,
        };
        let reasons = counts.by_reason();
        assert_eq!(reasons.iter().map(|(_, count)| count).sum::<u64>(), counts.rejected());
        assert!(reasons.contains(&("wrong checksum", 4)) && reasons.contains(&("repeated counter", 32)));
    }
}
