//! A received [`TrafficLightGroupArray`] as the core takes it.

use super::element::Unfit;
use super::traffic_light_group_array::{TrafficLightGroup, TrafficLightGroupArray};
use crate::core::time::WallStamp;
use crate::core::traffic_light::bulb::BulbSet;
use crate::core::traffic_light::engine::LightObservation;
use crate::core::traffic_light::input::TrafficLightInput;
use crate::core::traffic_light::target::StoreId;

/// A group as it was received.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReceivedGroup {
    /// Id of the regulatory element.
    pub relation_id: i64,
    /// Its bulbs; none = dark, or not reported.
    pub bulbs: BulbSet,
    /// Confidence of its least certain bulb, 0 to 1; 1 without bulbs.
    pub confidence: f64,
}

/// A group that was left out because of an undefined number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rejection {
    /// Id of the regulatory element.
    pub relation_id: i64,
    /// The first undefined number in it.
    pub why: Unfit,
}

/// A message as it was received. A group is in one of the two lists, never half in each.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReceivedGroups {
    /// The sender's stamp.
    pub stamp: WallStamp,
    /// Groups in the order of the message; an id can come more than once.
    pub groups: Vec<ReceivedGroup>,
    /// Groups that were left out, in the order of the message.
    pub rejected: Vec<Rejection>,
}

impl From<&TrafficLightGroupArray> for ReceivedGroups {
    fn from(message: &TrafficLightGroupArray) -> Self {
        let mut received = Self { stamp: message.stamp.into(), ..Self::default() };
        for group in &message.traffic_light_groups {
            let relation_id = group.traffic_light_group_id;
            match read(group) {
                Ok(group) => received.groups.push(group),
                Err(why) => received.rejected.push(Rejection { relation_id, why }),
            }
        }
        received
    }
}

impl ReceivedGroups {
    /// As an input of the gateway: dark groups have no state there, of the rejected ones there is the number.
    pub fn for_store(&self, store: StoreId) -> TrafficLightInput {
        let states = self.groups.iter().map(|group| {
            let ReceivedGroup { relation_id, bulbs, confidence } = *group;
            (relation_id, (!bulbs.is_empty()).then_some(LightObservation { bulbs, confidence }))
        });
        TrafficLightInput::States {
            store,
            stamp: self.stamp,
            states: states.collect(),
            rejected: u32::try_from(self.rejected.len()).unwrap_or(u32::MAX),
        }
    }
}

fn read(group: &TrafficLightGroup) -> Result<ReceivedGroup, Unfit> {
    let (mut bulbs, mut confidence) = (BulbSet::EMPTY, 1.0_f64);
    for element in &group.elements {
        bulbs.insert(element.bulb()?);
        confidence = confidence.min(f64::from(element.confidence));
    }
    Ok(ReceivedGroup { relation_id: group.traffic_light_group_id, bulbs, confidence })
}
