//! What is refused of traffic-light states over CAN.

use crate::pure::config_refusals::{HERE, assert_refused, load_texts, sound, with};

/// One group with a signal of its own.
const ONE: &str = r#"[message.SPAT]
timeout_ms = 500
[[v2i]]
id = 7
signal = "SPAT.STATE"
states = { red = [1] }
# here
"#;

/// A message of many groups.
const MANY: &str = r#"[message.SPAT]
timeout_ms = 500
[[v2i]]
signal = "SPAT.STATE"
states = "movement_phase_state"
intersection = "SPAT.PLACE"
group = "SPAT.GROUP"
group_timeout_ms = 900
groups = [{ intersection = 1, group = 2, id = 7 }]
# here
"#;

#[test]
fn both_forms_are_accepted() {
    let one = ONE.replace("id = 7", "id = -7").replace("red =", "\"red, green right\" =");
    for form in [one, MANY.replace("id = 7", "id = 7, arrow = \"left\"")] {
        let settings = with("car.toml", HERE, &form).settings();
        assert_eq!(settings.gateway.v2i.sources.len(), 1);
    }
}

#[test]
fn a_profile_may_leave_the_lights_out_only_beside_v2i() {
    let without = |profile: &str| {
        let mut texts = sound();
        let head = "name = \"Car\"\nbus.body.dbc = \"car.dbc\"\n";
        texts.insert("car.toml", format!("{head}{profile}"));
        load_texts(&texts)
    };
    let v2i = "message.SPAT.timeout_ms = 500\n[[v2i]]\nid = 7\nsignal = \"SPAT.STATE\"\n\
               states = { red = [1] }\n";
    let settings = without(v2i).unwrap();
    assert!(settings.gateway.lights.table.messages.is_empty());
    assert_eq!(settings.gateway.v2i.table.messages.len(), 1);
    let problems = without("").unwrap_err();
    let reasons: Vec<_> = problems.iter().map(|problem| problem.reason.as_str()).collect();
    assert_eq!(reasons, ["missing section `turn`", "missing section `hazard`"]);
}

#[test]
fn groups_without_a_name_of_their_own_are_refused() {
    let cases = r#"
- id = 7
> car.toml:8:1: v2i[1]: neither `id` nor `groups` names the traffic light; give `id` for one group, or intersection, group, groups and group_timeout_ms for a message of many
- id = 7
+ id = 0
> car.toml:9:6: v2i[1].id: 0 is not an id; give the id of a regulatory element or of a light's way
- id = 7
+ id = "7"
> car.toml:9:6: v2i[1].id: expected a number, found the text "7"; write 7 without quotes
- id = 7
+ id = 7.5
> car.toml:9:6: v2i[1].id: expected a whole number, found 7.5; give a whole number
+ [[v2i]]
+ id = 7
+ signal = "SPAT.SHORT"
+ states = { red = [1] }
> car.toml:13:6: v2i[2].id: 7 appears twice; give each id one signal
+ group = "SPAT.GROUP"
> car.toml:12:1: v2i[1].group: unknown key "group" with `id`; valid keys: confidence, status, arrow, signal, not_available, fault, states, id
+ color = 1
> car.toml:12:1: v2i[1].color: unknown key "color" with `id`; valid keys: confidence, status, arrow, signal, not_available, fault, states, id
"#;
    assert_refused(&with("car.toml", HERE, ONE), "car.toml", cases);
}

#[test]
fn states_without_one_meaning_are_refused() {
    let cases = r#"
- signal = "SPAT.STATE"
+ signal = "SPAT.STATUS"
> car.toml:10:10: v2i[1].signal: SPAT has no signal STATUS; did you mean STATE?
- states = { red = [1] }
+ states = { red = [1, 2], green = [2] }
> car.toml:11:35: v2i[1].states.green[1]: 2 is given twice; give each raw value one meaning
+ fault = ["0..=3"]
> car.toml:12:10: v2i[1].fault[1]: 0..=3 overlaps 1; give each raw value one meaning
- states = { red = [1] }
+ states = { red = [16] }
> car.toml:11:19: v2i[1].states.red[1]: STATE cannot hold 16; its raw values are 0 to 15
- states = { red = [1] }
+ states = { red = [] }
> car.toml:11:18: v2i[1].states.red: no value is given; give at least one raw value
- states = { red = [1] }
+ states = {}
> car.toml:11:10: v2i[1].states: no state is given; name states with their raw values, e.g. { "red" = [3], "green" = [5] }
- states = { red = [1] }
+ states = { "rot" = [1] }
> car.toml:11:12: v2i[1].states.rot: `rot` at column 1 is not a part of a bulb; colours are green, Green, yellow, Yellow, amber, red, Red, white, unknown; statuses are solidOn, solidOff, Blank, none, flashing, unknown; shapes are circle, cross, left, right, up, straight, upperLeft, upperRight, down, lowerLeft, lowerRight, unknown; write bulbs as colour, status, shape, e.g. "red" or "red, green right"
- states = { red = [1] }
+ states = { "unknown" = [1] }
> car.toml:11:12: v2i[1].states.unknown: a state received over V2I cannot be unknown; put these values into `not_available`
- states = { red = [1] }
+ states = { "" = [1] }
> car.toml:11:12: v2i[1].states."": a state has at least one bulb; write "solidOff" for a dark light
- states = { red = [1] }
+ states = "j2735"
> car.toml:11:10: v2i[1].states: expected "movement_phase_state", or states with their raw values such as { "red" = [3] }, found the text "j2735"; see config/gateway.toml
- states = { red = [1] }
+ states = 3
> car.toml:11:10: v2i[1].states: expected "movement_phase_state", or states with their raw values such as { "red" = [3] }, found 3; see config/gateway.toml
- states = { red = [1] }
+ states = "movement_phase_state"
+ not_available = [0]
> car.toml:12:18: v2i[1].not_available[1]: 0 is given twice; give each raw value one meaning
+ arrow = "left"
> car.toml:12:9: v2i[1].arrow: states that are written out name their arrows themselves; remove it, or use states = "movement_phase_state"
- states = { red = [1] }
+ states = "movement_phase_state"
+ arrow = "circle"
> car.toml:12:9: v2i[1].arrow: "circle" is not an arrow; use one of right, up, upperRight, down, lowerRight, left, upperLeft, lowerLeft
"#;
    assert_refused(&with("car.toml", HERE, ONE), "car.toml", cases);
}

#[test]
fn a_confidence_or_status_that_cannot_be_read_is_refused() {
    let cases = r#"
+ confidence = { signal = "SPAT.SURE", full = 0 }
> car.toml:12:45: v2i[1].confidence.full: 0 is out of range; give 1 to 4294967295
+ confidence = { signal = "SPAT.SURE", full = 128 }
> car.toml:12:45: v2i[1].confidence.full: SURE cannot hold 0..=128; its raw values are 0 to 127
+ [[v2i.status]]
+ signal = "SPAT.SHORT"
+ good = []
+ bad = [1]
> car.toml:14:8: v2i[1].status[1].good: no value is given; give at least one raw value
+ [[v2i.status]]
+ signal = "SPAT.SHORT"
+ good = [1]
+ bad = [1]
> car.toml:15:8: v2i[1].status[1].bad[1]: 1 is given twice; give each raw value one meaning
"#;
    assert_refused(&with("car.toml", HERE, ONE), "car.toml", cases);
}

#[test]
fn messages_of_many_groups_that_cannot_be_distinguished_are_refused() {
    let cases = r#"
- states = "movement_phase_state"
+ states = { red = [1] }
  intersection = "SPAT.PLACE"
  group = "SPAT.GROUP"
- group_timeout_ms = 900
- groups = [{ intersection = 1, group = 2, id = 7 }]
> car.toml:8:1: v2i[1]: missing keys: groups, group_timeout_ms; give `id` for one group, or intersection, group, groups and group_timeout_ms for a message of many
- groups = [{ intersection = 1, group = 2, id = 7 }]
+ groups = []
> car.toml:14:10: v2i[1].groups: no group is given; add { intersection = 1, group = 1, id = … }
- group_timeout_ms = 900
+ group_timeout_ms = 0
> car.toml:13:20: v2i[1].group_timeout_ms: 0 ms is out of range; give 1 to 3600000 ms
- groups = [{ intersection = 1, group = 2, id = 7 }]
+ groups = [{ intersection = 1, group = 16, id = 7 }]
> car.toml:14:39: v2i[1].groups[1].group: GROUP cannot hold 16; its raw values are 0 to 15
- groups = [{ intersection = 1, group = 2, id = 7 }]
+ groups = [{ intersection = 1, group = 2, id = 7 }, { intersection = 1, group = 2, id = 8 }]
> car.toml:14:52: v2i[1].groups[2]: group 2 of intersection 1 is mapped twice; map each group to one id
- groups = [{ intersection = 1, group = 2, id = 7 }]
+ groups = [{ intersection = 1, group = 2, id = 7 }, { intersection = 1, group = 3, id = 7 }]
> car.toml:14:88: v2i[1].groups[2].id: 7 appears twice; give each id one signal
- intersection = "SPAT.PLACE"
+ intersection = "BLINK.TILT"
> car.toml:11:16: v2i[1].intersection: the state is in another message, so they may differ in age; bind signals of one message
- signal = "SPAT.STATE"
+ signal = "SPAT.NEXT"
> car.toml:9:10: v2i[1].signal: SPAT.NEXT is not in every frame of its message; bind a signal that is, or give it an `id` of its own
  group_timeout_ms = 900
+ arrow = "left"
> car.toml:14:9: v2i[1].arrow: each group has its own arrow; move it into the entries of `groups`
"#;
    assert_refused(&with("car.toml", HERE, MANY), "car.toml", cases);
}
