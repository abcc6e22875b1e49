//! Messages that wait to be sent, by topic.
//!
//! A report, command or emission that waits to be sent is replaced by a newer one of the same topic. Messages
//! that must all be sent keep their order; beyond `max_waiting` of their row, the oldest is dropped.

use std::collections::{BTreeMap, VecDeque};
use std::fmt;
use std::sync::Arc;

use serde::{Serialize, Serializer};

use crate::io::ros::messages::{ToRos, diagnostic_array, factors_of_decision, section_markers};
use crate::io::ros::topics::OutgoingTopic;
use gateway_core::gateway::event::Output;
use gateway_core::vehicle_lights::output::VehicleLightsOutput;
use gateway_core::vehicle_report::Step;
use gateway_core::vehicle_status::output::VehicleStatusOutput;
use ros_messages::cdr::CdrBytes;
use ros_transport::parameters::Parameters;
use traffic_lights::emission::{Emission, LightsTopic};
use traffic_lights::output::TrafficLightOutput;
use turn_signal::output::TurnSignalOutput;

/// An instruction for a topic.
pub(crate) enum Publication {
    /// Publish this message now.
    Publish(Box<dyn OutgoingPayload>),
    /// Publish nothing, and withdraw the last message from late readers.
    Withdraw,
}

/// A message of any type.
pub(crate) trait OutgoingPayload: Send {
    /// Encodes the message for DDS and recordings; fails only for a sequence of more than 2³² − 1 elements.
    fn cdr(&self) -> cdr_encoding::Result<CdrBytes>;

    /// Encodes the message as one line of JSON.
    fn json(&self) -> serde_json::Result<String>;
}

impl<M: Serialize + Send> OutgoingPayload for M {
    fn cdr(&self) -> cdr_encoding::Result<CdrBytes> {
        CdrBytes::encode(self)
    }

    fn json(&self) -> serde_json::Result<String> {
        serde_json::to_string(self)
    }
}

/// A message that is created when it is encoded, so never if its topic has no name.
struct Lazy<F>(F);

impl<M: Serialize, F: Fn() -> M> Serialize for Lazy<F> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (self.0)().serialize(serializer)
    }
}

impl Publication {
    /// Creates the publication of a message.
    pub(crate) fn of(message: impl Serialize + Send + 'static) -> Self {
        Self::Publish(Box::new(message))
    }
}

impl fmt::Debug for Publication {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Publish(message) => write!(f, "Publish({})", message.json().unwrap_or_default()),
            Self::Withdraw => f.write_str("Withdraw"),
        }
    }
}

/// Returns the publications of an output with their topics; none for traffic lights, whose topics are
/// configured individually, and for outputs that are not published.
pub(crate) fn publications(output: &Output, hardware_id: &str) -> Vec<(OutgoingTopic, Publication)> {
    match output {
        Output::VehicleLights(VehicleLightsOutput::TurnIndicators(step)) => {
            vec![report(OutgoingTopic::TurnIndicatorsReport, *step)]
        }
        Output::VehicleLights(VehicleLightsOutput::HazardLights(step)) => {
            vec![report(OutgoingTopic::HazardLightsReport, *step)]
        }
        Output::VehicleStatus(output) => vec![status(*output)],
        Output::Diagnostics { diagnostics, stamp } => {
            let array = diagnostic_array(diagnostics, *stamp, hardware_id);
            vec![(OutgoingTopic::Diagnostics, Publication::of(array))]
        }
        Output::TurnSignal(TurnSignalOutput::TurnCommand { command, stamp }) => {
            vec![(OutgoingTopic::TurnCommand, Publication::of(command.to_ros(*stamp)))]
        }
        Output::TurnSignal(TurnSignalOutput::HazardCommand { command, stamp }) => {
            vec![(OutgoingTopic::HazardCommand, Publication::of(command.to_ros(*stamp)))]
        }
        Output::TurnSignal(TurnSignalOutput::Sections { decision, stamp }) => {
            let (markers, factors, stamp) = (Arc::clone(decision), Arc::clone(decision), *stamp);
            let markers = Lazy(move || section_markers(&markers, stamp));
            let factors = Lazy(move || factors_of_decision(&factors, stamp));
            vec![
                (OutgoingTopic::SectionMarkers, Publication::of(markers)),
                (OutgoingTopic::PlanningFactors, Publication::of(factors)),
            ]
        }
        Output::TurnSignal(TurnSignalOutput::Decision(_)) | Output::TrafficLights(_) | Output::Command(_) => {
            Vec::new()
        }
    }
}

fn status(output: VehicleStatusOutput) -> (OutgoingTopic, Publication) {
    match output {
        VehicleStatusOutput::Velocity(step) => report(OutgoingTopic::VelocityReport, step),
        VehicleStatusOutput::Steering(step) => report(OutgoingTopic::SteeringReport, step),
        VehicleStatusOutput::Gear(step) => report(OutgoingTopic::GearReport, step),
        VehicleStatusOutput::ControlMode(step) => report(OutgoingTopic::ControlModeReport, step),
        VehicleStatusOutput::Doors(step) => report(OutgoingTopic::DoorStatusArray, step),
    }
}

fn report(topic: OutgoingTopic, step: Step<impl ToRos>) -> (OutgoingTopic, Publication) {
    let publication = match step {
        Step::Publish(value, stamp) => Publication::of(value.to_ros(stamp)),
        Step::Withdraw => Publication::Withdraw,
    };
    (topic, publication)
}

/// All messages that wait to be sent.
#[derive(Debug, Default)]
pub(in crate::io) struct OutgoingMessages {
    /// Publications that wait for each topic, oldest first.
    pub(in crate::io) topics: BTreeMap<OutgoingTopic, VecDeque<Publication>>,
    /// The newest emission of each topic of traffic lights.
    pub(in crate::io) lights: BTreeMap<LightsTopic, Emission>,
    /// The newest parameters of the node.
    pub(in crate::io) parameters: Option<Box<Parameters>>,
    /// True if the session is to leave the graph after sending the remaining messages.
    pub(in crate::io) stop: bool,
}

impl OutgoingMessages {
    /// Adds the messages of an output; returns true if they replaced an unsent emission.
    pub(in crate::io) fn put(&mut self, output: &Output, hardware_id: &str) -> bool {
        if let Output::TrafficLights(TrafficLightOutput::Publish(emission)) = output {
            return self.lights.insert(emission.topic, emission.clone()).is_some();
        }
        for (topic, publication) in publications(output, hardware_id) {
            self.put_publication(topic, publication);
        }
        false
    }

    /// Adds a publication, and drops the oldest of its topic if too many wait.
    pub(in crate::io) fn put_publication(&mut self, topic: OutgoingTopic, publication: Publication) {
        let waiting = self.topics.entry(topic).or_default();
        if waiting.len() >= topic.row().max_waiting {
            waiting.pop_front();
        }
        waiting.push_back(publication);
    }

    /// Returns true if nothing waits.
    #[cfg(test)]
    pub(in crate::io) fn is_empty(&self) -> bool {
        self.topics.is_empty() && self.lights.is_empty()
    }
}
