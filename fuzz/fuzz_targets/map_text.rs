//! Any bytes are read as a lanelet2 map, or refused, and every lanelet of a map can be queried.

#![no_main]

use libfuzzer_sys::fuzz_target;
use lanelet2_map::geometry::polyline::at_arc;
use lanelet2_map::lane_network::LaneNetwork;
use lanelet2_map::osm;
use lanelet2_map::points::Points;
use lanelet2_map::projector::{Geo, Projector};

fuzz_target!(|bytes: &[u8]| {
    let _ = Projector::parse(&String::from_utf8_lossy(bytes));
    let Ok(osm) = osm::read(bytes) else { return };
    let origin = Geo { latitude_deg: 35.9, longitude_deg: 139.9, altitude_m: 0.0 };
    for projector in [Projector::Local, Projector::LocalCartesianUtm(origin)] {
        let road = Points::new(&osm, &projector).and_then(|points| LaneNetwork::read(&osm, &points));
        let Ok(road) = road else { continue };
        for lane in road.lanes() {
            assert_eq!(road.lane(lane.id), Some(lane));
            let middle = at_arc(&lane.centerline, lane.length_m() / 2.0).expect("it has points");
            assert!(middle.is_finite());
            for follower in road.followers(lane.id) {
                assert!(road.predecessors(*follower).contains(&lane.id));
            }
        }
    }
});
