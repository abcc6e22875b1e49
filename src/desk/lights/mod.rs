//! A scenario of traffic lights on virtual time, written down: as text, as JSON and as a picture.
//!
//! | file | what it is |
//! |---|---|
//! | [`run`] | the engine from one deadline to the next, with what it shows at each |
//! | [`span`] | how long to look at it |
//! | [`display`] | lights, groups, actions and happenings in short words |
//! | [`text`] | lines for people |
//! | [`json`] | lines for programs |
//! | [`chart`] | bars for a picture |

pub mod chart;
pub mod display;
pub mod json;
pub mod run;
pub mod span;
pub mod text;
