//! The topics we write: name, type, quality of service, and the samples that an output becomes.

pub(in crate::io) mod messages;

use std::collections::{HashMap, VecDeque};

use serde::Serialize;

use crate::core::compat::Compat;
use crate::core::traffic_light::emission::LightsTopic;
#[cfg(feature = "ros")]
use crate::io::ros::link::WrittenTopic;
use crate::io::ros::link::{Delivery, Order};
use crate::io::ros::messages::autoware_internal_planning_msgs::PlanningFactorArray;
use crate::io::ros::messages::visualization_msgs::MarkerArray;
use crate::io::ros::messages::{CdrBytes, LightsEncoder, LightsType};
use crate::io::ros::outgoing::messages::{OutgoingMessages, Publication};
use crate::io::ros::topics::{
    COMMAND_DEPTH, DIAGNOSTICS_DEPTH, DIAGNOSTICS_TYPE, Durability, HAZARD_COMMAND_TYPE, HAZARD_LIGHTS_TYPE,
    LOG_DEPTH, LOG_TYPE, PLANNING_FACTORS_TYPE, REPORT_DEPTH, TURN_COMMAND_TYPE, TURN_INDICATORS_TYPE,
    Topics, TypeName,
};

/// The source of a topic's messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(in crate::io) enum Source {
    Turn,
    Hazard,
    Diagnostics,
    Lights(LightsTopic, LightsType, Compat),
    TurnCommand,
    HazardCommand,
    SectionMarkers,
    PlanningFactors,
    Log,
}

/// A topic we write.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::io) struct Outgoing {
    /// Absolute name of the topic.
    pub(in crate::io) name: String,
    /// Message type of the topic.
    pub(in crate::io) type_name: TypeName,
    /// Durability offered to readers.
    pub(in crate::io) durability: Durability,
    /// Samples that the writer keeps.
    pub(in crate::io) depth: i32,
    /// Delivery of the messages to readers.
    pub(in crate::io) delivery: Delivery,
    /// Source of the messages.
    pub(in crate::io) source: Source,
}

impl Outgoing {
    /// Its part of the settings of the network side.
    #[cfg(feature = "ros")]
    pub(in crate::io) fn written(&self) -> WrittenTopic {
        let (package, message) = self.type_name;
        WrittenTopic {
            name: self.name.clone(),
            type_name: (package.to_owned(), message.to_owned()),
            durability: self.durability,
            depth: self.depth,
            delivery: self.delivery,
        }
    }

    /// Short name for people.
    #[cfg(any(feature = "ros", test))]
    pub(in crate::io) fn label(&self) -> &'static str {
        match self.source {
            Source::Turn => "turn",
            Source::Hazard => "hazard",
            Source::Diagnostics => "diagnostics",
            Source::Lights(LightsTopic::GroundTruth, ..) => "lights",
            Source::Lights(LightsTopic::Camera, ..) => "camera lights",
            Source::Lights(LightsTopic::V2i, ..) => "V2I lights",
            Source::Lights(LightsTopic::Arbiter, ..) => "arbiter lights",
            Source::Lights(LightsTopic::Markers, ..) => "markers",
            Source::Lights(LightsTopic::Clock, ..) => "clock",
            Source::TurnCommand => "turn command",
            Source::HazardCommand => "hazard command",
            Source::SectionMarkers => "section markers",
            Source::PlanningFactors => "planning factors",
            Source::Log => "log",
        }
    }
}

/// All topics: the reports that have a name, diagnostics, traffic lights, and those of the decider.
pub(in crate::io) fn table(topics: &Topics, durability: Durability) -> Vec<Outgoing> {
    let report = |name: &str, type_name, source| Outgoing {
        name: name.to_owned(),
        type_name,
        durability,
        depth: REPORT_DEPTH,
        delivery: Delivery::Report,
        source,
    };
    let reports = [
        (&topics.turn_indicators, TURN_INDICATORS_TYPE, Source::Turn),
        (&topics.hazard_lights, HAZARD_LIGHTS_TYPE, Source::Hazard),
    ];
    let reports = reports.into_iter().filter(|(name, ..)| !name.is_empty());
    let mut table: Vec<_> =
        reports.map(|(name, type_name, source)| report(name, type_name, source)).collect();
    table.push(Outgoing {
        name: topics.diagnostics.clone(),
        type_name: DIAGNOSTICS_TYPE,
        durability: Durability::Volatile,
        depth: DIAGNOSTICS_DEPTH,
        delivery: Delivery::Once,
        source: Source::Diagnostics,
    });
    table.extend(topics.lights.iter().map(|lights_topic| Outgoing {
        name: lights_topic.name.clone(),
        type_name: lights_topic.lights.type_name(),
        durability: Durability::TransientLocal,
        depth: lights_topic.lights.depth(),
        delivery: Delivery::Stream,
        source: Source::Lights(lights_topic.topic, lights_topic.lights, lights_topic.compat),
    }));
    // What the decider sends is not repeated: for a late joiner it is outdated.
    let command = |name: &String, type_name, source| Outgoing {
        name: name.clone(),
        type_name,
        durability: Durability::Volatile,
        depth: COMMAND_DEPTH,
        delivery: Delivery::Once,
        source,
    };
    let decider = [
        (&topics.turn_command, TURN_COMMAND_TYPE, Source::TurnCommand),
        (&topics.hazard_command, HAZARD_COMMAND_TYPE, Source::HazardCommand),
        (&topics.section_markers, LightsType::MarkerArray.type_name(), Source::SectionMarkers),
        (&topics.planning_factors, PLANNING_FACTORS_TYPE, Source::PlanningFactors),
    ];
    for (name, type_name, source) in decider {
        table.extend(name.iter().map(|name| command(name, type_name, source)));
    }
    table
}

/// The topic of warnings and errors, which follows those of the table.
#[cfg_attr(not(feature = "ros"), allow(dead_code))]
pub(in crate::io) fn log(name: &str) -> Outgoing {
    Outgoing {
        name: name.to_owned(),
        type_name: LOG_TYPE,
        durability: Durability::TransientLocal,
        depth: LOG_DEPTH,
        delivery: Delivery::Log,
        source: Source::Log,
    }
}

/// The encoders of traffic lights. Topics with the same source share one.
pub(in crate::io) type LightsEncoders = HashMap<Source, LightsEncoder>;

/// The orders that follow from the messages, each with the position of its topic in the table.
/// A message that several topics send is encoded once. An error is the text of the encoder.
pub(in crate::io) fn orders(
    table: &[Outgoing],
    encoders: &mut LightsEncoders,
    messages: &OutgoingMessages,
) -> Vec<(usize, Result<Order, String>)> {
    let mut orders = Vec::new();
    let mut made: Vec<(Source, Result<Vec<CdrBytes>, String>)> = Vec::new();
    for (position, outgoing) in table.iter().enumerate() {
        match outgoing.source {
            Source::Turn => {
                orders.extend(messages.turn.as_ref().map(|publication| (position, order(publication))));
            }
            Source::Hazard => {
                orders.extend(messages.hazard.as_ref().map(|publication| (position, order(publication))));
            }
            Source::Diagnostics => orders.extend(each(&messages.diagnostics).map(|order| (position, order))),
            Source::Log => orders.extend(each(&messages.log).map(|order| (position, order))),
            source @ Source::Lights(topic, lights, compat) => {
                let Some(emission) = messages.lights.get(&topic) else { continue };
                let known =
                    made.iter().find(|(known, _)| *known == source).map(|(_, samples)| samples.clone());
                let samples = known.unwrap_or_else(|| {
                    let encoder =
                        encoders.entry(source).or_insert_with(|| LightsEncoder::new(lights, compat));
                    let samples = encoder.encode(emission);
                    let samples = samples.map_err(|error| error.to_string());
                    made.push((source, samples.clone()));
                    samples
                });
                orders.push((position, samples.map(Order::Publish)));
            }
            Source::TurnCommand => {
                orders.extend(messages.turn_command.map(|command| (position, once(&command))));
            }
            Source::HazardCommand => {
                orders.extend(messages.hazard_command.map(|command| (position, once(&command))));
            }
            Source::SectionMarkers => {
                let sections = messages.sections.as_ref();
                let markers =
                    sections.map(|(decision, stamp)| once(&MarkerArray::sections(decision, *stamp)));
                orders.extend(markers.map(|order| (position, order)));
            }
            Source::PlanningFactors => {
                let sections = messages.sections.as_ref();
                let factors = sections
                    .map(|(decision, stamp)| once(&PlanningFactorArray::of_decision(decision, *stamp)));
                orders.extend(factors.map(|order| (position, order)));
            }
        }
    }
    orders
}

/// The order to publish all of these; `None` without any.
fn each(messages: &VecDeque<impl Serialize>) -> Option<Result<Order, String>> {
    let samples = messages.iter().map(encode).collect::<Result<_, _>>();
    (!messages.is_empty()).then(|| samples.map(Order::Publish))
}

fn once(message: &impl Serialize) -> Result<Order, String> {
    Ok(Order::Publish(vec![encode(message)?]))
}

fn order(publication: &Publication<impl Serialize>) -> Result<Order, String> {
    match publication {
        Publication::Publish(message) => once(message),
        Publication::Withdraw => Ok(Order::Withdraw),
    }
}

fn encode(message: &impl Serialize) -> Result<CdrBytes, String> {
    CdrBytes::encode(message).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::time::WallStamp;
    use crate::core::traffic_light::emission::{Emission, LightsContent};
    use crate::io::ros::topics::LightsTopicSettings;

    fn topics() -> Topics {
        let mut topics = Topics::default();
        let lights_topic = |topic, name: &str, lights| LightsTopicSettings {
            topic,
            name: name.to_owned(),
            lights,
            compat: Compat::Improved,
        };
        topics.lights = vec![
            lights_topic(LightsTopic::V2i, "/a", LightsType::GroupArray),
            lights_topic(LightsTopic::V2i, "/b", LightsType::GroupArray),
            lights_topic(LightsTopic::V2i, "/c", LightsType::SignalArray),
            lights_topic(LightsTopic::Markers, "/d", LightsType::MarkerArray),
        ];
        topics.turn_command = Some("/e".to_owned());
        topics.hazard_command = Some("/f".to_owned());
        topics.section_markers = Some("/g".to_owned());
        topics.planning_factors = Some("/h".to_owned());
        topics
    }

    #[test]
    fn each_topic_has_its_durability_depth_and_delivery() {
        let table = table(&topics(), Durability::Volatile);
        let actual: Vec<_> = table
            .iter()
            .map(|outgoing| (outgoing.label(), outgoing.durability, outgoing.depth, outgoing.delivery))
            .collect();
        let (kept, volatile) = (Durability::TransientLocal, Durability::Volatile);
        assert_eq!(
            actual,
            [
                ("turn", volatile, 1, Delivery::Report),
                ("hazard", volatile, 1, Delivery::Report),
                ("diagnostics", volatile, 10, Delivery::Once),
                ("V2I lights", kept, 10, Delivery::Stream),
                ("V2I lights", kept, 10, Delivery::Stream),
                ("V2I lights", kept, 10, Delivery::Stream),
                ("markers", kept, 1, Delivery::Stream),
                ("turn command", volatile, 1, Delivery::Once),
                ("hazard command", volatile, 1, Delivery::Once),
                ("section markers", volatile, 1, Delivery::Once),
                ("planning factors", volatile, 1, Delivery::Once),
            ]
        );
    }

    #[test]
    fn an_emission_goes_to_its_topics_only_and_each_message_is_made_once() {
        let mut messages = OutgoingMessages::default();
        let content = LightsContent::groups([]);
        let emission = Emission { topic: LightsTopic::V2i, stamp: WallStamp::default(), content };
        messages.lights.insert(LightsTopic::V2i, emission);
        let orders =
            orders(&table(&topics(), Durability::Volatile), &mut LightsEncoders::default(), &messages);
        let positions: Vec<_> = orders.iter().map(|(position, _)| *position).collect();
        assert_eq!(positions, [3, 4, 5]);
        let sample = |index: usize| match &orders[index].1 {
            Ok(Order::Publish(samples)) => samples[0].clone(),
            other => panic!("{other:?}"),
        };
        assert!(std::ptr::eq(sample(0).as_ref(), sample(1).as_ref()));
        assert!(!std::ptr::eq(sample(0).as_ref(), sample(2).as_ref()));
    }
}
