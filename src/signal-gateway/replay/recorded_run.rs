//! A recorded run of the gateway, call by call. The recording contains its inputs, the times of its calls,
//! and the results of sending its frames, so a replay makes the same decisions, to the byte and at the same
//! times.

use std::collections::VecDeque;
use std::io;
use std::time::Duration;

use derive_more::Display;

use crate::io::sample_log::{LoggedSample, SampleContent, SampleLog};
use can_signal::can::CanInput;
use gateway_base::time::gap_filling::{FILLED_IN_ALL, MAX_SILENCE};
use gateway_base::time::{MonoTime, Now, WallStamp};
use gateway_core::command::allow_list::CommandFrame;
use gateway_core::command::input::CommandInput;
use gateway_core::command::output::CommandOutput;
use gateway_core::gateway::GatewaySettings;
use gateway_core::gateway::call::{GatewayCall, TimedCall};
use gateway_core::gateway::event::{Input, Output};
use gateway_core::gateway::live::{Edges, GivenOut, Live};

/// Maximum number of inputs in a batch; the gateway reads far fewer.
const MAX_BATCH: u32 = 1 << 16;
/// Number of messages read ahead to check whether they are in the order in which the gateway read them.
const AHEAD: usize = 256;
/// Maximum time between two calls of a gateway that is not held up, since its statuses are due every second.
const USUAL_STEP: Duration = Duration::from_secs(1);

/// Receives the events of a recorded run.
pub trait RunSink {
    /// A call is made at its recorded time.
    fn call(&mut self, call: &TimedCall);

    /// An input of a bus is queued for this time.
    fn received(&mut self, input: &CanInput, at: Now);

    /// An input of a bus is handled next, at this time.
    fn handles(&mut self, input: &CanInput, at: Now);

    /// A sample of ROS 2 is passed to the gateway.
    fn sample(&mut self, sample: &LoggedSample);

    /// An output was decided at this time.
    fn decided(&mut self, output: &Output, at: MonoTime);

    /// An output was published, or its frame was sent.
    fn published(&mut self, output: &Output, at: WallStamp);
}

/// Points where a replay could not follow the recorded run.
#[derive(Debug, Clone, PartialEq, Eq, Display)]
#[display("the replay departs from the recorded run {times} times, first at {:.3} s: {reason}", at.since(MonoTime::ZERO).as_secs_f64())]
pub struct Departures {
    /// Number of departures.
    pub times: u64,
    /// Time of the first departure, since the start of the run.
    pub at: MonoTime,
    /// Description of the first departure.
    pub reason: &'static str,
}

/// Reason why a recording is not replayed call by call.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display)]
pub enum NoRun {
    /// It has no calls, like recordings of other recorders.
    #[display("it has no calls of the gateway")]
    NoCalls,
    /// Its first part is missing.
    #[display("it does not begin with the start of the gateway")]
    NoStart,
    /// The configuration has a different number of buses.
    #[display("its gateway had another number of buses")]
    OtherBuses,
    /// A tool has reordered the messages.
    #[display("its messages are not in the order in which the gateway read them")]
    OtherOrder,
}

/// A gateway that replays the calls of a recorded run.
pub struct RecordedRun {
    live: Live,
    settings: GatewaySettings,
    calls: Calls,
}

struct Calls {
    log: SampleLog,
    ahead: VecDeque<LoggedSample>,
    number: u64,
    at: Now,
    /// Remaining total time by which steps may exceed [`USUAL_STEP`].
    held_up: Duration,
    departures: Option<Departures>,
}

impl RecordedRun {
    /// Begins a run with these settings, or returns the reason why the recording is not a run.
    pub fn begin(
        settings: GatewaySettings,
        mut log: SampleLog,
        sink: &mut impl RunSink,
    ) -> io::Result<Result<Self, NoRun>> {
        let mut ahead = VecDeque::new();
        while ahead.len() < AHEAD
            && let Some(sample) = log.next_sample()?
        {
            ahead.push_back(sample);
        }
        let has_calls = ahead.iter().any(|sample| matches!(sample.content, SampleContent::Call(_)));
        let Some(SampleContent::Call(start)) = ahead.pop_front().map(|first| first.content) else {
            return Ok(Err(if has_calls { NoRun::NoStart } else { NoRun::NoCalls }));
        };
        let TimedCall { number: 1, at, call: GatewayCall::Start(links) } = &start else {
            return Ok(Err(NoRun::NoStart));
        };
        if links.len() != settings.buses.len() {
            return Ok(Err(NoRun::OtherBuses));
        }
        if !is_in_order(&ahead) {
            return Ok(Err(NoRun::OtherOrder));
        }
        sink.call(&start);
        let live = Live::new(settings.clone(), links, *at);
        let calls = Calls { log, ahead, number: 1, at: *at, held_up: FILLED_IN_ALL, departures: None };
        Ok(Ok(Self { live, settings, calls }))
    }

    /// Makes the next call; returns false at the end of the recording.
    pub fn step(&mut self, sink: &mut impl RunSink) -> io::Result<bool> {
        let Some(sample) = self.calls.take()? else { return Ok(false) };
        match sample.content {
            SampleContent::Call(mut timed) => {
                self.calls.accept(&mut timed, sink);
                self.make(timed, sink)?;
            }
            SampleContent::Input(Input::Can(input)) => {
                self.calls.depart("a frame is not where it was read");
                self.receive(vec![input], sink);
            }
            SampleContent::Input(_) => {
                self.calls.depart("a sample is not where it was read");
                self.receive_sample(sample, sink);
            }
            SampleContent::TurnReport(_) => {}
        }
        Ok(true)
    }

    fn make(&mut self, TimedCall { at, call, .. }: TimedCall, sink: &mut impl RunSink) -> io::Result<()> {
        match call {
            GatewayCall::Start(_) => self.calls.depart("the gateway was started again"),
            GatewayCall::Read(count) => {
                let batch = self.calls.batch(count, sink)?;
                self.receive(batch, sink);
            }
            GatewayCall::Note(bus, note) => {
                self.calls.depart("a note is not where it was read");
                self.receive(note.input(bus).into_iter().collect(), sink);
            }
            GatewayCall::Sample(_) => match self.calls.next_if(is_sample)? {
                Some(sample) => self.receive_sample(sample, sink),
                None => self.calls.depart("a sample is missing in the recording"),
            },
            GatewayCall::Look => {
                let mut edges = RunEdges { calls: &mut self.calls, sink, failed: Ok(()) };
                self.live.look(at, &mut edges);
                edges.failed?;
            }
            GatewayCall::Sent | GatewayCall::SendFailed(_) => {
                self.calls.depart("a frame was sent then that is not given out now");
            }
            GatewayCall::Reconfigure => self.live.reconfigure(self.settings.clone()),
            GatewayCall::Stop => self.live.take([CommandInput::Stop], at, |_, _| ()),
        }
        Ok(())
    }

    fn receive(&mut self, batch: Vec<CanInput>, sink: &mut impl RunSink) {
        self.live.take(batch, self.calls.at, |input, at| {
            if let Input::Can(input) = input {
                sink.received(input, at);
            }
        });
    }

    fn receive_sample(&mut self, sample: LoggedSample, sink: &mut impl RunSink) {
        sink.sample(&sample);
        if let SampleContent::Input(input) = sample.content {
            self.live.take([input], self.calls.at, |_, _| ());
        }
    }

    /// Returns the time of the last call.
    pub fn now(&self) -> Now {
        self.calls.at
    }

    /// Returns the departures from the recorded run; `None` if there was none.
    pub fn departures(&self) -> Option<&Departures> {
        self.calls.departures.as_ref()
    }

    /// Returns the recording, with its read errors.
    pub fn log(&self) -> &SampleLog {
        &self.calls.log
    }
}

impl Calls {
    fn take(&mut self) -> io::Result<Option<LoggedSample>> {
        let next = self.ahead.pop_front();
        if next.is_some() {
            self.ahead.extend(self.log.next_sample()?);
        }
        Ok(next)
    }

    fn next_if(&mut self, is_wanted: impl FnOnce(&LoggedSample) -> bool) -> io::Result<Option<LoggedSample>> {
        if self.ahead.front().is_some_and(is_wanted) { self.take() } else { Ok(None) }
    }

    /// Advances to a recorded call. Its clock can neither run back, nor so far ahead that handling the
    /// deadlines until then never ends.
    fn accept(&mut self, timed: &mut TimedCall, sink: &mut impl RunSink) {
        let from = self.at.mono;
        let to = from.after(MAX_SILENCE.min(USUAL_STEP.saturating_add(self.held_up)));
        if !(from..=to).contains(&timed.at.mono) {
            self.depart("a call has an impossible time");
            timed.at.mono = timed.at.mono.clamp(from, to);
        }
        self.held_up = self.held_up.saturating_sub(timed.at.mono.since(from).saturating_sub(USUAL_STEP));
        self.at = timed.at;
        if timed.number != self.number + 1 {
            self.depart("calls are missing in the recording");
        }
        self.number = timed.number;
        sink.call(timed);
    }

    fn batch(&mut self, count: u32, sink: &mut impl RunSink) -> io::Result<Vec<CanInput>> {
        let mut batch = Vec::new();
        for _ in 0..count.min(MAX_BATCH) {
            let next = self.next_if(is_of_bus)?;
            match next.map(|next| next.content) {
                Some(SampleContent::Input(Input::Can(input))) => batch.push(input),
                Some(SampleContent::Call(mut timed)) => {
                    self.accept(&mut timed, sink);
                    if let GatewayCall::Note(bus, note) = timed.call {
                        batch.extend(note.input(bus));
                    }
                }
                _ => {
                    self.depart("frames are missing in the recording");
                    break;
                }
            }
        }
        Ok(batch)
    }

    fn depart(&mut self, reason: &'static str) {
        let at = self.at.mono;
        self.departures.get_or_insert(Departures { times: 0, at, reason }).times += 1;
    }
}

/// Returns true if every frame and sample read ahead is in the position given by its call.
fn is_in_order(ahead: &VecDeque<LoggedSample>) -> bool {
    let mut messages = ahead.iter();
    let is_next = |next: Option<&LoggedSample>, is: fn(&LoggedSample) -> bool| next.is_none_or(is);
    while let Some(message) = messages.next() {
        let SampleContent::Call(timed) = &message.content else { return false };
        let is_right = match timed.call {
            GatewayCall::Read(count) => {
                (0..count.min(MAX_BATCH)).all(|_| is_next(messages.next(), is_of_bus))
            }
            GatewayCall::Sample(_) => is_next(messages.next(), is_sample),
            GatewayCall::Note(..) => false,
            GatewayCall::Start(_)
            | GatewayCall::Look
            | GatewayCall::Sent
            | GatewayCall::SendFailed(_)
            | GatewayCall::Reconfigure
            | GatewayCall::Stop => true,
        };
        if !is_right {
            return false;
        }
    }
    true
}

fn is_of_bus(next: &LoggedSample) -> bool {
    match &next.content {
        SampleContent::Input(Input::Can(_)) => true,
        SampleContent::Call(timed) => matches!(timed.call, GatewayCall::Note(..)),
        SampleContent::Input(_) | SampleContent::TurnReport(_) => false,
    }
}

fn is_sample(next: &LoggedSample) -> bool {
    matches!(&next.content, SampleContent::Input(input) if !matches!(input, Input::Can(_)))
}

fn is_result(next: &LoggedSample) -> bool {
    let is_result = |call: &GatewayCall| matches!(call, GatewayCall::Sent | GatewayCall::SendFailed(_));
    matches!(&next.content, SampleContent::Call(timed) if is_result(&timed.call))
}

/// Input and output of a recorded run. The result of sending each frame is the next call of the recording.
struct RunEdges<'a, S> {
    calls: &'a mut Calls,
    sink: &'a mut S,
    failed: io::Result<()>,
}

impl<S: RunSink> Edges for RunEdges<'_, S> {
    fn handles(&mut self, input: &Input, at: Now) {
        if let Input::Can(input) = input {
            self.sink.handles(input, at);
        }
    }

    fn transmit(&mut self, output: &Output, frame: &CommandFrame, read: Now) -> (CommandInput, Now) {
        let sample = self.calls.next_if(is_result).unwrap_or_else(|error| {
            self.failed = Err(error);
            None
        });
        let frame = frame.clone();
        let Some(SampleContent::Call(mut timed)) = sample.map(|sample| sample.content) else {
            self.calls.depart("a frame is given out now that was not sent then");
            self.sink.published(output, read.wall);
            return (CommandInput::Sent(frame), read);
        };
        let result = if let GatewayCall::SendFailed(failure) = timed.call {
            CommandInput::SendFailed { frame, failure }
        } else {
            self.sink.published(output, read.wall);
            CommandInput::Sent(frame)
        };
        self.calls.accept(&mut timed, self.sink);
        (result, timed.at)
    }

    fn give_out(&mut self, GivenOut { output, at, lag, is_held }: GivenOut) {
        self.sink.decided(&output, at.mono);
        if !is_held && !matches!(output, Output::Command(CommandOutput::Transmit { .. })) {
            self.sink.published(&output, at.wall.after(lag));
        }
    }

    fn publish_late(&mut self, output: &Output, read: Now) {
        self.sink.published(output, read.wall);
    }

    fn end_moment(&mut self, _: Now) {}
}
