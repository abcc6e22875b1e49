//! The cost of those who watch the live page: from none to 60 clients of its stream of events.
//!
//! `cargo bench --bench clients`. The gateway plays the demo in a process of its own, whose processor time counts; the clients
//! read all that comes. What an event costs is what the clients together cost beyond the gateway without any.

#![allow(clippy::unwrap_used)] // a program for developers

#[path = "comparison.rs"]
mod comparison;

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::process::{Child, Command, ExitCode, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use comparison::{Row, point, processor_time, processor_time_of};

const GATEWAY: &str = env!("CARGO_BIN_EXE_signal-gateway");
const COUNTS: [u32; 6] = [2, 5, 10, 20, 40, 60];
/// How long the clients of each count are served before, and while it is measured.
const SETTLING: Duration = Duration::from_millis(500);
const WINDOW: Duration = Duration::from_secs(4);
/// How long the gateway may take to start.
const START: Duration = Duration::from_secs(30);
/// Events that are written to a socket by hand.
const WRITES: u32 = 5_000;

/// What a time of serving clients cost and brought.
struct Served {
    /// Processor time of the gateway a second, seconds.
    load: f64,
    events: usize,
    bytes: usize,
}

fn main() -> ExitCode {
    // Free a moment ago, and nobody else's on a computer that runs a benchmark.
    let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let gateway = Gateway::start(address);
    let alone = gateway.serve(address, 0);
    let window_s = WINDOW.as_secs_f64();
    let costs = COUNTS.map(|count| {
        let served = gateway.serve(address, count);
        let cost_us = (served.load - alone.load) * window_s * 1e6 / f64::from(to_u32(served.events));
        println!(
            "{count} clients: {:.2} % of a core, {} events of {} bytes, {cost_us:.0} µs each",
            served.load * 100.0,
            served.events,
            served.bytes / served.events
        );
        point("clients: the gateway", "% of a core", f64::from(count), served.load * 100.0);
        (cost_us, served.bytes / served.events)
    });
    let [_, _, (few_us, _), .., (many_us, bytes)] = costs;
    let rows = [
        Row {
            what: "event for each of 60 clients of the live page",
            ours: many_us,
            peer: "for each of 10",
            theirs: few_us,
            unit: "µs",
            aim: Some(1.2),
            limit: 3.0,
        },
        Row {
            what: "event for each of 60 clients of the live page",
            ours: many_us,
            peer: "write of the same bytes to a socket",
            theirs: write_us(bytes),
            unit: "µs",
            aim: None,
            limit: 60.0,
        },
    ];
    let mut good = true;
    for row in rows {
        good &= row.print();
    }
    if good { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// A gateway that plays the demo, until this is dropped.
struct Gateway(Child);

impl Gateway {
    fn start(address: SocketAddr) -> Self {
        let mut command = Command::new(GATEWAY);
        command.args(["--quiet", "demo", "--no-ros", "--plain", "--repeat", &format!("--web={address}")]);
        let gateway = Self(command.stdout(Stdio::null()).spawn().unwrap());
        let end = Instant::now() + START;
        while TcpStream::connect(address).is_err() {
            assert!(Instant::now() < end, "the gateway does not listen at {address}");
            thread::sleep(Duration::from_millis(20));
        }
        gateway
    }

    /// Lets so many clients read, and measures for a while.
    fn serve(&self, address: SocketAddr, count: u32) -> Served {
        let (events, bytes) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicUsize::new(0)));
        let streams: Vec<_> = (0..count).map(|_| open(address)).collect();
        let clients: Vec<_> = streams
            .iter()
            .map(|stream| {
                let (events, bytes) = (Arc::clone(&events), Arc::clone(&bytes));
                let mut stream = stream.try_clone().unwrap();
                thread::spawn(move || {
                    let mut buffer = vec![0; 64 * 1024];
                    while let Ok(read @ 1..) = stream.read(&mut buffer) {
                        // An event, and nothing else, ends with an empty line.
                        let ends = buffer[..read].windows(2).filter(|pair| pair == b"\n\n").count();
                        events.fetch_add(ends, Ordering::Relaxed);
                        bytes.fetch_add(read, Ordering::Relaxed);
                    }
                })
            })
            .collect();
        thread::sleep(SETTLING);
        let pid = libc::pid_t::try_from(self.0.id()).unwrap();
        let before = (processor_time_of(pid), events.load(Ordering::Relaxed), bytes.load(Ordering::Relaxed));
        thread::sleep(WINDOW);
        let served = Served {
            load: processor_time_of(pid).checked_sub(before.0).unwrap().div_duration_f64(WINDOW),
            events: events.load(Ordering::Relaxed) - before.1,
            bytes: bytes.load(Ordering::Relaxed) - before.2,
        };
        for stream in streams {
            stream.shutdown(std::net::Shutdown::Both).unwrap();
        }
        for client in clients {
            client.join().unwrap();
        }
        served
    }
}

impl Drop for Gateway {
    fn drop(&mut self) {
        self.0.kill().unwrap();
        self.0.wait().unwrap();
    }
}

/// A client of the stream of events.
fn open(address: SocketAddr) -> TcpStream {
    let mut stream = TcpStream::connect(address).unwrap();
    write!(stream, "GET /events HTTP/1.1\r\nHost: {address}\r\n\r\n").unwrap();
    stream
}

/// Microseconds of processor time to write so many bytes to a socket whose other end is read.
fn write_us(bytes: usize) -> f64 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let mut to = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
    let (mut from, _) = listener.accept().unwrap();
    let reader = thread::spawn(move || std::io::copy(&mut from, &mut std::io::sink()).unwrap());
    let event = vec![b'x'; bytes];
    let begin = processor_time();
    for _ in 0..WRITES {
        to.write_all(&event).unwrap();
    }
    let taken = processor_time().checked_sub(begin).unwrap();
    drop(to);
    reader.join().unwrap();
    taken.as_secs_f64() * 1e6 / f64::from(WRITES)
}

fn to_u32(count: usize) -> u32 {
    u32::try_from(count).unwrap()
}
