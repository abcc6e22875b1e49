//! J1939 messages: of any sender or of listed ones, of any priority and destination, through profile, gateway
//! and check.

use can_signal::can::frame::CanId;
use can_signal::can::id_match::{IdMatch, SourceAddresses};
use can_signal::can::link::BusIndex;
use signal_gateway::config::Problem;

use crate::support::files::MemoryFiles;
use crate::support::virtual_gateway::VirtualGateway;

/// PDU2: the light switches, PGN FDCC, which the DBC has from source address 27.
const OEL: u32 = 0x0CFD_CC27;
/// PDU1: a proprietary message, PGN EF00, which the DBC has from 27 to 21.
const PROPRIETARY: u32 = 0x18EF_2127;
/// PDU2: a heartbeat message, PGN FEF1.
const ENGINE: u32 = 0x18FE_F100;

const DBC: &str = "\
BO_ 2365443111 OEL: 8 X
 SG_ TURN : 12|4@1+ (1,0) [0|15] \"\" X
BO_ 2565808423 PROP: 8 X
 SG_ HAZARD : 0|2@1+ (1,0) [0|3] \"\" X
BO_ 2365443112 OEL2: 8 X
 SG_ TURN : 12|4@1+ (1,0) [0|15] \"\" X
BO_ 256 SHORT: 8 X
 SG_ TURN : 12|4@1+ (1,0) [0|15] \"\" X
BO_ 2566844672 ENGINE: 8 X
";

/// A truck whose messages have these further keys.
fn truck(oel: &str, prop: &str) -> MemoryFiles {
    let profile = format!(
        "name = \"truck\"\n[bus.body]\ndbc = \"car.dbc\"\nheartbeat_messages = [\"ENGINE\"]\n[message.OEL]\n\
         timeout_ms = 2500\n{oel}\n[message.PROP]\ntimeout_ms = 2500\n{prop}\n[turn]\nsignal = \"OEL.TURN\"\noff = [0]\n\
         left = [1]\nright = [2]\n[hazard]\nfrom = \"signal\"\nsignal = \"PROP.HAZARD\"\noff = [0]\non = [1]\n"
    );
    MemoryFiles::vehicle(&profile, DBC)
}

const ANY: &str = "source_addresses = \"any\"";

fn desk(oel: &str, prop: &str) -> VirtualGateway {
    VirtualGateway::new(truck(oel, prop).settings().gateway)
}

impl VirtualGateway {
    /// Receives a turn code in a frame of the light switches.
    fn receive_turn(&mut self, id: u32, code: u8) {
        self.receive(CanId::Extended(id), &[0, code << 4, 0, 0, 0, 0, 0, 0]);
    }

    fn turn_message(&self) -> String {
        self.status("turn_indicators").message.clone()
    }
}

#[test]
fn group_is_followed_from_each_of_three_senders_at_any_priority() {
    for (source, priority) in [(0x27, 0x0C), (0x21, 0x18), (0x00, 0x00)] {
        let id = priority << 24 | 0x00FD_CC00 | source;
        let mut desk = desk(ANY, ANY);
        desk.receive_turn(id, 1);
        assert_eq!(desk.turn_message(), "publishing", "{id:08X}");
        desk.receive_turn(id ^ 0x0000_0100, 2);
        desk.receive_turn(id ^ 0x0100_0000, 2);
        assert_eq!(desk.value("turn_indicators", "raw_value"), "1", "another group says nothing");
    }
}

#[test]
fn message_without_the_key_has_one_identifier() {
    let mut desk = desk("", "");
    for id in [0x0CFD_CC28, 0x18FD_CC27] {
        desk.receive_turn(id, 1);
        assert!(desk.turn_message().starts_with("starting: waiting for the first frame of OEL "), "{id:08X}");
    }
    desk.receive_turn(OEL, 1);
    assert_eq!(desk.turn_message(), "publishing");
}

#[test]
fn message_to_one_destination_is_followed_to_each_of_them() {
    let mut desk = desk(ANY, ANY);
    for destination in [0x21_u32, 0x30, 0xFF] {
        let id = PROPRIETARY & 0x1FFF_00FF | destination << 8;
        desk.receive(CanId::Extended(id), &[1, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(desk.status("hazard_lights").message, "publishing", "{id:08X}");
        desk.pass(3000);
        assert!(desk.status("hazard_lights").message.contains("stale"));
    }
    desk.receive(CanId::Extended(0x18EE_2127), &[1, 0, 0, 0, 0, 0, 0, 0]);
    assert!(desk.status("hazard_lights").message.contains("stale"), "another PDU format is another group");
}

#[test]
fn second_sender_stops_the_report_until_one_of_them_is_silent_for_ten_seconds() {
    const CONFLICT: &str =
        "unknown: OEL is received from source addresses 21 and 27: choose one with source_addresses";
    let mut desk = desk(ANY, ANY);
    desk.receive_turn(OEL, 1);
    assert_eq!(desk.turn_message(), "publishing");
    desk.receive_turn(0x0CFD_CC21, 2);
    assert_eq!(desk.turn_message(), CONFLICT);
    for _ in 0..10 {
        desk.receive_turn(OEL, 1);
        desk.pass(1000);
        assert_eq!(desk.turn_message(), CONFLICT);
    }
    assert_eq!(desk.turn_reports(), [(0, "ENABLE_LEFT"), (0, "stops")], "nothing is published of two");
    desk.pass(1);
    desk.receive_turn(OEL, 2);
    assert_eq!(desk.turn_message(), "publishing");
    assert_eq!(desk.value("turn_indicators", "raw_value"), "2");
}

#[test]
fn listed_sender_is_believed_beside_others() {
    let mut desk = desk("source_addresses = [0x21]", ANY);
    for _ in 0..3 {
        for (id, code) in [(OEL, 1), (0x0CFD_CC21, 2), (0x0CFD_CC30, 1)] {
            desk.receive_turn(id, code);
        }
        desk.pass(100);
    }
    assert_eq!(desk.turn_message(), "publishing");
    assert_eq!(desk.value("turn_indicators", "raw_value"), "2");
    let mut desk = self::desk("source_addresses = [33, 39]", ANY);
    desk.receive_turn(0x0CFD_CC30, 1);
    desk.pass(10_000);
    assert_eq!(
        desk.turn_message(),
        "unknown: no frame of OEL (PGN FDCC from source address 21, 27) on can0 yet"
    );
    desk.receive_turn(OEL, 1);
    assert_eq!(desk.turn_message(), "publishing");
    desk.receive_turn(0x0CFD_CC21, 1);
    assert!(desk.turn_message().contains("source addresses 21 and 27"), "{}", desk.turn_message());
}

#[test]
fn kernel_filters_and_heartbeats_follow_the_profile() {
    let files = truck(ANY, "source_addresses = [0x27]");
    let profile =
        files.text("car.toml").replace("[turn]", "[message.ENGINE]\nsource_addresses = \"any\"\n[turn]");
    let settings = files.clone().with("car.toml", profile.clone()).settings().gateway;
    let group = |id, sources| IdMatch::j1939(CanId::Extended(id), sources).unwrap();
    let mut ids = settings.relevant_ids(BusIndex(0));
    ids.sort();
    let only = [0x27].into_iter().collect();
    let expected =
        [group(OEL, SourceAddresses::ANY), group(PROPRIETARY, only), group(ENGINE, SourceAddresses::ANY)];
    assert_eq!(ids, expected);
    let mut desk = VirtualGateway::new(settings);
    desk.receive(CanId::Extended(ENGINE ^ 0x0400_0055), &[0; 8]);
    assert_eq!(desk.status("can0").message, "receiving");

    let timed = profile.replace("[message.ENGINE]", "[message.ENGINE]\ntimeout_ms = 5");
    assert!(refused(&files.with("car.toml", timed)).contains("the message only proves the bus alive"));
}

fn refused(files: &MemoryFiles) -> String {
    let loaded = signal_gateway::config::load(
        files,
        std::path::Path::new("gateway.toml"),
        &signal_gateway::config::Overrides::default(),
    );
    let problems = loaded.map(drop).unwrap_err().0;
    problems.iter().map(Problem::to_string).collect::<Vec<_>>().join("\n")
}

#[test]
fn impossible_source_addresses_are_refused() {
    for (oel, reason) in [
        ("source_addresses = \"all\"", "expected a list"),
        ("source_addresses = []", "no source address is given"),
        ("source_addresses = [254]", "254 is out of range; give 0 to 253"),
        ("source_addresses = [\"x\"]", "expected a number"),
    ] {
        let refused = refused(&truck(oel, ANY));
        assert!(refused.contains(reason), "{oel}: {refused}");
    }
    let short = truck("", ANY)
        .text("car.toml")
        .replace("OEL", "SHORT")
        .replace("2500\n\n", &format!("2500\n{ANY}\n"));
    let refused_short = refused(&truck("", ANY).with("car.toml", short));
    assert!(refused_short.contains("SHORT has an identifier of 11 bits"), "{refused_short}");

    let two = truck(ANY, ANY);
    let both = two.text("car.toml").replace("PROP", "OEL2").replace("HAZARD", "TURN");
    let refused_both = refused(&two.clone().with("car.toml", both.clone()));
    assert!(
        refused_both.contains("OEL has frames in common with OEL2; name the senders of each"),
        "{refused_both}"
    );
    let apart =
        both.replacen(ANY, "source_addresses = [0x27]", 1).replacen(ANY, "source_addresses = [0x28]", 1);
    two.with("car.toml", apart).settings();
}
