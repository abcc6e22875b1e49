//! Refusals of OpenSCENARIO, in XML and as TIER IV writes it.

use signal_gateway::core::compat::Compat;

use crate::pure::scenario_refusals::{Row, accepted, assert_refused, read_text};

/// A document with `network` in its `TrafficSignals` and `board` in its `Storyboard`.
pub(crate) fn document(network: &str, board: &str) -> String {
    format!(
        "<OpenSCENARIO><ParameterDeclarations><ParameterDeclaration name=\"p\" parameterType=\"string\" \
         value=\"21\"/></ParameterDeclarations>\n<RoadNetwork><TrafficSignals>\n{network}\n</TrafficSignals>\
         </RoadNetwork>\n<Storyboard>\n{board}\n</Storyboard></OpenSCENARIO>"
    )
}

/// A controller A with one phase go of 5 s.
pub(crate) const A: &str =
    "<TrafficSignalController name=\"A\"><Phase name=\"go\" duration=\"5\"/></TrafficSignalController>";

pub(crate) fn event(inner: &str) -> String {
    format!(
        "<Story name=\"s\"><Act name=\"a\"><ManeuverGroup name=\"g\"><Maneuver name=\"m\">\
         <Event name=\"e\">\n{inner}\n</Event></Maneuver></ManeuverGroup></Act></Story>"
    )
}

pub(crate) fn action(inner: &str) -> String {
    event(&format!("<Action name=\"x\">{inner}</Action>"))
}

pub(crate) fn light_action(inner: &str) -> String {
    action(&format!(
        "<GlobalAction><InfrastructureAction><TrafficSignalAction>\n{inner}\n</TrafficSignalAction>\
         </InfrastructureAction></GlobalAction>"
    ))
}

pub(crate) fn condition(inner: &str) -> String {
    event(&format!("<StartTrigger><ConditionGroup>{inner}</ConditionGroup></StartTrigger>"))
}

pub(crate) fn by_value(inner: &str) -> String {
    condition(&format!("<Condition name=\"c\"><ByValueCondition>\n{inner}\n</ByValueCondition></Condition>"))
}

fn refused(rows: &[Row<'_>], whole: impl Fn(&str) -> String) {
    let rows: Vec<_> = rows.iter().map(|row| (whole(row.0), *row)).collect();
    assert_refused(Compat::Improved, "s.xosc", &rows);
}

#[test]
fn controllers_and_phases_that_cannot_run_are_refused() {
    let state = "TrafficSignalState/@state";
    let id = "TrafficSignalState/@trafficSignalId";
    #[rustfmt::skip]
    let rows: &[Row<'_>] = &[
        ("@@<TrafficSignalController/>", "TrafficSignals/TrafficSignalController", "attribute name is missing", "requires it"),
        (r#"<TrafficSignalController name="B" delay="@@1"/>"#, "/@delay", "delay without a reference", "name the controller"),
        (r#"<TrafficSignalController name="B" reference="@@B"/>"#, "/@reference", "reference without a delay", "may be 0"),
        (r#"<TrafficSignalController name="B" reference="@@C" delay="0"/>"#, "/@reference", "no controller is called \"C\"", "there are B"),
        (r#"<TrafficSignalController name="B" reference="B" delay="@@-1"/>"#, "/@delay", "-1 s is out of range", "0 or more"),
        (r#"<TrafficSignalController name="B" reference="B" delay="@@inf"/>"#, "/@delay", "inf s is out of range", "1e9"),
        (r#"<TrafficSignalController name="B" reference="@@B" delay="0"/>"#, "/@reference", "\"B\" waits for itself", "without a reference"),
        (r#"<TrafficSignalController name="B" referense="@@A"/>"#, "/@referense", "has no attribute referense", "correct its name"),
        (r#"<TrafficSignalController name="B"><Phase name="p" duration="@@-0.1"/></TrafficSignalController>"#, "Phase/@duration", "-0.1 s", "0 or more"),
        (r#"<TrafficSignalController name="B"><Phase name="p"/><Phase name="p" duration="@@NaN"/></TrafficSignalController>"#, "Phase[2]/@duration", "\"NaN\" is not a number", "e.g. 2.5"),
        (r#"<TrafficSignalController name="B"><Phase name="p" duration="@@1e400"/></TrafficSignalController>"#, "Phase/@duration", "1e400 is too large", "smaller"),
        (r#"<TrafficSignalController name="B"><Phase name="p" duration="@@1000000001"/></TrafficSignalController>"#, "Phase/@duration", "1000000001 s is out of range", "1e9"),
        (r#"<TrafficSignalController name="B"><Phase name="p" duration="@@five"/></TrafficSignalController>"#, "Phase/@duration", "\"five\" is not a number", "2.5"),
        (r#"<TrafficSignalController name="B"><Phase name="p" duration="@@"/></TrafficSignalController>"#, "Phase/@duration", "\"\" is not a number", "2.5"),
        (r#"<TrafficSignalController name="B">@@<Phase duration="1"/></TrafficSignalController>"#, "/Phase", "name is missing", "requires it"),
        (r#"<TrafficSignalController name="B"><Phase name="p" duratoin="@@1"/></TrafficSignalController>"#, "Phase/@duratoin", "no attribute duratoin", "correct"),
        (r#"<TrafficSignalController name="B"><Phase name="p" duration="@@$q"/></TrafficSignalController>"#, "Phase/@duration", "no parameter is called q", "there are p"),
        (r#"<TrafficSignalController name="B"><Phase name="p" duration="@@${$p + red}"/></TrafficSignalController>"#, "Phase/@duration", "is not an expression of numbers", "correct the expression"),
        (r#"<TrafficSignalController name="B"><Phase name="p" duration="@@$(var t)"/></TrafficSignalController>"#, "Phase/@duration", "launch system", "its value"),
    ];
    refused(rows, |part| document(part, ""));
    #[rustfmt::skip]
    let rows: &[Row<'_>] = &[
        (r#"@@<TrafficSignalState state="green"/>"#, "TrafficSignalState", "trafficSignalId is missing", "requires it"),
        (r#"@@<TrafficSignalState trafficSignalId="1"/>"#, "TrafficSignalState", "state is missing", "requires it"),
        (r#"<TrafficSignalState trafficSignalId="@@9223372036854775808" state="green"/>"#, id, "is not an id", "34802 v2i"),
        (r#"<TrafficSignalState trafficSignalId="@@1 V2I" state="green"/>"#, id, "`V2I` is not a channel", "34802 v2i"),
        (r#"<TrafficSignalState trafficSignalId="@@ 1" state="green"/>"#, id, "is not an id", "34802 v2i"),
        (r#"<TrafficSignalState trafficSignalId="@@1 v2i x" state="green"/>"#, id, "more than an id and a channel", "34802"),
        (r#"<TrafficSignalState trafficSignalId="1" state="@@blue"/>"#, state, "`blue`", ""),
        (r#"<TrafficSignalState trafficSignalId="1" state="@@red,,green"/>"#, state, "a bulb must begin", ""),
        (r#"<TrafficSignalState trafficSignalId="1" state="@@red, unknown"/>"#, state, "unknown", ""),
        (r#"<TrafficSignalState trafficSignalId="1 v2i" state="@@unknown"/>"#, state, "v2i_detected", ""),
    ];
    let whole = |part: &str| {
        let phase = format!(
            "<TrafficSignalController name=\"B\"><Phase name=\"p\">\n{part}\n</Phase></TrafficSignalController>"
        );
        document(&phase, "")
    };
    refused(rows, whole);
    let other = "<TrafficSignalController name=\"B\" reference=\"@@A\" delay=\"0\"><Phase name=\"p\" duration=\"5.002\"/></TrafficSignalController>";
    let row = (other, "/@reference", "\"B\" takes 5.002 s and that of \"A\" takes 5.000 s", "same sum");
    refused(&[row], |part| document(&format!("{A}\n{part}"), ""));
    let same = other.replace("@@", "").replace("5.002", "5.0009");
    accepted(Compat::Improved, "s.xosc", &document(&format!("{A}{same}"), ""));
}

#[test]
fn exactly_the_controllers_of_a_circle_are_refused() {
    let follows = |name: &str, reference: &str| {
        format!("<TrafficSignalController name=\"{name}\" reference=\"{reference}\" delay=\"1\"/>\n")
    };
    let network = [("behind", "B"), ("B", "C"), ("C", "D"), ("alone", "alone"), ("D", "B")]
        .map(|(name, reference)| follows(name, reference))
        .concat();
    let problems = read_text("s.xosc", &document(&network, "")).unwrap_err();
    let reasons: Vec<_> = problems.iter().map(|problem| problem.reason.as_str()).collect();
    let expected = ["B", "C", "alone", "D"].map(|name| format!("{name:?} waits for itself to begin"));
    assert_eq!(reasons, expected);
}

#[test]
fn actions_that_cannot_be_done_are_refused() {
    #[rustfmt::skip]
    let rows: &[Row<'_>] = &[
        (r#"@@<TrafficSignalStateAction name="1"/>"#, "TrafficSignalStateAction", "state is missing", "requires it"),
        (r#"<TrafficSignalStateAction name="@@x" state="red"/>"#, "StateAction/@name", "`x` is not an id", "34802"),
        (r#"<TrafficSignalStateAction name="1" state="@@unknown"/>"#, "StateAction/@state", "conventional_detected", ""),
        (r#"<TrafficSignalStateAction name="1" state="red" stat="@@x"/>"#, "/@stat", "no attribute stat", "correct"),
        (r#"<TrafficSignalControllerAction trafficSignalControllerRef="@@B" phase="go"/>"#, "Ref", "no controller is called \"B\"", "there are A"),
        (r#"<TrafficSignalControllerAction trafficSignalControllerRef="A" phase="@@went"/>"#, "/@phase", "no phase \"went\"", "there are go"),
    ];
    refused(rows, |part| document(A, &light_action(part)));
    #[rustfmt::skip]
    let rows: &[Row<'_>] = &[
        ("@@V2ITrafficSignalStateAction(1, red, green)", "/@type", "rate `green`", ""),
        ("@@V2ITrafficSignalStateAction(1, red, 0)", "/@type", "rate `0`", ""),
        ("@@V2ITrafficSignalStateAction(1, red solidOn circle)", "/@type", "takes 2 or 3 arguments, 4 given", "long argument"),
        ("@@V2ITrafficSignalStateAction(1, unknown)", "/@type", "unknown", ""),
        ("@@EnableTrafficSignalV2IFeatureAction@v1()", "/@type", "at least 1 argument", "long argument"),
        ("@@DisableTrafficSignalV2IFeatureAction@v1(1.5)", "/@type", "`1.5` is not an id", ""),
        ("@@PseudoTrafficSignalDetectorConfidenceSetAction@v1(1, 1.5)", "/@type", "confidence `1.5`", ""),
        ("@@PseudoTrafficSignalDetectorConfidenceSetAction@v1(1, NaN)", "/@type", "confidence `NaN`", ""),
        ("@@TrafficSignalControllerAction(A, went)", "/@type", "has no phase `went`", ""),
        ("@@exitSuccess(1)", "/@type", "takes no arguments", "long argument"),
    ];
    refused(rows, |part| {
        let command = format!("<CustomCommandAction type=\"{part}\"/>");
        document(A, &action(&format!("<UserDefinedAction>\n{command}\n</UserDefinedAction>")))
    });
}

#[test]
fn conditions_that_cannot_be_tested_are_refused() {
    #[rustfmt::skip]
    let rows: &[Row<'_>] = &[
        (r#"<SimulationTimeCondition value="@@-1" rule="greaterThan"/>"#, "/@value", "-1 s", "0 or more"),
        (r#"<SimulationTimeCondition value="@@inf" rule="greaterThan"/>"#, "/@value", "inf s", "1e9"),
        (r#"<SimulationTimeCondition value="1" rule="@@after"/>"#, "/@rule", "unknown value \"after\"", "greaterThan"),
        (r#"@@<SimulationTimeCondition value="1"/>"#, "SimulationTimeCondition", "rule is missing", "requires it"),
        (r#"<TrafficSignalCondition name="1" state="@@blue"/>"#, "/@state", "blue", ""),
        (r#"<TrafficSignalCondition name="@@one" state="red"/>"#, "/@name", "`one` is not an id", "34802"),
        (r#"<TrafficSignalControllerCondition trafficSignalControllerRef="A" phase="@@went"/>"#, "/@phase", "no phase", "go"),
        (r#"<StoryboardElementStateCondition storyboardElementType="event" storyboardElementRef="@@f" state="completeState"/>"#, "Ref", "there is no event \"f\"", "storyboard"),
        (r#"<StoryboardElementStateCondition storyboardElementType="@@scene" storyboardElementRef="e" state="completeState"/>"#, "Type", "\"scene\"", "maneuver"),
        (r#"<StoryboardElementStateCondition storyboardElementType="event" storyboardElementRef="e" state="@@done"/>"#, "/@state", "\"done\"", "completeState"),
    ];
    refused(rows, |part| document(A, &by_value(part)));
    #[rustfmt::skip]
    let rows: &[Row<'_>] = &[
        ("@@<Condition/>", "Condition", "holds 0 elements", "exactly one"),
        ("<Condition delay=\"@@-2\"><ByEntityCondition/></Condition>", "/@delay", "-2 s", "0 or more"),
        ("<Condition conditionEdge=\"@@up\"><ByEntityCondition/></Condition>", "Edge", "\"up\"", "risingOrFalling"),
        ("<Condition>@@<ByValueCondition><A/><B/></ByValueCondition></Condition>", "ByValueCondition", "holds 2 elements", "exactly one"),
    ];
    refused(rows, |part| document(A, &condition(part)));
    let twice = "<Event name=\"e\"/><Event name=\"e\" maximumExecutionCount=\"@@0\"/>";
    let row = (twice, "Event[2]/@maximumExecutionCount", "\"0\" is not a count", "1 or more");
    refused(&[row], |part| {
        let story =
            format!("<Story><Act><ManeuverGroup><Maneuver>{part}</Maneuver></ManeuverGroup></Act></Story>");
        document("", &story)
    });
    let waits = "<Act name=\"a\"><ManeuverGroup><Maneuver><Event name=\"e\"/></Maneuver></ManeuverGroup></Act>\
        <Act name=\"b\"><ManeuverGroup><Maneuver><Event name=\"e\"/></Maneuver></ManeuverGroup>\
        <StartTrigger><ConditionGroup><Condition><ByValueCondition><StoryboardElementStateCondition \
        storyboardElementType=\"event\" storyboardElementRef=\"@@e\" state=\"completeState\"/></ByValueCondition>\
        </Condition></ConditionGroup></StartTrigger></Act>";
    let row = (waits, "Ref", "2 events are called \"e\"", "Act::Name");
    refused(&[row], |part| document("", &format!("<Story>{part}</Story>")));
    let qualified = waits.replace("@@e", "a::e");
    let file = accepted(Compat::Improved, "s.xosc", &document("", &format!("<Story>{qualified}</Story>")));
    let test = &file.scenario.acts[1].start.as_ref().unwrap().groups[0][0].test;
    assert_eq!(format!("{test:?}"), "Element { name: \"a/Event[1]\", state: Complete }");
}

#[test]
fn all_problems_of_a_document_come_at_once() {
    let text = document(
        "<TrafficSignalController name=\"B\" delay=\"1\"><Phase name=\"p\" duration=\"-1\">\
         <TrafficSignalState trafficSignalId=\"x\" state=\"unknown\"/></Phase></TrafficSignalController>",
        &light_action("<TrafficSignalControllerAction trafficSignalControllerRef=\"C\" phase=\"go\"/>"),
    );
    let problems = read_text("s.xosc", &text).unwrap_err();
    assert_eq!(problems.len(), 4, "{}", crate::pure::scenario_refusals::shown(&problems));
    assert!(problems.is_sorted_by_key(|problem| problem.position));
}

#[test]
fn the_yaml_form_is_refused_with_the_same_texts() {
    #[rustfmt::skip]
    let rows: &[Row<'_>] = &[
        ("- { name: B, delay: @@1 }", "TrafficSignalController/@delay", "delay without a reference", "name the"),
        ("- name: B\n        Phase:\n          - { name: p, duration: @@-1 }", "Phase/@duration", "-1 s", "0 or more"),
        ("- name: B\n        Phase:\n          - { name: p, duration: @@.nan }", "Phase/@duration", "is not a number", "2.5"),
        ("- name: B\n        Phase:\n          - { name: p }\n          - { name: p, time: @@1 }", "Phase[2]/@time", "no attribute time", "correct"),
        ("- @@{ delay: 1, reference: x }", "TrafficSignalController", "name is missing", "requires"),
        ("- @@[1]", "", "a list within a list", "write a table"),
    ];
    let rows: Vec<_> = rows
        .iter()
        .map(|row| {
            let text = format!(
                "OpenSCENARIO:\n  RoadNetwork:\n    TrafficSignals:\n      TrafficSignalController:\n      {}\n",
                row.0
            );
            (text, *row)
        })
        .collect();
    // A controller without a name has a second problem: its reference.
    let (mut one, rest): (Vec<_>, Vec<_>) =
        rows.into_iter().partition(|(_, row)| row.0.contains("reference: x"));
    one[0].0 = one[0].0.replace("delay: 1, reference: x", "reference: ''");
    assert_refused(Compat::Improved, "s.yaml", &one);
    assert_refused(Compat::Improved, "s.yaml", &rest);
}
