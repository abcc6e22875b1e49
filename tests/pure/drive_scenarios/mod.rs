//! The shipped maps and drive scenarios: each map is what its generator makes and has what its
//! description names, each scenario keeps its expectations, improved and as upstream.

mod coverage;
mod drives;
mod levels;
mod maps;
mod pull_outs;
pub(crate) mod random_drives;
