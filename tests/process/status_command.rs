//! `status` and its socket: what is shown is true, nobody can be shut out for long or hold the gateway up,
//! and two gateways do not take each other's socket.

use std::fmt::Display;
use std::fs::File;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::os::unix::fs::PermissionsExt as _;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::PathBuf;
use std::process::{Command, Output};

use serde_json::Value;

use crate::support::json_process::JsonProcess;
use crate::support::process::{Folder, Process};
use crate::support::service_manager::ServiceManager;
use crate::support::waiting::{described, wait_for, wait_until};

/// A gateway on a recording of one frame in 20 ms of each message of the demo vehicle, repeated; with a
/// status socket.
struct Gateway {
    process: Process,
    folder: Folder,
}

/// Turn state 1 is left; 5 is not defined.
fn folder(turn_state: u8) -> Folder {
    let lines = (0..100).map(|frame| {
        let ms = frame * 20;
        let stamp = format!("({}.{:03}000)", 1_700_000_000 + ms / 1000, ms % 1000);
        format!("{stamp} can0 2A5#0000{:02X}0000000000\n{stamp} can0 2C1#0000000000000000\n", turn_state << 1)
    });
    let keys = "source = \"recording\"\n[recording]\nfile = \"steady.log\"\nrepeat = true\n[ros]\nenabled = false\n\
                [status]\nsocket = \"status.sock\"\n";
    let folder = Folder::with_demo_vehicle("can0", keys);
    folder.write("steady.log", &lines.collect::<String>());
    folder
}

impl Gateway {
    fn run(folder: Folder) -> Self {
        let process = Process::run(&folder);
        let gateway = Self { process, folder };
        gateway.wait_for(|status| status["turn_indicators"]["signals"].is_array());
        gateway
    }

    fn socket(&self) -> PathBuf {
        self.folder.path().join("status.sock")
    }

    /// The output of `status`, once the gateway answers in the time that the command gives it.
    fn status(&self, arguments: &[&str]) -> Output {
        wait_for(self.lacks("answer"), || {
            Some(status(&self.socket(), arguments)).filter(|output| code(output) != UNREACHABLE)
        })
    }

    /// Waits for a status for which `is_it` holds.
    fn wait_for(&self, is_it: impl Fn(&Value) -> bool) -> Value {
        wait_for(self.lacks("status"), || {
            let output = self.status(&["--json"]);
            serde_json::from_slice(&output.stdout).ok().filter(|status| is_it(status))
        })
    }

    fn lacks(&self, what: &str) -> impl Display {
        described(move || format!("{what}: {:?}", self.process.log()))
    }
}

/// The exit code of `status` without a gateway that answers.
const UNREACHABLE: i32 = 8;

fn status(socket: &std::path::Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
    command.arg("status").arg("--socket").arg(socket).args(arguments).output().unwrap()
}

/// The words of a text, without its columns.
fn plain(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn code(output: &Output) -> i32 {
    output.status.code().unwrap()
}

#[test]
fn status_shows_what_is_published_and_its_exit_code_the_level() {
    let mut gateway = Gateway::run(folder(1));
    let shown = gateway.wait_for(|status| status["level"] == "OK");
    assert_eq!(shown["turn_indicators"]["published"], "ENABLE_LEFT");
    assert_eq!(shown["turn_indicators"]["withheld"], Value::Null);
    assert_eq!(shown["hazard_lights"]["published"], "DISABLE");
    assert_eq!(shown["signals"][0]["raw"], 1);
    assert_eq!(shown["process"]["build"]["version"], env!("CARGO_PKG_VERSION"));
    assert!(shown["buses"][0]["frames"].as_u64().unwrap() > 0);
    let text = gateway.status(&[]);
    let lines = String::from_utf8(text.stdout.clone()).unwrap();
    assert!(lines.starts_with("OK    signal_gateway: "), "{lines}");
    assert!(plain(&lines).contains("turn_indicators left, "), "{lines}");
    assert_eq!((code(&text), code(&gateway.status(&["--quiet"]))), (0, 0));
    assert_eq!(gateway.status(&["--quiet"]).stdout, b"");
    gateway.process.stop("TERM");
    let output = status(&gateway.socket(), &[]);
    assert_eq!((code(&output), output.stdout.len()), (UNREACHABLE, 0));
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(error.contains("status.sock") && error.contains("start the service"), "{error}");
    assert!(!gateway.socket().exists(), "the socket goes with the gateway");
}

#[test]
fn undefined_value_is_withheld_with_its_reason_and_is_an_error() {
    let gateway = Gateway::run(folder(5));
    let shown = gateway.wait_for(|status| status["turn_indicators"]["failure"] == "invalid");
    assert_eq!(shown["turn_indicators"]["published"], Value::Null);
    let reason = shown["turn_indicators"]["withheld"].as_str().unwrap();
    assert!(reason.contains("= 5 is not a defined value"), "{reason}");
    let signal = &shown["signals"][0];
    assert_eq!((&signal["raw"], &signal["is_defined"]), (&5.into(), &false.into()));
    let text = gateway.status(&[]);
    assert_eq!(code(&text), 7);
    let shown = plain(&String::from_utf8(text.stdout).unwrap());
    assert!(shown.contains("turn_indicators withheld, for ") && shown.contains(": invalid: "), "{shown}");
}

#[test]
fn watching_gives_a_line_of_json_twice_a_second_and_goes_on_after_a_restart() {
    let mut gateway = Gateway::run(folder(0));
    let errors = gateway.folder.path().join("errors");
    let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
    command.args(["status", "--watch", "--json", "--socket"]).arg(gateway.socket());
    let watching = JsonProcess::start("watching", command.stderr(File::create(&errors).unwrap()));
    let next_of = |process: &Process| {
        let line = watching.next("a line", |line| line["process"]["pid"] == process.id());
        line["process"]["uptime_ms"].as_u64().unwrap()
    };
    let [first, second] = [next_of(&gateway.process), next_of(&gateway.process)];
    assert!(first < second, "{first} {second}");
    // As many lines as the other client gets.
    wait_until("three lines of one connection", || {
        let served = BufReader::new(UnixStream::connect(gateway.socket()).unwrap());
        served.lines().take(3).map_while(Result::ok).count() == 3
    });
    gateway.process.stop("TERM");
    let lost = "status.sock: the connection was closed; waiting for it";
    wait_until(lost, || std::fs::read_to_string(&errors).unwrap().contains(lost));
    let restarted = Process::run(&gateway.folder);
    for _ in 0..2 {
        next_of(&restarted);
    }
    watching.kill();
}

#[test]
fn socket_is_for_owner_and_group_and_replaces_a_stale_one() {
    let folder = folder(0);
    drop(UnixListener::bind(folder.path().join("status.sock")).unwrap());
    let gateway = Gateway::run(folder);
    let mode = std::fs::metadata(gateway.socket()).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o660);
}

#[test]
fn second_gateway_leaves_the_socket_of_the_first_and_runs_on() {
    let mut first = Gateway::run(folder(0));
    let mut second = Process::run(&first.folder);
    second.wait_for_log("no status socket: ");
    second.wait_for_log("turn_indicators");
    let is_of_first = |status: &Value| status["process"]["pid"] == first.process.id();
    assert!(is_of_first(&first.wait_for(|_| true)));
    second.stop("TERM");
    assert!(is_of_first(&first.wait_for(|_| true)));
    first.process.stop("TERM");
    assert!(!first.socket().exists());
}

#[test]
fn file_with_the_name_of_the_socket_is_left() {
    let folder = folder(0);
    folder.write("status.sock", "precious");
    let mut gateway = Process::run(&folder);
    gateway.wait_for_log("exists and is not a socket");
    gateway.wait_for_log("turn_indicators");
    gateway.stop("TERM");
    assert_eq!(std::fs::read(folder.path().join("status.sock")).unwrap(), b"precious");
}

#[test]
fn clients_that_do_not_read_send_garbage_or_come_by_the_thousand_hold_nobody_up() {
    let folder = folder(0);
    let manager = ServiceManager::in_folder(folder.path());
    let process = Process::run_with(&folder, |command| manager.watch(command, 400_000));
    let mut gateway = Gateway { process, folder };
    gateway.wait_for(|status| status["level"] == "OK");
    let mut clients = Vec::new();
    let mut refused = 0;
    for number in 0..1000 {
        let Ok(mut client) = UnixStream::connect(gateway.socket()) else { continue };
        client.set_nonblocking(true).unwrap();
        // Whatever is sent is not read, until the kernel takes no more.
        let _ = client.write(&vec![b'x'; 1024]);
        if number % 100 == 99 {
            let mut answer = [0; 64];
            refused +=
                u32::from(client.read(&mut answer).is_ok_and(|len| answer[..len].starts_with(b"{\"error\"")));
        }
        clients.push(client);
    }
    assert!(clients.len() >= 64 && refused < 1000);
    // The gateway lives: the watchdog is fed all the while, and the state changes as before.
    manager.drain();
    for _ in 0..5 {
        manager.wait_for("WATCHDOG=1");
    }
    drop(clients);
    gateway.wait_for(|status| status["level"] == "OK");
    gateway.process.stop("TERM");
}
