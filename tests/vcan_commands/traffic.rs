//! Every command frame on the bus, seen by a socket that is not the gateway's.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use socketcan::{CanFrame, CanSocket, EmbeddedFrame as _, Id, Socket as _, StandardId};

use crate::bench::asks;
use crate::interface::Vcan;
use crate::process::DEADLINE;

/// The command message of the bench vehicle.
pub(crate) const CMD: u32 = 304;

/// A listener.
pub(crate) struct Traffic {
    frames: Arc<Mutex<Vec<Vec<u8>>>>,
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Traffic {
    /// From now on.
    pub(crate) fn of(vcan: &Vcan) -> Self {
        let socket = CanSocket::open(vcan.name).unwrap();
        socket.set_read_timeout(Duration::from_millis(50)).unwrap();
        let (frames, over) = (Arc::<Mutex<Vec<Vec<u8>>>>::default(), Arc::<AtomicBool>::default());
        let (seen, is_over) = (Arc::clone(&frames), Arc::clone(&over));
        let own = Id::Standard(StandardId::new(u16::try_from(CMD).unwrap()).unwrap());
        let thread = std::thread::spawn(move || {
            while !is_over.load(Ordering::Relaxed) {
                // Silence, or a link that is down: listen on.
                let Ok(CanFrame::Data(frame)) = socket.read_frame() else { continue };
                if frame.id() == own {
                    seen.lock().unwrap().push(frame.data().to_vec());
                }
            }
        });
        Self { frames, over, thread: Some(thread) }
    }

    pub(crate) fn count(&self) -> usize {
        self.frames.lock().unwrap().len()
    }

    /// Now, to look from there on.
    pub(crate) fn mark(&self) -> usize {
        self.count()
    }

    /// What each frame asked for.
    pub(crate) fn all_asked(&self) -> Vec<&'static str> {
        self.frames.lock().unwrap().iter().map(|data| asks(data)).collect()
    }

    /// What the newest frame asked for, if it came after the mark.
    pub(crate) fn asked_since(&self, mark: usize) -> Option<&'static str> {
        self.frames.lock().unwrap().get(mark..)?.last().map(|data| asks(data))
    }

    pub(crate) fn wait_for(&self, asked: &str) {
        self.wait_since(0, asked);
    }

    pub(crate) fn wait_since(&self, mark: usize, asked: &str) {
        let since = Instant::now();
        while self.asked_since(mark) != Some(asked) {
            assert!(since.elapsed() < DEADLINE, "{asked:?} never came: {:?}", self.all_asked().last());
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// What the frames after the mark asked for, once no more come.
    pub(crate) fn after_silence(&self, mark: usize) -> Vec<&'static str> {
        let mut count = self.count();
        loop {
            std::thread::sleep(Duration::from_millis(500));
            if count == std::mem::replace(&mut count, self.count()) {
                return self.all_asked().split_off(mark);
            }
        }
    }

    /// Counter without a gap and checksum right, from the first frame to the last. (`asks` has looked at
    /// all other bits.)
    pub(crate) fn check_every_byte(&self) {
        let frames = self.frames.lock().unwrap();
        for (index, data) in frames.iter().enumerate() {
            assert_eq!(usize::from(data[6] & 15), index % 16, "frame {index} of {}", frames.len());
            assert_eq!(data[7], j1850(&data[..7]), "frame {index}");
        }
    }
}

impl Drop for Traffic {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        let _ended = self.thread.take().map(JoinHandle::join);
    }
}

/// CRC-8 SAE J1850, bit by bit.
fn j1850(data: &[u8]) -> u8 {
    let step = |crc: u8| if crc & 0x80 == 0 { crc << 1 } else { crc << 1 ^ 0x1D };
    !data.iter().fold(0xFF, |crc, byte| (0..8).fold(crc ^ byte, |crc, _| step(crc)))
}
