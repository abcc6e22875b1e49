//! Refusals of the bench format.

use signal_gateway::core::compat::Compat;

use crate::pure::scenario_refusals::{Row, assert_refused, read_text};

const SEE: &str = "config/scenarios/bench.toml";

fn refused(front: &str, rows: &[Row<'_>]) {
    let rows: Vec<_> = rows.iter().map(|row| (format!("{front}{}", row.0), *row)).collect();
    assert_refused(Compat::Improved, "s.toml", &rows);
}

#[test]
fn broken_tables_are_refused_at_their_keys() {
    #[rustfmt::skip]
    let rows: &[Row<'_>] = &[
        ("@@maps = 'x'", "maps", "unknown key \"maps\"", "did you mean map?"),
        ("a = @@@@= 1", "", "", SEE),
        ("map = @@['x']", "map", "expected a single value, found a list", SEE),
        ("map = @@'x'\ngroups = { 1 = [2] }", "map", "both a map and groups", "keep one"),
        ("groups = @@[1]", "groups", "expected a table, found a list", "100 = [11, 12]"),
        ("groups = { @@x = [2] }", "groups.x", "`x` is not an id", "relation id"),
        ("groups = { 1 = [2, @@'x'] }", "groups.1[2]", "`x` is not an id", "relation id"),
        ("groups = { 1 = [@@9223372036854775808] }", "groups.1[1]", "is not an id", "relation id"),
        ("groups = { @@1 = [] }", "groups.1", "a group without heads", "way ids"),
        ("pedestrian_groups = [@@1]", "pedestrian_groups[1]", "1 is not one of the groups", "name one"),
        ("stop_at_s = @@'5'", "stop_at_s", "expected a number, found the text \"5\"", "without quotes"),
        ("stop_at_s = @@-1", "stop_at_s", "-1 s", "0 or more"),
        ("stop_at_s = @@5\nstop_when = { after_s = 5 }", "stop_at_s", "both stop_at_s and stop_when", "keep one"),
        ("controller = @@1", "controller", "expected a list, found", "[[controller]]"),
        ("controller = [@@1]", "controller[1]", "expected a table, found", SEE),
        ("@@[[controller]]\ndelay_s = 1", "controller[1]", "missing key: name", SEE),
        ("[[controller]]\nname = 'B'\ndelay_s = @@1", "controller[1].delay_s", "delay without a reference", "name the"),
        ("[[controller]]\nname = 'B'\n@@phases = 1", "controller[1].phases", "unknown key", "did you mean phase?"),
    ];
    refused("", rows);
}

#[test]
fn broken_phases_are_refused_at_their_keys() {
    let front = "[[controller]]\nname = 'A'\n[[controller.phase]]\nname = 'go'\n";
    #[rustfmt::skip]
    let rows: &[Row<'_>] = &[
        ("duration_s = @@-1", "controller[1].phase[1].duration_s", "-1 s", "0 or more"),
        ("duration_s = @@nan", "phase[1].duration_s", "\"nan\" is not a number", "2.5"),
        ("duration_s = @@1e300", "phase[1].duration_s", "1e300 s is out of range", "1e9"),
        ("duration_s = @@1979-05-27", "phase[1].duration_s", "is not a number", "2.5"),
        ("states = @@'red'", "phase[1].states", "expected a table, found the text \"red\"", "green"),
        ("states = [@@['21']]", "states[1]", "expected a target and its state, found a list", "[target, state]"),
        ("states = [@@'21']", "states[1]", "expected a target and its state, found the text \"21\"", "[target, state]"),
        ("states = [['21', @@'blue']]", "states[1][2]", "`blue`", ""),
        ("states = { @@\"21 V2I\" = 'red' }", "states.\"21 V2I\"", "not a channel", "34802 v2i"),
        ("states = { \"21\" = @@'red unknown' }", "states.21", "unknown", ""),
        ("states = { \"21\" = @@['red'] }", "states.21", "expected a single value", SEE),
    ];
    refused(front, rows);
}

#[test]
fn broken_events_are_refused_at_their_keys() {
    let front = "[[controller]]\nname = 'A'\nphase = [{ name = 'go' }]\n[[event]]\n";
    #[rustfmt::skip]
    let rows: &[Row<'_>] = &[
        ("do = @@5", "event[1].do", "expected a table, found 5", SEE),
        ("do = @@{ state = 'red' }", "event[1].do", "an action does exactly one thing", "set, clear"),
        ("do = @@{ set = '1', clear = '1', state = 'red' }", "event[1].do", "exactly one thing", "set, clear"),
        ("do = @@{ set = '1' }", "event[1].do", "missing key: state", SEE),
        ("do = { set = '1', state = @@'unknown' }", "event[1].do.state", "conventional_detected", ""),
        ("do = [{ clear = '1' }, { clear = @@'x' }]", "event[1].do[2].clear", "not an id", "34802"),
        ("do = { enter = @@'B', phase = 'go' }", "event[1].do.enter", "no controller", "there are A"),
        ("do = { enter = 'A', phase = @@'went' }", "event[1].do.phase", "no phase \"went\"", "there are go"),
        ("do = { enable_v2i = @@[] }", "event[1].do.enable_v2i", "no id is given", "way or relation"),
        ("do = { disable_v2i = [@@99999999999999999999] }", "disable_v2i[1]", "is not an id", "way or relation"),
        ("do = { v2i_rate_hz = @@0 }", "event[1].do.v2i_rate_hz", "0 Hz is out of range", "0.001 to 1000"),
        ("do = { v2i_rate_hz = @@inf }", "event[1].do.v2i_rate_hz", "inf Hz", "0.001 to 1000"),
        ("do = { confidence = @@1.1, of = '1' }", "event[1].do.confidence", "1.1 is out of range", "0 to 1"),
        ("do = @@{ confidence = 1 }", "event[1].do", "missing key: of", SEE),
        ("do = { end = @@'well' }", "event[1].do.end", "unknown value \"well\"", "success"),
        ("do = { end = 'success', @@off = 1 }", "event[1].do.off", "unknown key \"off\"", "valid keys: end"),
        ("times = @@0\ndo = { end = 'success' }", "event[1].times", "0 is out of range", "give 1 to"),
        ("times = @@1.5\ndo = { end = 'success' }", "event[1].times", "expected a whole number, found 1.5", "give 1 to"),
        ("at_s = @@1\nwhen = { after_s = 1 }\ndo = []", "event[1].at_s", "both at_s and when", "keep one"),
        ("when = @@[]\ndo = []", "event[1].when", "no condition", "at least one"),
        ("when = @@{ any = [] }\ndo = []", "event[1].when", "no condition", "at least one"),
        ("when = @@{ phase = 'go' }\ndo = []", "event[1].when", "exactly one thing", "after_s"),
        ("when = { after_s = @@-1 }\ndo = []", "event[1].when.after_s", "-1 s", "0 or more"),
        ("when = { after_s = 1, edge = @@'up' }\ndo = []", "event[1].when.edge", "\"up\"", "rising"),
        ("when = { after_s = 1, delay_s = @@-1 }\ndo = []", "event[1].when.delay_s", "-1 s", "0 or more"),
        ("when = [{ event = @@'x' }]\ndo = []", "event[1].when[1].event", "no event is called \"x\"", "none"),
        ("name = 'x'\nwhen = { event = 'x', is = @@'over' }\ndo = []", "event[1].when.is", "\"over\"", "complete"),
        ("when = { light = '1', state = @@'blue' }\ndo = []", "event[1].when.state", "blue", ""),
        ("when = { light = '1', state = 'red', exact = @@1 }\ndo = []", "event[1].when.exact", "expected true or false, found 1", SEE),
        ("name = 'x'\ndo = []\n[[event]]\nname = @@'x'\ndo = []", "event[2].name", "second event \"x\"", "its own name"),
    ];
    refused(front, rows);
    let missing = ("@@[[event]]\nat_s = 1", "event[1]", "missing key: do", "clear");
    refused("", &[missing]);
}

#[test]
fn yaml_is_for_open_scenario_only() {
    let row: Row<'_> = ("@@map: x", "", "the key OpenSCENARIO is missing", "our own form in TOML");
    assert_refused(Compat::Improved, "s.yaml", &[(row.0.to_owned(), row)]);
}

#[test]
fn all_problems_of_a_file_come_at_once() {
    let text = "stop_at_s = -1\nx = 1\n[[event]]\ndo = [{ clear = 'x' }, { v2i_rate_hz = 0 }]\n";
    let problems = read_text("s.toml", text).unwrap_err();
    let keys: Vec<_> = problems.iter().map(|problem| &*problem.key).collect();
    assert_eq!(keys, ["stop_at_s", "x", "event[1].do[1].clear", "event[1].do[2].v2i_rate_hz"]);
}
