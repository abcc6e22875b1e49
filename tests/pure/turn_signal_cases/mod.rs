//! The turn signal decider, case by case, in both behaviours where they differ
//! (docs/spec/turn-signal-decider.md, "Labels of test cases").

#![allow(clippy::float_cmp)] // whole and quarter metres are exact, and boundaries are the point
#![allow(clippy::items_after_statements, clippy::too_many_lines)] // tables with their short names
#![allow(clippy::many_single_char_names, clippy::manual_midpoint)] // formulas as they are printed
#![allow(clippy::struct_excessive_bools)] // a case is made of yes and no

mod bad_inputs;
pub(super) mod bench;
mod combination;
mod conflicts;
mod drive;
mod gateway;
mod laws;
mod line;
mod manoeuvres;
mod mirror;
mod path_generator;
mod required_end;
mod roundabouts;
mod settings;
mod shifts;
mod steadiness;
mod three_records;
mod turns;
mod whole;
