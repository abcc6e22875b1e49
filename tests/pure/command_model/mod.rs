//! Commands to the vehicle: against a model of the arbitration over random days, by the cases of
//! docs/spec/vehicle-interface.md, and byte by byte on the wire.

mod bench;
mod buttons;
mod cases;
mod clocks;
mod closed_loop;
mod days;
mod gateway;
mod live;
mod model;
mod recorded_run;
mod signalled_mode;
mod wire;
