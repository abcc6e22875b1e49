//! The terminal of this process while a view is up: raw keys, the alternate screen, and standard error, whose lines go into
//! the view.
//!
//! What is drawn goes through an [`OutputQueue`]: a terminal that does not take it is not drawn to, and holds nobody up.

use std::fs::File;
use std::io::{self, BufRead as _, BufReader, IsTerminal as _, Read as _, Write};
use std::os::fd::OwnedFd;
use std::panic;
use std::sync::{Mutex, MutexGuard, PoisonError};
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

use super::output_queue::OutputQueue;
use super::process_log;

/// Longest time that the end waits for a terminal that does not take what is written.
const PATIENCE: Duration = Duration::from_millis(300);
/// Longest line of standard error, in bytes.
const MAX_LINE: u64 = 16 * 1024;

/// The terminal while it is taken.
static TAKEN: Mutex<Option<Taken>> = Mutex::new(None);

struct Taken {
    queue: OutputQueue,
    /// Standard error as it was; `None` where it is not a terminal, and left alone.
    stderr: Option<OwnedFd>,
}

fn taken() -> MutexGuard<'static, Option<Taken>> {
    TAKEN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// True if a view can be shown: standard input and output are a terminal that knows control sequences, and this process is
/// in its foreground.
pub fn is_usable() -> bool {
    let is_dumb = std::env::var_os("TERM").is_none_or(|name| name.is_empty() || name == "dumb");
    let is_foreground = || tcgetpgrp(io::stdout()).is_ok_and(|group| group == getpgrp());
    !is_dumb && io::stdin().is_terminal() && io::stdout().is_terminal() && is_foreground()
}

/// Requests an orderly stop of this process, as Ctrl-C does.
pub fn request_stop() {
    // Our own process is there, and may be signalled.
    let _ = kill_process(getpid(), Signal::INT);
}

/// Gives the terminal back as it was; nothing happens when it is not taken. A panic does it by itself.
pub fn restore() {
    let Some(Taken { queue, stderr }) = taken().take() else { return };
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
    terminal: Terminal<CrosstermBackend<Drawing>>,
    queue: OutputQueue,
    lost: u64,
}

impl Screen {
    /// Takes the terminal. `line` gets each line of standard error if that is a terminal as well, from a thread of its own.
    ///
    /// # Errors
    /// A terminal that cannot be set, a file that cannot be duplicated, or a thread that cannot be started.
    pub fn take(line: impl Fn(String) + Send + 'static) -> io::Result<Self> {
        let queue = OutputQueue::start("screen", &io::stdout())?;
        let stderr = if io::stderr().is_terminal() { Some(capture(line)?) } else { None };
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            restore();
            before(panic);
        }));
        enable_raw_mode()?;
        *taken() = Some(Taken { queue: queue.clone(), stderr });
        queue.push(&sequence(|bytes| queue!(bytes, EnterAlternateScreen, Hide)));
        let terminal = Terminal::new(CrosstermBackend::new(Drawing::default()))?;
        Ok(Self { terminal, queue, lost: 0 })
    }

    /// Draws, unless the terminal has not taken the last drawing yet.
    ///
    /// # Errors
    /// A terminal whose size is not known.
    pub fn draw(&mut self, draw: impl FnOnce(&mut Frame<'_>)) -> io::Result<()> {
        if !self.queue.flush(Duration::ZERO) {
            return Ok(());
        }
        let lost = self.queue.losses().lines;
        if self.lost != lost {
            self.lost = lost;
            // Something is missing on the screen: all of it is drawn again.
            self.terminal.resize(self.terminal.size()?.into())?;
        }
        self.terminal.draw(draw)?;
        Ok(())
    }

    /// The next key that is pressed until `end`; `None` without one.
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

/// Waits until there is input, at most for `patience`; true if there is some.
fn wait_for_input(patience: Duration) -> Result<bool, Gone> {
    let input = io::stdin();
    let mut waited = [PollFd::new(&input, PollFlags::IN)];
    let patience = Timespec::try_from(patience).map_err(|_| Gone)?;
    // A signal, such as that of a new size, is not input.
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

/// Puts a pipe in the place of standard error, and hands on its lines while the terminal is taken; later ones go to the
/// standard error that was there, which is given back.
fn capture(line: impl Fn(String) + Send + 'static) -> io::Result<OwnedFd> {
    let (reader, writer) = io::pipe()?;
    let stderr = rustix::stdio::stderr().try_clone_to_owned()?;
    let mut real = File::from(stderr.try_clone()?);
    thread::Builder::new().name("stderr".to_owned()).spawn(move || {
        let mut reader = BufReader::new(reader);
        let mut bytes = Vec::new();
        while reader.by_ref().take(MAX_LINE).read_until(b'\n', &mut bytes).is_ok_and(|length| length > 0) {
            if taken().is_some() {
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

/// The bytes of control sequences.
fn sequence(write: impl FnOnce(&mut Vec<u8>) -> io::Result<()>) -> Vec<u8> {
    let mut bytes = Vec::new();
    // Writing to a Vec cannot fail.
    let _ = write(&mut bytes);
    bytes
}

/// One drawing on its way to the terminal.
#[derive(Default)]
struct Drawing(Vec<u8>);

impl Write for Drawing {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    /// Hands on what was drawn as a whole. After the terminal was given back nothing is written any more.
    fn flush(&mut self) -> io::Result<()> {
        let bytes = std::mem::take(&mut self.0);
        if let Some(taken) = taken().as_ref().filter(|_| !bytes.is_empty()) {
            taken.queue.push(&bytes);
        }
        Ok(())
    }
}
