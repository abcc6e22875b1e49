//! Every frame on an interface with the time at which the kernel had it, recorded by a socket that is
//! not the gateway's.

use std::os::unix::net::UnixStream;
use std::sync::{Arc, Condvar, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, UNIX_EPOCH};

use rustix::event::{PollFd, PollFlags, poll};
use socketcan::{
    CanAnyFrame, CanDataFrame, CanFdSocket, CanSocket, EmbeddedFrame as _, ExtendedId, Id, Socket as _,
    SocketOptions as _,
};

use crate::support::vcan::wall;
use crate::support::waiting::{DEADLINE, let_pass};

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

/// The identifier of the frame that ends a recording.
const LAST: u32 = 1 << 31 | 0x1FFF_FFFF;

/// A listener on one interface.
pub(crate) struct Recording {
    interface: String,
    frames: Frames,
    /// Its thread ends when this is dropped.
    end: Option<UnixStream>,
    thread: Option<JoinHandle<()>>,
}

impl Recording {
    /// From now on.
    pub(crate) fn of(interface: &str) -> Self {
        let socket = CanFdSocket::open(interface).unwrap();
        socket.set_nonblocking(true).unwrap();
        socket.set_recv_timestamp(true).unwrap();
        // Room for whatever comes while a slow machine does something else.
        socket.set_socket_option_int(libc::SOL_SOCKET, libc::SO_RCVBUFFORCE, 8 << 20).unwrap();
        let frames = Frames::default();
        let recorded = Arc::clone(&frames);
        let (end, ended) = UnixStream::pair().unwrap();
        let thread = std::thread::spawn(move || {
            let mut is_over = false;
            while !is_over {
                let (readable, gone) = (PollFlags::IN, PollFlags::empty());
                let mut events = [PollFd::new(&socket, readable), PollFd::new(&ended, gone)];
                poll(&mut events, None).unwrap();
                is_over = !events[1].revents().is_empty();
                // A link that is down is an error once.
                while let Ok((frame, at)) = socket.read_frame_with_timestamp() {
                    let (id, data) = match &frame {
                        CanAnyFrame::Normal(frame) => (frame.id(), frame.data()),
                        CanAnyFrame::Fd(frame) => (frame.id(), frame.data()),
                        CanAnyFrame::Remote(_) | CanAnyFrame::Error(_) => continue,
                    };
                    let at = at.duration_since(UNIX_EPOCH).unwrap();
                    let frame = RecordedFrame { at, id: number(id), data: data.to_vec() };
                    recorded.0.lock().unwrap().push(frame);
                    recorded.1.notify_all();
                }
            }
        });
        Self { interface: interface.to_owned(), frames, end: Some(end), thread: Some(thread) }
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

    /// Ends, with all that was on the bus up to now: up to a frame of its own, which it leaves out.
    pub(crate) fn finish(&mut self) {
        let Some(end) = self.end.take() else { return };
        let_pass(Duration::from_millis(50), "in which frames of other processors arrive");
        let last = CanDataFrame::new(ExtendedId::MAX, &[]).unwrap();
        let sent = CanSocket::open(&self.interface).and_then(|socket| socket.write_frame(&last));
        // An interface that is down has no frame on its way.
        if sent.is_ok() {
            let frames = self.frames.0.lock().unwrap();
            let lacks = |frames: &mut Vec<RecordedFrame>| frames.iter().all(|frame| frame.id != LAST);
            let (mut frames, timeout) = self.frames.1.wait_timeout_while(frames, DEADLINE, lacks).unwrap();
            frames.retain(|frame| frame.id != LAST);
            let is_in_time = !timeout.timed_out() || std::thread::panicking();
            assert!(is_in_time, "the recording never reached its end");
        }
        drop(end);
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
