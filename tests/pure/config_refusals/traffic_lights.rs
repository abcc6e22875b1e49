//! What is refused in the section of traffic lights.

use crate::pure::config_refusals::{load_texts, sound};

/// `@@` marks the place that must be named; then the key, and parts of reason and remedy.
type Row = (&'static str, &'static str, &'static str, &'static str);

const ROWS: &[Row] = &[
    // A mode of the turn signal decider.
    ("compat = @@'path_generator'", "compat", "unknown value \"path_generator\"", "improved, upstream"),
    ("v2i_rate_hz = @@0", "v2i_rate_hz", "0 Hz is out of range", "0.001 to 1000"),
    ("frame_rate_hz = @@nan", "frame_rate_hz", "nan Hz", "0.001 to 1000"),
    ("v2i_timeout_ms = @@0", "v2i_timeout_ms", "0 ms", "1 to 3600000"),
    ("architecture = @@'awf/universe'", "architecture", "is not of the form", ""),
    (
        "architecture = @@'awf/universe/20240101'",
        "architecture",
        "is not supported; use `awf/universe/20230906`",
        "",
    ),
    ("topics.camera = @@'no slash'", "topics.camera", "not an absolute topic", "/a/b"),
    ("topics = { camera = '/a', v2i = @@'/a' }", "topics.v2i", "another topic has this name", "its own"),
    ("topics.arbiter = @@'/a'", "topics.arbiter", "there is no arbiter", "[traffic_lights.arbiter]"),
    ("inputs.v2i = @@'a'", "inputs.v2i", "not an absolute topic", "/a/b"),
    (
        "inputs = { v2i = '/a', v2i_detected = @@'/a' }",
        "inputs.v2i_detected",
        "another topic has this name",
        "its own",
    ),
    ("inputs = { v2i = '/a', command = @@'/a' }", "inputs.command", "another topic has this name", "its own"),
    ("inputs.v2i = @@'/v2x/traffic_signals'", "inputs.v2i", "another topic has this name", "its own"),
    ("arbiter.source_priority = @@'x'", "arbiter.source_priority", "unknown value \"x\"", "confidence"),
    ("arbiter.external_time_tolerance_s = @@-1", "arbiter.external_time_tolerance_s", "-1 s", "0 to 3600 s"),
    ("faults.v2i.loss = @@1.1", "faults.v2i.loss", "1.1 is out of range", "0 to 1"),
    ("faults.v2i.loss = @@nan", "faults.v2i.loss", "nan is out of range", "0 to 1"),
    ("faults.v2i.unknown = @@-0.1", "faults.v2i.unknown", "-0.1 is out of range", "0 to 1"),
    ("faults.v2i.freeze = @@2", "faults.v2i.freeze", "2 is out of range", "0 to 1"),
    ("faults.v2i.freeze_messages = @@0.5", "faults.v2i.freeze_messages", "0.5 messages", "1 "),
    ("faults.v2i.miss_messages = @@inf", "faults.v2i.miss_messages", "inf messages", "1 "),
    ("faults.v2i.miss = @@-1", "faults.v2i.miss", "-1 is out of range", "0 to 1"),
    ("faults.v2i.confidence = @@1.5", "faults.v2i.confidence", "1.5 is out of range", "0 to 1"),
    ("faults.v2i.confidence_spread = @@nan", "faults.v2i.confidence_spread", "nan is out of range", "0 "),
    ("faults.v2i.latency_ms = @@61000", "faults.v2i.latency_ms", "61000 ms", "0 to 60000 ms"),
    (
        "faults.v2i.confusion = [{ from = 'red', to = 'green', probability = @@1.2 }]",
        "faults.v2i.confusion[1].probability",
        "1.2 is out of range",
        "0 to 1",
    ),
];

#[test]
fn broken_lights_are_refused_at_their_keys() {
    for (marked, key, reason, remedy) in ROWS {
        let text = format!("[ros]\nenabled = false\n[traffic_lights]\nscenario = 's.toml'\n{marked}\n");
        let column = marked.split_once("@@").unwrap().0.chars().count() + 1;
        let mut texts = sound();
        texts.insert("s.toml", "[groups]\n100 = [11]\n");
        texts.insert("gateway.toml", text.replace("@@", ""));
        let problems = load_texts(&texts).expect_err(marked);
        let [problem] = problems.as_slice() else { panic!("{marked}: {problems:?}") };
        assert_eq!((problem.position, &*problem.key), (Some((5, column)), &*format!("traffic_lights.{key}")));
        assert!(problem.reason.contains(reason) && problem.remedy.contains(remedy), "{problem}");
    }
}
