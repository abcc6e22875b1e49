//! What needs neither a process, a network nor a CAN interface: models, properties, golden files, refusals.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // helpers of tests fail like tests

mod support;

mod pure {
    mod absences;
    mod advisories;
    mod arxml;
    mod bring_up;
    mod case_files;
    mod change_costs;
    mod command_model;
    mod config_refusals;
    mod configuration_keys;
    mod dbc_real_files;
    mod demo_recording;
    mod diagnostics_doc;
    mod discovery;
    mod doctor;
    mod documents;
    mod drive_scenarios;
    mod file_memory;
    mod integrity_real_logs;
    mod j1939;
    mod lamp_reports;
    mod layering;
    mod link_findings;
    mod live_and_replay;
    mod log_formats;
    mod msrv;
    mod no_allocation;
    mod performance_counts;
    mod performance_pictures;
    mod picture_captions;
    mod reader_limits;
    mod reading_memory;
    mod reconfigure;
    mod recording_formats;
    mod recording_variants;
    mod repetition;
    mod report_model;
    mod rustdds_defects;
    mod scenario_refusals;
    mod snapshot;
    mod spec_citations;
    mod start;
    mod terminal_view;
    mod text_rules;
    mod topics;
    mod traffic_light_cases;
    mod turn_signal_cases;
    mod type_hashes;
    mod validation_model;
    mod vehicle_status;
    mod vehicles;
    mod waiting_rules;
}

#[path = "support/counting_allocator.rs"]
mod counting_allocator;
#[path = "hostile_files/mod.rs"]
mod hostile_files;
