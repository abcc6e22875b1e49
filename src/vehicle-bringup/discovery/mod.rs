//! Discovery of the signals of turn indicators and hazard lights in a vehicle that no DBC describes.
//!
//! A driver operates the indicators as a [`machine::Discovery`] requests, or marks in a recording state when.
//! Bits that change by themselves (counters, checksums, sensors, periodic lamps) are left out; the others are
//! ranked by how well they follow the requests.
//!
//! | file | contents |
//! |---|---|
//! | [`machine`] | a whole discovery as a state machine |
//! | [`session`] | its requests to the driver |
//! | [`capture`] | the frames, by message |
//! | [`timeline`] | the requests over time |
//! | `bits`, `response` | bits that rest without a request; their responses to each |
//! | `pages` | bits of multiplexed messages, which are left out |
//! | `search`, [`candidate`] | signals made of them, ranked |
//! | `two_messages` | signals of the two sides in different messages |
//! | `suspects` | bits that may be parts of a checksum or a number |
//! | `widening` | bits beside a signal that belong to it |
//! | [`protection`] | counter and checksum of a message |
//! | [`findings`] | the result, and what is not sure |
//! | [`proof`] | what a written profile reports over the session, compared with the requests |

mod bits;
pub mod candidate;
pub mod capture;
pub mod findings;
pub mod machine;
mod pages;
pub mod proof;
pub mod protection;
mod response;
mod search;
pub mod session;
mod suspects;
pub mod timeline;
mod two_messages;
mod widening;

pub use response::{Followed, ResponseShape};
