//! A network process that somebody has taken over: this test program, started by a session as its network
//! process, and confined as any. It tries each of [`ATTACKS`] and prints the outcome; without confinement,
//! nearly all succeed.

mod attacks;

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use ros_transport::link::LostLines;
use ros_transport::process;
use serde_json::{Value, json};
#[cfg(feature = "zenoh")]
use signal_gateway::io::ros::session::ZenohSettings;
use signal_gateway::io::ros::session::{Isolation, RosSession, RosSettings, Transport, supervisor};
use signal_gateway::process_status::confinement::Confinement;

use crate::support::peer::domain;
use crate::support::waiting::wait_for;
use attacks::{ATTACKS, Attacker};

/// The environment variable that makes [`taken_over`] attack: `confined` or `free`.
const ROLE: &str = "SIGNAL_GATEWAY_TEST_HOSTILE";
/// What refuses: the filter, Landlock or the rights of files, calls that do not exist, the limit of memory,
/// the service manager.
const REFUSALS: [i32; 5] = [libc::EPERM, libc::EACCES, libc::ENOSYS, libc::ENOMEM, libc::EAFNOSUPPORT];
/// The lists of this test in the documents.
const REFUSED: &str = "Refused with DDS and with Zenoh";
const ZENOH_MAY: &str = "Refused with DDS, needed by Zenoh";
const BOTH_MAY: &str = "Not refused";
/// Where the lists are.
const TABLE: [&str; 2] = ["<!-- attacks -->", "<!-- end of attacks -->"];

/// The error number of each attack; `None` if it succeeded.
type Outcomes = BTreeMap<String, Option<i32>>;

/// The process itself, which needs a role.
#[test]
#[ignore = "started by the tests below"]
fn taken_over() {
    let attacker = Attacker::new();
    let attack = || {
        for (what, attempt) in ATTACKS {
            let error = attempt(&attacker).err().map(|error| error.raw_os_error());
            eprintln!("{}", json!({"what": what, "error": error}));
        }
    };
    match std::env::var(ROLE).as_deref() {
        Ok("confined") => {
            // The socket of the report is not for what libtest prints.
            rustix::stdio::dup2_stdout(fs::File::from(process_report())).unwrap();
            let memory = std::env::var("MEMORY_MB").unwrap().parse().unwrap();
            // Afterwards it serves the session like any.
            let _ = process::run(memory, LostLines::default, || {
                attack();
                eprintln!("{}", json!({"end": true}));
            });
        }
        Ok("free") => {
            attack();
            attacker.end();
            eprintln!("{}", json!({"end": true}));
        }
        _ => panic!("no role"),
    }
}

/// The socket of the report, which the script below has put aside.
#[allow(unsafe_code)]
fn process_report() -> std::os::fd::OwnedFd {
    // SAFETY: it is open, and nobody else uses it.
    unsafe { std::os::fd::FromRawFd::from_raw_fd(3) }
}

/// A program that is this test as a network process, in this role; its output goes to the file.
fn program(folder: &Path, role: &str) -> (PathBuf, PathBuf) {
    let (script, output) = (folder.join(role), folder.join("output"));
    let test = std::env::current_exe().unwrap();
    let text = format!(
        "#!/bin/sh\nexec 3>&1 >/dev/null 2>>'{}'\nexport MEMORY_MB=$3 TMPDIR='{}' {ROLE}={role}\n\
         {}'{}' --exact dds::hostile::taken_over --ignored --nocapture\n",
        output.display(),
        folder.display(),
        // A network process replaces the script; otherwise the script is the parent that is attacked.
        if role == "confined" { "exec " } else { "" },
        test.display(),
    );
    fs::write(&script, text).unwrap();
    fs::set_permissions(&script, fs::Permissions::from_mode(0o755)).unwrap();
    (script, output)
}

/// What came of the attacks, once they are over.
fn outcomes(output: &Path) -> Outcomes {
    wait_for(format!("the end of attacks in {}", output.display()), || {
        let text = fs::read_to_string(output).unwrap_or_default();
        let lines: Vec<Value> = text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
        let end = lines.iter().position(|line| line["end"] == true)?;
        let outcome = |line: &Value| {
            let error = line["error"].as_i64().map(|error| i32::try_from(error).unwrap());
            (line["what"].as_str().unwrap().to_owned(), error)
        };
        Some(lines[..end].iter().map(outcome).collect())
    })
}

fn is_refused(outcome: Option<i32>) -> bool {
    outcome.is_some_and(|error| REFUSALS.contains(&error))
}

/// Attacks of a network process of this transport, by a session of this process.
fn confined(transport: Transport) -> (Outcomes, Confinement) {
    let folder = tempfile::tempdir().unwrap();
    let (program, output) = program(folder.path(), "confined");
    let isolation = Isolation::Process { program, memory_limit_mb: 384, supervisor: None };
    let settings = RosSettings { domain_id: domain(), transport, isolation, ..RosSettings::default() };
    let session = RosSession::start(settings).unwrap();
    let outcomes = outcomes(&output);
    let confinement = wait_for("the session's word of what was refused", || {
        session.status().network.confinement.filter(|confinement| !confinement.refused.is_empty())
    });
    session.stop();
    (outcomes, confinement)
}

/// Attacks of a process that is not confined, which has a shell as its parent.
fn free() -> Outcomes {
    let folder = tempfile::tempdir().unwrap();
    let (program, output) = program(folder.path(), "free");
    let ended = Command::new(program).args(["network", "info", "384"]).stdin(Stdio::null()).status().unwrap();
    assert!(ended.success(), "{}", fs::read_to_string(&output).unwrap_or_default());
    outcomes(&output)
}

/// Those that were not refused.
fn succeeded(outcomes: &Outcomes) -> Vec<(&str, Option<i32>)> {
    let outcomes = outcomes.iter().map(|(what, outcome)| (what.as_str(), *outcome));
    outcomes.filter(|(_, outcome)| !is_refused(*outcome)).collect()
}

#[test]
fn a_taken_over_network_process_is_refused_what_succeeds_without_confinement() {
    let (dds, confinement) = confined(Transport::Dds);
    println!("confinement {}; refused {}", confinement.layers(), confinement.refused_calls());
    assert_eq!(dds.len(), ATTACKS.len());
    assert_eq!(succeeded(&dds), []);
    for name in ["ptrace", "clone", "kill", "fcntl", "prlimit64"] {
        assert!(confinement.refused.contains_key(name), "{name}: {}", confinement.refused_calls());
    }
    let free = free();
    let refused: Vec<_> = free.iter().filter(|(_, outcome)| is_refused(**outcome)).collect();
    println!("refused without confinement as well: {refused:?}");
    // As root, all but what this kernel or container has not.
    if rustix::process::geteuid().is_root() {
        assert!(refused.len() <= 12, "{refused:?}");
    }
}

/// What it needs it has, as long as nobody has taken it over.
#[test]
fn a_network_process_in_order_is_refused_nothing() {
    /// It has looked at interfaces several times by then.
    const AGE: Duration = Duration::from_secs(4);
    let transports = [
        Transport::Dds,
        #[cfg(feature = "zenoh")]
        Transport::Zenoh(ZenohSettings::default()),
    ];
    for transport in transports {
        let program = env!("CARGO_BIN_EXE_signal-gateway").into();
        let isolation = Isolation::Process { program, memory_limit_mb: 384, supervisor: None };
        let settings = RosSettings { domain_id: domain(), transport, isolation, ..RosSettings::default() };
        let session = RosSession::start(settings).unwrap();
        let state = wait_for("a network process of some age", || {
            let state = session.status().network;
            state.age.is_some_and(|age| age >= AGE).then_some(state)
        });
        session.stop();
        let confinement = state.confinement.as_ref().unwrap();
        assert_eq!(
            (state.restarts, confinement.refused_calls().as_str()),
            (0, "none"),
            "{}",
            state.transport()
        );
    }
}

/// What the documents say of DDS, and with Zenoh built in also of Zenoh.
#[test]
fn the_documents_say_what_is_refused() {
    let (dds, _) = confined(Transport::Dds);
    #[cfg(feature = "zenoh")]
    let zenoh = Some(confined(Transport::Zenoh(ZenohSettings::default())).0);
    #[cfg(not(feature = "zenoh"))]
    let zenoh = None::<Outcomes>;
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/security.md");
    let text = fs::read_to_string(&path).unwrap();
    let [begin, end] = TABLE.map(|mark| text.find(mark).unwrap());
    let written = &text[begin + TABLE[0].len()..end];
    let is_listed = |place: &str, what: &str| {
        let line = written.lines().find(|line| line.starts_with(&format!("- **{place}**")));
        line.is_some_and(|line| line.split([':', ';', '.']).any(|listed| listed.trim() == what))
    };
    let place = |what: &str| {
        let of_zenoh =
            zenoh.as_ref().map_or_else(|| !is_listed(ZENOH_MAY, what), |zenoh| is_refused(zenoh[what]));
        if !is_refused(dds[what]) {
            BOTH_MAY
        } else if of_zenoh {
            REFUSED
        } else {
            ZENOH_MAY
        }
    };
    let line = |title: &str| {
        let listed = ATTACKS.iter().map(|(what, _)| *what).filter(|what| place(what) == title);
        let listed: Vec<_> = listed.collect();
        if listed.is_empty() { String::new() } else { format!("- **{title}**: {}.\n", listed.join("; ")) }
    };
    let table = format!("\n\n{}\n", [REFUSED, ZENOH_MAY, BOTH_MAY].map(line).concat());
    if std::env::var_os("UPDATE_DOCS").is_some() {
        let [before, after] = [&text[..begin + TABLE[0].len()], &text[end..]];
        fs::write(&path, format!("{before}{table}{after}")).unwrap();
    } else {
        assert_eq!(written, table, "docs/security.md: UPDATE_DOCS=1 renews the lists");
    }
}

/// As the service of the network process: `tests/systemd/run` starts it in the unit of that, where a gateway
/// connects. What came of the attacks is said once that has left.
#[test]
#[ignore = "started by tests/systemd/run"]
fn under_the_unit_of_the_network_process() {
    let folder = tempfile::tempdir().unwrap();
    let (program, output) = program(folder.path(), "confined");
    let supervised = supervisor::run(&program);
    let outcomes = outcomes(&output);
    println!("{} attacks, not refused: {:?}", outcomes.len(), succeeded(&outcomes));
    supervised.unwrap();
    assert_eq!(succeeded(&outcomes), []);
}

/// As a service of systemd: `tests/systemd/run` starts it in the gateway's unit.
#[test]
#[ignore = "started by tests/systemd/run"]
fn under_the_unit() {
    let (dds, confinement) = confined(Transport::Dds);
    println!("confinement {}; refused {}", confinement.layers(), confinement.refused_calls());
    println!("{} attacks, not refused: {:?}", dds.len(), succeeded(&dds));
    assert_eq!(succeeded(&dds), []);
}
