//! The live page over HTTP: its headers, its stream, its limits. `tests/live_page` looks at it in a browser.

use std::fs::Permissions;
use std::io::{BufRead as _, BufReader, ErrorKind, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::os::unix::fs::PermissionsExt as _;
use std::time::Duration;

use serde_json::Value;

use super::metrics_endpoint::Gateway;
use crate::support::http::{ask, body, free_address};
use crate::support::process::Process;
use crate::support::waiting::{Bystander, DEADLINE, wait_for, wait_until};

/// A stream of events whose answer is not read yet.
fn open_stream(gateway: &Gateway) -> TcpStream {
    let mut stream = TcpStream::connect(gateway.address).unwrap();
    stream.set_read_timeout(Some(DEADLINE)).unwrap();
    stream
        .write_all(format!("GET /events HTTP/1.1\r\nHost: {}\r\n\r\n", gateway.address).as_bytes())
        .unwrap();
    stream
}

/// The next snapshot of a stream; `None` at its end.
fn snapshot(stream: &mut BufReader<TcpStream>) -> Option<Value> {
    let mut line = String::new();
    while stream.read_line(&mut line).ok()? > 0 {
        if let Some(data) = line.trim_end().strip_prefix("data: ") {
            return serde_json::from_str(data).ok();
        }
        line.clear();
    }
    None
}

#[test]
fn page_is_one_document_that_may_load_nothing_but_its_own_stream() {
    let gateway = Gateway::run("");
    let page = gateway.get("/");
    let (head, document) = page.split_once("\r\n\r\n").unwrap();
    let head = head.to_lowercase();
    for header in [
        "content-type: text/html; charset=utf-8",
        "x-content-type-options: nosniff",
        "x-frame-options: deny",
        "referrer-policy: no-referrer",
        "cache-control: no-store",
        "content-security-policy: default-src 'none'; style-src 'sha256-",
        "script-src 'sha256-",
        "connect-src 'self'",
        "frame-ancestors 'none'",
    ] {
        assert!(head.contains(header), "{header}: {head}");
    }
    assert!(!head.contains("unsafe"), "{head}");
    for outside in ["src=", "@import", "url(", "style=\"", "onclick"] {
        assert!(!document.contains(outside), "{outside}");
    }
    let elsewhere = gateway.ask("GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n");
    assert!(elsewhere.starts_with("HTTP/1.1 421 "), "{elsewhere}");
    for path in ["/", "/events", "/metrics"] {
        let written = gateway.ask(&format!("POST {path} HTTP/1.1\r\nHost: localhost\r\n\r\n"));
        let head = written.to_lowercase();
        assert!(head.starts_with("http/1.1 405 ") && head.contains("allow: get, head"), "{path}: {written}");
    }
}

/// True while the gateway holds its end of a connection open.
fn is_held(gateway: &Gateway, client: &TcpStream) -> bool {
    const ESTABLISHED: &str = "01";
    let end = |address: SocketAddr| format!(":{:04X}", address.port());
    let (own, other) = (end(gateway.address), end(client.local_addr().unwrap()));
    let connections = std::fs::read_to_string("/proc/net/tcp").unwrap();
    connections.lines().any(|line| {
        let fields: Vec<_> = line.split_whitespace().collect();
        fields[1].ends_with(&own) && fields[2].ends_with(&other) && fields[3] == ESTABLISHED
    })
}

#[test]
fn stream_gives_one_snapshot_after_the_other_and_streams_leave_room_for_requests() {
    const MAX_STREAMS: usize = 64;
    let gateway = Gateway::run("");
    let mut streams: Vec<_> = (0..MAX_STREAMS).map(|_| BufReader::new(open_stream(&gateway))).collect();
    for stream in &mut streams {
        // A gateway that the machine holds up for seconds ends its streams.
        let [first, second] = wait_for("two snapshots of a stream", || {
            let both = snapshot(stream).zip(snapshot(stream)).map(<[Value; 2]>::from);
            if both.is_none() {
                *stream = BufReader::new(open_stream(&gateway));
            }
            both
        });
        let uptime = |snapshot: &Value| snapshot["process"]["uptime_ms"].as_u64().unwrap();
        assert!(uptime(&second) > uptime(&first), "{first}");
        assert_eq!(
            (&first["node"], &first["buses"][0]["name"]),
            (&"signal_gateway".into(), &"body (can0)".into())
        );
    }
    let refused = wait_for("a stream too many", || {
        let (mut stream, mut head) = (BufReader::new(open_stream(&gateway)), String::new());
        stream.read_line(&mut head).unwrap();
        if head.starts_with("HTTP/1.1 200 ") {
            streams.push(stream);
            return None;
        }
        stream.read_to_string(&mut head).unwrap();
        Some(head)
    });
    assert!(refused.starts_with("HTTP/1.1 503 ") && body(&refused) == "too many streams\n", "{refused}");
    let held = streams.iter().filter(|stream| is_held(&gateway, stream.get_ref())).count();
    assert!(held <= MAX_STREAMS, "{held} streams");
    assert!(gateway.get("/metrics").starts_with("HTTP/1.1 200 "));
}

#[test]
fn one_key_switches_the_page_off_and_metrics_stay() {
    let gateway = Gateway::run("page = false\n");
    for path in ["/", "/events"] {
        assert!(gateway.get(path).starts_with("HTTP/1.1 404 "), "{path}");
    }
}

#[test]
fn demo_and_replay_serve_the_page_and_open_it_in_the_browser() {
    let demo: &[&str] = &["demo", "--no-ros", "--repeat"];
    let replay: &[&str] = &["replay", "long.log", "--profile", "demo_vehicle"];
    for command in [demo, replay] {
        let folder = tempfile::tempdir().unwrap();
        // Played in its own time, it is not over before it is looked at.
        let recording = "(1000.0) can0 2A5#0000000000000000\n(9000.0) can0 2A5#0000000000000000\n";
        std::fs::write(folder.path().join("long.log"), recording).unwrap();
        // A browser of the desktop, as far as it matters here.
        let (browser, opened) = (folder.path().join("xdg-open"), folder.path().join("opened"));
        std::fs::write(&browser, format!("#!/bin/sh\necho \"$1\" > {}\n", opened.display())).unwrap();
        std::fs::set_permissions(&browser, Permissions::from_mode(0o755)).unwrap();
        let address = free_address();
        let mut gateway = Process::start(folder.path(), |process| {
            let path = std::env::var("PATH").unwrap();
            process.args(command).arg(format!("--web={address}")).arg("--open");
            process.env("PATH", format!("{}:{path}", folder.path().display()));
        });
        let url = format!("http://{address}/");
        gateway.wait_for_log(&format!("live page: {url}"));
        wait_until(format_args!("the browser of {command:?}"), || {
            std::fs::read_to_string(&opened).is_ok_and(|opened| opened.trim() == url)
        });
        // It listens before it is opened.
        let page = ask(address, &format!("GET / HTTP/1.1\r\nHost: {address}\r\n\r\n")).unwrap();
        assert!(page.starts_with("HTTP/1.1 200 "), "{page}");
        gateway.stop("INT");
    }
}

mod slow {
    use super::*;

    /// The most that waits in the kernel for a client that does not read, far less than the kernel would
    /// take.
    const MAX_WAITING: usize = 1_000_000;

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn who_leaves_the_events_unread_is_disconnected_and_who_reads_them_is_not() {
        let gateway = Gateway::run("");
        let (mut reading, mut beside) = (BufReader::new(open_stream(&gateway)), Bystander::start());
        let mut uptime_ms = || loop {
            if let Some(snapshot) = snapshot(&mut reading) {
                return snapshot["process"]["uptime_ms"].as_u64().unwrap();
            }
            // Only a gateway that the machine holds up for seconds ends the stream of somebody who reads it.
            let before = std::mem::replace(&mut beside, Bystander::start());
            before.finish().assert_gap(
                "a state of the gateway",
                Duration::from_secs(3),
                Duration::from_secs(1),
            );
            reading = BufReader::new(open_stream(&gateway));
        };
        let mut idle = open_stream(&gateway);
        idle.peek(&mut [0]).unwrap();
        assert!(is_held(&gateway, &idle));
        let held = (0..600).map(|_| uptime_ms()).take_while(|_| is_held(&gateway, &idle)).count();
        assert!(held < 600, "still connected after {held} events");
        // Much longer than the limit of ten seconds, by the clock of the gateway.
        let end_ms = uptime_ms() + 20_000;
        while uptime_ms() < end_ms {}
        // What waited in the kernel, and then the end.
        let mut waiting = Vec::new();
        let ended =
            idle.read_to_end(&mut waiting).map_or_else(|error| error.kind(), |_| ErrorKind::UnexpectedEof);
        assert!([ErrorKind::UnexpectedEof, ErrorKind::ConnectionReset].contains(&ended), "{ended}");
        println!("{held} events, {} bytes unread", waiting.len());
        assert!((1..MAX_WAITING).contains(&waiting.len()), "{}", waiting.len());
    }
}
