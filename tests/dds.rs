//! The gateway on ROS 2, against peers of other makes.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // helpers of tests fail like tests

mod support;

mod dds {
    mod autoware;
    mod cyclone;
    mod daemon_on_ros;
    mod delivery;
    mod demo;
    mod fast_dds;
    mod forged;
    mod hostile;
    mod incoming;
    mod installed_cyclone;
    mod isolation;
    mod network;
    mod outage;
    mod parameters;
    mod rosout;
    mod session;
    mod slow;
    mod streams;
    mod two_hosts;
}
