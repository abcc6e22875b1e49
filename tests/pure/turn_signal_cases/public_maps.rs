//! Facts of public maps that decide upstream's commands: who follows whom, and where short turns are aligned.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use flate2::read::GzDecoder;
use lanelet2_map::geometry::polyline::nearest;
use lanelet2_map::geometry::required_end::first_aligned;
use lanelet2_map::lane_network::LaneNetwork;
use lanelet2_map::points::Points;
use lanelet2_map::projector::Projector;

use crate::support::prerequisite::{require, shared_data};

fn road(folder: &Path, map: &str, projector: Option<Projector>) -> LaneNetwork {
    let packed = File::open(folder.join(format!("decider/{map}.osm.gz"))).unwrap();
    let mut text = Vec::new();
    GzDecoder::new(packed).read_to_end(&mut text).unwrap();
    let osm = lanelet2_map::osm::read(&text).unwrap();
    let projector = projector.unwrap_or_else(|| Projector::mgrs_around(&osm).unwrap());
    LaneNetwork::read(&osm, &Points::new(&osm, &projector).unwrap()).unwrap()
}

/// The answers of lanelet2 1.2.3 for these maps, written to its binary format and read from it.
#[test]
fn forks_and_merges_of_public_maps_are_in_the_order_of_the_routing_graph() {
    let folder = require!(shared_data());
    let [smart, later] =
        ["zala_smart", "zala_smart_2025"].map(|map| road(&folder, map, Some(Projector::Local)));
    for (id, followers) in [
        (4_033_656, [4_035_192, 4_033_672]),
        (4_033_793, [4_037_280, 4_035_172]),
        (4_033_759, [4_035_126, 4_035_143]),
    ] {
        assert_eq!(smart.followers(id), followers, "{id}");
    }
    for (id, followers) in [
        (4_035_224, [4_036_912, 4_033_741, 4_038_905]),
        (4_036_289, [4_036_338, 4_036_356, 4_036_327]),
        (4_036_383, [4_036_491, 4_036_469, 4_039_698]),
    ] {
        assert_eq!(later.followers(id), followers, "{id}");
    }
    for (road, predecessors) in
        [(&smart, [4_036_327, 4_035_397, 4_036_272]), (&later, [4_035_397, 4_036_327, 4_036_272])]
    {
        assert_eq!(road.predecessors(4_035_360), predecessors);
    }
}

/// Turns of three points, which a straight line between these would align a quarter of their length earlier.
#[test]
fn short_turns_of_public_maps_are_aligned_on_the_cubic() {
    let folder = require!(shared_data());
    for (map, lane, expected_m) in
        [("core_motion_velocity", 35046, 3.50), ("kashiwanoha", 35046, 3.50), ("kashiwanoha", 35051, 4.11)]
    {
        let road = road(&folder, map, None);
        let centerline = &road.lane(lane).unwrap().centerline;
        let start = first_aligned(centerline, 15.0).unwrap();
        let along_m = nearest(centerline, start.position).unwrap().arc_m;
        assert!((along_m - expected_m).abs() < 0.005, "{map} {lane}: {along_m} m");
    }
}
