//! A fault campaign: recordings of every shipped vehicle, with everything happening to them that can, held
//! against an oracle of its own.
//!
//! ```sh
//! cargo test --test campaign -- --recordings 3800 --seed 1
//! cargo test --test campaign -- --seed 1 --only 17     # one of them again
//! ```
//!
//! It prints a table by fault, and ends with 1 when a report was published or withheld wrongly: then it also
//! prints which recording it was, and writes the shortest one that still goes wrong.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)] // fails like a test

mod campaign {
    pub(crate) mod dice;
    pub(crate) mod faults;
    pub(crate) mod oracle;
    pub(crate) mod recording;
    pub(crate) mod trial;
    pub(crate) mod vehicle;
    pub(crate) mod wire;
}

#[path = "support/docs_section.rs"]
mod docs_section;

use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;

use campaign::dice::Dice;
use campaign::faults::FAULTS;
use campaign::recording::{Line, drive};
use campaign::trial::{Kind, Verdict, run, shrink, text};
use campaign::vehicle::Vehicle;
use gateway_core::gateway::GatewaySettings;
use signal_gateway::config::files::Disk;
use signal_gateway::config::load_profile;

/// Recordings when the command line names no number.
const RECORDINGS: usize = 400;

/// After so many wrong recordings the rest is not tried.
const MOST_WRONG: usize = 3;

struct Arguments {
    recordings: std::ops::Range<usize>,
    seed: u64,
}

/// A shipped vehicle, as the campaign and as the gateway reads it.
type Subject = (Vehicle, GatewaySettings);

/// Outcome of one recording, and which faults it has.
struct Outcome {
    recording: usize,
    faults: Vec<usize>,
    verdict: Verdict,
}

fn main() -> ExitCode {
    let Some(Arguments { recordings, seed }) = arguments() else {
        eprintln!("usage: campaign [--recordings NUMBER] [--seed NUMBER] [--only RECORDING]");
        return ExitCode::from(2);
    };
    let subjects = subjects();
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let mut outcomes: Vec<Outcome> = std::thread::scope(|scope| {
        let share = |first: usize| {
            let (mine, subjects) = (recordings.clone().skip(first).step_by(threads), &subjects);
            scope.spawn(move || outcomes(mine, seed, subjects))
        };
        let workers: Vec<_> = (0..threads).map(share).collect();
        workers.into_iter().flat_map(|worker| worker.join().unwrap()).collect()
    });
    outcomes.sort_by_key(|outcome| outcome.recording);
    let table = table(&outcomes, &subjects);
    print!("{table}");
    docs_section::update("campaign", &table);
    let mut failed = false;
    for outcome in outcomes.iter().filter(|outcome| outcome.verdict.wrong.is_some()) {
        failed = true;
        explain(outcome, seed, &subjects);
    }
    ExitCode::from(u8::from(failed))
}

fn arguments() -> Option<Arguments> {
    let (mut recordings, mut seed) = (0..RECORDINGS, 1);
    let mut given = std::env::args().skip(1);
    while let Some(name) = given.next() {
        let number: u32 = given.next()?.parse().ok()?;
        let count = number as usize;
        match name.as_str() {
            "--recordings" => recordings = 0..count,
            "--only" => recordings = count..count + 1,
            "--seed" => seed = number.into(),
            _ => return None,
        }
    }
    Some(Arguments { recordings, seed })
}

/// Every shipped vehicle that has lights.
fn subjects() -> Vec<Subject> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/vehicles");
    let mut profiles: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    profiles.sort();
    let read = |profile: &std::path::PathBuf| {
        let vehicle = Vehicle::read(profile)?;
        let mut settings = load_profile(&Disk, profile).unwrap().gateway;
        // The oracle knows the lights, not what tells a vehicle from its variants.
        settings.lights.requirements.clear();
        Some((vehicle, settings))
    };
    profiles.iter().filter_map(read).collect()
}

/// A recording of a campaign, its vehicle, and the faults that befell it.
fn recording(seed: u64, number: usize, subjects: &[Subject]) -> (&Subject, Vec<Line>, Vec<usize>) {
    let mut dice = Dice::of(seed, number as u64);
    let subject = &subjects[number % subjects.len()];
    let mut lines = drive(&subject.0, &mut dice);
    let mut faults: Vec<_> = (0..dice.index(0..6)).map(|_| dice.index(0..FAULTS.len())).collect();
    faults.sort_unstable();
    for fault in &faults {
        FAULTS[*fault].1(&mut lines, &subject.0, &mut dice);
    }
    faults.dedup();
    (subject, lines, faults)
}

fn outcomes(numbers: impl Iterator<Item = usize>, seed: u64, subjects: &[Subject]) -> Vec<Outcome> {
    let (mut outcomes, mut wrong) = (Vec::new(), 0);
    for number in numbers {
        let ((vehicle, settings), lines, faults) = recording(seed, number, subjects);
        let verdict = run(vehicle, settings, &lines);
        wrong += usize::from(verdict.wrong.is_some());
        outcomes.push(Outcome { recording: number, faults, verdict });
        if wrong == MOST_WRONG {
            break;
        }
    }
    outcomes
}

const HEAD: &str = "\
| fault | recordings | reports | instants without one | wrong publications | wrong withholdings |
|---|---|---|---|---|---|
";

/// By fault, since a recording may have several, and all in all.
fn table(outcomes: &[Outcome], subjects: &[Subject]) -> String {
    let mut table = HEAD.to_owned();
    let mut row = |name: &str, keep: &dyn Fn(&Outcome) -> bool| {
        let chosen = || outcomes.iter().filter(|outcome| keep(outcome)).map(|outcome| &outcome.verdict);
        let wrong = |kind| {
            chosen().filter_map(|verdict| verdict.wrong.as_ref()).filter(|wrong| wrong.kind == kind).count()
        };
        let (published, withholdings) = (wrong(Kind::Publication), wrong(Kind::Withholding));
        let reports: u64 = chosen().map(|verdict| verdict.reports).sum();
        let withheld: u64 = chosen().map(|verdict| verdict.withheld).sum();
        let recordings = chosen().count();
        writeln!(table, "| {name} | {recordings} | {reports} | {withheld} | {published} | {withholdings} |")
            .unwrap();
    };
    row("none", &|outcome| outcome.faults.is_empty());
    for (index, (name, _)) in FAULTS.iter().enumerate() {
        row(name, &|outcome| outcome.faults.contains(&index));
    }
    row(&format!("**all, {} vehicles**", subjects.len()), &|_| true);
    table
}

/// How to repeat a wrong recording, and the shortest one like it.
fn explain(outcome: &Outcome, seed: u64, subjects: &[Subject]) {
    let number = outcome.recording;
    let ((vehicle, settings), lines, faults) = recording(seed, number, subjects);
    let Some(kind) = outcome.verdict.wrong.as_ref().map(|wrong| wrong.kind) else { return };
    let (shortest, wrong) = shrink(vehicle, settings, &lines, kind);
    let path =
        Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("campaign-{seed}-{number}-{}.log", vehicle.name));
    std::fs::write(&path, text(&shortest)).unwrap();
    let faults: Vec<_> = faults.into_iter().map(|fault| FAULTS[fault].0).collect();
    eprintln!("\n--seed {seed} --only {number}: {}, {faults:?}: {wrong}", vehicle.name);
    eprintln!("{} of its {} lines do: {}", shortest.len(), lines.len(), path.display());
}
