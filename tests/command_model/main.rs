//! Commands to the vehicle: against a model of the arbitration over random days, by the cases of the
//! specification, and byte by byte on the wire.

#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests fail like tests

mod bench;
mod buttons;
mod cases;
mod closed_loop;
mod days;
mod gateway;
mod live;
mod model;
mod wire;
