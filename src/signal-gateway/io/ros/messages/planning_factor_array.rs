//! `autoware_internal_planning_msgs/msg/PlanningFactorArray` of release 1.12.

use super::geometry::{plane_pose, upright_pose};
use gateway_base::time::WallStamp;
use lanelet2_map::geometry as plane;
use ros_messages::autoware_internal_planning_msgs::{
    ControlPoint, PlanningFactor, PlanningFactorArray, SafetyFactorArray,
};
use ros_messages::std_msgs::Header;
use turn_signal::decision::Decision;
use turn_signal::planner_input::{self, FactorTopic, PlannerInput};
use turn_signal::side::Side;
use turn_signal::subject::SignalSubject;

/// Name of the module in our own factors.
const MODULE: &str = "signal_gateway";

/// Creates the factors of a decision: none, or one that spans the required section
/// (docs/spec/turn-signal-decider.md, "Published sections").
pub fn factors_of_decision(decision: &Decision, stamp: WallStamp) -> PlanningFactorArray {
    let header = Header::new(stamp, "map");
    let factor = decision.won().and_then(|won| {
        let (section, distances) = (decision.sections.of(won.source)?, won.distances?);
        let [left, right] = match won.subject {
            SignalSubject::Turn(_) | SignalSubject::RoundaboutEntry(_) | SignalSubject::RoundaboutExit(_) => {
                [PlanningFactor::TURN_LEFT, PlanningFactor::TURN_RIGHT]
            }
            SignalSubject::Unnamed | SignalSubject::Manoeuvre(_) => {
                [PlanningFactor::SHIFT_LEFT, PlanningFactor::SHIFT_RIGHT]
            }
        };
        let behavior = if won.turn.side()? == Side::Left { left } else { right };
        #[allow(clippy::cast_possible_truncation)] // the message has 32 bits
        let point = |pose: plane::Pose, distance_m: f64| ControlPoint {
            pose: upright_pose(pose),
            distance: distance_m as f32,
            ..ControlPoint::default()
        };
        Some(PlanningFactor {
            module: MODULE.to_owned(),
            is_driving_forward: true,
            control_points: vec![
                point(section.required_start, distances.required_start_m),
                point(section.required_end, distances.required_end_m),
            ],
            behavior,
            detail: won.subject.name(won.turn).unwrap_or_default(),
            safety_factors: SafetyFactorArray {
                header: header.clone(),
                is_safe: true,
                ..SafetyFactorArray::default()
            },
        })
    });
    PlanningFactorArray { header, factors: factor.into_iter().collect() }
}

/// Converts a message received on `topic` to an input of the decider.
pub fn factors_input(message: PlanningFactorArray, topic: FactorTopic) -> PlannerInput {
    let factor = |factor: PlanningFactor| planner_input::PlanningFactor {
        behavior: factor.behavior,
        is_driving_forward: factor.is_driving_forward,
        detail: factor.detail.into_boxed_str(),
        control_points: factor.control_points.into_iter().map(control_point).collect(),
    };
    PlannerInput::Factors { topic, factors: message.factors.into_iter().map(factor).collect() }
}

fn control_point(point: ControlPoint) -> planner_input::ControlPoint {
    planner_input::ControlPoint {
        pose: plane_pose(point.pose),
        distance_m: point.distance.into(),
        speed_mps: point.velocity.into(),
        shift_length_m: point.shift_length.into(),
    }
}
