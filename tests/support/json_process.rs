//! A process of a test that takes commands as lines on standard input, and answers in lines of JSON.

use std::io::{BufRead as _, BufReader, Read, Write as _};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::{Arc, Condvar, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::waiting::{DEADLINE, Pace, let_pass, wait_for};

/// A line, and when it was read.
pub(crate) type Line = (Instant, Value);

#[derive(Default)]
struct Output {
    lines: Vec<Line>,
    /// The number of lines that [`JsonProcess::next`] has passed.
    passed: usize,
    ended: bool,
}

type SharedOutput = Arc<(Mutex<Output>, Condvar)>;

/// A running process, and every line it has written. It ends when it is dropped.
pub(crate) struct JsonProcess {
    child: Mutex<Child>,
    input: Option<ChildStdin>,
    output: SharedOutput,
    name: String,
    /// False for one that runs on when its standard input is closed.
    ends_by_itself: bool,
}

/// The number of lines there were at some moment.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mark(usize);

impl Mark {
    /// Before the first line.
    pub(crate) const START: Self = Self(0);
}

impl JsonProcess {
    /// Starts it; `name` is for messages. Lines that are not JSON (a test harness writes some) are dropped. A
    /// standard error that is piped is read as well: each of its lines becomes one with the event `log` and
    /// its `text`.
    pub(crate) fn start(name: &str, command: &mut Command) -> Self {
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().unwrap_or_else(|error| panic!("{name} does not start: {error}"));
        let output = SharedOutput::default();
        let (stdout, shared) = (child.stdout.take().unwrap(), Arc::clone(&output));
        thread::spawn(move || {
            read_lines(stdout, &shared, |line| serde_json::from_str(&line).ok());
            shared.0.lock().unwrap().ended = true;
            shared.1.notify_all();
        });
        // Only where the caller wants it among the lines.
        if let Some(stderr) = child.stderr.take() {
            let shared = Arc::clone(&output);
            thread::spawn(move || {
                read_lines(stderr, &shared, |line| Some(json!({"event": "log", "text": line})));
            });
        }
        let input = child.stdin.take();
        Self { input, child: Mutex::new(child), output, name: name.to_owned(), ends_by_itself: true }
    }

    /// The same process, which is killed in the end, since it runs on when its standard input is closed.
    pub(crate) fn killed_in_the_end(mut self) -> Self {
        self.ends_by_itself = false;
        self
    }

    /// Sends it a line.
    pub(crate) fn send(&self, line: &str) {
        // In one piece.
        self.input.as_ref().unwrap().write_all(format!("{line}\n").as_bytes()).unwrap();
    }

    /// The id of the process.
    pub(crate) fn id(&self) -> u32 {
        self.child.lock().unwrap().id()
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
    /// If none comes within [`DEADLINE`], or the process ends before.
    pub(crate) fn find<T>(&self, mark: Mark, what: &str, find: impl FnMut(&Line) -> Option<T>) -> T {
        self.find_within(DEADLINE, mark, find).unwrap_or_else(|| panic!("{}", self.missed(what)))
    }

    /// The message of a test that has waited for something that did not come.
    fn missed(&self, what: &str) -> String {
        let output = self.output.0.lock().unwrap();
        let last: Vec<_> = output.lines.iter().rev().take(8).map(|(_, line)| line.to_string()).collect();
        let why = if output.ended { self.end_text() } else { "too late".to_owned() };
        let last = last.join("\n");
        format!("{}: waited for {what}: {why}; its last lines, newest first:\n{last}", self.name)
    }

    /// That a process without output has ended, and how.
    fn end_text(&self) -> String {
        let ended = self.child.lock().ok().and_then(|mut child| child.try_wait().ok().flatten());
        ended.map_or_else(|| "its output has ended".to_owned(), |status| format!("it has ended: {status}"))
    }

    /// Likewise; `None` if there is none in that time, so that the caller tries once more.
    pub(crate) fn find_within<T>(
        &self,
        time: Duration,
        Mark(mark): Mark,
        mut find: impl FnMut(&Line) -> Option<T>,
    ) -> Option<T> {
        let (mut next, mut found) = (mark, None);
        let lacks = |output: &mut Output| {
            found = output.lines.get(next..).unwrap_or_default().iter().find_map(&mut find);
            next = next.max(output.lines.len());
            found.is_none() && !output.ended
        };
        let guard = self.output.0.lock().unwrap();
        drop(self.output.1.wait_timeout_while(guard, time, lacks).unwrap());
        found
    }

    /// Waits for the first line after `mark` that `is_it`.
    pub(crate) fn wait_for(&self, mark: Mark, what: &str, is_it: impl Fn(&Value) -> bool) -> Line {
        self.find(mark, what, |line| is_it(&line.1).then(|| line.clone()))
    }

    /// Likewise, and does something before and then every `period`, such as sending again what a sender
    /// repeats.
    pub(crate) fn wait_while_doing(
        &self,
        mark: Mark,
        what: &str,
        period: Duration,
        mut act: impl FnMut(),
        is_it: impl Fn(&Value) -> bool,
    ) -> Line {
        let mut pace = Pace::every(period);
        wait_for(format!("{what} of {}", self.name), || {
            act();
            pace.wait();
            self.lines(mark).into_iter().find(|(_, line)| is_it(line))
        })
    }

    /// Waits for the first line that `is_it` after the one that the last call returned.
    ///
    /// # Panics
    /// As [`find`](Self::find).
    pub(crate) fn next(&self, what: &str, is_it: impl Fn(&Value) -> bool) -> Value {
        self.pass(|mark, find| Some(self.find(mark, what, find)), is_it).unwrap()
    }

    /// Likewise; `None` if there is none in that time, so that the caller tries once more.
    pub(crate) fn next_within(&self, time: Duration, is_it: impl Fn(&Value) -> bool) -> Option<Value> {
        self.pass(|mark, find| self.find_within(time, mark, find), is_it)
    }

    /// Looks for a line after those that were passed, and passes it.
    fn pass(
        &self,
        look: impl FnOnce(Mark, &mut dyn FnMut(&Line) -> Option<Value>) -> Option<Value>,
        is_it: impl Fn(&Value) -> bool,
    ) -> Option<Value> {
        let passed = self.output.0.lock().unwrap().passed;
        let mut position = passed;
        let found = look(Mark(passed), &mut |(_, line)| {
            position += 1;
            is_it(line).then(|| line.clone())
        })?;
        self.output.0.lock().unwrap().passed = position;
        Some(found)
    }

    /// The lines that come in that time after those that [`next`](Self::next) returned, which passes these
    /// lines too.
    ///
    /// # Panics
    /// If the process ends meanwhile.
    pub(crate) fn next_during(&self, time: Duration) -> Vec<Value> {
        let_pass(time, "for lines that must not come, or that the caller does not need");
        let mut output = self.output.0.lock().unwrap();
        assert!(!output.ended, "{} has ended", self.name);
        let end = output.lines.len();
        let passed = std::mem::replace(&mut output.passed, end);
        output.lines.get(passed..).unwrap_or_default().iter().map(|(_, line)| line.clone()).collect()
    }

    /// Kills the process without a chance to leave orderly.
    pub(crate) fn kill(mut self) {
        self.child.get_mut().unwrap().kill().unwrap();
    }
}

impl Drop for JsonProcess {
    fn drop(&mut self) {
        drop(self.input.take());
        // The end of a process is the end of its output. One that is to be seen to leave must not be killed
        // too soon.
        if self.ends_by_itself && !thread::panicking() {
            let output = self.output.0.lock().unwrap();
            drop(self.output.1.wait_timeout_while(output, DEADLINE, |output| !output.ended).unwrap());
        }
        let is_ended = self.output.0.lock().is_ok_and(|output| output.ended);
        let Ok(child) = self.child.get_mut() else { return };
        let _ended = (if is_ended { Ok(()) } else { child.kill() }, child.wait());
    }
}

/// Keeps each line that `value` makes something of, until the end.
fn read_lines(from: impl Read, output: &SharedOutput, value: impl Fn(String) -> Option<Value>) {
    for line in BufReader::new(from).lines().map_while(Result::ok) {
        if let Some(value) = value(line) {
            output.0.lock().unwrap().lines.push((Instant::now(), value));
            output.1.notify_all();
        }
    }
}
