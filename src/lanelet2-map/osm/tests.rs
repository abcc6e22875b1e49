use std::io::BufReader;

use proptest::prelude::*;
use quick_xml::reader::Reader;

use super::*;

const SMALL: &str = "<?xml version='1.0'?>
<osm version='0.6'>
  <note>not ours</note>
  <node id='1' lat='35.5' lon='-139.25' version='1'>
    <tag k='ele' v='4.5'/>
    <tag k='local_x' v='-1.5'/>
    <tag k='local_y' v='2e3'/>
    <tag k='mgrs_code' v='54SVE'/>
  </node>
  <node id='-2' lat='' lon=''/>
  <way id='9223372036854775807'><nd ref='-2'/><nd ref='1'/><nd ref='-2'/><tag k='type' v='a &amp; b'/></way>
  <relation id='-7'>
    <member type='way' ref='9223372036854775807' role='left'/>
    <member type='relation' ref='99' role=''/>
    <tag k='type' v='route'/>
  </relation>
</osm>
";

#[test]
fn primitives_are_read_with_what_a_map_needs() {
    let osm = read(SMALL.as_bytes()).unwrap();
    let [one, two] = osm.nodes.all() else { panic!("{:?}", osm.nodes) };
    assert_eq!(
        (one.id, one.geo_deg, one.local_m, one.ele_m),
        (1, Some([35.5, -139.25]), Some([-1.5, 2e3]), 4.5)
    );
    assert_eq!((one.tags.get("mgrs_code"), two.id, two.geo_deg, two.local_m), (None, -2, None, None));
    let way = osm.ways.get(i64::MAX).unwrap();
    assert_eq!((way.nodes.as_slice(), way.tags.get("type")), ([1, 0, 1].as_slice(), Some("a & b")));
    let relation = osm.relations.get(-7).unwrap();
    assert_eq!(relation.members("left", OsmKind::Way).collect::<Vec<_>>(), [i64::MAX]);
    assert_eq!(relation.members("left", OsmKind::Node).count(), 0);
    assert_eq!(osm.nodes.get(99), None);
}

fn described(error: &OsmError) -> String {
    format!("line {}: {error}", error.line)
}

#[test]
fn the_line_of_an_element_is_found() {
    let osm = read(SMALL.as_bytes()).unwrap();
    let line = |kind, id| osm.line(OsmElement { kind, id });
    assert_eq!(
        [line(OsmKind::Node, -2), line(OsmKind::Way, i64::MAX), line(OsmKind::Relation, -7)],
        [Some(10), Some(11), Some(12)]
    );
    assert_eq!([line(OsmKind::Way, 1), line(OsmKind::Node, 99)], [None, None]);
}

#[test]
fn deleted_elements_are_not_there() {
    for mark in ["action='delete'", "visible='false'", "deleted='true'"] {
        let text = SMALL.replace("<relation id", &format!("<relation {mark} id"));
        assert_eq!(read(text.as_bytes()).unwrap().relations.all(), [], "{mark}");
        let text = SMALL.replace("<node id='-2'", &format!("<node id='-2' {mark}"));
        let missing = "line 11: way 9223372036854775807 refers to node -2, which is not in the file";
        assert_eq!(described(&read(text.as_bytes()).unwrap_err()), missing, "{mark}");
    }
}

#[test]
fn errors_name_element_and_line() {
    #[rustfmt::skip]
    let cases = [
        ("", "", "line 1: not an OSM file: <osm> expected at the top"),
        ("osm", "gpx", "line 2: not an OSM file: <osm> expected at the top, found <gpx>"),
        ("version='0.6'>", "version='0.6'></osm><osm>",
            "line 2: not an OSM file: <osm> expected at the top, found <osm>"),
        ("</osm>", "", "line 18: the file ends before </osm>: it is cut short"),
        ("  </relation>\n</osm>\n", "  </rel", "line 16: the file ends before </osm>: it is cut short"),
        ("</osm>", "<way id='4", "line 18: the file ends before </osm>: it is cut short"),
        ("</way>", "</node>",
            "line 11: not XML: ill-formed document: expected `</way>`, but `</node>` was found"),
        ("lat='35.5'", "lat='35,5'", "line 4: node 1: `lat` is `35,5`, a number expected"),
        ("lat='35.5'", "lat='inf'", "line 4: node 1: `lat` is `inf`, a number expected"),
        ("v='4.5'", "v='high'", "line 5: node 1: `ele` is `high`, a number expected"),
        ("v='-1.5'", "v=''", "line 6: node 1: `local_x` is ``, a number expected"),
        ("v='2e3'", "w='2e3'", "line 7: node 1 has no `v`"),
        ("<node id='-2'", "<node", "line 10: a node has no `id`"),
        ("id='-2'", "id='two'", "line 10: a node: `id` is `two`, a whole number of 64 bits expected"),
        ("way id='9223372036854775807'", "way id='9223372036854775808'",
            "line 11: a way: `id` is `9223372036854775808`, a whole number of 64 bits expected"),
        ("<nd ref='1'", "<nd ref='x'",
            "line 11: way 9223372036854775807: `ref` is `x`, a whole number of 64 bits expected"),
        ("<nd ref='1'", "<nd ref='5'",
            "line 11: way 9223372036854775807 refers to node 5, which is not in the file"),
        ("id='-2'", "id='1'", "line 10: node 1 appears twice, first on line 4"),
        ("type='way'", "type='area'",
            "line 13: relation -7: `type` is `area`, node, way or relation expected"),
        ("v='route'", "v='lanelet'", "line 12: relation -7 refers to relation 99, which is not in the file"),
        ("v='route'", "v='regulatory_element'",
            "line 12: relation -7 refers to relation 99, which is not in the file"),
        ("&amp;", "&me;", "line 11: not XML: "),
        ("<note>", "<!note>", "line 3: not XML: syntax error: unknown or missed symbol in markup"),
        ("<note>", "<!--", "line 18: the file ends before </osm>: it is cut short"),
    ];
    for (part, other, expected) in cases {
        let text = if part.is_empty() { String::new() } else { SMALL.replace(part, other) };
        let error = described(&read(text.as_bytes()).unwrap_err());
        assert!(
            error == expected || expected.ends_with(": ") && error.starts_with(expected),
            "{part}: {error}"
        );
    }
    for (text, line) in [
        (&b"<osm>\n\xFF</osm>"[..], 2),
        (b"<osm>\n\n<node id='1'\n\n>\n</node>\n<node id='2' a='\n\xE3\x81'/></osm>", 8),
        (b"<osm>\n<node id='1' a='\xE3", 2),
    ] {
        assert_eq!(
            read(text),
            Err(OsmError { line, fault: OsmFault::NotUtf8 }),
            "{}",
            String::from_utf8_lossy(text)
        );
    }
}

proptest! {
    #[test]
    fn no_cut_or_change_of_a_byte_panics(cut in 0..SMALL.len(), at in 0..SMALL.len(), byte: u8) {
        let mut bytes = SMALL.as_bytes().to_vec();
        bytes[at] = byte;
        let _ = read(&bytes);
        // All before the end of the file's last tag is needed.
        prop_assert!(read(&SMALL.as_bytes()[..cut]).is_err() || cut >= SMALL.trim_end().len());
    }

    /// Pieces end anywhere: within a character, a name, a value, a comment.
    #[test]
    fn a_text_in_pieces_is_read_as_the_whole(
        text in prop_oneof![Just(SMALL), Just(STANDARD)],
        size in 1..200_usize,
        at in any::<prop::sample::Index>(),
        left_out in 0..4_usize,
        inserted in prop::collection::vec(prop::sample::select(&INSERTED[..]), 0..3),
    ) {
        let mut text = text.as_bytes().to_vec();
        let at = at.index(text.len());
        text.splice(at..(at + left_out).min(text.len()), inserted.concat());
        let mut reader = Reader::from_reader(BufReader::with_capacity(size, &text[..]));
        prop_assert_eq!(read_events(|text| reader.read_event_into(text)), read(&text));
    }

    #[test]
    fn no_heap_of_tags_panics(parts in proptest::collection::vec(0..PARTS.len(), 0..40)) {
        let text: String = parts.into_iter().map(|part| PARTS[part]).collect();
        let _ = read(text.as_bytes());
        let _ = read(format!("<osm>{text}</osm>").as_bytes());
    }
}

const STANDARD: &str = include_str!("../../../tests/maps/standard.osm");

#[rustfmt::skip]
const INSERTED: [&[u8]; 14] = [
    "é".as_bytes(), "交差点".as_bytes(), b"\xE3", b"<!-- a -- > -->", b"<!--", b"<![CDATA[ ]] > ]]>",
    b"<!DOCTYPE osm [<!ELEMENT osm ANY>]>", b"<?a > ?>", b"\n", b"<node id='7' lat='1' lon='>'>", b"&amp;",
    b"\"", b"<", b">",
];

#[rustfmt::skip]
const PARTS: [&str; 16] = [
    "<osm>", "</osm>", "<node id='1'>", "<node id='2' lat='1' lon='2'/>", "</node>", "<way id='1'>", "</way>",
    "<nd ref='2'/>", "<relation id='1'>", "</relation>", "<member type='way' ref='1' role='left'/>",
    "<tag k='type' v='lanelet'/>", "<tag k='ele' v='1e400'/>", "<!--", "<![CDATA[", "&#0;",
];
