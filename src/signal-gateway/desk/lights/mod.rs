//! A scenario of traffic lights on virtual time.

pub mod run;
pub mod span;
