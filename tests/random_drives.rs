//! Random drives of the turn signal decider: maps, routes, speeds, stops and manoeuvres as they come, and
//! roads that meet themselves, against what must hold for every drive by default.
//!
//! ```sh
//! cargo test --test random_drives -- --drives 10000 --seed 1
//! cargo test --test random_drives -- --seed 1 --only 17     # one of them again
//! cargo test --test random_drives -- --loops 10000 --seed 1 # roads that meet themselves
//! cargo test --test random_drives -- --seed 1 --only-loop 17
//! ```
//!
//! It prints each drive that breaks a law, shrunk: as a file for `signal-gateway decide`, or the pieces of
//! the road, their ids and the speed. It ends with 1 then.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)] // fails like a test

#[path = "random_drives/mod.rs"]
mod random_drives;

use std::ops::Range;
use std::process::ExitCode;

/// Drives when the command line names no number.
const DRIVES: u64 = 200;

struct Arguments {
    drives: Range<u64>,
    loops: Range<u64>,
    seed: u64,
}

fn main() -> ExitCode {
    let Some(Arguments { drives, loops, seed }) = arguments() else {
        eprintln!(
            "usage: random_drives [--drives NUMBER] [--loops NUMBER] [--seed NUMBER] [--only DRIVE | --only-loop LOOP]"
        );
        return ExitCode::from(2);
    };
    let over_maps = broken(drives.clone(), |number| {
        random_drives::drive(seed, number).map_err(|law| format!("--seed {seed} --only {number}: {law}"))
    });
    let over_loops = broken(loops.clone(), |number| {
        random_drives::drive_loop(seed, number)
            .map_err(|law| format!("--seed {seed} --only-loop {number}: {law}"))
    });
    for (count, kind, broken) in [
        (drives.end - drives.start, "random drives", over_maps),
        (loops.end - loops.start, "random loops", over_loops),
    ] {
        if count > 0 {
            println!("{count} {kind} of seed {seed}: {broken} break a law");
        }
    }
    ExitCode::from(u8::from(over_maps + over_loops > 0))
}

/// How many of these drives break a law; each that does is printed.
fn broken(numbers: Range<u64>, drive: impl Fn(u64) -> Result<(), String> + Sync) -> usize {
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let drive = &drive;
    std::thread::scope(|scope| {
        let share = |first: usize| {
            let mine = numbers.clone().skip(first).step_by(threads);
            let is_broken =
                move |number: &u64| drive(*number).inspect_err(|law| eprintln!("{law}\n")).is_err();
            scope.spawn(move || mine.filter(is_broken).count())
        };
        let workers: Vec<_> = (0..threads).map(share).collect();
        workers.into_iter().map(|worker| worker.join().unwrap()).sum()
    })
}

/// Without a number of drives or loops, [`DRIVES`] are driven over maps.
fn arguments() -> Option<Arguments> {
    let (mut drives, mut loops, mut seed) = (None, None, 1);
    let mut given = std::env::args().skip(1);
    while let Some(name) = given.next() {
        let number: u64 = given.next()?.parse().ok()?;
        match name.as_str() {
            "--drives" => drives = Some(0..number),
            "--loops" => loops = Some(0..number),
            "--only" => drives = Some(number..number + 1),
            "--only-loop" => loops = Some(number..number + 1),
            "--seed" => seed = number,
            _ => return None,
        }
    }
    let default = if loops.is_none() { 0..DRIVES } else { 0..0 };
    Some(Arguments { drives: drives.unwrap_or(default), loops: loops.unwrap_or(0..0), seed })
}
