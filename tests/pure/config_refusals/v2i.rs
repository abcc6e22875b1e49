//! What is refused of traffic-light states over CAN.

use crate::pure::config_refusals::{Spoilt, assert_refused, load_texts, row, sound, spoil};

const SEE: &str = "see config/gateway.toml";
const PLACE: &str = "[hazard]\n";

/// What stands in front of `[hazard]`.
fn refused(rows: &[(&'static str, &'static str, &'static str, &'static str)]) {
    let rows: Vec<Spoilt> =
        rows.iter().map(|(new, key, reason, remedy)| row(PLACE, new, key, reason, remedy)).collect();
    assert_refused("car.toml", &rows);
}

/// One group with a signal of its own; `@@` marks the place, and what comes behind it is spoilt.
macro_rules! one {
    ($text:literal) => {
        concat!("[message.SPAT]\ntimeout_ms = 500\n", $text, "\n[hazard]\n")
    };
}

/// A message of many groups.
macro_rules! many {
    ($text:literal) => {
        concat!(
            "[message.SPAT]\ntimeout_ms = 500\n[[v2i]]\nstates = \"movement_phase_state\"\n",
            $text,
            "\n[hazard]\n"
        )
    };
}

#[test]
fn both_forms_are_accepted() {
    for text in [
        one!("[[v2i]]\nid = -7\nsignal = \"SPAT.STATE\"\nstates = { \"red, green right\" = [1] }"),
        many!(
            "signal = \"SPAT.STATE\"\nintersection = \"SPAT.PLACE\"\ngroup = \"SPAT.GROUP\"\n\
             group_timeout_ms = 900\ngroups = [{ intersection = 1, group = 2, id = 7, arrow = \"left\" }]"
        ),
    ] {
        let mut texts = sound();
        let (text, _) = spoil(texts.text("car.toml"), PLACE, text);
        texts.insert("car.toml", text);
        let settings = load_texts(&texts).unwrap_or_else(|problems| panic!("{problems:?}"));
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
    refused(&[
        (
            one!("@@[[v2i]]\nsignal = \"SPAT.STATE\"\nstates = { red = [1] }"),
            "v2i[1]",
            "neither `id` nor `groups`",
            "give `id` for one group",
        ),
        (
            one!("[[v2i]]\nid = @@0\nsignal = \"SPAT.STATE\"\nstates = { red = [1] }"),
            "v2i[1].id",
            "0 is not an id",
            "regulatory element",
        ),
        (
            one!("[[v2i]]\nid = @@\"7\"\nsignal = \"SPAT.STATE\"\nstates = { red = [1] }"),
            "v2i[1].id",
            "expected a number, found the text \"7\"",
            "give",
        ),
        (
            one!("[[v2i]]\nid = @@7.5\nsignal = \"SPAT.STATE\"\nstates = { red = [1] }"),
            "v2i[1].id",
            "expected a whole number, found 7.5",
            "give",
        ),
        (
            one!(
                "[[v2i]]\nid = 7\nsignal = \"SPAT.STATE\"\nstates = { red = [1] }\n\
                 [[v2i]]\nid = @@7\nsignal = \"SPAT.SHORT\"\nstates = { red = [1] }"
            ),
            "v2i[2].id",
            "7 appears twice",
            "give each id one signal",
        ),
        (
            one!(
                "[[v2i]]\nid = 7\nsignal = \"SPAT.STATE\"\nstates = { red = [1] }\n\
                 @@group = \"SPAT.GROUP\""
            ),
            "v2i[1].group",
            "unknown key \"group\" with `id`",
            "known here are confidence, status, arrow, signal",
        ),
        (
            one!("[[v2i]]\nid = 7\nsignal = \"SPAT.STATE\"\nstates = { red = [1] }\n@@color = 1"),
            "v2i[1].color",
            "unknown key \"color\" with `id`",
            "known here are",
        ),
    ]);
}

#[test]
fn states_without_one_meaning_are_refused() {
    refused(&[
        (
            one!("[[v2i]]\nid = 7\nsignal = @@\"SPAT.STATUS\"\nstates = { red = [1] }"),
            "v2i[1].signal",
            "SPAT has no signal STATUS",
            "it has PLACE, GROUP, STATE",
        ),
        (
            one!("[[v2i]]\nid = 7\nsignal = \"SPAT.STATE\"\nstates = { red = [1, 2], green = [@@2] }"),
            "v2i[1].states.green[1]",
            "2 overlaps 2",
            "give each raw value one meaning",
        ),
        (
            one!("[[v2i]]\nid = 7\nsignal = \"SPAT.STATE\"\nstates = { red = [1] }\nfault = [@@\"0..=3\"]"),
            "v2i[1].fault[1]",
            "0..=3 overlaps 1",
            "give each raw value one meaning",
        ),
        (
            one!("[[v2i]]\nid = 7\nsignal = \"SPAT.STATE\"\nstates = { red = [@@16] }"),
            "v2i[1].states.red[1]",
            "STATE cannot hold 16",
            "0 to 15",
        ),
        (
            one!("[[v2i]]\nid = 7\nsignal = \"SPAT.STATE\"\nstates = { red = @@[] }"),
            "v2i[1].states.red",
            "no value is named",
            "at least one",
        ),
        (
            one!("[[v2i]]\nid = 7\nsignal = \"SPAT.STATE\"\nstates = @@{}"),
            "v2i[1].states",
            "no state is named",
            "\"red\" = [3]",
        ),
        (
            one!("[[v2i]]\nid = 7\nsignal = \"SPAT.STATE\"\nstates = { @@\"rot\" = [1] }"),
            "v2i[1].states.rot",
            "rot",
            "colour, status, shape",
        ),
        (
            one!("[[v2i]]\nid = 7\nsignal = \"SPAT.STATE\"\nstates = { @@\"unknown\" = [1] }"),
            "v2i[1].states.unknown",
            "a state from the network is known",
            "`not_available`",
        ),
        (
            one!("[[v2i]]\nid = 7\nsignal = \"SPAT.STATE\"\nstates = { @@\"\" = [1] }"),
            "v2i[1].states.\"\"",
            "at least one bulb",
            "solidOff",
        ),
        (
            one!("[[v2i]]\nid = 7\nsignal = \"SPAT.STATE\"\nstates = @@\"j2735\""),
            "v2i[1].states",
            "expected \"movement_phase_state\", or states with their raw values such as { \"red\" = [3] }, found the text \"j2735\"",
            SEE,
        ),
        (
            one!("[[v2i]]\nid = 7\nsignal = \"SPAT.STATE\"\nstates = @@3"),
            "v2i[1].states",
            "expected \"movement_phase_state\", or states with their raw values such as { \"red\" = [3] }, found 3",
            SEE,
        ),
        (
            one!(
                "[[v2i]]\nid = 7\nsignal = \"SPAT.STATE\"\nstates = \"movement_phase_state\"\n\
                 not_available = [@@0]"
            ),
            "v2i[1].not_available[1]",
            "0 overlaps 0",
            "give each raw value one meaning",
        ),
        (
            one!("[[v2i]]\nid = 7\nsignal = \"SPAT.STATE\"\nstates = { red = [1] }\narrow = @@\"left\""),
            "v2i[1].arrow",
            "the states themselves name the arrow",
            "movement_phase_state",
        ),
        (
            one!(
                "[[v2i]]\nid = 7\nsignal = \"SPAT.STATE\"\nstates = \"movement_phase_state\"\n\
                 arrow = @@\"circle\""
            ),
            "v2i[1].arrow",
            "\"circle\" is not an arrow",
            "right, up, upperRight",
        ),
    ]);
}

#[test]
fn a_confidence_or_status_that_cannot_be_read_is_refused() {
    refused(&[
        (
            one!(
                "[[v2i]]\nid = 7\nsignal = \"SPAT.STATE\"\nstates = { red = [1] }\n\
                 confidence = { signal = \"SPAT.SURE\", full = @@0 }"
            ),
            "v2i[1].confidence.full",
            "0 is out of range",
            "give 1 to",
        ),
        (
            one!(
                "[[v2i]]\nid = 7\nsignal = \"SPAT.STATE\"\nstates = { red = [1] }\n\
                 confidence = { signal = \"SPAT.SURE\", full = @@128 }"
            ),
            "v2i[1].confidence.full",
            "SURE cannot hold 0..=128",
            "0 to 127",
        ),
        (
            one!(
                "[[v2i]]\nid = 7\nsignal = \"SPAT.STATE\"\nstates = { red = [1] }\n\
                 [[v2i.status]]\nsignal = \"SPAT.SHORT\"\ngood = @@[]\nbad = [1]"
            ),
            "v2i[1].status[1].good",
            "no value is named",
            "at least one",
        ),
        (
            one!(
                "[[v2i]]\nid = 7\nsignal = \"SPAT.STATE\"\nstates = { red = [1] }\n\
                 [[v2i.status]]\nsignal = \"SPAT.SHORT\"\ngood = [1]\nbad = [@@1]"
            ),
            "v2i[1].status[1].bad[1]",
            "1 overlaps 1",
            "one meaning",
        ),
    ]);
}

#[test]
fn messages_of_many_groups_that_cannot_be_told_apart_are_refused() {
    refused(&[
        (
            "[message.SPAT]\ntimeout_ms = 500\n@@[[v2i]]\nsignal = \"SPAT.STATE\"\n\
             states = { red = [1] }\nintersection = \"SPAT.PLACE\"\ngroup = \"SPAT.GROUP\"\n[hazard]\n",
            "v2i[1]",
            "keys are missing: groups, group_timeout_ms",
            "give `id` for one group",
        ),
        (
            many!(
                "signal = \"SPAT.STATE\"\nintersection = \"SPAT.PLACE\"\ngroup = \"SPAT.GROUP\"\n\
                 group_timeout_ms = 900\ngroups = @@[]"
            ),
            "v2i[1].groups",
            "no group is mapped",
            "intersection = 1",
        ),
        (
            many!(
                "signal = \"SPAT.STATE\"\nintersection = \"SPAT.PLACE\"\ngroup = \"SPAT.GROUP\"\n\
                 group_timeout_ms = @@0\ngroups = [{ intersection = 1, group = 2, id = 7 }]"
            ),
            "v2i[1].group_timeout_ms",
            "0 ms is out of range",
            "1 to 3600000 ms",
        ),
        (
            many!(
                "signal = \"SPAT.STATE\"\nintersection = \"SPAT.PLACE\"\ngroup = \"SPAT.GROUP\"\n\
                 group_timeout_ms = 900\ngroups = [{ intersection = 1, group = @@16, id = 7 }]"
            ),
            "v2i[1].groups[1].group",
            "GROUP cannot hold 16",
            "0 to 15",
        ),
        (
            many!(
                "signal = \"SPAT.STATE\"\nintersection = \"SPAT.PLACE\"\ngroup = \"SPAT.GROUP\"\n\
                 group_timeout_ms = 900\n\
                 groups = [{ intersection = 1, group = 2, id = 7 }, @@{ intersection = 1, group = 2, id = 8 }]"
            ),
            "v2i[1].groups[2]",
            "group 2 of intersection 1 is mapped twice",
            "one id",
        ),
        (
            many!(
                "signal = \"SPAT.STATE\"\nintersection = \"SPAT.PLACE\"\ngroup = \"SPAT.GROUP\"\n\
                 group_timeout_ms = 900\n\
                 groups = [{ intersection = 1, group = 2, id = 7 }, { intersection = 1, group = 3, id = @@7 }]"
            ),
            "v2i[1].groups[2].id",
            "7 appears twice",
            "one signal",
        ),
        (
            many!(
                "signal = \"SPAT.STATE\"\nintersection = @@\"BLINK.TILT\"\ngroup = \"SPAT.GROUP\"\n\
                 group_timeout_ms = 900\ngroups = [{ intersection = 1, group = 2, id = 7 }]"
            ),
            "v2i[1].intersection",
            "the state comes in another message",
            "signals of one message",
        ),
        (
            many!(
                "signal = @@\"SPAT.NEXT\"\nintersection = \"SPAT.PLACE\"\ngroup = \"SPAT.GROUP\"\n\
                 group_timeout_ms = 900\ngroups = [{ intersection = 1, group = 2, id = 7 }]"
            ),
            "v2i[1].signal",
            "SPAT.NEXT is not in each frame",
            "`id` of its own",
        ),
        (
            many!(
                "signal = \"SPAT.STATE\"\nintersection = \"SPAT.PLACE\"\ngroup = \"SPAT.GROUP\"\n\
                 group_timeout_ms = 900\narrow = @@\"left\"\n\
                 groups = [{ intersection = 1, group = 2, id = 7 }]"
            ),
            "v2i[1].arrow",
            "each group has its own arrow",
            "entries of `groups`",
        ),
    ]);
}
