//! The decider's sections as markers for a viewer: arrows at their four points, and texts with their names
//! (docs/spec/turn-signal-decider.md, "Published sections").

use super::geometry::upright_pose;
use super::marker_array::{FRAME, delete_all};
use gateway_base::time::WallStamp;
use lanelet2_map::geometry as plane;
use ros_messages::builtin_interfaces::Duration;
use ros_messages::geometry_msgs::Vector3;
use ros_messages::std_msgs::{ColorRGBA, Header};
use ros_messages::visualization_msgs::{Marker, MarkerArray};
use turn_signal::decision::Decision;
use turn_signal::resolve::{CandidateOutcome, EvaluatedCandidate};
use turn_signal::section::Section;
use turn_signal::side::Side;

/// Opacity of a candidate that is not signalled.
const ALPHA_LOST: f32 = 0.35;
/// Height of a text above its section, and height of its letters, metres.
const TEXT_HEIGHTS_M: (f64, f64) = (2.0, 0.8);
/// Lengths of the arrows of desired and required sections, metres.
const DESIRED_M: f64 = 2.0;
const REQUIRED_M: f64 = 4.0;
/// Time after which the viewer deletes the markers of a stopped gateway.
const LIFETIME: Duration = Duration { sec: 3, nanosec: 0 };

/// Creates the markers of all candidates that have a side and finite points, preceded by the deletion of all
/// earlier markers. The signalled candidate is opaque.
pub fn section_markers(decision: &Decision, stamp: WallStamp) -> MarkerArray {
    let mut markers = delete_all(stamp).markers;
    markers
        .extend(decision.evaluated().iter().flat_map(|candidate| of_candidate(decision, candidate, stamp)));
    MarkerArray { markers }
}

fn of_candidate(decision: &Decision, candidate: &EvaluatedCandidate, stamp: WallStamp) -> Vec<Marker> {
    let section = decision.sections.of(candidate.source).filter(Section::is_finite);
    let (Some(section), Some(side)) = (section, candidate.turn.side()) else { return Vec::new() };
    let is_won = candidate.outcome == CandidateOutcome::Won;
    // As in the charts: colour-blind viewers can distinguish blue and orange.
    let [r, g, b] = match side {
        Side::Left => [0.13, 0.4, 0.67],
        Side::Right => [0.85, 0.37, 0.05],
    };
    let color = ColorRGBA { r, g, b, a: if is_won { 1.0 } else { ALPHA_LOST } };
    let marker = |id, r#type, pose: plane::Pose, scale| Marker {
        header: Header::new(stamp, FRAME),
        ns: candidate.source.to_string(),
        id,
        r#type,
        action: Marker::ADD,
        pose: upright_pose(pose),
        scale,
        color,
        lifetime: LIFETIME,
        ..Marker::default()
    };
    let arrow = |id, pose, length_m: f64| {
        let thick_m = length_m / 8.0;
        marker(id, Marker::ARROW, pose, Vector3 { x: length_m, y: thick_m, z: thick_m })
    };
    let (above_m, letter_m) = TEXT_HEIGHTS_M;
    let mut label =
        marker(4, Marker::TEXT_VIEW_FACING, section.required_start, Vector3 { x: 0.0, y: 0.0, z: letter_m });
    label.pose.position.z += above_m;
    let name = candidate.subject.name(candidate.turn).unwrap_or_else(|| candidate.source.to_string());
    label.text = format!("{name}: {}", candidate.outcome);
    vec![
        arrow(0, section.desired_start, DESIRED_M),
        arrow(1, section.required_start, REQUIRED_M),
        arrow(2, section.required_end, REQUIRED_M),
        arrow(3, section.desired_end, DESIRED_M),
        label,
    ]
}

#[cfg(test)]
mod tests {
    use super::super::planning_factor_array::factors_of_decision;
    use super::*;
    use lanelet2_map::geometry::path::{NearestLimits, Path, PathFrame};
    use turn_signal::decision::Basis;
    use turn_signal::light_command::{HazardCommand, TurnCommand};
    use turn_signal::resolve::{Candidates, PairwiseRules, resolve};
    use turn_signal::subject::{ManoeuvreKind, SignalSubject};

    fn at(x_m: f64) -> plane::Pose {
        plane::Pose::new(x_m, 0.0, 0.0)
    }

    /// Decides between a left turn required from 40 to 50 m and a later avoidance to the right, for a vehicle
    /// at 20 m.
    fn decision(sections: &Candidates) -> Decision {
        let path = Path::new((0..100_u32).map(|x| at(x.into()))).unwrap();
        let limits = NearestLimits { distance_m: 3.0, yaw_rad: 1.0 };
        let resolution =
            resolve(&PathFrame::new(&path, at(20.0), 4.0, limits), sections, &PairwiseRules::default());
        Decision {
            turn: resolution.signal(),
            hazard: HazardCommand::Disable,
            basis: Basis::Candidates(Box::new(resolution)),
            held: None,
            sections: *sections,
            intersection: None,
            junction: None,
            remarks: Vec::new(),
            findings: Vec::new(),
            next_deadline: None,
        }
    }

    fn section(side: Side, subject: SignalSubject, [desired, start, end, over]: [f64; 4]) -> Section {
        let section = Section::blinking(side, at(desired)..at(over), at(start)..at(end));
        Section { subject, ..section }
    }

    fn two() -> Decision {
        decision(&Candidates {
            intersection: Some(section(Side::Left, SignalSubject::Turn(111), [10.0, 40.0, 50.0, 60.0])),
            roundabout: None,
            manoeuvre: Some(section(
                Side::Right,
                SignalSubject::Manoeuvre(ManoeuvreKind::Avoidance),
                [15.0, 70.0, 80.0, 80.0],
            )),
        })
    }

    #[test]
    fn each_candidate_has_four_arrows_and_its_name() {
        let markers = section_markers(&two(), WallStamp::default()).markers;
        assert_eq!(markers[0].action, 3, "those before are deleted");
        let names: Vec<_> = markers[1..].iter().map(|marker| (marker.ns.as_str(), marker.id)).collect();
        let expected = ["intersection", "manoeuvre"].map(|ns| (0..5).map(move |id| (ns, id)));
        assert_eq!(names, expected.into_iter().flatten().collect::<Vec<_>>());
        let xs: Vec<f64> = markers[1..5].iter().map(|marker| marker.pose.position.x).collect();
        assert_eq!(xs, [10.0, 40.0, 50.0, 60.0]);
        let texts = [&markers[5], &markers[10]].map(|marker| (marker.text.as_str(), marker.color.a));
        let lost = "avoidance to the right: lost to intersection by A2";
        assert_eq!(texts, [("left turn on 111: won", 1.0), (lost, ALPHA_LOST)]);
        assert!(
            markers[1..].iter().all(|marker| marker.lifetime == LIFETIME && marker.header.frame_id == "map")
        );
    }

    #[test]
    fn what_cannot_be_drawn_is_left_out() {
        let nan = section(Side::Left, SignalSubject::Turn(1), [0.0, f64::NAN, 50.0, 60.0]);
        let silent = Some(Section { turn: TurnCommand::Disable, ..Section::default() });
        let decision = decision(&Candidates { intersection: Some(nan), roundabout: silent, manoeuvre: None });
        assert_eq!(section_markers(&decision, WallStamp::default()).markers.len(), 1);
        assert!(factors_of_decision(&decision, WallStamp::default()).factors.is_empty());
    }

    #[test]
    fn what_is_signalled_is_a_planning_factor() {
        let array = factors_of_decision(&two(), WallStamp::default());
        let [factor] = &array.factors[..] else { panic!("{array:?}") };
        assert_eq!((factor.module.as_str(), factor.behavior), ("signal_gateway", 6));
        assert_eq!(factor.detail, "left turn on 111");
        let points: Vec<_> =
            factor.control_points.iter().map(|point| (point.pose.position.x, point.distance)).collect();
        // The vehicle's front is 4 m ahead of its rear axle, which is at 20 m.
        assert_eq!(points, [(40.0, 16.0), (50.0, 30.0)]);
        let shift = decision(&Candidates { manoeuvre: two().sections.manoeuvre, ..Candidates::default() });
        assert_eq!(factors_of_decision(&shift, WallStamp::default()).factors[0].behavior, 5);
    }
}
