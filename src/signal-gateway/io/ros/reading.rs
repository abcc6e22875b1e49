//! Decodes a sample's bytes to the input that its subscription provides. Any bytes are safe to decode.

use super::messages::{factors_input, groups_for_arbiter, groups_for_store, planner_inputs};
use super::topics::SubscriptionKind;
use gateway_core::command::input::CommandInput;
use gateway_core::command::origin::{CommandOrigin, SampleId};
use gateway_core::gateway::event::Input;
use ros_messages::autoware_planning_msgs::PoseWithUuidStamped;
use ros_messages::autoware_vehicle_msgs::{ControlModeReport, HazardLightsCommand, TurnIndicatorsCommand};
use ros_messages::cdr::{CdrInput, Endian, Unreadable};
use ros_messages::rosgraph_msgs::Clock;
use ros_messages::std_msgs;
use traffic_lights::input::TrafficLightInput;
use turn_signal::light_command::EnumOrUnknown;
use turn_signal::planner_input::PlannerInput;

/// Decodes the bytes of a sample of this kind, without the encapsulation header.
pub fn read(
    kind: SubscriptionKind,
    sample: SampleId,
    bytes: &[u8],
    endian: Endian,
) -> Result<Input, Unreadable> {
    let bytes = CdrInput { bytes, endian };
    Ok(match kind {
        SubscriptionKind::Groups(store) => groups_for_store(&bytes.whole()?, store).into(),
        SubscriptionKind::Camera => groups_for_arbiter(&bytes.whole()?).into(),
        SubscriptionKind::Clock => TrafficLightInput::Clock(bytes.whole::<Clock>()?.clock.into()).into(),
        SubscriptionKind::Command => {
            TrafficLightInput::Command(bytes.whole::<std_msgs::String>()?.data).into()
        }
        SubscriptionKind::Odometry => planner_inputs::odometry(&bytes.whole()?).into(),
        SubscriptionKind::Route => planner_inputs::route(&bytes.whole()?).into(),
        SubscriptionKind::PlannedPath => planner_inputs::planned_path(bytes.whole()?).into(),
        SubscriptionKind::Trajectory => planner_inputs::trajectory(bytes.whole()?).into(),
        SubscriptionKind::Factors(topic) => factors_input(bytes.whole()?, topic).into(),
        SubscriptionKind::ModifiedGoal => {
            let goal = bytes.whole::<PoseWithUuidStamped>();
            // Some releases append a flag that tells whether the goal may be moved.
            let flagged = |_| bytes.whole::<(PoseWithUuidStamped, bool)>().map(|(goal, _)| goal);
            planner_inputs::modified_goal(&goal.or_else(flagged)?).into()
        }
        SubscriptionKind::OperationMode => planner_inputs::operation_mode(bytes.whole()?).into(),
        SubscriptionKind::Scenario => planner_inputs::scenario(&bytes.whole()?).into(),
        SubscriptionKind::HazardRequest => {
            let message: HazardLightsCommand = bytes.whole()?;
            match message.command.into() {
                EnumOrUnknown::Known(request) => PlannerInput::HazardRequest(request).into(),
                EnumOrUnknown::Unknown(number) => {
                    return Err(Unreadable::Layout(format!("{number} is not a hazard command")));
                }
            }
        }
        SubscriptionKind::OwnTurnCommand => {
            let command = bytes.whole::<TurnIndicatorsCommand>()?.command.into();
            PlannerInput::OwnTurnCommand(command).into()
        }
        SubscriptionKind::OwnHazardCommand => {
            let command = bytes.whole::<HazardLightsCommand>()?.command.into();
            PlannerInput::OwnHazardCommand(command).into()
        }
        SubscriptionKind::TurnCommand => {
            let message: TurnIndicatorsCommand = bytes.whole()?;
            let (command, stamp) = (message.command.into(), message.stamp.into());
            CommandInput::Turn { origin: CommandOrigin::Topic(sample), command, stamp }.into()
        }
        SubscriptionKind::HazardCommand => {
            let message: HazardLightsCommand = bytes.whole()?;
            let (command, stamp) = (message.command.into(), message.stamp.into());
            CommandInput::Hazard { origin: CommandOrigin::Topic(sample), command, stamp }.into()
        }
        SubscriptionKind::ControlMode => {
            let message: ControlModeReport = bytes.whole()?;
            let (mode, stamp) = (message.mode.into(), message.stamp.into());
            CommandInput::ControlMode { sample, mode, stamp }.into()
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn command(bytes: &[u8], endian: Endian) -> Option<Input> {
        read(SubscriptionKind::Command, SampleId::default(), bytes, endian).ok()
    }

    #[test]
    fn text_is_read_in_both_byte_orders_and_with_padding() {
        let text = Some(TrafficLightInput::Command("ab".to_owned()).into());
        assert_eq!(command(&[3, 0, 0, 0, b'a', b'b', 0], Endian::Little), text);
        assert_eq!(command(&[3, 0, 0, 0, b'a', b'b', 0, 0], Endian::Little), text);
        assert_eq!(command(&[0, 0, 0, 3, b'a', b'b', 0], Endian::Big), text);
    }

    #[test]
    fn bytes_of_another_layout_are_refused() {
        for bytes in [
            &[][..],
            &[3, 0, 0],
            &[9, 0, 0, 0, b'a', b'b', 0],
            &[0xFF, 0xFF, 0xFF, 0xFF, b'a'],
            &[3, 0, 0, 0, 0xFF, 0xFE, 0],
            &[3, 0, 0, 0, b'a', b'b', 0, 0, 0, 0, 0],
        ] {
            assert_eq!(command(bytes, Endian::Little), None, "{bytes:?}");
        }
    }
}
