//! A lanelet2 map in the making, and its text. Equal points are one node, equal lines one way: so
//! lanelets that touch share what they should.

use std::collections::BTreeMap;

use super::curve::{Curve, Point};

/// Half the width of a lane, metres.
pub(crate) const HALF_WIDTH_M: f64 = 1.75;

/// The origin of `local_x` and `local_y`; only for viewers that know nothing of them.
const ORIGIN_DEG: [f64; 2] = [35.0, 139.0];
const METRES_PER_DEGREE: f64 = 111_195.0;

/// The marking of a line.
#[derive(Clone, Copy)]
pub(crate) enum Marking {
    /// The edge of the road.
    Border,
    /// Not to be crossed.
    Solid,
    /// Dashed: may be crossed.
    Dashed,
    /// No marking at all.
    Virtual,
}

/// A tag: key and value.
pub(crate) type Tag = (&'static str, String);

/// A map. Ids of lanelets and elements are given, those of nodes and ways counted.
#[derive(Default)]
pub(crate) struct Drawing {
    /// Nodes by position and height in millimetres.
    nodes: BTreeMap<[i64; 3], i64>,
    ways: Vec<Way>,
    relations: Vec<Relation>,
}

struct Way {
    id: i64,
    nodes: Vec<i64>,
    tags: Vec<Tag>,
}

struct Relation {
    id: i64,
    members: Vec<(&'static str, &'static str, i64)>,
    tags: Vec<Tag>,
}

/// A lanelet to draw.
pub(crate) struct Lane<'a> {
    pub(crate) id: i64,
    pub(crate) middle: &'a Curve,
    pub(crate) left: Marking,
    pub(crate) right: Marking,
    /// Heights of its start and its end, metres.
    pub(crate) heights_m: [f64; 2],
    /// Ids of regulatory elements.
    pub(crate) elements: Vec<i64>,
    /// Besides those every road has.
    pub(crate) tags: Vec<Tag>,
}

/// A tag with this value.
pub(crate) fn tag(key: &'static str, value: impl Into<String>) -> Tag {
    (key, value.into())
}

impl<'a> Lane<'a> {
    /// A lane between two markings, without anything special.
    pub(crate) fn new(id: i64, middle: &'a Curve, left: Marking, right: Marking) -> Self {
        Self { id, middle, left, right, heights_m: [0.0; 2], elements: Vec::new(), tags: Vec::new() }
    }

    /// A lane of an intersection.
    pub(crate) fn turning(id: i64, middle: &'a Curve, direction: &str) -> Self {
        let lane = Self::new(id, middle, Marking::Virtual, Marking::Virtual);
        Self { tags: vec![tag("turn_direction", direction)], ..lane }
    }
}

impl Drawing {
    /// A lane of a road.
    pub(crate) fn lane(&mut self, lane: Lane<'_>) {
        let mut bound =
            |left_m, marking| self.rising_line(&lane.middle.beside(left_m), lane.heights_m, marked(marking));
        let (left, right) = (bound(HALF_WIDTH_M, lane.left), bound(-HALF_WIDTH_M, lane.right));
        let mut tags = vec![
            tag("subtype", "road"),
            tag("location", "urban"),
            tag("one_way", "yes"),
            tag("participant:vehicle", "yes"),
            tag("speed_limit", "50"),
        ];
        tags.extend(lane.tags);
        self.lanelet(lane.id, [left, right], &lane.elements, tags);
    }

    /// A hard shoulder between two lines in the direction of traffic.
    pub(crate) fn shoulder(&mut self, id: i64, left: (&[Point], Marking), right: (&[Point], Marking)) {
        let sides = [left, right].map(|(line, marking)| self.line(line, marked(marking)));
        let tags = vec![tag("subtype", "road_shoulder"), tag("location", "urban"), tag("one_way", "yes")];
        self.lanelet(id, sides, &[], tags);
    }

    fn lanelet(&mut self, id: i64, [left, right]: [i64; 2], elements: &[i64], tags: Vec<Tag>) {
        let mut members = vec![("way", "left", left), ("way", "right", right)];
        members.extend(elements.iter().map(|id| ("relation", "regulatory_element", *id)));
        self.relations.push(Relation { id, members, tags: with_type("lanelet", tags) });
    }

    /// A roundabout of lanelets that refer to it.
    pub(crate) fn roundabout(&mut self, id: i64, roles: [(&'static str, Vec<i64>); 3]) {
        let members =
            roles.into_iter().flat_map(|(role, ids)| ids.into_iter().map(move |id| ("relation", role, id)));
        self.element(id, members.collect(), "roundabout");
    }

    /// A traffic light for lanelets that refer to it: its head from left to right, and the stop line.
    pub(crate) fn traffic_light(&mut self, id: i64, head: [Point; 2], stop_line: [Point; 2]) {
        let (type_of, subtype) = (tag("type", "traffic_light"), tag("subtype", "red_yellow_green"));
        let head = self.line(&head, vec![type_of, subtype, tag("height", "0.45")]);
        let stop_line = self.line(&stop_line, vec![tag("type", "stop_line")]);
        self.element(id, vec![("way", "refers", head), ("way", "ref_line", stop_line)], "traffic_light");
    }

    fn element(&mut self, id: i64, members: Vec<(&'static str, &'static str, i64)>, subtype: &str) {
        let tags = with_type("regulatory_element", vec![tag("subtype", subtype)]);
        self.relations.push(Relation { id, members, tags });
    }

    /// A hatched area; it touches lanes where it has their points.
    pub(crate) fn hatched(&mut self, ring: &[Point]) {
        self.line(ring, vec![tag("type", "hatched_road_markings"), tag("area", "yes")]);
    }

    /// A way at height zero, or one drawn before through the same points in either direction.
    fn line(&mut self, points: &[Point], tags: Vec<Tag>) -> i64 {
        self.rising_line(points, [0.0; 2], tags)
    }

    /// A way that rises by as much from each point to the next, or one drawn before.
    fn rising_line(&mut self, points: &[Point], [from_m, to_m]: [f64; 2], tags: Vec<Tag>) -> i64 {
        let steps = (1..points.len()).map(|_| 1.0).sum::<f64>();
        let heights_m = (0..).map(|step| from_m + (to_m - from_m) * f64::from(step) / steps);
        let nodes: Vec<i64> =
            points.iter().zip(heights_m).map(|([x, y], z)| self.node([*x, *y, z])).collect();
        let backwards: Vec<i64> = nodes.iter().rev().copied().collect();
        let drawn = self.ways.iter().find(|way| way.nodes == nodes || way.nodes == backwards);
        if let Some(way) = drawn {
            return way.id;
        }
        let id = next_id(5001, self.ways.len());
        self.ways.push(Way { id, nodes, tags });
        id
    }

    fn node(&mut self, point: [f64; 3]) -> i64 {
        let next = next_id(10_001, self.nodes.len());
        *self.nodes.entry(point.map(millimetres)).or_insert(next)
    }

    /// The text of the file.
    pub(crate) fn osm(&self) -> String {
        let mut nodes: Vec<(i64, [i64; 3])> = self.nodes.iter().map(|(at, id)| (*id, *at)).collect();
        nodes.sort_unstable();
        let mut text = String::from(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<osm generator=\"make_maps\" version=\"0.6\">\n",
        );
        text.push_str("  <MetaInfo format_version=\"1\" map_version=\"1\"/>\n");
        for (id, at) in nodes {
            let [x, y, z] = at.map(metres);
            let latitude = ORIGIN_DEG[0] + y / METRES_PER_DEGREE;
            let longitude = ORIGIN_DEG[1] + x / (METRES_PER_DEGREE * ORIGIN_DEG[0].to_radians().cos());
            text.push_str(&format!("  <node id=\"{id}\" lat=\"{latitude:.8}\" lon=\"{longitude:.8}\">\n"));
            let tags = [
                tag("ele", z.to_string()),
                tag("local_x", format!("{x:.3}")),
                tag("local_y", format!("{y:.3}")),
            ];
            push_tags(&mut text, &tags);
            text.push_str("  </node>\n");
        }
        for way in &self.ways {
            text.push_str(&format!("  <way id=\"{}\">\n", way.id));
            for node in &way.nodes {
                text.push_str(&format!("    <nd ref=\"{node}\"/>\n"));
            }
            push_tags(&mut text, &way.tags);
            text.push_str("  </way>\n");
        }
        for relation in &self.relations {
            text.push_str(&format!("  <relation id=\"{}\">\n", relation.id));
            for (kind, role, id) in &relation.members {
                text.push_str(&format!("    <member type=\"{kind}\" ref=\"{id}\" role=\"{role}\"/>\n"));
            }
            push_tags(&mut text, &relation.tags);
            text.push_str("  </relation>\n");
        }
        text.push_str("</osm>\n");
        text
    }
}

fn push_tags(text: &mut String, tags: &[Tag]) {
    for (key, value) in tags {
        text.push_str(&format!("    <tag k=\"{key}\" v=\"{value}\"/>\n"));
    }
}

fn with_type(kind: &str, tags: Vec<Tag>) -> Vec<Tag> {
    std::iter::once(tag("type", kind)).chain(tags).collect()
}

fn marked(marking: Marking) -> Vec<Tag> {
    let (kind, subtype) = match marking {
        Marking::Border => ("road_border", None),
        Marking::Solid => ("line_thin", Some("solid")),
        Marking::Dashed => ("line_thin", Some("dashed")),
        Marking::Virtual => ("virtual", None),
    };
    with_type(kind, subtype.map(|subtype| tag("subtype", subtype)).into_iter().collect())
}

fn next_id(first: i64, count: usize) -> i64 {
    // The maps are small.
    first + i64::try_from(count).unwrap_or(i64::MAX - first)
}

#[allow(clippy::cast_possible_truncation)] // the maps are small
fn millimetres(metres: f64) -> i64 {
    (metres * 1000.0).round() as i64
}

#[allow(clippy::cast_precision_loss)] // the maps are small
fn metres(millimetres: i64) -> f64 {
    millimetres as f64 / 1000.0
}
