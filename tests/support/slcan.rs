//! A CAN adapter on a serial line, without hardware: the kernel drives one end of a pseudo-terminal as an
//! adapter (slcan), and the test is the adapter at the other end. When it takes nothing more, the line and
//! the queue of the interface fill up, as they do behind a bus that is jammed.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::os::fd::{AsRawFd as _, FromRawFd as _};
use std::ptr::{null, null_mut};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use socketcan::{CanDataFrame, CanInterface, CanSocket, EmbeddedFrame as _, Socket as _, StandardId};

use super::prerequisite::{Missing, Prerequisite};
use super::vcan::can_interfaces;
use super::waiting::{let_pass, wait_for};

/// An adapter, plugged in and up. Dropping it unplugs it.
pub(crate) struct Adapter {
    pub(crate) name: String,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    far_end: File,
    _near_end: File,
}

#[derive(Default)]
struct Shared {
    /// Lines that the adapter got for the bus, as the protocol encodes them.
    lines: Mutex<Vec<String>>,
    is_stalled: AtomicBool,
    over: AtomicBool,
}

impl Adapter {
    pub(crate) fn plug_in() -> Result<Self, Missing> {
        can_interfaces()?;
        let (far_end, near_end) = pseudo_terminal();
        let missing =
            || Prerequisite::Slcan.missing("the kernel has no slcan (run it under tests/with-vcan)");
        let name = become_adapter(&near_end).ok_or_else(missing)?;
        let shared = Arc::<Shared>::default();
        let of_thread = Arc::clone(&shared);
        let far = far_end.try_clone().unwrap();
        let thread = std::thread::spawn(move || take(far, &of_thread));
        let adapter = Self { name, shared, thread: Some(thread), far_end, _near_end: near_end };
        let can = adapter.interface();
        can.set_bitrate(500_000, None).unwrap();
        can.bring_up().unwrap();
        Ok(adapter)
    }

    pub(crate) fn interface(&self) -> CanInterface {
        CanInterface::open(&self.name).unwrap()
    }

    /// Receives frames from the bus or changes its state, by lines of the protocol.
    pub(crate) fn send_lines(&self, lines: &str) {
        (&self.far_end).write_all(lines.as_bytes()).unwrap();
    }

    /// Takes nothing more, until the queue of the interface is full; gives how many frames of somebody
    /// else that took.
    pub(crate) fn stall(&self) -> usize {
        self.shared.is_stalled.store(true, Ordering::SeqCst);
        let socket = CanSocket::open(&self.name).unwrap();
        let frame = CanDataFrame::new(StandardId::new(0x555).unwrap(), &[0; 8]).unwrap();
        let mut count = 0;
        let full = wait_for("a full queue", || {
            let full = loop {
                match socket.write_frame(&frame) {
                    Ok(()) => count += 1,
                    Err(full) => break full.to_string(),
                }
            };
            // What is still in hand makes room for some more.
            let_pass(Duration::from_millis(20), "until the line is full as well");
            socket.write_frame(&frame).is_err().then_some(full)
        });
        println!("the queue is full after {count} frames: {full}");
        count
    }

    /// Takes all again.
    pub(crate) fn go_on(&self) {
        self.shared.is_stalled.store(false, Ordering::SeqCst);
    }

    /// The lines that it was given that are no frames: to open and to close it, and to set a bit rate.
    pub(crate) fn commands(&self) -> Vec<String> {
        let lines = self.shared.lines.lock().unwrap();
        lines.iter().filter(|line| !line.starts_with(['t', 'T', 'r', 'R'])).cloned().collect()
    }

    /// The data of all frames with this 29-bit identifier it was given.
    pub(crate) fn frames(&self, id: u32) -> Vec<Vec<u8>> {
        let head = format!("T{:08X}8", id & 0x1FFF_FFFF);
        let lines = self.shared.lines.lock().unwrap();
        let hex = |text: &str| -> Vec<u8> {
            let byte = |at: usize| u8::from_str_radix(&text[2 * at..2 * at + 2], 16).unwrap();
            (0..8).map(byte).collect()
        };
        lines.iter().filter_map(|line| line.strip_prefix(&head)).map(hex).collect()
    }
}

impl Drop for Adapter {
    fn drop(&mut self) {
        self.shared.over.store(true, Ordering::SeqCst);
        let _ended = self.thread.take().map(JoinHandle::join);
    }
}

/// The adapter's life: reads a bit at a time, so that it can stop at once.
fn take(mut far: File, shared: &Shared) {
    let mut rest = String::new();
    while !shared.over.load(Ordering::SeqCst) {
        if shared.is_stalled.load(Ordering::SeqCst) || !is_readable(&far) {
            let_pass(Duration::from_millis(1), "in which the adapter takes nothing");
            continue;
        }
        let mut some = [0; 64];
        let Ok(count) = far.read(&mut some) else { continue };
        rest.push_str(&String::from_utf8_lossy(&some[..count]));
        while let Some((line, others)) = rest.split_once('\r') {
            shared.lines.lock().unwrap().push(line.to_owned());
            rest = others.to_owned();
        }
    }
}

#[allow(unsafe_code)]
fn is_readable(file: &File) -> bool {
    let mut poll = libc::pollfd { fd: file.as_raw_fd(), events: libc::POLLIN, revents: 0 };
    // SAFETY: the pointer is to one local structure.
    unsafe { libc::poll(&raw mut poll, 1, 20) == 1 }
}

/// Its far and its near end.
#[allow(unsafe_code)]
pub(crate) fn pseudo_terminal() -> (File, File) {
    let (mut far, mut near) = (0, 0);
    // SAFETY: all pointers are to locals or null where that is allowed; termios is integers, zero is a
    // value of each; both descriptors are new and nobody else's.
    unsafe {
        assert_eq!(libc::openpty(&raw mut far, &raw mut near, null_mut(), null(), null()), 0);
        let mut raw: libc::termios = std::mem::zeroed();
        libc::cfmakeraw(&raw mut raw);
        assert_eq!(libc::tcsetattr(near, libc::TCSANOW, &raw const raw), 0);
        (File::from_raw_fd(far), File::from_raw_fd(near))
    }
}

/// Has the kernel drive this end as a CAN adapter; gives the name of the interface.
#[allow(unsafe_code)]
fn become_adapter(near_end: &File) -> Option<String> {
    let slcan: libc::c_int = 17; // N_SLCAN of linux/tty.h
    // SAFETY: ifreq is integers and a union of plain values; zero is a value of each.
    let mut name: libc::ifreq = unsafe { std::mem::zeroed() };
    // SAFETY: the descriptor is open; the line discipline writes its interface's name into `name`.
    unsafe {
        if libc::ioctl(near_end.as_raw_fd(), libc::TIOCSETD, &raw const slcan) < 0 {
            return None;
        }
        assert_eq!(libc::ioctl(near_end.as_raw_fd(), libc::SIOCGIFNAME as _, &raw mut name), 0);
    }
    Some(name.ifr_name.iter().take_while(|c| **c != 0).map(|c| char::from(c.cast_unsigned())).collect())
}
