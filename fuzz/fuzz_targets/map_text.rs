//! Any bytes are read as a lanelet2 map, or refused, and every lanelet of a map can be asked for.

#![no_main]

use libfuzzer_sys::fuzz_target;
use signal_gateway::core::map::lanelet::LaneletIndex;
use signal_gateway::core::map::projector::{Geo, Projector};
use signal_gateway::core::map::road_map::RoadMap;

fuzz_target!(|bytes: &[u8]| {
    let origin = Geo { latitude_deg: 35.9, longitude_deg: 139.9, altitude_m: 0.0 };
    for projector in [Projector::Local, Projector::LocalCartesianUtm(origin)] {
        let Ok(map) = RoadMap::read(bytes, &projector) else { continue };
        for at in 0..map.lanelets().len() {
            let index = LaneletIndex(at);
            let lanelet = map.lanelet(index).expect("it is one of them");
            assert_eq!(map.index_of(lanelet.id), Some(index));
            let [x, y, _] = lanelet.centerline.point_at(lanelet.centerline.length_m() / 2.0);
            assert!(x.is_finite() && y.is_finite());
            assert!(map.nearest_lanelet([x, y], |_| true).is_some());
            for follower in map.followers(index) {
                assert!(map.previous(*follower).contains(&index));
            }
        }
    }
    let _ = Projector::parse(&String::from_utf8_lossy(bytes));
});
