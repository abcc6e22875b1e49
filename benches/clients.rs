//! The cost of those who watch the live page: from none to 60 clients of its stream of events.
//!
//! `cargo bench --bench clients`. The gateway plays the demo in a process of its own, whose processor time
//! counts; the clients read all that comes.

#![allow(clippy::unwrap_used)] // a program for developers

#[path = "comparison.rs"]
mod comparison;

use std::io::{self, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::process::{Command, ExitCode, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use comparison::{Gateway, Row, point, processor_time_of};

const GATEWAY: &str = env!("CARGO_BIN_EXE_signal-gateway");
const COUNTS: [u32; 6] = [2, 5, 10, 20, 40, 60];
/// How long the clients of each count are served before, and while it is measured.
const SETTLING: Duration = Duration::from_millis(500);
const WINDOW: Duration = Duration::from_secs(4);
/// How long the gateway may take to start.
const START: Duration = Duration::from_secs(30);

fn main() -> ExitCode {
    // Free a moment ago, and nobody else's on a computer that runs a benchmark.
    let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let gateway = Gateway::start(address);
    let alone = gateway.serve(address, 0);
    let loads = COUNTS.map(|count| {
        let load = gateway.serve(address, count);
        point("clients: the gateway", "% of a core", f64::from(count), load);
        load
    });
    let [.., most] = loads;
    let row = Row {
        what: "demo with 60 clients of the live page",
        ours: most,
        peer: "without any",
        theirs: alone,
        unit: "% of a core",
        aim: None,
        limit: 3.0,
    };
    if row.print() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

impl Gateway {
    /// Plays the demo.
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

    /// Lets so many clients read for a while; processor time of the gateway, % of a core.
    fn serve(&self, address: SocketAddr, count: u32) -> f64 {
        let streams: Vec<_> = (0..count).map(|_| open(address)).collect();
        let read = |stream: &TcpStream| {
            let mut stream = stream.try_clone().unwrap();
            thread::spawn(move || io::copy(&mut stream, &mut io::sink()).unwrap())
        };
        let clients: Vec<_> = streams.iter().map(read).collect();
        thread::sleep(SETTLING);
        let pid = libc::pid_t::try_from(self.0.id()).unwrap();
        let before = processor_time_of(pid);
        thread::sleep(WINDOW);
        let taken = processor_time_of(pid).checked_sub(before).unwrap();
        for stream in streams {
            stream.shutdown(Shutdown::Both).unwrap();
        }
        for client in clients {
            assert!(client.join().unwrap() > 10_000, "a client got hardly an event");
        }
        taken.div_duration_f64(WINDOW) * 100.0
    }
}

/// A client of the stream of events.
fn open(address: SocketAddr) -> TcpStream {
    let mut stream = TcpStream::connect(address).unwrap();
    write!(stream, "GET /events HTTP/1.1\r\nHost: {address}\r\n\r\n").unwrap();
    stream
}
