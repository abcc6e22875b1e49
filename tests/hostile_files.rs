//! Hostile files: named ones, each hostile in one way, and nests, which are any format in any container in
//! any compression with any damage. Whatever a file is, a command that reads it takes a bounded time of a
//! processor and bounded memory, and ends with a documented exit code and a reason.
//!
//! ```sh
//! cargo test --release --test hostile_files -- --nests 20000 --seed 1
//! cargo test --release --test hostile_files -- --seed 1 --only 17 # one of them again
//! cargo test --release --test hostile_files -- --named 9900000 # the named ones, of about this many bytes
//! cargo test --release --test hostile_files -- --named 9900000 --like pcapng # those with this name
//! cargo test --release --test hostile_files -- --named 9900000 --write FOLDER # writes, runs nothing
//! ```
//!
//! It prints what took most time and most memory, and each run that breaks a limit, whose files it keeps; it
//! ends with 1 then. `--program` names another program than the one that was built with it.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)] // fails like a test

#[path = "hostile_files/child.rs"]
mod child;
#[path = "hostile_files/mod.rs"]
mod hostile_files;
#[path = "hostile_files/judge.rs"]
mod judge;

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};

use child::Taken;
use hostile_files::case::{Case, READING};
use hostile_files::choices::Choices;
use hostile_files::{named, named_texts, nested_texts, nests};

/// Nests when the command line says nothing.
const NESTS: u64 = 200;
/// After so many wrong runs the rest is not tried.
const MOST_WRONG: usize = 20;
/// Rows of each table.
const ROWS: usize = 12;

struct Arguments {
    nests: Range<u64>,
    seed: u64,
    /// Size of the named ones, bytes.
    named: Option<usize>,
    like: String,
    write: Option<PathBuf>,
    program: PathBuf,
}

/// A case that is made when it is due.
struct Due {
    /// How to repeat it.
    repeat: String,
    make: Box<dyn Fn() -> Case + Send + Sync>,
}

/// One run.
struct Outcome {
    repeat: String,
    name: String,
    words: String,
    size: u64,
    taken: Taken,
    wrong: Option<String>,
}

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    if words.first().is_some_and(|word| word == child::MARK) {
        return child::measure(&words[1..]).map_or(ExitCode::FAILURE, |()| ExitCode::SUCCESS);
    }
    let Some(arguments) = arguments(&words) else {
        eprintln!(
            "usage: hostile_files [--nests NUMBER | --only NEST] [--seed NUMBER] [--named BYTES [--like NAME]] [--write FOLDER] \
             [--program FILE]"
        );
        return ExitCode::from(2);
    };
    let due = due(&arguments);
    if let Some(folder) = &arguments.write {
        for due in &due {
            write(&(due.make)(), &folder.join(folder_name(&due.repeat)));
        }
        return ExitCode::SUCCESS;
    }
    let (next, wrong) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let work = || {
        let mut outcomes = Vec::new();
        while wrong.load(Ordering::Relaxed) < MOST_WRONG {
            let Some(due) = due.get(next.fetch_add(1, Ordering::Relaxed)) else { break };
            let of_case = outcomes_of(due, &arguments.program);
            wrong.fetch_add(
                of_case.iter().filter(|outcome| outcome.wrong.is_some()).count(),
                Ordering::Relaxed,
            );
            outcomes.extend(of_case);
        }
        outcomes
    };
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let outcomes: Vec<_> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        workers.into_iter().flat_map(|worker| worker.join().unwrap()).collect()
    });
    report(due.len(), &outcomes)
}

fn arguments(words: &[String]) -> Option<Arguments> {
    let built = option_env!("CARGO_BIN_EXE_signal-gateway").map(PathBuf::from);
    let (mut nests, mut seed, mut named, mut like, mut write, mut program) =
        (None, 1, None, String::new(), None, built);
    let mut given = words.iter();
    while let Some(name) = given.next() {
        let value = given.next()?;
        match name.as_str() {
            "--nests" => nests = Some(0..value.parse().ok()?),
            "--only" => nests = value.parse().ok().map(|only: u64| only..only + 1),
            "--seed" => seed = value.parse().ok()?,
            "--named" => named = Some(value.parse().ok()?),
            "--like" => like.clone_from(value),
            "--write" => write = Some(value.into()),
            "--program" => program = Some(std::path::absolute(value).ok()?),
            _ => return None,
        }
    }
    let nests = nests.unwrap_or(0..if named.is_none() { NESTS } else { 0 });
    Some(Arguments { nests, seed, named, like, write, program: program? })
}

fn due(arguments: &Arguments) -> Vec<Due> {
    let mut due = Vec::new();
    if let Some(size) = arguments.named {
        let all = named::all(size).into_iter().chain(named_texts::all(size));
        due.extend(
            all.filter(|(name, _)| name.contains(&arguments.like))
                .map(|(name, make)| Due { repeat: format!("--named {size} --like {name}"), make }),
        );
    }
    let seed = arguments.seed;
    due.extend(arguments.nests.clone().map(|number| Due {
        repeat: format!("--seed {seed} --only {number}"),
        make: Box::new(move || nest(&mut Choices::of(seed, number))),
    }));
    due
}

/// Any recording, or sometimes a text of another kind, and what reads it.
fn nest(choices: &mut Choices<'_>) -> Case {
    if choices.percent(15) {
        return nested_texts::nest(choices);
    }
    let nests::Nest { name, content, is_held_whole } = nests::nest(choices);
    // `identify` reads all vehicle profiles first.
    let often = ["check", "check", "check", "decode", "decode", "decode", "replay", "mcap"];
    let first = *choices.pick(&often);
    let second = *choices.pick(&READING);
    let commands: &[&str] = if first != second && choices.percent(15) { &[first, second] } else { &[first] };
    Case { is_held_whole, ..Case::recording(name, content, commands) }
}

fn write(case: &Case, folder: &Path) {
    std::fs::create_dir_all(folder).unwrap();
    for (name, content) in &case.files {
        std::fs::write(folder.join(name), content).unwrap();
    }
}

fn outcomes_of(due: &Due, program: &Path) -> Vec<Outcome> {
    let case = (due.make)();
    let folder = tempfile::tempdir().unwrap();
    write(&case, folder.path());
    let size = case.files.first().map_or(0, |(_, content)| content.len() as u64);
    let mut outcomes = Vec::new();
    for words in &case.runs {
        let taken = child::run(program, words, folder.path(), judge::END).unwrap();
        let wrong = judge::wrong(&case, &words[0], &taken, size);
        let (repeat, name, words) = (due.repeat.clone(), case.name.clone(), words.join(" "));
        outcomes.push(Outcome { repeat, name, words, size, taken, wrong });
        let _none_was_written = std::fs::remove_dir_all(folder.path().join("written"));
    }
    if outcomes.iter().any(|outcome| outcome.wrong.is_some()) {
        write(&case, &kept(&due.repeat));
    }
    outcomes
}

fn folder_name(repeat: &str) -> String {
    repeat.replace("--", "").replace(' ', "_")
}

/// Where the files of a case are kept that is wrong.
fn kept(repeat: &str) -> PathBuf {
    let temporary = option_env!("CARGO_TARGET_TMPDIR").map_or_else(std::env::temp_dir, PathBuf::from);
    temporary.join("hostile_files").join(folder_name(repeat))
}

fn report(cases: usize, outcomes: &[Outcome]) -> ExitCode {
    let mut order: Vec<_> = outcomes.iter().collect();
    order.sort_by_key(|outcome| std::cmp::Reverse(outcome.taken.processor));
    table("time of a processor", &order);
    order.sort_by_key(|outcome| std::cmp::Reverse(outcome.taken.memory_kib));
    table("memory", &order);
    order.sort_by_key(|outcome| std::cmp::Reverse(outcome.taken.written));
    table("bytes written", &order);
    let mut wrong = 0;
    for outcome in outcomes {
        let Some(reason) = &outcome.wrong else { continue };
        wrong += 1;
        let Outcome { repeat, words, size, .. } = outcome;
        eprintln!(
            "\n{repeat}: {reason}\n  signal-gateway {words}    ({size} bytes)\n  kept in {}",
            kept(repeat).display()
        );
        for line in outcome.taken.error.lines().take(3) {
            eprintln!("  {}", line.chars().take(200).collect::<String>());
        }
    }
    let read = outcomes.iter().filter(|outcome| matches!(outcome.taken.code, Some(0 | 4))).count();
    let seconds: f64 = outcomes.iter().map(|outcome| outcome.taken.processor.as_secs_f64()).sum();
    println!(
        "{cases} hostile files, {} runs, {read} of them not refused, {seconds:.1} s of a processor: {wrong} break a limit",
        outcomes.len()
    );
    ExitCode::from(u8::from(wrong > 0))
}

#[allow(clippy::cast_precision_loss)] // for people
fn table(by: &str, order: &[&Outcome]) {
    println!("most {by}:\n{:>8} {:>9} {:>11} {:>10}  what", "s", "MiB", "written kB", "bytes");
    for Outcome { repeat, name, words, size, taken, .. } in order.iter().take(ROWS) {
        println!(
            "{:>8.2} {:>9.1} {:>11} {size:>10}  {name}: {words} ({repeat})",
            taken.processor.as_secs_f64(),
            taken.memory_kib as f64 / 1024.0,
            taken.written / 1000,
        );
    }
    println!();
}
