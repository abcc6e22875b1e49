//! What is refused of commands to the vehicle, in the profile and in the gateway's file.

use crate::pure::config_refusals::{Spoilt, assert_refused, load_texts, row, sound, spoil};

const PLACE: &str = "[hazard]\n";

/// A profile with commands; parts of it are spoilt.
const COMMAND: &str = r#"[[command.message]]
name = "LAMP_CMD"
period_ms = 100
enable = { on = { ENABLE = 1 }, off = { ENABLE = 0 } }
constants = { DOOR = 0 }
counter = { signal = "CMD_COUNT" }
checksum = { kind = "sum8", signal = "CMD_SUM" }
turn = { off = { TURN_REQ = 0 }, left = { TURN_REQ = 1 }, right = { TURN_REQ = 2 }, hazard = { TURN_REQ = 3 } }
[hazard]
"#;

/// Replacements in [`COMMAND`], key, reason, remedy; `@@` marks the place that must be named.
type Row<'a> = (&'a [(&'a str, &'a str)], &'static str, &'static str, &'static str);

/// The message's name is the place.
const NAMED: (&str, &str) = ("\"LAMP_CMD\"", "@@\"LAMP_CMD\"");

fn refused(rows: &[Row<'_>]) {
    let rows: Vec<Spoilt> = rows
        .iter()
        .map(|(changes, key, reason, remedy)| {
            let text = changes.iter().fold(COMMAND.to_owned(), |text, (old, new)| {
                assert_eq!(text.matches(old).count(), 1, "{old:?} must stand there once");
                text.replace(old, new)
            });
            row(PLACE, text.leak(), key, reason, remedy)
        })
        .collect();
    assert_refused("car.toml", &rows);
}

#[test]
fn command_messages_are_checked_against_the_dbc() {
    let count = "counter = { signal = \"CMD_COUNT\" }\n";
    refused(&[
        (
            &[("\"LAMP_CMD\"", "@@\"NONE\"")],
            "command.message[1].name",
            "has no message NONE",
            "a message of the DBC",
        ),
        (
            &[("TURN_REQ = 1", "@@NONE = 1")],
            "command.message[1].turn.left.NONE",
            "has no signal NONE",
            "it has ENABLE",
        ),
        (
            &[("TURN_REQ = 1", "TURN_REQ = @@8")],
            "command.message[1].turn.left.TURN_REQ",
            "cannot be 8",
            "0 to 7",
        ),
        (&[("DOOR = 0", "DOOR = @@-1")], "command.message[1].constants.DOOR", "DOOR cannot be -1", "0 to 1"),
        (&[("{ DOOR = 0 }", "@@{}")], "command.message[1].constants", "no signal is named", "give signals"),
        (
            &[("left = { TURN_REQ = 1 }", "left = @@{ DOOR = 1 }")],
            "command.message[1].turn.left",
            "sets other signals",
            "the same signals",
        ),
        (
            &[("{ DOOR = 0 }", "@@{ DOOR = 0, ENABLE = 1 }")],
            "command.message[1].constants",
            "set elsewhere",
            "once",
        ),
        (
            &[NAMED, ("constants = { DOOR = 0 }\n", "")],
            "command.message[1].name",
            "is sent in DOOR",
            "`constants`",
        ),
        (&[NAMED, (count, "")], "command.message[1].name", "is sent in CMD_COUNT", "`constants`"),
        (
            &[
                ("signal = \"CMD_COUNT\"", "signal = @@\"ENABLE\""),
                ("{ DOOR = 0 }", "{ DOOR = 0, CMD_COUNT = 0 }"),
            ],
            "command.message[1].counter.signal",
            "bits of ENABLE are set elsewhere",
            "once",
        ),
        (
            &[("\"CMD_COUNT\"", "\"CMD_COUNT\", increments_on = @@\"changes\"")],
            "command.message[1].counter.increments_on",
            "counts every frame",
            "remove",
        ),
        (
            &[("\"CMD_SUM\"", "@@\"CMD_COUNT\"")],
            "command.message[1].checksum.signal",
            "the checksum has 8 bits",
            "holds the checksum",
        ),
    ]);
}

#[test]
fn times_of_command_messages_are_checked() {
    let period = "period_ms = 100";
    refused(&[
        (
            &[(period, "period_ms = @@5")],
            "command.message[1].period_ms",
            "5 ms is out of range",
            "10 to 1000 ms",
        ),
        (
            &[NAMED, ("period_ms = 100\n", "")],
            "command.message[1].name",
            "no period for LAMP_CMD",
            "period_ms",
        ),
        (
            &[(period, "period_ms = 100\nmin_send_interval_ms = @@101")],
            "command.message[1].min_send_interval_ms",
            "101 ms",
            "1 to 100 ms",
        ),
        (
            &[(period, "period_ms = 100\nburst_gap_ms = @@9")],
            "command.message[1].burst_gap_ms",
            "9 ms",
            "10 to 100 ms",
        ),
        (
            &[(period, "period_ms = 100\nburst = @@0")],
            "command.message[1].burst",
            "0 frames is out of range",
            "1 to 10",
        ),
        (
            &[(period, "period_ms = 100\nunused_bits = @@2")],
            "command.message[1].unused_bits",
            "2 is out of range",
            "0 to 1",
        ),
    ]);
}

#[test]
fn what_a_command_message_can_say_is_checked() {
    let enable = "enable = { on = { ENABLE = 1 }, off = { ENABLE = 0 } }\n";
    refused(&[
        (
            &[("[[command.message]]", "[[@@command.message]]"), (", hazard = { TURN_REQ = 3 }", "")],
            "command",
            "no message asks for hazard lights",
            "emergency",
        ),
        (
            &[(enable, "idle = @@\"neutral\"\n"), ("{ DOOR = 0 }", "{ DOOR = 0, ENABLE = 1 }")],
            "command.message[1].idle",
            "nothing in this message says that nothing is asked for",
            "idle = \"silent\"",
        ),
        (
            &[("right = { TURN_REQ = 2 }", "right = @@{ TURN_REQ = 1 }")],
            "command.message[1].turn.right",
            "another state of the group has the same values",
            "values of its own",
        ),
        (
            &[("hazard = { TURN_REQ = 3 }", "hazard = { TURN_REQ = 3 }, none = @@{ TURN_REQ = 1 }")],
            "command.message[1].turn.none",
            "the same values",
            "only `none` may be the same as `off`",
        ),
        (
            &[("off = { ENABLE = 0 }", "off = @@{ ENABLE = 1 }")],
            "command.message[1].enable.off",
            "the same values",
            "values of its own",
        ),
        (
            &[
                NAMED,
                ("hazard = { TURN_REQ = 3 }", "hazard = { TURN_REQ = 3 }, none = { TURN_REQ = 0 }"),
                (
                    "constants = { DOOR = 0 }",
                    "hazard = { off = { DOOR = 0 }, on = { DOOR = 1 }, none = { DOOR = 0 } }",
                ),
            ],
            "command.message[1].name",
            "hazard lights in two ways",
            "remove",
        ),
        (
            &[
                NAMED,
                (", hazard = { TURN_REQ = 3 }", ""),
                ("constants = { DOOR = 0 }", "hazard = { off = { DOOR = 0 }, on = { DOOR = 1 } }"),
            ],
            "command.message[1].name",
            "share this message",
            "`none` each",
        ),
    ]);
}

#[test]
fn buttons_are_checked() {
    let none = (", hazard = { TURN_REQ = 3 }", ", none = { TURN_REQ = 7 }");
    let door = "constants = { DOOR = 0 }";
    let key = "command.message[1].hazard.button";
    refused(&[
        (
            &[
                none,
                (
                    door,
                    "hazard = { off = { DOOR = 0 }, on = { DOOR = 1 }, none = { DOOR = 0 }, button = { press_ms = @@99 } }",
                ),
            ],
            "command.message[1].hazard.button.press_ms",
            "99 ms is out of range",
            "100 to 60000 ms",
        ),
        (
            &[
                none,
                (
                    door,
                    "hazard = { off = { DOOR = 0 }, on = { DOOR = 1 }, none = { DOOR = 0 }, button = { attempts = @@0 } }",
                ),
            ],
            "command.message[1].hazard.button.attempts",
            "0 is out of range",
            "1 to 255",
        ),
    ]);
    let button = "hazard = { off = { DOOR = 0 }, on = { DOOR = 1 }, none = { DOOR = 0 }, button = {} }";
    let mut texts = sound();
    let command = COMMAND.replace(none.0, none.1).replace(door, button);
    let profile = texts.text("car.toml");
    let (lights, _) = profile.split_once(PLACE).unwrap();
    let profile = format!("{lights}{command}from = \"unbound\"\n");
    texts.insert("car.toml", profile);
    let problems = load_texts(&texts).unwrap_err();
    let [problem] = problems.as_slice() else { panic!("{problems:?}") };
    assert!(problem.key == key && problem.reason.contains("[hazard] binds no signal"), "{problem}");
}

#[test]
fn what_the_gateway_sends_is_not_what_it_receives() {
    let own = "[[command.driver]]\nsignal = \"LAMP_CMD.DOOR\"\non = [1]\noff = [0]\n[message.LAMP_CMD]\ntimeout_ms = 100\n[hazard]\n";
    refused(&[(
        &[NAMED, (PLACE, own)],
        "command.message[1].name",
        "is received as well",
        "the vehicle sends",
    )]);
    let mut texts = sound();
    let profile = texts.text("car.toml").replace(PLACE, COMMAND);
    let profile =
        profile.replace("dbc = \"car.dbc\"", "dbc = \"car.dbc\"\nheartbeat_messages = [\"LAMP_CMD\"]");
    texts.insert("car.toml", profile);
    let problems = load_texts(&texts).unwrap_err();
    let [problem] = problems.as_slice() else { panic!("{problems:?}") };
    assert_eq!(
        problem.to_string(),
        "car.toml:4:23: bus.body.heartbeat_messages[1]: LAMP_CMD is sent by the gateway itself; name messages that the vehicle sends"
    );
}

#[test]
fn the_section_of_the_gateway_is_checked() {
    let mut texts = sound();
    let profile = texts.text("car.toml").replace(PLACE, COMMAND);
    texts.insert("car.toml", profile);
    let rows = [
        ("tx = @@\"maybe\"", "command.tx", "unknown value \"maybe\"", "off, on"),
        ("source = @@\"can\"", "command.source", "unknown value \"can\"", "topic, decider"),
        ("source = @@\"decider\"", "command.source", "no decider that commands", "enabled = true"),
        ("turn_timeout_ms = @@0", "command.turn_timeout_ms", "0 ms is out of range", "1 to 3600000"),
        (
            "hazard_timeout_ms = @@3600001",
            "command.hazard_timeout_ms",
            "3600001 ms is out of range",
            "1 to 3600000",
        ),
        (
            "warn_after_ms = 500\nerror_after_ms = @@400",
            "command.error_after_ms",
            "before its warning",
            "at least 500 ms",
        ),
        (
            "control_mode = @@\"signal\"",
            "command.control_mode",
            "binds no signal for the control mode",
            "[command.control_mode]",
        ),
        ("topics.control_mode = @@\"mode\"", "command.topics.control_mode", "not an absolute topic", "/a/b"),
        (
            "on_turn_timeout = @@\"on\"",
            "command.on_turn_timeout",
            "unknown value \"on\"",
            "off, hold, hazard",
        ),
    ];
    for (keys, key, reason, remedy) in rows {
        let mut texts = texts.clone();
        let gateway = texts.text("gateway.toml");
        let (gateway, position) = spoil(gateway, "[reports]\n", &format!("[command]\n{keys}\n[reports]\n"));
        texts.insert("gateway.toml", gateway);
        let problems = load_texts(&texts).unwrap_err();
        let [problem] = problems.as_slice() else { panic!("{keys}: {problems:?}") };
        assert_eq!((problem.position, problem.key.as_str()), (Some(position), key), "{keys}");
        assert!(problem.reason.contains(reason) && problem.remedy.contains(remedy), "{keys}: {problem}");
    }
    let mut silent = sound();
    let gateway = silent.text("gateway.toml").to_owned() + "[command]\n";
    silent.insert("gateway.toml", gateway);
    let problems = load_texts(&silent).unwrap_err();
    assert!(problems[0].reason.contains("the vehicle profile has no [command]"), "{problems:?}");
}
