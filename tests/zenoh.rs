//! The gateway on ROS 2 over Zenoh, against the Python binding of Zenoh.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // helpers of tests fail like tests

mod support;

#[allow(dead_code)] // the tests of DDS use more of it
#[path = "dds/session/mod.rs"]
mod session;

#[allow(dead_code)]
#[path = "dds/network.rs"]
mod network;

mod zenoh {
    mod bridge;
    mod daemon;
    mod delivery;
    mod fleet;
    mod netem;
    mod outage;
    mod parameters;
    mod peer;
    mod security;
    mod topics;
}
