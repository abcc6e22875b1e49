//! The engaged gear, from one or more signals that name it, most trusted first.

use std::time::Duration;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::state::{Judged, StatusContext, StatusReason};
use can_signal::validation::table::{Role, SignalIndex};
use gateway_base::names::{named_by_variant, state_word};
use gateway_base::time::{MonoTime, deadline_after};

/// The engaged gear, as in `GearReport.report`. `NONE` (0) is not among them, since it must never be
/// published.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
#[repr(u8)]
#[allow(missing_docs)] // their names are those of the message
pub enum Gear {
    Neutral = 1,
    Drive = 2,
    #[serde(rename = "DRIVE_2")]
    Drive2 = 3,
    #[serde(rename = "DRIVE_3")]
    Drive3 = 4,
    #[serde(rename = "DRIVE_4")]
    Drive4 = 5,
    #[serde(rename = "DRIVE_5")]
    Drive5 = 6,
    #[serde(rename = "DRIVE_6")]
    Drive6 = 7,
    #[serde(rename = "DRIVE_7")]
    Drive7 = 8,
    #[serde(rename = "DRIVE_8")]
    Drive8 = 9,
    #[serde(rename = "DRIVE_9")]
    Drive9 = 10,
    #[serde(rename = "DRIVE_10")]
    Drive10 = 11,
    #[serde(rename = "DRIVE_11")]
    Drive11 = 12,
    #[serde(rename = "DRIVE_12")]
    Drive12 = 13,
    #[serde(rename = "DRIVE_13")]
    Drive13 = 14,
    #[serde(rename = "DRIVE_14")]
    Drive14 = 15,
    #[serde(rename = "DRIVE_15")]
    Drive15 = 16,
    #[serde(rename = "DRIVE_16")]
    Drive16 = 17,
    #[serde(rename = "DRIVE_17")]
    Drive17 = 18,
    #[serde(rename = "DRIVE_18")]
    Drive18 = 19,
    Reverse = 20,
    #[serde(rename = "REVERSE_2")]
    Reverse2 = 21,
    Park = 22,
    Low = 23,
    #[serde(rename = "LOW_2")]
    Low2 = 24,
}

named_by_variant!(Gear);

impl Gear {
    /// Returns all gears.
    pub fn all() -> impl Iterator<Item = Self> + Clone {
        const FORWARD: [Gear; 18] = [
            Gear::Drive,
            Gear::Drive2,
            Gear::Drive3,
            Gear::Drive4,
            Gear::Drive5,
            Gear::Drive6,
            Gear::Drive7,
            Gear::Drive8,
            Gear::Drive9,
            Gear::Drive10,
            Gear::Drive11,
            Gear::Drive12,
            Gear::Drive13,
            Gear::Drive14,
            Gear::Drive15,
            Gear::Drive16,
            Gear::Drive17,
            Gear::Drive18,
        ];
        let others = [Self::Reverse, Self::Reverse2, Self::Park, Self::Low, Self::Low2];
        std::iter::once(Self::Neutral).chain(FORWARD).chain(others)
    }

    /// Returns the direction in which the engine moves the vehicle: 1 forward, −1 backward; `None` in neutral
    /// and park.
    pub fn direction(self) -> Option<f64> {
        if matches!(self, Self::Neutral | Self::Park) {
            return None;
        }
        Some(if matches!(self, Self::Reverse | Self::Reverse2) { -1.0 } else { 1.0 })
    }
}

/// Meaning of a raw value for the gear.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GearCode {
    /// This gear is engaged.
    Engaged(Gear),
    /// The gearbox is between two gears.
    Between,
    /// Any gear except reverse, if the gearbox shows only reverse.
    NotReverse,
}

impl GearCode {
    /// Returns the words used in texts, e.g. `drive` or `between gears`.
    pub fn words(self) -> String {
        match self {
            Self::Engaged(gear) => state_word(&gear),
            Self::Between => "between gears".to_owned(),
            Self::NotReverse => "not reverse".to_owned(),
        }
    }
}

/// Binding of the gear.
#[derive(Debug, Clone, PartialEq)]
pub struct GearBinding {
    /// At least one source, most trusted first.
    pub sources: Vec<GearSource>,
    /// Longest time for which the gearbox may be between two gears.
    pub shifting: Duration,
}

/// A signal that names the gear.
#[derive(Debug, Clone, PartialEq)]
pub struct GearSource {
    /// Name in diagnostics; empty for the only source.
    pub name: String,
    /// Meanings of its raw values.
    pub role: Role<GearCode>,
}

/// Time at which the gearbox left a gear, for each source.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Shifting(Vec<Option<MonoTime>>);

impl Shifting {
    /// Returns the gear that a code names. A gearbox that stays between gears counts as faulty after
    /// `shifting`.
    pub fn judge(
        &mut self,
        binding: &GearBinding,
        source: usize,
        code: Judged<GearCode>,
        context: StatusContext<'_>,
    ) -> Judged<Gear> {
        let signal = binding.sources[source].role.signal;
        let since = match code {
            Ok((GearCode::Between, received)) => Some(self.since(source).unwrap_or(received.at)),
            Ok(_) | Err(_) => None,
        };
        self.0.resize(binding.sources.len(), None);
        self.0[source] = since;
        let (code, received) = code?;
        match code {
            GearCode::Engaged(gear) => Ok((gear, received)),
            GearCode::NotReverse => Err(StatusReason::OnlyReverseShown(signal)),
            GearCode::Between => {
                let is_long = since.is_some_and(|since| !context.now.mono.is_within(binding.shifting, since));
                Err(StatusReason::BetweenGears { signal, is_long })
            }
        }
    }

    fn since(&self, source: usize) -> Option<MonoTime> {
        self.0.get(source).copied().flatten()
    }

    /// Returns the time from which a gearbox has been between gears for too long.
    pub fn next_deadline(&self, binding: &GearBinding, now: MonoTime) -> Option<MonoTime> {
        let deadlines = self.0.iter().flatten().map(|since| deadline_after(*since, binding.shifting));
        deadlines.filter(|at| *at > now).min()
    }
}

impl GearBinding {
    /// Returns the signals of all sources.
    pub fn signals(&self) -> impl Iterator<Item = SignalIndex> {
        self.sources.iter().map(|source| source.role.signal)
    }
}
