//! Search for the counter and checksum of a message of which only frames are known.
//!
//! A rule is found only when it holds for every frame, and the frames differ so much that chance is excluded. A
//! constant part that depends on the message, such as a data ID of AUTOSAR E2E, is solved for and becomes the start
//! value, the final exclusive or, or the constants of the rule.

mod checksum;
mod counter;

pub use checksum::{FoundChecksum, Parameter, find_checksum};
pub use counter::{FoundCounter, find_counter};

#[cfg(test)]
mod tests;
