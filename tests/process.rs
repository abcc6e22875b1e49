//! The built binary as a process: its commands, its texts, its exit codes.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // helpers of tests fail like tests

mod support;

mod process {
    mod check_fix;
    mod check_gate;
    mod ci_recipe;
    mod cli;
    mod daemon_process;
    mod decide_command;
    mod descriptors;
    mod discover_command;
    mod doctor_command;
    mod history;
    mod init_command;
    mod lights_command;
    mod live_page;
    mod log_output;
    mod manual;
    mod mcap;
    mod metrics_endpoint;
    mod mistakes;
    mod on_terminal;
    mod pictures;
    mod recorded_drives;
    mod recordings;
    mod refusals;
    mod reload;
    mod status_command;
    mod status_sockets;
    mod systemd_units;
    mod tables;
    mod terminal_view;
    mod vehicle_status;
}
