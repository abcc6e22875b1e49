//! The status socket and the live page of a gateway on a real bus: the values are those of the bus and of the reader, and
//! clients that do not read delay no report.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use serde_json::Value;

use super::{
    Bench, DISABLE, ENABLE_LEFT, ENABLE_RIGHT, HAZARD, HAZARD_OFF, LEFT, OFF, RIGHT, TURN, UNDEFINED,
};
use crate::support::prerequisite::require;
use crate::support::process::DEADLINE;

const STATUS: &str = "[status]\nsocket = \"status.sock\"\n";

fn bench(interface: &'static str) -> Result<Bench, crate::support::prerequisite::Missing> {
    Bench::new(interface, STATUS)
}

/// A client of the live page that reads the first byte of its stream and no more.
fn open_page(address: SocketAddr) -> TcpStream {
    let end = Instant::now() + DEADLINE;
    loop {
        // A place may still be that of a client that has just left.
        if let Ok(mut stream) = TcpStream::connect(address) {
            stream.set_read_timeout(Some(DEADLINE)).unwrap();
            let request = format!("GET /events HTTP/1.1\r\nHost: {address}\r\n\r\n");
            let mut answer = [0; 13];
            let read = stream.write_all(request.as_bytes()).and_then(|()| stream.read_exact(&mut answer));
            if read.is_ok() && &answer == b"HTTP/1.1 200 " {
                return stream;
            }
        }
        assert!(Instant::now() < end, "no stream");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn connect(bench: &Bench) -> UnixStream {
    let end = Instant::now() + DEADLINE;
    loop {
        match UnixStream::connect(bench.folder.path().join("status.sock")) {
            Ok(stream) => return stream,
            Err(error) => assert!(Instant::now() < end, "{error}"),
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn status(bench: &Bench) -> Value {
    let mut line = String::new();
    BufReader::new(connect(bench)).read_line(&mut line).unwrap();
    serde_json::from_str(&line).unwrap()
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
        let shown = status(&bench);
        assert_eq!(shown["turn_indicators"]["published"], name);
        assert_eq!(shown["turn_indicators"]["stamp_ns"], stamp);
        let message =
            shown["messages"].as_array().unwrap().iter().find(|message| message["id"] == TURN).unwrap();
        assert_eq!(message["frames"], sent);
        let bus = &shown["buses"][0];
        assert_eq!(
            (&bus["link"], &bus["frames"], &bus["controller"]),
            (&"up".into(), &(sent + 1).into(), &Value::Null)
        );
        let written = shown["process"]["ros"]["written"].as_array().unwrap();
        assert!(written.iter().any(|topic| topic["peers"] == 1), "{written:?}");
    }
    bench.vcan.send(TURN, UNDEFINED);
    reader.status(reader.mark(), "turn_indicators", 2, "= 3 is not a defined value");
    let shown = status(&bench);
    assert_eq!(
        (&shown["turn_indicators"]["published"], &shown["signals"][0]["raw"]),
        (&Value::Null, &3.into())
    );
    let traffic = std::iter::repeat_with(|| status(&bench)["buses"][0]["traffic"].clone());
    let traffic = traffic.inspect(|_| std::thread::sleep(Duration::from_millis(500))).take(20);
    let measured = traffic.into_iter().find(Value::is_object).unwrap();
    assert_eq!(
        (&measured["load_percent"], &measured["bitrate_bps"]),
        (&Value::Null, &Value::Null),
        "a virtual bus"
    );
    bench.vcan.bring_down();
    reader.status(reader.mark(), "turn_indicators", 2, "is down");
    assert_eq!(status(&bench)["buses"][0]["link"], "down");
    gateway.stop("TERM");
}

/// Frame to report at the reader, with and without clients that do not read, fifty of the status socket and fifty of the
/// live page, in turn.
#[test]
fn fifty_clients_that_do_not_read_delay_and_lose_no_report() {
    const ROUNDS: usize = 8;
    const FRAMES: usize = 12;
    let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let keys = format!("{STATUS}[http]\naddress = \"{address}\"\n");
    let bench = require!(Bench::new("vcan-watch", &keys));
    let (reader, mut gateway) = bench.start();
    gateway.wait_for_log("turn_indicators");
    drop(connect(&bench));
    let mut times = [Vec::new(), Vec::new()];
    for round in 0..ROUNDS {
        let count = 50 * (round % 2);
        let clients: Vec<_> = (0..count).map(|_| (connect(&bench), open_page(address))).collect();
        for frame in 0..FRAMES {
            let (data, report) = if frame % 2 == 0 { (LEFT, ENABLE_LEFT) } else { (RIGHT, ENABLE_RIGHT) };
            let (mark, sent) = (reader.mark(), Instant::now());
            bench.vcan.send(TURN, data);
            // Every change is published: one that is lost is waited for in vain.
            reader.report(mark, "turn", report);
            times[round % 2].push(sent.elapsed());
        }
        drop(clients);
    }
    let [without, with] = times.map(|mut times| {
        times.sort();
        (times[times.len() / 2], times[times.len() * 95 / 100])
    });
    let ratio = with.0.as_secs_f64() / without.0.as_secs_f64();
    println!(
        "frame to report: p50 {:?}, p95 {:?}; with 50 slow clients of socket and page each: p50 {:?}, p95 {:?}; ratio {ratio:.2}",
        without.0, without.1, with.0, with.1
    );
    assert!(ratio < 3.0, "the clients make it slower: {without:?}, {with:?}");
    gateway.stop("TERM");
}
