//! The shipped maps: small, made up, traffic on the left as in Autoware's own parameters. Lanes are
//! 3.5 m wide; the middle of each is what its description gives.

mod block;
mod bus_bay;
mod chicane;
mod crossing;
mod curve;
mod drawing;
mod fork;
mod helix;
mod lane_change_road;
mod narrow_road;
mod roundabout;
mod side_streets;
mod turn_before_roundabout;
mod turns;

use drawing::Drawing;

/// The file with the lanelets, in the folder of a map.
pub(crate) const MAP_FILE: &str = "lanelet2_map.osm";
/// The file that defines the projection of coordinates.
pub(crate) const PROJECTOR_FILE: &str = "map_projector_info.yaml";
/// Its text: `local_x` and `local_y` are the coordinates.
pub(crate) const PROJECTOR: &str = "projector_type: Local\n";

/// A map, and the drawing of it.
pub(crate) struct Map {
    /// Name of the folder of the map.
    pub(crate) name: &'static str,
    draw: fn(&mut Drawing),
}

/// All maps to make.
pub(crate) const ALL: [Map; 13] = [
    Map { name: "block", draw: block::draw },
    Map { name: "bus_bay", draw: bus_bay::draw },
    Map { name: "chicane", draw: chicane::draw },
    Map { name: "consecutive_turns", draw: turns::draw },
    Map { name: "crossing", draw: crossing::draw },
    Map { name: "fork", draw: fork::draw },
    Map { name: "helix", draw: helix::draw },
    Map { name: "lane_change_road", draw: lane_change_road::draw },
    Map { name: "narrow_road", draw: narrow_road::draw },
    Map { name: "roundabout", draw: roundabout::draw_tagged },
    Map { name: "roundabout_untagged", draw: roundabout::draw_untagged },
    Map { name: "side_streets", draw: side_streets::draw },
    Map { name: "turn_before_roundabout", draw: turn_before_roundabout::draw },
];

impl Map {
    /// The text of [`MAP_FILE`].
    pub(crate) fn osm(&self) -> String {
        let mut drawing = Drawing::default();
        (self.draw)(&mut drawing);
        drawing.osm()
    }
}
