//! CAN interfaces of a test's own, and senders on them.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use socketcan::{CanDataFrame, CanInterface, CanSocket, EmbeddedFrame as _, Socket as _, StandardId};

use super::prerequisite::{Missing, Prerequisite};
use super::waiting::Pace;

/// Wall-clock nanoseconds before and after something.
pub(crate) type Window = std::ops::RangeInclusive<i64>;

/// The means to make CAN interfaces.
pub(crate) fn can_interfaces() -> Result<(), Missing> {
    let there = Path::new("/sys/class/net/vcan0").exists();
    there.then_some(()).ok_or_else(|| Prerequisite::Vcan.missing("no vcan0 (run it under tests/with-vcan)"))
}

/// An interface of a test's own, up. It goes when the test ends.
pub(crate) struct Vcan {
    pub(crate) name: &'static str,
}

impl Vcan {
    pub(crate) fn new(name: &'static str) -> Result<Self, Missing> {
        can_interfaces()?;
        let vcan = Self { name };
        vcan.create();
        Ok(vcan)
    }

    pub(crate) fn create(&self) {
        CanInterface::create_vcan(self.name, None).unwrap().bring_up().unwrap();
    }

    pub(crate) fn delete(&self) {
        self.interface().delete().unwrap();
    }

    pub(crate) fn bring_down(&self) {
        self.interface().bring_down().unwrap();
    }

    pub(crate) fn bring_up(&self) {
        self.interface().bring_up().unwrap();
    }

    pub(crate) fn interface(&self) -> CanInterface {
        CanInterface::open(self.name).unwrap()
    }

    /// Sends one frame; returns the time.
    pub(crate) fn send(&self, id: u32, data: [u8; 8]) -> Window {
        send(self.name, id, data).unwrap()
    }
}

impl Drop for Vcan {
    fn drop(&mut self) {
        if let Ok(interface) = CanInterface::open(self.name) {
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

/// The wall clock, nanoseconds.
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
            let mut pace = Pace::every(Duration::from_millis(50));
            loop {
                // Held until the frames are noted, since a report of them may come before.
                let mut sending = sending.lock().unwrap();
                if sending.over {
                    return;
                }
                let frames = sending.frames.clone().into_iter();
                // Down or gone: nothing is sent.
                sending.windows.extend(frames.filter_map(|(id, data)| send(interface, id, data).ok()));
                drop(sending);
                pace.wait();
            }
        });
        Self { shared, thread: Some(thread) }
    }

    /// From now on the frame has this data.
    pub(crate) fn set(&self, id: u32, data: [u8; 8]) {
        self.shared.lock().unwrap().frames.insert(id, data);
    }

    /// True if a frame was being sent at that time.
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
