//! What is refused in the gateway's own file.

use std::path::Path;

use signal_gateway::config::files::Disk;
use signal_gateway::config::{Overrides, load, load_profile};

use crate::pure::config_refusals::{assert_refused, load_texts, sound, with};

#[test]
fn broken_gateway_files_are_refused_where_they_break() {
    let cases = r#"
- interface = "can0"
+ interface = = "can0"
> gateway.toml:3:13: …; see config/gateway.toml for every key
  interface = "can0"
+ speed = 5
> gateway.toml:4:1: can.body.speed: unknown key "speed"; valid keys: receive_buffer_bytes, interface
- [ros]
+ [rosa]
> gateway.toml:9:2: rosa: unknown key "rosa"; did you mean ros?
- interface = "can0"
+ interface = 0
> gateway.toml:3:13: can.body.interface: expected a text in quotes, found 0; write "0"
- interface = "can0"
> gateway.toml:2:1: can.body: missing key: interface; see config/gateway.toml
- profile = "car.toml"
> gateway.toml:1:1: no vehicle profile is given; give a path, or a name of `signal-gateway profiles list`, with profile = "…"
- profile = "car.toml"
+ profile = "cart.toml"
> gateway.toml:1:11: profile: cart.toml: there is no such file; give the profile's path relative to this file, or a name of `signal-gateway profiles list`
  profile = "car.toml"
+ vehicle = { name = "x", turn = { fitted = false }, hazard = { from = "unbound" } }
> gateway.toml:1:11: profile: both a profile and a [vehicle] are given; keep one of them
- [can.body]
- interface = "can0"
> gateway.toml:1:1: bus body of the vehicle profile has no interface; add [can.body] interface = "can0"
  interface = "can0"
+ [can.chassis]
+ interface = "can1"
> gateway.toml:4:6: can.chassis: the vehicle profile has no bus chassis; it has body
- interface = "can0"
+ interface = "can 0"
> gateway.toml:3:13: can.body.interface: "can 0" is not an interface name; give 1 to 15 characters without spaces and slashes, e.g. can0
- interface = "can0"
+ interface = ""
> gateway.toml:3:13: can.body.interface: "" is not an interface name; give 1 to 15 characters without spaces and slashes, e.g. can0
- interface = "can0"
+ interface = "can0123456789012"
> gateway.toml:3:13: can.body.interface: "can0123456789012" is not an interface name; give 1 to 15 characters without spaces and slashes, e.g. can0
  interface = "can0"
+ receive_buffer_bytes = 100
> gateway.toml:4:24: can.body.receive_buffer_bytes: 100 bytes is out of range; give 4096 to 1073741824 bytes
"#;
    assert_refused(&sound(), "gateway.toml", cases);
}

#[test]
fn broken_rates_names_and_recordings_are_refused() {
    let cases = r#"
- publish = "periodic"
+ publish = "sometimes"
> gateway.toml:5:11: reports.publish: unknown value "sometimes"; give one of periodic, on_change
- publish = "periodic"
+ publish = "on_change"
+ rate_hz = 10.0
> gateway.toml:6:11: reports.rate_hz: reports on change have no rate; remove it, or use publish = "periodic"
- publish = "periodic"
+ rate_hz = 0.0
> gateway.toml:5:11: reports.rate_hz: 0.0 Hz is out of range; give 0.1 to 1000 Hz
- publish = "periodic"
+ rate_hz = nan
> gateway.toml:5:11: reports.rate_hz: nan Hz is out of range; give 0.1 to 1000 Hz
- publish = "periodic"
+ rate_hz = 1000.1
> gateway.toml:5:11: reports.rate_hz: 1000.1 Hz is out of range; give 0.1 to 1000 Hz
- publish = "periodic"
+ rate_hz = "10"
> gateway.toml:5:11: reports.rate_hz: expected a number, found the text "10"; write 10 without quotes
- publish = "periodic"
+ durability = "forever"
> gateway.toml:5:14: reports.durability: unknown value "forever"; give one of transient_local, volatile
- period_ms = 250
+ period_ms = 1000
> gateway.toml:7:13: diagnostics.period_ms: 1000 ms is out of range; give 20 to 500 ms
- period_ms = 250
+ period_ms = 19
> gateway.toml:7:13: diagnostics.period_ms: 19 ms is out of range; give 20 to 500 ms
- period_ms = 250
+ hardware_id = ""
> gateway.toml:7:15: diagnostics.hardware_id: ROS tools warn about an empty hardware_id; use "none" or leave it out
- node = "signal_gateway"
+ node = "signal-gateway"
> gateway.toml:10:8: ros.node: "signal-gateway" is not a ROS name; use letters, digits and _, no digit first
- node = "signal_gateway"
+ node = "2nd"
> gateway.toml:10:8: ros.node: "2nd" is not a ROS name; use letters, digits and _, no digit first
- node = "signal_gateway"
+ namespace = "car"
> gateway.toml:10:13: ros.namespace: "car" is not a namespace; write it as / or /vehicle
- node = "signal_gateway"
+ domain_id = 233
> gateway.toml:10:13: ros.domain_id: 233 is out of range; give 0 to 232
- node = "signal_gateway"
+ domain_id = -1
> gateway.toml:10:13: ros.domain_id: -1 is out of range; give 0 to 232
- node = "signal_gateway"
+ only_networks = ["eth0"]
> gateway.toml:10:18: ros.only_networks[1]: invalid IP address syntax; give IP addresses of this computer
- node = "signal_gateway"
+ memory_limit_mb = 64
> gateway.toml:10:19: ros.memory_limit_mb: 64 MB is out of range; give 128 to 16384 MB
- node = "signal_gateway"
+ topics.diagnostics = "/diag nostics"
> gateway.toml:10:22: ros.topics.diagnostics: "/diag nostics" is not a topic; write it as /a/b, a/b or ~/a
  profile = "car.toml"
+ source = "recording"
> gateway.toml:1:1: source = "recording" without a recording; add [recording] file = "….log"
+ [recording]
+ file = "a.log"
+ speed = 0.0
> gateway.toml:10:9: recording.speed: 0.0 is out of range; give 0.01 to 1000
+ [recording]
+ repeat = true
> gateway.toml:8:1: recording: missing key: file; see config/gateway.toml
"#;
    assert_refused(&sound(), "gateway.toml", cases);
}

#[test]
fn an_interface_that_serves_two_buses_is_refused() {
    let two = with("car.toml", "[bus.body]\n", "[bus.rear]\ndbc = \"car.dbc\"\n[bus.body]\n");
    let profile = two.text("car.toml").replace("= \"BLINK.", "= \"body:BLINK.");
    let cases = r#"
+ [can.rear]
+ interface = "can0"
> gateway.toml:9:13: can.rear.interface: can0 already serves another bus; give each bus its own interface
"#;
    assert_refused(&two.with("car.toml", profile), "gateway.toml", cases);
}

#[test]
fn buses_are_checked_even_if_the_profile_is_refused() {
    let mut texts = with("car.toml", "from = \"signal\"", "from = \"signl\"");
    let gateway = texts.text("gateway.toml").replace("[can.body]", "[can.bdy]");
    texts.insert("gateway.toml", gateway);
    let problems: Vec<_> = load_texts(&texts).unwrap_err().iter().map(ToString::to_string).collect();
    let expected = [
        "car.toml:13:8: hazard.from: unknown value \"signl\"; did you mean signal?",
        "gateway.toml:1:1: bus body of the vehicle profile has no interface; add [can.body] interface = \"can0\"",
        "gateway.toml:2:6: can.bdy: the vehicle profile has no bus bdy; did you mean body?",
    ];
    assert_eq!(problems, expected);
}

#[test]
fn all_problems_of_both_files_come_at_once() {
    let mut texts = sound();
    let gateway = texts.text("gateway.toml").to_owned();
    let gateway = gateway.replace("= 250", "= 9").replace("signal_gateway", "signal gateway");
    texts.insert("gateway.toml", gateway.replace("\"can0\"", "\"\""));
    let problems = load_texts(&texts).unwrap_err();
    let keys: Vec<_> = problems.iter().map(|problem| &*problem.key).collect();
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
            "gateway.toml can.body.interface",
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
        assert_eq!((problems[0].position, &*problems[0].key), (Some((1, 6)), key));
        assert!(problems[0].to_string().ends_with("this is not UTF-8; save the file as UTF-8"));
    }
}

#[test]
fn a_missing_configuration_is_refused_with_its_path_and_the_option() {
    let refused = load(&Disk, Path::new("nowhere/gateway.toml"), &Overrides::default()).unwrap_err();
    let text = refused.to_string();
    assert!(text.starts_with("nowhere/gateway.toml: there is no such file"), "{text}");
    assert!(text.contains("--config FILE"), "{text}");
    let refused = load_profile(&Disk, Path::new("nowhere/car.toml")).unwrap_err();
    let text = refused.to_string();
    assert!(text.contains("nowhere/car.toml: there is no such file"), "{text}");
    assert!(!text.contains("--config"), "{text}");
}
