//! The status socket and the live page of a gateway on a real bus: the values are those of the bus and of the
//! reader, and clients that do not read delay no report.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::os::unix::net::UnixStream;
use std::time::Instant;

use serde_json::Value;

use super::{
    Bench, DISABLE, ENABLE_LEFT, ENABLE_RIGHT, HAZARD, HAZARD_OFF, LEFT, OFF, RIGHT, TURN, UNDEFINED,
};
use crate::support::prerequisite::require;
use crate::support::waiting::{DEADLINE, wait_for};

const STATUS: &str = "[status]\nsocket = \"status.sock\"\n";

fn bench(interface: &'static str) -> Result<Bench, crate::support::prerequisite::Missing> {
    Bench::new(interface, STATUS)
}

/// A client of the live page that reads the first byte of its stream and no more.
fn open_page(address: SocketAddr) -> TcpStream {
    wait_for("a stream of the live page", || {
        // A place may still be that of a client that has just left.
        let mut stream = TcpStream::connect(address).ok()?;
        stream.set_read_timeout(Some(DEADLINE)).unwrap();
        let request = format!("GET /events HTTP/1.1\r\nHost: {address}\r\n\r\n");
        let mut answer = [0; 13];
        stream.write_all(request.as_bytes()).and_then(|()| stream.read_exact(&mut answer)).ok()?;
        (&answer == b"HTTP/1.1 200 ").then_some(stream)
    })
}

fn connect(bench: &Bench) -> UnixStream {
    let path = bench.folder.path().join("status.sock");
    wait_for("the status socket", || UnixStream::connect(&path).ok())
}

/// Waits for a snapshot that `is_it`. Reports are published a little before the snapshot that shows them can
/// be taken, and a busy gateway hands out none for some seconds.
fn status(bench: &Bench, what: &str, is_it: impl Fn(&Value) -> bool) -> Value {
    wait_for(what, || {
        let mut line = String::new();
        BufReader::new(connect(bench)).read_line(&mut line).ok()?;
        serde_json::from_str(&line).ok().filter(&is_it)
    })
}

#[test]
fn status_has_the_frames_of_the_bus_and_the_reports_of_the_reader() {
    let bench = require!(bench("vcan-status"));
    let (reader, mut gateway) = bench.start();
    gateway.wait_for_log("turn_indicators");
    bench.vcan.send(HAZARD, HAZARD_OFF);
    let names = [
        (OFF, DISABLE, "DISABLE"),
        (LEFT, ENABLE_LEFT, "ENABLE_LEFT"),
        (RIGHT, ENABLE_RIGHT, "ENABLE_RIGHT"),
    ];
    for (sent, (data, report, name)) in (1_u64..).zip(names) {
        let mark = reader.mark();
        bench.vcan.send(TURN, data);
        let stamp = reader.report(mark, "turn", report);
        // The network side tells of a new reader on its own.
        let is_read = |shown: &Value| {
            let written = shown["process"]["ros"]["written"].as_array();
            written.is_some_and(|topics| topics.iter().any(|topic| topic["peers"] == 1))
        };
        let is_shown = |shown: &Value| shown["turn_indicators"]["published"] == name && is_read(shown);
        let shown = status(&bench, name, is_shown);
        assert_eq!(shown["turn_indicators"]["stamp_ns"], stamp);
        let message =
            shown["messages"].as_array().unwrap().iter().find(|message| message["id"] == TURN).unwrap();
        assert_eq!(message["frames"], sent);
        let bus = &shown["buses"][0];
        assert_eq!(
            (&bus["link"], &bus["frames"], &bus["controller"]),
            (&"up".into(), &(sent + 1).into(), &Value::Null)
        );
    }
    bench.vcan.send(TURN, UNDEFINED);
    reader.status(reader.mark(), "turn_indicators", 2, "= 3 is not a defined value");
    let shown = status(&bench, "no report", |shown| shown["turn_indicators"]["published"].is_null());
    assert_eq!(shown["signals"][0]["raw"], 3);
    let shown = status(&bench, "the traffic", |shown| shown["buses"][0]["traffic"].is_object());
    let measured = &shown["buses"][0]["traffic"];
    assert_eq!(
        (&measured["load_percent"], &measured["bitrate_bps"]),
        (&Value::Null, &Value::Null),
        "a virtual bus"
    );
    bench.vcan.bring_down();
    reader.status(reader.mark(), "turn_indicators", 2, "is down");
    status(&bench, "a link that is down", |shown| shown["buses"][0]["link"] == "down");
    gateway.stop("TERM");
}

/// Frame to report at the reader, with and without clients that do not read, fifty of the status socket and
/// fifty of the live page, in turn. A busy machine is seldom as busy in two rounds, so the pair of rounds
/// counts that compares best.
#[test]
fn fifty_clients_that_do_not_read_delay_and_lose_no_report() {
    /// Pairs of rounds at least, and at most.
    const PAIRS: [usize; 2] = [4, 20];
    const FRAMES: usize = 12;
    let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let keys = format!("{STATUS}[http]\naddress = \"{address}\"\n");
    let bench = require!(Bench::new("vcan-watch", &keys));
    let (reader, mut gateway) = bench.start();
    gateway.wait_for_log("turn_indicators");
    drop(connect(&bench));
    let round = |count: usize| {
        let clients: Vec<_> = (0..count).map(|_| (connect(&bench), open_page(address))).collect();
        let mut times: Vec<_> = [(LEFT, ENABLE_LEFT), (RIGHT, ENABLE_RIGHT)]
            .into_iter()
            .cycle()
            .take(FRAMES)
            .map(|(data, report)| {
                let (mark, sent) = (reader.mark(), Instant::now());
                bench.vcan.send(TURN, data);
                // Every change is published: one that is lost is waited for in vain.
                reader.report(mark, "turn", report);
                sent.elapsed()
            })
            .collect();
        drop(clients);
        times.sort();
        times[FRAMES / 2]
    };
    let mut best = f64::INFINITY;
    for pair in 1..=PAIRS[1] {
        let [without, with] = [0, 50].map(round);
        let ratio = with.as_secs_f64() / without.as_secs_f64();
        println!(
            "frame to report, median: {without:?}, with 50 slow clients of socket and page each {with:?}; ratio {ratio:.2}"
        );
        best = best.min(ratio);
        if pair >= PAIRS[0] && best < 3.0 {
            break;
        }
    }
    assert!(best < 3.0, "the clients make it slower, {best:.2} times at least");
    gateway.stop("TERM");
}
