//! A lanelet: a piece of a lane between two bounds, with the tags that decide about signals
//! (docs/spec/turn-signal-decider.md, "Map facts").

use super::error::{MapError, id_list_tag, number_tag};
use super::osm::{Element, Kind, Relation, Tags};
use super::polyline::Polyline;

/// A lanelet, by position in [`RoadMap::lanelets`](super::road_map::RoadMap::lanelets).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LaneletIndex(pub usize);

/// A roundabout, by position in [`RoadMap::roundabouts`](super::road_map::RoadMap::roundabouts).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RoundaboutIndex(pub usize);

/// A piece of a lane.
#[derive(Debug, Clone, PartialEq)]
pub struct Lanelet {
    /// Id of its relation.
    pub id: i64,
    /// On the left of traffic, drawn in its direction.
    pub left: Bound,
    /// On the right of traffic, drawn in its direction.
    pub right: Bound,
    /// Generated of the bounds; one drawn in the map does not count.
    pub centerline: Polyline,
    /// `road`, `road_shoulder`, `crosswalk`, …; empty without one.
    pub subtype: Box<str>,
    /// `urban`, `nonurban`, …
    pub location: Option<Box<str>>,
    /// Where it leads in its intersection.
    pub turn_direction: TurnDirection,
    /// Overrides the distance before it at which its signal begins, metres.
    pub turn_signal_distance_m: Option<f64>,
    /// For an entry of a roundabout: exits that it signals for already.
    pub exit_signals: ExitSignals,
    /// Whether the signal for the exit of a roundabout may begin here.
    pub enable_exit_turn_signal: bool,
    /// Whether vehicles may use it (lanelet2's rules: tags of participants, else the subtype).
    pub for_vehicles: bool,
    /// Whether vehicles may use it in its direction only.
    pub one_way: bool,
    /// The roundabouts that it says it belongs to, in the order of its members.
    pub roundabouts: Vec<RoundaboutIndex>,
}

/// A side of a lanelet.
#[derive(Debug, Clone, PartialEq)]
pub struct Bound {
    /// Id of its way. Several lanelets can share it.
    pub way_id: i64,
    /// Whether the way is drawn against traffic.
    pub inverted: bool,
    /// In the direction of traffic.
    pub line: Polyline,
    /// Positions of the first and last node in the file: what lanelets that follow each other share.
    pub ends: [usize; 2],
    /// Which way vehicles may change lanes over it.
    pub lane_change: LaneChange,
    /// Whether a polygon of hatched road markings shares a point with it.
    pub hatched: bool,
}

/// Lane changes over a line, seen in the direction of traffic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LaneChange {
    /// From its right side to its left.
    pub to_left: bool,
    /// From its left side to its right.
    pub to_right: bool,
}

/// The tag `turn_direction`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum TurnDirection {
    /// No tag, or a value that says nothing about turning.
    #[default]
    None,
    /// `straight`
    Straight,
    /// `left`
    Left,
    /// `right`
    Right,
}

/// Lanelet ids of exits, by the side to signal; none if the tag is missing or `none`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ExitSignals {
    /// `exit_turn_signal_left`
    pub left: Option<Vec<i64>>,
    /// `exit_turn_signal_right`
    pub right: Option<Vec<i64>>,
}

/// A regulatory element of the subtype `roundabout`: lanelet ids by role, in the order of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Roundabout {
    /// Id of the regulatory element.
    pub relation_id: i64,
    /// Role `entry`.
    pub entries: Vec<i64>,
    /// Role `exit`.
    pub exits: Vec<i64>,
    /// Role `internal`.
    pub internals: Vec<i64>,
}

/// What the tags of a lanelet say.
pub(super) struct Said {
    pub(super) turn_direction: TurnDirection,
    pub(super) turn_signal_distance_m: Option<f64>,
    pub(super) exit_signals: ExitSignals,
}

impl Said {
    pub(super) fn read(lanelet: &Relation) -> Result<Self, MapError> {
        let element = Element { kind: Kind::Relation, id: lanelet.id };
        let tags = &lanelet.tags;
        Ok(Self {
            turn_direction: TurnDirection::from_tag(tags.get("turn_direction")),
            turn_signal_distance_m: number_tag(tags, "turn_signal_distance", element)?,
            exit_signals: ExitSignals {
                left: id_list_tag(tags, "exit_turn_signal_left", element)?,
                right: id_list_tag(tags, "exit_turn_signal_right", element)?,
            },
        })
    }
}

impl TurnDirection {
    fn from_tag(value: Option<&str>) -> Self {
        match value {
            Some("left") => Self::Left,
            Some("right") => Self::Right,
            Some("straight") => Self::Straight,
            Some(_) | None => Self::None,
        }
    }
}

impl Roundabout {
    pub(super) fn read(relation: &Relation) -> Self {
        let members = |role| relation.members(role, Kind::Relation).collect();
        let [entries, exits, internals] = [members("entry"), members("exit"), members("internal")];
        Self { relation_id: relation.id, entries, exits, internals }
    }

    /// Whether a lanelet has any role in it.
    pub fn has(&self, lanelet: i64) -> bool {
        [&self.entries, &self.exits, &self.internals].into_iter().any(|role| role.contains(&lanelet))
    }
}

impl LaneChange {
    /// What lanelet2 lets vehicles do over a way, in the direction it is drawn: its own tags, else the
    /// marking. On a line that is solid on one side, the dashed side may be left.
    pub(super) fn over(way: &Tags) -> Self {
        if let Some(both) = way.get("lane_change") {
            return Self { to_left: is_yes(both), to_right: is_yes(both) };
        }
        let [to_left, to_right] = ["lane_change:left", "lane_change:right"].map(|key| way.get(key));
        if to_left.is_some() || to_right.is_some() {
            // With both tags, a `left` that says no forbids both: so lanelet2 reads them.
            let left = to_left.is_some_and(is_yes);
            let right = to_right.is_some_and(is_yes) && (left || to_left.is_none());
            return Self { to_left: left, to_right: right };
        }
        if !matches!(way.get("type"), Some("line_thin" | "line_thick")) {
            return Self::default();
        }
        match way.get("subtype") {
            Some("dashed") => Self { to_left: true, to_right: true },
            Some("dashed_solid") => Self { to_left: false, to_right: true },
            Some("solid_dashed") => Self { to_left: true, to_right: false },
            Some(_) | None => Self::default(),
        }
    }

    /// Seen from the other direction.
    pub(super) fn inverted(self) -> Self {
        Self { to_left: self.to_right, to_right: self.to_left }
    }
}

/// Whether vehicles may use a lanelet with these tags.
pub(super) fn is_for_vehicles(tags: &Tags) -> bool {
    override_tag(tags, "participant").unwrap_or_else(|| {
        matches!(tags.get("subtype"), None | Some("" | "road" | "highway" | "play_street" | "exit"))
    })
}

/// Whether vehicles may use a lanelet with these tags in one direction only.
pub(super) fn is_one_way(tags: &Tags) -> bool {
    match tags.get("one_way") {
        Some(one_way) => is_yes(one_way),
        None => override_tag(tags, "one_way").unwrap_or(true),
    }
}

/// What `participant:vehicle` and its like say of vehicles; none without any tag that begins so. A tag
/// for others only means: not for vehicles.
fn override_tag(tags: &Tags, prefix: &str) -> Option<bool> {
    let mut overrides = tags.iter().filter(|(key, _)| key.starts_with(prefix)).peekable();
    overrides.peek()?;
    let ours = |key: &str| key == prefix || key.strip_prefix(prefix) == Some(":vehicle");
    let said = overrides.find(|(key, _)| ours(key)).map(|(_, value)| is_yes(value));
    Some(said.unwrap_or(prefix == "one_way")) // other's ways do not open ours to both directions
}

fn is_yes(value: &str) -> bool {
    matches!(value, "yes" | "true" | "1")
}

#[cfg(test)]
mod tests;
