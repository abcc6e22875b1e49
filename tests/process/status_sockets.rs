//! The status sockets of gateways that a user starts: where they are, and how `status` finds them.

use std::fs::{self, DirBuilder};
use std::os::unix::fs::{DirBuilderExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::support::process::{Folder, Process};
use crate::support::waiting::{described, wait_for};

/// A folder with configurations, and a runtime directory of the user.
struct Desk {
    folder: Folder,
    runtime: tempfile::TempDir,
}

const UNREACHABLE: i32 = 8;
const USAGE: i32 = 2;

impl Desk {
    fn new() -> Self {
        let keys = "source = \"recording\"\n[recording]\nfile = \"steady.log\"\nrepeat = true\n[ros]\nenabled = false\n";
        let folder = Folder::with_demo_vehicle("can0", keys);
        let lines = (0..100).map(|frame| {
            let stamp = format!("(1700000000.{:06})", frame * 9_000);
            format!("{stamp} can0 2A5#0000020000000000\n{stamp} can0 2C1#0000000000000000\n")
        });
        folder.write("steady.log", &lines.collect::<String>());
        let text = fs::read_to_string(folder.path().join("gateway.toml")).unwrap();
        folder.write("kona.toml", &text);
        Self { folder, runtime: tempfile::tempdir().unwrap() }
    }

    fn socket(&self, name: &str) -> PathBuf {
        self.runtime.path().join("signal-gateway").join(name)
    }

    /// Starts a gateway, and waits for its socket.
    fn run(&self, configuration: &str, socket: &str) -> Process {
        let mut process = Process::start(self.folder.path(), |command| {
            command.args(["run", "--config", configuration]).env("XDG_RUNTIME_DIR", self.runtime.path());
        });
        process.wait_for_log(&format!("status socket: {}", self.socket(socket).display()));
        process
    }

    fn ask(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
        let command = command.current_dir(self.folder.path()).env("XDG_RUNTIME_DIR", self.runtime.path());
        command.args(arguments).output().unwrap()
    }

    /// The id of the process that answers `status` with these arguments; waits until one does.
    fn answering(&self, arguments: &[&str]) -> u32 {
        let arguments = [&["status", "--json"], arguments].concat();
        wait_for(described(|| format!("an answer: {:?}", self.ask(&arguments))), || {
            let status: serde_json::Value = serde_json::from_slice(&self.ask(&arguments).stdout).ok()?;
            Some(u32::try_from(status["process"]["pid"].as_u64()?).unwrap())
        })
    }
}

fn mode(path: &Path) -> u32 {
    fs::metadata(path).unwrap().permissions().mode() & 0o777
}

fn error_text(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

#[test]
fn gateway_of_a_user_is_found_without_options_and_its_socket_is_private() {
    let desk = Desk::new();
    let mut gateway = desk.run("gateway.toml", "gateway.sock");
    assert_eq!(desk.answering(&[]), gateway.id());
    let socket = desk.socket("gateway.sock");
    assert_eq!((mode(&socket), mode(socket.parent().unwrap())), (0o600, 0o700));
    assert!(desk.ask(&["status", "--history"]).status.success());
    gateway.stop("TERM");
    assert!(!socket.exists(), "the socket goes with the gateway");
    let output = desk.ask(&["status"]);
    assert_eq!(output.status.code(), Some(UNREACHABLE));
    assert!(error_text(&output).contains("/run/signal-gateway/status.sock"), "{output:?}");
}

#[test]
fn several_gateways_are_listed_each_with_the_command_that_asks_it() {
    let desk = Desk::new();
    let first = desk.run("gateway.toml", "gateway.sock");
    let second = desk.run("gateway.toml", "gateway-2.sock");
    let kona = desk.run("kona.toml", "kona.sock");
    let ids = [first.id(), second.id(), kona.id()];
    for (socket, id) in ["gateway.sock", "gateway-2.sock", "kona.sock"].into_iter().zip(ids) {
        assert_eq!(desk.answering(&["--socket", desk.socket(socket).to_str().unwrap()]), id);
    }
    let output = desk.ask(&["status"]);
    assert_eq!((output.status.code(), output.stdout.len()), (Some(USAGE), 0));
    let text = error_text(&output);
    assert!(text.contains("3 gateways run here"), "{text}");
    let file = fs::canonicalize(desk.folder.path().join("kona.toml")).unwrap();
    assert!(text.contains(&format!("kona: {}, ", file.display())), "{text}");
    // The commands do as they say.
    let commands: Vec<_> =
        text.lines().filter_map(|line| line.trim().strip_prefix("signal-gateway status ")).collect();
    let asked: Vec<_> =
        commands.iter().map(|line| desk.answering(&line.split(' ').collect::<Vec<_>>())).collect();
    assert_eq!(asked, ids, "{text}");
    // A configuration chooses, unless two run with it.
    assert_eq!(desk.answering(&["-c", "kona.toml"]), kona.id());
    let output = desk.ask(&["status", "-c", "gateway.toml"]);
    assert_eq!(output.status.code(), Some(USAGE));
    assert!(error_text(&output).contains("2 gateways run here"), "{output:?}");
    let output = desk.ask(&["reload"]);
    assert_eq!(output.status.code(), Some(USAGE));
    assert!(error_text(&output).contains("signal-gateway reload --socket "), "{output:?}");
}

#[test]
fn configuration_that_runs_nowhere_is_said_with_those_that_run() {
    let desk = Desk::new();
    let _gateway = desk.run("gateway.toml", "gateway.sock");
    let output = desk.ask(&["status", "-c", "kona.toml"]);
    assert_eq!(output.status.code(), Some(UNREACHABLE));
    let text = error_text(&output);
    assert!(text.contains("no gateway runs with ") && text.contains("gateway.sock"), "{text}");
    // A socket of its own is that of its configuration.
    desk.folder.append("kona.toml", "[status]\nsocket = \"own.sock\"\n");
    let mut kona = Process::start(desk.folder.path(), |command| {
        command.args(["run", "--config", "kona.toml"]);
    });
    kona.wait_for_log("turn_indicators");
    assert_eq!(desk.answering(&["-c", "kona.toml"]), kona.id());
}

#[test]
fn name_of_a_killed_gateway_is_free_for_the_next_one() {
    let desk = Desk::new();
    let mut killed = desk.run("gateway.toml", "gateway.sock");
    killed.signal("KILL");
    killed.ended();
    assert!(desk.socket("gateway.sock").exists(), "stale");
    let next = desk.run("gateway.toml", "gateway.sock");
    assert_eq!(desk.answering(&[]), next.id());
}

#[test]
fn gateway_without_a_runtime_directory_says_so_and_runs() {
    let desk = Desk::new();
    let missing = desk.folder.path().join("missing");
    let mut gateway = Process::run_with(&desk.folder, |command| {
        command.env("XDG_RUNTIME_DIR", &missing);
    });
    let reason = format!("no status socket: XDG_RUNTIME_DIR: {} is not a folder", missing.display());
    gateway.wait_for_log(&reason);
    gateway.wait_for_log("[status] socket = \"PATH\"");
    gateway.wait_for_log("turn_indicators");
    gateway.stop("TERM");
}

#[test]
fn service_has_its_socket_where_systemd_says_for_its_group() {
    let desk = Desk::new();
    let directory = desk.folder.path().join("run");
    DirBuilder::new().mode(0o750).create(&directory).unwrap();
    let mut gateway = Process::run_with(&desk.folder, |command| {
        command.env("RUNTIME_DIRECTORY", &directory).env("XDG_RUNTIME_DIR", desk.runtime.path());
    });
    gateway.wait_for_log("turn_indicators");
    let socket = directory.join("status.sock");
    assert_eq!((mode(&socket), mode(&directory)), (0o660, 0o750));
    assert!(!desk.socket("gateway.sock").exists());
    assert_eq!(desk.answering(&["--socket", socket.to_str().unwrap()]), gateway.id());
    gateway.stop("TERM");
}
