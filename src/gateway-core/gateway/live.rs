//! Runs the gateway on live inputs: perception in the steps of a replay, commands in real time.
//!
//! Inputs of perception are handled as soon as they are read, at the time they were received. A deadline is
//! handled before the first input that was received after it, or [`LAG`] after its time. Commands and frames
//! to the vehicle do not wait for this: they are due by the clock.

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

/// What a live gateway is connected to: the sockets and files of the daemon, or the recording of a run.
pub trait Edges {
    /// An input or deadline of perception is handled next, at this time.
    fn handles(&mut self, input: &Input, at: Now);

    /// Sends the frame of an output to the vehicle, which the gateway decided on at `read`. Returns the
    /// result, and when it was known.
    fn transmit(&mut self, output: &Output, frame: &CommandFrame, read: Now) -> (CommandInput, Now);

    /// Takes an output.
    fn give_out(&mut self, output: GivenOut);

    /// Publishes a report that was held because it was late.
    fn publish_late(&mut self, output: &Output, read: Now);

    /// All outputs of a time have been given out.
    fn end_moment(&mut self, at: Now);
}

/// An output of a live gateway.
#[derive(Debug, Clone, PartialEq)]
pub struct GivenOut {
    /// The output.
    pub output: Output,
    /// When its decision was due.
    pub at: Now,
    /// By how much later it is given out.
    pub lag: Duration,
    /// The report is too late to be published now: [`Edges::publish_late`] follows unless a newer one comes
    /// first.
    pub is_held: bool,
}

impl GivenOut {
    /// Creates an output that is given out when it was due.
    pub fn on_time(output: Output, at: Now) -> Self {
        Self { output, at, lag: Duration::ZERO, is_held: false }
    }
}

/// A gateway on live inputs.
#[derive(Debug)]
pub struct Live {
    gateway: Gateway,
    time: LiveTime,
    /// Inputs of perception that were read but not handled.
    waiting: VecDeque<(Input, Now)>,
    handled: MonoTime,
    late_reports: LateReports,
}

impl Live {
    /// Starts a gateway with the link of each bus.
    pub fn new(settings: GatewaySettings, links: &[LinkState], now: Now) -> Self {
        let gateway = Gateway::with_links(settings, links, now);
        let (time, handled) = (LiveTime::starting_at(now), now.mono);
        Self { gateway, time, waiting: VecDeque::new(), handled, late_reports: LateReports::default() }
    }

    /// Takes inputs that were read at `read`, commands are handled at once; inputs of perception are queued,
    /// each after `observe` has seen it with its time. Then call [`Self::look`].
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

    /// Handles what is due at `read`, and gives out what comes of it.
    pub fn look(&mut self, read: Now, edges: &mut impl Edges) {
        // The outputs from before the first step belong to the start.
        self.give_out(read, self.now(), edges);
        while let Some(at) = self.step(read.mono, |input, at| edges.handles(input, at)) {
            self.give_out(read, at, edges);
        }
        // All that was due at `read` is decided: what is held now is current.
        for output in self.late_reports.take() {
            edges.publish_late(&output, read);
        }
        self.settle_commands(read);
        self.give_out(read, read, edges);
    }

    /// Gives out the outputs of a decision at `at` that was made at `read`. The result of sending a frame to
    /// the vehicle goes back as an input.
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

    /// Handles the next input or deadline of perception that is due at `read`, after `observe` has seen it.
    /// Returns its time, or `None` if nothing is due.
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

    /// Returns the gateway.
    pub fn gateway(&self) -> &Gateway {
        &self.gateway
    }

    /// Returns the time of the last step, or of the start.
    pub fn now(&self) -> Now {
        self.time.now(self.handled)
    }

    /// Queues the frames to the vehicle that are due at `read`. Call it after the steps until then.
    pub fn settle_commands(&mut self, read: Now) {
        self.gateway.read_wall_clock(read);
        self.gateway.settle_commands(read);
    }

    /// Returns true if the last frames to the vehicle are out, after
    /// [`CommandInput::Stop`].
    pub fn is_finished(&self) -> bool {
        self.gateway.is_finished()
    }

    /// Returns when to call [`Self::step`] and [`Self::settle_commands`] if nothing is read before.
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
