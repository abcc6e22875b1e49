//! States of stories, groups of maneuvers and maneuvers.

use traffic_lights::compat::Compat::{Improved, Upstream};

use super::variables::starts;
use super::{read_text, shown};

const ENTITY: &str = "<ByEntityCondition><EntityCondition><SpeedCondition value=\"1\" rule=\"greaterThan\"/>\
     </EntityCondition></ByEntityCondition>";

fn at(seconds: &str) -> String {
    format!(
        "<ByValueCondition><SimulationTimeCondition value=\"{seconds}\" rule=\"greaterOrEqual\"/></ByValueCondition>"
    )
}

fn reaches(kind: &str, name: &str, state: &str) -> String {
    format!(
        "<ByValueCondition><StoryboardElementStateCondition storyboardElementType=\"{kind}\" \
         storyboardElementRef=\"{name}\" state=\"{state}\"/></ByValueCondition>"
    )
}

fn event(name: &str, condition: &str) -> String {
    format!(
        "<Event name=\"{name}\"><Action name=\"x\"><UserDefinedAction><CustomCommandAction \
         type=\"ClearTrafficSignal(21)\"/></UserDefinedAction></Action><StartTrigger><ConditionGroup>\
         <Condition name=\"c\">{condition}</Condition></ConditionGroup></StartTrigger></Event>\n"
    )
}

/// A story whose act starts at 1 s, with a group of two maneuvers that end at 2 and 3 s, and a story that
/// watches.
fn document(last: &str, watching: &str) -> String {
    let maneuvers = format!(
        "<Maneuver name=\"first\">{}</Maneuver><Maneuver name=\"second\">{}</Maneuver>",
        event("e1", &at("2")),
        event("e2", last)
    );
    format!(
        "<OpenSCENARIO><Storyboard><Story name=\"watched\"><Act name=\"act\"><ManeuverGroup name=\"group\">\
         {maneuvers}</ManeuverGroup><StartTrigger><ConditionGroup><Condition name=\"t\">{}</Condition>\
         </ConditionGroup></StartTrigger></Act></Story><Story name=\"watching\"><Act name=\"b\">\
         <ManeuverGroup name=\"g\"><Maneuver name=\"m\">{watching}</Maneuver></ManeuverGroup></Act></Story>\
         </Storyboard></OpenSCENARIO>",
        at("1")
    )
}

#[test]
fn a_story_runs_from_the_start_a_maneuver_from_its_act_until_its_events_are_complete() {
    let watching: String = [
        ("story runs", "story", "watched", "runningState"),
        ("story ends", "story", "watched", "completeState"),
        ("group starts", "maneuverGroup", "group", "startTransition"),
        ("group ends", "maneuverGroup", "group", "endTransition"),
        ("first ends", "maneuver", "first", "completeState"),
        ("second runs", "maneuver", "second", "runningState"),
        ("second ends", "maneuver", "second", "completeState"),
        ("itself runs", "maneuver", "m", "runningState"),
    ]
    .map(|(name, kind, element, state)| event(name, &reaches(kind, element, state)))
    .concat();
    let expected = [
        ("story runs", 0),
        ("itself runs", 0),
        ("group starts", 10),
        ("second runs", 10),
        ("e1", 20),
        ("first ends", 20),
        ("e2", 30),
        ("story ends", 30),
        ("group ends", 30),
        ("second ends", 30),
    ];
    for compat in [Improved, Upstream] {
        let (starts, left_out) = starts(compat, "s.xosc", &document(&at("3"), &watching));
        assert_eq!(starts, expected.map(|(name, at)| (name.to_owned(), at)), "{compat:?}");
        assert_eq!(left_out, "");
    }
}

#[test]
fn the_state_of_an_element_of_which_a_part_is_left_out_is_not_known() {
    for (kind, element, is_known) in [
        ("story", "watched", false),
        ("maneuverGroup", "group", false),
        ("maneuver", "second", false),
        ("maneuver", "first", true),
    ] {
        let watching = event("watch", &reaches(kind, element, "completeState"));
        let (starts, left_out) = starts(Improved, "s.xosc", &document(ENTITY, &watching));
        assert_eq!(starts.iter().any(|(name, _)| name == "watch"), is_known, "{kind} {element}");
        let waits = format!("\"watch\": its trigger waits for \"{element}\", which is not interpreted");
        assert_eq!(left_out.contains(&waits), !is_known, "{left_out}");
    }
}

#[test]
fn an_element_of_another_type_is_taken_by_its_name_and_the_type_is_listed() {
    for (kind, element, tenths) in
        [("event", "first", 20), ("action", "e2", 30), ("maneuver", "e2", 30), ("event", "act", 30)]
    {
        let watching = event("watch", &reaches(kind, element, "completeState"));
        for compat in [Improved, Upstream] {
            let (starts, left_out) = starts(compat, "s.xosc", &document(&at("3"), &watching));
            let watched = starts.iter().find(|(name, _)| name == "watch").map(|(_, at)| *at);
            assert_eq!(watched, Some(tenths), "{kind} {element} {compat:?}");
            let listed = format!("not interpreted: the type {kind}, since {element:?} has the type ");
            assert!(left_out.contains(&listed), "{left_out}");
        }
    }
}

#[test]
fn an_event_may_be_called_like_its_action_and_its_maneuver() {
    for kind in ["event", "action", "maneuver", "act"] {
        let watching = event("watch", &reaches(kind, "second", "completeState"));
        let text = document(&at("3"), &watching).replace(
            "<Event name=\"e2\"><Action name=\"x\">",
            "<Event name=\"second\"><Action name=\"second\">",
        );
        let (starts, left_out) = starts(Improved, "s.xosc", &text);
        assert_eq!(starts.iter().find(|(name, _)| name == "watch").map(|(_, at)| *at), Some(30), "{kind}");
        let is_listed = left_out.contains("the type act, since \"second\" has the type event");
        assert_eq!(is_listed, kind == "act", "{left_out}");
    }
}

#[test]
fn a_name_that_only_elements_of_other_types_have_in_several_places_is_refused() {
    let watching = event("watch", &reaches("story", "x", "completeState"));
    let refused = shown(&read_text("s.xosc", &document(&at("3"), &watching)).unwrap_err());
    assert!(refused.contains("there is no story \"x\"") && refused.contains("the type action"), "{refused}");
}

#[test]
fn a_time_rises_in_the_first_frame_but_not_where_it_was_true_before() {
    let rising = |rule: &str, value: &str, delay: &str| {
        let time = format!(
            "<ByValueCondition><SimulationTimeCondition rule=\"{rule}\" value=\"{value}\"/></ByValueCondition>"
        );
        let attributes = format!("<Condition conditionEdge=\"rising\" delay=\"{delay}\" ");
        event("it", &time).replace("<Condition ", &attributes)
    };
    for (condition, tenths) in [
        (rising("greaterThan", "0", "0"), Some(0)),
        (rising("greaterThan", "0", "1"), Some(10)),
        (rising("greaterOrEqual", "0", "0"), None),
        (rising("greaterThan", "2", "0"), Some(20)),
    ] {
        for compat in [Improved, Upstream] {
            let began = starts(compat, "s.xosc", &document(&event("e2", &at("3")), &condition)).0;
            let at = began.iter().find(|(event, _)| event == "it").map(|(_, at)| *at);
            let expected = tenths.filter(|tenths| compat == Improved || *tenths == 20);
            assert_eq!(at, expected, "{condition}");
        }
    }
}
