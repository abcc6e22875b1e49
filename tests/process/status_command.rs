//! `status` and its socket: what is shown is true, nobody can be shut out for long or hold the gateway up, and two gateways
//! do not take each other's socket.

use std::io::{BufRead as _, BufReader, ErrorKind, Read as _, Write as _};
use std::os::unix::fs::PermissionsExt as _;
use std::os::unix::net::{UnixDatagram, UnixListener, UnixStream};
use std::path::PathBuf;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::support::process::{DEADLINE, Folder, Process};

/// A gateway on a recording of one frame in 20 ms of each message of the demo vehicle, repeated; with a status socket.
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

    fn status(&self, arguments: &[&str]) -> Output {
        status(&self.socket(), arguments)
    }

    fn json(&self) -> Option<Value> {
        serde_json::from_slice(&self.status(&["--json"]).stdout).ok()
    }

    /// Waits for a status for which `is_it` holds.
    fn wait_for(&self, is_it: impl Fn(&Value) -> bool) -> Value {
        let end = Instant::now() + DEADLINE;
        loop {
            let status = self.json();
            if let Some(status) = status.filter(|status| is_it(status)) {
                return status;
            }
            assert!(Instant::now() < end, "{:?}", self.process.log());
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

fn status(socket: &std::path::Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
    command.arg("status").arg("--socket").arg(socket).args(arguments).output().unwrap()
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
    assert!(lines.contains("turn_indicators  ENABLE_LEFT\n"), "{lines}");
    assert_eq!((code(&text), code(&gateway.status(&["--quiet"]))), (0, 0));
    assert_eq!(gateway.status(&["--quiet"]).stdout, b"");
    gateway.process.stop("TERM");
    let output = gateway.status(&[]);
    assert_eq!((code(&output), output.stdout.len()), (8, 0));
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
    assert!(String::from_utf8(text.stdout).unwrap().contains("turn_indicators  withheld: invalid: "));
}

#[test]
fn watching_gives_a_line_of_json_twice_a_second_and_goes_on_after_a_restart() {
    let mut gateway = Gateway::run(folder(0));
    let mut watching = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
    watching.args(["status", "--watch", "--json", "--socket"]).arg(gateway.socket());
    let mut watching =
        watching.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(watching.stdout.take().unwrap()).lines();
    let mut next = move || serde_json::from_str::<Value>(&lines.next().unwrap().unwrap()).unwrap();
    let before = [next(), next()];
    // As many lines as the other client gets.
    let served = BufReader::new(UnixStream::connect(gateway.socket()).unwrap());
    assert_eq!(served.lines().take(3).map_while(Result::ok).count(), 3);
    gateway.process.stop("TERM");
    let mut errors = BufReader::new(watching.stderr.take().unwrap()).lines();
    let lost = errors.next().unwrap().unwrap();
    assert!(lost.contains("status.sock: the connection was closed; waiting for it"), "{lost}");
    let _restarted = Process::run(&gateway.folder);
    let uptime = |line: &Value| line["process"]["uptime_ms"].as_u64().unwrap();
    // The lines of the first gateway that were not read yet come first.
    let mut last = before[1].clone();
    assert!(uptime(&before[0]) < uptime(&last));
    loop {
        let line = next();
        if uptime(&line) < uptime(&last) {
            break;
        }
        last = line;
    }
    assert!(next()["turn_indicators"].is_object());
    assert_eq!(watching.try_wait().unwrap(), None);
    watching.kill().unwrap();
    watching.wait().unwrap();
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
    let pid = first.json().unwrap()["process"]["pid"].clone();
    second.stop("TERM");
    assert_eq!(first.json().unwrap()["process"]["pid"], pid);
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
    let path = folder.path().join("notify");
    let manager = UnixDatagram::bind(&path).unwrap();
    manager.set_nonblocking(true).unwrap();
    let process = Process::run_with(&folder, |command| {
        command.env("NOTIFY_SOCKET", &path).env("WATCHDOG_USEC", "400000");
    });
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
    let mut fed = 0;
    let end = Instant::now() + DEADLINE;
    while fed < 5 {
        let mut buffer = [0; 512];
        match manager.recv(&mut buffer) {
            Ok(len) => fed += u32::from(&buffer[..len] == b"WATCHDOG=1"),
            Err(error) => assert_eq!(error.kind(), ErrorKind::WouldBlock),
        }
        assert!(Instant::now() < end, "{:?}", gateway.process.log());
        std::thread::sleep(Duration::from_millis(10));
    }
    drop(clients);
    gateway.wait_for(|status| status["level"] == "OK");
    gateway.process.stop("TERM");
}
