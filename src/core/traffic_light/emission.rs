//! Messages before they have a type (docs/spec/traffic-lights.md, "Message building").
//!
//! Conversions to message types go one way and stand with the messages, one file for each.

use std::sync::Arc;

use super::bulb::{Bulb, BulbSet};
use crate::core::map::light_map::Lamp;
use crate::core::time::WallStamp;

/// A topic with traffic lights.
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
    /// The topic that it is for.
    pub topic: LightsTopic,
    /// Stamp of the header or message.
    pub stamp: WallStamp,
    /// The list that is sent.
    pub content: Content,
}

/// The list that an emission sends.
///
/// Its place in memory shows what changed: as long as nothing does, the emissions of a topic share one list,
/// and a group that did not change is shared by one list with the next.
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// Head by head, ascending by way id.
    Lights(Arc<Vec<LightState>>),
    /// Group by group, ascending by relation id. Upstream's behaviour has one for each head of a group
    /// instead (Q17).
    Groups(Groups),
    /// Lamp by lamp, ascending by way id.
    Markers(Arc<Vec<LampMarker>>),
}

/// Groups, which lists and messages share.
pub type Groups = Arc<Vec<Arc<GroupState>>>;

impl Content {
    /// Lists these heads.
    pub fn lights(lights: impl IntoIterator<Item = LightState>) -> Self {
        Self::Lights(Arc::new(lights.into_iter().collect()))
    }

    /// Lists these groups.
    pub fn groups(groups: impl IntoIterator<Item = GroupState>) -> Self {
        Self::Groups(Arc::new(groups.into_iter().map(Arc::new).collect()))
    }

    /// Lists these lamps.
    pub fn markers(markers: impl IntoIterator<Item = LampMarker>) -> Self {
        Self::Markers(Arc::new(markers.into_iter().collect()))
    }

    /// Whether both share one list. Equal lists need not be shared.
    pub fn is_shared_with(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Lights(one), Self::Lights(other)) => Arc::ptr_eq(one, other),
            (Self::Groups(one), Self::Groups(other)) => Arc::ptr_eq(one, other),
            (Self::Markers(one), Self::Markers(other)) => Arc::ptr_eq(one, other),
            (Self::Lights(_) | Self::Groups(_) | Self::Markers(_), _) => false,
        }
    }
}

/// The state of a head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightState {
    /// Id of its way.
    pub way_id: i64,
    /// Its bulbs; none = dark.
    pub bulbs: BulbSet,
    /// 0 to 1; upstream takes any number.
    pub confidence: f64,
}

/// The state of a group.
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
    /// Colour, status and shape.
    pub bulb: Bulb,
    /// 0 to 1.
    pub confidence: f64,
}

/// A future state of a group.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// When it begins.
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
    /// Position and colour.
    pub lamp: Lamp,
    /// Whether a circle of that colour is among the head's bulbs.
    pub is_on: bool,
}
