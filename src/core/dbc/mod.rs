//! DBC text to a database, and compiled decoding.
pub mod codec;
