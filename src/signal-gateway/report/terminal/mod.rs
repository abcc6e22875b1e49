//! The live view on a terminal: a common view of the state for all long-running commands.
//!
//! The view has its own thread, which draws ten times a second. It is fed through a bounded queue whose
//! writers never wait for room, so a slow or blocked terminal does not affect them.

mod car;
pub mod draw;
mod draw_messages;
mod ink;
pub mod message_table;
mod parts;
mod reports;
pub mod vehicle;
pub mod view_model;

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use anstream::adapter::strip_str;

use self::draw::draw;
use self::message_table::MessageRow;
use self::view_model::{KeyRequest, Keys, Model};
use super::text::escaped;
use crate::io::terminal::{Screen, request_stop, restore};
use crate::report::gateway_view::GatewayView;
use crate::report::text::clock_text;
use gateway_base::diagnostics::Level;
use gateway_base::time::MonoTime;

const FRAME_TIME: Duration = Duration::from_millis(100);
/// Maximum time to wait for the thread at the end.
const PATIENCE: Duration = Duration::from_millis(500);
/// Maximum number of messages that wait for the thread.
const MAX_WAITING: usize = 1024;

/// Receives a line for the simulated vehicle.
pub type DriverLine = Box<dyn Fn(&str) + Send>;

/// A change of what is shown, which the thread of the view makes.
type Change = Box<dyn FnOnce(&mut Model) + Send>;

/// A running view, which ends when this is dropped.
pub struct TerminalView {
    changes: SyncSender<Change>,
    is_over: Arc<AtomicBool>,
    thread: JoinHandle<()>,
    next_picture: Instant,
}

impl TerminalView {
    /// Takes the terminal and shows `model`; `driver` receives the requests of the driver's keys.
    pub fn start(model: Model, driver: Option<DriverLine>) -> io::Result<Self> {
        let (changes, received) = sync_channel::<Change>(MAX_WAITING);
        let lines = changes.clone();
        let screen = Screen::take(move |line| {
            drop(lines.try_send(Box::new(move |model| add_log_line(model, &line))));
        })?;
        let keys = if driver.is_some() { Keys::Driver } else { Keys::View };
        let model = Model { keys, ..model };
        let is_over = Arc::<AtomicBool>::default();
        let ended = Arc::clone(&is_over);
        let show = move || run(screen, model, (&received, &ended), driver.as_deref());
        let thread = thread::Builder::new().name("view".to_owned()).spawn(show)?;
        Ok(Self { changes, is_over, thread, next_picture: Instant::now() })
    }

    /// Adds a line to the log, with this time since the start.
    pub fn line(&self, level: Level, at: MonoTime, text: &str) {
        let text = line_text(at.since(MonoTime::ZERO), text);
        self.change(move |model| {
            let text = escaped(&strip_str(&text).to_string()).into_owned();
            model.add_line(Some(level), text);
        });
    }

    /// Adds lines of an earlier process to the log, each with its level.
    pub fn earlier(&self, lines: Vec<(Level, String)>) {
        self.change(|model| lines.into_iter().for_each(|(level, text)| model.add_line(Some(level), text)));
    }

    /// Shows another caption from now on.
    pub fn caption(&self, text: &str) {
        let text = text.to_owned();
        self.change(|model| model.caption = text);
    }

    /// Returns true if a new picture would be drawn.
    pub fn is_due(&self) -> bool {
        Instant::now() >= self.next_picture
    }

    /// Shows the state of a gateway at this time since its start. The thread of the view calls `make`.
    pub fn show(&mut self, at: MonoTime, make: impl FnOnce() -> GatewayView + Send + 'static) {
        self.next_picture = Instant::now() + FRAME_TIME;
        self.change(move |model| {
            model.at = Some(at.since(MonoTime::ZERO));
            model.show(make());
        });
    }

    /// Shows another state from now on.
    pub fn picture(&mut self, picture: GatewayView) {
        self.next_picture = Instant::now() + FRAME_TIME;
        self.change(|model| model.show(picture));
    }

    /// Shows the messages on the buses.
    pub fn messages(&mut self, rows: Vec<MessageRow>) {
        self.change(|model| model.show_messages(rows));
    }

    /// Sends a change. A full queue loses it; the next picture makes up for that, except for log lines.
    fn change(&self, change: impl FnOnce(&mut Model) + Send + 'static) {
        let _ = self.changes.try_send(Box::new(change));
    }
}

impl Drop for TerminalView {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Release);
        let end = Instant::now() + PATIENCE;
        while !self.thread.is_finished() && Instant::now() < end {
            thread::sleep(Duration::from_millis(5));
        }
        // Independent of the thread.
        restore();
    }
}

fn run(
    mut screen: Screen,
    mut model: Model,
    (changes, is_over): (&Receiver<Change>, &AtomicBool),
    driver: Option<&(dyn Fn(&str) + Send)>,
) {
    let started = Instant::now();
    while !is_over.load(Ordering::Acquire) {
        changes.try_iter().take(MAX_WAITING).for_each(|change| change(&mut model));
        let now = Instant::now();
        model.elapsed = now - started;
        // A terminal that cannot be drawn to is gone, or available again for the next drawing.
        let _ = screen.draw(|frame| draw(frame, &model));
        while let Some(key) = screen.key(now + FRAME_TIME) {
            match model.press(key) {
                Some(KeyRequest::Quit) => request_stop(),
                Some(KeyRequest::Driver(line)) => driver.iter().for_each(|driver| driver(line)),
                None => {}
            }
        }
    }
}

/// Adds a line of the process's log, which comes without a time.
fn add_log_line(model: &mut Model, line: &str) {
    let line = strip_str(line).to_string();
    model.add_line(level_in(&line), escaped(&line_text(model.time(), &line)).into_owned());
}

/// Formats a line of the log with its time, to the millisecond.
pub fn line_text(since_start: Duration, text: &str) -> String {
    format!("{:>8}.{:03} {text}", clock_text(since_start), since_start.subsec_millis())
}

/// Returns the level at the beginning of a log line, or after its time.
fn level_in(line: &str) -> Option<Level> {
    let words = || line.split_whitespace().take(2);
    let has = |names: [&str; 2]| words().any(|word| names.contains(&word));
    if has(["ERROR", "error:"]) {
        Some(Level::Error)
    } else if has(["WARN", "warning:"]) {
        Some(Level::Warn)
    } else {
        None
    }
}
