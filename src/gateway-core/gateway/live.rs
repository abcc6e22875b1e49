//! Runs the gateway on live inputs: perception in the same steps as a replay, commands in real time.
//!
//! Inputs of perception are handled as soon as they are read, with the time at which they were received. A
//! deadline is handled before the first input received after it, or [`LAG`] after its time. Commands and
//! frames to the vehicle do not wait for this: they follow the real-time clock.

use std::collections::VecDeque;
use std::time::Duration;

use super::event::{Input, Output};
use super::late_reports::LateReports;
use super::live_time::{LAG, LiveTime};
use super::{Gateway, GatewaySettings};
use crate::command::allow_list::CommandFrame;
use crate::command::input::CommandInput;
use crate::command::output::CommandOutput;
use can_signal::can::LinkState;
use gateway_base::time::{MonoTime, Now};

/// Connections of a live gateway: the sockets and files of the daemon, or the recording of a run.
pub trait Edges {
    /// Called before an input or deadline of perception is handled at this time.
    fn handles(&mut self, input: &Input, at: Now);

    /// Sends the frame of an output to the vehicle; the gateway decided on it at `read`. Returns the result,
    /// and when it was known.
    fn transmit(&mut self, output: &Output, frame: &CommandFrame, read: Now) -> (CommandInput, Now);

    /// Publishes an output.
    fn give_out(&mut self, output: GivenOut);

    /// Publishes a report that was held because it was late.
    fn publish_late(&mut self, output: &Output, read: Now);

    /// Called when all outputs of a time have been published.
    fn end_moment(&mut self, at: Now);
}

/// An output of a live gateway, with the time of its decision.
#[derive(Debug, Clone, PartialEq)]
pub struct GivenOut {
    /// The output to publish.
    pub output: Output,
    /// Time at which its decision was due.
    pub at: Now,
    /// Delay from `at` until the output is published.
    pub lag: Duration,
    /// True if the report is too late to be published now: [`Edges::publish_late`] follows unless a newer
    /// report comes first.
    pub is_held: bool,
}

impl GivenOut {
    /// Creates an output that is published at the time it was due.
    pub fn on_time(output: Output, at: Now) -> Self {
        Self { output, at, lag: Duration::ZERO, is_held: false }
    }
}

/// A gateway on live inputs.
#[derive(Debug)]
pub struct Live {
    gateway: Gateway,
    time: LiveTime,
    /// Inputs of perception that have been read but not handled.
    waiting: VecDeque<(Input, Now)>,
    handled: MonoTime,
    late_reports: LateReports,
}

impl Live {
    /// Starts a gateway with the link state of each bus.
    pub fn new(settings: GatewaySettings, links: &[LinkState], now: Now) -> Self {
        let gateway = Gateway::with_links(settings, links, now);
        let (time, handled) = (LiveTime::starting_at(now), now.mono);
        Self { gateway, time, waiting: VecDeque::new(), handled, late_reports: LateReports::default() }
    }

    /// Accepts inputs that were read at `read`. Commands are handled immediately; inputs of perception are
    /// queued after `observe` has received each with its time. Then call [`Self::look`].
    pub fn take<I: Into<Input>>(
        &mut self,
        inputs: impl IntoIterator<Item = I>,
        read: Now,
        mut observe: impl FnMut(&Input, Now),
    ) {
        for input in inputs {
            match input.into() {
                Input::Command(command) => self.gateway.handle_command(command, read),
                input @ (Input::Can(_) | Input::TrafficLight(_) | Input::Planner(_) | Input::Tick) => {
                    let at = self.time.arrival(input.stamp().unwrap_or(read.wall), read);
                    observe(&input, at);
                    self.waiting.push_back((input, at));
                }
            }
        }
    }

    /// Handles everything that is due at `read`, and publishes the resulting outputs.
    pub fn look(&mut self, read: Now, edges: &mut impl Edges) {
        // Outputs from before the first step belong to the start.
        self.give_out(read, self.now(), edges);
        while let Some(at) = self.step(read.mono, |input, at| edges.handles(input, at)) {
            self.give_out(read, at, edges);
        }
        // Everything due at `read` is decided, so the held reports are current.
        for output in self.late_reports.take() {
            edges.publish_late(&output, read);
        }
        self.settle_commands(read);
        self.give_out(read, read, edges);
    }

    /// Publishes the outputs of a decision due at `at` and made at `read`. The result of sending a frame to
    /// the vehicle is passed back as an input.
    fn give_out(&mut self, read: Now, at: Now, edges: &mut impl Edges) {
        while let Some(output) = self.poll_output() {
            if let Output::Command(CommandOutput::Transmit { frame, .. }) = &output {
                let (result, known) = edges.transmit(&output, frame, read);
                self.gateway.handle_command(result, known);
            }
            let lag = read.mono.since(at.mono);
            let is_held = self.late_reports.holds(&output, lag);
            edges.give_out(GivenOut { output, at, lag, is_held });
        }
        edges.end_moment(at);
    }

    /// Passes the next input or deadline of perception that is due at `read` to `observe`, then handles it.
    /// Returns its time; `None` if nothing is due.
    pub fn step(&mut self, read: MonoTime, observe: impl FnOnce(&Input, Now)) -> Option<Now> {
        let deadline = self.next_deadline();
        let is_input = self.waiting.front().map(|(_, at)| at.mono < deadline);
        let (input, at) = match is_input {
            None if deadline.after(LAG) > read => return None,
            Some(true) => self.waiting.pop_front()?,
            Some(false) | None => (Input::Tick, self.time.deadline(deadline)),
        };
        observe(&input, at);
        self.handled = at.mono;
        self.gateway.handle_perception(input, at);
        Some(at)
    }

    /// Continues with other settings, see [`Gateway::reconfigure`]. Queued inputs are handled with the new
    /// settings.
    pub fn reconfigure(&mut self, settings: GatewaySettings) {
        let now = self.now();
        self.gateway.reconfigure(settings, now);
    }

    /// Returns the gateway behind the live inputs.
    pub fn gateway(&self) -> &Gateway {
        &self.gateway
    }

    /// Returns the time of the last step, or of the start.
    pub fn now(&self) -> Now {
        self.time.now(self.handled)
    }

    /// Queues the frames to the vehicle that are due at `read`. Call it after all steps up to `read`.
    pub fn settle_commands(&mut self, read: Now) {
        self.gateway.read_wall_clock(read);
        self.gateway.settle_commands(read);
    }

    /// Returns true after [`CommandInput::Stop`] once the last frames to the vehicle have been sent.
    pub fn is_finished(&self) -> bool {
        self.gateway.is_finished()
    }

    /// Returns when to call [`Self::step`] and [`Self::settle_commands`] if nothing is read earlier.
    pub fn wake_at(&self) -> MonoTime {
        let step = self.next_deadline().after(LAG);
        self.gateway.next_command_deadline().map_or(step, |due| due.min(step))
    }

    /// Returns the next output, oldest first.
    pub fn poll_output(&mut self) -> Option<Output> {
        self.gateway.poll_output()
    }

    fn next_deadline(&self) -> MonoTime {
        self.gateway.next_perception_deadline().max(self.handled)
    }
}
