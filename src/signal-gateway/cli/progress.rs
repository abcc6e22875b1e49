//! Shows the progress of work that takes longer than a second, on a terminal.

use std::io::{self, IsTerminal, Read};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressBarIter, ProgressDrawTarget, ProgressStyle};

use super::messages::options;

const PATIENCE: Duration = Duration::from_secs(1);
const TICK: Duration = Duration::from_millis(100);

/// A bar on standard error that appears after a second and disappears when it is dropped.
pub(super) struct ProgressDisplay {
    bar: ProgressBar,
    /// Dropping the sender wakes the thread that shows the bar.
    waiting: Option<(Sender<()>, JoinHandle<()>)>,
}

impl ProgressDisplay {
    /// Shows `text` with the progress; `length` is in bytes or ms, if known.
    pub(super) fn new(text: impl Into<String>, length: Option<u64>, form: &str) -> Self {
        let bar =
            ProgressBar::with_draw_target(length, ProgressDrawTarget::hidden()).with_message(text.into());
        if let Ok(style) = ProgressStyle::with_template(form) {
            bar.set_style(style.progress_chars("=> "));
        }
        if options().quiet || !io::stderr().is_terminal() {
            return Self { bar, waiting: None };
        }
        let (sender, receiver) = channel();
        let shown = bar.clone();
        let show = move || {
            if receiver.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
                shown.set_draw_target(ProgressDrawTarget::stderr());
                shown.enable_steady_tick(TICK);
            }
        };
        let thread = std::thread::spawn(show);
        Self { bar, waiting: Some((sender, thread)) }
    }

    /// Counts what is done of an unknown number, unless standard output is the same terminal, with lines of
    /// its own.
    pub(super) fn several(noun: &'static str) -> Option<Self> {
        let form = "{spinner} {pos} {msg}, {elapsed}";
        (!io::stdout().is_terminal()).then(|| Self::new(noun, None, form))
    }

    pub(super) fn spinner(text: impl Into<String>) -> Self {
        Self::new(text, None, "{spinner} {msg}, {elapsed}")
    }

    /// Returns a reader of `source` that shows its progress; `length` is in bytes, if known.
    pub(super) fn reading<R: Read>(source: R, length: Option<u64>, text: String) -> impl Read + use<R> {
        let form = match length {
            Some(_) => "{spinner} {msg} [{wide_bar}] {percent:>3} %, {eta} left",
            None => "{spinner} {msg}, {decimal_bytes}, {elapsed}",
        };
        let progress = Self::new(text, length, form);
        ProgressReader { source: progress.bar.wrap_read(source), _progress: progress }
    }

    pub(super) fn set(&self, position: u64) {
        self.bar.set_position(position);
    }
}

impl Drop for ProgressDisplay {
    fn drop(&mut self) {
        if let Some((sender, thread)) = self.waiting.take() {
            drop(sender);
            // A panic of the thread only means that the bar is missing.
            drop(thread.join());
        }
        self.bar.finish_and_clear();
    }
}

struct ProgressReader<R> {
    source: ProgressBarIter<R>,
    _progress: ProgressDisplay,
}

impl<R: Read> Read for ProgressReader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.source.read(buffer)
    }
}
