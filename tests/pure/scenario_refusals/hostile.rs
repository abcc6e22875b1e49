//! Files that are not scenarios, or are meant to do harm.

use std::path::Path;

use signal_gateway::config::files::Disk;
use signal_gateway::config::scenario::read;
use traffic_lights::compat::Compat;

use crate::pure::scenario_refusals::{accepted, read_as};

#[test]
fn files_that_are_not_scenarios_are_refused_with_a_reason() {
    let deep_xml = "<a>".repeat(50_000) + &"</a>".repeat(50_000);
    let deeper_xml = "<a>".repeat(400_000);
    let deep_list = "[".repeat(100_000);
    let deep_toml = format!("a = {deep_list}");
    let deep_block: String = (0..200).map(|depth| " ".repeat(depth) + "a:\n").collect();
    let xml_laughs = "<!DOCTYPE a [<!ENTITY b 'ha'><!ENTITY c '&b;&b;&b;'>]><OpenSCENARIO>&c;</OpenSCENARIO>";
    let yaml_laughs: String =
        (1..40).map(|n| format!("a{n}: &a{n} [*a{0}, *a{0}, *a{0}]\n", n - 1)).collect();
    let yaml_laughs = format!("a0: &a0 ha\n{yaml_laughs}");
    let many: String = "- x\n".repeat(200_000);
    let modified = |list: &str, text: &str| {
        format!("ScenarioModifiers: {{ M: [{list}] }}\nOpenSCENARIO: {{ RoadNetwork: {{ a: {text} }} }}\n")
    };
    let modifiers_laugh =
        modified(&format!("{{ name: a, list: [{}] }}", "b".repeat(3_000)), &"a".repeat(3_000));
    let many_modifiers = modified(&"{ name: a, list: [b] }, ".repeat(101), "x");
    let latin = b"<OpenSCENARIO>\n<a b='\xFC'/></OpenSCENARIO>";
    let wide = b"\xFF\xFE<\0O\0";
    #[rustfmt::skip]
    let rows: &[(&str, &[u8], &str)] = &[
        ("s.xosc", b"", "s.xosc:1:1: the file is empty"),
        ("s.yaml", b" \n", "s.yaml:1:1: the file is empty"),
        ("s.toml", b"\xEF\xBB\xBF", "s.toml:1:1: the file is empty"),
        ("s.yaml", b"# nothing\n", "s.yaml:1:1: the file is empty"),
        ("s.xosc", latin, "s.xosc:2:7: this is not UTF-8; save the file as UTF-8"),
        ("s.yaml", wide,
            "s.yaml: this is text in UTF-16, not a scenario of traffic lights; save it as UTF-8"),
        ("s.txt", b"x", "s.txt: unknown file extension"),
        ("s", b"x", "s: unknown file extension"),
        ("S.XOSC", b"<Open/>", "S.XOSC:1:1: Open: the root is Open"),
        ("s.xosc", b"<Open/>", "s.xosc:1:1: Open: the root is Open, not OpenSCENARIO"),
        ("s.xosc", b"<OpenSCENARIO/>", "neither RoadNetwork nor Storyboard"),
        ("s.xosc", b"<OpenSCENARIO><Catalog/></OpenSCENARIO>", "not a catalog"),
        ("s.xosc", b"OpenSCENARIO: {}", "correct the XML"),
        ("s.xosc", b"<OpenSCENARIO>", "correct the XML"),
        ("s.yaml", b"- 1", "expected a table, found a list"),
        ("s.yaml", b"OpenSCENARIO: 1", "neither RoadNetwork nor Storyboard"),
        ("s.yaml", b"OpenSCENARIO: [1]", "a list within a list"),
        ("s.yaml", b"a: \x00", "s.yaml:1:"),
        ("s.toml", b"a = \x00", "s.toml:1:"),
        ("s.xosc", b"<a>\x00</a>", "s.xosc:1:"),
        ("s.xosc", deep_xml.as_bytes(), "nested too deeply"),
        ("s.xosc", deeper_xml.as_bytes(), "nodes limit reached"),
        ("s.yaml", deep_list.as_bytes(), "recursion limit exceeded"),
        ("s.yaml", deep_block.as_bytes(), "nested too deeply"),
        ("s.toml", deep_toml.as_bytes(), "s.toml:1:"),
        ("s.xosc", xml_laughs.as_bytes(),
            "s.xosc:1:1: declarations of a document type cannot be read here; remove"),
        ("s.yaml", yaml_laughs.as_bytes(), "more than 100000 values"),
        ("s.yaml", many.as_bytes(), "more than 100000 values"),
        ("s.yaml", modifiers_laugh.as_bytes(),
            "s.yaml:2:35: OpenSCENARIO/RoadNetwork/@a: the values of the scenario modifiers are longer than a file"),
        ("s.yaml", many_modifiers.as_bytes(), "more than 100 scenario modifiers"),
        ("s.toml", &vec![b'#'; (4 << 20) + 1], "the file is too large: 4194305 bytes"),
    ];
    for (name, bytes, part) in rows {
        let problems = read_as(Compat::Improved, name, bytes).unwrap_err();
        let text = crate::pure::scenario_refusals::shown(&problems);
        assert!(problems.len() == 1 && text.contains(part), "{name}: {part}:\n{text:.600}");
    }
}

#[test]
fn a_missing_file_is_refused_by_its_name() {
    let refused = read(&Disk, Path::new("no/such.xosc"), Compat::Improved).unwrap_err();
    assert!(refused.to_string().starts_with("no/such.xosc: there is no such file; "), "{refused}");
}

#[test]
fn a_byte_order_mark_is_skipped() {
    for (name, text) in [
        ("s.xosc", "\u{FEFF}<?xml version=\"1.0\"?><OpenSCENARIO><Storyboard/></OpenSCENARIO>"),
        ("s.yaml", "\u{FEFF}OpenSCENARIO:\n  RoadNetwork: { LogicFile: { filepath: x.osm } }"),
        ("s.toml", "\u{FEFF}map = 'x.osm'"),
    ] {
        let file = accepted(Compat::Improved, name, text);
        assert_eq!(file.map.is_some(), name != "s.xosc", "{name}");
    }
}

#[test]
fn huge_names_make_short_refusals() {
    let name = "n\\n".repeat(300_000);
    let problems = read_as(Compat::Improved, "s.toml", format!("\"{name}\" = 1").as_bytes()).unwrap_err();
    let text = problems[0].to_string();
    assert!(!text.contains('\n') && text.chars().count() < 1500, "{text}");
}
