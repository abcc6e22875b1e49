//! Autoware's commands for the lights, numbered as in its messages.

use derive_more::Display;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use gateway_base::names::display_by_name;

/// Command for the turn indicators (`TurnIndicatorsCommand.command`).
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
#[repr(u8)]
pub enum TurnCommand {
    /// `NO_COMMAND`, 0: nothing is known or requested.
    #[default]
    NoCommand = 0,
    /// `DISABLE`, 1: both sides off.
    Disable = 1,
    /// `ENABLE_LEFT`, 2: left side on.
    Left = 2,
    /// `ENABLE_RIGHT`, 3: right side on.
    Right = 3,
}

/// Command for the hazard lights (`HazardLightsCommand.command`).
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
#[repr(u8)]
pub enum HazardCommand {
    /// `NO_COMMAND`, 0: nothing is known or requested.
    #[default]
    NoCommand = 0,
    /// `DISABLE`, 1: lights off.
    Disable = 1,
    /// `ENABLE`, 2: lights on.
    Enable = 2,
}

/// A number in a message that stands for a value of `T`, or for no value if the sender is newer than this
/// gateway or faulty.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Display)]
pub enum EnumOrUnknown<T> {
    /// A number that the message defines.
    Known(T),
    /// Any other number, as received.
    Unknown(u8),
}

impl<T> EnumOrUnknown<T> {
    /// Returns the value, if the message defines it.
    pub fn known(self) -> Option<T> {
        if let Self::Known(value) = self { Some(value) } else { None }
    }
}

/// A type whose values are numbered from 0 without a gap.
pub trait Numbered: Copy + 'static {
    /// All values in the order of their numbers, from 0.
    const ALL: &'static [Self];
}

impl Numbered for TurnCommand {
    const ALL: &'static [Self] = &[Self::NoCommand, Self::Disable, Self::Left, Self::Right];
}

impl Numbered for HazardCommand {
    const ALL: &'static [Self] = &[Self::NoCommand, Self::Disable, Self::Enable];
}

impl<T: Numbered> From<u8> for EnumOrUnknown<T> {
    fn from(number: u8) -> Self {
        T::ALL.get(usize::from(number)).map_or(Self::Unknown(number), |value| Self::Known(*value))
    }
}

display_by_name!(TurnCommand, HazardCommand);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_is_the_value_that_casts_to_it_or_unknown() {
        for number in 0..=u8::MAX {
            match EnumOrUnknown::<TurnCommand>::from(number) {
                EnumOrUnknown::Known(command) => assert_eq!(command as u8, number),
                EnumOrUnknown::Unknown(unknown) => assert_eq!((unknown, number > 3), (number, true)),
            }
            match EnumOrUnknown::<HazardCommand>::from(number) {
                EnumOrUnknown::Known(command) => assert_eq!(command as u8, number),
                EnumOrUnknown::Unknown(unknown) => assert_eq!((unknown, number > 2), (number, true)),
            }
        }
    }
}
