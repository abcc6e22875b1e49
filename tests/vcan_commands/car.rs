//! A vehicle on the bus that does as it is told, and has a stalk.

use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use socketcan::{
    CanDataFrame, CanFrame, CanSocket, EmbeddedFrame as _, ExtendedId, Id, Socket as _, StandardId,
};

use crate::vehicles::Vehicle;

/// From report to report.
const PERIOD: Duration = Duration::from_millis(50);

/// A running vehicle.
pub(crate) struct Car {
    state: Arc<Mutex<State>>,
    thread: Option<JoinHandle<()>>,
}

struct State {
    /// Lights that are on without a command.
    stalk: &'static str,
    /// Value of a message of its own, for the control mode.
    mode: Option<u8>,
    over: bool,
}

impl Car {
    /// On an interface. It puts `mode`, if there is any, into message `0x231`.
    pub(crate) fn start(vehicle: &'static Vehicle, interface: &'static str) -> Self {
        let state = Arc::new(Mutex::new(State { stalk: "off", mode: None, over: false }));
        let shared = Arc::clone(&state);
        let thread = std::thread::spawn(move || drive(vehicle, interface, &shared));
        Self { state, thread: Some(thread) }
    }

    /// The driver's hand.
    pub(crate) fn stalk(&self, lights: &'static str) {
        self.state.lock().unwrap().stalk = lights;
    }

    /// From now on.
    pub(crate) fn mode(&self, raw: Option<u8>) {
        self.state.lock().unwrap().mode = raw;
    }
}

impl Drop for Car {
    fn drop(&mut self) {
        self.state.lock().unwrap().over = true;
        let _ended = self.thread.take().map(JoinHandle::join);
    }
}

fn drive(vehicle: &Vehicle, interface: &str, shared: &Mutex<State>) {
    let socket = CanSocket::open(interface).unwrap();
    socket.set_read_timeout(Duration::from_millis(10)).unwrap();
    let command = id(vehicle.command);
    let mut asked = vehicle.nothing;
    let mut due = Instant::now();
    for number in (0..=u8::MAX).cycle() {
        while Instant::now() < due {
            if let Ok(CanFrame::Data(frame)) = socket.read_frame()
                && frame.id() == command
            {
                asked = (vehicle.asks)(frame.data());
            }
        }
        due = Instant::now() + PERIOD;
        let state = shared.lock().unwrap();
        if state.over {
            return;
        }
        let lights = if asked == vehicle.nothing { state.stalk } else { asked.trim_end_matches(", any") };
        let mode = state.mode.map(|mode| (0x231, vec![mode]));
        drop(state);
        let report = (vehicle.report, (vehicle.lights)(lights, number));
        for (to, data) in [report].into_iter().chain(mode) {
            // Down: nothing is sent.
            let _down = socket.write_frame(&CanDataFrame::new(id(to), &data).unwrap());
        }
    }
}

/// An identifier as in a DBC.
pub(crate) fn id(number: u32) -> Id {
    if number & 1 << 31 == 0 {
        Id::Standard(StandardId::new(u16::try_from(number).unwrap()).unwrap())
    } else {
        Id::Extended(ExtendedId::new(number & 0x1FFF_FFFF).unwrap())
    }
}
