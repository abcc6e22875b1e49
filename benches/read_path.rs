//! The cost of reading frames: the gateway's reader beside the two loops that anybody would write, with the
//! same filter.
//!
//! It needs an interface `vcan0`, which the guest of `tests/with-vcan` has:
//!
//! ```sh
//! cargo --config 'target."cfg(unix)".runner="tests/with-vcan"' bench --bench read_path
//! ```
//!
//! Frames are sent one by one from another thread. Of the thread that reads, processor time and wake-ups are
//! counted over some runs in turn. The guest counts processor time in ticks of 10 ms, which says little of a
//! thread that seldom runs. So there is also a queue of frames that waits and is read as fast as it goes, the
//! best of some runs by the clock; there one of the loops takes the kernel's stamps as well, which the
//! gateway needs. The one limit is a ratio of processor time at 20,000 frames a second, to the better of the
//! loops.

#![allow(clippy::unwrap_used, clippy::cast_precision_loss)] // a program for developers, counts far below 2^52

use std::mem::{size_of, zeroed};
use std::os::fd::AsRawFd;
use std::process::ExitCode;
use std::ptr::null_mut;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

use can_signal::can::frame::CanId;
use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use signal_gateway::io::can::bus::{BusSocketSettings, receive};
use signal_gateway::io::can::id_filter::IdFilter;
use signal_gateway::io::can::transmit::Transmitter;
use socketcan::{
    CanDataFrame, CanFilter, CanSocket, EmbeddedFrame as _, Socket as _, SocketOptions as _, StandardId,
};

const INTERFACE: &str = "vcan0";
const IDS: [u16; 2] = [0x2A5, 0x2C1];
/// Sent until the reader has ended.
const END: u16 = 0x7FF;
/// The work of the better loop, divided by that of the gateway's reader, is at least this.
const MIN_RATIO: f64 = 0.9;
const RUNS: u32 = 4;
const LENGTH: Duration = Duration::from_secs(3);
const RECEIVE_BUFFER_BYTES: i32 = 4 << 20;
/// Frames of a queue: less than the buffer holds.
const WAITING: u32 = 4_000;
/// More queues than runs: they are short.
const QUEUES: u32 = 25;

/// So many frames, one after the other, in each period.
struct Load {
    name: &'static str,
    frames: u32,
    period: Duration,
}

const LOADS: [Load; 3] = [
    Load { name: "200 a second in pairs", frames: 2, period: Duration::from_millis(10) },
    Load { name: "2,000 a second", frames: 1, period: Duration::from_micros(500) },
    Load { name: "20,000 a second", frames: 1, period: Duration::from_micros(50) },
];

/// Passes the gate once it is open for frames, reads until `END`, and gives the number of frames before.
type Reader = fn(&Gate) -> u64;

const READERS: [(&str, Reader); 4] = [
    ("recv", recv_loop),
    ("recvmmsg", recvmmsg_loop::<false>),
    ("stamped", recvmmsg_loop::<true>),
    ("gateway", gateway_reader),
];

/// Where a reader waits until it may begin.
struct Gate {
    ready: Sender<()>,
    go: Receiver<()>,
    begun: Sender<Usage>,
}

impl Gate {
    fn pass(&self) {
        self.ready.send(()).unwrap();
        self.go.recv().unwrap();
        self.begun.send(Usage::now()).unwrap();
    }
}

/// What reading so many frames cost.
#[derive(Clone, Copy, Default)]
struct Cost {
    read: u64,
    lost: u64,
    busy: Duration,
    wakeups: i64,
    time: Duration,
}

fn main() -> ExitCode {
    if CanSocket::open(INTERFACE).is_err() {
        println!("skipped: no {INTERFACE}; run it under tests/with-vcan");
        return ExitCode::SUCCESS;
    }
    println!("{:21}  {:8} {:>12} {:>10} {:>5}", "load", "reader", "CPU ns/frame", "wake-ups/s", "lost");
    let mut ratio = 0.0;
    for load in &LOADS {
        let mut costs = [Cost::default(); READERS.len()];
        for _ in 0..RUNS {
            for ((_, reader), total) in READERS.iter().zip(&mut costs) {
                let cost = measure(*reader, |start| {
                    start();
                    send(load)
                });
                total.read += cost.read;
                total.lost += cost.lost;
                total.busy += cost.busy;
                total.wakeups += cost.wakeups;
                total.time += cost.time;
            }
        }
        for ((name, _), cost) in READERS.iter().zip(&costs) {
            let nanos = cost.busy.as_nanos() as f64 / cost.read as f64;
            let wakeups = cost.wakeups as f64 / cost.time.as_secs_f64();
            println!("{:21}  {name:8} {nanos:12.0} {wakeups:10.0} {:5}", load.name, cost.lost);
        }
        let [recv, recvmmsg, _, gateway] = costs.map(|cost| cost.busy.as_secs_f64() / cost.read as f64);
        ratio = recv.min(recvmmsg) / gateway; // the last load counts
    }
    println!("\n{WAITING} waiting frames: ns/frame by the clock");
    let mut best = [f64::INFINITY; READERS.len()];
    for _ in 0..QUEUES {
        for ((_, reader), best) in READERS.iter().zip(&mut best) {
            let cost = measure(*reader, |start| {
                let sent = send(&Load { name: "", frames: WAITING, period: LENGTH });
                CanSocket::open(INTERFACE).unwrap().write_frame(&frame(END)).unwrap();
                start();
                sent
            });
            assert_eq!(cost.lost, 0);
            *best = best.min(cost.time.as_nanos() as f64 / cost.read as f64);
        }
    }
    for ((name, _), best) in READERS.iter().zip(&best) {
        println!("  {name:8} {best:6.0}");
    }
    println!(
        "At 20,000 a second the better loop takes {ratio:.2} of the processor time of the gateway's reader."
    );
    if ratio >= MIN_RATIO {
        ExitCode::SUCCESS
    } else {
        println!("That is less than {MIN_RATIO}.");
        ExitCode::FAILURE
    }
}

/// What it costs to read what `send` sends, which gives the number of frames and calls its argument when
/// reading may begin.
fn measure(reader: Reader, send: impl FnOnce(&dyn Fn()) -> u64) -> Cost {
    let is_over = AtomicBool::new(false);
    let ((ready, is_ready), (start, go), (begun, before)) = (channel(), channel(), channel());
    let gate = Gate { ready, go, begun };
    thread::scope(|scope| {
        let is_over = &is_over;
        let reading = scope.spawn(move || {
            let read = reader(&gate);
            is_over.store(true, Ordering::Relaxed);
            (read, Usage::now())
        });
        is_ready.recv().unwrap();
        let sent = send(&|| start.send(()).unwrap());
        let before = before.recv().unwrap();
        let (end, socket) = (frame(END), CanSocket::open(INTERFACE).unwrap());
        while !is_over.load(Ordering::Relaxed) {
            socket.write_frame(&end).unwrap();
            thread::sleep(Duration::from_millis(10));
        }
        let (read, after) = reading.join().unwrap();
        Cost {
            read,
            lost: sent - read,
            busy: after.busy.saturating_sub(before.busy),
            wakeups: after.wakeups - before.wakeups,
            time: after.at.saturating_duration_since(before.at),
        }
    })
}

/// Sends for a while, evenly; gives the number of frames.
fn send(load: &Load) -> u64 {
    let socket = CanSocket::open(INTERFACE).unwrap();
    let frames = IDS.map(frame);
    let (begun, mut due, mut sent) = (Instant::now(), Duration::ZERO, 0);
    while due < LENGTH {
        thread::sleep(due.saturating_sub(begun.elapsed()));
        for (_, frame) in (0..load.frames).zip(frames.iter().cycle()) {
            socket.write_frame(frame).unwrap();
            sent += 1;
        }
        due += load.period;
    }
    sent
}

fn frame(id: u16) -> CanDataFrame {
    CanDataFrame::new(StandardId::new(id).unwrap(), &[0; 8]).unwrap()
}

/// What a thread has used until now.
#[derive(Clone, Copy)]
struct Usage {
    at: Instant,
    /// Processor time.
    busy: Duration,
    /// Voluntary context switches.
    wakeups: i64,
}

impl Usage {
    /// Of this thread.
    #[allow(unsafe_code)]
    fn now() -> Self {
        // SAFETY: zero is a value of both, and the calls only write to what they are given.
        let (usage, time) = unsafe {
            let (mut usage, mut time): (libc::rusage, libc::timespec) = zeroed();
            assert_eq!(libc::getrusage(libc::RUSAGE_THREAD, &raw mut usage), 0);
            assert_eq!(libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time), 0);
            (usage, time)
        };
        let busy = Duration::new(time.tv_sec.try_into().unwrap(), time.tv_nsec.try_into().unwrap());
        Self { at: Instant::now(), busy, wakeups: usage.ru_nvcsw }
    }
}

/// A blocking socket for `IDS` and `END`.
fn socket() -> CanSocket {
    let socket = CanSocket::open(INTERFACE).unwrap();
    let ids = IDS.into_iter().chain([END]);
    let filters: Vec<_> = ids.map(|id| CanFilter::new(id.into(), libc::CAN_SFF_MASK)).collect();
    socket.set_filters(&filters).unwrap();
    set_option(&socket, libc::SO_RCVBUFFORCE, RECEIVE_BUFFER_BYTES);
    socket
}

#[allow(unsafe_code)]
fn set_option(socket: &CanSocket, name: libc::c_int, value: libc::c_int) {
    let length = libc::socklen_t::try_from(size_of_val(&value)).unwrap();
    let (fd, level) = (socket.as_raw_fd(), libc::SOL_SOCKET);
    // SAFETY: pointer and length describe `value`, which the kernel only reads.
    let result = unsafe { libc::setsockopt(fd, level, name, (&raw const value).cast(), length) };
    assert_eq!(result, 0, "this needs root, which the command is in the guest");
}

/// The identifier of a frame as the kernel gives it.
fn id_of(frame: &[u8]) -> u32 {
    u32::from_ne_bytes(frame[..4].try_into().unwrap())
}

#[allow(unsafe_code)]
fn recv_loop(gate: &Gate) -> u64 {
    let socket = socket();
    let mut frame = [0; size_of::<libc::can_frame>()];
    gate.pass();
    let mut read = 0;
    loop {
        // SAFETY: pointer and length describe `frame`.
        let length = unsafe { libc::recv(socket.as_raw_fd(), frame.as_mut_ptr().cast(), frame.len(), 0) };
        assert_eq!(usize::try_from(length), Ok(frame.len()));
        if id_of(&frame) == u32::from(END) {
            return read;
        }
        read += 1;
    }
}

/// Takes what is there, at most as many as the gateway does; also the kernel's stamps, if `STAMPS`.
#[allow(unsafe_code)]
fn recvmmsg_loop<const STAMPS: bool>(gate: &Gate) -> u64 {
    const BATCH: usize = 64;
    const CONTROL: usize = 64;
    let socket = socket();
    if STAMPS {
        set_option(&socket, libc::SO_TIMESTAMPNS, 1);
    }
    let mut frames = [[0; size_of::<libc::can_frame>()]; BATCH];
    let mut controls = [[0_u64; CONTROL / size_of::<u64>()]; BATCH];
    // SAFETY: zero bytes are null pointers and zero lengths, values of these structures.
    let (mut parts, mut headers): ([libc::iovec; BATCH], [libc::mmsghdr; BATCH]) = unsafe { zeroed() };
    for ((frame, part), header) in frames.iter_mut().zip(&mut parts).zip(&mut headers) {
        part.iov_base = frame.as_mut_ptr().cast();
        part.iov_len = frame.len();
        header.msg_hdr.msg_iov = part;
        header.msg_hdr.msg_iovlen = 1;
    }
    gate.pass();
    let mut read = 0;
    loop {
        if STAMPS {
            for (header, control) in headers.iter_mut().zip(&mut controls) {
                header.msg_hdr.msg_control = control.as_mut_ptr().cast();
                header.msg_hdr.msg_controllen = CONTROL;
            }
        }
        let (headers, flags) = (headers.as_mut_ptr(), libc::MSG_WAITFORONE);
        // SAFETY: every header points to its own part, frame and control, with their lengths; all of them
        // live as long.
        let count = unsafe { libc::recvmmsg(socket.as_raw_fd(), headers, 64, flags, null_mut()) };
        for frame in &frames[..usize::try_from(count).unwrap()] {
            if id_of(frame) == u32::from(END) {
                return read;
            }
            read += 1;
        }
    }
}

/// With stamps, counts of what is lost, and the inputs that the gateway handles, at the end of its channel.
fn gateway_reader(gate: &Gate) -> u64 {
    let settings = BusSocketSettings {
        bus: BusIndex(0),
        interface: INTERFACE.to_owned(),
        ids: IdFilter::new(Some(IDS.into_iter().chain([END]).map(|id| CanId::Standard(id).into()).collect())),
        receive_buffer_bytes: RECEIVE_BUFFER_BYTES.try_into().unwrap(),
        transmitter: Transmitter::default(),
    };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let (sender, mut batches) = tokio::sync::mpsc::channel(16);
        let _reading = tokio::spawn(receive(settings, sender));
        let mut read = 0;
        loop {
            for input in batches.recv().await.unwrap() {
                match input {
                    CanInput::Frame { frame, .. } if frame.id() == CanId::Standard(END) => return read,
                    CanInput::Frame { .. } => read += 1,
                    CanInput::Link { state: LinkState::Up, .. } => gate.pass(),
                    CanInput::Link { .. }
                    | CanInput::Drops { .. }
                    | CanInput::ErrorFrame { .. }
                    | CanInput::Controller { .. }
                    | CanInput::BadRecords { .. } => {}
                }
            }
        }
    })
}
