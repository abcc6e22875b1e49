//! The present state of the traffic lights, for people and programs that monitor the gateway.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::bulb::Bulb;
use super::flow::TrafficLightFlow;
use super::scenario::ControllerIndex;
use super::target::{LightChannel, StoreId, StoreLayer};

/// Maximum number of lights listed for each store; a map can have thousands.
pub const MAX_LISTED_LIGHTS: usize = 200;
const MAX_LISTED_CONTROLLERS: usize = 100;

/// The traffic lights of both channels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrafficLightsSnapshot {
    /// The channels `conventional` and `v2i`.
    pub channels: Vec<ChannelSnapshot>,
    /// The controllers of the scenario and their phases, at most 100.
    pub controllers: Vec<ControllerPhaseSnapshot>,
    /// Commands since start that were not understood or could not be done.
    pub refused_commands: u64,
}

/// The lights of one channel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ChannelSnapshot {
    /// The channel.
    pub channel: LightChannel,
    /// Lights in the ground truth.
    pub lights: u32,
    /// Number of them that show no light.
    pub dark: u32,
    /// Lights with a colour or status that was not recognised.
    pub unknown: u32,
    /// Lights that are reported as detected in place of the ground truth.
    pub detected: u32,
    /// Lights that show red and green at once.
    pub contradictory: u32,
    /// Inputs since start that were rejected.
    pub rejected: u64,
    /// Lights removed because no state was received for too long.
    pub stale: u64,
    /// The lights with their states, at most 200 of each layer.
    pub states: Vec<LightSnapshot>,
}

/// The state of one light.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LightSnapshot {
    /// Way id of its head in the map; relation id of the group for a state that was received for a whole
    /// group over V2I.
    pub id: i64,
    /// Relation ids of the groups that it belongs to; its own for a group.
    pub groups: Vec<i64>,
    /// Whether it is the light itself or the perception of it.
    pub layer: StoreLayer,
    /// Its bulbs; empty when it is dark.
    pub bulbs: Vec<Bulb>,
    /// Confidence of the state, 0 to 1.
    pub confidence: f64,
}

impl LightSnapshot {
    /// Returns the bulbs as text, such as `red solidOn circle`, or `dark`.
    pub fn text(&self) -> String {
        let bulbs: Vec<_> = self.bulbs.iter().map(Bulb::to_string).collect();
        if bulbs.is_empty() { "dark".to_owned() } else { bulbs.join(", ") }
    }
}

/// The phase of one controller.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct ControllerPhaseSnapshot {
    /// Name of the controller.
    pub name: String,
    /// Name of its phase; `None` before the first.
    pub phase: Option<String>,
}

impl TrafficLightsSnapshot {
    /// Returns the listed lights, each with a name that includes channel and layer: `11 conventional,
    /// detected`.
    pub fn named_lights(&self) -> impl Iterator<Item = (String, &LightSnapshot)> {
        self.channels.iter().flat_map(|channel| {
            channel.states.iter().map(|light| {
                let layer = if light.layer == StoreLayer::Detected { ", detected" } else { "" };
                (format!("{} {}{layer}", light.id, channel.channel.name()), light)
            })
        })
    }
}

impl TrafficLightFlow {
    /// Returns the present state.
    pub fn snapshot(&self) -> TrafficLightsSnapshot {
        let engine = self.engine();
        let controllers = engine.controllers().iter().enumerate().take(MAX_LISTED_CONTROLLERS);
        let controllers = controllers.map(|(index, controller)| {
            let phase = engine.phase(ControllerIndex(index)).and_then(|phase| controller.phases.get(phase));
            ControllerPhaseSnapshot {
                name: controller.name.clone(),
                phase: phase.map(|phase| phase.name.clone()),
            }
        });
        TrafficLightsSnapshot {
            channels: LightChannel::ALL.into_iter().map(|channel| self.channel_snapshot(channel)).collect(),
            controllers: controllers.collect(),
            refused_commands: self.refused,
        }
    }

    fn channel_snapshot(&self, channel: LightChannel) -> ChannelSnapshot {
        let engine = self.engine();
        let [truth, detected] = [StoreLayer::GroundTruth, StoreLayer::Detected]
            .map(|layer| engine.stores().counts(StoreId { channel, layer }));
        let stale = match channel {
            LightChannel::Conventional => 0,
            LightChannel::V2i => engine.expiry.expired(),
        };
        let states = [StoreLayer::GroundTruth, StoreLayer::Detected]
            .into_iter()
            .flat_map(|layer| self.light_snapshots(StoreId { channel, layer }).take(MAX_LISTED_LIGHTS));
        ChannelSnapshot {
            channel,
            lights: truth.lights,
            dark: truth.dark,
            unknown: truth.unknown + detected.unknown,
            detected: detected.lights,
            contradictory: truth.contradictory + detected.contradictory,
            rejected: engine.counts[channel as usize].rejected,
            stale: u64::try_from(stale).unwrap_or(u64::MAX),
            states: states.collect(),
        }
    }

    fn light_snapshots(&self, store: StoreId) -> impl Iterator<Item = LightSnapshot> {
        let stores = self.engine().stores();
        let map = &stores.map;
        let received = (store.channel == LightChannel::V2i).then(|| stores.received.states(store.layer));
        let received = received.into_iter().flatten().map(move |(id, state)| LightSnapshot {
            id,
            groups: vec![id],
            layer: store.layer,
            bulbs: state.bulbs.iter().collect(),
            confidence: state.confidence,
        });
        let heads = self.engine().iter_states(store).map(move |(id, light)| {
            let head = map.head(id).and_then(|head| map.at(head));
            LightSnapshot {
                id,
                groups: head.map_or_else(Vec::new, |head| head.relation_ids.to_vec()),
                layer: store.layer,
                bulbs: light.bulbs.iter().collect(),
                confidence: light.confidence,
            }
        });
        received.chain(heads)
    }
}
