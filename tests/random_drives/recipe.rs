//! A random drive: a route over a shipped map, speeds, stops, manoeuvres one after the other. As a file it is
//! read like any other.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::LazyLock;

use lanelet2_map::lane_network::{LaneId, LaneNetwork};
use lanelet2_map::osm;
use lanelet2_map::points::Points;
use lanelet2_map::projector::Projector;
use proptest::prelude::*;

#[rustfmt::skip]
const MAPS: [&str; 12] = [
    "lane_change_road", "consecutive_turns", "chicane", "fork", "bus_bay", "crossing", "helix", "roundabout",
    "roundabout_untagged", "side_streets", "turn_before_roundabout", "narrow_road",
];
const SIDES: [&str; 3] = ["None", "Left", "Right"];
/// Routes end after so many lanelets, or as soon as they are this long, metres.
const MOST_LANES: usize = 16;
const ROUTE_M: f64 = 500.0;
/// A manoeuvre ends this far before the end of the route at least, metres.
const BEFORE_END_M: f64 = 5.0;

/// A drive to be written as a file. Manoeuvres follow each other.
#[derive(Debug, Clone)]
pub(crate) struct Recipe {
    map: usize,
    /// The first lanelet, and which of the followers comes next.
    start: usize,
    ways: Vec<usize>,
    speeds: Vec<(u16, u8)>,
    stop: Option<(u16, u8)>,
    on_entry: usize,
    on_exit: usize,
    persists: bool,
    pulls_out: Option<bool>,
    moves: Vec<Move>,
    pull_over: Option<(u16, u16, bool)>,
}

#[derive(Debug, Clone)]
struct Move {
    gap_m: u16,
    length_m: u16,
    to_left: bool,
    /// The planner knows of it so far ahead; otherwise from the start.
    known_ahead_m: Option<u16>,
    /// Gap to the way back of an avoidance and its length; a lane change without.
    back: Option<(u16, u16)>,
}

pub(crate) fn any_recipe() -> impl Strategy<Value = Recipe> {
    use proptest::collection::vec;
    use proptest::option;
    let back = option::of((1..50_u16, 8..50_u16));
    let known = option::weighted(0.3, 8..80_u16);
    let a_move = (0..80_u16, 8..60_u16, any::<bool>(), known, back).prop_map(
        |(gap_m, length_m, to_left, known_ahead_m, back)| Move {
            gap_m,
            length_m,
            to_left,
            known_ahead_m,
            back,
        },
    );
    let route = (0..MAPS.len(), 0..1000_usize, vec(0..6_usize, MOST_LANES));
    let speeds = vec((0..300_u16, 2..15_u8), 1..4);
    let pull_over = (0..60_u16, 10..40_u16, any::<bool>());
    (
        (route, speeds, option::weighted(0.3, (0..250_u16, 1..6_u8))),
        (0..SIDES.len(), 0..SIDES.len(), any::<bool>(), option::weighted(0.3, any::<bool>())),
        vec(a_move, 0..4),
        option::weighted(0.3, pull_over),
    )
        .prop_map(|(way, (on_entry, on_exit, persists, pulls_out), moves, pull_over)| {
            let ((map, start, ways), speeds, stop) = way;
            Recipe {
                map,
                start,
                ways,
                speeds,
                stop,
                on_entry,
                on_exit,
                persists,
                pulls_out,
                moves,
                pull_over,
            }
        })
}

static NETWORKS: LazyLock<Vec<LaneNetwork>> = LazyLock::new(|| {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/maps");
    let read = |name: &&str| {
        let bytes = |file: &str| std::fs::read(folder.join(name).join(file)).unwrap();
        let projector = String::from_utf8(bytes("map_projector_info.yaml")).unwrap();
        let osm = osm::read(&bytes("lanelet2_map.osm")).unwrap();
        let points = Points::new(&osm, &Projector::parse(&projector).unwrap()).unwrap();
        LaneNetwork::read(&osm, &points).unwrap()
    };
    MAPS.iter().map(read).collect()
});

impl Recipe {
    /// Lanelets that follow each other, none twice, and their length, metres.
    fn route(&self) -> (Vec<LaneId>, f64) {
        let road = &NETWORKS[self.map];
        let starts: Vec<LaneId> = road.lanes().map(|lane| lane.id).collect();
        let mut lanes = vec![starts[self.start % starts.len()]];
        let mut length_m = road.lane(lanes[0]).unwrap().length_m();
        for way in &self.ways {
            let followers = road.followers(lanes[lanes.len() - 1]);
            if followers.is_empty() || length_m > ROUTE_M {
                break;
            }
            let next = followers[way % followers.len()];
            // From inside a ring once around to the own start: a limit of the decider,
            // docs/spec/turn-signal-decider.md, W20.
            if lanes.contains(&next) || road.followers(next).contains(&lanes[0]) {
                break;
            }
            length_m += road.lane(next).unwrap().length_m();
            lanes.push(next);
        }
        (lanes, length_m)
    }

    /// The drive as a file. Manoeuvres that do not fit on the route are left out.
    pub(crate) fn text(&self) -> String {
        let (lanes, length_m) = self.route();
        let map = MAPS[self.map];
        let fits = |to_m: u16| f64::from(to_m) <= length_m - BEFORE_END_M;
        let mut text = format!("map = \"../maps/{map}/lanelet2_map.osm\"\nplanning_hz = 5\n");
        let mut speeds = self.speeds.clone();
        speeds.sort_unstable_by_key(|(at_m, _)| *at_m);
        speeds.dedup_by_key(|(at_m, _)| *at_m);
        let step = |(at_m, mps): &(u16, u8)| format!("{{ at_m = {at_m}, mps = {mps} }}");
        let steps: Vec<_> = speeds.iter().map(step).collect();
        let (entry, exit) = (SIDES[self.on_entry], SIDES[self.on_exit]);
        let segments: Vec<_> = lanes.iter().map(|lane| format!("[{lane}]")).collect();
        let _ = writeln!(
            text,
            "\n[route]\nsegments = [{}]\n\n[parameters]\nturn_signal_roundabout_on_entry = \"{entry}\"\n\
             turn_signal_roundabout_on_exit = \"{exit}\"\n\
             turn_signal_roundabout_entry_indicator_persistence = {}\n\n[drive]\nspeed = [{}]",
            segments.join(", "),
            self.persists,
            steps.join(", ")
        );
        if let Some((at_m, for_s)) = self.stop {
            let _ = writeln!(text, "stops = [{{ at_m = {at_m}, for_s = {for_s} }}]");
        }
        let mut at_m = 0;
        if let Some(from_left) = self.pulls_out.filter(|_| fits(25)) {
            let offset_m = if from_left { 2.2 } else { -2.2 };
            let _ = writeln!(
                text,
                "\n[[manoeuvre]]\nkind = \"pull_out\"\nfrom_m = 0\nto_m = 25\noffset_m = {offset_m}"
            );
            at_m = 25;
        }
        for a_move in &self.moves {
            let (from_m, to_m) = a_move.within_m(at_m);
            if !fits(to_m) {
                break;
            }
            a_move.write(from_m, &mut text);
            at_m = to_m;
        }
        if let Some((gap_m, length_m, is_announced)) = self.pull_over {
            let from_m = at_m + 40 + gap_m;
            let to_m = from_m + length_m;
            if !fits(to_m) {
                return text;
            }
            let _ = writeln!(
                text,
                "\n[[manoeuvre]]\nkind = \"pull_over\"\nfrom_m = {from_m}\nto_m = {to_m}\noffset_m = 2.2"
            );
            if is_announced {
                let (decided_m, braking_m) = (from_m - 25, from_m - 38);
                let _ = writeln!(
                    text,
                    "decided_from_m = {decided_m}\ndeceleration_m = {braking_m}\nstop_m = {from_m}\nstop_path_end_m = {to_m}"
                );
            }
        }
        text
    }
}

impl Move {
    /// Its start and end, the one before having ended at a position.
    fn within_m(&self, before_m: u16) -> (u16, u16) {
        let from_m = before_m + self.gap_m;
        let out_m = from_m + self.length_m;
        (from_m, self.back.map_or(out_m, |(gap_m, length_m)| out_m + gap_m + length_m))
    }

    fn write(&self, from_m: u16, text: &mut String) {
        let to_m = from_m + self.length_m;
        match self.back {
            None => {
                let side = if self.to_left { "left" } else { "right" };
                let _ = writeln!(
                    text,
                    "\n[[manoeuvre]]\nkind = \"lane_change\"\nside = \"{side}\"\nfrom_m = {from_m}\nto_m = {to_m}"
                );
            }
            Some((gap_m, length_m)) => {
                // Within its lane an avoidance is not signalled.
                let offset_m = if self.to_left { 2.5 } else { -2.5 };
                let back_m = to_m + gap_m;
                let end_m = back_m + length_m;
                let _ = writeln!(
                    text,
                    "\n[[manoeuvre]]\nkind = \"avoidance\"\nlines = [{{ from_m = {from_m}, to_m = {to_m}, offset_m \
                     = {offset_m} }}, {{ from_m = {back_m}, to_m = {end_m}, offset_m = 0 }}]"
                );
            }
        }
        if let Some(known_m) = self.known_ahead_m.and_then(|ahead_m| from_m.checked_sub(ahead_m)) {
            let _ = writeln!(text, "known_from_m = {known_m}");
        }
    }
}
