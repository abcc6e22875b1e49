//! What judges received signals, for every flow that receives some: whether a frame may be believed,
//! how long its values hold, and what they mean.
//!
//! A room that flows share and no flow itself: it knows messages and signals, and nothing of what
//! they are for. Each flow has a [`table::SignalTable`] of what it takes and
//! [`observation::Observations`] of what came.

pub mod display;
pub mod integrity;
pub mod meaning;
pub mod observation;
pub mod table;
