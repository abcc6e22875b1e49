//! The tests of layering find what they are to find.

use super::*;

fn found(path: &str, text: &str) -> Vec<String> {
    Source::parse(Path::new(path), text).breaches().collect()
}

fn assert_found(path: &str, texts: &[&str]) {
    for text in texts {
        assert_eq!(found(path, text).len(), 1, "{path}: {text}: {:?}", found(path, text));
    }
}

fn assert_clean(path: &str, texts: &[&str]) {
    for text in texts {
        assert_eq!(found(path, text), Vec::<String>::new(), "{path}: {text}");
    }
}

#[test]
fn finds_an_import_that_runs_uphill() {
    assert_found(
        "src/signal-gateway/io/can/mod.rs",
        &[
            "use crate::config::file;",
            "use crate::{io::can::link, config::settings};",
            "use super::super::report;",
            "use super::super::*;",
            "use crate as everything;",
            "fn f() { crate::daemon::run() }",
            "fn f() { assert!(true, crate::daemon::NAME) }",
            "mod inner { use super::super::super::config; }",
            "pub(crate) use crate::report::text;",
            "use crate::Shortcut;",
            "use signal_gateway::cli;",
        ],
    );
    assert_found("src/signal-gateway/config/file.rs", &["use crate::report::text;", "use crate::cli::Args;"]);
    assert_found("src/signal-gateway/daemon.rs", &["use crate::cli::Args;", "use crate::check::run;"]);
}

#[test]
fn lets_imports_run_downhill() {
    assert_clean("src/signal-gateway/main.rs", &["use signal_gateway::cli;"]);
    assert_clean("src/signal-gateway/cli.rs", &["use crate::{daemon, replay, report, config::file, io};"]);
    assert_clean("src/signal-gateway/daemon.rs", &["use crate::{config::settings, io::ros};"]);
    assert_clean(
        "src/signal-gateway/io/can/mod.rs",
        &["use can_signal::can::frame::Frame; use std::{fs, net}; use tokio::net;"],
    );
    assert_clean(
        "src/can-signal/can/bus.rs",
        &["use super::{*, frame::CanId as io}; pub(crate) struct Bus(pub(super) u8);"],
    );
}

#[test]
fn finds_a_room_that_is_on_no_floor() {
    for shed in ["src/signal-gateway/shed.rs", "src/gateway-core/shed.rs"] {
        assert!(!found(shed, "use crate::gateway::Gateway;").is_empty());
    }
}

#[test]
fn finds_what_is_not_pure_in_what_computes() {
    assert_found(
        "src/can-signal/dbc/codec.rs",
        &[
            "use std::fs;",
            "use std::{cmp, io::Read, fmt};",
            "use std as s;",
            "use std::*;",
            "fn f() { std::thread::yield_now() }",
            "fn f() { println!() }",
            "fn f() { let _ = ::std::process::id(); }",
            "use std::time::{Duration, Instant};",
            "use std::collections::{BTreeMap, HashMap as Map};",
            "use std::sync::Mutex;",
            "#[cfg(not(test))] use std::fs;",
            "#[cfg(test)] mod tests { use std::fs; } use std::env;",
        ],
    );
    let pure =
        ["can_signal", "gateway_base", "gateway_core", "lanelet2_map", "traffic_lights", "turn_signal"];
    assert!(pure.iter().all(|package| PURE.contains(*package)) && !PURE.contains("signal_gateway"));
}

#[test]
fn reads_code_and_neither_comments_nor_strings_nor_tests() {
    assert_clean(
        "src/can-signal/dbc/codec.rs",
        &[
            "//! std::fs, tokio::net\n/* crate::io */ const A: &str = \"std::env\"; const B: &str = r#\"crate::io\"#;",
            "use std::{collections::BTreeMap, fmt, sync::Arc, time::Duration}; use can_dbc::Dbc;",
            "#[derive(Debug, thiserror::Error)] enum E {}",
            "#[cfg(test)] mod tests { use std::fs; use crate::io; }",
            "#[cfg(test)] use std::fs; #[cfg(test)] fn f() { std::process::abort() }",
            "fn f(s: &S) { s.fs.read(s.io::<u8>()); let env = s.net; }",
        ],
    );
}

#[test]
fn finds_flows_that_meet() {
    assert_found(
        "src/gateway-core/command/origin.rs",
        &[
            "use crate::vehicle_lights::report;",
            "use super::super::vehicle_status;",
            "use super::super::*;",
            "use crate::gateway::Gateway;",
        ],
    );
    assert_found("src/gateway-core/command/mod.rs", &["use super::vehicle_lights::report;"]);
    assert_found(
        "src/can-signal/can/bus.rs",
        &["use crate::dbc::codec;", "use super::super::validation;", "use super::super::*;"],
    );
    assert_clean(
        "src/can-signal/validation/words.rs",
        &["use super::meaning::Meaning; use crate::can::bus::Bus;"],
    );
    assert_clean("src/gateway-core/gateway/mod.rs", &["use super::{command, vehicle_lights};"]);
}

#[test]
fn finds_comments_that_are_too_wide() {
    let text =
        format!("//! {}\n/// {}\nconst A: &str = \"{}\";", "a".repeat(106), "é".repeat(107), "b".repeat(200));
    assert_eq!(Source::parse(Path::new("src/a/b.rs"), &text).wide_comments, [2]);
}

#[test]
fn knows_which_files_are_tests() {
    let source =
        Source::parse(Path::new("src/can-signal/dbc/mod.rs"), "#[cfg(test)]\nmod golden;\nmod codec;");
    assert_eq!(source.test_modules, [["can_signal", "dbc", "golden"]]);
    assert_eq!(source.declared, ["golden", "codec"]);
}
