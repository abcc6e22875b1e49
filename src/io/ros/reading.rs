//! A sample's bytes as the gateway's input that its subscription is for. Any bytes are safe to try.

use byteorder::{BigEndian, LittleEndian};
use serde::de::DeserializeOwned;
use thiserror::Error;

use super::messages::{
    ControlModeReport, HazardLightsCommand, LaneletRoute, Odometry, OperationModeState, PathWithLaneId,
    PlanningFactorArray, ReceivedGroups, Scenario, Text, TrafficLightGroupArray, TurnIndicatorsCommand,
};
use super::topics::SubscriptionKind;
use crate::core::command::input::CommandInput;
use crate::core::gateway::event::Input;
use crate::core::traffic_light::input::TrafficLightInput;
use crate::core::turn_signal::planner_input::PlannerInput;

/// Byte order of CDR, as the sample's header tells it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Endian {
    /// `CDR_BE`.
    Big,
    /// `CDR_LE`.
    Little,
}

/// Why bytes are not what the topic is for.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum Unreadable {
    /// Another layout, or cut off.
    #[error("{0}")]
    Layout(String),
    /// Another layout that happens to begin like ours.
    #[error("{used} of {length} bytes are a message")]
    Leftover {
        /// Bytes of what was read.
        used: usize,
        /// Bytes there are.
        length: usize,
    },
    /// A command that does not exist.
    #[error("{0} is not a hazard command")]
    Hazard(u8),
}

/// Reads a sample of a kind, without its encapsulation header.
pub fn read(kind: SubscriptionKind, bytes: &[u8], endian: Endian) -> Result<Input, Unreadable> {
    let bytes = Bytes { bytes, endian };
    Ok(match kind {
        SubscriptionKind::Groups(store) => {
            let message: TrafficLightGroupArray = bytes.whole()?;
            ReceivedGroups::from(&message).for_store(store).into()
        }
        SubscriptionKind::Command => TrafficLightInput::Command(bytes.whole::<Text>()?.data).into(),
        SubscriptionKind::Odometry => Input::Planner(bytes.whole::<Odometry>()?.into()),
        SubscriptionKind::Route => Input::Planner(bytes.whole::<LaneletRoute>()?.into()),
        SubscriptionKind::PlannedPath => Input::Planner(bytes.whole::<PathWithLaneId>()?.into()),
        SubscriptionKind::Factors(topic) => {
            Input::Planner(bytes.whole::<PlanningFactorArray>()?.into_input(topic))
        }
        SubscriptionKind::OperationMode => Input::Planner(bytes.whole::<OperationModeState>()?.into()),
        SubscriptionKind::Scenario => Input::Planner(bytes.whole::<Scenario>()?.into()),
        SubscriptionKind::HazardRequest => {
            let message: HazardLightsCommand = bytes.whole()?;
            let request = message.hazard().ok_or(Unreadable::Hazard(message.command))?;
            Input::Planner(PlannerInput::HazardRequest(request))
        }
        SubscriptionKind::OwnTurnCommand => {
            Input::Planner(PlannerInput::OwnTurnCommand(bytes.whole::<TurnIndicatorsCommand>()?.command))
        }
        SubscriptionKind::OwnHazardCommand => {
            Input::Planner(PlannerInput::OwnHazardCommand(bytes.whole::<HazardLightsCommand>()?.command))
        }
        SubscriptionKind::TurnCommand => {
            let message: TurnIndicatorsCommand = bytes.whole()?;
            CommandInput::Turn { raw: message.command, stamp: message.stamp.into() }.into()
        }
        SubscriptionKind::HazardCommand => {
            let message: HazardLightsCommand = bytes.whole()?;
            CommandInput::Hazard { raw: message.command, stamp: message.stamp.into() }.into()
        }
        SubscriptionKind::ControlMode => {
            let message: ControlModeReport = bytes.whole()?;
            CommandInput::ControlMode { raw: message.mode, stamp: message.stamp.into() }.into()
        }
    })
}

#[derive(Clone, Copy)]
struct Bytes<'a> {
    bytes: &'a [u8],
    endian: Endian,
}

impl Bytes<'_> {
    /// A message that fills its bytes, but for what fills up to a multiple of four: another layout
    /// would decode by chance, but hardly to its end.
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
        read(SubscriptionKind::Command, bytes, endian).ok()
    }

    #[test]
    fn text_is_read_in_both_byte_orders_and_with_what_fills_up() {
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
