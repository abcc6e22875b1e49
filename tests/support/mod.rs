//! Shared by the tests of all four programs: peers, processes, interfaces, files in memory.

#![allow(dead_code)] // each program uses its part

pub(crate) mod bag;
pub(crate) mod cases;
pub(crate) mod clock;
pub(crate) mod command_vehicle;
pub(crate) mod diagnostics;
pub(crate) mod docs_section;
pub(crate) mod docs_table;
pub(crate) mod doctor;
pub(crate) mod drive_script;
pub(crate) mod driving_vehicle;
pub(crate) mod files;
pub(crate) mod http;
pub(crate) mod json_process;
pub(crate) mod mcap;
pub(crate) mod peer;
pub(crate) mod ports;
pub(crate) mod prerequisite;
pub(crate) mod process;
pub(crate) mod processor;
pub(crate) mod program;
pub(crate) mod property;
pub(crate) mod random;
pub(crate) mod rows;
pub(crate) mod rtps;
pub(crate) mod service_manager;
pub(crate) mod slcan;
pub(crate) mod sources;
pub(crate) mod status_vehicle;
pub(crate) mod terminal;
pub(crate) mod tmpfs;
pub(crate) mod tmux;
pub(crate) mod two_lanes;
pub(crate) mod vcan;
pub(crate) mod vehicle_facts;
pub(crate) mod virtual_gateway;
pub(crate) mod waiting;
