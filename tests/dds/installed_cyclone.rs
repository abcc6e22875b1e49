//! The Cyclone DDS of the system as a peer, which on Debian 12 is 0.10.2: older and stricter than the pinned
//! one.
//!
//! The reader is compiled here with `cc` and `idlc` against Debian's `cyclonedds-dev`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::session::Role;
use crate::support::json_process::JsonProcess;
use crate::support::peer::{PATIENT, domain};
use crate::support::prerequisite::{Missing, Prerequisite, require};
use crate::support::waiting::DEADLINE;

/// Compiles `tests/peer/cyclone_reader.c`; gives the program.
fn compiled() -> Result<PathBuf, Missing> {
    let has_idlc = Command::new("idlc").arg("-v").output().is_ok();
    if !has_idlc || !Path::new("/usr/include/dds/dds.h").exists() {
        let why = "no idlc, or no headers (cyclonedds-tools, cyclonedds-dev)";
        return Err(Prerequisite::CycloneDds.missing(why));
    }
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peer");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cyclone_reader");
    fs::create_dir_all(&folder).unwrap();
    let run = |command: &mut Command| {
        let output = command.current_dir(&folder).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    run(Command::new("idlc").args(["-x", "final"]).arg(sources.join("diagnostics.idl")));
    let mut compiler = Command::new("cc");
    compiler.args(["-std=c11", "-D_POSIX_C_SOURCE=200809L", "-Wall", "-Wextra", "-Werror", "-I."]);
    compiler.arg(sources.join("cyclone_reader.c"));
    run(compiler.args(["diagnostics.c", "-o", "cyclone_reader", "-lddsc"]));
    Ok(folder.join("cyclone_reader"))
}

/// A last fragment whose length is not a multiple of four is malformed to Cyclone DDS 0.10.2. On every
/// network: the loopback carries 65 kB in one piece, an Ethernet interface 1,500 bytes.
#[test]
fn samples_of_every_length_reach_the_cyclone_of_the_system() {
    let program = require!(compiled());
    let domain = domain();
    let gateway = Role::new(domain).start();
    let mut command = Command::new(program);
    command.arg(domain.to_string()).env("CYCLONEDDS_URI", PATIENT);
    let reader = JsonProcess::start("the reader", &mut command);
    reader.next("its start", |line| line["event"] == "ready");
    reader.next("a match", |line| line["event"] == "matched");
    gateway.wait_until("the reader", |status| status["readers"][2] == 1);
    let lengths = [1_000, 1_024, 1_200, 1_450, 1_700, 2_458, 10_000, 60_000, 65_536, 100_000];
    for length in lengths.iter().flat_map(|length| *length..length + 4) {
        // Again, if a busy machine has the gateway's participant or its process replaced meanwhile.
        let arrived = (0..6).find_map(|_| {
            gateway.send(&format!("value {}", "x".repeat(length)));
            reader.next_within(DEADLINE / 6, |line| line["event"] == "sample" && line["length"] == length)
        });
        let sample = arrived.unwrap_or_else(|| panic!("a message of {length} bytes never arrived"));
        assert_eq!(sample["key"], "bus");
    }
}
