use std::fmt::Write as _;

use proptest::prelude::*;

use super::*;

const TWO_CLUSTERS: &str = include_str!("../../../../../fuzz/corpus/arxml_text/two_clusters.arxml");

fn assert_sound(database: &Database) {
    let (mut names, mut ids) = (BTreeSet::new(), BTreeSet::new());
    for message in &database.messages {
        assert!(names.insert(&message.name) && ids.insert(message.id), "{} twice", message.name);
        let mut signals = BTreeSet::new();
        for signal in &message.signals {
            assert!(signals.insert(&signal.name), "{} twice", signal.name);
            assert!(signal.codec.needed_length() <= message.length);
        }
    }
    assert!(database.findings.is_sorted_by_key(|finding| finding.line));
}

#[test]
fn small_file_that_refers_to_one_pdu_many_times_is_too_large() {
    let mut text = TWO_CLUSTERS.to_owned();
    let (mapping, end) = ("<I-SIGNAL-TO-I-PDU-MAPPING>", "</I-SIGNAL-TO-I-PDU-MAPPING>");
    let from = text.find(mapping).unwrap();
    let to = text.find(end).unwrap() + end.len();
    text.insert_str(to, &text[from..to].repeat(2_000));
    let (triggering, end) = ("<CAN-FRAME-TRIGGERING>", "</CAN-FRAME-TRIGGERING>");
    let from = text.find(triggering).unwrap();
    let to = text.find(end).unwrap() + end.len();
    let one = text[from..to].to_owned();
    let frame = TWO_CLUSTERS.find("<CAN-FRAME>").unwrap();
    let frame = &TWO_CLUSTERS[frame..TWO_CLUSTERS.find("</CAN-FRAME>").unwrap() + "</CAN-FRAME>".len()];
    let (mut triggerings, mut frames) = (String::new(), String::new());
    for number in 0..200 {
        let name = format!("Lights{number}");
        let of_frame = one.replace("/Frames/Lights", &format!("/Frames/{name}"));
        write!(triggerings, "{}", of_frame.replace("0x123", &number.to_string())).unwrap();
        write!(frames, "{}", frame.replacen(">Lights<", &format!(">{name}<"), 1)).unwrap();
    }
    text.insert_str(to, &triggerings);
    text.insert_str(text.find("<CAN-FRAME>").unwrap(), &frames);
    let database = read(text.as_bytes(), Some("Body")).unwrap();
    assert!(database.is_too_large && database.messages.is_empty(), "{}", database.messages.len());
}

#[test]
fn depth_and_reference_cycles_are_bounded() {
    let deep = "<a>".repeat(200_000) + &"</a>".repeat(200_000);
    let text = TWO_CLUSTERS.replacen("<ELEMENTS>", &format!("<ELEMENTS>{deep}"), 1);
    assert_sound(&read(text.as_bytes(), Some("Body")).unwrap());
    // A part of the multiplexed PDU is the PDU itself.
    let cycle = TWO_CLUSTERS.replacen(">/Pdus/PageOne<", ">/Pdus/Pages<", 1);
    let database = read(cycle.as_bytes(), Some("Body")).unwrap();
    let reason = "a multiplexed PDU within another one is not read";
    assert!(database.findings.iter().any(|finding| finding.reason == reason), "{:?}", database.findings);
    let crowded = TWO_CLUSTERS.replacen("<ELEMENTS>", &format!("<ELEMENTS>{}", "<a/>".repeat(1_500_000)), 1);
    let refused = read(crowded.as_bytes(), Some("Body")).unwrap_err().to_string();
    assert!(refused.contains("elements and texts, the most of a file with 60"), "{refused}");
    let laughs = format!("<!DOCTYPE a [<!ENTITY b 'x'>]>{}", TWO_CLUSTERS.split_once('\n').unwrap().1);
    assert!(matches!(read(laughs.as_bytes(), None), Err(ArxmlError::Xml(_))));
}

proptest! {
    #[test]
    fn damaged_file_is_read_without_panic(
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0_u8..6), 1..12),
    ) {
        let mut bytes = TWO_CLUSTERS.as_bytes().to_vec();
        for (at, byte, kind) in damage {
            let at = at.index(bytes.len());
            // Digits and names change more than the markup, which would make it no XML at all.
            match kind {
                0 => bytes[at] = byte,
                1 => { bytes.remove(at); }
                2 => bytes.insert(at, byte),
                _ if bytes[at].is_ascii_digit() => bytes[at] = b'0' + byte % 10,
                _ if bytes[at].is_ascii_alphabetic() => bytes[at] = b'A' + byte % 26,
                _ => {}
            }
        }
        for cluster in [None, Some("Body"), Some("Drive")] {
            if let Ok(database) = read(&bytes, cluster) {
                assert_sound(&database);
            }
        }
    }
}
