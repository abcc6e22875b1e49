//! Search for the counter and checksum of a message of which only frames are known.
//!
//! A rule is found only if it holds for every frame and the frames differ enough to exclude chance. A
//! message-specific constant, such as a Data ID of AUTOSAR E2E, becomes the start value, the final exclusive
//! or, or the constants of the rule.

mod checksum;
mod counter;

pub use checksum::{FoundChecksum, RuleParameter, find_checksum};
pub use counter::{FoundCounter, find_counter};

#[cfg(test)]
mod tests;
