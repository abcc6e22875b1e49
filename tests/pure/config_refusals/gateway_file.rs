//! What is refused in the gateway's own file.

use std::path::Path;

use signal_gateway::config::files::Disk;
use signal_gateway::config::{Overrides, load, load_profile};

use crate::pure::config_refusals::{assert_refused, load_texts, row, sound, spoil};

const SEE: &str = "config/gateway.toml";

#[test]
fn broken_gateway_files_are_refused_where_they_break() {
    let can = "interface = \"can0\"";
    assert_refused(
        "gateway.toml",
        &[
            row(can, "interface = @@= \"can0\"", "", "", SEE),
            row(
                can,
                "interface = \"can0\"\n@@speed = 5",
                "can.body.speed",
                "unknown key \"speed\"",
                "known here are",
            ),
            row("[ros]\n", "[@@rosa]\n", "rosa", "unknown key \"rosa\"", "known here are profile"),
            row(can, "interface = @@0", "can.body.interface", "expected a text in quotes, found 0", SEE),
            row(
                "[can.body]\ninterface = \"can0\"",
                "@@[can.body]",
                "can.body",
                "a key is missing: interface",
                SEE,
            ),
            row("profile = \"car.toml\"\n", "", "", "no vehicle profile is given", "profile = "),
            row("\"car.toml\"", "@@\"cart.toml\"", "profile", "cannot read it", "relative to this file"),
            row(
                "profile = \"car.toml\"\n",
                "profile = @@\"car.toml\"\nvehicle = { name = \"x\", turn = { fitted = false }, hazard = { from = \"unbound\" } }\n",
                "profile",
                "both a profile and a [vehicle]",
                "keep one",
            ),
            row(
                "[can.body]\ninterface = \"can0\"\n",
                "",
                "",
                "bus body of the vehicle profile has no interface",
                "[can.body]",
            ),
            row(
                "[reports]",
                "[can.@@chassis]\ninterface = \"can1\"\n[reports]",
                "can.chassis",
                "no bus chassis",
                "it has body",
            ),
            row(
                can,
                "interface = @@\"can 0\"",
                "can.body.interface",
                "not an interface name",
                "1 to 15 characters",
            ),
            row(
                can,
                "interface = @@\"\"",
                "can.body.interface",
                "not an interface name",
                "1 to 15 characters",
            ),
            row(
                can,
                "interface = @@\"can0123456789012\"",
                "can.body.interface",
                "not an interface name",
                "e.g. can0",
            ),
            row(
                can,
                "interface = \"can0\"\nreceive_buffer_bytes = @@100",
                "can.body.receive_buffer_bytes",
                "100 bytes is out of range",
                "4096 to",
            ),
        ],
    );
}

#[test]
fn broken_rates_names_and_recordings_are_refused() {
    let periodic = "publish = \"periodic\"";
    let period = "period_ms = 250";
    let node = "node = \"signal_gateway\"";
    assert_refused(
        "gateway.toml",
        &[
            row(
                periodic,
                "publish = @@\"sometimes\"",
                "reports.publish",
                "unknown value \"sometimes\"",
                "periodic, on_change",
            ),
            row(
                periodic,
                "publish = \"on_change\"\nrate_hz = @@10.0",
                "reports.rate_hz",
                "no rate",
                "periodic",
            ),
            row(periodic, "rate_hz = @@0.0", "reports.rate_hz", "0.0 Hz is out of range", "0.1 to 1000"),
            row(periodic, "rate_hz = @@nan", "reports.rate_hz", "nan Hz is out of range", "0.1 to 1000"),
            row(periodic, "rate_hz = @@1000.1", "reports.rate_hz", "1000.1 Hz", "0.1 to 1000"),
            row(
                periodic,
                "rate_hz = @@\"10\"",
                "reports.rate_hz",
                "expected a number, found the text \"10\"",
                "0.1 to 1000",
            ),
            row(
                periodic,
                "durability = @@\"forever\"",
                "reports.durability",
                "unknown value",
                "transient_local, volatile",
            ),
            row(period, "period_ms = @@1000", "diagnostics.period_ms", "1000 ms", "20 to 500 ms"),
            row(period, "period_ms = @@19", "diagnostics.period_ms", "19 ms", "20 to 500 ms"),
            row(period, "hardware_id = @@\"\"", "diagnostics.hardware_id", "empty", "none"),
            row(node, "node = @@\"signal-gateway\"", "ros.node", "not a ROS name", "letters, digits and _"),
            row(node, "node = @@\"2nd\"", "ros.node", "not a ROS name", "no digit first"),
            row(node, "namespace = @@\"car\"", "ros.namespace", "\"car\"", "/a/b"),
            row(node, "domain_id = @@233", "ros.domain_id", "233 is out of range", "0 to 232"),
            row(node, "domain_id = @@-1", "ros.domain_id", "-1 is out of range", "0 to 232"),
            row(
                node,
                "only_networks = [@@\"eth0\"]",
                "ros.only_networks[1]",
                "invalid IP address",
                "addresses",
            ),
            row(
                node,
                "topics.diagnostics = @@\"/diag nostics\"",
                "ros.topics.diagnostics",
                "not an absolute topic",
                "/a/b",
            ),
            row(
                "profile = \"car.toml\"\n",
                "profile = \"car.toml\"\nsource = \"recording\"\n",
                "",
                "without a recording",
                "[recording] file",
            ),
            row(
                "[ros]",
                "[recording]\nfile = \"a.log\"\nspeed = @@0.0\n[ros]",
                "recording.speed",
                "0.0 is out of range",
                "0.01 to 1000",
            ),
            row("[ros]", "@@[recording]\nrepeat = true\n[ros]", "recording", "a key is missing: file", SEE),
        ],
    );
}

#[test]
fn an_interface_that_serves_two_buses_is_refused() {
    let mut texts = sound();
    let profile = texts.text("car.toml").to_owned();
    let two = profile.replace("[bus.body]", "[bus.rear]\ndbc = \"car.dbc\"\n[bus.body]");
    texts.insert("car.toml", two.replace("= \"BLINK.", "= \"body:BLINK."));
    let gateway = texts.text("gateway.toml").to_owned();
    let twice = "[can.rear]\ninterface = @@\"can0\"\n[reports]";
    let (text, position) = spoil(&gateway, "[reports]", twice);
    texts.insert("gateway.toml", text);
    let problems = load_texts(&texts).unwrap_err();
    assert_eq!(problems.len(), 1);
    assert_eq!(problems[0].position, Some(position));
    assert_eq!(problems[0].key, "can.rear.interface");
    assert!(problems[0].to_string().contains("can0 serves two buses; give each bus its own"));
}

#[test]
fn all_problems_of_both_files_come_at_once() {
    let mut texts = sound();
    let gateway = texts.text("gateway.toml").to_owned();
    let gateway = gateway.replace("= 250", "= 9").replace("signal_gateway", "signal gateway");
    texts.insert("gateway.toml", gateway.replace("\"can0\"", "\"\""));
    let problems = load_texts(&texts).unwrap_err();
    let keys: Vec<_> = problems.iter().map(|problem| problem.key.as_str()).collect();
    assert_eq!(keys, ["can.body.interface", "diagnostics.period_ms", "ros.node"]);

    let profile = texts.text("car.toml").to_owned();
    let profile = profile.replace("left = [1]", "left = [0, 99]").replace("on = [1]", "on = []");
    texts.insert("car.toml", profile.replace("500", "0"));
    let problems = load_texts(&texts).unwrap_err();
    let places: Vec<_> =
        problems.iter().map(|problem| format!("{} {}", problem.file.display(), problem.key)).collect();
    assert_eq!(
        places,
        [
            "car.toml message.BLINK.timeout_ms",
            "car.toml turn.left[1]",
            "car.toml turn.left[2]",
            "car.toml hazard.on",
            "gateway.toml diagnostics.period_ms",
            "gateway.toml ros.node",
        ]
    );
}

#[test]
fn a_file_that_is_not_utf8_is_refused_at_its_first_bad_byte() {
    for (file, key) in [("gateway.toml", ""), ("car.toml", "")] {
        let mut texts = sound();
        let mut bytes = b"# caf\xE9\n".to_vec();
        bytes.extend(texts.text(file).as_bytes());
        texts.insert(file, bytes);
        let problems = load_texts(&texts).unwrap_err();
        assert_eq!(problems.len(), 1);
        assert_eq!(problems[0].file, Path::new(file));
        assert_eq!((problems[0].position, problems[0].key.as_str()), (Some((1, 6)), key));
        assert!(problems[0].to_string().ends_with("this is not UTF-8; save the file as UTF-8"));
    }
}

#[test]
fn a_missing_configuration_says_which_file_and_which_option() {
    let refused = load(&Disk, Path::new("nowhere/gateway.toml"), &Overrides::default()).unwrap_err();
    let text = refused.to_string();
    assert!(text.starts_with("nowhere/gateway.toml: cannot read it: No such file"), "{text}");
    assert!(text.ends_with("--config"), "{text}");
    let refused = load_profile(&Disk, Path::new("nowhere/car.toml")).unwrap_err();
    let text = refused.to_string();
    assert!(text.contains("nowhere/car.toml: cannot read it: No such file"), "{text}");
    assert!(!text.contains("--config"), "{text}");
}
