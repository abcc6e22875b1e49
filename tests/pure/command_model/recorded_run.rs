//! A run on live inputs, recorded as the daemon does it, and replayed call by call.

use std::path::Path;
use std::sync::LazyLock;

use proptest::prelude::*;
use proptest::test_runner::Config;

use can_log::Log;
use can_log::file_budget::FileBudget;
use can_signal::can::{BusIndex, CanId, CanInput, Frame, LinkState, LogNote};
use gateway_base::time::{MonoTime, Now, WallStamp};
use gateway_core::command::allow_list::CommandFrame;
use gateway_core::command::input::CommandInput;
use gateway_core::command::output::CommandOutput;
use gateway_core::command::sender::SendFailure;
use gateway_core::gateway::call::{GatewayCall, TimedCall};
use gateway_core::gateway::event::{Input, Output};
use gateway_core::gateway::live::{Edges, GivenOut, Live};
use ros_messages::autoware_vehicle_msgs::{ControlModeReport, TurnIndicatorsCommand};
use ros_messages::cdr::{CdrBytes, Endian};
use signal_gateway::config::Settings;
use signal_gateway::daemon::publisher::subscriptions;
use signal_gateway::daemon::recording::encoder;
use signal_gateway::io::mcap::encoder::{Encoder, RecordedMessage};
use signal_gateway::io::mcap::file::McapFile;
use signal_gateway::io::ros::reading::read;
use signal_gateway::io::ros::topics::{Subscription, SubscriptionKind};
use signal_gateway::io::sample_log::{LoggedSample, SampleKind, SampleLog};
use signal_gateway::process_status::PROCESS_TASKS;
use signal_gateway::replay::{Departures, NoRun, RecordedRun, Recording, Replay, Routes, RunSink};

use super::bench::settings;
use crate::support::clock::at_ns;
use crate::support::command_vehicle::{PROFILE, next_sample, request_text};

const LENGTH_MS: u64 = 3_000;

/// A run, and the messages of its recording in their order.
struct Recorded {
    encoder: Encoder,
    subscriptions: Vec<Subscription>,
    messages: Vec<RecordedMessage>,
    calls: u64,
    /// All that was given out, and when.
    published: Vec<(Output, WallStamp)>,
    decided: Vec<(Output, MonoTime)>,
    /// Frames that were submitted so far.
    submitted: u32,
}

impl Recorded {
    fn call(&mut self, call: GatewayCall, at: Now) {
        self.calls += 1;
        let timed = TimedCall { number: self.calls, at, call };
        self.messages.extend(self.encoder.call(&timed));
    }

    fn publish(&mut self, output: &Output, at: WallStamp) {
        self.published.push((output.clone(), at));
        self.messages.extend(self.encoder.given_out(output, at));
    }

    fn receive(&mut self, live: &mut Live, batch: Vec<CanInput>, read: Now) {
        self.call(GatewayCall::Read(u32::try_from(batch.len()).unwrap()), read);
        live.take(batch, read, |input, at| {
            let Input::Can(input) = input else { return };
            match LogNote::of(input) {
                Some((bus, note)) => self.call(GatewayCall::Note(bus, note), read),
                None => self.messages.extend(self.encoder.received(input, at.wall)),
            }
        });
    }

    fn receive_sample(&mut self, live: &mut Live, kind: SubscriptionKind, bytes: CdrBytes, read_at: Now) {
        let input = read(kind, next_sample(), bytes.as_ref(), Endian::Little).unwrap();
        self.call(GatewayCall::of_sample(&input), read_at);
        let subscription = self.subscriptions.iter().position(|topic| topic.kind == kind).unwrap();
        let message = self.encoder.sample(subscription, bytes, Endian::Little, read_at.wall);
        self.messages.extend(message);
        live.take([input], read_at, |_, _| ());
    }

    fn write(&self, path: &Path, without: Option<usize>) {
        self.write_those(path, |position, _| Some(position) != without);
    }

    /// Writes the messages that are chosen by position and topic.
    fn write_those(&self, path: &Path, is_written: impl Fn(usize, &str) -> bool) {
        let mut file = McapFile::create(path, true).unwrap();
        for (position, message) in self.messages.iter().enumerate() {
            if is_written(position, &self.encoder.channels()[message.channel].topic) {
                file.add(message, self.encoder.channels()).unwrap();
            }
        }
        file.finish().unwrap();
    }
}

impl Edges for Recorded {
    fn handles(&mut self, _: &Input, _: Now) {}

    fn transmit(&mut self, output: &Output, frame: &CommandFrame, read: Now) -> (CommandInput, Now) {
        self.submitted += 1;
        let known = Now { mono: MonoTime::from_nanos(read.mono.as_nanos() + 12_345), ..read };
        let result = if self.submitted.is_multiple_of(7) {
            CommandInput::SendFailed { frame: frame.clone(), failure: SendFailure::QueueFull }
        } else {
            self.publish(output, read.wall);
            CommandInput::Sent(frame.clone())
        };
        self.call(GatewayCall::of_result(&result).unwrap(), known);
        (result, known)
    }

    fn give_out(&mut self, GivenOut { output, at, lag, is_held }: GivenOut) {
        self.decided.push((output.clone(), at.mono));
        if !is_held && !matches!(output, Output::Command(CommandOutput::Transmit { .. })) {
            self.publish(&output, at.wall.after(lag));
        }
    }

    fn publish_late(&mut self, output: &Output, read: Now) {
        self.publish(output, read.wall);
    }

    fn end_moment(&mut self, _: Now) {}
}

fn car() -> Settings {
    settings("tx = \"on\"", PROFILE)
}

/// A run with frames, commands, a link that goes down and comes back, lost frames, a full queue and a stop;
/// no time is a whole millisecond, and once nothing is looked at for half a second.
fn recorded() -> Recorded {
    let settings = car();
    let mut run = Recorded {
        encoder: encoder(&settings),
        subscriptions: subscriptions(&settings),
        messages: Vec::new(),
        calls: 0,
        published: Vec::new(),
        decided: Vec::new(),
        submitted: 0,
    };
    let bus = BusIndex(0);
    let start = at_ns(77);
    run.call(GatewayCall::Start(vec![LinkState::Up]), start);
    let mut live = Live::new(settings.gateway.clone(), &[LinkState::Up], start);
    for ms in 0..LENGTH_MS {
        let read = at_ns(ms * 1_000_003 + 901);
        if ms % 13 == 0 {
            let frame = |lights: u8| {
                let frame = Frame::classic(CanId::Standard(560), &[lights, 0, 0, 0]).unwrap();
                CanInput::Frame { bus, frame, stamp: at_ns((ms * 1_000_003).saturating_sub(4_000_000)).wall }
            };
            let lights = u8::try_from(ms / 700 % 2).unwrap();
            run.receive(&mut live, vec![frame(lights), frame(lights)], read);
        }
        if ms % 90 == 0 {
            let stamp = read.wall.into();
            let mode = CdrBytes::encode(&ControlModeReport { stamp, mode: 1 }).unwrap();
            run.receive_sample(&mut live, SubscriptionKind::ControlMode, mode, read);
            let command = u8::try_from(1 + ms / 450 % 3).unwrap();
            let turn = CdrBytes::encode(&TurnIndicatorsCommand { stamp, command }).unwrap();
            run.receive_sample(&mut live, SubscriptionKind::TurnCommand, turn, read);
        }
        let link = |state| CanInput::Link { bus, state };
        match ms {
            1_000 => {
                run.receive(&mut live, vec![CanInput::Drops { bus, lost: 3 }, link(LinkState::Down)], read);
            }
            1_200 => run.receive(&mut live, vec![link(LinkState::Up)], read),
            1_500 => {
                run.call(GatewayCall::Reconfigure, read);
                live.reconfigure(settings.gateway.clone());
            }
            2_900 => {
                run.call(GatewayCall::Stop, read);
                live.take([CommandInput::Stop], read, |_, _| ());
            }
            _ => {}
        }
        if !(2_000..2_500).contains(&ms) {
            run.call(GatewayCall::Look, read);
            live.look(read, &mut run);
        }
    }
    run
}

#[derive(Default)]
struct Seen {
    calls: u64,
    published: Vec<(Output, WallStamp)>,
    decided: Vec<(Output, MonoTime)>,
}

impl RunSink for Seen {
    fn call(&mut self, _: &TimedCall) {
        self.calls += 1;
    }

    fn received(&mut self, _: &CanInput, _: Now) {}

    fn handles(&mut self, _: &CanInput, _: Now) {}

    fn sample(&mut self, _: &LoggedSample) {}

    fn decided(&mut self, output: &Output, at: MonoTime) {
        self.decided.push((output.clone(), at));
    }

    fn published(&mut self, output: &Output, at: WallStamp) {
        self.published.push((output.clone(), at));
    }
}

/// The run in a file.
fn replayed(path: &Path) -> Result<(Seen, Option<Departures>), NoRun> {
    let settings = car();
    let topics = encoder(&settings).inputs(&subscriptions(&settings));
    let mut seen = Seen::default();
    let log = SampleLog::open(path, topics, FileBudget::default()).unwrap();
    let mut run = RecordedRun::begin(settings.gateway, log, &mut seen).unwrap()?;
    while run.step(&mut seen).unwrap() {}
    Ok((seen, run.departures().cloned()))
}

#[test]
fn a_recorded_run_decides_and_publishes_the_same_at_the_same_times() {
    let run = recorded();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    run.write(&path, None);
    let (seen, departures) = replayed(&path).unwrap();
    assert_eq!(departures, None);
    assert_eq!(seen.calls, run.calls);
    assert!(seen.decided == run.decided, "{} {}", seen.decided.len(), run.decided.len());
    assert!(seen.published == run.published, "{} {}", seen.published.len(), run.published.len());
    let sent = |output: &Output| matches!(output, Output::Command(CommandOutput::Transmit { .. }));
    let [sent, decided] =
        [&run.published.iter().filter(|(output, _)| sent(output)).count(), &run.published.len()];
    assert!(*sent > 30 && *decided > 100, "{sent} of {decided}");
    assert!(run.decided.len() > run.published.len(), "a late report is not published");
}

#[test]
fn a_message_that_is_missing_is_told_and_ends_nothing() {
    let run = recorded();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let channels = run.encoder.channels();
    let told = |topic: &str, nth: usize| {
        let of_topic = |message: &RecordedMessage| channels[message.channel].topic.ends_with(topic);
        let position = run.messages.iter().enumerate().filter(|(_, message)| of_topic(message)).nth(nth);
        run.write(&path, Some(position.unwrap().0));
        let (seen, departures) = replayed(&path).unwrap();
        assert!(seen.calls + 1 >= run.calls, "{topic}");
        departures.unwrap_or_else(|| panic!("{topic} {nth}")).reason
    };
    assert_eq!(told("from_can_bus", 200), "frames are missing in the recording");
    assert_eq!(told("turn_indicators_cmd", 20), "a sample is missing in the recording");
    let reasons: std::collections::BTreeSet<_> = (30..60).map(|nth| told("/calls", nth * 11)).collect();
    assert!(reasons.contains("calls are missing in the recording"), "{reasons:?}");
    run.write(&path, Some(0));
    assert_eq!(replayed(&path).err(), Some(NoRun::NoStart));
}

#[test]
fn messages_that_were_sorted_by_their_times_are_no_run() {
    let mut run = recorded();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    run.messages.sort_by_key(|message| message.log_time.as_nanos());
    run.write(&path, None);
    assert_eq!(replayed(&path).err(), Some(NoRun::NoStart), "the first frames were received before it");
    run.write_those(&path, |position, topic| position > 2 || topic.ends_with("/calls"));
    assert_eq!(replayed(&path).err(), Some(NoRun::OtherOrder));
}

#[test]
fn a_recording_that_was_cut_is_replayed_up_to_there() {
    let run = recorded();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    run.write(&path, None);
    let whole = std::fs::read(&path).unwrap();
    std::fs::write(&path, &whole[..whole.len() / 3]).unwrap();
    let (seen, departures) = replayed(&path).unwrap();
    assert_eq!(departures, None);
    assert!(run.published.starts_with(&seen.published), "the same as far as it goes");
    assert!(seen.published.len() > 20, "{}", seen.published.len());
}

#[test]
fn what_another_recorder_received_is_replayed_by_its_stamps() {
    let run = recorded();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let requested = |is_written: &dyn Fn(&str) -> bool| {
        run.write_those(&path, |_, topic| is_written(topic));
        let settings = car();
        let topics = encoder(&settings).inputs(&subscriptions(&settings));
        let topics = topics.into_iter().filter(|(_, kind)| !matches!(kind, SampleKind::Frames { .. }));
        let samples = Some(SampleLog::open(&path, topics.collect(), FileBudget::default()).unwrap());
        let routes = Routes::by_interface(&settings.gateway);
        let recording = Recording { log: Log::open(&path).unwrap(), samples };
        let mut replay = Replay::new(settings.gateway, recording, routes).unwrap();
        let (mut requests, mut is_told_down) = (Vec::new(), false);
        loop {
            while let Some(output) = replay.poll_output() {
                if let Output::Command(CommandOutput::WouldTransmit { frame, .. }) = &output {
                    requests.push(request_text(frame.data()));
                } else if let Output::Diagnostics { diagnostics, .. } = &output {
                    is_told_down |=
                        diagnostics.statuses.iter().any(|status| status.message.contains("can0 is down"));
                }
            }
            if !replay.step().unwrap() {
                break;
            }
        }
        requests.dedup();
        (requests, is_told_down, replay.counts())
    };
    let (requests, is_told_down, counts) = requested(&|topic| !topic.ends_with("/calls"));
    assert!(counts.records > 400 && counts.samples == 68, "{counts:?}");
    for request in ["off", "left", "right"] {
        assert!(requests.iter().any(|text| text.starts_with(request)), "{request}: {requests:?}");
    }
    assert!(!is_told_down, "what a bus did tells the gateway alone");
    let (_, is_told_down, _) = requested(&|_| true);
    assert!(is_told_down);
    let (requests, _, counts) =
        requested(&|topic| topic.ends_with("_cmd") || topic.ends_with("control_mode"));
    assert!(counts.records == 0 && counts.samples == 68, "without frames: {counts:?}");
    assert!(!requests.is_empty());
}

#[test]
fn the_documents_list_what_no_replay_has() {
    let text = include_str!("../../../docs/recordings.md");
    let listed =
        text.split_once("the statuses of the process itself").unwrap().1.split_once(".\n").unwrap().0;
    let names: Vec<_> = listed.split('`').skip(1).step_by(2).skip(1).collect();
    assert_eq!(names, PROCESS_TASKS);
}

proptest! {
    #![proptest_config(Config { cases: 16, failure_persistence: None, ..Config::default() })]

    /// Times of centuries, other numbers and kinds, calls without what belongs to them: the replay comes to
    /// its end.
    #[test]
    fn calls_of_any_content_and_order_end_nothing(
        changes in prop::collection::vec((0..400_usize, 0..64_usize, any::<u8>()), 1..20),
        swaps in prop::collection::vec((0..400_usize, 0..400_usize), 0..10),
    ) {
        static RUN: LazyLock<Recorded> = LazyLock::new(recorded);
        let mut messages = RUN.messages[..400].to_vec();
        for (position, byte, value) in changes {
            let message = &mut messages[position];
            let mut bytes = message.bytes.as_ref().to_vec();
            let place = byte % bytes.len();
            bytes[place] = value;
            message.bytes = CdrBytes::from(bytes);
        }
        for (one, other) in swaps {
            messages.swap(one, other);
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        let mut file = McapFile::create(&path, true).unwrap();
        for message in &messages {
            file.add(message, RUN.encoder.channels()).unwrap();
        }
        file.finish().unwrap();
        if let Ok((seen, departures)) = replayed(&path) {
            prop_assert!(seen.calls <= 400);
            prop_assert!(departures.is_none_or(|departures| departures.times <= 2_000));
        }
    }
}
