//! The gateway on a real CAN interface; run under `tests/with-vcan`.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // helpers of tests fail like tests

mod support;

mod vcan {
    mod vcan_bus;
    mod vcan_closed_loop;
    #[cfg(feature = "ros")]
    mod vcan_commands;
    mod vcan_controller;
    mod vcan_discover;
    mod vcan_doctor;
    #[cfg(feature = "ros")]
    mod vcan_faults;
    #[cfg(feature = "ros")]
    mod vcan_gateway;
    mod vcan_identify;
    mod vcan_shipped;
    mod vcan_views;
}
