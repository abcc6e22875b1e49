//! The shipped DBCs against the public ones their facts come from: same identifiers, same bits.

use std::path::Path;

use signal_gateway::core::can::frame::MAX_DATA;
use signal_gateway::core::dbc::model::{Database, Message, Signal};
use signal_gateway::core::dbc::parse;

use crate::pure::vehicles::{profile_names, project};
use crate::support::prerequisite::{require, shared_data};

/// Profile, public DBC, and our signals that differ from it on purpose.
const TWINS: [(&str, &str, &[&str]); 31] = [
    ("acura_ilx_2016", "acura_ilx_2016_can_generated", &[]),
    ("bmw_e9x", "bmw_e9x_e8x", &["TurnBits"]),
    ("chrysler_pacifica_2017", "chrysler_pacifica_2017_hybrid_generated", &[]),
    ("ford_falcon_fg", "ford_falcon_fg", &["TurnStalkSwitchSatus"]),
    ("ford_fusion_2018", "ford_fusion_2018_pt", &[]),
    ("ford_lincoln", "ford_lincoln_base_pt", &[]),
    ("gm_global_a", "gm_global_a_powertrain_generated", &[]),
    ("honda_civic_hatchback_2017", "honda_civic_hatchback_ex_2017_can_generated", &[]),
    ("honda_civic_touring_2016", "honda_civic_touring_2016_can_generated", &[]),
    ("hyundai_i30_2014", "hyundai_i30_2014", &[]),
    ("hyundai_kia", "hyundai_can_generated", &[]),
    ("luxgen_s5", "luxgen_s5_2015", &[]),
    ("mazda_2017", "mazda_2017", &[]),
    ("mercedes_e350_2010", "mercedes_benz_e350_2010", &[]),
    ("mg", "mg", &[]),
    ("new_eagle_dbw", "New_Eagle_DBW_3.4", &[]),
    ("nissan_leaf_2018", "nissan_leaf_2018_generated", &[]),
    ("nissan_leaf_aze0", "leaf_CAR-can_AZE0", &["TurnSignalLeft", "TurnSignalRight"]),
    ("psa_aee2010", "psa_aee2010_r3", &[]),
    ("psa_can_confort", "psa_can_confort", &[]),
    ("subaru_global", "subaru_global_2017_generated", &[]),
    ("subaru_outback_2015", "subaru_outback_2015_generated", &[]),
    ("tesla_model3", "tesla_model3_vehicle", &[]),
    ("tesla_model3_party", "tesla_model3_party", &[]),
    ("tesla_model_s", "tesla_can", &[]),
    ("toyota_nodsu", "toyota_nodsu_pt_generated", &[]),
    ("volvo_s60_2002", "volvo_s60_2002", &["Counter"]),
    ("volvo_v40_2017", "volvo_v40_2017_pt", &[]),
    ("vw_meb", "vw_meb_generated", &[]),
    ("vw_mqb", "vw_mqb", &[]),
    ("vw_pq", "vw_pq", &[]),
];
/// Written from files of opendbc, which packs their frames in `pure::vehicles::opendbc`.
const IN_OPENDBC: [&str; 11] = [
    "fca_giorgio",
    "gm_low_speed",
    "gwm_haval_h6_2024",
    "hongqi_hs5",
    "hyundai_canfd",
    "jeep_cherokee_kl",
    "nissan_x_trail_2017",
    "rivian_r1",
    "tesla_model_s_powertrain",
    "volvo_v60_2015",
    "vw_mlb",
];
/// Invented, written from a standard, or from labelled frames.
const WITHOUT_TWIN: [&str; 6] =
    ["dacia_sandero_2", "demo_vehicle", "j1939_truck", "opel_260", "pacmod", "v2x_unit"];

fn load(path: &Path) -> Database {
    let database = parse(&std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display())));
    assert!(!database.messages.is_empty(), "{}", path.display());
    database
}

fn ours(name: &str) -> Database {
    let database = load(&project().join("dbc").join(format!("{name}.dbc")));
    assert_eq!(database.findings, [], "{name}");
    database
}

fn theirs(folder: &Path, name: &str) -> Database {
    load(&folder.join("dbc").join(format!("{name}.dbc")))
}

/// Which bits of the message make up the value, the least significant first, found by trying each.
fn bits_of(message: &Message, signal: &Signal) -> Vec<(usize, i128)> {
    let value_of = |bit: usize| {
        let mut data = [0; MAX_DATA];
        data[bit / 8] = 1 << (bit % 8);
        signal.codec.value(&data)
    };
    let mut beyond = [0; MAX_DATA];
    beyond[message.length..].fill(0xFF);
    assert_eq!(signal.codec.value(&beyond), 0, "{}", signal.name);
    let mut bits: Vec<_> =
        (0..message.length * 8).map(|bit| (bit, value_of(bit))).filter(|(_, value)| *value != 0).collect();
    bits.sort_by_key(|(_, value)| *value);
    bits
}

#[test]
fn every_profile_has_a_public_twin_or_a_reason() {
    let mut known: Vec<_> = TWINS.iter().map(|(name, ..)| *name).collect();
    known.extend(IN_OPENDBC.iter().chain(&WITHOUT_TWIN));
    known.sort_unstable();
    assert_eq!(profile_names(), known);
}

#[test]
fn our_signals_have_the_bits_of_the_public_files() {
    let folder = require!(shared_data());
    for (profile, twin, differing) in &TWINS {
        let (ours, theirs) = (ours(profile), theirs(&folder, twin));
        for mine in &ours.messages {
            let their = theirs.messages.iter().find(|message| message.id == mine.id);
            let their = their.unwrap_or_else(|| panic!("{profile}: {} is not in {twin}", mine.id));
            assert_eq!((&mine.name, mine.length), (&their.name, their.length), "{profile}");
            for signal in mine.signals.iter().filter(|signal| !differing.contains(&signal.name.as_str())) {
                let twin = their.signal(&signal.name);
                let twin = twin.unwrap_or_else(|| panic!("{profile}: {} has no {}", mine.name, signal.name));
                let bits = bits_of(mine, signal);
                assert_eq!(bits, bits_of(their, twin), "{profile}: {}", signal.name);
                assert!(!bits.is_empty());
            }
        }
    }
}

#[test]
fn the_bmw_number_is_made_of_the_public_single_bits() {
    let folder = require!(shared_data());
    let (ours, theirs) = (ours("bmw_e9x"), theirs(&folder, "bmw_e9x_e8x"));
    let ours = ours.message("TurnSignals").unwrap();
    let number = bits_of(ours, ours.signal("TurnBits").unwrap());
    let public = theirs.message("TurnSignals").unwrap();
    for (name, weight) in
        [("LeftTurn", 1), ("RightTurn", 2), ("TurnSignalActive", 16), ("TurnSignalIdle", 32)]
    {
        let [(bit, 1)] = bits_of(public, public.signal(name).unwrap())[..] else {
            panic!("{name} is one bit")
        };
        assert!(number.contains(&(bit, weight)), "{name}");
    }
}

#[test]
fn the_falcon_number_begins_with_the_public_byte() {
    let folder = require!(shared_data());
    let name = "TurnStalkSwitchSatus";
    let (ours, theirs) = (ours("ford_falcon_fg"), theirs(&folder, "ford_falcon_fg"));
    let signal = |database: &Database| {
        let message = database.messages.iter().find(|message| message.id.number() == 0x128).unwrap();
        bits_of(message, message.signal(name).unwrap())
    };
    assert_eq!(signal(&theirs), signal(&ours)[..8]);
}
