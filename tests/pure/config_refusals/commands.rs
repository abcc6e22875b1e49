//! What is refused of commands to the vehicle, in the profile and in the gateway's file.

use crate::pure::config_refusals::{HAZARD, HERE, assert_refused, sound, with};

/// A command message for both lights.
const COMMAND: &str = r#"[[command.message]]
name = "LAMP_CMD"
period_ms = 100
enable = { on = { ENABLE = 1 }, off = { ENABLE = 0 } }
constants = { DOOR = 0 }
counter = { signal = "CMD_COUNT" }
checksum = { kind = "sum8", signal = "CMD_SUM" }
turn.off = { TURN_REQ = 0 }
turn.left = { TURN_REQ = 1 }
turn.right = { TURN_REQ = 2 }
turn.hazard = { TURN_REQ = 3 }
# here
"#;

/// A command message with a part for each of the lights.
const SEPARATE: &str = r#"[[command.message]]
name = "LAMP_CMD"
period_ms = 100
enable = { on = { ENABLE = 1 }, off = { ENABLE = 0 } }
hazard.off = { DOOR = 0 }
hazard.on = { DOOR = 1 }
hazard.none = { DOOR = 0 }
counter = { signal = "CMD_COUNT" }
checksum = { kind = "sum8", signal = "CMD_SUM" }
turn.off = { TURN_REQ = 0 }
turn.left = { TURN_REQ = 1 }
turn.right = { TURN_REQ = 2 }
turn.none = { TURN_REQ = 7 }
# here
"#;

#[test]
fn command_messages_are_checked_against_the_dbc() {
    let cases = r#"
- name = "LAMP_CMD"
+ name = "NONE"
> car.toml:7:8: command.message[1].name: car.dbc has no message NONE; name a message of the DBC
- turn.left = { TURN_REQ = 1 }
+ turn.left = { NONE = 1 }
> car.toml:14:15: command.message[1].turn.left.NONE: LAMP_CMD has no signal NONE; it has ENABLE, DOOR, TURN_REQ, CMD_COUNT, CMD_SUM
- turn.left = { TURN_REQ = 1 }
+ turn.left = { TURN_REQ = 8 }
> car.toml:14:26: command.message[1].turn.left.TURN_REQ: TURN_REQ cannot be 8; its raw values are 0 to 7
- constants = { DOOR = 0 }
+ constants = { DOOR = -1 }
> car.toml:10:22: command.message[1].constants.DOOR: DOOR cannot be -1; its raw values are 0 to 1
- constants = { DOOR = 0 }
+ constants = {}
> car.toml:10:13: command.message[1].constants: no signal is given; give signals with raw values, e.g. { TURN = 1 }
- turn.left = { TURN_REQ = 1 }
+ turn.left = { DOOR = 1 }
> car.toml:14:13: command.message[1].turn.left: this state sets other signals than the first of its group; give each state of a group the same signals, so that none keeps an old value
- constants = { DOOR = 0 }
+ constants = { DOOR = 0, ENABLE = 1 }
> car.toml:10:13: command.message[1].constants: these bits are set elsewhere in the message as well; set each bit once
- constants = { DOOR = 0 }
> car.toml:7:8: command.message[1].name: no value is given for DOOR; give each a raw value in `constants`
- counter = { signal = "CMD_COUNT" }
> car.toml:7:8: command.message[1].name: no value is given for CMD_COUNT; give each a raw value in `constants`
- constants = { DOOR = 0 }
- counter = { signal = "CMD_COUNT" }
+ constants = { DOOR = 0, CMD_COUNT = 0 }
+ counter = { signal = "ENABLE" }
> car.toml:11:22: command.message[1].counter.signal: the bits of ENABLE are set elsewhere as well; set each bit once
- counter = { signal = "CMD_COUNT" }
+ counter = { signal = "CMD_COUNT", increments_on = "changes" }
> car.toml:11:51: command.message[1].counter.increments_on: the counter of a command counts every frame; remove `increments_on`
- checksum = { kind = "sum8", signal = "CMD_SUM" }
+ checksum = { kind = "sum8", signal = "CMD_COUNT" }
> car.toml:12:38: command.message[1].checksum.signal: the checksum has 8 bits, but its signal has 4; bind the signal that holds the checksum
"#;
    assert_refused(&with("car.toml", HERE, COMMAND), "car.toml", cases);
}

#[test]
fn a_wrong_keyword_hides_no_contradiction_of_a_command_message() {
    let cases = r#"
- constants = { DOOR = 0 }
+ idle = "neutrl"
> car.toml:7:8: command.message[1].name: no value is given for DOOR; give each a raw value in `constants`
> car.toml:10:8: command.message[1].idle: unknown value "neutrl"; did you mean neutral?
- turn.hazard = { TURN_REQ = 3 }
+ idle = "neutrl"
> car.toml:6:3: command: no message requests the hazard lights; give one message `hazard`, or its `turn` a state `hazard`: Autoware's emergency needs them
> car.toml:16:8: command.message[1].idle: unknown value "neutrl"; did you mean neutral?
"#;
    assert_refused(&with("car.toml", HERE, COMMAND), "car.toml", cases);
}

#[test]
fn times_of_command_messages_are_checked() {
    let cases = r"
- period_ms = 100
+ period_ms = 5
> car.toml:8:13: command.message[1].period_ms: 5 ms is out of range; give 10 to 1000 ms
- period_ms = 100
> car.toml:7:8: command.message[1].name: no period for LAMP_CMD: the DBC has no usable GenMsgCycleTime for it; add period_ms
  period_ms = 100
+ min_send_interval_ms = 101
> car.toml:9:24: command.message[1].min_send_interval_ms: 101 ms is out of range; give 1 to 100 ms
  period_ms = 100
+ burst_gap_ms = 9
> car.toml:9:16: command.message[1].burst_gap_ms: 9 ms is out of range; give 10 to 100 ms
  period_ms = 100
+ burst = 0
> car.toml:9:9: command.message[1].burst: 0 frames is out of range; give 1 to 10 frames
  period_ms = 100
+ unused_bits = 2
> car.toml:9:15: command.message[1].unused_bits: 2 is out of range; give 0 to 1
";
    assert_refused(&with("car.toml", HERE, COMMAND), "car.toml", cases);
}

#[test]
fn states_of_command_messages_are_checked() {
    let cases = r#"
- turn.hazard = { TURN_REQ = 3 }
> car.toml:6:3: command: no message requests the hazard lights; give one message `hazard`, or its `turn` a state `hazard`: Autoware's emergency needs them
- enable = { on = { ENABLE = 1 }, off = { ENABLE = 0 } }
- constants = { DOOR = 0 }
+ idle = "neutral"
+ constants = { DOOR = 0, ENABLE = 1 }
> car.toml:9:8: command.message[1].idle: this message cannot express that nothing is requested; give `enable` or a state `none`, or idle = "silent"
- turn.right = { TURN_REQ = 2 }
+ turn.right = { TURN_REQ = 1 }
> car.toml:15:14: command.message[1].turn.right: another state of the group has the same values; give each state values of its own; only `none` may be the same as `off`
+ turn.none = { TURN_REQ = 1 }
> car.toml:17:13: command.message[1].turn.none: another state of the group has the same values; give each state values of its own; only `none` may be the same as `off`
- enable = { on = { ENABLE = 1 }, off = { ENABLE = 0 } }
+ enable = { on = { ENABLE = 1 }, off = { ENABLE = 1 } }
> car.toml:9:39: command.message[1].enable.off: another state of the group has the same values; give each state values of its own; only `none` may be the same as `off`
"#;
    assert_refused(&with("car.toml", HERE, COMMAND), "car.toml", cases);
    let cases = r"
+ turn.hazard = { TURN_REQ = 3 }
> car.toml:7:8: command.message[1].name: this message requests the hazard lights twice; remove the state `hazard` of `turn`, or the part `hazard`
- hazard.none = { DOOR = 0 }
> car.toml:7:8: command.message[1].name: turn indicators and hazard lights share this message, but are requested separately; give `turn` and `hazard` a state `none` each, which requests nothing
- turn.none = { TURN_REQ = 7 }
> car.toml:7:8: command.message[1].name: turn indicators and hazard lights share this message, but are requested separately; give `turn` and `hazard` a state `none` each, which requests nothing
";
    assert_refused(&with("car.toml", HERE, SEPARATE), "car.toml", cases);
}

#[test]
fn buttons_are_checked() {
    let cases = r"
+ hazard.button = { press_ms = 99 }
> car.toml:19:30: command.message[1].hazard.button.press_ms: 99 ms is out of range; give 100 to 60000 ms
+ hazard.button = { attempts = 0 }
> car.toml:19:30: command.message[1].hazard.button.attempts: 0 is out of range; give 1 to 255
";
    assert_refused(&with("car.toml", HERE, SEPARATE), "car.toml", cases);
    let unbound = with("car.toml", HAZARD, "from = \"unbound\"\n");
    let profile = unbound.text("car.toml").replace(HERE, SEPARATE);
    let cases = r"
+ hazard.button = {}
> car.toml:19:17: command.message[1].hazard.button: a button is pressed until the report shows the lights, but [hazard] binds no signal; bind one, or remove `button` when the switch stays
";
    assert_refused(&unbound.with("car.toml", profile), "car.toml", cases);
}

#[test]
fn messages_that_are_sent_cannot_be_received() {
    let cases = r#"
  right = [2]
+ [[command.driver]]
+ signal = "LAMP_CMD.DOOR"
+ on = [1]
+ off = [0]
+ [message.LAMP_CMD]
+ timeout_ms = 100
> car.toml:7:8: command.message[1].name: LAMP_CMD is received as well: the gateway's own frames would be taken for the vehicle's; bind signals of messages that the vehicle sends
  dbc = "car.dbc"
+ heartbeat_messages = ["LAMP_CMD"]
> car.toml:4:23: bus.body.heartbeat_messages[1]: LAMP_CMD is sent by the gateway itself; name messages that the vehicle sends
"#;
    assert_refused(&with("car.toml", HERE, COMMAND), "car.toml", cases);
}

#[test]
fn the_section_of_the_gateway_is_checked() {
    let cases = r#"
+ tx = "maybe"
> gateway.toml:9:6: command.tx: unknown value "maybe"; give one of off, on
+ source = "can"
> gateway.toml:9:10: command.source: unknown value "can"; give one of topic, decider
+ source = "decider"
> gateway.toml:9:10: command.source: the decider does not publish commands; add [turn_signal] enabled = true, or use "topic"
+ turn_timeout_ms = 0
> gateway.toml:9:19: command.turn_timeout_ms: 0 ms is out of range; give 1 to 3600000 ms
+ hazard_timeout_ms = 3600001
> gateway.toml:9:21: command.hazard_timeout_ms: 3600001 ms is out of range; give 1 to 3600000 ms
+ warn_after_ms = 500
+ error_after_ms = 400
> gateway.toml:10:18: command.error_after_ms: 400 ms is less than warn_after_ms; give at least 500 ms
+ control_mode = "signal"
> gateway.toml:9:16: command.control_mode: the vehicle profile binds no signal for the control mode; add [command.control_mode] there, or use "topic"
+ topics.control_mode = "/mode/"
> gateway.toml:9:23: command.topics.control_mode: "/mode/" is not a topic; write it as /a/b, a/b or ~/a
+ on_turn_timeout = "on"
> gateway.toml:9:19: command.on_turn_timeout: unknown value "on"; give one of off, hold, hazard
"#;
    let commands = with("car.toml", HERE, COMMAND);
    let gateway = commands.text("gateway.toml").replace(HERE, "[command]\n# here\n");
    assert_refused(&commands.with("gateway.toml", gateway), "gateway.toml", cases);
    let cases = r"
+ [command]
> gateway.toml:8:1: command: the vehicle profile has no [command], so no message can be sent; describe its command messages there
";
    assert_refused(&sound(), "gateway.toml", cases);
}
