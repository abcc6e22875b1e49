//! Plausibility alarms, one row each: meaning, withheld reports and remedy.

/// A contradiction between parts of the motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
#[allow(missing_docs)] // described by the rows
pub enum Alarm {
    FrontLeftWheel,
    FrontRightWheel,
    RearLeftWheel,
    RearRightWheel,
    WheelsContradict,
    SpeedsDiffer,
    SpeedsContradict,
    SpeedJumps,
    SpeedLeaps,
    YawRateDiffers,
    YawRateContradicts,
    SteeringContradicts,
    RatesContradict,
    YawRateFrozen,
    YawRateJumps,
    YawRateLeaps,
    SteeringFrozen,
    SteeringJumps,
    SteeringLeaps,
    DirectionAgainstGear,
    MovesInPark,
}

/// Effect of an alarm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// Diagnostics show a warning.
    Warn,
    /// The source is not used while another is available.
    LeaveOut,
    /// The velocity is withheld.
    WithholdVelocity,
    /// Steering and velocity are withheld, since one of them is wrong.
    WithholdBoth,
    /// The steering is withheld.
    WithholdSteering,
}

/// Description of an alarm.
#[derive(Debug, Clone, Copy)]
#[allow(missing_docs)] // a field without a comment is what its name says
pub struct AlarmRow {
    pub alarm: Alarm,
    /// Text for display that describes the contradiction.
    pub text: &'static str,
    pub effect: Effect,
    /// Remedy, a clause in lower case without a full stop.
    pub remedy: &'static str,
}

const WHEEL_REMEDY: &str = "check the sensor of the wheel and its tyre";
const WHEELS_REMEDY: &str =
    "check the sensors of the wheels and their tyres; a wheel that locks or spins is no fault of theirs";
const JUMP_REMEDY: &str = "check unit and scale of the signal";
const YAW_REMEDY: &str = "check sign, unit and zero of the yaw rate, and the steering ratio";
const STEERING_REMEDY: &str = "check sign, unit and zero of the steering angle, and the steering ratio";
const SPEED_REMEDY: &str = "check unit and scale of both sources";

/// Alarms in the order of [`Alarm`].
#[rustfmt::skip]
pub const ALARMS: [AlarmRow; 21] = [
    row(Alarm::FrontLeftWheel, "the front left wheel does not move as the others do", Effect::LeaveOut, WHEEL_REMEDY),
    row(Alarm::FrontRightWheel, "the front right wheel does not move as the others do", Effect::LeaveOut, WHEEL_REMEDY),
    row(Alarm::RearLeftWheel, "the rear left wheel does not move as the others do", Effect::LeaveOut, WHEEL_REMEDY),
    row(Alarm::RearRightWheel, "the rear right wheel does not move as the others do", Effect::LeaveOut, WHEEL_REMEDY),
    row(Alarm::WheelsContradict, "the wheels contradict each other, and nothing tells which of them are right", Effect::WithholdVelocity, WHEELS_REMEDY),
    row(Alarm::SpeedsDiffer, "two sources of the speed differ by more than 5 % and 0.5 m/s", Effect::Warn, SPEED_REMEDY),
    row(Alarm::SpeedsContradict, "two sources of the speed differ by more than 30 % and 1 m/s", Effect::WithholdVelocity, SPEED_REMEDY),
    row(Alarm::SpeedJumps, "the speed changes by more than 15 m/s²", Effect::Warn, JUMP_REMEDY),
    row(Alarm::SpeedLeaps, "the speed changes by more than 30 m/s²", Effect::WithholdVelocity, JUMP_REMEDY),
    row(Alarm::YawRateDiffers, "the yaw rate differs from speed and steering by more than 30 % and 0.05 rad/s", Effect::Warn, YAW_REMEDY),
    row(Alarm::YawRateContradicts, "the yaw rate contradicts both the steering and the rear wheels", Effect::LeaveOut, YAW_REMEDY),
    row(Alarm::SteeringContradicts, "the steering contradicts both the yaw rate and the rear wheels", Effect::WithholdSteering, STEERING_REMEDY),
    row(Alarm::RatesContradict, "yaw rate and steering contradict each other", Effect::WithholdBoth, YAW_REMEDY),
    row(Alarm::YawRateFrozen, "the yaw rate stays the same while the vehicle moves", Effect::LeaveOut, YAW_REMEDY),
    row(Alarm::YawRateJumps, "the yaw rate changes by more than 10 rad/s²", Effect::Warn, JUMP_REMEDY),
    row(Alarm::YawRateLeaps, "the yaw rate changes by more than 20 rad/s²", Effect::WithholdVelocity, JUMP_REMEDY),
    row(Alarm::SteeringFrozen, "the steering angle stays the same while the vehicle moves", Effect::Warn, "check the steering sensor"),
    row(Alarm::SteeringJumps, "the angle of the front wheels changes by more than 2 rad/s", Effect::Warn, JUMP_REMEDY),
    row(Alarm::SteeringLeaps, "the angle of the front wheels changes by more than 4 rad/s", Effect::WithholdSteering, JUMP_REMEDY),
    row(Alarm::DirectionAgainstGear, "the vehicle moves against its gear", Effect::Warn, "check the signals of direction and gear; rolling back on a slope is real"),
    row(Alarm::MovesInPark, "the vehicle moves in park", Effect::Warn, "check the signal of the gear, and the wheels"),
];

const fn row(alarm: Alarm, text: &'static str, effect: Effect, remedy: &'static str) -> AlarmRow {
    AlarmRow { alarm, text, effect, remedy }
}

impl AlarmRow {
    /// Returns the remedy as a sentence.
    pub fn remedy_sentence(&self) -> String {
        let mut letters = self.remedy.chars();
        letters
            .next()
            .map_or_else(String::new, |first| format!("{}{}.", first.to_uppercase(), letters.as_str()))
    }
}

impl Alarm {
    /// Alarms of the wheels, in the order in which wheels are bound.
    pub const OF_WHEELS: [Self; 4] =
        [Self::FrontLeftWheel, Self::FrontRightWheel, Self::RearLeftWheel, Self::RearRightWheel];

    /// Alarms that withhold the velocity because its speed is not trusted.
    pub const OF_SPEED: [Self; 3] = [Self::WheelsContradict, Self::SpeedsContradict, Self::SpeedLeaps];

    /// Returns the row of the alarm.
    pub fn row(self) -> &'static AlarmRow {
        &ALARMS[self as usize]
    }
}

/// Set of alarms that are on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AlarmSet(u32);

impl AlarmSet {
    /// Adds an alarm if `is_on`.
    pub fn set(&mut self, alarm: Alarm, is_on: bool) {
        self.0 |= u32::from(is_on) << alarm as u8;
    }

    /// Returns true if the alarm is on.
    pub fn has(self, alarm: Alarm) -> bool {
        self.0 & (1 << alarm as u8) != 0
    }

    /// Returns the alarms of the wheels.
    #[must_use]
    pub fn of_wheels(self) -> Self {
        let first = Alarm::FrontLeftWheel as u8;
        Self(self.0 & ((1 << (Alarm::WheelsContradict as u8 + 1)) - (1 << first)))
    }

    /// Returns the alarms of the report on steering or, if `is_steering` is false, of the report on velocity.
    #[must_use]
    pub fn of_steering(self, is_steering: bool) -> Self {
        let steering =
            [Alarm::SteeringContradicts, Alarm::SteeringFrozen, Alarm::SteeringJumps, Alarm::SteeringLeaps];
        let concerns = |row: &AlarmRow| {
            row.effect == Effect::WithholdBoth || steering.contains(&row.alarm) == is_steering
        };
        let mut set = Self::default();
        self.iter().filter(|row| concerns(row)).for_each(|row| set.set(row.alarm, true));
        set
    }

    /// Returns the alarms that are on, in the order of their rows.
    pub fn iter(self) -> impl Iterator<Item = &'static AlarmRow> {
        ALARMS.iter().filter(move |row| self.has(row.alarm))
    }

    /// Returns the first alarm that is on and has one of these effects.
    pub fn first_with(self, effects: &[Effect]) -> Option<Alarm> {
        self.iter().find(|row| effects.contains(&row.effect)).map(|row| row.alarm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_alarm_is_at_the_position_of_its_row() {
        for row in &ALARMS {
            assert_eq!(row.alarm.row().alarm, row.alarm);
            assert!(row.remedy_sentence().starts_with("Check "), "{}", row.remedy_sentence());
            let mut set = AlarmSet::default();
            set.set(row.alarm, true);
            assert!(set.has(row.alarm) && set.iter().count() == 1, "{}", row.text);
        }
    }
}
