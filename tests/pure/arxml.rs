//! ARXML files as the DBC of a bus: read like cantools reads them, refused and left out with a reason.

use std::path::Path;
use std::process::Command;

use can_signal::can::frame::{CanId, FrameFormat};
use can_signal::dbc::codec::{ByteOrder, Layout, SignalCodec};
use can_signal::dbc::model::{Database, DbcSeverity, Message, Number, Signal};
use can_signal::dbc::parse;
use serde_json::Value;
use signal_gateway::config::{Overrides, Problem, load};

use crate::support::files::MemoryFiles;
use crate::support::prerequisite::{peer_python, require};
use crate::support::virtual_gateway::VirtualGateway;

/// Two clusters with both byte orders, signed and floating-point signals, all kinds of scaling, and a
/// multiplexed PDU.
const TWO_CLUSTERS: &str = include_str!("../../fuzz/corpus/arxml_text/two_clusters.arxml");

/// A car whose bus has these keys and whose ARXML has this text. It has no lights.
fn car(bus: &str, arxml: &str) -> MemoryFiles {
    let profile = format!(
        "name = \"Car\"\n[bus.body]\ndbc = \"car.arxml\"\n{bus}\n[turn]\nfitted = false\n[hazard]\nfrom = \"not_fitted\"\n"
    );
    MemoryFiles::vehicle(&profile, "").with("car.arxml", arxml)
}

fn database(cluster: &str, arxml: &str) -> Database {
    car(&format!("cluster = \"{cluster}\""), arxml).settings().dbcs.remove(0).database
}

fn refused(files: &MemoryFiles) -> String {
    let loaded = load(files, Path::new("gateway.toml"), &Overrides::default());
    loaded.map(drop).unwrap_err().0.iter().map(Problem::to_string).collect::<Vec<_>>().join("\n")
}

/// A signal as cantools describes it, with the selector of its part of the message.
fn expected_codec(described: &Value, message: &Value) -> SignalCodec {
    let length = message["length"].as_u64().unwrap().try_into().unwrap();
    let number = |key: &str| u16::try_from(described[key].as_u64().unwrap()).unwrap();
    let order = if described["big_endian"] == true { ByteOrder::Motorola } else { ByteOrder::Intel };
    let signed = described["signed"] == true;
    let layout = Layout { start: number("start"), length: number("length"), order, signed };
    let codec = SignalCodec::new(layout, length).unwrap();
    let Some(selector) = described["selected_by"][0].as_str() else { return codec };
    let code = described["selected_by"][1].as_u64().unwrap();
    let signals = message["signals"].as_array().unwrap();
    let selector = signals.iter().find(|signal| signal["name"] == selector).unwrap();
    codec.multiplexed(&expected_codec(selector, message), &[code..=code])
}

fn assert_same_signal(ours: &Signal, described: &Value, message: &Value) {
    let name = &ours.name;
    assert_eq!(ours.codec, expected_codec(described, message), "{name}");
    let number = match (described["float"] == true, described["length"].as_u64()) {
        (true, Some(32)) => Number::Float32,
        (true, _) => Number::Float64,
        (false, _) => Number::Integer,
    };
    assert_eq!(ours.number, number, "{name}");
    let scale = [&described["factor"], &described["offset"]].map(|number| number.as_f64().unwrap().to_bits());
    assert_eq!([ours.factor.to_bits(), ours.offset.to_bits()], scale, "{name}");
    assert_eq!(ours.unit, described["unit"].as_str().unwrap(), "{name}");
    let values = ours.values.iter().map(|(raw, text)| (raw.to_string(), Value::from(text.as_str())));
    assert_eq!(
        values.collect::<serde_json::Map<_, _>>(),
        *described["values"].as_object().unwrap(),
        "{name}"
    );
}

fn assert_same_message(ours: &Message, described: &Value) {
    let id = u32::try_from(described["id"].as_u64().unwrap()).unwrap();
    let id = if described["extended"] == true { CanId::extended(id) } else { CanId::standard(id) };
    assert_eq!((ours.name.as_str(), Some(ours.id)), (described["name"].as_str().unwrap(), id));
    assert_eq!(Some(ours.length), described["length"].as_u64().map(|length| length.try_into().unwrap()));
    assert_eq!(ours.format == Some(FrameFormat::Fd), described["fd"] == true, "{}", ours.name);
    assert_eq!(ours.cycle_ms.map(u64::from), described["cycle_ms"].as_u64(), "{}", ours.name);
    let signals = described["signals"].as_array().unwrap();
    assert_eq!(ours.signals.len(), signals.len(), "{}", ours.name);
    for (signal, theirs) in ours.signals.iter().zip(signals) {
        assert_eq!(signal.name, theirs["name"].as_str().unwrap());
        assert_same_signal(signal, theirs, described);
    }
}

#[test]
fn messages_are_read_like_cantools_reads_them_and_like_the_dbc_it_makes() {
    let python = require!(peer_python());
    let folder = tempfile::tempdir().unwrap();
    let [arxml, dbc] = ["car.arxml", "car.dbc"].map(|name| folder.path().join(name));
    std::fs::write(&arxml, TWO_CLUSTERS).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peer/cantools_arxml.py");
    let mut signals = 0;
    for cluster in ["Body", "Drive"] {
        let output = Command::new(&python).arg(&script).args([&arxml, &dbc]).arg(cluster).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let theirs: Vec<Value> = serde_json::from_slice(&output.stdout).unwrap();
        let ours = database(cluster, TWO_CLUSTERS);
        assert_eq!(ours.messages.len(), theirs.len(), "{cluster}");
        assert_eq!(ours.rejected(), 0, "{:?}", ours.findings);
        let converted = parse(&std::fs::read(&dbc).unwrap());
        for (message, theirs) in ours.messages.iter().zip(&theirs) {
            assert_same_message(message, theirs);
            let same = converted.message(&message.name).unwrap();
            assert_eq!((same.id, same.length, same.cycle_ms), (message.id, message.length, message.cycle_ms));
            for signal in &message.signals {
                let of_dbc = same.signal(&signal.name).unwrap();
                assert_eq!((&of_dbc.codec, of_dbc.number), (&signal.codec, signal.number), "{}", signal.name);
                assert_eq!(of_dbc.values, signal.values, "{}", signal.name);
                signals += 1;
            }
        }
    }
    assert_eq!(signals, 13, "all of both clusters");
}

#[test]
fn bound_signals_of_an_arxml_are_reported() {
    let profile = "name = \"Car\"\n[bus.body]\ndbc = \"car.arxml\"\ncluster = \"Body\"\n[turn]\nsignal = \"Lights.Turn\"\n\
                   off = [0]\nleft = [1]\nright = [2]\nnot_available = [15]\n[hazard]\nfrom = \"not_fitted\"\n";
    let files = MemoryFiles::vehicle(profile, "").with("car.arxml", TWO_CLUSTERS);
    let mut desk = VirtualGateway::new(files.settings().gateway);
    desk.receive(CanId::Standard(0x123), &[0x10, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(desk.turn_reports(), [(0, "ENABLE_LEFT")]);
    desk.pass(1000);
    assert!(
        desk.status("turn_indicators").message.contains("silent for more than 200 ms"),
        "five periods, at least 200 ms"
    );
}

#[test]
fn cluster_is_chosen_by_its_name() {
    assert_eq!(database("Drive", TWO_CLUSTERS).messages[0].name, "Engine");
    let one = TWO_CLUSTERS.replacen("CAN-CLUSTER>", "LIN-CLUSTER>", 2);
    assert!(
        car("", &one).settings().dbcs[0].database.message("Engine").is_some(),
        "the only one needs no name"
    );
    for (files, reason) in [
        (
            car("", TWO_CLUSTERS),
            "bus.body.dbc: car.arxml: its CAN clusters are Body, Drive; name the one of this bus",
        ),
        (
            car("cluster = \"Bodi\"", TWO_CLUSTERS),
            "bus.body.cluster: car.arxml: there is no such cluster: its CAN",
        ),
        (
            car("", "<AUTOSAR xmlns=\"http://autosar.org/3.2.3\"/>"),
            "is not AUTOSAR 4, the only version that is read",
        ),
        (
            car("", "<AUTOSAR xmlns=\"http://autosar.org/schema/r4.0\"/>"),
            "it has no CAN cluster: only system",
        ),
        (car("", "<AUTOSAR xmlns=\"http://autosar.org/schema/r4.0\">"), "not XML that can be read: "),
    ] {
        let refused = refused(&files);
        assert!(refused.contains(reason), "{reason}: {refused}");
    }
    let dbc = car("cluster = \"Body\"", "BO_ 1 M: 8 X\n");
    assert!(refused(&dbc).contains("bus.body.cluster: a DBC has no clusters"), "{}", refused(&dbc));
}

/// A change of the file: from, to, the signals that are left out, and the finding: severity, beginning of its
/// excerpt, reason.
type Omission =
    (&'static str, &'static str, &'static [&'static str], DbcSeverity, &'static str, &'static str);

#[test]
fn what_is_not_read_is_left_out_with_a_reason() {
    use DbcSeverity::{Partial, Rejected};
    let plain = database("Body", TWO_CLUSTERS);
    let line = |text: &str| 1 + TWO_CLUSTERS.split_once(text).unwrap().0.matches('\n').count();
    let protected = plain.findings.iter().find(|finding| finding.excerpt == "Protected").unwrap();
    assert_eq!((protected.severity, protected.line), (Partial, line("<I-SIGNAL-GROUP>")));
    assert!(protected.reason.contains("end-to-end protection is not read"));
    assert_eq!(plain.findings.len(), 1, "{:?}", plain.findings);

    let text = "<UPPER-LIMIT INTERVAL-TYPE=\"CLOSED\">15</UPPER-LIMIT>";
    let rows: [Omission; 11] = [
        (
            "2C",
            "SM",
            &["Temperature", "Torque", "TwoPage"],
            Rejected,
            "P_Temperature",
            "encoding SM cannot be read",
        ),
        (
            "<LENGTH>32</LENGTH>",
            "<LENGTH>31</LENGTH>",
            &["Level"],
            Rejected,
            "P_Level",
            "of 31 bits cannot be read",
        ),
        ("<START-POSITION>40</", "<START-POSITION>41</", &["Wide"], Rejected, "Wide", "needs 9 bytes"),
        (">/Signals/Turn<", ">/Signals/Torn<", &["Turn"], Rejected, "P_Turn", "I-SIGNAL-REF leads nowhere"),
        (">Turn<", ">Speed<", &["Turn"], Rejected, "P_Turn", "leads nowhere"),
        (
            "<SELECTOR-FIELD-CODE>1<",
            "<SELECTOR-FIELD-CODE>8<",
            &["OnePage"],
            Rejected,
            "OnePage",
            "selector cannot be 8",
        ),
        (
            "<SELECTOR-FIELD-CODE>1<",
            "<SELECTOR-FIELD-CODE>x<",
            &["OnePage"],
            Rejected,
            "DYNAMIC-PART",
            "without a SEL",
        ),
        (
            text,
            "<UPPER-LIMIT>20</UPPER-LIMIT>",
            &[],
            Partial,
            "Turn",
            "the text of a range of values is not read",
        ),
        (">LINEAR<", ">RAT_FUNC<", &[], Partial, "Temperature", "only linear scaling and texts are read"),
        ("<V>16</V>", "<V>0</V>", &[], Partial, "Speed", "scaling in several segments is not read"),
        (
            "<START-POSITION>4<",
            "<UPDATE-INDICATION-BIT-POSITION>3</UPDATE-INDICATION-BIT-POSITION><START-POSITION>4<",
            &[],
            Partial,
            "Turn",
            "its update bit is not read",
        ),
    ];
    for (from, to, left, severity, excerpt, reason) in rows {
        assert!(TWO_CLUSTERS.contains(from), "{from}");
        let found = database("Body", &TWO_CLUSTERS.replacen(from, to, 1));
        let finding = found.findings.iter().find(|finding| finding.reason.contains(reason));
        let finding = finding.unwrap_or_else(|| panic!("{reason}: {:#?}", found.findings));
        assert_eq!(finding.severity, severity, "{finding:?}");
        assert!(finding.excerpt.starts_with(excerpt), "{finding:?}");
        let names = |database: &Database| {
            let signals = database.messages.iter().flat_map(|message| &message.signals);
            signals
                .map(|signal| signal.name.clone())
                .filter(|name| !left.contains(&name.as_str()))
                .collect::<Vec<_>>()
        };
        assert_eq!(names(&found), names(&plain), "{to}: the rest stays");
        let is_left = |name: &&str| found.messages.iter().all(|message| message.signal(name).is_none());
        assert!(left.iter().all(is_left), "{to}");
    }
    for (from, to, reason) in [
        ("<FRAME-LENGTH>8<", "<FRAME-LENGTH>65<", "no FRAME-LENGTH of 0 to 64 bytes"),
        ("<IDENTIFIER>0x123<", "<IDENTIFIER>0x923<", "more bits than CAN-ADDRESSING-MODE says"),
        ("<IDENTIFIER>292<", "<IDENTIFIER>291<", "identifier 123 is taken by a message above"),
    ] {
        let found = database("Body", &TWO_CLUSTERS.replacen(from, to, 1));
        assert!(found.findings.iter().any(|finding| finding.reason.contains(reason)), "{:?}", found.findings);
        assert_eq!((found.messages.len(), found.rejected()), (2, 1), "{to}");
    }
    let container = TWO_CLUSTERS.replace("MULTIPLEXED-I-PDU", "CONTAINER-I-PDU");
    let found = database("Body", &container);
    assert!(found.findings.iter().any(|finding| finding.reason == "containers of PDUs are not read"));
    assert!(found.message("Pages").unwrap().signals.is_empty());
}
