//! What runs on virtual time without a recording.
//!
//! | module | what it is |
//! |---|---|
//! | [`lights`] | a scenario of traffic lights, from one deadline to the next |
//! | [`drive`] | a drive of the turn signal decider, cycle by cycle |
//! | [`vehicle`] | a simulated vehicle and its script |

pub mod drive;
pub mod lights;
pub mod vehicle;
