//! The shipped maps and drive scenarios: each map is what its generator makes and says what its
//! description says, each scenario keeps its expectations in both behaviours.

#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests fail like tests

mod coverage;
mod drives;
mod maps;
