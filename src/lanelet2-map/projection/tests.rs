//! The expected numbers come from PROJ (9.x, its extended transverse Mercator and its topocentric
//! conversion).

use super::*;

fn geo(latitude_deg: f64, longitude_deg: f64, altitude_m: f64) -> Geo {
    Geo { latitude_deg, longitude_deg, altitude_m }
}

fn near<const N: usize>(found: Option<[f64; N]>, expected: [f64; N]) -> bool {
    found.is_some_and(|found| found.iter().zip(expected).all(|(one, two)| (one - two).abs() < 2e-6))
}

#[test]
fn transverse_mercator_agrees_with_proj() {
    let cases = [
        (35.6586, 139.7454, 141.0, 0.9996, [-113_562.397_219, 3_946_808.155_174]),
        (48.1, 11.6, 9.0, 0.9996, [193_566.088_290, 5_330_684.896_675]),
        (-33.8688, 151.2093, 153.0, 0.9996, [-165_631.366_352, -3_749_051.654_615]),
        (0.0, -3.0, -3.0, 1.0, [0.0, 0.0]),
        (84.0, -170.0, -177.0, 0.9996, [81_492.039_418, 9_333_050.927_492]),
        (84.0, 190.0, 183.0, 0.9996, [81_492.039_418, 9_333_050.927_492]),
        (51.5, -0.1, 0.0, 1.0, [-6_944.050_874, 5_707_716.994_143]),
        (35.6586, 139.7454, 139.7, 1.0, [4_111.001_838, 3_947_663.295_927]),
    ];
    for (lat, lon, meridian, scale, expected) in cases {
        let found = transverse_mercator(geo(lat, lon, 0.0), meridian, scale);
        assert!(near(found, expected), "{lat} {lon}: {found:?}");
    }
    for (lat, lon) in [(91.0, 0.0), (f64::NAN, 0.0), (0.0, 60.0), (0.0, f64::INFINITY), (0.0, 1e300)] {
        assert_eq!(transverse_mercator(geo(lat, lon, 0.0), 0.0, 1.0), None, "{lat} {lon}");
    }
    assert!(transverse_mercator(geo(90.0, 10.0, 0.0), 0.0, 1.0).is_some());
}

#[test]
fn east_north_and_up_agree_with_proj() {
    let tokyo = geo(35.6586, 139.7454, 40.0);
    let cases = [
        (geo(35.67, 139.75, 60.0), tokyo, [416.477_918, 1_264.883_480, 19.860_582]),
        (geo(-33.9, 151.2, -5.0), geo(-33.8688, 151.2093, 12.5), [-860.183_317, -3_460.749_363, -18.500_218]),
        (tokyo, tokyo, [0.0; 3]),
    ];
    for (position, origin, expected) in cases {
        let found = east_north_up(position, origin);
        assert!(near(found, expected), "{position:?}: {found:?}");
    }
    assert_eq!(east_north_up(geo(91.0, 0.0, 0.0), tokyo), None);
}

#[test]
fn a_military_square_begins_in_its_south_western_corner() {
    // UTM zone 54: easting 386437.602781, northing 3946808.155174.
    let position = geo(35.6586, 139.7454, 0.0);
    let cases = [
        ("54SUE", Some([86_437.602_781, 46_808.155_174])),
        ("54SVE", Some([-13_562.397_219, 46_808.155_174])), // the square beside it
        ("54SUD", Some([86_437.602_781, 146_808.155_174])),
        ("54SUF", Some([86_437.602_781, -53_191.844_826])),
        ("4QFJ", None),  // far away
        ("53SUE", None), // no such column in this zone
        ("54SUW", None),
        ("54IUE", None),
        ("61SUE", None),
        ("0SUE", None),
        ("54SU", None),
        ("54SUE1", None),
        ("54", None),
        ("SUE", None),
        ("", None),
        ("５４SUE", None),
    ];
    for (name, expected) in cases {
        let found = MgrsSquare::parse(name).and_then(|square| square.project(position));
        assert!(expected.map_or(found.is_none(), |expected| near(found, expected)), "{name}: {found:?}");
    }
    // Sydney: 56HLH, easting 334368.633648, northing 6250948.345385 with the southern false northing.
    let found = MgrsSquare::parse("56HLH").unwrap().project(geo(-33.8688, 151.2093, 0.0));
    assert!(near(found, [34_368.633_648, 50_948.345_385]), "{found:?}");
}

#[test]
fn the_square_around_a_position_is_the_one_with_its_name() {
    for (name, position) in [("54SUE", geo(35.68, 139.75, 0.0)), ("56HLH", geo(-33.8688, 151.2093, 0.0))] {
        let found = MgrsSquare::around(position).unwrap().project(position);
        assert!(
            near(found, MgrsSquare::parse(name).unwrap().project(position).unwrap()),
            "{name}: {found:?}"
        );
    }
}

#[test]
fn zones_have_their_exceptions() {
    let cases = [
        (35.0, 139.7, 141.0),
        (35.0, 138.0, 141.0),
        (35.0, 137.999, 135.0),
        (0.0, -180.0, -177.0),
        (0.0, 180.0, -177.0),
        (60.0, 2.9, 3.0),
        (60.0, 3.0, 9.0),
        (55.9, 5.0, 3.0),
        (64.0, 5.0, 3.0),
        (75.0, 8.9, 3.0),
        (75.0, 9.0, 15.0),
        (75.0, 21.0, 27.0),
        (75.0, 33.0, 39.0),
        (75.0, 42.0, 45.0),
        (75.0, -1.0, -3.0),
    ];
    for (lat, lon, meridian) in cases {
        assert!((utm_meridian_deg(geo(lat, lon, 0.0)) - meridian).abs() < 1e-9, "{lat} {lon}");
    }
}
