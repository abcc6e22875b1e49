//! The shipped maps and drive scenarios: each map is what its generator makes and says what its
//! description says, each scenario keeps its expectations in both behaviours.

mod coverage;
mod drives;
mod maps;
