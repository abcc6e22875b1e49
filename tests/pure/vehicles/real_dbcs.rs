//! The shipped DBCs against the public ones their facts come from: same identifiers, same bits.

use std::path::Path;

use can_signal::can::frame::MAX_DATA;
use can_signal::dbc::model::{Database, Message, Signal};
use can_signal::dbc::parse;

use crate::pure::vehicles::project;
use crate::support::prerequisite::{require, shared_data};
use crate::support::vehicle_facts::{DbcOrigin, Twin, VEHICLES};

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
fn our_signals_have_the_bits_of_the_public_files() {
    let folder = require!(shared_data());
    for (profile, vehicle) in &*VEHICLES {
        let DbcOrigin::Twin(Twin { file, differing, .. }) = &vehicle.dbc else { continue };
        let (ours, theirs) = (ours(profile), theirs(&folder, file));
        for mine in &ours.messages {
            let their = theirs.messages.iter().find(|message| message.id == mine.id);
            let their = their.unwrap_or_else(|| panic!("{profile}: {} is not in {file}", mine.id));
            assert_eq!((&mine.name, mine.length), (&their.name, their.length), "{profile}");
            for signal in mine.signals.iter().filter(|signal| !differing.contains(&signal.name)) {
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
