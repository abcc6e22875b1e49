//! Runs a command with limits, and measures what it took.
//!
//! A process has as its largest memory what the one had that it was copied from, until it begins its own
//! program. So a small process, this program again, starts the command, and tells what it took.

use std::fs::File;
use std::io::{self, Read};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use rustix::process::{Resource, Rlimit, setrlimit};

/// What a run took, and how it ended.
#[derive(Debug, Clone)]
pub(crate) struct Taken {
    /// `None` if a signal ended it.
    pub(crate) code: Option<i32>,
    pub(crate) signal: Option<i32>,
    pub(crate) processor: Duration,
    pub(crate) memory_kib: u64,
    /// What it wrote to standard output and into files, bytes.
    pub(crate) written: u64,
    pub(crate) lines: usize,
    /// The beginning of standard error.
    pub(crate) error: String,
}

/// Marks this program as the small process.
pub(crate) const MARK: &str = "--measure";

/// Most that a run may write into a file.
const MAX_FILE: u64 = 2 << 30;
/// Most of standard error that is kept.
const KEPT: u64 = 64 << 10;

/// Runs `program` in a folder; it is killed behind so much time of a processor, or with so much address
/// space.
pub(crate) fn run(program: &Path, words: &[String], folder: &Path, most: Duration) -> io::Result<Taken> {
    let [out, error] = ["stdout", "stderr"].map(|name| folder.join(format!(".{name}")));
    Command::new(std::env::current_exe()?)
        .args([MARK, &most.as_secs().to_string()])
        .arg(program)
        .args(words)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(File::create(&out)?)
        .stderr(File::create(&error)?)
        .status()?;
    let numbers = std::fs::read_to_string(folder.join(".taken"))?;
    let numbers: Vec<i64> = numbers.split(' ').filter_map(|number| number.parse().ok()).collect();
    let [status, micros, memory_kib] = numbers[..] else { return Err(io::ErrorKind::InvalidData.into()) };
    let status = std::process::ExitStatus::from_raw(i32::try_from(status).unwrap_or(-1));
    let mut text = Vec::new();
    File::open(&error)?.take(KEPT).read_to_end(&mut text)?;
    let lines = memchr::memchr_iter(b'\n', &std::fs::read(&out)?).count();
    let written =
        size_of(&folder.join("written"))? + std::fs::metadata(&out)?.len() + std::fs::metadata(&error)?.len();
    Ok(Taken {
        code: status.code(),
        signal: status.signal(),
        processor: Duration::from_micros(u64::try_from(micros).unwrap_or(0)),
        memory_kib: u64::try_from(memory_kib).unwrap_or(0),
        written,
        lines,
        error: String::from_utf8_lossy(&text).into_owned(),
    })
}

fn size_of(folder: &Path) -> io::Result<u64> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Ok(0) };
    let mut size = 0;
    for entry in entries {
        size += entry?.metadata()?.len();
    }
    Ok(size)
}

/// The small process: `arguments` are the seconds, the program and its words.
pub(crate) fn measure(arguments: &[String]) -> io::Result<()> {
    let [seconds, program, words @ ..] = arguments else { return Err(io::ErrorKind::InvalidInput.into()) };
    let seconds: u64 = seconds.parse().map_err(|_| io::ErrorKind::InvalidInput)?;
    let limit = |most: u64| Rlimit { current: Some(most), maximum: Some(most) };
    setrlimit(Resource::Cpu, limit(seconds))?;
    setrlimit(Resource::As, limit(6 << 30))?;
    setrlimit(Resource::Fsize, limit(MAX_FILE))?;
    setrlimit(Resource::Core, limit(0))?;
    let status = Command::new(program).args(words).status()?;
    let taken = children();
    let time = |part: libc::timeval| part.tv_sec * 1_000_000 + part.tv_usec;
    let micros = time(taken.ru_utime) + time(taken.ru_stime);
    std::fs::write(".taken", format!("{} {micros} {}", status.into_raw(), taken.ru_maxrss))
}

/// What the children of this process have taken that have ended.
#[allow(unsafe_code)]
fn children() -> libc::rusage {
    let mut taken = std::mem::MaybeUninit::zeroed();
    // SAFETY: the place is as large as what is written, and all zeros are a value of it.
    unsafe {
        libc::getrusage(libc::RUSAGE_CHILDREN, taken.as_mut_ptr());
        taken.assume_init()
    }
}
