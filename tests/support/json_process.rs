//! A process of a test that takes commands as lines on standard input, and answers in lines of JSON.

use std::io::{BufRead as _, BufReader, Write as _};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::{Arc, Condvar, Mutex};
use std::time::{Duration, Instant};

use serde_json::Value;

/// Longest wait of a test for an expected event: longer than the longest lease of a DDS participant.
pub(crate) const PATIENCE: Duration = Duration::from_secs(90);

/// Time in which a process must end by itself once its standard input is closed.
const GRACE: Duration = Duration::from_secs(5);

/// A line, and when it was read.
pub(crate) type Line = (Instant, Value);

#[derive(Default)]
struct Output {
    lines: Vec<Line>,
    /// The number of lines that [`JsonProcess::next`] has passed.
    passed: usize,
    ended: bool,
}

/// A running process, and every line it has written. It ends when it is dropped.
pub(crate) struct JsonProcess {
    child: Child,
    input: Option<ChildStdin>,
    output: Arc<(Mutex<Output>, Condvar)>,
    name: String,
}

/// The number of lines there were at some moment.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mark(usize);

impl Mark {
    /// Before the first line.
    pub(crate) const START: Self = Self(0);
}

impl JsonProcess {
    /// Starts it; `name` is for messages. Lines that are not JSON (a test harness writes some) are dropped.
    pub(crate) fn start(name: &str, command: &mut Command) -> Self {
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().unwrap_or_else(|error| panic!("{name} does not start: {error}"));
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let output = Arc::<(Mutex<Output>, Condvar)>::default();
        let writer = Arc::clone(&output);
        std::thread::spawn(move || {
            let values = lines.map_while(Result::ok).filter_map(|line| serde_json::from_str(&line).ok());
            for value in values {
                writer.0.lock().unwrap().lines.push((Instant::now(), value));
                writer.1.notify_all();
            }
            writer.0.lock().unwrap().ended = true;
            writer.1.notify_all();
        });
        Self { input: child.stdin.take(), child, output, name: name.to_owned() }
    }

    /// Sends it a line.
    pub(crate) fn send(&self, line: &str) {
        // In one piece.
        self.input.as_ref().unwrap().write_all(format!("{line}\n").as_bytes()).unwrap();
    }

    /// The id of the process.
    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    /// The present end of its output, to look from there on.
    pub(crate) fn mark(&self) -> Mark {
        Mark(self.output.0.lock().unwrap().lines.len())
    }

    /// The lines after `mark`.
    pub(crate) fn lines(&self, Mark(mark): Mark) -> Vec<Line> {
        self.output.0.lock().unwrap().lines.get(mark..).unwrap_or_default().to_vec()
    }

    /// Waits for the first line after `mark` that `find` makes something of.
    ///
    /// # Panics
    /// If none comes within [`PATIENCE`], or the process ends before.
    pub(crate) fn find<T>(
        &self,
        Mark(mark): Mark,
        what: &str,
        mut find: impl FnMut(&Line) -> Option<T>,
    ) -> T {
        let (mut next, mut found) = (mark, None);
        let lacks = |output: &mut Output| {
            found = output.lines.get(next..).unwrap_or_default().iter().find_map(&mut find);
            next = next.max(output.lines.len());
            found.is_none() && !output.ended
        };
        let guard = self.output.0.lock().unwrap();
        let (output, _) = self.output.1.wait_timeout_while(guard, PATIENCE, lacks).unwrap();
        found.unwrap_or_else(|| {
            let last: Vec<_> = output.lines.iter().rev().take(8).map(|(_, line)| line.to_string()).collect();
            let why = if output.ended { "it has ended" } else { "too late" };
            panic!(
                "{}: waited for {what}: {why}; its last lines, newest first:\n{}",
                self.name,
                last.join("\n")
            )
        })
    }

    /// Waits for the first line after `mark` that `is_it`.
    pub(crate) fn wait_for(&self, mark: Mark, what: &str, is_it: impl Fn(&Value) -> bool) -> Line {
        self.find(mark, what, |line| is_it(&line.1).then(|| line.clone()))
    }

    /// Waits for the first line that `is_it` after the one that the last call returned.
    ///
    /// # Panics
    /// As [`find`](Self::find).
    pub(crate) fn next(&self, what: &str, is_it: impl Fn(&Value) -> bool) -> Value {
        let passed = self.output.0.lock().unwrap().passed;
        let mut position = passed;
        let found = self.find(Mark(passed), what, |(_, line)| {
            position += 1;
            is_it(line).then(|| line.clone())
        });
        self.output.0.lock().unwrap().passed = position;
        found
    }

    /// The lines that come in that time after those that [`next`](Self::next) returned, which passes these lines too.
    ///
    /// # Panics
    /// If the process ends meanwhile.
    pub(crate) fn next_during(&self, time: Duration) -> Vec<Value> {
        std::thread::sleep(time);
        let mut output = self.output.0.lock().unwrap();
        assert!(!output.ended, "{} has ended", self.name);
        let end = output.lines.len();
        let passed = std::mem::replace(&mut output.passed, end);
        output.lines.get(passed..).unwrap_or_default().iter().map(|(_, line)| line.clone()).collect()
    }

    /// Kills the process without a chance to leave orderly.
    pub(crate) fn kill(mut self) {
        self.child.kill().unwrap();
    }
}

impl Drop for JsonProcess {
    fn drop(&mut self) {
        drop(self.input.take());
        let closed = Instant::now();
        while closed.elapsed() < GRACE {
            if !matches!(self.child.try_wait(), Ok(None)) {
                return;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        let _ended = (self.child.kill(), self.child.wait());
    }
}
