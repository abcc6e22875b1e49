//! Validation of received signals: integrity of frames, age of values, and meanings.
//!
//! All flows that receive signals share this module. It knows messages and signals but not their purpose:
//! each flow has a [`table::SignalTable`] of the signals it needs, and [`observation::Observations`] of their
//! values.

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
