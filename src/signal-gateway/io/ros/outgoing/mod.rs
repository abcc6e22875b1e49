//! The published topics: name, type, quality of service, and the samples created from an output.

pub(crate) mod messages;

use std::collections::{HashMap, VecDeque};

use crate::io::ros::messages::{LightsEncoder, LightsType};
use crate::io::ros::outgoing::messages::{OutgoingMessages, Publication};
use crate::io::ros::topics::{
    Delivery, Durability, LightsTopicSettings, OutgoingTopic, TopicFlow, Topics, lights_row,
};
use ros_messages::TypeName;
use ros_messages::cdr::CdrBytes;
use ros_transport::link::{Order, WrittenTopic};
use traffic_lights::compat::Compat;
use traffic_lights::emission::LightsTopic;

/// The source of a topic's messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(in crate::io) enum OutgoingSource {
    Topic(OutgoingTopic),
    Lights(LightsTopic, LightsType, Compat),
}

/// A published topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::io) struct Outgoing {
    /// Absolute name of the topic.
    pub(in crate::io) name: String,
    pub(in crate::io) type_name: TypeName,
    /// Durability offered to readers.
    pub(in crate::io) durability: Durability,
    /// History depth of the writer, samples.
    pub(in crate::io) depth: i32,
    pub(in crate::io) delivery: Delivery,
    pub(in crate::io) source: OutgoingSource,
}

impl Outgoing {
    fn topic(topic: OutgoingTopic, name: &str, configured: Durability) -> Self {
        let row = topic.row();
        Self {
            name: name.to_owned(),
            type_name: row.type_name,
            durability: row.durability.unwrap_or(configured),
            depth: row.depth,
            delivery: row.delivery,
            source: OutgoingSource::Topic(topic),
        }
    }

    fn lights(topic: &LightsTopicSettings) -> Self {
        let (type_name, depth) = lights_row(topic.lights);
        Self {
            name: topic.name.clone(),
            type_name,
            durability: Durability::TransientLocal,
            depth,
            delivery: Delivery::Stream,
            source: OutgoingSource::Lights(topic.topic, topic.lights, topic.compat),
        }
    }

    /// Returns the topic's part of the network side's settings.
    pub(in crate::io) fn written(&self) -> WrittenTopic {
        WrittenTopic {
            name: self.name.clone(),
            type_name: self.type_name.to_owned(),
            durability: self.durability,
            depth: self.depth,
            delivery: self.delivery,
        }
    }

    /// Returns true for a topic that many nodes publish: statuses and the log.
    pub(in crate::io) fn is_shared(&self) -> bool {
        let OutgoingSource::Topic(topic) = self.source else { return false };
        topic.row().flow == TopicFlow::Gateway
    }

    /// Returns true for a report on the vehicle.
    pub(in crate::io) fn is_report(&self) -> bool {
        let OutgoingSource::Topic(topic) = self.source else { return false };
        matches!(topic.row().flow, TopicFlow::VehicleLights | TopicFlow::VehicleStatus)
    }
}

/// Returns all published topics, with the traffic lights before the topics of the decider.
pub(in crate::io) fn table(topics: &Topics, durability: Durability) -> Vec<Outgoing> {
    let named = topics.named().map(|(topic, name)| Outgoing::topic(topic, name, durability));
    let mut table: Vec<_> = named.collect();
    let first = topics.named().take_while(|(topic, _)| *topic < OutgoingTopic::TurnCommand).count();
    table.splice(first..first, topics.lights.iter().map(Outgoing::lights));
    table
}

/// The encoders of traffic lights. Topics with the same source share one.
pub(in crate::io) type LightsEncoders = HashMap<OutgoingSource, LightsEncoder>;

/// A message cannot be encoded, for this reason.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub(in crate::io) struct EncodingError(String);

impl From<cdr_encoding::Error> for EncodingError {
    fn from(error: cdr_encoding::Error) -> Self {
        Self(error.to_string())
    }
}

/// Returns the orders for the messages, each with the position of its topic in the table. A message that is
/// published on several topics is encoded once.
pub(in crate::io) fn orders(
    table: &[Outgoing],
    encoders: &mut LightsEncoders,
    messages: &OutgoingMessages,
) -> Vec<(usize, Result<Order, EncodingError>)> {
    let mut orders = Vec::new();
    let mut made: HashMap<OutgoingSource, Result<Vec<CdrBytes>, EncodingError>> = HashMap::new();
    for (position, outgoing) in table.iter().enumerate() {
        match outgoing.source {
            OutgoingSource::Topic(topic) => {
                orders.extend(messages.topics.get(&topic).map(|waiting| (position, order(waiting))));
            }
            source @ OutgoingSource::Lights(topic, lights, compat) => {
                let Some(emission) = messages.lights.get(&topic) else { continue };
                let samples = made.entry(source).or_insert_with(|| {
                    let encoder =
                        encoders.entry(source).or_insert_with(|| LightsEncoder::new(lights, compat));
                    Ok(encoder.encode(emission)?)
                });
                orders.push((position, samples.clone().map(Order::Publish)));
            }
        }
    }
    orders
}

/// Returns the order to publish the messages that wait for a topic, or to withdraw the published message.
fn order(waiting: &VecDeque<Publication>) -> Result<Order, EncodingError> {
    let mut samples = Vec::new();
    for publication in waiting {
        match publication {
            Publication::Publish(message) => samples.push(message.cdr()?),
            Publication::Withdraw => samples.clear(),
        }
    }
    Ok(if samples.is_empty() { Order::Withdraw } else { Order::Publish(samples) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::ros::topics::OUTGOING;
    use gateway_base::time::WallStamp;
    use traffic_lights::emission::{Emission, LightsContent};

    fn topics() -> Topics {
        let lights_topic = |topic, name: &str, lights| LightsTopicSettings {
            topic,
            name: name.to_owned(),
            lights,
            compat: Compat::Improved,
        };
        let mut topics = Topics::default()
            .with(OutgoingTopic::VelocityReport, "/i")
            .with(OutgoingTopic::SteeringReport, "/j")
            .with(OutgoingTopic::GearReport, "/k")
            .with(OutgoingTopic::ControlModeReport, "/l")
            .with(OutgoingTopic::DoorStatusArray, "/m")
            .with(OutgoingTopic::TurnCommand, "/e")
            .with(OutgoingTopic::HazardCommand, "/f")
            .with(OutgoingTopic::SectionMarkers, "/g")
            .with(OutgoingTopic::PlanningFactors, "/h")
            .with(OutgoingTopic::Log, "/rosout");
        topics.lights = vec![
            lights_topic(LightsTopic::V2i, "/a", LightsType::GroupArray),
            lights_topic(LightsTopic::V2i, "/b", LightsType::GroupArray),
            lights_topic(LightsTopic::V2i, "/c", LightsType::SignalArray),
            lights_topic(LightsTopic::Markers, "/d", LightsType::MarkerArray),
        ];
        topics
    }

    #[test]
    fn each_topic_has_its_durability_depth_and_delivery() {
        let configured = Durability::TransientLocal;
        let table = table(&topics(), configured);
        let actual: Vec<_> = table
            .iter()
            .map(|outgoing| (outgoing.name.as_str(), outgoing.durability, outgoing.depth, outgoing.delivery))
            .collect();
        let (kept, volatile) = (Durability::TransientLocal, Durability::Volatile);
        assert_eq!(
            actual,
            [
                ("/vehicle/status/turn_indicators_status", configured, 1, Delivery::Report),
                ("/vehicle/status/hazard_lights_status", configured, 1, Delivery::Report),
                ("/i", volatile, 1, Delivery::Live),
                ("/j", volatile, 1, Delivery::Live),
                ("/k", configured, 1, Delivery::Report),
                ("/l", configured, 1, Delivery::Report),
                ("/m", configured, 1, Delivery::Report),
                ("/diagnostics", volatile, 10, Delivery::Once),
                ("/a", kept, 10, Delivery::Stream),
                ("/b", kept, 10, Delivery::Stream),
                ("/c", kept, 10, Delivery::Stream),
                ("/d", kept, 1, Delivery::Stream),
                ("/e", volatile, 1, Delivery::Once),
                ("/f", volatile, 1, Delivery::Once),
                ("/g", volatile, 1, Delivery::Once),
                ("/h", volatile, 1, Delivery::Once),
                ("/rosout", kept, 100, Delivery::Log),
            ]
        );
    }

    #[test]
    fn a_state_of_the_vehicle_has_the_durability_that_is_configured() {
        let table = table(&topics(), Durability::Volatile);
        assert!(table.iter().all(|outgoing| {
            let is_shared = matches!(outgoing.source, OutgoingSource::Lights(..));
            is_shared || outgoing.name == "/rosout" || outgoing.durability == Durability::Volatile
        }));
    }

    #[test]
    fn each_topic_is_at_the_position_of_its_row() {
        for row in &OUTGOING {
            assert_eq!(row.topic.row().topic, row.topic);
        }
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
        assert_eq!(positions, [8, 9, 10]);
        let sample = |index: usize| match &orders[index].1 {
            Ok(Order::Publish(samples)) => samples[0].clone(),
            other => panic!("{other:?}"),
        };
        assert!(std::ptr::eq(sample(0).as_ref(), sample(1).as_ref()));
        assert!(!std::ptr::eq(sample(0).as_ref(), sample(2).as_ref()));
    }
}
