//! Decodes a sample's bytes to the gateway's input that its subscription is for. Any bytes are safe to decode.

use byteorder::{BigEndian, LittleEndian};
use serde::de::DeserializeOwned;
use thiserror::Error;

use super::messages::autoware_adapi_v1_msgs::OperationModeState;
use super::messages::autoware_internal_planning_msgs::{PathWithLaneId, PlanningFactorArray, Scenario};
use super::messages::autoware_perception_msgs::TrafficLightGroupArray;
use super::messages::autoware_planning_msgs::{LaneletRoute, PoseWithUuidStamped, Trajectory};
use super::messages::autoware_vehicle_msgs::{ControlModeReport, HazardLightsCommand, TurnIndicatorsCommand};
use super::messages::nav_msgs::Odometry;
use super::messages::rosgraph_msgs::Clock;
use super::messages::std_msgs;
use super::topics::SubscriptionKind;
use gateway_core::command::input::CommandInput;
use gateway_core::command::origin::{CommandOrigin, SampleId};
use gateway_core::gateway::event::Input;
use traffic_lights::input::TrafficLightInput;
use turn_signal::light_command::EnumOrUnknown;
use turn_signal::planner_input::PlannerInput;

/// Byte order of CDR, as the sample's header names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Endian {
    /// Most significant byte first, `CDR_BE`.
    Big,
    /// Least significant byte first, `CDR_LE`.
    Little,
}

impl Endian {
    /// Returns the encapsulation header of a message in plain CDR.
    pub const fn encapsulation(self) -> [u8; 4] {
        match self {
            Self::Big => [0, 0, 0, 0],
            Self::Little => [0, 1, 0, 0],
        }
    }
}

/// Why bytes are not a message of the topic.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum Unreadable {
    /// The bytes have another layout, or are cut off; the text is the decoder's.
    #[error("{0}")]
    Layout(String),
    /// The bytes have another layout that happens to begin like this one.
    #[error("{used} of {length} bytes are a message")]
    Leftover {
        /// Bytes that were decoded.
        used: usize,
        /// Bytes of the sample.
        length: usize,
    },
    /// There is more of something than is read.
    #[error("{length} bytes or elements, at most {limit}")]
    TooMuch {
        /// How much there is.
        length: usize,
        /// The most that is read.
        limit: usize,
    },
    /// The hazard command has an undefined value.
    #[error("{0} is not a hazard command")]
    Hazard(u8),
}

/// Decodes the bytes of a sample of a kind, without their encapsulation header.
pub fn read(
    kind: SubscriptionKind,
    sample: SampleId,
    bytes: &[u8],
    endian: Endian,
) -> Result<Input, Unreadable> {
    let bytes = CdrInput { bytes, endian };
    Ok(match kind {
        SubscriptionKind::Groups(store) => bytes.whole::<TrafficLightGroupArray>()?.for_store(store).into(),
        SubscriptionKind::Camera => bytes.whole::<TrafficLightGroupArray>()?.for_arbiter().into(),
        SubscriptionKind::Clock => TrafficLightInput::Clock(bytes.whole::<Clock>()?.clock.into()).into(),
        SubscriptionKind::Command => {
            TrafficLightInput::Command(bytes.whole::<std_msgs::String>()?.data).into()
        }
        SubscriptionKind::Odometry => Input::Planner(bytes.whole::<Odometry>()?.into()),
        SubscriptionKind::Route => Input::Planner(bytes.whole::<LaneletRoute>()?.into()),
        SubscriptionKind::PlannedPath => Input::Planner(bytes.whole::<PathWithLaneId>()?.into()),
        SubscriptionKind::Trajectory => Input::Planner(bytes.whole::<Trajectory>()?.into()),
        SubscriptionKind::Factors(topic) => {
            Input::Planner(bytes.whole::<PlanningFactorArray>()?.into_input(topic))
        }
        SubscriptionKind::ModifiedGoal => {
            let goal = bytes.whole::<PoseWithUuidStamped>();
            // Some releases append whether the goal may be moved.
            let flagged = |_| bytes.whole::<(PoseWithUuidStamped, bool)>().map(|(goal, _)| goal);
            Input::Planner(goal.or_else(flagged)?.into())
        }
        SubscriptionKind::OperationMode => Input::Planner(bytes.whole::<OperationModeState>()?.into()),
        SubscriptionKind::Scenario => Input::Planner(bytes.whole::<Scenario>()?.into()),
        SubscriptionKind::HazardRequest => {
            let message: HazardLightsCommand = bytes.whole()?;
            match message.command.into() {
                EnumOrUnknown::Known(request) => Input::Planner(PlannerInput::HazardRequest(request)),
                EnumOrUnknown::Unknown(number) => return Err(Unreadable::Hazard(number)),
            }
        }
        SubscriptionKind::OwnTurnCommand => {
            let command = bytes.whole::<TurnIndicatorsCommand>()?.command.into();
            Input::Planner(PlannerInput::OwnTurnCommand(command))
        }
        SubscriptionKind::OwnHazardCommand => {
            let command = bytes.whole::<HazardLightsCommand>()?.command.into();
            Input::Planner(PlannerInput::OwnHazardCommand(command))
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

/// Decodes a message from its bytes, without their encapsulation header.
///
/// # Errors
/// Bytes of another layout.
pub fn read_message<M: DeserializeOwned>(bytes: &[u8], endian: Endian) -> Result<M, Unreadable> {
    CdrInput { bytes, endian }.whole()
}

/// Returns the byte order that the encapsulation header of a message names, and the bytes behind it; `None` for another encoding than
/// plain CDR.
pub const fn encapsulated(message: &[u8]) -> Option<(Endian, &[u8])> {
    match message {
        [0, 0, _, _, bytes @ ..] => Some((Endian::Big, bytes)),
        [0, 1, _, _, bytes @ ..] => Some((Endian::Little, bytes)),
        _ => None,
    }
}

#[derive(Clone, Copy)]
struct CdrInput<'a> {
    bytes: &'a [u8],
    endian: Endian,
}

impl CdrInput<'_> {
    /// Decodes a message that takes all of the bytes, but for padding to a multiple of four: another layout may decode
    /// by chance, but hardly to its end.
    fn whole<M: DeserializeOwned>(self) -> Result<M, Unreadable> {
        let read = match self.endian {
            Endian::Big => cdr_encoding::from_bytes::<M, BigEndian>(self.bytes),
            Endian::Little => cdr_encoding::from_bytes::<M, LittleEndian>(self.bytes),
        };
        let (message, used) = read.map_err(|error| Unreadable::Layout(error.to_string()))?;
        match self.bytes.len().checked_sub(used) {
            Some(0..=3) => Ok(message),
            Some(_) | None => Err(Unreadable::Leftover { used, length: self.bytes.len() }),
        }
    }
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
