//! Instructions for each frame, counted by valgrind: the same on a busy machine as on an idle one, so that a
//! change of a few per cent is seen.
//!
//! It fails where a count is more than [`TOLERANCE_PERCENT`] away from `benches/instructions.tsv`. With
//! `--renew` the file takes the counts, and with `--measured` also as those that the times in
//! docs/performance.md belong to: `benches/performance` does both. Exit code 77 without valgrind. To see
//! where instructions are spent: `valgrind --tool=callgrind --toggle-collect='*Gateway*handle*' PROGRAM
//! --frames 'frame, value unchanged' 10000`.
//!
//! A count is the difference between a few and many frames, so that starting does not count. It depends on
//! the compiler, the C library, and the processor as valgrind presents it. Where these are not those of the
//! file, only [`FOREIGN_TOLERANCE_PERCENT`] is judged, and a note says so.

#![allow(clippy::unwrap_used, clippy::cast_precision_loss)] // a program for developers, counts far below 2^52

#[path = "demo_frames.rs"]
mod demo_frames;

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use demo_frames::{CHANGED, FramePair, LIGHTS_VEHICLE, NOW, SIGN_OF_LIFE, UNCHANGED, take, write_frames};

/// Growth, or shrinking, above which the run fails.
const TOLERANCE_PERCENT: f64 = 4.0;
/// The same for counts of another compiler, C library or processor.
const FOREIGN_TOLERANCE_PERCENT: f64 = 25.0;
/// The option by which this program runs itself below valgrind.
const FRAMES: &str = "--frames";

const FRAME_PAIRS: [FramePair; 3] = [SIGN_OF_LIFE, UNCHANGED, CHANGED];
/// Numbers of frames of a pair.
const FED: [u32; 2] = [1_000, 11_000];

/// Commands, which read a recording.
const COMMANDS: [(&str, &[&str]); 4] = [
    ("check", &["check", "--profile", LIGHTS_VEHICLE]),
    ("decode", &["decode", "--profile", LIGHTS_VEHICLE]),
    ("identify", &["identify"]),
    ("replay --json", &["replay", "--json", "--profile", LIGHTS_VEHICLE]),
];
/// Lengths of the recordings, in frames: the first as many as are searched for the names of interfaces
/// before, the second as many more as the demo has.
const RECORDED: [u32; 2] = [20_000, 111_570];

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    let arguments: Vec<_> = arguments.iter().map(String::as_str).collect();
    if let [FRAMES, name, count] = arguments[..] {
        feed(name, count.parse().unwrap());
        return ExitCode::SUCCESS;
    }
    if Command::new("valgrind").arg("--version").stdout(Stdio::null()).status().is_err() {
        println!("skipped: valgrind is not installed");
        return ExitCode::from(77);
    }
    let counts = rows();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/instructions.tsv");
    let known = Kept::parse(&fs::read_to_string(&path).unwrap_or_default());
    let kept = Kept::new(&counts, &known, arguments.contains(&"--measured"));
    let is_good = compare(&counts, &known, &kept.basis);
    if arguments.contains(&"--renew") {
        fs::write(path, kept.text()).unwrap();
        return ExitCode::SUCCESS;
    }
    if is_good { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Handles so many frames of a pair, by its name.
fn feed(name: &str, count: usize) {
    let pair = FRAME_PAIRS.into_iter().find(|pair| pair.name == name).unwrap();
    let (mut gateway, inputs) = pair.prepared();
    for input in inputs.iter().cycle().take(count) {
        take(&mut gateway, *input, NOW);
    }
}

/// The counts in the file.
struct Kept {
    /// What they depend on beside the code.
    basis: String,
    rows: Vec<KeptRow>,
}

/// Instructions for each frame of a row.
struct KeptRow {
    name: String,
    count: u64,
    /// The count when the times in docs/performance.md were measured.
    measured: u64,
}

impl Kept {
    /// Keeps new counts, if `is_measured` as those of a measurement.
    fn new(counts: &[(&str, u64)], before: &Self, is_measured: bool) -> Self {
        let rows = counts.iter().map(|(name, count)| {
            let known = before.row(name).filter(|_| !is_measured);
            let measured = known.map_or(*count, |row| row.measured);
            KeptRow { name: (*name).to_owned(), count: *count, measured }
        });
        Self { basis: basis(), rows: rows.collect() }
    }

    fn row(&self, name: &str) -> Option<&KeptRow> {
        self.rows.iter().find(|row| row.name == name)
    }

    /// Reads a file as [`Self::text`] writes it.
    fn parse(text: &str) -> Self {
        let mut lines = text.lines();
        let basis = lines.next().and_then(|line| line.strip_prefix(BASIS)).unwrap_or_default().to_owned();
        let row = |line: &str| {
            let [name, count, measured] = line.split('\t').collect::<Vec<_>>().try_into().unwrap();
            KeptRow {
                name: str::to_owned(name),
                count: count.parse().unwrap(),
                measured: measured.parse().unwrap(),
            }
        };
        Self { basis, rows: lines.map(row).collect() }
    }

    fn text(&self) -> String {
        let rows = self.rows.iter().map(|row| format!("{}\t{}\t{}\n", row.name, row.count, row.measured));
        format!("{BASIS}{}\n{}", self.basis, rows.collect::<String>())
    }
}

/// Begins the first line of the file.
const BASIS: &str = "row\tinstructions a frame\tat the measurement in docs/performance.md\t";

/// What counts depend on beside the code: compiler, C library, and how valgrind presents the processor.
fn basis() -> String {
    let first_line = |program: &str, argument: &str| {
        let output = Command::new(program).arg(argument).output();
        let text = output.map(|output| String::from_utf8_lossy(&output.stdout).into_owned());
        text.unwrap_or_default().lines().next().unwrap_or_default().to_owned()
    };
    let has_avx2 = fs::read_to_string("/proc/cpuinfo").is_ok_and(|text| text.contains(" avx2"));
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_owned());
    // Clippy's driver compiles as rustc does, but optimizes less before LLVM.
    let compiler = option_env!("RUSTC_WORKSPACE_WRAPPER").unwrap_or("rustc alone");
    format!(
        "{} with {compiler}; {}; {}; {}{}",
        first_line(&rustc, "--version"),
        first_line("ldd", "--version"),
        first_line("valgrind", "--version"),
        std::env::consts::ARCH,
        if has_avx2 { " with AVX2" } else { "" }
    )
}

/// Counts all rows.
fn rows() -> Vec<(&'static str, u64)> {
    let folder = tempfile::tempdir().unwrap();
    let own = std::env::current_exe().unwrap();
    let demo = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/demo.log.gz");
    let logs = RECORDED.map(|frames| {
        let path = folder.path().join(format!("{frames}.log"));
        let mut out = BufWriter::new(File::create(&path).unwrap());
        write_frames(&mut out, &demo, frames).unwrap();
        out.flush().unwrap();
        path
    });
    let count_of = |counts: [u64; 2], frames: [u32; 2]| {
        let [few, many] = counts;
        many.saturating_sub(few) / u64::from(frames[1] - frames[0])
    };
    let pairs = FRAME_PAIRS.map(|pair| {
        let count =
            |frames: u32| instructions(folder.path(), &own, &[FRAMES, pair.name, &frames.to_string()]);
        (pair.name, count_of(FED.map(count), FED))
    });
    let commands = COMMANDS.map(|(name, arguments)| {
        let gateway = Path::new(env!("CARGO_BIN_EXE_signal-gateway"));
        let count = |log: &PathBuf| {
            instructions(folder.path(), gateway, &[arguments, &[log.to_str().unwrap()]].concat())
        };
        (name, count_of(logs.each_ref().map(count), RECORDED))
    });
    pairs.into_iter().chain(commands).collect()
}

/// The number of instructions of a program that may find something.
fn instructions(folder: &Path, program: &Path, arguments: &[&str]) -> u64 {
    let log = folder.join("valgrind.log");
    let mut valgrind = Command::new("valgrind");
    valgrind.args(["--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null"]);
    valgrind.arg(format!("--log-file={}", log.display())).arg(program).args(arguments);
    let status = valgrind.stdout(Stdio::null()).status().unwrap();
    let text = fs::read_to_string(&log).unwrap();
    assert!(matches!(status.code(), Some(0 | 4)), "{} {arguments:?}: {status}\n{text}", program.display());
    let line = text.lines().find_map(|line| line.split_once("refs:")).unwrap();
    line.1.chars().filter(char::is_ascii_digit).collect::<String>().parse().unwrap()
}

/// Prints the counts beside those of the file; false if one is too far away.
fn compare(counts: &[(&str, u64)], known: &Kept, basis: &str) -> bool {
    let is_same_basis = basis == known.basis;
    let tolerance = if is_same_basis { TOLERANCE_PERCENT } else { FOREIGN_TOLERANCE_PERCENT };
    let mut is_good = true;
    for (name, count) in counts {
        let Some(row) = known.row(name) else {
            println!("{name}: {count} instructions a frame; none are kept");
            is_good = false;
            continue;
        };
        let percent = (*count as f64 / row.count as f64 - 1.0) * 100.0;
        let is_near = percent.abs() <= tolerance;
        let judgement = if is_near { String::new() } else { format!("; the limit is {tolerance} %") };
        println!("{name}: {count} instructions a frame, kept are {}: {percent:+.1} %{judgement}", row.count);
        is_good &= is_near;
    }
    if !is_same_basis {
        println!("note: the limit is {tolerance} %, since the kept counts are of another build or machine");
        println!("note: here: {basis}");
        println!("note: kept: {}", known.basis);
    }
    if !is_good {
        println!(
            "remove what has been added, or keep the new counts on purpose: benches/performance --renew"
        );
    }
    is_good
}
