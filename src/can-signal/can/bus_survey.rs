//! Survey of a bus over a few seconds: frames, error frames by kind, and distance of the stamps from the
//! clock.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::error_frame::{bits, class, class_name};
use super::{CanId, CanInput, IdMatch};
use gateway_base::time::WallStamp;

/// Largest number of distinct identifiers counted; a classical bus has 2,048.
const MAX_IDS: usize = 4096;

/// Counts of the inputs of one bus.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct BusSurvey {
    /// Data frames.
    pub frames: u64,
    /// Distinct identifiers, at most 4,096.
    pub ids: usize,
    /// Frames with an identifier that the vehicle profile reads; `None` without a profile.
    pub of_profile: Option<u64>,
    /// Error frames, except pure recovery announcements.
    pub error_frames: u64,
    /// Error frames by error class.
    pub errors: BTreeMap<String, u64>,
    /// Frames that the kernel dropped because they were not read in time.
    pub drops: u64,
    /// Largest distance between a frame's stamp and the clock when the frame was handled, ms.
    pub stamp_distance_ms: i64,
}

/// Collects a [`BusSurvey`].
#[derive(Debug, Default)]
pub struct BusSurveyor {
    counted: BusSurvey,
    seen: BTreeSet<CanId>,
    /// Identifiers of the profile; `None` without one.
    profile: Option<Vec<IdMatch>>,
}

impl BusSurveyor {
    /// Starts an empty survey; `profile` has the identifiers that the vehicle profile reads.
    pub fn new(profile: Option<Vec<IdMatch>>) -> Self {
        let counted = BusSurvey { of_profile: profile.as_ref().map(|_| 0), ..BusSurvey::default() };
        Self { counted, seen: BTreeSet::new(), profile }
    }

    /// Counts an input that was handled at `now`.
    pub fn take(&mut self, input: &CanInput, now: WallStamp) {
        let counted = &mut self.counted;
        match input {
            CanInput::Frame { frame, stamp, .. } => {
                counted.frames += 1;
                if self.seen.len() < MAX_IDS {
                    self.seen.insert(frame.id());
                }
                let is_read = |ids: &Vec<IdMatch>| ids.iter().any(|ids| ids.contains(frame.id()));
                if let (Some(count), true) =
                    (&mut counted.of_profile, self.profile.as_ref().is_some_and(is_read))
                {
                    *count += 1;
                }
                let distance = (now.as_nanos().saturating_sub(stamp.as_nanos())) / 1_000_000;
                if distance.saturating_abs() > counted.stamp_distance_ms.saturating_abs() {
                    counted.stamp_distance_ms = distance;
                }
            }
            CanInput::ErrorFrame { error, .. } if !error.is_recovery() => {
                counted.error_frames += 1;
                for bit in bits(error.class).filter(|bit| *bit != class::COUNTERS) {
                    *counted.errors.entry(class_name(bit).to_owned()).or_default() += 1;
                }
            }
            CanInput::Drops { lost, .. } => counted.drops += u64::from(*lost),
            CanInput::ErrorFrame { .. }
            | CanInput::Link { .. }
            | CanInput::Controller { .. }
            | CanInput::BadRecords { .. } => {}
        }
    }

    /// Returns the counts.
    pub fn finish(self) -> BusSurvey {
        BusSurvey { ids: self.seen.len(), ..self.counted }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::can::{BusIndex, ErrorFrame, Frame};

    const BUS: BusIndex = BusIndex(0);

    fn frame(id: u16, stamp_ms: i64) -> CanInput {
        let frame = Frame::classic(CanId::Standard(id), &[]).unwrap();
        CanInput::Frame { bus: BUS, frame, stamp: WallStamp::from_nanos(stamp_ms * 1_000_000) }
    }

    #[test]
    fn frames_errors_by_class_and_distance_of_stamps_are_counted() {
        let profile = vec![CanId::Standard(0x123).into()];
        let mut surveyor = BusSurveyor::new(Some(profile));
        let now = WallStamp::from_nanos(5_000_000_000);
        for input in [
            frame(0x123, 4_998),
            frame(0x123, 5_400),
            frame(0x7FF, 5_000),
            CanInput::ErrorFrame { bus: BUS, error: ErrorFrame::new(0x88, &[0; 8]) },
            CanInput::ErrorFrame { bus: BUS, error: ErrorFrame::new(0x204, &[0, 0x40]) },
            CanInput::Drops { bus: BUS, lost: 7 },
        ] {
            surveyor.take(&input, now);
        }
        let errors = [("bus-error".to_owned(), 1), ("protocol".to_owned(), 1)].into();
        let expected = BusSurvey {
            frames: 3,
            ids: 2,
            of_profile: Some(2),
            error_frames: 1,
            errors,
            drops: 7,
            stamp_distance_ms: -400,
        };
        assert_eq!(surveyor.finish(), expected);
        assert_eq!(BusSurveyor::new(None).finish().of_profile, None);
    }
}
