//! What is refused in a vehicle profile.

use crate::pure::config_refusals::{assert_refused, load_texts, row, sound};

const SEE: &str = "config/gateway.toml";
const TURN: &str = "[turn]\nsignal = \"BLINK.TURN\"\noff = [0]\nleft = [1]\nright = [2]\n";
const HAZARD: &str = "from = \"signal\"\nsignal = \"BLINK.HAZARD\"\non = [1]\noff = [0]\n";
const FORMS: &str = "`left_signal`, `right_signal` and `both_on`";

#[test]
fn broken_keys_and_files_are_refused() {
    assert_refused(
        "car.toml",
        &[
            row("name = \"Car\"\n", "@@", "", "a key is missing: name", SEE),
            row(
                "left = [1]",
                "left = [1]\n@@lefts = [1]",
                "turn.lefts",
                "unknown key \"lefts\"",
                "off, left, right",
            ),
            row("left = [1]", "left = @@1", "turn.left", "expected a list, found 1", "raw values"),
            row("left = [1]", "left = [@@1.5]", "turn.left[1]", "a raw value such as 3, or a range", SEE),
            row(
                "left = [1]",
                "left = [@@\"7..=4\"]",
                "turn.left[1]",
                "a raw value such as 3, or a range",
                SEE,
            ),
            row(
                "\"car.dbc\"",
                "@@\"cart.dbc\"",
                "bus.body.dbc",
                "cannot read cart.dbc",
                "relative to this file",
            ),
            row(
                "dbc = \"car.dbc\"",
                "dbc = \"car.dbc\"\nalive_timeout_ms = @@0",
                "bus.body.alive_timeout_ms",
                "0 ms is out of range",
                "1 to 3600000 ms",
            ),
            row(
                "dbc = \"car.dbc\"",
                "dbc = \"car.dbc\"\nheartbeat_messages = [@@\"ENGINE\"]",
                "bus.body.heartbeat_messages[1]",
                "car.dbc has no message ENGINE",
                "name a message of the DBC",
            ),
            row(
                "timeout_ms = 500",
                "timeout_ms = @@3600001",
                "message.BLINK.timeout_ms",
                "3600001 ms is out of range",
                "1 to",
            ),
            row(
                "timeout_ms = 500\n",
                "timing = @@\"often\"\n",
                "message.BLINK.timing",
                "unknown value \"often\"",
                "cyclic, event",
            ),
            row(
                "[message.BLINK]\ntimeout_ms = 500\n",
                "",
                "",
                "no timeout for BLINK: the DBC has no GenMsgCycleTime",
                "add [message.BLINK] timeout_ms",
            ),
            row(
                "[message.BLINK]\ntimeout_ms = 500\n",
                "[message.@@BLINK]\n",
                "message.BLINK",
                "no timeout for BLINK",
                "timeout_ms",
            ),
        ],
    );
}

#[test]
fn messages_without_a_believable_timing_are_refused() {
    assert_refused(
        "car.toml",
        &[
            row(
                "[message.BLINK]\ntimeout_ms = 500\n",
                "[message.@@BLINK]\ntiming = \"event\"\n",
                "message.BLINK",
                "nothing proves this bus alive",
                "heartbeat_messages",
            ),
            row(
                "dbc = \"car.dbc\"\n[message.BLINK]\ntimeout_ms = 500\n",
                "dbc = \"car.dbc\"\nheartbeat_messages = [\"CLIMATE\"]\n[message.BLINK]\ntiming = \"event\"\ntimeout_ms = @@500\n",
                "message.BLINK.timeout_ms",
                "an event message has no timeout",
                "cyclic",
            ),
            row(
                "[message.BLINK]\n",
                "[message.@@CLIMATE]\ntimeout_ms = 100\n[message.BLINK]\n",
                "message.CLIMATE",
                "no bound signal is in this message",
                "remove the section",
            ),
            row(
                "[message.BLINK]\n",
                "[message.BLINK]\nbus = @@\"boot\"\n",
                "message.BLINK.bus",
                "there is no bus boot",
                "it has body",
            ),
        ],
    );
}

#[test]
fn signals_that_cannot_be_bound_are_refused() {
    let turn = "\"BLINK.TURN\"";
    assert_refused(
        "car.toml",
        &[
            row(turn, "@@\"BLINK\"", "turn.signal", "names no signal", "MESSAGE.SIGNAL"),
            row(turn, "@@\"WINK.TURN\"", "turn.signal", "car.dbc has no message WINK", "name a message"),
            row(turn, "@@\"BLINK.TURNS\"", "turn.signal", "BLINK has no signal TURNS", "it has TURN, HAZARD"),
            row(turn, "@@\"boot:BLINK.TURN\"", "turn.signal", "there is no bus boot", "it has body"),
            row(turn, "@@\"BLINK.TORN\"", "turn.signal", "rejected at car.dbc:6: ", "it has TURN"),
            row(turn, "@@\"LAMPS.TURN\"", "turn.signal", "rejected at car.dbc:15: ", "name a message"),
            row(turn, "@@\"CLIMATE.HEAT\"", "turn.signal", "HEAT is a floating-point signal", "integer"),
        ],
    );
}

#[test]
fn values_that_contradict_are_refused() {
    assert_refused(
        "car.toml",
        &[
            row("left = [1]", "left = [@@0]", "turn.left[1]", "0 overlaps 0", "one meaning"),
            row("right = [2]", "right = [@@\"1..=3\"]", "turn.right[1]", "1..=3 overlaps 1", "one meaning"),
            row("left = [1]", "left = [1, @@1]", "turn.left[2]", "1 overlaps 1", "one meaning"),
            row("left = [1]", "left = [1, @@16]", "turn.left[2]", "TURN cannot hold 16", "0 to 15"),
            row("left = [1]", "left = [@@-1]", "turn.left[1]", "TURN cannot hold -1", "0 to 15"),
            row("left = [1]", "left = @@[]", "turn.left", "no value is named", "at least one"),
            row("right = [2]", "right = [2]\nfault = [@@2]", "turn.fault[1]", "2 overlaps 2", "one meaning"),
            row(
                "on = [1]",
                "on = [1]\nnot_available = [@@1]",
                "hazard.not_available[1]",
                "overlaps",
                "one meaning",
            ),
            row("on = [1]", "on = [1, @@\"3..=4\"]", "hazard.on[2]", "HAZARD cannot hold 3..=4", "0 to 3"),
        ],
    );
}

#[test]
fn turn_forms_that_do_not_fit_together_are_refused() {
    assert_refused(
        "car.toml",
        &[
            row(TURN, "@@[turn]\n", "turn", "the turn state comes from no signal", FORMS),
            row(
                "right = [2]\n",
                "right = [2]\nleft_signal = @@{ signal = \"BLINK.LEFT\", on = [1], off = [0] }\n",
                "turn.left_signal",
                "exclude each other",
                FORMS,
            ),
            row(
                TURN,
                "@@[turn]\nleft_signal = { signal = \"BLINK.LEFT\", on = [1], off = [0] }\n",
                "turn",
                "keys are missing: right_signal, both_on",
                "a pair of turn signals needs",
            ),
            row(
                TURN,
                "[turn]\nboth_on = \"undefined\"\nleft_signal = { signal = \"BLINK.LEFT\", on = [1], off = [0] }\n\
                 right_signal = @@{ signal = \"BLINK.LEFT\", on = [1], off = [0] }\n",
                "turn.right_signal",
                "the same signal",
                "one signal for each side",
            ),
            row(
                TURN,
                "[turn]\nboth_on = @@\"off\"\nleft_signal = { signal = \"BLINK.LEFT\", on = [1], off = [0] }\n\
                 right_signal = { signal = \"BLINK.RIGHT\", on = [1], off = [0] }\n",
                "turn.both_on",
                "unknown value \"off\"",
                "hazard, undefined",
            ),
            row(
                TURN,
                "@@[turn]\nsignal = \"BLINK.TURN\"\n",
                "turn",
                "keys are missing: off, left, right",
                "needs signal, off",
            ),
        ],
    );
    let mut texts = sound();
    let profile = texts.text("car.toml").to_owned();
    texts.insert("car.toml", profile.replace("left = [1]", "left = [1]\nfitted = false"));
    let problems = load_texts(&texts).unwrap_err();
    let reasons: Vec<_> = problems.iter().map(|problem| problem.reason.as_str()).collect();
    let expected = ["signal", "off", "left", "right"];
    assert_eq!(reasons, expected.map(|key| format!("unknown key {key:?} with fitted = false")));
    assert_eq!(problems[0].position, Some((7, 1)));
}

#[test]
fn hazard_forms_that_do_not_fit_together_are_refused() {
    assert_refused(
        "car.toml",
        &[
            row(
                "from = \"signal\"",
                "from = @@\"lamps\"",
                "hazard.from",
                "unknown value \"lamps\"",
                "signal, reason",
            ),
            row("[hazard]\nfrom = \"signal\"\n", "@@[hazard]\n", "hazard", "a key is missing: from", SEE),
            row(
                "[hazard]\nfrom = \"signal\"\nsignal = \"BLINK.HAZARD\"\non = [1]\n",
                "@@[hazard]\nfrom = \"signal\"\nsignal = \"BLINK.HAZARD\"\n",
                "hazard",
                "a key is missing: on",
                "a hazard signal needs",
            ),
            row(
                HAZARD,
                "from = \"reason\"\nsignal = \"BLINK.HAZARD\"\n@@on = [1]\noff = [0]\nreasons = { a = [1] }\n",
                "hazard.on",
                "unknown key \"on\" with from = \"reason\"",
                "reasons",
            ),
            row(
                "[hazard]\nfrom = \"signal\"\nsignal = \"BLINK.HAZARD\"\non = [1]\n",
                "@@[hazard]\nfrom = \"reason\"\n",
                "hazard",
                "keys are missing: signal, reasons",
                "a hazard reason needs",
            ),
            row(
                HAZARD,
                "from = @@\"both_sides\"\n",
                "hazard.from",
                "cannot show both sides",
                "both_on = \"hazard\"",
            ),
            row(
                HAZARD,
                "from = \"unbound\"\n@@signal = \"BLINK.HAZARD\"\n",
                "hazard.signal",
                "unknown key \"signal\" without a source",
                "known here are from",
            ),
            row(
                HAZARD,
                "from = \"reason\"\nsignal = \"BLINK.HAZARD\"\noff = [0]\nreasons = @@{}\n",
                "hazard.reasons",
                "no reason is named",
                "[hazard.reasons]",
            ),
            row(
                HAZARD,
                "from = \"not_fitted\"\n@@reasons = { button = [1] }\n",
                "hazard.reasons",
                "unknown key \"reasons\" without a source",
                "known here are from",
            ),
            row(
                HAZARD,
                "from = \"reason\"\nsignal = \"BLINK.HAZARD\"\noff = [0]\nreasons = { a = [1], b = [@@1] }\n",
                "hazard.reasons.b[1]",
                "1 overlaps 1",
                "one meaning",
            ),
            row(
                "right = [2]\n[hazard]\nfrom = \"signal\"\nsignal = \"BLINK.HAZARD\"\non = [1]\noff = [0]\n",
                "right = [2]\nboth = [3]\nwhile_hazard = @@\"keep\"\n[hazard]\nfrom = \"both_sides\"\n",
                "turn.while_hazard",
                "no turn state to keep",
                "\"disable\"",
            ),
            row(
                "on = [1]",
                "on = [1]\non_fault = @@\"stop\"",
                "hazard.on_fault",
                "unknown value \"stop\"",
                "report, withhold",
            ),
            row(
                "on = [1]\noff = [0]\n",
                "on = [1]\noff = [0]\n[[hazard.fault_signal]]\nsignal = @@\"BLINK.BULB\"\non = [1]\noff = [0]\ntext = \"\"\n",
                "hazard.fault_signal[1].signal",
                "BLINK has no signal BULB",
                "it has TURN",
            ),
        ],
    );
}
