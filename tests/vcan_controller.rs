//! A controller with states, without hardware: the kernel's serial-line CAN on a pseudo-terminal.
//!
//! Runs under `tests/with-vcan` like `vcan_bus`; says so and passes where there is no slcan.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // helpers of tests

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::os::fd::{AsRawFd as _, FromRawFd as _};
use std::path::Path;
use std::ptr::{null, null_mut};
use std::time::Duration;

use signal_gateway::core::event::{BusIndex, Input, LinkState};
use signal_gateway::core::frame::{CanId, Frame};
use signal_gateway::io::can::bus::{BusSocketSettings, receive};
use socketcan::CanInterface;
use tokio::sync::mpsc::{Receiver, channel};
use tokio::time::timeout;

const BUS: BusIndex = BusIndex(0);
const DEADLINE: Duration = Duration::from_secs(30);

/// The far end of a serial line whose near end the kernel drives as a CAN adapter. Dropping it
/// unplugs the adapter.
struct Adapter {
    line: File,
    _near_end: File,
}

impl Adapter {
    /// The adapter and the name of its interface; `None` where the kernel has no slcan.
    #[allow(unsafe_code)]
    fn plug_in() -> Option<(Self, String)> {
        let slcan: libc::c_int = 17; // N_SLCAN of linux/tty.h
        let (mut far, mut near) = (0, 0);
        // SAFETY: ifreq is integers and a union of plain values; zero is a value of each.
        let mut name: libc::ifreq = unsafe { std::mem::zeroed() };
        // SAFETY: all pointers are to locals or null where that is allowed.
        unsafe {
            assert_eq!(libc::openpty(&raw mut far, &raw mut near, null_mut(), null(), null()), 0);
            let mut raw: libc::termios = std::mem::zeroed();
            libc::cfmakeraw(&raw mut raw);
            assert_eq!(libc::tcsetattr(near, libc::TCSANOW, &raw const raw), 0);
        }
        // SAFETY: both descriptors are new and nobody else's.
        let (line, near_end) = unsafe { (File::from_raw_fd(far), File::from_raw_fd(near)) };
        // SAFETY: as above; the line discipline writes its interface's name into `name`.
        unsafe {
            if libc::ioctl(near_end.as_raw_fd(), libc::TIOCSETD, &raw const slcan) < 0 {
                return None;
            }
            assert_eq!(libc::ioctl(near_end.as_raw_fd(), libc::SIOCGIFNAME as _, &raw mut name), 0);
        }
        let name =
            name.ifr_name.iter().take_while(|c| **c != 0).map(|c| char::from(c.cast_unsigned())).collect();
        // The kernel waits for the adapter to take its commands.
        let mut commands = line.try_clone().unwrap();
        std::thread::spawn(move || while commands.read(&mut [0; 64]).is_ok_and(|count| count > 0) {});
        Some((Self { line, _near_end: near_end }, name))
    }

    fn say(&mut self, line: &str) {
        self.line.write_all(line.as_bytes()).unwrap();
    }
}

async fn until(inputs: &mut Receiver<Vec<Input>>, wanted: impl Fn(&Input) -> bool) -> Vec<Input> {
    let mut seen: Vec<Input> = Vec::new();
    while !seen.iter().any(&wanted) {
        let batch = timeout(DEADLINE, inputs.recv()).await;
        seen.extend(batch.unwrap_or_else(|_| panic!("only {seen:?}")).expect("the task goes on"));
    }
    seen
}

#[tokio::test]
async fn error_states_arrive_as_class_bits_and_frames_after_bus_off_are_received() {
    let adapter = if Path::new("/sys/class/net/vcan0").exists() { Adapter::plug_in() } else { None };
    let Some((mut adapter, interface)) = adapter else {
        writeln!(std::io::stderr(), "skipped: controller states: no slcan (run it under tests/with-vcan)")
            .unwrap();
        return; // eprintln! would have been captured
    };
    let can = CanInterface::open(&interface).unwrap();
    can.set_bitrate(500_000, None).unwrap();
    can.bring_up().unwrap();
    let (sender, mut inputs) = channel(64);
    let ids = vec![CanId::Standard(0x123)];
    tokio::spawn(receive(
        BusSocketSettings { bus: BUS, interface, ids, receive_buffer_bytes: 65_536 },
        sender,
    ));
    let link = |state| move |input: &Input| *input == Input::Link { bus: BUS, state };
    until(&mut inputs, link(LinkState::Up)).await;
    let warned_passive_bit_error_bus_off =
        [("sw100096\r", 0x4), ("sp130020\r", 0x4), ("e2bc\r", 0x88), ("sb000256\r", 0x40)];
    for (report, bits) in warned_passive_bit_error_bus_off {
        adapter.say(report);
        let error = |input: &Input| matches!(input, Input::ErrorFrame { class, .. } if class & bits == bits);
        until(&mut inputs, error).await;
    }
    // This driver never gives the carrier back after bus-off; frames come all the same.
    adapter.say("sa000000\rt1232AABB\r");
    let frame = Frame::classic(CanId::Standard(0x123), &[0xAA, 0xBB]).unwrap();
    let seen =
        until(&mut inputs, |input| matches!(input, Input::Frame { frame: it, .. } if *it == frame)).await;
    assert!(!seen.iter().any(|input| matches!(input, Input::Link { .. })), "{seen:?}");
    drop(adapter);
    until(&mut inputs, link(LinkState::Missing)).await;
}
