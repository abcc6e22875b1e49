//! The hashes that the build computes from `ros/msg` are the known hashes of ROS 2 and Autoware.

use std::collections::BTreeSet;

use ros_messages::{TYPE_HASHES, type_hash};
use signal_gateway::io::ros::topics::SubscriptionKind;

/// Package, name and hash of every type that is written, read or asked for, as `ros2 interface` and the keys
/// of `rmw_zenoh` show them; and of `Time`, as it stands in its design document.
const KNOWN: &str = include_str!("type_hashes/known.txt");

#[test]
fn computed_hashes_are_the_known_ones() {
    for line in KNOWN.lines() {
        let [package, name, hash] = line.split(' ').collect::<Vec<_>>().try_into().unwrap();
        let of = |kind| type_hash(&format!("{package}/{kind}/{name}"));
        assert_eq!(of("msg").or(of("srv")), Some(hash), "{package}/{name}");
    }
    assert_eq!(KNOWN.lines().count(), 33);
    assert_eq!(type_hash("std_msgs/msg/Nothing"), None);
}

#[test]
fn each_type_has_one_hash() {
    let names: BTreeSet<_> = TYPE_HASHES.iter().map(|(name, _)| name).collect();
    assert_eq!(names.len(), TYPE_HASHES.len(), "a message and a service have the same name");
}

#[test]
fn everything_that_is_read_has_a_hash() {
    use turn_signal::planner_input::FactorTopic;
    #[rustfmt::skip]
    let kinds = [
        SubscriptionKind::Camera, SubscriptionKind::Clock, SubscriptionKind::Command,
        SubscriptionKind::Odometry, SubscriptionKind::Route, SubscriptionKind::PlannedPath,
        SubscriptionKind::Factors(FactorTopic::GoalPlanner), SubscriptionKind::ModifiedGoal,
        SubscriptionKind::OperationMode, SubscriptionKind::Scenario, SubscriptionKind::HazardRequest,
        SubscriptionKind::OwnTurnCommand, SubscriptionKind::ControlMode, SubscriptionKind::Trajectory,
    ];
    let mut types = kinds.map(|kind| kind.row().type_name).into_iter();
    assert_eq!(types.find(|name| type_hash(name).is_none()), None);
}
