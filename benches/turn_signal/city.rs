//! The text of a made-up city: streets on a grid, one lane each way, traffic on the left, and every turn
//! at every crossing a lanelet of its own.

use std::collections::HashMap;
use std::fmt::Write;

/// Between crossings, metres.
const BLOCK_M: f64 = 100.0;
/// From the middle of a crossing to where its streets begin, metres.
const CORNER_M: f64 = 10.0;
const LANE_WIDTH_M: f64 = 3.5;
/// Points of a bound, its ends included.
const STREET_POINTS: u32 = 9;
const TURN_POINTS: u32 = 7;

/// Directions of driving: east, north, west, south.
const HEADINGS: [[f64; 2]; 4] = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
pub(crate) const EAST: usize = 0;
pub(crate) const NORTH: usize = 1;

/// The role of a lanelet at the crossing that names it.
#[derive(Clone, Copy)]
pub(crate) enum Part {
    /// The street that leaves it in a direction.
    Street = 0,
    /// The lanelets over it from a direction.
    Left = 1,
    Straight = 2,
    Right = 3,
}

/// A city of so many by so many crossings.
#[derive(Clone, Copy)]
pub(crate) struct City {
    pub(crate) side: usize,
}

impl City {
    /// Metres from its southern to its northern end.
    pub(crate) fn extent_m(self) -> f64 {
        metres(self.side) * BLOCK_M
    }

    pub(crate) fn lanelet(self, [column, row]: [usize; 2], heading: usize, part: Part) -> i64 {
        let number = ((row * self.side + column) * HEADINGS.len() + heading) * 4 + part as usize;
        i64::try_from(number).unwrap() + 1
    }

    /// The lanelets of a route that turns left and right in turn, from the south-west, over so many steps.
    pub(crate) fn staircase(self, steps: usize) -> Vec<i64> {
        let step = |at: usize| {
            [
                self.lanelet([at, at], EAST, Part::Street),
                self.lanelet([at + 1, at], EAST, Part::Left),
                self.lanelet([at + 1, at], NORTH, Part::Street),
                self.lanelet([at + 1, at + 1], NORTH, Part::Right),
            ]
        };
        (0..steps).flat_map(step).collect()
    }

    /// The text of its map.
    pub(crate) fn osm(self) -> String {
        let mut sheet = Sheet::default();
        for crossing in (0..self.side).flat_map(|row| (0..self.side).map(move |column| [column, row])) {
            for heading in 0..HEADINGS.len() {
                self.draw(&mut sheet, crossing, heading);
            }
        }
        let Sheet { nodes_text, ways_text, relations_text, .. } = sheet;
        [
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<osm version=\"0.6\">\n",
            &nodes_text,
            &ways_text,
            &relations_text,
            "</osm>\n",
        ]
        .concat()
    }

    fn draw(self, sheet: &mut Sheet, crossing: [usize; 2], heading: usize) {
        let middle = crossing.map(|at| metres(at) * BLOCK_M);
        let [dx, dy] = HEADINGS[heading];
        let beyond = [middle[0] + dx * BLOCK_M, middle[1] + dy * BLOCK_M];
        let inside = |at: f64| at >= 0.0 && at < self.extent_m();
        if beyond.into_iter().all(inside) {
            let bounds = [LANE_WIDTH_M, 0.0].map(|aside_m| {
                let (from, to) =
                    (beside(middle, heading, CORNER_M, aside_m), beside(beyond, heading, -CORNER_M, aside_m));
                let half = [f64::midpoint(from[0], to[0]), f64::midpoint(from[1], to[1])];
                bend([from, half, to], STREET_POINTS)
            });
            sheet.lanelet(self.lanelet(crossing, heading, Part::Street), &bounds, None);
        }
        for (part, turned, direction) in
            [(Part::Left, 1, "left"), (Part::Straight, 0, "straight"), (Part::Right, 3, "right")]
        {
            let leaving = (heading + turned) % HEADINGS.len();
            let bounds = [LANE_WIDTH_M, 0.0].map(|aside_m| {
                let from = beside(middle, heading, -CORNER_M, aside_m);
                let to = beside(middle, leaving, CORNER_M, aside_m);
                let corner = beside(middle, heading, 0.0, aside_m);
                let corner = if turned == 0 { corner } else { beside(corner, leaving, 0.0, aside_m) };
                bend([from, corner, to], TURN_POINTS)
            });
            sheet.lanelet(self.lanelet(crossing, heading, part), &bounds, Some(direction));
        }
    }
}

/// So far along a heading and to the left of it.
fn beside([x, y]: [f64; 2], heading: usize, along_m: f64, left_m: f64) -> [f64; 2] {
    let [dx, dy] = HEADINGS[heading];
    [x + dx * along_m - dy * left_m, y + dy * along_m + dx * left_m]
}

/// Points of the parabola that leaves `from` towards `corner` and meets `to` from there.
fn bend([from, corner, to]: [[f64; 2]; 3], points: u32) -> Vec<[f64; 2]> {
    let at = |share: f64| {
        let rest = 1.0 - share;
        [0, 1].map(|axis| {
            rest * rest * from[axis] + 2.0 * share * rest * corner[axis] + share * share * to[axis]
        })
    };
    (0..points).map(|point| at(f64::from(point) / f64::from(points - 1))).collect()
}

/// The map drawn so far. Equal points are one node, equal lines one way.
#[derive(Default)]
struct Sheet {
    /// Nodes by position in millimetres.
    nodes: HashMap<[i64; 2], usize>,
    ways: HashMap<Vec<usize>, usize>,
    nodes_text: String,
    ways_text: String,
    relations_text: String,
}

impl Sheet {
    fn lanelet(&mut self, id: i64, bounds: &[Vec<[f64; 2]>; 2], turn_direction: Option<&str>) {
        let text = |way: usize, role| format!("<member type=\"way\" ref=\"{way}\" role=\"{role}\"/>\n");
        let [left, right] = bounds.each_ref().map(|bound| self.way(bound));
        let out = &mut self.relations_text;
        write!(out, "<relation id=\"{id}\">\n{}{}", text(left, "left"), text(right, "right")).unwrap();
        let tags = [("type", "lanelet"), ("subtype", "road"), ("location", "urban"), ("one_way", "yes")];
        for (key, value) in tags.into_iter().chain(turn_direction.map(|turn| ("turn_direction", turn))) {
            tag(out, key, value);
        }
        out.push_str("</relation>\n");
    }

    fn way(&mut self, points: &[[f64; 2]]) -> usize {
        let mut nodes: Vec<usize> = points.iter().map(|point| self.node(*point)).collect();
        if nodes.first() > nodes.last() {
            nodes.reverse();
        }
        let id = self.ways.len() + 1;
        if let Some(drawn) = self.ways.get(&nodes) {
            return *drawn;
        }
        let out = &mut self.ways_text;
        writeln!(out, "<way id=\"{id}\">").unwrap();
        for node in &nodes {
            writeln!(out, "<nd ref=\"{node}\"/>").unwrap();
        }
        tag(out, "type", "line_thin");
        tag(out, "subtype", "solid");
        out.push_str("</way>\n");
        self.ways.insert(nodes, id);
        id
    }

    fn node(&mut self, point: [f64; 2]) -> usize {
        let next = self.nodes.len() + 1;
        #[allow(clippy::cast_possible_truncation)] // a city is far smaller than 2^53 mm
        let node = self.nodes.entry(point.map(|axis| (axis * 1000.0).round() as i64));
        *node.or_insert_with(|| {
            let out = &mut self.nodes_text;
            writeln!(out, "<node id=\"{next}\" lat=\"35.00000000\" lon=\"139.00000000\">").unwrap();
            let [x, y] = point.map(|axis| format!("{axis:.3}"));
            for (key, value) in [("ele", "0.0"), ("local_x", &x), ("local_y", &y)] {
                tag(out, key, value);
            }
            out.push_str("</node>\n");
            next
        })
    }
}

fn tag(out: &mut String, key: &str, value: &str) {
    writeln!(out, "  <tag k=\"{key}\" v=\"{value}\"/>").unwrap();
}

fn metres(count: usize) -> f64 {
    f64::from(u32::try_from(count).unwrap())
}
