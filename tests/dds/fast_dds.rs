//! Fast DDS, the other middleware of ROS 2, as a peer; and what it alone can show.
//!
//! Its programs are compiled here with `c++` against Debian's `libfastrtps-dev`.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use super::delivery::{Peer, TURN, is_match, is_report};
use super::session::Role;
use crate::support::json_process::JsonProcess;
use crate::support::peer::domain;
use crate::support::prerequisite::{Missing, Prerequisite, require};

/// Readers of Fast DDS.
pub(crate) struct FastDds {
    program: &'static Path,
    /// `loopback`, or `default` for every network and shared memory.
    transport: &'static str,
}

impl FastDds {
    /// Over UDP on the loopback.
    pub(crate) fn compiled() -> Result<Self, Missing> {
        static PROGRAM: OnceLock<Option<PathBuf>> = OnceLock::new();
        Ok(Self { program: program(&PROGRAM, "fastdds_reader")?, transport: "loopback" })
    }

    /// As Fast DDS is by itself.
    pub(crate) fn with_all_transports() -> Result<Self, Missing> {
        Ok(Self { transport: "default", ..Self::compiled()? })
    }
}

/// The client of a service.
pub(crate) fn client() -> Result<&'static Path, Missing> {
    static PROGRAM: OnceLock<Option<PathBuf>> = OnceLock::new();
    program(&PROGRAM, "fastdds_client")
}

fn program(known: &'static OnceLock<Option<PathBuf>>, name: &str) -> Result<&'static Path, Missing> {
    let program = known.get_or_init(|| has_fast_dds().then(|| compile(name))).as_deref();
    let why = "no c++, or no Fast DDS 2 for it (libfastrtps-dev)";
    program.ok_or_else(|| Prerequisite::FastDds.missing(why))
}

impl Peer for FastDds {
    fn reader(&self, domain: u16, kind: &str, topic: &str, durability: &str) -> JsonProcess {
        let mut command = Command::new(self.program);
        command.arg(domain.to_string()).args([kind, topic, durability, self.transport]);
        let process = JsonProcess::start(&format!("{durability} reader of {topic}"), &mut command);
        process.next("its start", |line| line["event"] == "ready");
        process
    }

    fn understands_goodbyes(&self) -> bool {
        false
    }
}

/// True if there is a compiler that finds the headers.
fn has_fast_dds() -> bool {
    let mut compiler = Command::new("c++");
    compiler.args(["-E", "-x", "c++", "-"]).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null());
    let Ok(mut compiler) = compiler.spawn() else { return false };
    let source = b"#include <fastrtps/fastrtps_all.h>\n#include <fastcdr/Cdr.h>\n";
    compiler.stdin.take().unwrap().write_all(source).unwrap();
    compiler.wait().unwrap().success()
}

/// Compiles a program of `tests/peer` unless that was done since it changed.
fn compile(name: &str) -> PathBuf {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/peer/{name}.cpp"));
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let changed = |path| fs::metadata(path).and_then(|metadata| metadata.modified());
    if changed(&program).is_ok_and(|compiled| compiled > changed(&source).unwrap()) {
        return program;
    }
    // Not over the old file: another run may be executing it.
    let fresh = program.with_extension(std::process::id().to_string());
    let mut compiler = Command::new("c++");
    compiler.args(["-std=c++17", "-Wall", "-Wextra", "-Werror", "-o"]).arg(&fresh).arg(source);
    let output = compiler.args(["-lfastrtps", "-lfastcdr"]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    fs::rename(fresh, &program).unwrap();
    program
}

#[test]
fn volatile_reports_reach_volatile_readers_and_are_refused_to_transient_local_ones() {
    let peer = require!(FastDds::compiled());
    let domain = domain();
    let gateway = Role::new(domain).volatile().start();
    let suited = peer.reader(domain, "turn", TURN, "volatile");
    let demanding = peer.reader(domain, "turn", TURN, "transient_local");
    suited.next("a match", is_match);
    demanding.next("a refusal", |line| line["event"] == "incompatible");
    gateway.wait_until("a reader", |status| status["readers"][0] == 1);
    gateway.send("turn left 1");
    suited.next("a report", is_report(2, 1));
}

/// Shared memory is offered by such a reader, and not understood by the gateway.
#[test]
fn a_reader_with_the_default_transports_is_served_too() {
    let peer = require!(FastDds::with_all_transports());
    let domain = domain();
    let gateway = Role::new(domain).start();
    gateway.send("turn left 1");
    let late = peer.reader(domain, "turn", TURN, "transient_local");
    late.next("the current report", is_report(2, 1));
    gateway.send("turn right 2");
    late.next("the next report", is_report(3, 2));
}
