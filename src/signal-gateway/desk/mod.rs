//! Everything that runs on virtual time apart from the gateway.
//!
//! | module | what it is |
//! |---|---|
//! | [`lights`] | a scenario of traffic lights, from one deadline to the next |
//! | [`drive`] | a drive of the turn signal decider, cycle by cycle |
//! | [`recorded_session`] | a discovery on a recording |
//! | [`proven_draft`] | the files of a discovered vehicle, proven on its session |
//! | [`rehearsal`] | the gateway with a drive and a simulated vehicle around it |
//! | [`vehicle`] | a simulated vehicle and its script |

pub mod drive;
pub mod lights;
pub mod proven_draft;
pub mod recorded_session;
pub mod rehearsal;
pub mod vehicle;
