//! What the benchmarks have in common: processor time, and rows that compare a figure with that of a peer in
//! the same run.
//!
//! A row is printed as one line of a Markdown table, which `benches/performance` collects. The peers are
//! those of `benches/peers`, by the path in `SIGNAL_GATEWAY_PEERS`.

#![allow(dead_code)] // each benchmark uses its part

use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// A figure beside one of a peer, both in the same unit.
pub(crate) struct Row<'a> {
    /// What is measured.
    pub(crate) what: &'a str,
    /// The figure.
    pub(crate) ours: f64,
    /// What it is compared with.
    pub(crate) peer: &'a str,
    /// The figure of the peer.
    pub(crate) theirs: f64,
    /// Unit of both.
    pub(crate) unit: &'a str,
    /// The ratio that is aimed at; `None` where the figure only tells what there is to gain.
    pub(crate) aim: Option<f64>,
    /// The ratio above which the run fails.
    pub(crate) limit: f64,
}

impl Row<'_> {
    /// Prints the row; false when the limit is exceeded.
    pub(crate) fn print(&self) -> bool {
        let Self { what, ours, peer, theirs, unit, aim, limit } = self;
        let ratio = (ours / theirs * 100.0).round() / 100.0;
        let digits = |value: f64| usize::from(value < 10.0);
        let aim = match aim {
            Some(aim) if ratio > *aim => format!("{aim}, not reached"),
            Some(aim) => aim.to_string(),
            None => String::new(),
        };
        println!(
            "| {what} | {ours:.*} {unit} | {peer}: {theirs:.*} {unit} | {ratio:.2} | {aim} |",
            digits(*ours),
            digits(*theirs)
        );
        if ratio > *limit {
            println!("{what}: {ratio:.2} times as much as {peer}; the limit is {limit}");
        }
        ratio <= *limit
    }
}

/// The figures of peers, nanoseconds by name; `None`, said so, without them.
pub(crate) fn peers(arguments: &[&str]) -> Option<Vec<(String, f64)>> {
    let Some(program) = std::env::var_os("SIGNAL_GATEWAY_PEERS") else {
        println!(
            "skipped: comparison with peers: SIGNAL_GATEWAY_PEERS is not set (benches/performance sets it)"
        );
        return None;
    };
    let output = Command::new(program).args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let figure = |line: &str| {
        let (name, figure) = line.rsplit_once(": ").unwrap();
        (name.to_owned(), figure.strip_suffix(" ns").unwrap().parse().unwrap())
    };
    Some(text.lines().map(figure).collect())
}

/// The figure of one peer.
pub(crate) fn figure(peers: &[(String, f64)], name: &str) -> f64 {
    peers.iter().find(|(known, _)| known == name).unwrap().1
}

/// A point of a curve of growth, which `benches/performance` draws.
pub(crate) fn point(curve: &str, unit: &str, size: f64, figure: f64) {
    println!("curve\t{curve}\t{unit}\t{size}\t{figure}");
}

/// A gateway that runs until this is dropped.
pub(crate) struct Gateway(pub(crate) Child);

impl Drop for Gateway {
    fn drop(&mut self) {
        self.0.kill().unwrap();
        self.0.wait().unwrap();
    }
}

/// Processor time of this thread, which other threads and programs do not change.
pub(crate) fn processor_time() -> Duration {
    clock(libc::CLOCK_THREAD_CPUTIME_ID)
}

/// Processor time of a process so far, of all its threads.
pub(crate) fn processor_time_of(pid: libc::pid_t) -> Duration {
    let mut id = 0;
    // SAFETY: the pointer is to a live value of the right type.
    #[allow(unsafe_code)]
    let result = unsafe { libc::clock_getcpuclockid(pid, &raw mut id) };
    assert_eq!(result, 0);
    clock(id)
}

fn clock(id: libc::clockid_t) -> Duration {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is to a live value of the right type.
    #[allow(unsafe_code)]
    let result = unsafe { libc::clock_gettime(id, &raw mut time) };
    assert_eq!(result, 0);
    Duration::new(u64::try_from(time.tv_sec).unwrap(), u32::try_from(time.tv_nsec).unwrap())
}

/// Processor time of a program that may find something, and its peak resident memory, KiB.
pub(crate) fn run(command: &mut Command) -> (Duration, i64) {
    #[allow(clippy::zombie_processes)] // `wait` below reaps it
    let child = command.stdout(Stdio::null()).spawn().unwrap();
    let (time, peak_kib) = wait(libc::pid_t::try_from(child.id()).unwrap());
    // Until it became the program the child was this process, and Linux counts that in.
    let own = own_peak_kib();
    assert!(own < peak_kib, "{own} KiB here hide what the program needs");
    (time, peak_kib)
}

/// Waits until the process has ended, with 0, or with 4 for findings; its processor time and peak resident
/// memory, KiB.
fn wait(pid: libc::pid_t) -> (Duration, i64) {
    // SAFETY: all-zero is a valid `rusage`.
    #[allow(unsafe_code)]
    let mut usage: libc::rusage = unsafe { std::mem::zeroed() };
    let mut status = 0;
    // SAFETY: both pointers are to live values of the right types; `pid` is our child, waited for once.
    #[allow(unsafe_code)]
    let waited = unsafe { libc::wait4(pid, &raw mut status, 0, &raw mut usage) };
    assert_eq!(waited, pid);
    assert!(libc::WIFEXITED(status) && [0, 4].contains(&libc::WEXITSTATUS(status)), "it failed: {status}");
    let duration = |time: libc::timeval| {
        Duration::new(u64::try_from(time.tv_sec).unwrap(), u32::try_from(time.tv_usec * 1000).unwrap())
    };
    (duration(usage.ru_utime) + duration(usage.ru_stime), usage.ru_maxrss)
}

fn own_peak_kib() -> i64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.trim().trim_end_matches(" kB").parse().unwrap()
}
