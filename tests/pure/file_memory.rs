//! The memory that files take which are not recordings, however they are built: bounded by their size.

use std::path::Path;

use signal_gateway::config::scenario::{ReadOptions, read};
use signal_gateway::config::{load_profile, read_lane_network};

use crate::counting_allocator::most_held;
use crate::support::files::MemoryFiles;

const MIB: usize = 1 << 20;

fn peak_bytes(action: impl FnOnce()) -> usize {
    usize::try_from(most_held(action)).unwrap()
}

/// A text of about `bytes`: `begin`, then pieces by their number, then `end`.
fn filled(bytes: usize, begin: &str, piece: impl Fn(usize) -> String, end: &str) -> String {
    let mut text = begin.to_owned();
    for number in 0.. {
        if text.len() >= bytes {
            break;
        }
        text += &piece(number);
    }
    text + end
}

fn scenario(name: &str, text: String) -> usize {
    let files = MemoryFiles::new([(name, text)]);
    peak_bytes(|| {
        assert!(read(&files, Path::new(name), ReadOptions::default()).is_err(), "{name}");
    })
}

fn profile(database: &str, text: String) -> usize {
    let profile = format!("name = \"x\"\n[bus.body]\ndbc = \"{database}\"\n");
    let files = MemoryFiles::new([("car.toml", profile), (database, text)]);
    peak_bytes(|| assert!(load_profile(&files, Path::new("car.toml")).is_err(), "{database}"))
}

fn map(text: String) -> usize {
    let files = MemoryFiles::new([("map.osm", text)]);
    peak_bytes(|| drop(read_lane_network(&files, Path::new("map.osm"))))
}

#[test]
fn anchors_within_anchors_are_not_kept_again_and_again() {
    let text = "&a [".repeat(60) + &"1,".repeat(90_000) + &"]".repeat(60);
    let peak = scenario("a.yaml", text);
    assert!(peak < 120 * MIB, "{peak}");
}

#[test]
fn lanelets_that_share_their_ways_are_bounded_by_the_size_of_the_map() {
    let node = |id: i64, lat: f64, lon: f64| format!("<node id='{id}' lat='{lat}' lon='{lon}'/>");
    let nodes =
        [node(1, 35.9, 139.9), node(2, 35.95, 139.9), node(3, 35.9, 139.9001), node(4, 35.95, 139.9001)]
            .concat();
    let ways = "<way id='2'><nd ref='1'/><nd ref='2'/></way><way id='3'><nd ref='3'/><nd ref='4'/></way>";
    let lanelet = |number: usize| {
        format!(
            "<relation id='{}'><tag k='type' v='lanelet'/><member type='way' ref='2' role='left'/>\
             <member type='way' ref='3' role='right'/></relation>",
            number + 10
        )
    };
    let peak = map(filled(2 * MIB, &format!("<osm>{nodes}{ways}"), lanelet, "</osm>"));
    assert!(peak < 200 * MIB, "{peak}");
}

mod slow {
    use super::*;

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn no_file_takes_more_than_its_share_of_memory() {
        let largest = 4 * MIB;
        let of_four_mib = |piece: &str| piece.repeat(largest / piece.len());
        let peaks = [
            ("arrays", scenario("a.toml", format!("x = [{}]", of_four_mib("1,").split_off(16)))),
            ("keys", scenario("a.toml", filled(largest - 32, "", |number| format!("k{number} = 1\n"), ""))),
            ("tables", scenario("a.toml", filled(largest - 32, "", |number| format!("[a{number}]\n"), ""))),
            ("dots", scenario("a.toml", of_four_mib("a.").split_off(16) + "b = 1")),
            ("brackets", scenario("a.toml", of_four_mib("["))),
            ("line ends", scenario("a.toml", of_four_mib("\n"))),
            ("list", scenario("a.yaml", of_four_mib("- 1\n"))),
            (
                "attributes",
                scenario("a.xosc", filled(largest - 32, "<a", |number| format!(" a{number}=''"), "/>")),
            ),
            (
                "elements",
                scenario(
                    "a.xosc",
                    filled(largest - 32, "<OpenSCENARIO>", |_| "<a/>".to_owned(), "</OpenSCENARIO>"),
                ),
            ),
            (
                "signals",
                profile(
                    "a.dbc",
                    filled(
                        5 * MIB,
                        "BO_ 1 M: 8 A\n",
                        |number| format!(" SG_ S{number} : 0|1@1+ (1,0) [0|1] \"\" A\n"),
                        "",
                    ),
                ),
            ),
            ("nodes", map(filled(5 * MIB, "<osm>", |number| format!("<node id='{number}'/>"), "</osm>"))),
            (
                "relations",
                map(filled(5 * MIB, "<osm>", |number| format!("<relation id='{number}'/>"), "</osm>")),
            ),
        ];
        for (name, peak) in peaks {
            assert!(peak < 200 * MIB, "{name}: {} MiB", peak / MIB);
        }
    }
}
