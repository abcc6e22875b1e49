//! What is sent: the one type all messages are made of (docs/spec/traffic-lights.md, "Message building").
//!
//! Conversions to message types go one way and stand with the messages, one file for each.

use std::sync::Arc;

use super::bulb::{Bulb, BulbSet};
use crate::core::map::light_map::Lamp;
use crate::core::time::WallStamp;

/// A topic of ours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LightsTopic {
    /// `/simulation/traffic_lights`: ground truth of the conventional channel.
    GroundTruth,
    /// `…/internal/traffic_signals`: what the camera pipeline reports.
    Camera,
    /// `…/external/traffic_signals` and its legacy name: what the network reports.
    V2i,
    /// `…/traffic_signals`: camera and network merged as the arbiter does.
    Arbiter,
    /// `traffic_light/marker`: spheres for a viewer.
    Markers,
}

/// One message, independent of its type.
#[derive(Debug, Clone, PartialEq)]
pub struct Emission {
    /// Where it goes.
    pub topic: LightsTopic,
    /// Header or message stamp.
    pub stamp: WallStamp,
    /// Shared with earlier emissions when nothing changed in between.
    pub content: Arc<Content>,
}

/// What an emission says.
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// Head by head, ascending by way id.
    Lights(Vec<LightState>),
    /// Group by group, ascending by relation id. Upstream's behaviour has one for each head of a group
    /// instead (Q17). A group is shared with earlier emissions when it did not change.
    Groups(Vec<Arc<GroupState>>),
    /// Lamp by lamp.
    Markers(Vec<LampMarker>),
}

impl Content {
    /// These groups.
    pub fn groups(groups: impl IntoIterator<Item = GroupState>) -> Self {
        Self::Groups(groups.into_iter().map(Arc::new).collect())
    }
}

/// A head as it is sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightState {
    /// Id of its way.
    pub way_id: i64,
    /// Its bulbs; none = dark.
    pub bulbs: BulbSet,
    /// 0 to 1; upstream takes any number.
    pub confidence: f64,
}

/// A group as it is sent.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GroupState {
    /// Id of the regulatory element.
    pub relation_id: i64,
    /// Ascending by the key of the bulb.
    pub elements: Vec<Element>,
    /// Ascending by time.
    pub predictions: Vec<Prediction>,
}

/// One bulb of a group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Element {
    /// How it looks.
    pub bulb: Bulb,
    /// 0 to 1.
    pub confidence: f64,
}

/// How a group will look.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// From then on.
    pub at: WallStamp,
    /// The bulbs; more than once the same one in upstream's behaviour (Q10).
    pub elements: Vec<Element>,
    /// 0 to 1.
    pub reliability: f64,
    /// A constant of `PredictedTrafficLightState`.
    pub source: &'static str,
}

/// A sphere for a viewer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LampMarker {
    /// Id of the head's way.
    pub way_id: i64,
    /// Where and in which colour.
    pub lamp: Lamp,
    /// Whether a circle of that colour is among the head's bulbs.
    pub is_on: bool,
}
