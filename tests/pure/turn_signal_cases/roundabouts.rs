//! R1 to R11: into a roundabout and out of it, improved and as upstream.

use lanelet2_map::lane_network::{LaneNetwork, Lanelet, Roundabout};
use turn_signal::compat::DeciderCompat::{self, Improved, Upstream};
use turn_signal::compat::DeciderQuirks;
use turn_signal::parameters::DeciderParameters;
use turn_signal::roundabout::RoundaboutMemory;
use turn_signal::roundabout::backward::backward_length_m;
use turn_signal::roundabout::legs::{RoundaboutLegs, legs};
use turn_signal::side::Side::{self, Left, Right};

use super::drive::{Drive, straight_lane};
use super::line::{at, blinking, samples};

/// The setup of a case.
#[derive(Clone, Copy, Default)]
struct Setup {
    on_entry: Option<Side>,
    on_exit: Option<Side>,
    persists: bool,
    /// The ring from 130 on is tagged.
    tagged: bool,
    exit_listed_right: bool,
    exit_listed_left: bool,
    entry_distance_m: Option<f64>,
    /// Another exit branches off at 130.
    other_exit: bool,
}

const BEFORE: i64 = 1;
const ENTRY: i64 = 11;
const RING: i64 = 12;
const RING_END: i64 = 13;
const EXIT: i64 = 14;
const OTHER_EXIT: i64 = 15;
const AFTER: i64 = 2;
const ROUTE: [i64; 6] = [BEFORE, ENTRY, RING, RING_END, EXIT, AFTER];

fn road(setup: Setup) -> LaneNetwork {
    let lane = |id, from, to, followers| Lanelet { followers, ..straight_lane(id, from, to) };
    let in_ring = |id, from, to, followers| Lanelet { roundabouts: vec![0], ..lane(id, from, to, followers) };
    let listed = |is: bool| if is { vec![99, EXIT] } else { vec![99] };
    let entry = Lanelet {
        turn_signal_distance_m: setup.entry_distance_m,
        exits_signalled_left: listed(setup.exit_listed_left),
        exits_signalled_right: listed(setup.exit_listed_right),
        ..in_ring(ENTRY, 100.0, 112.0, vec![RING])
    };
    let branches = if setup.other_exit { vec![OTHER_EXIT, RING_END] } else { vec![RING_END] };
    let ring_end =
        Lanelet { enables_exit_signal: setup.tagged, ..in_ring(RING_END, 130.0, 150.0, vec![EXIT]) };
    let lanes = [
        lane(BEFORE, -60.0, 100.0, vec![ENTRY]),
        entry,
        in_ring(RING, 112.0, 130.0, branches),
        ring_end,
        in_ring(EXIT, 150.0, 165.0, vec![AFTER]),
        in_ring(OTHER_EXIT, 130.0, 140.0, vec![]),
        lane(AFTER, 165.0, 300.0, vec![]),
    ];
    let element =
        Roundabout { entries: vec![ENTRY], exits: vec![EXIT, OTHER_EXIT], internals: vec![RING, RING_END] };
    LaneNetwork::new(lanes, vec![element])
}

fn drive(setup: Setup, compat: DeciderCompat) -> Drive {
    let mut drive = Drive::on(road(setup), &ROUTE, compat).at_once();
    drive.parameters.roundabout_on_entry = setup.on_entry;
    drive.parameters.roundabout_on_exit = setup.on_exit;
    drive.parameters.roundabout_entry_persists = setup.persists;
    let mut legs: RoundaboutLegs = legs(&drive.context(at(0.0), 5.0), &ROUTE);
    // Required ends as the cases give them.
    for entry in &mut legs.entries {
        entry.lane.required_end = at(108.0);
    }
    for exit in &mut legs.exits {
        exit.lane.required_end = at(160.0);
    }
    drive.observed.legs = legs;
    drive
}

fn blinks(setup: Setup, compat: DeciderCompat) -> String {
    blinking(drive(setup, compat).through(samples(0.0, 200.0, 0.5), 5.0, |_| Vec::new()))
}

/// Id, setup, upstream's signals, improved ones. Without tags, improved announces the exit once
/// the front is in the ring, 45 m before it at the earliest: from 108.5 on.
#[rustfmt::skip]
fn cases() -> [(&'static str, Setup, &'static str, &'static str); 13] {
    let none = Setup::default();
    let left_right = Setup { on_entry: Some(Left), on_exit: Some(Right), ..none };
    let listed = Setup { on_exit: Some(Left), exit_listed_right: true, ..none };
    [
        ("R1", Setup { on_exit: Some(Left), ..none }, "LEFT 146.5 to 165", "LEFT 108.5 to 165"),
        ("R2", Setup { on_exit: Some(Right), ..none }, "RIGHT 146.5 to 165", "RIGHT 108.5 to 165"),
        ("R3", left_right, "LEFT 51.5 to 112, RIGHT 146.5 to 165", "LEFT 51.5 to 108, RIGHT 108.5 to 165"),
        ("R4", Setup { persists: true, ..left_right }, "LEFT 51.5 to 146, RIGHT 146.5 to 165",
            "LEFT 51.5 to 146, RIGHT 146.5 to 165"),
        ("R5", Setup { on_entry: Some(Left), persists: true, ..none }, "LEFT 51.5 to 146",
            "LEFT 51.5 to 165"),
        ("R6", Setup { on_entry: Some(Left), ..none }, "LEFT 51.5 to 112", "LEFT 51.5 to 112"),
        ("R7", listed, "RIGHT 51.5 to 112, LEFT 146.5 to 165", "RIGHT 51.5 to 108, LEFT 108.5 to 165"),
        ("R8", Setup { persists: true, ..listed }, "RIGHT 51.5 to 146, LEFT 146.5 to 165",
            "RIGHT 51.5 to 146, LEFT 146.5 to 165"),
        ("R9", Setup { on_exit: Some(Left), tagged: true, ..none }, "LEFT 126.5 to 165", "LEFT 126.5 to 165"),
        ("R10", Setup { persists: true, tagged: true, ..left_right }, "LEFT 51.5 to 126, RIGHT 126.5 to 165",
            "LEFT 51.5 to 126, RIGHT 126.5 to 165"),
        ("R11", Setup { entry_distance_m: Some(20.0), ..left_right }, "LEFT 76.5 to 112, RIGHT 146.5 to 165",
            "LEFT 76.5 to 108, RIGHT 108.5 to 165"),
        ("left comes before right", Setup { exit_listed_left: true, ..listed },
            "LEFT 51.5 to 112, LEFT 146.5 to 165", "LEFT 51.5 to 165"),
        ("behind another exit", Setup { on_exit: Some(Left), other_exit: true, ..none }, "LEFT 146.5 to 165",
            "LEFT 126.5 to 165"),
    ]
}

#[test]
fn every_listed_roundabout_is_signalled_as_upstream_does() {
    for (id, setup, upstream, _) in cases() {
        assert_eq!(blinks(setup, Upstream), upstream, "{id}");
    }
}

#[test]
fn by_default_exits_are_announced_and_silent_ones_displace_nothing() {
    for (id, setup, _, default) in cases() {
        assert_eq!(blinks(setup, Improved), default, "{id}");
    }
}

#[test]
fn slowing_down_does_not_drop_the_signal_of_an_entry() {
    let setup = Setup { on_entry: Some(Left), ..Setup::default() };
    for compat in [Upstream, Improved] {
        let mut drive = drive(setup, compat);
        let speeds = [(51.0, 5.0, false), (52.0, 5.0, true), (53.0, 0.5, true), (60.0, 0.0, true)];
        for (x, speed, on) in speeds {
            assert_eq!(drive.step(x, speed, &[]).turn.side().is_some(), on, "{x} {compat:?}");
        }
    }
}

#[test]
fn a_route_leaves_a_roundabout_by_its_last_lanelet_there() {
    let lanes = |route: &[i64]| {
        let drive = Drive::on(road(Setup::default()), route, Upstream);
        let observed = legs(&drive.context(at(0.0), 5.0), route);
        observed.entries.first().unwrap().leaving.map(|leaving| leaving.lane)
    };
    assert_eq!(lanes(&ROUTE), Some(EXIT));
    assert_eq!(lanes(&[BEFORE, ENTRY, RING]), Some(RING), "the route ends inside");
    assert_eq!(lanes(&[BEFORE, ENTRY]), None, "the route ends on the entry");
}

#[test]
fn a_closed_ring_of_tagged_lanelets_ends() {
    let ring = |id: i64, next: i64| Lanelet {
        followers: if id == 3 { vec![next, EXIT] } else { vec![next] },
        roundabouts: vec![0],
        enables_exit_signal: true,
        ..straight_lane(id, 0.0, 10.0)
    };
    let exit = Lanelet { roundabouts: vec![0], ..straight_lane(EXIT, 10.0, 20.0) };
    let start = Lanelet { followers: vec![1], ..straight_lane(7, -10.0, 0.0) };
    let element = Roundabout { entries: vec![7], exits: vec![EXIT], internals: vec![1, 2, 3] };
    let road = LaneNetwork::new([start, ring(1, 2), ring(2, 3), ring(3, 1), exit], vec![element]);
    for compat in [Upstream, Improved] {
        let drive = Drive::on(road.clone(), &[7, 1, 2, 3, EXIT], compat);
        let observed = legs(&drive.context(at(0.0), 5.0), &[7, 1, 2, 3, EXIT]);
        assert!(observed.exits.first().unwrap().is_tagged, "{compat:?}");
    }
}

/// A ring of three lanelets, 20 m each, behind an entry of 12 m and a road of 100 m.
fn backward_m(compat: DeciderCompat, start_x: f64, depth: Option<u32>, current: i64) -> f64 {
    let setup = Setup { on_entry: Some(Left), ..Setup::default() };
    let mut drive = drive(setup, compat);
    let mut memory = RoundaboutMemory::default();
    // The entry has a search distance of its own that is longer than any.
    drive.observed.legs.entries[0].lane.search_distance_m = Some(1000.0);
    memory.section(&drive.context(at(start_x), 5.0), &drive.observed.legs);
    let parameters = DeciderParameters {
        roundabout_backward_depth: depth,
        path_backward_length_m: 10.0,
        ..DeciderParameters::DEPLOYED
    };
    backward_length_m((&drive.road, &drive.route), &parameters, &memory, current, DeciderQuirks::of(compat))
}

#[test]
fn inside_a_roundabout_the_path_reaches_back_to_where_the_entry_came_into_view() {
    // 20 m of the ring, 18 m before, the entry's 12 m, the road's 160 m.
    for (what, compat, start_x, depth, current, expected) in [
        ("from the end of the ring", Upstream, 50.0, Some(50), RING_END, 20.0 + 18.0 + 12.0 + 160.0),
        ("from the exit", Upstream, 50.0, Some(50), EXIT, 15.0 + 20.0 + 18.0 + 12.0 + 160.0),
        ("by default as well", Improved, 50.0, Some(50), RING_END, 210.0),
        ("without a limit", Upstream, 50.0, None, RING_END, 210.0),
        ("too deep", Upstream, 50.0, Some(2), RING_END, 10.0),
        ("just deep enough", Upstream, 50.0, Some(3), RING_END, 210.0),
        ("before the roundabout", Upstream, 50.0, Some(50), BEFORE, 10.0),
        ("on the entry", Upstream, 50.0, Some(50), ENTRY, 10.0),
        ("remembered inside the entry", Upstream, 105.0, Some(50), RING_END, 10.0),
        ("which the default finds", Improved, 105.0, Some(50), RING_END, 20.0 + 18.0 + 12.0),
    ] {
        let got = backward_m(compat, start_x, depth, current);
        assert!((got - expected).abs() < 1e-9, "{what}: {got}");
    }
}

#[test]
fn a_split_entry_is_two_upstream_and_one_improved() {
    let lane = |id, from, to, followers| Lanelet {
        followers,
        roundabouts: vec![0],
        exits_signalled_right: vec![id],
        ..straight_lane(id, from, to)
    };
    let element = Roundabout { entries: vec![1, 2], exits: vec![], internals: vec![3] };
    let lanes = [lane(1, 0.0, 10.0, vec![2]), lane(2, 10.0, 20.0, vec![3]), lane(3, 20.0, 40.0, vec![])];
    let road = LaneNetwork::new(lanes, vec![element]);
    let entries = |compat| {
        let drive = Drive::on(road.clone(), &[1, 2, 3], compat);
        legs(&drive.context(at(0.0), 5.0), &[1, 2, 3]).entries
    };
    let ids = |compat| entries(compat).iter().map(|entry| entry.lane.id).collect::<Vec<_>>();
    assert_eq!([ids(Upstream), ids(Improved)], [vec![1, 2], vec![1]]);
    let joined = &entries(Improved)[0];
    assert_eq!((joined.lane.front, joined.lane.back), (at(0.0), at(20.0)));
    assert_eq!((joined.leaving.unwrap().lane, &joined.exits_right[..]), (3, &[1, 2][..]));
}
