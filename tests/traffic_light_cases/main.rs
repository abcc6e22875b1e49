//! The cases of the traffic-lights specification, section 7, by their numbers, and their neighbours.

#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests fail like tests

mod names;
