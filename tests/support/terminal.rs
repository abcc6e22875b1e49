//! A terminal of 80 columns on which a program runs.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::os::fd::AsRawFd as _;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use super::slcan::pseudo_terminal;
use super::waiting::{described, wait_until};

/// Width of the terminal, characters.
pub(crate) const COLUMNS: u16 = 80;

/// A program whose output, and whose input unless it is given, is a terminal.
pub(crate) struct OnTerminal {
    /// The process.
    pub(crate) child: Child,
    far_end: File,
    shown: Arc<Mutex<Vec<u8>>>,
    reader: JoinHandle<()>,
}

impl OnTerminal {
    /// Starts a program that reads the terminal.
    pub(crate) fn start(command: &mut Command) -> Self {
        Self::start_with(command, None)
    }

    /// Starts a program that reads `input`, else the terminal.
    #[allow(unsafe_code)]
    pub(crate) fn start_with(command: &mut Command, input: Option<Stdio>) -> Self {
        let (far_end, near_end) = pseudo_terminal();
        let size = libc::winsize { ws_row: 24, ws_col: COLUMNS, ws_xpixel: 0, ws_ypixel: 0 };
        // SAFETY: the descriptor is open, the pointer is to one local structure.
        let sized = unsafe { libc::ioctl(near_end.as_raw_fd(), libc::TIOCSWINSZ, &raw const size) };
        assert_eq!(sized, 0);
        let stream = || Stdio::from(near_end.try_clone().unwrap());
        command.env("TERM", "xterm-256color");
        for variable in ["COLUMNS", "NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE"] {
            if !command.get_envs().any(|(name, _)| name == variable) {
                command.env_remove(variable);
            }
        }
        command.stdin(input.unwrap_or_else(stream)).stdout(stream()).stderr(stream());
        let child = command.spawn().unwrap();
        // The last near end is the program's: its end is the end of the output.
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        drop(near_end);
        let shown = Arc::new(Mutex::new(Vec::new()));
        let (mut from, to) = (far_end.try_clone().unwrap(), Arc::clone(&shown));
        let read = move || {
            let mut part = [0; 4096];
            // The end is an error of the kernel's.
            while let Ok(count @ 1..) = from.read(&mut part) {
                to.lock().unwrap().extend_from_slice(&part[..count]);
            }
        };
        Self { child, far_end, shown, reader: std::thread::spawn(read) }
    }

    /// Types a text.
    pub(crate) fn type_in(&mut self, text: &str) {
        self.far_end.write_all(text.as_bytes()).unwrap();
    }

    /// Waits until the program has written a text.
    pub(crate) fn wait_for(&self, text: &str) {
        let what = described(|| format!("{text:?}; there is: {}", self.shown()));
        wait_until(what, || self.shown().contains(text));
    }

    fn shown(&self) -> String {
        String::from_utf8_lossy(&self.shown.lock().unwrap()).into_owned()
    }

    /// Waits for the end of the program; its exit code and all that it wrote.
    pub(crate) fn end(mut self) -> (Option<i32>, String) {
        let status = self.child.wait().unwrap();
        self.reader.join().unwrap();
        let shown = self.shown.lock().unwrap();
        (status.code(), String::from_utf8_lossy(&shown).into_owned())
    }
}

/// A text without its escape sequences.
pub(crate) fn plain(text: &str) -> String {
    let mut plain = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("\u{1b}[") {
        plain.push_str(before);
        rest = after.split_once(|end: char| end.is_ascii_alphabetic()).map_or("", |(_, rest)| rest);
    }
    plain + rest
}
