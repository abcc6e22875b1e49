//! Judges whether frames fit a vehicle profile: lengths, periods, counters and checksums, values, and whether
//! the states are plausible for a driver.
//!
//! [`ProfileEvidence`](evidence::ProfileEvidence) accepts frames one by one and keeps counts only, so that a
//! recording of any length is judged in one pass and constant memory. The results are
//! [`ProfileFinding`](finding::ProfileFinding)s when a profile is checked, and a [`Fit`](fit::Fit) when a
//! profile is searched.

pub mod evidence;
pub mod finding;
pub mod fingerprint;
pub mod fit;
pub mod gaps;
pub mod message;
pub mod states;
mod unused;
