//! Validation of received signals: the integrity of a frame, the age of its values, their meanings.
//!
//! All flows that receive signals share it. It knows messages and signals but not their purpose: each flow
//! has a [`table::SignalTable`] of the signals it needs and [`observation::Observations`] of those received.

pub mod catalogue;
pub mod display;
pub mod integrity;
pub mod meaning;
pub mod observation;
pub mod requirement;
pub mod senders;
pub mod snapshot;
pub mod table;
pub mod unusable;
