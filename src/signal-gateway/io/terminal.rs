//! The terminal of this process while a view is up: raw keys, the alternate screen, and standard error, whose
//! lines go into the view.
//!
//! Drawings go through an [`OutputQueue`]: for a slow terminal, drawings are skipped, and nothing is delayed.

use std::fs::File;
use std::io::{self, BufRead as _, BufReader, IsTerminal as _, Read as _, Write};
use std::os::fd::OwnedFd;
use std::panic;
use std::sync::Mutex;
use std::thread;
use std::time::{Duration, Instant};

use ratatui::backend::CrosstermBackend;
use ratatui::crossterm::cursor::{Hide, Show};
use ratatui::crossterm::event::{self, Event, KeyEvent, KeyEventKind};
use ratatui::crossterm::queue;
use ratatui::crossterm::terminal::{
    EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode,
};
use ratatui::{Frame, Terminal};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Signal, getpgrp, getpid, kill_process};
use rustix::stdio::dup2_stderr;
use rustix::termios::tcgetpgrp;

use super::lock::lock;
use super::output_queue::OutputQueue;
use super::process_log;

/// Maximum wait for a slow terminal at the end.
const PATIENCE: Duration = Duration::from_millis(300);
/// Maximum length of a line of standard error, bytes.
const MAX_LINE: u64 = 16 * 1024;

/// The terminal, while a view uses it.
static TAKEN: Mutex<Option<TakenTerminal>> = Mutex::new(None);

struct TakenTerminal {
    queue: OutputQueue,
    /// Original standard error; `None` if it is not a terminal and was therefore not replaced.
    stderr: Option<OwnedFd>,
}

/// Returns true if a view can be shown: standard input and output are a terminal that supports control
/// sequences, and this process is in its foreground.
pub fn is_usable() -> bool {
    let is_dumb = std::env::var_os("TERM").is_none_or(|name| name.is_empty() || name == "dumb");
    let is_foreground = || tcgetpgrp(io::stdout()).is_ok_and(|group| group == getpgrp());
    !is_dumb && io::stdin().is_terminal() && io::stdout().is_terminal() && is_foreground()
}

/// Requests an orderly stop of this process, as Ctrl-C does.
pub fn request_stop() {
    // Our own process exists and may be signalled.
    let _ = kill_process(getpid(), Signal::INT);
}

/// Restores the terminal if a view uses it. A panic does the same.
pub fn restore() {
    let Some(TakenTerminal { queue, stderr }) = lock(&TAKEN).take() else { return };
    let _ = disable_raw_mode();
    queue.push(&sequence(|bytes| queue!(bytes, LeaveAlternateScreen, Show)));
    queue.flush(PATIENCE);
    if let Some(stderr) = stderr {
        let _ = dup2_stderr(&stderr);
        process_log::redirect(&stderr);
    }
}

/// The terminal, taken until this is dropped.
pub struct Screen {
    terminal: Terminal<CrosstermBackend<ScreenBuffer>>,
    queue: OutputQueue,
    lost: u64,
}

impl Screen {
    /// Takes the terminal. If standard error is a terminal too, `line` receives each line of it, on another
    /// thread. Fails if the terminal cannot be set, a file cannot be duplicated, or a thread cannot be
    /// started.
    pub fn take(line: impl Fn(String) + Send + 'static) -> io::Result<Self> {
        let queue = OutputQueue::start("screen", &io::stdout())?;
        let stderr = if io::stderr().is_terminal() { Some(capture(line)?) } else { None };
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            restore();
            before(panic);
        }));
        enable_raw_mode()?;
        *lock(&TAKEN) = Some(TakenTerminal { queue: queue.clone(), stderr });
        queue.push(&sequence(|bytes| queue!(bytes, EnterAlternateScreen, Hide)));
        let terminal = Terminal::new(CrosstermBackend::new(ScreenBuffer::default()))?;
        Ok(Self { terminal, queue, lost: 0 })
    }

    /// Draws, unless the terminal has not accepted the last drawing yet. Fails if the size of the terminal is
    /// unknown.
    pub fn draw(&mut self, draw: impl FnOnce(&mut Frame<'_>)) -> io::Result<()> {
        if !self.queue.flush(Duration::ZERO) {
            return Ok(());
        }
        let lost = self.queue.losses().lines;
        if self.lost != lost {
            self.lost = lost;
            // Part of the screen is missing, so everything is drawn again.
            self.terminal.resize(self.terminal.size()?.into())?;
        }
        self.terminal.draw(draw)?;
        Ok(())
    }

    /// Waits for the next key until `end`; returns `None` if there is none.
    pub fn key(&self, end: Instant) -> Option<KeyEvent> {
        loop {
            // Keys that were read already come first. Reading from a terminal that is gone would never end.
            while wait_for_input(Duration::ZERO).is_ok() && event::poll(Duration::ZERO).unwrap_or(false) {
                match event::read() {
                    Ok(Event::Key(key)) if key.kind == KeyEventKind::Press => return Some(key),
                    Ok(_) | Err(_) => {}
                }
            }
            let left = end.saturating_duration_since(Instant::now());
            match wait_for_input(left) {
                Ok(true) => {}
                Ok(false) => return None,
                Err(Gone) => {
                    thread::sleep(left);
                    return None;
                }
            }
        }
    }
}

/// The terminal is gone; SIGHUP ends the process.
struct Gone;

/// Waits for input at most for `patience`; returns true if there is any.
fn wait_for_input(patience: Duration) -> Result<bool, Gone> {
    let input = io::stdin();
    let mut waited = [PollFd::new(&input, PollFlags::IN)];
    let patience = Timespec::try_from(patience).map_err(|_| Gone)?;
    // A signal, such as SIGWINCH, is not input.
    let _ = poll(&mut waited, Some(&patience));
    let found = waited[0].revents();
    if found.intersects(PollFlags::HUP | PollFlags::ERR | PollFlags::NVAL) {
        return Err(Gone);
    }
    Ok(found.contains(PollFlags::IN))
}

impl Drop for Screen {
    fn drop(&mut self) {
        restore();
    }
}

/// Replaces standard error by a pipe and passes its lines to `line` while the terminal is taken, and later to
/// the original standard error, which is returned.
fn capture(line: impl Fn(String) + Send + 'static) -> io::Result<OwnedFd> {
    let (reader, writer) = io::pipe()?;
    let stderr = rustix::stdio::stderr().try_clone_to_owned()?;
    let mut real = File::from(stderr.try_clone()?);
    thread::Builder::new().name("stderr".to_owned()).spawn(move || {
        let mut reader = BufReader::new(reader);
        let mut bytes = Vec::new();
        while reader.by_ref().take(MAX_LINE).read_until(b'\n', &mut bytes).is_ok_and(|length| length > 0) {
            if lock(&TAKEN).is_some() {
                line(String::from_utf8_lossy(&bytes).trim_end().to_owned());
            } else {
                let _ = real.write_all(&bytes);
            }
            bytes.clear();
        }
    })?;
    dup2_stderr(&writer)?;
    process_log::redirect(&writer);
    Ok(stderr)
}

fn sequence(write: impl FnOnce(&mut Vec<u8>) -> io::Result<()>) -> Vec<u8> {
    let mut bytes = Vec::new();
    // Writing to a Vec cannot fail.
    let _ = write(&mut bytes);
    bytes
}

/// A drawing that is collected for the terminal.
#[derive(Default)]
struct ScreenBuffer(Vec<u8>);

impl Write for ScreenBuffer {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    /// Passes the whole drawing to the terminal, if a view still uses it.
    fn flush(&mut self) -> io::Result<()> {
        let bytes = std::mem::take(&mut self.0);
        if let Some(taken) = lock(&TAKEN).as_ref().filter(|_| !bytes.is_empty()) {
            taken.queue.push(&bytes);
        }
        Ok(())
    }
}
