//! Documents of OpenSCENARIO in parts.

use traffic_lights::compat::Compat;

use crate::pure::scenario_refusals::accepted;

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

#[test]
fn an_element_of_many_is_named_by_what_holds_it() {
    let events = "<Act name=\"a\"><ManeuverGroup><Maneuver><Event name=\"e\"/></Maneuver></ManeuverGroup></Act>\
        <Act name=\"b\"><ManeuverGroup><Maneuver><Event name=\"e\"/></Maneuver></ManeuverGroup>\
        <StartTrigger><ConditionGroup><Condition><ByValueCondition><StoryboardElementStateCondition \
        storyboardElementType=\"event\" storyboardElementRef=\"a::e\" state=\"completeState\"/></ByValueCondition>\
        </Condition></ConditionGroup></StartTrigger></Act>";
    let file = accepted(Compat::Improved, "s.xosc", &document("", &format!("<Story>{events}</Story>")));
    let test = &file.scenario.acts[1].start.as_ref().unwrap().groups[0][0].test;
    assert_eq!(format!("{test:?}"), "Element { name: \"a/Event[1]\", state: Complete }");
}
