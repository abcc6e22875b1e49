//! Maps, databases of messages, scenarios and configurations out of the shipped ones, with any damage and any
//! repetition.

use std::path::Path;

use super::case::Case;
use super::choices::Choices;
use super::damage;
use super::recordings::{TEXT_FORMATS, drive, text};

/// A shipped file, what cuts it into blocks, and what is run with it; `{}` is its name.
struct Shipped {
    file: &'static str,
    name: &'static str,
    cut: u8,
    runs: &'static [&'static str],
}

const SHIPPED: [Shipped; 8] = [
    Shipped {
        file: "tests/maps/crossroads.osm",
        name: "map.osm",
        cut: b'>',
        runs: &["check {}", "lights bench.toml --map {} --until 5", "decide --map {} --all-routes 2"],
    },
    Shipped {
        file: "config/maps/crossing/lanelet2_map.osm",
        name: "map.osm",
        cut: b'>',
        runs: &["decide --map {} --all-routes 2", "check {}"],
    },
    Shipped {
        file: "config/scenarios/bench.xosc",
        name: "bench.xosc",
        cut: b'>',
        runs: &["lights {} --without-map --until 5"],
    },
    Shipped {
        file: "config/scenarios/bench.toml",
        name: "bench2.toml",
        cut: b'\n',
        runs: &["lights {} --until 5"],
    },
    Shipped {
        file: "config/drives/crossing_left.toml",
        name: "drive.toml",
        cut: b'\n',
        runs: &["decide {}"],
    },
    Shipped {
        file: "dbc/demo_vehicle.dbc",
        name: "car.dbc",
        cut: b'\n',
        runs: &["check drive.log -p car.toml"],
    },
    Shipped {
        file: "fuzz/corpus/arxml_text/two_clusters.arxml",
        name: "car.arxml",
        cut: b'>',
        runs: &["check drive.log -p car.toml"],
    },
    Shipped {
        file: "config/vehicles/demo_vehicle.toml",
        name: "car.toml",
        cut: b'\n',
        runs: &["check drive.log -p {}"],
    },
];

/// Most bytes of a text.
const MOST: usize = 128 << 10;

pub(crate) fn nest(choices: &mut Choices<'_>) -> Case {
    let Shipped { file, name, cut, runs } = choices.pick(&SHIPPED);
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let content = std::fs::read(root.join(file)).unwrap();
    let mut blocks: Vec<Vec<u8>> = content.split_inclusive(|byte| byte == cut).map(<[u8]>::to_vec).collect();
    for _ in 0..=choices.below(6) {
        damage::blocks(choices, &mut blocks, MOST);
        if choices.percent(20) {
            // A part of it within itself.
            let at = choices.place(blocks.len());
            let part = blocks[at..].iter().take(1 + choices.below(20)).cloned().collect::<Vec<_>>();
            let times = 1 << choices.below(8);
            let to = choices.place(blocks.len());
            if part.concat().len() * times < MOST {
                blocks.splice(to..to, (0..times).flat_map(|_| part.clone()));
            }
        }
    }
    let run = *choices.pick(runs);
    let profile = std::fs::read_to_string(root.join("config/vehicles/demo_vehicle.toml")).unwrap();
    let of_database = profile.replace("../../dbc/demo_vehicle.dbc", name);
    let drives = ["map.osm", "drive.toml"].contains(name);
    let mut case = Case::other(name, blocks.concat(), &[run])
        .with("drive.log", text(TEXT_FORMATS[0], &drive(20)))
        .with("bench.toml", std::fs::read(root.join("config/scenarios/bench.toml")).unwrap());
    if *name != "car.toml" {
        case = case.with("car.toml", of_database);
    }
    if drives && *name != "map.osm" {
        let map = std::fs::read(root.join("config/maps/crossing/lanelet2_map.osm")).unwrap();
        let content =
            String::from_utf8_lossy(&case.files[0].1).replace("../maps/crossing/lanelet2_map.osm", "map.osm");
        case.files[0].1 = content.into_bytes();
        case = case.with("map.osm", map);
    }
    case
}
