//! The session against an independent DDS: Cyclone's Python binding.
//!
//! `SIGNAL_GATEWAY_PEER_PYTHON` names a Python that has `cyclonedds==11.0.1`; without it the tests
//! say that they are skipped. Tests with network namespaces also need root.

#![cfg(feature = "ros")]
#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests fail like tests

mod autoware;
mod autoware_topics;
mod bench;
mod cyclone;
mod delivery;
mod incoming;
mod lights;
mod outage;
mod session;
mod streams;
