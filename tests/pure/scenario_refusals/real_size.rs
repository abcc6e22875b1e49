//! A scenario like those of test tracks: an ego, a crossing car, a pedestrian, weather, and lights.

use traffic_lights::compat::Compat;
use traffic_lights::scenario::Action;

use crate::pure::scenario_refusals::accepted;

const CROSSING: &str = include_str!("crossing.xosc");

/// The first line with that text.
fn line_of(text: &str) -> usize {
    CROSSING.lines().position(|line| line.contains(text)).unwrap_or_else(|| panic!("{text}")) + 1
}

#[test]
fn parts_without_lights_are_listed_with_their_locations() {
    let file = accepted(Compat::Improved, "maps/crossing.xosc", CROSSING);
    let listed: Vec<_> = file
        .not_interpreted
        .iter()
        .map(|part| format!("{} {}: {}", part.location.position.line, part.location.key, part.what))
        .collect();
    let act = "OpenSCENARIO/Storyboard/Story/Act";
    let event = format!("{act}/ManeuverGroup/Maneuver/Event");
    let later = format!("{act}[2]/ManeuverGroup/Maneuver/Event");
    let signals = "OpenSCENARIO/RoadNetwork/TrafficSignals/TrafficSignalController";
    let init = "OpenSCENARIO/Storyboard/Init/Actions";
    let both = line_of("storyboardElementRef=\"both\"");
    let arrived = line_of("storyboardElementRef=\"arrived\"");
    let nothing = "nothing it does is about traffic lights";
    #[rustfmt::skip]
    let expected = [
        ("<CatalogLocations>", "OpenSCENARIO/CatalogLocations: once, 3 elements".to_owned()),
        ("<SceneGraphFile", "OpenSCENARIO/RoadNetwork/SceneGraphFile: once, 1 element".to_owned()),
        ("<TrafficSignalGroupState", format!("{signals}/Phase/TrafficSignalGroupState: 2 times, 2 elements")),
        ("<Entities>", "OpenSCENARIO/Entities: once, 12 elements".to_owned()),
        ("<EnvironmentAction", format!("{init}/GlobalAction[2]/EnvironmentAction: once, 2 elements")),
        ("<Private ", format!("{init}/Private: 2 times, 11 elements")),
        ("maximumExecutionCount=\"2\"", format!("{act}/ManeuverGroup/@maximumExecutionCount: each event has its own count, it is not repeated 2 times")),
        ("<Actors", format!("{act}/ManeuverGroup/Actors: 2 times, 4 elements")),
        ("\"brake\"", format!("{event}: \"brake\": {nothing}")),
        ("name=\"slow\"", format!("{event}[2]/Action[2]/PrivateAction: once, 2 elements")),
        ("\"after both\"", format!("{event}[3]: \"after both\": its trigger waits for \"both\", which is not interpreted (line {both})")),
        ("\"arrived\"", format!("{later}: \"arrived\": its trigger needs ReachPositionCondition (line {})", line_of("<ReachPosition"))),
        ("\"after arrival\"", format!("{later}[2]: \"after arrival\": its trigger waits for \"arrived\", which is not interpreted (line {arrived})")),
        ("\"cooperate\"", format!("{later}[4]: \"cooperate\": {nothing}")),
        ("RequestToCooperate", format!("{later}[4]/Action/UserDefinedAction/CustomCommandAction/@type: `RequestToCooperateCommandAction@v1` is not a command for traffic lights")),
        ("\"third\"", format!("{act}[3]: \"third\": its trigger needs TraveledDistanceCondition (line {})", line_of("<TraveledDistance"))),
        ("<!-- collision", format!("OpenSCENARIO/Storyboard/StopTrigger/ConditionGroup: its trigger needs CollisionCondition (line {})", line_of("<CollisionCondition"))),
    ];
    let expected: Vec<_> = expected.map(|(text, part)| format!("{} {part}", line_of(text))).into();
    let shown = |listed: &String| listed.split("; commands are").next().unwrap().to_owned();
    assert_eq!(listed.iter().map(shown).collect::<Vec<_>>(), expected);
}

#[test]
fn parts_about_lights_are_interpreted() {
    let file = accepted(Compat::Improved, "maps/crossing.xosc", CROSSING);
    assert_eq!(file.map.unwrap(), std::path::Path::new("maps/lanelet2_map.osm"));
    let scenario = file.scenario;
    assert_eq!(scenario.controllers.iter().map(|it| it.phases.len()).collect::<Vec<_>>(), [3, 2]);
    assert!(matches!(&scenario.init[..], [Action::SetState { target, .. }] if target.id == 34836));
    let acts: Vec<_> = scenario
        .acts
        .iter()
        .map(|act| {
            (act.name.as_str(), act.events.iter().map(|event| event.name.as_str()).collect::<Vec<_>>())
        })
        .collect();
    assert_eq!(acts, [("first", vec!["both", "by time"]), ("second", vec!["second/Event[3]"])]);
    // The collision is never true; the time is.
    assert_eq!(scenario.stop.unwrap().groups.len(), 1);
    assert!(scenario.acts[0].events[0].actions.len() == 1);
}
