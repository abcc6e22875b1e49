//! Judges whether frames fit a vehicle profile: lengths, periods, counters and checksums, values, and whether
//! a driver behaves as they show.
//!
//! [`ProfileEvidence`](evidence::ProfileEvidence) takes frames one by one and keeps counts only, so that a
//! recording of any length is judged in one pass and constant memory. From it come
//! [`ProfileFinding`](finding::ProfileFinding)s for a profile that is checked, and a [`Fit`](fit::Fit) for
//! one that is searched.

pub mod evidence;
pub mod finding;
pub mod fingerprint;
pub mod fit;
pub mod gaps;
pub mod message;
pub mod states;
mod unused;
