//! Messages independent of their type (docs/spec/traffic-lights.md, "Message building").
//!
//! They are converted to message types where those are defined, never back.

use std::borrow::Cow;
use std::sync::Arc;

use super::bulb::{Bulb, BulbSet};
use gateway_base::time::WallStamp;
use lanelet2_map::light_map::MapLamp;

/// A topic with traffic lights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LightsTopic {
    /// Ground truth of the conventional channel, on `/simulation/traffic_lights`.
    GroundTruth,
    /// Reports of the camera pipeline, on `…/internal/traffic_signals`.
    Camera,
    /// Reports of the network, on `…/external/traffic_signals` and its legacy name.
    V2i,
    /// Reports of camera and network merged by the arbiter, on `…/traffic_signals`.
    Arbiter,
    /// Spheres for a viewer, on `traffic_light/marker`.
    Markers,
    /// The time of each frame, on `/clock`.
    Clock,
}

/// One message, independent of its type.
#[derive(Debug, Clone, PartialEq)]
pub struct Emission {
    /// The topic of the message.
    pub topic: LightsTopic,
    /// Stamp of the message or its header.
    pub stamp: WallStamp,
    /// The list to send.
    pub content: LightsContent,
}

/// The list of an emission.
///
/// Its address in memory shows changes: while nothing changes, the emissions of a topic share one list, and
/// successive lists share each unchanged group.
#[derive(Debug, Clone, PartialEq)]
pub enum LightsContent {
    /// States of heads, ascending by way id.
    Lights(Arc<Vec<LightState>>),
    /// States of groups, ascending by relation id. Upstream sends one for each head of a group instead (Q17).
    Groups(Groups),
    /// Markers of lamps, ascending by way id.
    Markers(Arc<Vec<LampMarker>>),
    /// Only the stamp.
    Clock,
}

/// A list of groups; messages share lists, and lists share groups.
pub type Groups = Arc<Vec<Arc<GroupState>>>;

impl LightsContent {
    /// Creates a list of heads.
    pub fn lights(lights: impl IntoIterator<Item = LightState>) -> Self {
        Self::Lights(Arc::new(lights.into_iter().collect()))
    }

    /// Creates a list of groups.
    pub fn groups(groups: impl IntoIterator<Item = GroupState>) -> Self {
        Self::Groups(Arc::new(groups.into_iter().map(Arc::new).collect()))
    }

    /// Creates a list of lamps.
    pub fn markers(markers: impl IntoIterator<Item = LampMarker>) -> Self {
        Self::Markers(Arc::new(markers.into_iter().collect()))
    }

    /// Returns whether both share one list. Equal lists are not necessarily shared.
    pub fn is_shared_with(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Lights(one), Self::Lights(other)) => Arc::ptr_eq(one, other),
            (Self::Groups(one), Self::Groups(other)) => Arc::ptr_eq(one, other),
            (Self::Markers(one), Self::Markers(other)) => Arc::ptr_eq(one, other),
            (Self::Clock, Self::Clock) => true,
            (Self::Lights(_) | Self::Groups(_) | Self::Markers(_) | Self::Clock, _) => false,
        }
    }
}

/// The state of a head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightState {
    /// Way id of the head.
    pub way_id: i64,
    /// Bulbs of the head, empty if it is dark.
    pub bulbs: BulbSet,
    /// Confidence, 0 to 1; upstream accepts any number.
    pub confidence: f64,
}

/// The state of a group.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GroupState {
    /// Id of the regulatory element.
    pub relation_id: i64,
    /// Bulbs of the group, ascending by their keys.
    pub elements: Vec<GroupElement>,
    /// Future states, ascending by time.
    pub predictions: Vec<Prediction>,
}

/// One bulb of a group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroupElement {
    /// Colour, status and shape of the bulb.
    pub bulb: Bulb,
    /// Confidence in this bulb, 0 to 1.
    pub confidence: f64,
}

/// A future state of a group.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Time at which the state begins.
    pub at: WallStamp,
    /// Bulbs of the state; upstream may repeat one (Q10).
    pub elements: Vec<GroupElement>,
    /// Reliability of the prediction, 0 to 1.
    pub reliability: f64,
    /// Source of the information, usually a constant of `PredictedTrafficLightState`.
    pub source: Cow<'static, str>,
}

/// A sphere for a viewer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LampMarker {
    /// Way id of the head.
    pub way_id: i64,
    /// Position and colour of the lamp.
    pub lamp: MapLamp,
    /// True if a circle of that colour is among the head's bulbs.
    pub is_on: bool,
}
