//! CAN interfaces of a test's own, and senders on them.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use socketcan::{CanDataFrame, CanInterface, CanSocket, EmbeddedFrame as _, Socket as _, StandardId};

/// Wall-clock nanoseconds before and after something.
pub(crate) type Window = std::ops::RangeInclusive<i64>;

/// Says on stderr, past the capture of libtest, that something is left out.
pub(crate) fn skip(what: &str, why: &str) {
    std::io::stderr().write_all(format!("skipped: {what}: {why}\n").as_bytes()).unwrap();
}

/// An interface, up. It goes when the test ends, unless it was there before.
pub(crate) struct Vcan {
    pub(crate) name: &'static str,
    own: bool,
}

impl Vcan {
    /// `None` where there are no CAN interfaces to be had.
    pub(crate) fn for_test(test: &str, name: &'static str) -> Option<Self> {
        if !Path::new("/sys/class/net/vcan0").exists() {
            skip(test, "no vcan0 (run it under tests/with-vcan)");
            return None;
        }
        let vcan = Self { name, own: name != "vcan0" };
        if vcan.own {
            vcan.create();
        }
        Some(vcan)
    }

    pub(crate) fn create(&self) {
        CanInterface::create_vcan(self.name, None).unwrap().bring_up().unwrap();
    }

    pub(crate) fn delete(&self) {
        assert!(self.own);
        CanInterface::open(self.name).unwrap().delete().unwrap();
    }

    pub(crate) fn bring_down(&self) {
        CanInterface::open(self.name).unwrap().bring_down().unwrap();
    }

    pub(crate) fn bring_up(&self) {
        CanInterface::open(self.name).unwrap().bring_up().unwrap();
    }

    /// Sends one frame; says when.
    pub(crate) fn send(&self, id: u32, data: [u8; 8]) -> Window {
        send(self.name, id, data).unwrap()
    }
}

impl Drop for Vcan {
    fn drop(&mut self) {
        if let (true, Ok(interface)) = (self.own, CanInterface::open(self.name)) {
            let _gone = interface.delete();
        }
    }
}

fn send(interface: &str, id: u32, data: [u8; 8]) -> Result<Window, socketcan::Error> {
    let id = StandardId::new(u16::try_from(id).unwrap()).unwrap();
    let socket = CanSocket::open(interface)?;
    let before = wall();
    socket.write_frame(&CanDataFrame::new(id, &data).unwrap())?;
    Ok(before..=wall())
}

pub(crate) fn wall() -> i64 {
    i64::try_from(SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_nanos()).unwrap()
}

/// Sends cyclically, as control units do, whatever becomes of the interface.
pub(crate) struct Sender {
    shared: Arc<Mutex<Sending>>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Sending {
    frames: BTreeMap<u32, [u8; 8]>,
    windows: Vec<Window>,
    over: bool,
}

impl Sender {
    pub(crate) fn start(vcan: &Vcan, frames: &[(u32, [u8; 8])]) -> Self {
        let sending = Sending { frames: frames.iter().copied().collect(), ..Sending::default() };
        let shared = Arc::new(Mutex::new(sending));
        let (sending, interface) = (Arc::clone(&shared), vcan.name);
        let thread = std::thread::spawn(move || {
            while !sending.lock().unwrap().over {
                let frames = sending.lock().unwrap().frames.clone();
                // Down or gone: nothing is sent.
                let sent = frames.into_iter().filter_map(|(id, data)| send(interface, id, data).ok());
                let sent: Vec<_> = sent.collect();
                sending.lock().unwrap().windows.extend(sent);
                std::thread::sleep(Duration::from_millis(50));
            }
        });
        Self { shared, thread: Some(thread) }
    }

    /// From now on the frame has this data.
    pub(crate) fn set(&self, id: u32, data: [u8; 8]) {
        self.shared.lock().unwrap().frames.insert(id, data);
    }

    /// Whether a frame was being sent at that time.
    pub(crate) fn sent_at(&self, nanos: i64) -> bool {
        self.shared.lock().unwrap().windows.iter().any(|window| window.contains(&nanos))
    }
}

impl Drop for Sender {
    fn drop(&mut self) {
        self.shared.lock().unwrap().over = true;
        let _ended = self.thread.take().map(JoinHandle::join);
    }
}
