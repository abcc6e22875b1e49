//! One CAN bus on a real interface, with all that can become of an interface.

use std::collections::HashSet;
use std::time::{Duration, Instant};

use can_signal::can::error_frame::ErrorFrame;
use can_signal::can::frame::{CanId, Frame};
use can_signal::can::id_match::{IdMatch, SourceAddresses};
use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use signal_gateway::io::can::bus::{BusSocketSettings, receive};
use signal_gateway::io::can::id_filter::IdFilter;
use signal_gateway::io::can::transmit::Transmitter;
use socketcan::{
    CanAnyFrame, CanDataFrame, CanErrorFrame, CanFdFrame, CanFdSocket, CanInterface, CanRemoteFrame,
    EmbeddedFrame as _, ExtendedId, Id, Socket as _, StandardId,
};
use tokio::sync::mpsc::{Receiver, channel};
use tokio::time::timeout;

use crate::support::prerequisite::require;
use crate::support::vcan::{Vcan, wall};
use crate::support::waiting::{DEADLINE, Pace, let_pass};

const BUS: BusIndex = BusIndex(3);
const FIRST: CanId = CanId::Standard(0x123);
const SECOND: CanId = CanId::Extended(0x18FE_F100);

fn send(vcan: &Vcan, frames: impl IntoIterator<Item = CanAnyFrame>) {
    let socket = CanFdSocket::open(vcan.name).unwrap();
    for frame in frames {
        socket.write_frame(&frame).unwrap();
    }
}

fn settings(interface: &str, ids: &[CanId]) -> BusSocketSettings {
    BusSocketSettings {
        bus: BUS,
        interface: interface.to_owned(),
        ids: IdFilter::new(Some(ids.iter().copied().map(IdMatch::from).collect())),
        receive_buffer_bytes: 4 << 20,
        transmitter: Transmitter::default(),
    }
}

fn settings_for(interface: &str, ids: Vec<IdMatch>) -> BusSocketSettings {
    BusSocketSettings { ids: IdFilter::new(Some(ids)), ..settings(interface, &[]) }
}

/// The consumer's end.
struct Inbox {
    inputs: Receiver<Vec<CanInput>>,
    task: tokio::task::JoinHandle<()>,
}

impl Inbox {
    /// Of `ids`, with a channel for 64 batches, once the bus is up.
    async fn of(vcan: &Vcan, ids: &[CanId]) -> Self {
        let mut inbox = Self::start(settings(vcan.name, ids), 64);
        inbox.until_link(LinkState::Up).await;
        inbox
    }

    fn start(settings: BusSocketSettings, batches: usize) -> Self {
        let (sender, inputs) = channel(batches);
        Self { inputs, task: tokio::spawn(receive(settings, sender)) }
    }

    async fn batch(&mut self) -> Vec<CanInput> {
        timeout(DEADLINE, self.inputs.recv()).await.expect("an input in time").expect("the task goes on")
    }

    /// Batches up to and with the first that has an input like this.
    async fn until(&mut self, is_last: impl Fn(&CanInput) -> bool) -> Vec<Vec<CanInput>> {
        let mut batches = Vec::new();
        while !batches.last().is_some_and(|batch: &Vec<CanInput>| batch.iter().any(&is_last)) {
            batches.push(self.batch().await);
        }
        batches
    }

    async fn until_link(&mut self, state: LinkState) -> Vec<CanInput> {
        let is_it = |input: &CanInput| *input == CanInput::Link { bus: BUS, state };
        self.until(is_it).await.concat()
    }

    async fn until_frame(&mut self, last: Frame) -> Vec<Vec<CanInput>> {
        self.until(|input| matches!(input, CanInput::Frame { frame, .. } if *frame == last)).await
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

fn frames(inputs: &[CanInput]) -> Vec<Frame> {
    inputs
        .iter()
        .filter_map(|input| if let CanInput::Frame { frame, .. } = input { Some(*frame) } else { None })
        .collect()
}

/// `count` different frames of one id.
fn numbered(id: CanId, count: u32) -> impl Iterator<Item = CanAnyFrame> {
    (0..count).map(move |number| sent(&classic(id, &number.to_be_bytes())))
}

#[tokio::test]
async fn classic_fd_and_29_bit_frames_come_with_the_time_the_kernel_received_them() {
    let vcan = require!(Vcan::new("vcan-stamp"));
    let mut inbox = Inbox::of(&vcan, &[FIRST, SECOND]).await;
    let expected = [
        classic(FIRST, &[1, 2, 3]),
        classic(SECOND, &[]),
        Frame::fd(FIRST, &[7; 64]).unwrap(),
        Frame::fd(SECOND, &[8; 12]).unwrap(),
    ];
    let before = wall();
    send(&vcan, expected.iter().map(sent));
    let after = wall();
    let inputs = inbox.until_frame(expected[3]).await.concat();
    assert_eq!(frames(&inputs), expected);
    for input in inputs {
        let CanInput::Frame { bus, stamp, .. } = input else { panic!("{input:?}") };
        assert_eq!(bus, BUS);
        assert!((before..=after).contains(&stamp.as_nanos()), "{before} {stamp:?} {after}");
    }
}

#[tokio::test]
async fn the_kernel_passes_a_j1939_group_of_any_or_of_listed_senders() {
    let vcan = require!(Vcan::new("vcan-j1939"));
    let group = |id, sources| IdMatch::j1939(CanId::Extended(id), sources).unwrap();
    let any = group(0x0CFD_CC27, SourceAddresses::ANY);
    // PDU1, from so many senders that one filter passes all of them; and PDU2 from two.
    let many = group(0x18EF_2127, (0..20).collect());
    let two = group(0x18FE_4E21, [0x21, 0x27].into_iter().collect());
    let mut inbox = Inbox::start(settings_for(vcan.name, vec![any, many, two, FIRST.into()]), 64);
    inbox.until_link(LinkState::Up).await;
    let passed = [0x0CFD_CC27, 0x18FD_CC00, 0x00FD_CCFF, 0x18EF_2100, 0x00EF_FF13, 0x18FE_4E21, 0x0CFE_4E27];
    let hidden = [0x0CFD_CD27, 0x0DFD_CC27, 0x0EFD_CC27, 0x18EE_2100, 0x18FE_4E22, 0x18FE_4F21];
    let frames_of =
        |ids: &[u32]| ids.iter().map(|id| classic(CanId::Extended(*id), &[1])).collect::<Vec<_>>();
    let last = classic(FIRST, &[9]);
    let sent_frames =
        [frames_of(&hidden), vec![classic(CanId::Standard(0x4FF), &[1])], frames_of(&passed), vec![last]];
    send(&vcan, sent_frames.concat().iter().map(sent));
    let received = frames(&inbox.until_frame(last).await.concat());
    assert_eq!(received, [frames_of(&passed), vec![last]].concat());
}

#[tokio::test]
async fn the_kernel_hides_other_ids_other_lengths_of_id_and_remote_requests() {
    let vcan = require!(Vcan::new("vcan-filter"));
    let mut inbox = Inbox::of(&vcan, &[FIRST, SECOND]).await;
    let last = classic(FIRST, &[1]);
    send(
        &vcan,
        [
            sent(&classic(CanId::Standard(0x122), &[])),
            sent(&classic(CanId::Extended(0x123), &[])),
            sent(&classic(CanId::Extended(0x18FE_F101), &[])),
            CanRemoteFrame::new_remote(id(FIRST), 1).unwrap().into(),
            sent(&last),
        ],
    );
    assert_eq!(frames(&inbox.until_frame(last).await.concat()), [last]);
}

#[tokio::test]
async fn without_ids_only_error_frames_are_received_with_their_contents() {
    let vcan = require!(Vcan::new("vcan-error"));
    let mut inbox = Inbox::of(&vcan, &[]).await;
    let (bus_off_and_controller, data) = (0x44, [0, 0x20, 0, 0, 0, 0, 255, 9]);
    let error = CanErrorFrame::new_error(bus_off_and_controller, &data).unwrap();
    send(&vcan, [sent(&classic(FIRST, &[])), error.into()]);
    let error = ErrorFrame::new(bus_off_and_controller, &data);
    assert_eq!(inbox.batch().await, [CanInput::ErrorFrame { bus: BUS, error }]);
}

#[tokio::test]
async fn frames_a_full_buffer_could_not_take_are_counted() {
    let vcan = require!(Vcan::new("vcan-drops"));
    let settings = BusSocketSettings { receive_buffer_bytes: 1, ..settings(vcan.name, &[FIRST, SECOND]) };
    let mut inbox = Inbox::start(settings, 1);
    inbox.until_link(LinkState::Up).await;
    let next = classic(SECOND, &[]);
    for round in 1..=2 {
        send(&vcan, numbered(FIRST, 2000)); // one thread: the task takes none of them meanwhile
        let mut inputs = inbox.batch().await;
        // The kernel reports a loss with the next frame it has room for.
        send(&vcan, [sent(&next)]);
        inputs.extend(inbox.until_frame(next).await.concat());
        let received = u32::try_from(frames(&inputs).len()).unwrap() - 1;
        let drops =
            inputs.iter().map(|input| if let CanInput::Drops { lost, .. } = input { *lost } else { 0 });
        let lost: u32 = drops.sum();
        assert_eq!(received + lost, 2000, "round {round}: {received} received, {lost} lost");
        assert!(received > 0 && lost > 1000, "round {round}: {received} received, {lost} lost");
    }
}

#[tokio::test]
async fn an_interface_set_down_is_reported_and_taken_up_again() {
    let vcan = require!(Vcan::new("vcan-down"));
    let mut inbox = Inbox::of(&vcan, &[FIRST]).await;
    for round in 0..3 {
        vcan.bring_down();
        assert_eq!(inbox.until_link(LinkState::Down).await.len(), 1);
        vcan.bring_up();
        assert_eq!(inbox.until_link(LinkState::Up).await.len(), 1);
        let frame = classic(FIRST, &[round]);
        send(&vcan, [sent(&frame)]);
        inbox.until_frame(frame).await;
    }
}

#[tokio::test]
async fn an_interface_deleted_and_made_again_is_found_by_its_name() {
    let vcan = require!(Vcan::new("vcan-again"));
    let mut inbox = Inbox::of(&vcan, &[FIRST]).await;
    for round in 0..3 {
        vcan.delete();
        inbox.until_link(LinkState::Missing).await;
        vcan.create();
        inbox.until_link(LinkState::Up).await;
        let frame = classic(FIRST, &[round]);
        send(&vcan, [sent(&frame)]);
        inbox.until_frame(frame).await;
    }
}

#[tokio::test]
async fn a_loss_too_short_to_be_seen_is_reported_and_frames_before_it_are_not_taken_for_new() {
    let vcan = require!(Vcan::new("vcan-short"));
    let mut inbox = Inbox::of(&vcan, &[FIRST, SECOND]).await;
    let losses: [(&dyn Fn(), u8); 2] =
        [(&|| (vcan.bring_down(), vcan.bring_up()).1, 1), (&|| (vcan.delete(), vcan.create()).1, 2)];
    for (lose, round) in losses {
        // One thread: the task does not run before the wait below, and finds the frame and the loss.
        send(&vcan, [sent(&classic(FIRST, &[round]))]);
        lose();
        let inputs = inbox.until_link(LinkState::Up).await;
        let lost = [LinkState::Down, LinkState::Missing].map(|state| CanInput::Link { bus: BUS, state });
        assert!(lost.iter().any(|link| inputs.contains(link)), "{inputs:?}");
        assert_eq!(frames(&inputs), []);
        let fresh = classic(SECOND, &[round]);
        send(&vcan, [sent(&fresh)]);
        assert_eq!(frames(&inbox.until_frame(fresh).await.concat()), [fresh]);
    }
}

#[tokio::test]
async fn an_interface_that_appears_later_is_waited_for() {
    let vcan = require!(Vcan::new("vcan-later"));
    vcan.delete();
    let mut inbox = Inbox::start(settings(vcan.name, &[FIRST]), 64);
    assert_eq!(inbox.batch().await, [CanInput::Link { bus: BUS, state: LinkState::Missing }]);
    CanInterface::create_vcan(vcan.name, None).unwrap();
    assert_eq!(inbox.batch().await, [CanInput::Link { bus: BUS, state: LinkState::Down }]);
    vcan.bring_up();
    assert_eq!(inbox.batch().await, [CanInput::Link { bus: BUS, state: LinkState::Up }]);
}

/// The clock is advanced to the next look as soon as nothing else is left to do.
#[tokio::test(start_paused = true)]
async fn an_interface_that_appears_is_announced_without_waiting_for_the_next_look() {
    let vcan = require!(Vcan::new("vcan-linked"));
    vcan.delete();
    let started = tokio::time::Instant::now();
    let mut inbox = Inbox::start(settings(vcan.name, &[FIRST]), 64);
    inbox.until_link(LinkState::Missing).await;
    vcan.create();
    inbox.until_link(LinkState::Up).await;
    let waited = started.elapsed();
    assert_eq!(waited.as_secs(), 0, "announced, not looked for");
}

#[tokio::test]
async fn an_interface_that_is_no_can_interface_fails() {
    let mut inbox = Inbox::start(settings("lo", &[]), 64);
    assert_eq!(inbox.batch().await, [CanInput::Link { bus: BUS, state: LinkState::NotCan }]);
}

#[tokio::test]
async fn a_busy_bus_wakes_the_gateway_every_5_ms_and_never_for_other_ids() {
    let vcan = require!(Vcan::new("vcan-busy"));
    let end = classic(SECOND, &[]);
    let others: Vec<_> = (1..25).map(|step| CanId::Standard(step * 7)).collect();
    for (others, relevant) in [(&others[..0], 80), (&others[..], 2000)] {
        let mut inbox = Inbox::of(&vcan, &[others, &[FIRST, SECOND]].concat()).await;
        let (started, wakeups_before) = (Instant::now(), wakeups());
        let name = vcan.name;
        // 2,000 frames in a second, every 25th of FIRST.
        let sender = std::thread::spawn(move || {
            let socket = CanFdSocket::open(name).unwrap();
            let mut pace = Pace::every(Duration::from_micros(500));
            for number in 0..2000_u16 {
                let id = if number % 25 == 0 { FIRST } else { CanId::Standard(number % 25 * 7) };
                let frame = sent(&classic(id, &number.to_be_bytes()));
                socket.write_frame(&frame).unwrap();
                pace.wait();
            }
            socket.write_frame(&sent(&end)).unwrap();
        });
        let batches = inbox.until_frame(end).await;
        let wakeups = wakeups() - wakeups_before;
        sender.join().unwrap();
        let count = batches.concat().len() - 1;
        // One every 5 ms, or three within 10 ms where the sender had to wait.
        let bound = started.elapsed().as_millis() * 3 / 10 + 2;
        let distinct: HashSet<_> = frames(&batches.concat()).iter().map(Frame::to_string).collect();
        println!("{count} of 2000 frames relevant: {} batches, {wakeups} wake-ups", batches.len());
        assert_eq!((count, distinct.len()), (relevant, relevant + 1), "none lost, none twice, no other");
        assert!(batches.len() as u128 <= bound, "{} batches, {bound} expected", batches.len());
        assert!(wakeups <= batches.len() * 3 / 2 + 20, "{wakeups} wake-ups for {} batches", batches.len());
        inbox.task.abort();
    }
}

/// Ticks without a frame would wake it for nothing.
#[tokio::test]
async fn frames_now_and_then_wake_the_gateway_once_each() {
    const PAIRS: u16 = 100;
    let vcan = require!(Vcan::new("vcan-pairs"));
    let end = classic(SECOND, &[]);
    let mut inbox = Inbox::of(&vcan, &[FIRST, SECOND]).await;
    let (before, name) = (wakeups(), vcan.name);
    let sender = std::thread::spawn(move || {
        let socket = CanFdSocket::open(name).unwrap();
        for number in 0..2 * PAIRS {
            socket.write_frame(&sent(&classic(FIRST, &number.to_be_bytes()))).unwrap();
            let pause = Duration::from_millis(if number % 2 == 0 { 1 } else { 11 });
            let_pass(pause, "between two frames");
        }
        socket.write_frame(&sent(&end)).unwrap();
    });
    let batches = inbox.until_frame(end).await;
    let wakeups = wakeups() - before;
    sender.join().unwrap();
    println!("{} frames, {} batches, {wakeups} wake-ups", 2 * PAIRS, batches.len());
    assert!(wakeups <= usize::from(2 * PAIRS) * 6 / 5, "{wakeups} wake-ups");
}

#[tokio::test]
async fn a_burst_of_many_batches_comes_whole_and_in_order() {
    let vcan = require!(Vcan::new("vcan-burst"));
    let end = classic(SECOND, &[]);
    for count in [63, 64, 65, 5000] {
        let mut inbox = Inbox::of(&vcan, &[FIRST, SECOND]).await; // for the task, a frame after a pause
        send(&vcan, numbered(FIRST, count).chain([sent(&end)]));
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
async fn the_task_ends_when_the_receiver_is_dropped() {
    let vcan = require!(Vcan::new("vcan-nobody"));
    let Inbox { inputs, task } = Inbox::of(&vcan, &[FIRST]).await;
    drop(inputs);
    timeout(DEADLINE, task).await.expect("the task ends on an idle bus").unwrap();
}
