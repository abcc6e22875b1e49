//! Random drives of the turn signal decider: maps, routes, speeds, stops and manoeuvres as they come, against what must
//! hold for every drive by default.
//!
//! ```sh
//! cargo test --test random_drives -- --drives 10000 --seed 1
//! cargo test --test random_drives -- --seed 1 --only 17     # one of them again
//! ```
//!
//! It prints each drive that breaks a law, shrunk, as a file for `signal-gateway decide`, and ends with 1 then.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)] // fails like a test

#[path = "random_drives/mod.rs"]
mod random_drives;

use std::ops::Range;
use std::process::ExitCode;

/// Drives when the command line names no number.
const DRIVES: u64 = 200;

struct Arguments {
    drives: Range<u64>,
    seed: u64,
}

fn main() -> ExitCode {
    let Some(Arguments { drives, seed }) = arguments() else {
        eprintln!("usage: random_drives [--drives NUMBER] [--seed NUMBER] [--only DRIVE]");
        return ExitCode::from(2);
    };
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let broken: usize = std::thread::scope(|scope| {
        let share = |first: usize| {
            let mine = drives.clone().skip(first).step_by(threads);
            let broken = move |number: &u64| {
                let broken = random_drives::drive(seed, *number);
                broken.inspect_err(|law| eprintln!("--seed {seed} --only {number}: {law}\n")).is_err()
            };
            scope.spawn(move || mine.filter(broken).count())
        };
        let workers: Vec<_> = (0..threads).map(share).collect();
        workers.into_iter().map(|worker| worker.join().unwrap()).sum()
    });
    println!("{} random drives of seed {seed}: {broken} break a law", drives.end - drives.start);
    ExitCode::from(u8::from(broken > 0))
}

fn arguments() -> Option<Arguments> {
    let (mut drives, mut seed) = (0..DRIVES, 1);
    let mut given = std::env::args().skip(1);
    while let Some(name) = given.next() {
        let number: u64 = given.next()?.parse().ok()?;
        match name.as_str() {
            "--drives" => drives = 0..number,
            "--only" => drives = number..number + 1,
            "--seed" => seed = number,
            _ => return None,
        }
    }
    Some(Arguments { drives, seed })
}
