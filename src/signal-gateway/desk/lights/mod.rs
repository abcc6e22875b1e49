//! A scenario of traffic lights on virtual time.
//!
//! | file | what it is |
//! |---|---|
//! | [`run`] | the engine from one deadline to the next |
//! | [`span`] | the length of a run |

pub mod run;
pub mod span;
