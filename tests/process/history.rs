//! The history: it goes on over a restart, tells of a process that was killed, and takes nothing that is not
//! its own.

use std::io::{BufRead as _, BufReader, Write as _};
use std::net::SocketAddr;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::process::{Command, Output};

use serde_json::Value;

use crate::support::http::{body, free_address, get};
use crate::support::process::{Folder, Process};
use crate::support::waiting::{described, wait_for, wait_until};

/// A folder for a gateway on a recording, with its black-box folder and status socket.
struct Car {
    folder: Folder,
    address: SocketAddr,
}

impl Car {
    fn new() -> Self {
        let recording = concat!(env!("CARGO_MANIFEST_DIR"), "/config/demo.log.gz");
        let address = free_address();
        let keys = format!(
            "source = \"recording\"\n[recording]\nfile = \"{recording}\"\n[ros]\nenabled = false\n\
             [http]\naddress = \"{address}\"\n[status]\nsocket = \"s\"\n[black_box]\nfolder = \"box\"\n"
        );
        Self { folder: Folder::with_demo_vehicle("can0", &keys), address }
    }

    fn run(&self) -> Process {
        let process = Process::run(&self.folder);
        wait_until(described(|| format!("changes: {:?}", process.log())), || !self.history("").is_empty());
        process
    }

    /// The entries that a query finds.
    fn history(&self, query: &str) -> Vec<Value> {
        let answer = get(self.address, &format!("/history{query}"));
        let page: Option<Value> = answer.and_then(|answer| serde_json::from_str(body(&answer)).ok());
        page.and_then(|page| page["entries"].as_array().cloned()).unwrap_or_default()
    }

    fn kinds(&self) -> Vec<String> {
        let of_process = |kind: &str| ["started", "stopped", "missing"].contains(&kind);
        let entries = self.history("");
        let kinds = entries.iter().map(|entry| entry["kind"].as_str().unwrap().to_owned());
        kinds.filter(|kind| of_process(kind)).collect()
    }

    fn file(&self) -> PathBuf {
        self.folder.path().join("box/history.jsonl")
    }

    fn status(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
        command.arg("status").arg("--socket").arg(self.folder.path().join("s")).args(arguments);
        command.output().unwrap()
    }
}

/// The page to which the first error with frames leads.
fn page_of_first_error(address: SocketAddr, process: &Process) -> String {
    let error = wait_for(described(|| format!("an error with frames: {:?}", process.log())), || {
        let page: Value = serde_json::from_str(body(&get(address, "/history?level=ERROR")?)).ok()?;
        page["entries"].as_array()?.iter().find(|entry| entry["black_box"].is_object()).cloned()
    });
    let path = format!("/frames/{}", error["number"]);
    wait_for(described(|| format!("{path}: {:?}", process.log())), || {
        get(address, &path).filter(|page| page.starts_with("HTTP/1.1 200 "))
    })
}

#[test]
fn error_in_a_recording_that_is_played_leads_to_its_frames() {
    let car = Car::new();
    // Left from 0 s, an undefined value at 1 s, left again from 2 s on.
    let lines = (0..80).map(|frame| {
        let (ms, state) = (frame * 50, if (20..40).contains(&frame) { 3 } else { 1 });
        let stamp = format!("({}.{:03}000)", 1_700_000_000 + ms / 1000, ms % 1000);
        format!("{stamp} can0 2A5#0000{:02X}0000000000\n{stamp} can0 2C1#0000000000000000\n", state << 1)
    });
    car.folder.write("played.log", &lines.collect::<String>());
    let keys = std::fs::read_to_string(car.folder.path().join("gateway.toml")).unwrap();
    let recording = concat!(env!("CARGO_MANIFEST_DIR"), "/config/demo.log.gz");
    let keys = keys.replace(&format!("\"{recording}\""), "\"played.log\"\nrepeat = true");
    car.folder.write("gateway.toml", &keys.replace("folder = \"box\"", "folder = \"box\"\nafter_s = 1"));
    let gateway = car.run();
    let page = page_of_first_error(car.address, &gateway);
    assert!(
        page.contains("\"opened_at\":{\"group\":\"diagnostics\",\"label\":\"turn_indicators\""),
        "{page}"
    );
    assert!(page.contains("\"bytes\":\"00 00 06 00 00 00 00 00\""), "{page}");
}

#[test]
fn error_of_the_demo_leads_to_its_frames_and_the_demo_leaves_nothing_behind() {
    let folder = Folder::with_configuration("");
    let address = free_address();
    let mut demo = Process::start(folder.path(), |command| {
        command
            .args(["demo", "--no-ros", "--repeat", "--plain", "--speed", "20"])
            .arg(format!("--web={address}"));
        command.env("TMPDIR", folder.path());
    });
    let page = page_of_first_error(address, &demo);
    assert!(page.contains("\"opened_at\":{\"group\":\"diagnostics\""), "{page}");
    assert!(page.contains("\"interface\":\"can0\""), "{page}");
    demo.stop("TERM");
    let left: Vec<_> =
        std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert!(!left.iter().any(|name| name.to_string_lossy().contains("demo")), "{left:?}");
}

#[test]
fn history_goes_on_over_a_restart_and_tells_of_a_process_that_was_killed() {
    let car = Car::new();
    let mut gateway = car.run();
    let first = car.history("");
    gateway.stop("TERM");
    let mut gateway = car.run();
    let again = car.history("");
    assert_eq!(again[..first.len()], first[..], "what was there is there");
    assert!(again.is_sorted_by_key(|entry| entry["number"].as_u64().unwrap()));
    assert_eq!(car.kinds(), ["started", "stopped", "started"]);
    // The file of this process says at once that it runs.
    let is_running = || std::fs::read_to_string(car.file()).is_ok_and(|text| text.contains("\"running\""));
    wait_until("the file of a running process", is_running);
    gateway.signal("KILL");
    gateway.ended();
    let _gateway = car.run();
    assert_eq!(car.kinds(), ["started", "stopped", "started", "missing", "started"]);
    let missing = car.history("?level=WARN").into_iter().find(|entry| entry["kind"] == "missing").unwrap();
    assert!(missing["text"].as_str().unwrap().contains("did not end in order"), "{missing}");
}

#[test]
fn second_gateway_in_the_same_folder_leaves_the_history_of_the_first_alone() {
    let car = Car::new();
    let mut first = car.run();
    let address = free_address();
    let second_keys = std::fs::read_to_string(car.folder.path().join("gateway.toml")).unwrap();
    let own = second_keys.replace(&car.address.to_string(), &address.to_string()).replace("\"s\"", "\"t\"");
    car.folder.write("gateway.toml", &own);
    let mut second = Process::run(&car.folder);
    second.wait_for_log("another gateway keeps its history there");
    second.stop("TERM");
    first.stop("TERM");
    car.folder.write("gateway.toml", &second_keys);
    let _third = car.run();
    assert_eq!(car.kinds(), ["started", "stopped", "started"], "of the first and the third");
}

#[test]
fn file_that_is_no_history_is_left_alone_and_lines_that_are_no_entry_are_told() {
    let car = Car::new();
    std::fs::create_dir_all(car.folder.path().join("box")).unwrap();
    let of_a_later_version = "{\"history\":9,\"writer\":\"stopped\"}\n";
    std::fs::write(car.file(), of_a_later_version).unwrap();
    let mut gateway = car.run();
    gateway.wait_for_log("expected a history of version 1, found version 9; give it a folder");
    gateway.stop("TERM");
    assert_eq!(std::fs::read_to_string(car.file()).unwrap(), of_a_later_version);
    let entry = |number: u64| {
        format!(
            "{{\"number\":{number},\"stamp_ns\":5,\"kind\":\"status\",\"level\":\"ERROR\",\"subject\":\"\\u001b[2J\",\
             \"text\":\"<script>\",\"remedy\":null,\"black_box\":{{\"recording\":\"../../etc/passwd\",\"at_us\":1}}}}\n"
        )
    };
    let lines = [entry(7), "no entry\n".to_owned(), entry(3), entry(8)].concat();
    std::fs::write(car.file(), format!("{{\"history\":1,\"writer\":\"stopped\"}}\n{lines}")).unwrap();
    let mut gateway = car.run();
    gateway.wait_for_log("2 lines of the history could not be read");
    let numbers: Vec<_> =
        car.history("?count=2&before=9").iter().map(|entry| entry["number"].clone()).collect();
    assert_eq!(numbers, [7, 8]);
    // A place that is no black box of ours leads nowhere.
    let frames = get(car.address, "/frames/7").unwrap();
    assert!(frames.starts_with("HTTP/1.1 404 "), "{frames}");
    let text = String::from_utf8(car.status(&["--history"]).stdout).unwrap();
    assert!(text.contains("\\u{1b}[2J") && !text.contains('\u{1b}'), "{text}");
}

#[test]
fn changes_are_read_over_the_socket_and_what_is_no_request_ends_the_connection() {
    let car = Car::new();
    let _gateway = car.run();
    let json = car.status(&["--history", "--json"]);
    let lines: Vec<Value> = json
        .stdout
        .split(|byte| *byte == b'\n')
        .filter_map(|line| serde_json::from_slice(line).ok())
        .collect();
    assert_eq!(lines[0]["kind"], "started");
    assert_eq!(json.status.code(), Some(0), "the exit code is no level of the past");
    let none = car.status(&["--history=ERROR", "--json"]).stdout;
    let errors: Vec<Value> =
        none.split(|byte| *byte == b'\n').filter_map(|line| serde_json::from_slice(line).ok()).collect();
    assert!(errors.iter().all(|entry| entry["level"] == "ERROR") && errors.len() < lines.len());
    let connect = || UnixStream::connect(car.folder.path().join("s")).unwrap();
    // Two requests in one piece, cut within the second.
    let client = connect();
    (&client).write_all(b"{\"count\":1}\n{\"cou").unwrap();
    (&client).write_all(b"nt\":2}\n").unwrap();
    let mut answers = Vec::new();
    for line in BufReader::new(&client).lines() {
        let line: Value = serde_json::from_str(&line.unwrap()).unwrap();
        answers.extend(line["history"]["entries"].as_array().map(Vec::len));
        if answers.len() == 2 {
            break;
        }
    }
    assert_eq!(answers, [1, 2]);
    for garbage in ["hello\n", "{\"count\":-1}\n", "{\"other\":1}\n", &"x".repeat(300)] {
        let client = connect();
        (&client).write_all(garbage.as_bytes()).unwrap();
        // The end of the connection, after the snapshots that were sent before.
        let ended = BufReader::new(&client).lines().take(100).take_while(Result::is_ok).count();
        assert!(ended < 100, "{garbage:?} is borne");
    }
    let query = get(car.address, "/history?count=x").unwrap();
    assert!(
        query.starts_with("HTTP/1.1 400 ") && query.contains("count") || query.contains("usize"),
        "{query}"
    );
}

#[test]
fn changes_that_come_are_followed() {
    let car = Car::new();
    let mut gateway = car.run();
    let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
    command.args(["status", "--history", "--watch", "--socket"]).arg(car.folder.path().join("s"));
    let watcher = command.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::null());
    let mut watcher = watcher.spawn().unwrap();
    let mut lines = BufReader::new(watcher.stdout.take().unwrap()).lines().map_while(Result::ok);
    assert!(lines.any(|line| line.contains("started, ")));
    gateway.stop("TERM");
    let gateway = car.run();
    // It connects again and goes on where it was: the earlier process's end comes, and its start does not
    // come again.
    let next = wait_for("the next start", || {
        let line = lines.next()?;
        line.contains("gateway").then_some(line)
    });
    assert!(next.contains("stopped"), "{next}: {:?}", gateway.log());
    assert!(lines.any(|line| line.contains("started, ")));
    watcher.kill().unwrap();
    watcher.wait().unwrap();
}
