//! Others that do what the gateway does, or the least part of it. Each figure is processor time for one of
//! the things named, in nanoseconds, that a tenth of many rounds stay below.
//!
//! - `peers frames` decodes two frames of the demo vehicle in turn: by hand, and with the decoder that
//!   dbc-codegen makes.
//! - `peers lines LOG` reads the frames of a candump log with C's `sscanf`, and finds the ends of its lines
//!   with memchr.
//! - `peers xml MAP` reads an OSM file from one element to the next, and does nothing with them.

use std::hint::black_box;
use std::time::Duration;

#[allow(clippy::all, clippy::pedantic, dead_code, missing_docs, warnings)] // as it is made
mod demo_vehicle {
    include!(concat!(env!("OUT_DIR"), "/demo_vehicle.rs"));
}

use demo_vehicle::{BcmTurnIndicatorsTurnIndicatorState as State, Messages};
use embedded_can::{Id, StandardId};

const LEFT: [u8; 8] = [1, 0, 0b0010, 0, 0, 0, 0x10, 0];
const RIGHT: [u8; 8] = [2, 0, 0b0100, 0, 0, 0, 0x20, 0];
const TURN_INDICATORS: u16 = 0x2A5;
/// Frames of a round.
const FRAMES: usize = 100_000;

fn main() {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["frames"] => frames(),
        ["lines", path] => lines(&std::fs::read(path).unwrap()),
        ["xml", path] => xml(&std::fs::read_to_string(path).unwrap()),
        _ => panic!("usage: peers frames | lines LOG | xml MAP"),
    }
}

fn frames() {
    let mut inputs = [(TURN_INDICATORS, LEFT), (TURN_INDICATORS, RIGHT)].into_iter().cycle();
    print_each("decode by hand", FRAMES, || {
        for _ in 0..FRAMES {
            let (id, data) = black_box(inputs.next().unwrap());
            black_box((id == TURN_INDICATORS).then(|| report((data[2] >> 1) & 7)));
        }
    });
    print_each("decode with dbc-codegen", FRAMES, || {
        for _ in 0..FRAMES {
            let (id, data) = black_box(inputs.next().unwrap());
            let message = Messages::from_can_message(Id::Standard(StandardId::new(id).unwrap()), &data);
            black_box(match message {
                Ok(Messages::BcmTurnIndicators(message)) => match message.turn_indicator_state() {
                    State::Off => Some(1),
                    State::Left => Some(2),
                    State::Right => Some(3),
                    _ => None,
                },
                _ => None,
            });
        }
    });
}

/// `TurnIndicatorsReport.report` of the signal; 0 for none.
fn report(state: u8) -> u8 {
    match state {
        0 => 1,
        1 => 2,
        2 => 3,
        _ => 0,
    }
}

fn lines(text: &[u8]) {
    let ends = memchr::memchr_iter(b'\n', text);
    let lines: Vec<_> = ends.scan(0, |from, to| Some((std::mem::replace(from, to + 1), to))).collect();
    let count = lines.len();
    print_each("find the end of a line with memchr", count, || {
        black_box(memchr::memchr_iter(b'\n', black_box(text)).count());
    });
    let mut line = Vec::with_capacity(4096);
    print_each("read a frame with sscanf", count, || {
        for (from, to) in &lines {
            // As `fgets` gives it.
            line.clear();
            line.extend_from_slice(&text[*from..*to]);
            line.push(0);
            let (mut seconds, mut micros, mut id) = (0_u64, 0_u64, 0_u32);
            let (mut interface, mut data) = ([0_u8; 16], [0_u8; 8]);
            let [d0, d1, d2, d3, d4, d5, d6, d7] = data.each_mut().map(std::ptr::from_mut);
            // SAFETY: the line ends with 0, and each conversion has its place, of at least the size that it
            // may fill.
            let read = unsafe {
                libc::sscanf(
                    line.as_ptr().cast(),
                    c"(%lu.%lu) %15s %x#%2hhx%2hhx%2hhx%2hhx%2hhx%2hhx%2hhx%2hhx".as_ptr(),
                    &raw mut seconds,
                    &raw mut micros,
                    interface.as_mut_ptr(),
                    &raw mut id,
                    d0,
                    d1,
                    d2,
                    d3,
                    d4,
                    d5,
                    d6,
                    d7,
                )
            };
            black_box((read, seconds, micros, interface, id, data));
        }
    });
}

fn xml(text: &str) {
    let mut elements = 0_u64;
    print_each("read a byte of a map with quick-xml", text.len(), || {
        let mut reader = quick_xml::Reader::from_str(text);
        while !matches!(reader.read_event().unwrap(), quick_xml::events::Event::Eof) {
            elements += 1;
        }
    });
    black_box(elements);
}

/// Prints the time of one of `count` things that are done in each round.
fn print_each(name: &str, count: usize, mut round: impl FnMut()) {
    let mut times: Vec<_> = (0..20).map(|_| timed(&mut round).as_nanos()).collect();
    times.sort_unstable();
    println!("{name}: {:.3} ns", times[times.len() / 10] as f64 / count as f64);
}

/// The processor time of this thread for something.
fn timed(work: impl FnOnce()) -> Duration {
    let now = || {
        let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
        // SAFETY: the pointer is to a live value of the right type.
        assert_eq!(unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time) }, 0);
        Duration::new(u64::try_from(time.tv_sec).unwrap(), u32::try_from(time.tv_nsec).unwrap())
    };
    let start = now();
    work();
    now() - start
}
