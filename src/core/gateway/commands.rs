//! Commands to the vehicle, among the other flows: what they are told, and what comes of it.

use super::{Gateway, news};
use crate::core::command::allow_list::CommandFrame;
use crate::core::command::flow::CommandFlow;
use crate::core::command::sender::SendFailure;
use crate::core::command::{Reported, Turn};
use crate::core::diagnostics::Status;
use crate::core::gateway::event::Output;
use crate::core::time::{MonoTime, Now};
use crate::core::turn_signal::output::TurnSignalOutput;
use crate::core::vehicle_lights::VehicleLights;
use crate::core::vehicle_lights::verdict::{HazardLights, TurnIndicators};

impl Gateway {
    /// From now on [`Self::handle`] leaves commands to [`Self::settle_commands`]: live, inputs and
    /// deadlines are handled a little after their time, but frames to the vehicle keep real time.
    pub fn set_commands_apart(&mut self) {
        self.commands_apart = true;
    }

    /// Brings commands up to now, which never lies before an earlier call.
    pub fn settle_commands(&mut self, now: Now) {
        let changed = self.commands_settled(now);
        if !changed.is_empty() {
            self.say(changed, false, now);
        }
    }

    /// Says when a frame of [`CommandOutput::Transmit`](crate::core::command::output::CommandOutput::Transmit) was sent, before anything else is done.
    pub fn sent(&mut self, frame: &CommandFrame, at: MonoTime) {
        self.command.iter_mut().for_each(|flow| flow.sent(frame, at));
    }

    /// Takes back a frame of [`CommandOutput::Transmit`](crate::core::command::output::CommandOutput::Transmit) that could not be sent, before anything else
    /// is done.
    pub fn not_sent(&mut self, frame: &CommandFrame, why: SendFailure, now: Now) {
        self.command.iter_mut().for_each(|flow| flow.not_sent(frame, why, now));
    }

    /// When commands have to be settled though nothing else happens.
    pub fn next_command_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        self.command.as_ref().and_then(|flow| flow.next_deadline(now))
    }

    /// Whether nothing is left to be sent after [`Input::Stop`]; always, when nothing is ever sent.
    ///
    /// [`Input::Stop`]: crate::core::gateway::event::Input::Stop
    pub fn is_finished(&self) -> bool {
        self.command.as_ref().is_none_or(CommandFlow::is_finished)
    }

    /// Queues the frames that are due; gives the statuses that say something new.
    pub(super) fn commands_settled(&mut self, now: Now) -> Vec<Status> {
        let Some(flow) = &mut self.command else { return Vec::new() };
        flow.report(reported(&self.lights));
        let has_news = flow.settle(&self.buses, now);
        self.outputs.extend(std::iter::from_fn(|| flow.poll_output()).map(Output::Command));
        if !has_news {
            return Vec::new();
        }
        let statuses = self.command_statuses(now.mono);
        news(statuses, &mut self.command_said)
    }

    pub(super) fn command_statuses(&self, now: MonoTime) -> Vec<Status> {
        let flow = self.command.as_ref();
        flow.map(|flow| flow.statuses(&self.node, &self.buses, now)).unwrap_or_default()
    }
}

/// Hands on what the decider commands, where it is the source.
pub(super) fn follow(flow: &mut CommandFlow, output: &TurnSignalOutput, now: Now) {
    if !flow.follows_decider() {
        return;
    }
    match output {
        TurnSignalOutput::TurnCommand { command, stamp } => flow.turn_command(*command as u8, *stamp, now),
        TurnSignalOutput::HazardCommand { command, stamp } => {
            flow.decider_hazard(*command as u8, *stamp, now);
        }
        TurnSignalOutput::Decision(_) => {}
    }
}

/// What the vehicle's lights are published as.
fn reported(lights: &VehicleLights) -> Reported {
    let (turn, hazard) = lights.reports();
    Reported {
        turn: turn.map(|turn| match turn {
            TurnIndicators::Disable => Turn::Off,
            TurnIndicators::EnableLeft => Turn::Left,
            TurnIndicators::EnableRight => Turn::Right,
        }),
        hazard: hazard.map(|hazard| hazard == HazardLights::Enable),
    }
}
