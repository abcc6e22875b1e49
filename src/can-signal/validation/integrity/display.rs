//! Texts for the integrity rules of a message.

use std::fmt;

use super::checksum::{Checksum, ChecksumRule};
use super::counter::CounterRule;
use super::e2e::{E2e, E2eProfile};
use super::{MessageIntegrity, Protection};

/// Formats all rules, e.g. `Honda's checksum and a counter of 0 to 3 in steps of at most 2`.
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
        ChecksumRule::Honda => "Honda's checksum",
        ChecksumRule::Psa { .. } => "PSA's checksum",
        ChecksumRule::Sum(_) => "a sum of bytes",
        ChecksumRule::Xor { .. } => "an exclusive or of bytes",
        ChecksumRule::Crc(crc) if crc.width() == 8 => "a CRC of 8 bits",
        ChecksumRule::Crc(_) => "a CRC of 16 bits",
    }
}

fn counter_text(rule: &CounterRule) -> String {
    let ((first, last), step) = (rule.range(), rule.max_step());
    format!("a counter of {first} to {last} in steps of at most {step}")
}

fn profile_name(profile: &E2e) -> &'static str {
    match profile.profile() {
        E2eProfile::P01 { .. } => "1",
        E2eProfile::P02 { .. } => "2",
        E2eProfile::P04 { .. } => "4",
        E2eProfile::P05 { .. } => "5",
        E2eProfile::P06 { .. } => "6",
        E2eProfile::P07 { .. } => "7",
    }
}
