//! Everything that runs on virtual time apart from the gateway.

pub mod drive;
pub mod lights;
pub mod proven_draft;
pub mod recorded_session;
pub(crate) mod rehearsal;
pub mod vehicle;
