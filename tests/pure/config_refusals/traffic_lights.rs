//! What is refused in the section of traffic lights.

use crate::pure::config_refusals::{HERE, assert_refused, load_texts, sound};

#[test]
fn broken_lights_are_refused_at_their_keys() {
    let gateway = format!("[ros]\nenabled = false\n[traffic_lights]\nscenario = 's.toml'\n{HERE}");
    let files = sound().with("s.toml", "[groups]\n100 = [11]\n").with("gateway.toml", gateway);
    let cases = r#"
+ compat = 'path_generator'
> gateway.toml:5:10: traffic_lights.compat: unknown value "path_generator"; give one of improved, upstream
+ v2i_rate_hz = 0
> gateway.toml:5:15: traffic_lights.v2i_rate_hz: 0 Hz is out of range; give 0.001 to 1000 Hz
+ frame_rate_hz = nan
> gateway.toml:5:17: traffic_lights.frame_rate_hz: nan Hz is out of range; give 0.001 to 1000 Hz
+ v2i_timeout_ms = 0
> gateway.toml:5:18: traffic_lights.v2i_timeout_ms: 0 ms is out of range; give 1 to 3600000 ms
+ architecture = 'awf/universe'
> gateway.toml:5:16: traffic_lights.architecture: architecture `awf/universe` is not of the form `awf/universe/<yyyymmdd>`; use `awf/universe/20240605`, for example
+ architecture = 'awf/universe/20240101'
> gateway.toml:5:16: traffic_lights.architecture: architecture `awf/universe/20240101` is not supported; use `awf/universe/20230906`, or `awf/universe/20240605` or later
+ topics.camera = 'no slash'
> gateway.toml:5:17: traffic_lights.topics.camera: "no slash" is not a topic; write it as /a/b, a/b or ~/a
+ topics = { camera = '/a', v2i = '/a' }
> gateway.toml:5:33: traffic_lights.topics.v2i: another topic has this name; give each its own, or ""
+ topics.arbiter = '/a'
> gateway.toml:5:18: traffic_lights.topics.arbiter: there is no arbiter; add [traffic_lights.arbiter]
+ inputs.v2i = '~a'
> gateway.toml:5:14: traffic_lights.inputs.v2i: "~a" is not a topic; write it as /a/b, a/b or ~/a
+ inputs = { v2i = '/a', v2i_detected = '/a' }
> gateway.toml:5:39: traffic_lights.inputs.v2i_detected: another topic has this name; give each its own
+ inputs = { v2i = '/a', command = '/a' }
> gateway.toml:5:34: traffic_lights.inputs.command: another topic has this name; give each its own
+ inputs.camera = '/camera'
> gateway.toml:5:17: traffic_lights.inputs.camera: there is no arbiter; add [traffic_lights.arbiter]
+ use_sim_time = true
+ topics.clock = '/clock'
> gateway.toml:5:16: traffic_lights.use_sim_time: topics.clock publishes a clock as well; keep one of them
+ inputs.v2i = '/v2x/traffic_signals'
> gateway.toml:5:14: traffic_lights.inputs.v2i: another topic has this name; give each its own
+ arbiter.source_priority = 'x'
> gateway.toml:5:27: traffic_lights.arbiter.source_priority: unknown value "x"; give one of confidence, external, perception
+ arbiter.external_time_tolerance_s = -1
> gateway.toml:5:37: traffic_lights.arbiter.external_time_tolerance_s: -1 s is out of range; give 0 to 3600 s
+ faults.v2i.loss = 1.1
> gateway.toml:5:19: traffic_lights.faults.v2i.loss: 1.1 is out of range; give 0 to 1
+ faults.v2i.loss = nan
> gateway.toml:5:19: traffic_lights.faults.v2i.loss: nan is out of range; give 0 to 1
+ faults.v2i.unknown = -0.1
> gateway.toml:5:22: traffic_lights.faults.v2i.unknown: -0.1 is out of range; give 0 to 1
+ faults.v2i.freeze = 2
> gateway.toml:5:21: traffic_lights.faults.v2i.freeze: 2 is out of range; give 0 to 1
+ faults.v2i.freeze_messages = 0.5
> gateway.toml:5:30: traffic_lights.faults.v2i.freeze_messages: 0.5 messages is out of range; give 1 messages or more
+ faults.v2i.miss_messages = inf
> gateway.toml:5:28: traffic_lights.faults.v2i.miss_messages: inf messages is out of range; give 1 messages or more
+ faults.v2i.miss = -1
> gateway.toml:5:19: traffic_lights.faults.v2i.miss: -1 is out of range; give 0 to 1
+ faults.v2i.confidence = 1.5
> gateway.toml:5:25: traffic_lights.faults.v2i.confidence: 1.5 is out of range; give 0 to 1
+ faults.v2i.confidence_spread = nan
> gateway.toml:5:32: traffic_lights.faults.v2i.confidence_spread: nan is out of range; give 0 or more
+ faults.v2i.latency_ms = 61000
> gateway.toml:5:25: traffic_lights.faults.v2i.latency_ms: 61000 ms is out of range; give 0 to 60000 ms
+ faults.v2i.confusion = [{ from = 'red', to = 'green', probability = 1.2 }]
> gateway.toml:5:69: traffic_lights.faults.v2i.confusion[1].probability: 1.2 is out of range; give 0 to 1
"#;
    assert_refused(&files, "gateway.toml", cases);
}

#[test]
fn markers_of_a_map_whose_lamps_cannot_be_placed_are_refused() {
    let gateway = format!("[ros]\nenabled = false\n[traffic_lights]\n{HERE}");
    let far =
        "<osm><node id='7' lat='0' lon='0'><tag k='local_x' v='1e9'/><tag k='local_y' v='0'/></node></osm>";
    let files = sound().with("far.osm", far).with("gateway.toml", gateway);
    let cases = "\
+ map = 'far.osm'
+ topics.markers = '/traffic_light/marker'
> gateway.toml:4:7: traffic_lights.map: lamps cannot be placed for the markers: node 7: it lies 1e8 metres or more from the origin of the map; correct the map or its map_projector_info.yaml, or leave out topics.markers
";
    assert_refused(&files, "gateway.toml", cases);
    let without = format!("[ros]\nenabled = false\n[traffic_lights]\nmap = 'far.osm'\n{HERE}");
    assert!(load_texts(&files.with("gateway.toml", without)).is_ok());
}
