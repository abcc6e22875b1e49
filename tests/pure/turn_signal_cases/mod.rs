//! The turn signal decider, case by case, improved and as upstream where they differ
//! (docs/spec/turn-signal-decider.md, "Labels of test cases").

#![allow(clippy::float_cmp)] // whole and quarter metres are exact, and boundaries are the point
#![allow(clippy::items_after_statements, clippy::too_many_lines)] // tables with their short names
#![allow(clippy::many_single_char_names, clippy::manual_midpoint)] // formulas as they are printed
#![allow(clippy::struct_excessive_bools)] // independent switches of a case

mod bad_inputs;
pub(super) mod bench;
mod combination;
mod conflicts;
mod countries;
mod decider;
mod drive;
mod first_aligned;
mod gateway;
mod improved;
mod junctions;
mod laws;
mod learned_planners;
mod line;
mod loops;
mod manoeuvres;
mod mirror;
mod path_generator;
mod public_maps;
mod reference;
mod required_end;
mod roundabouts;
mod settings;
mod shifts;
mod three_records;
mod turns;
pub(super) mod vehicle;
