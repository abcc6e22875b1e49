//! A control unit on a CAN interface, which can be made to send wrong things, or nothing.

use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use socketcan::{CanDataFrame, CanSocket, EmbeddedFrame as _, Socket as _, StandardId};

use crate::support::vcan::{Window, wall};
use crate::support::waiting::Pace;
use crate::vcan::vcan_commands::j1850;

pub(crate) const TURN: u16 = 0x100;
const HAZARD: u16 = 0x101;

pub(crate) const DBC: &str = "\
BO_ 256 TURN: 4 X
 SG_ CODE : 0|3@1+ (1,0) [0|7] \"\" X
 SG_ COUNTER : 8|4@1+ (1,0) [0|15] \"\" X
 SG_ CRC : 24|8@1+ (1,0) [0|255] \"\" X
BO_ 257 HAZARD: 1 X
 SG_ CODE : 0|2@1+ (1,0) [0|3] \"\" X
";

/// Both messages are sent every 50 ms and believed for a second.
pub(crate) const PROFILE: &str = "\
name = \"Bench\"
[bus.body]
dbc = \"bench.dbc\"
[message.TURN]
timeout_ms = 1000
counter = { signal = \"COUNTER\", max_step = 4 }
checksum = { kind = \"j1850\", signal = \"CRC\" }
[message.HAZARD]
timeout_ms = 1000
[turn]
signal = \"TURN.CODE\"
off = [0]
left = [1]
right = [2]
[hazard]
from = \"signal\"
signal = \"HAZARD.CODE\"
off = [0]
on = [1]
";

/// `CODE` of the states, which is one less than `TurnIndicatorsReport.report`.
pub(crate) const LEFT: u8 = 1;
pub(crate) const RIGHT: u8 = 2;
pub(crate) const UNDEFINED: u8 = 5;

/// How the turn message is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Manner {
    Sound,
    /// Only the hazard message is sent.
    Silent,
    /// Nothing is sent.
    Dead,
    /// The same frame again and again.
    Stuck,
    WrongChecksum,
}

struct State {
    code: u8,
    manner: Manner,
    /// What was sent as it should be, and when.
    sent: Vec<(u8, Window)>,
    over: bool,
}

/// Sends until it is dropped, whatever becomes of the interface.
pub(crate) struct Unit {
    state: Arc<Mutex<State>>,
    thread: Option<JoinHandle<()>>,
}

impl Unit {
    pub(crate) fn start(interface: &'static str) -> Self {
        let state = State { code: LEFT, manner: Manner::Sound, sent: Vec::new(), over: false };
        let state = Arc::new(Mutex::new(state));
        let shared = Arc::clone(&state);
        let thread = std::thread::spawn(move || {
            let (mut counter, mut pace) = (0_u8, Pace::every(Duration::from_millis(50)));
            loop {
                // Held until the frame is noted, since its report may come before its socket is closed.
                let mut state = shared.lock().unwrap();
                if state.over {
                    return;
                }
                let State { code, manner, .. } = *state;
                let before = wall();
                counter = counter.wrapping_add(u8::from(manner != Manner::Stuck));
                let mut data = [code, counter & 15, 0, 0];
                data[3] = j1850(&data[..3]) ^ u8::from(manner == Manner::WrongChecksum);
                if manner != Manner::Dead {
                    send(interface, HAZARD, &[0]);
                }
                let is_sent = !matches!(manner, Manner::Dead | Manner::Silent);
                let is_sent = is_sent && send(interface, TURN, &data).is_some();
                if is_sent && manner == Manner::Sound {
                    state.sent.push((code, before..=wall()));
                }
                drop(state);
                pace.wait();
            }
        });
        Self { state, thread: Some(thread) }
    }

    pub(crate) fn set(&self, code: u8, manner: Manner) {
        let mut state = self.state.lock().unwrap();
        (state.code, state.manner) = (code, manner);
    }

    /// Does it while no frame is being sent.
    pub(crate) fn between_frames(&self, act: impl FnOnce()) {
        let _state = self.state.lock().unwrap();
        act();
    }

    /// Whether a right frame with that code was being sent at that time.
    pub(crate) fn has_sent(&self, code: u8, stamp: i64) -> bool {
        self.state.lock().unwrap().sent.iter().any(|(sent, window)| *sent == code && window.contains(&stamp))
    }
}

impl Drop for Unit {
    fn drop(&mut self) {
        self.state.lock().unwrap().over = true;
        let _ended = self.thread.take().map(JoinHandle::join);
    }
}

/// Sends one frame; `None` when the interface is down or gone.
pub(crate) fn send(interface: &str, id: u16, data: &[u8]) -> Option<()> {
    let frame = CanDataFrame::new(StandardId::new(id)?, data)?;
    CanSocket::open(interface).ok()?.write_frame(&frame).ok()
}
