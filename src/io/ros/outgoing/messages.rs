//! Messages on their way out, by the topic they are for.
//!
//! A report, command or emission that waits to be sent is replaced by a newer one of the same topic. Diagnostics keep
//! their order; when [`MAX_DIAGNOSTICS`] wait, the oldest is dropped.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use crate::core::gateway::event::Output;
use crate::core::time::WallStamp;
use crate::core::traffic_light::emission::{Emission, LightsTopic};
use crate::core::traffic_light::output::TrafficLightOutput;
use crate::core::turn_signal::decision::Decision;
use crate::core::turn_signal::output::TurnSignalOutput;
use crate::core::vehicle_lights::output::VehicleLightsOutput;
use crate::core::vehicle_lights::report::Step;
use crate::io::ros::messages::autoware_vehicle_msgs::{
    HazardLightsCommand, HazardLightsReport, TurnIndicatorsCommand, TurnIndicatorsReport,
};
use crate::io::ros::messages::diagnostic_msgs::DiagnosticArray;
use crate::io::ros::messages::rcl_interfaces::Log;
#[cfg(feature = "ros")]
use crate::io::ros::parameters::Parameters;

/// Diagnostics that may wait.
pub(in crate::io) const MAX_DIAGNOSTICS: usize = 64;

/// An instruction for a report topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::io) enum Publication<M> {
    /// Publish this message.
    Publish(M),
    /// Publish nothing, not even to late readers.
    Withdraw,
}

impl<M> Publication<M> {
    /// The publication of a step, as the message of its value.
    pub(in crate::io) fn of<T>(step: Step<T>, message: impl FnOnce(T, WallStamp) -> M) -> Self {
        match step {
            Step::Publish(value, stamp) => Self::Publish(message(value, stamp)),
            Step::Withdraw => Self::Withdraw,
        }
    }
}

/// A message for a topic, or the end.
#[derive(Debug)]
pub(in crate::io) enum OutgoingMessage {
    /// For the turn-indicators report.
    Turn(Publication<TurnIndicatorsReport>),
    /// For the hazard-lights report.
    Hazard(Publication<HazardLightsReport>),
    /// For the diagnostics.
    Diagnostics(DiagnosticArray),
    /// For the topics of its emissions; the thread makes the messages.
    Lights(Emission),
    /// For the turn command.
    TurnCommand(TurnIndicatorsCommand),
    /// For the hazard command.
    HazardCommand(HazardLightsCommand),
    /// For the topics of the decider's sections; the thread makes the messages.
    Sections(Arc<Decision>, WallStamp),
    /// The parameters of the node from now on.
    #[cfg(feature = "ros")]
    Parameters(Box<Parameters>),
    /// Leave the graph.
    #[cfg(feature = "ros")]
    Stop,
}

impl OutgoingMessage {
    /// The message that publishes an output; `None` for what is not published.
    pub(in crate::io) fn of(output: &Output, hardware_id: &str) -> Option<Self> {
        Some(match output {
            Output::VehicleLights(output) => match output {
                VehicleLightsOutput::TurnIndicators(step) => {
                    Self::Turn(Publication::of(*step, TurnIndicatorsReport::new))
                }
                VehicleLightsOutput::HazardLights(step) => {
                    Self::Hazard(Publication::of(*step, HazardLightsReport::new))
                }
            },
            Output::Diagnostics { diagnostics, stamp } => {
                Self::Diagnostics(DiagnosticArray::new(diagnostics, *stamp, hardware_id))
            }
            Output::TrafficLights(TrafficLightOutput::Publish(emission)) => Self::Lights(emission.clone()),
            Output::TurnSignal(TurnSignalOutput::TurnCommand { command, stamp }) => {
                Self::TurnCommand(TurnIndicatorsCommand::new(*command, *stamp))
            }
            Output::TurnSignal(TurnSignalOutput::HazardCommand { command, stamp }) => {
                Self::HazardCommand(HazardLightsCommand::new(*command, *stamp))
            }
            Output::TurnSignal(TurnSignalOutput::Sections { decision, stamp }) => {
                Self::Sections(Arc::clone(decision), *stamp)
            }
            Output::TurnSignal(TurnSignalOutput::Decision(_))
            | Output::TrafficLights(TrafficLightOutput::CommandRefused(_))
            | Output::Command(_) => return None,
        })
    }
}

/// Everything that waits.
#[derive(Debug, Default, PartialEq)]
pub(in crate::io) struct OutgoingMessages {
    /// The newest turn report, if there is a new one.
    pub(in crate::io) turn: Option<Publication<TurnIndicatorsReport>>,
    /// The newest hazard report, likewise.
    pub(in crate::io) hazard: Option<Publication<HazardLightsReport>>,
    /// Diagnostics, oldest first.
    pub(in crate::io) diagnostics: VecDeque<DiagnosticArray>,
    /// Warnings and errors, oldest first.
    pub(in crate::io) log: VecDeque<Log>,
    /// The newest emission of each topic.
    pub(in crate::io) lights: BTreeMap<LightsTopic, Emission>,
    /// The newest turn command.
    pub(in crate::io) turn_command: Option<TurnIndicatorsCommand>,
    /// The newest hazard command.
    pub(in crate::io) hazard_command: Option<HazardLightsCommand>,
    /// The newest decision with its sections, and its time.
    pub(in crate::io) sections: Option<(Arc<Decision>, WallStamp)>,
    /// The newest parameters of the node.
    #[cfg(feature = "ros")]
    pub(in crate::io) parameters: Option<Box<Parameters>>,
    /// Leave the graph after sending the rest.
    pub(in crate::io) stop: bool,
}

impl OutgoingMessages {
    /// Adds a message; true if it replaced an emission that was not sent.
    pub(in crate::io) fn put(&mut self, message: OutgoingMessage) -> bool {
        match message {
            OutgoingMessage::Turn(publication) => self.turn = Some(publication),
            OutgoingMessage::Hazard(publication) => self.hazard = Some(publication),
            OutgoingMessage::Diagnostics(array) => {
                if self.diagnostics.len() >= MAX_DIAGNOSTICS {
                    self.diagnostics.pop_front();
                }
                self.diagnostics.push_back(array);
            }
            OutgoingMessage::Lights(emission) => {
                return self.lights.insert(emission.topic, emission).is_some();
            }
            OutgoingMessage::TurnCommand(command) => self.turn_command = Some(command),
            OutgoingMessage::HazardCommand(command) => self.hazard_command = Some(command),
            OutgoingMessage::Sections(decision, stamp) => self.sections = Some((decision, stamp)),
            #[cfg(feature = "ros")]
            OutgoingMessage::Parameters(parameters) => self.parameters = Some(parameters),
            #[cfg(feature = "ros")]
            OutgoingMessage::Stop => self.stop = true,
        }
        false
    }
}
