//! One CAN bus on a real interface, with all that can become of an interface.
//!
//! Runs where `tests/with-vcan` has prepared the ground (its header tells how); says so and passes
//! elsewhere.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // helpers of tests

use std::collections::HashSet;
use std::io::Write as _;
use std::path::Path;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use signal_gateway::core::error_frame::ErrorFrame;
use signal_gateway::core::event::{BusIndex, Input, LinkState};
use signal_gateway::core::frame::{CanId, Frame};
use signal_gateway::io::can::bus::{BusSocketSettings, receive};
use signal_gateway::io::can::transmit::Transmitter;
use socketcan::{
    CanAnyFrame, CanDataFrame, CanErrorFrame, CanFdFrame, CanFdSocket, CanInterface, CanRemoteFrame,
    EmbeddedFrame as _, ExtendedId, Id, Socket as _, StandardId,
};
use tokio::sync::mpsc::{Receiver, channel};
use tokio::time::timeout;

const BUS: BusIndex = BusIndex(3);
/// What no wait should ever come near.
const DEADLINE: Duration = Duration::from_secs(30);
const FIRST: CanId = CanId::Standard(0x123);
const SECOND: CanId = CanId::Extended(0x18FE_F100);

/// An interface of our own, up; it goes when the test ends.
struct Vcan(&'static str);

impl Vcan {
    /// `None`, said on stderr past the capture of libtest, where there are no CAN interfaces to be had.
    fn for_test(test: &str, name: &'static str) -> Option<Self> {
        if !Path::new("/sys/class/net/vcan0").exists() {
            let skipped = format!("skipped: {test}: no vcan0 (run it under tests/with-vcan)\n");
            std::io::stderr().write_all(skipped.as_bytes()).unwrap();
            return None;
        }
        let vcan = Self(name);
        vcan.create();
        Some(vcan)
    }

    fn create(&self) {
        CanInterface::create_vcan(self.0, None).unwrap().bring_up().unwrap();
    }

    fn interface(&self) -> CanInterface {
        CanInterface::open(self.0).unwrap()
    }

    fn delete(&self) {
        self.interface().delete().unwrap();
    }

    fn send(&self, frames: impl IntoIterator<Item = CanAnyFrame>) {
        let socket = CanFdSocket::open(self.0).unwrap();
        for frame in frames {
            socket.write_frame(&frame).unwrap();
        }
    }

    fn settings(&self, ids: &[CanId]) -> BusSocketSettings {
        BusSocketSettings {
            bus: BUS,
            interface: self.0.to_owned(),
            ids: ids.to_vec(),
            receive_buffer_bytes: 4 << 20,
            transmitter: Transmitter::default(),
        }
    }

    /// Receives `ids`, with a channel for 64 batches; returns when the bus is up.
    async fn receive(&self, ids: &[CanId]) -> Inbox {
        let mut inbox = Inbox::start(self.settings(ids), 64);
        inbox.until_link(LinkState::Up).await;
        inbox
    }
}

impl Drop for Vcan {
    fn drop(&mut self) {
        if let Ok(interface) = CanInterface::open(self.0) {
            let _gone = interface.delete();
        }
    }
}

/// The consumer's end.
struct Inbox {
    inputs: Receiver<Vec<Input>>,
    task: tokio::task::JoinHandle<()>,
}

impl Inbox {
    fn start(settings: BusSocketSettings, batches: usize) -> Self {
        let (sender, inputs) = channel(batches);
        Self { inputs, task: tokio::spawn(receive(settings, sender)) }
    }

    async fn batch(&mut self) -> Vec<Input> {
        timeout(DEADLINE, self.inputs.recv()).await.expect("an input in time").expect("the task goes on")
    }

    /// Batches up to and with the first that has an input like this.
    async fn until(&mut self, wanted: impl Fn(&Input) -> bool) -> Vec<Vec<Input>> {
        let mut batches = Vec::new();
        while !batches.last().is_some_and(|batch: &Vec<Input>| batch.iter().any(&wanted)) {
            batches.push(self.batch().await);
        }
        batches
    }

    async fn until_link(&mut self, state: LinkState) -> Vec<Input> {
        let is_it = |input: &Input| *input == Input::Link { bus: BUS, state };
        self.until(is_it).await.concat()
    }

    async fn until_frame(&mut self, wanted: Frame) -> Vec<Vec<Input>> {
        self.until(|input| matches!(input, Input::Frame { frame, .. } if *frame == wanted)).await
    }
}

fn classic(id: CanId, data: &[u8]) -> Frame {
    Frame::classic(id, data).unwrap()
}

/// The frame as the socketcan crate sends it.
fn sent(frame: &Frame) -> CanAnyFrame {
    let id = id(frame.id());
    if frame.is_fd() {
        CanFdFrame::new(id, frame.data()).unwrap().into()
    } else {
        CanDataFrame::new(id, frame.data()).unwrap().into()
    }
}

fn id(id: CanId) -> Id {
    match id {
        CanId::Standard(id) => StandardId::new(id).unwrap().into(),
        CanId::Extended(id) => ExtendedId::new(id).unwrap().into(),
    }
}

fn frames(inputs: &[Input]) -> Vec<Frame> {
    inputs
        .iter()
        .filter_map(|input| if let Input::Frame { frame, .. } = input { Some(*frame) } else { None })
        .collect()
}

/// `count` different frames of one id.
fn numbered(id: CanId, count: u32) -> impl Iterator<Item = CanAnyFrame> {
    (0..count).map(move |number| sent(&classic(id, &number.to_be_bytes())))
}

#[tokio::test]
async fn classic_fd_and_29_bit_frames_come_with_the_time_the_kernel_received_them() {
    let Some(vcan) = Vcan::for_test("frames with stamps", "vcan-stamp") else { return };
    let mut inbox = vcan.receive(&[FIRST, SECOND]).await;
    let expected = [
        classic(FIRST, &[1, 2, 3]),
        classic(SECOND, &[]),
        Frame::fd(FIRST, &[7; 64]).unwrap(),
        Frame::fd(SECOND, &[8; 12]).unwrap(),
    ];
    let wall = || i64::try_from(SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_nanos()).unwrap();
    let before = wall();
    vcan.send(expected.iter().map(sent));
    let after = wall();
    let inputs = inbox.until_frame(expected[3]).await.concat();
    assert_eq!(frames(&inputs), expected);
    for input in inputs {
        let Input::Frame { bus, stamp, .. } = input else { panic!("{input:?}") };
        assert_eq!(bus, BUS);
        assert!((before..=after).contains(&stamp.as_nanos()), "{before} {stamp:?} {after}");
    }
}

#[tokio::test]
async fn the_kernel_hides_other_ids_other_lengths_of_id_and_remote_requests() {
    let Some(vcan) = Vcan::for_test("filters", "vcan-filter") else { return };
    let mut inbox = vcan.receive(&[FIRST, SECOND]).await;
    let wanted = classic(FIRST, &[1]);
    vcan.send([
        sent(&classic(CanId::Standard(0x122), &[])),
        sent(&classic(CanId::Extended(0x123), &[])),
        sent(&classic(CanId::Extended(0x18FE_F101), &[])),
        CanRemoteFrame::new_remote(id(FIRST), 1).unwrap().into(),
        sent(&wanted),
    ]);
    assert_eq!(frames(&inbox.until_frame(wanted).await.concat()), [wanted]);
}

#[tokio::test]
async fn without_ids_only_error_frames_come_with_all_they_say() {
    let Some(vcan) = Vcan::for_test("error frames", "vcan-error") else { return };
    let mut inbox = vcan.receive(&[]).await;
    let (bus_off_and_controller, data) = (0x44, [0, 0x20, 0, 0, 0, 0, 255, 9]);
    let error = CanErrorFrame::new_error(bus_off_and_controller, &data).unwrap();
    vcan.send([sent(&classic(FIRST, &[])), error.into()]);
    let error = ErrorFrame::new(bus_off_and_controller, &data);
    assert_eq!(inbox.batch().await, [Input::ErrorFrame { bus: BUS, error }]);
}

#[tokio::test]
async fn frames_a_full_buffer_could_not_take_are_counted() {
    let Some(vcan) = Vcan::for_test("drops", "vcan-drops") else { return };
    let settings = BusSocketSettings { receive_buffer_bytes: 1, ..vcan.settings(&[FIRST, SECOND]) };
    let mut inbox = Inbox::start(settings, 1);
    inbox.until_link(LinkState::Up).await;
    let next = classic(SECOND, &[]);
    for round in 1..=2 {
        vcan.send(numbered(FIRST, 2000)); // one thread: the task takes none of them meanwhile
        let mut inputs = inbox.batch().await;
        // The kernel tells of a loss with the next frame it has room for.
        vcan.send([sent(&next)]);
        inputs.extend(inbox.until_frame(next).await.concat());
        let received = u32::try_from(frames(&inputs).len()).unwrap() - 1;
        let drops = inputs.iter().map(|input| if let Input::Drops { lost, .. } = input { *lost } else { 0 });
        let lost: u32 = drops.sum();
        assert_eq!(received + lost, 2000, "round {round}: {received} received, {lost} lost");
        assert!(received > 0 && lost > 1000, "round {round}: {received} received, {lost} lost");
    }
}

#[tokio::test]
async fn an_interface_set_down_is_reported_and_taken_up_again() {
    let Some(vcan) = Vcan::for_test("down and up", "vcan-down") else { return };
    let mut inbox = vcan.receive(&[FIRST]).await;
    for round in 0..3 {
        vcan.interface().bring_down().unwrap();
        assert_eq!(inbox.until_link(LinkState::Down).await.len(), 1);
        vcan.interface().bring_up().unwrap();
        assert_eq!(inbox.until_link(LinkState::Up).await.len(), 1);
        let frame = classic(FIRST, &[round]);
        vcan.send([sent(&frame)]);
        inbox.until_frame(frame).await;
    }
}

#[tokio::test]
async fn an_interface_deleted_and_made_again_is_found_by_its_name() {
    let Some(vcan) = Vcan::for_test("deleted and re-created", "vcan-again") else { return };
    let mut inbox = vcan.receive(&[FIRST]).await;
    for round in 0..3 {
        vcan.delete();
        inbox.until_link(LinkState::Missing).await;
        vcan.create();
        inbox.until_link(LinkState::Up).await;
        let frame = classic(FIRST, &[round]);
        vcan.send([sent(&frame)]);
        inbox.until_frame(frame).await;
    }
}

#[tokio::test]
async fn a_loss_too_short_to_be_seen_is_reported_and_frames_before_it_are_not_taken_for_new() {
    let Some(vcan) = Vcan::for_test("short losses", "vcan-short") else { return };
    let mut inbox = vcan.receive(&[FIRST, SECOND]).await;
    let losses: [(&dyn Fn(), u8); 2] = [
        (&|| (vcan.interface().bring_down().unwrap(), vcan.interface().bring_up().unwrap()).1, 1),
        (&|| (vcan.delete(), vcan.create()).1, 2),
    ];
    for (lose, round) in losses {
        // One thread: the task does not run before the wait below, and finds the frame and the loss.
        vcan.send([sent(&classic(FIRST, &[round]))]);
        lose();
        let inputs = inbox.until_link(LinkState::Up).await;
        let lost = [LinkState::Down, LinkState::Missing].map(|state| Input::Link { bus: BUS, state });
        assert!(lost.iter().any(|link| inputs.contains(link)), "{inputs:?}");
        assert_eq!(frames(&inputs), []);
        let fresh = classic(SECOND, &[round]);
        vcan.send([sent(&fresh)]);
        assert_eq!(frames(&inbox.until_frame(fresh).await.concat()), [fresh]);
    }
}

#[tokio::test]
async fn an_interface_that_appears_later_is_waited_for() {
    let Some(vcan) = Vcan::for_test("appears later", "vcan-later") else { return };
    vcan.delete();
    let mut inbox = Inbox::start(vcan.settings(&[FIRST]), 64);
    assert_eq!(inbox.batch().await, [Input::Link { bus: BUS, state: LinkState::Missing }]);
    CanInterface::create_vcan(vcan.0, None).unwrap();
    assert_eq!(inbox.batch().await, [Input::Link { bus: BUS, state: LinkState::Down }]);
    vcan.interface().bring_up().unwrap();
    assert_eq!(inbox.batch().await, [Input::Link { bus: BUS, state: LinkState::Up }]);
}

#[tokio::test]
async fn an_interface_that_is_no_can_interface_fails() {
    if Vcan::for_test("no CAN interface", "vcan-lo").is_none() {
        return;
    }
    let settings = BusSocketSettings {
        bus: BUS,
        interface: "lo".into(),
        ids: vec![],
        receive_buffer_bytes: 4096,
        transmitter: Transmitter::default(),
    };
    let mut inbox = Inbox::start(settings, 64);
    assert_eq!(inbox.batch().await, [Input::Link { bus: BUS, state: LinkState::Failed(libc::ENODEV) }]);
}

#[tokio::test]
async fn a_busy_bus_wakes_the_gateway_no_more_often_than_every_5_ms_and_never_for_other_ids() {
    let Some(vcan) = Vcan::for_test("wake-ups", "vcan-busy") else { return };
    let end = classic(SECOND, &[]);
    let others: Vec<_> = (1..25).map(|step| CanId::Standard(step * 7)).collect();
    for (others, relevant) in [(&others[..0], 80), (&others[..], 2000)] {
        let mut inbox = vcan.receive(&[others, &[FIRST, SECOND]].concat()).await;
        let (started, wakeups_before) = (Instant::now(), wakeups());
        let name = vcan.0;
        // 2,000 frames in a second, every 25th of FIRST.
        let sender = std::thread::spawn(move || {
            let socket = CanFdSocket::open(name).unwrap();
            for number in 0..2000_u16 {
                let id = if number % 25 == 0 { FIRST } else { CanId::Standard(number % 25 * 7) };
                let frame = sent(&classic(id, &number.to_be_bytes()));
                socket.write_frame(&frame).unwrap();
                std::thread::sleep(Duration::from_micros(500));
            }
            socket.write_frame(&sent(&end)).unwrap();
        });
        let batches = inbox.until_frame(end).await;
        let wakeups = wakeups() - wakeups_before;
        sender.join().unwrap();
        let count = batches.concat().len() - 1;
        let bound = started.elapsed().as_millis() / 5 + 2;
        let distinct: HashSet<_> = frames(&batches.concat()).iter().map(Frame::to_string).collect();
        println!("{count} of 2000 frames relevant: {} batches, {wakeups} wake-ups", batches.len());
        assert_eq!((count, distinct.len()), (relevant, relevant + 1), "none lost, none twice, no other");
        assert!(batches.len() as u128 <= bound, "{} batches, {bound} expected", batches.len());
        assert!(wakeups <= batches.len() * 3 / 2 + 20, "{wakeups} wake-ups for {} batches", batches.len());
        inbox.task.abort();
    }
}

#[tokio::test]
async fn a_burst_of_many_batches_comes_whole_and_in_order() {
    let Some(vcan) = Vcan::for_test("burst", "vcan-burst") else { return };
    let end = classic(SECOND, &[]);
    for count in [63, 64, 65, 5000] {
        let mut inbox = vcan.receive(&[FIRST, SECOND]).await; // for the task, a frame after a pause
        vcan.send(numbered(FIRST, count).chain([sent(&end)]));
        let inputs = inbox.until_frame(end).await.concat();
        let expected = numbered(FIRST, count).chain([sent(&end)]).map(|frame| frame.data().to_vec());
        assert!(frames(&inputs).iter().map(|frame| frame.data().to_vec()).eq(expected), "{count}");
        assert_eq!(inputs.len(), count as usize + 1, "no drops");
    }
}

/// How often this thread, which runs task and test, has gone to sleep.
fn wakeups() -> usize {
    let status = std::fs::read_to_string("/proc/thread-self/status").unwrap();
    let count = status.lines().find_map(|line| line.strip_prefix("voluntary_ctxt_switches:"));
    count.unwrap().trim().parse().unwrap()
}

#[tokio::test]
async fn the_task_ends_when_nobody_listens() {
    let Some(vcan) = Vcan::for_test("nobody listens", "vcan-nobody") else { return };
    let Inbox { inputs, task } = vcan.receive(&[FIRST]).await;
    drop(inputs);
    timeout(DEADLINE, task).await.expect("the task ends on an idle bus").unwrap();
}
