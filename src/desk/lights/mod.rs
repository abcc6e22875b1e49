//! A scenario of traffic lights on virtual time.
//!
//! | file | what it is |
//! |---|---|
//! | [`run`] | the engine from one deadline to the next |
//! | [`span`] | how long a scenario is run |

pub mod run;
pub mod span;
