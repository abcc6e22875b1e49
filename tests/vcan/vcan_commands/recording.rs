//! Every frame on an interface with the time at which the kernel had it, recorded by a socket that is
//! not the gateway's.

use std::sync::{Arc, Condvar, Mutex, OnceLock};
use std::thread::JoinHandle;
use std::time::{Duration, UNIX_EPOCH};

use socketcan::{CanFrame, CanSocket, EmbeddedFrame as _, Id, Socket as _, SocketOptions as _};

use crate::support::process::DEADLINE;
use crate::support::vcan::wall;

/// A frame that was on the bus.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct RecordedFrame {
    /// Of the kernel, `SO_TIMESTAMPNS`.
    pub(crate) at: Duration,
    /// With bit 31 for 29-bit identifiers, as in a DBC.
    pub(crate) id: u32,
    pub(crate) data: Vec<u8>,
}

type Frames = Arc<(Mutex<Vec<RecordedFrame>>, Condvar)>;

/// An instant on the kernel's wall clock.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BusTime(Duration);

impl BusTime {
    /// Before the first frame.
    pub(crate) const START: Self = Self(Duration::ZERO);

    /// The present, to look from there on, whether or not earlier frames have been read yet.
    pub(crate) fn now() -> Self {
        Self(Duration::from_nanos(wall().cast_unsigned()))
    }
}

/// A listener on one interface.
pub(crate) struct Recording {
    frames: Frames,
    end: Arc<OnceLock<Duration>>,
    thread: Option<JoinHandle<()>>,
}

impl Recording {
    /// From now on.
    pub(crate) fn of(interface: &str) -> Self {
        let socket = CanSocket::open(interface).unwrap();
        socket.set_read_timeout(Duration::from_millis(50)).unwrap();
        socket.set_recv_timestamp(true).unwrap();
        // Room for whatever comes while a slow machine does something else.
        socket.set_socket_option_int(libc::SOL_SOCKET, libc::SO_RCVBUFFORCE, 8 << 20).unwrap();
        let (frames, end) = (Frames::default(), Arc::<OnceLock<Duration>>::default());
        let (recorded, last) = (Arc::clone(&frames), Arc::clone(&end));
        let thread = std::thread::spawn(move || {
            loop {
                match socket.read_frame_with_timestamp() {
                    Ok((CanFrame::Data(frame), at)) => {
                        let at = at.duration_since(UNIX_EPOCH).unwrap();
                        if last.get().is_some_and(|last| at > *last) {
                            return;
                        }
                        let frame = RecordedFrame { at, id: number(frame.id()), data: frame.data().to_vec() };
                        recorded.0.lock().unwrap().push(frame);
                        recorded.1.notify_all();
                    }
                    Err(_) if last.get().is_some() => return,
                    // Silence, or a link that is down: listen on.
                    _ => {}
                }
            }
        });
        Self { frames, end, thread: Some(thread) }
    }

    /// The number of frames with this identifier.
    pub(crate) fn count(&self, id: u32) -> usize {
        self.frames.0.lock().unwrap().iter().filter(|frame| frame.id == id).count()
    }

    /// The frames with this identifier from `mark` on.
    pub(crate) fn since(&self, mark: BusTime, id: u32) -> Vec<RecordedFrame> {
        let frames = self.frames.0.lock().unwrap();
        frames.iter().filter(|frame| frame.at > mark.0 && frame.id == id).cloned().collect()
    }

    /// Waits until the frames with this identifier from `mark` on fulfil `is_it`.
    pub(crate) fn wait(&self, mark: BusTime, id: u32, what: &str, is_it: impl Fn(&[&RecordedFrame]) -> bool) {
        let is_done = |frames: &[RecordedFrame]| {
            is_it(&frames.iter().filter(|frame| frame.at > mark.0 && frame.id == id).collect::<Vec<_>>())
        };
        let frames = self.frames.0.lock().unwrap();
        let lacks = |frames: &mut Vec<RecordedFrame>| !is_done(frames);
        let (frames, timeout) = self.frames.1.wait_timeout_while(frames, DEADLINE, lacks).unwrap();
        let last = frames.last().cloned();
        drop(frames);
        assert!(!timeout.timed_out(), "{what} never came; the last frame: {last:?}");
    }

    /// Ends, with all that was on the bus up to now.
    pub(crate) fn finish(&mut self) {
        let _again = self.end.set(BusTime::now().0);
        let _ended = self.thread.take().map(JoinHandle::join);
    }
}

impl Drop for Recording {
    fn drop(&mut self) {
        self.finish();
    }
}

fn number(id: Id) -> u32 {
    match id {
        Id::Standard(id) => id.as_raw().into(),
        Id::Extended(id) => id.as_raw() | 1 << 31,
    }
}
