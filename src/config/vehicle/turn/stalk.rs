//! `stalk = { … }` of `[turn]`: rules and times of a stalk that springs back.

use serde::Deserialize;
use toml::Spanned;

use super::super::binder::Binder;
use crate::config::reading::keyword::{Keyword, keywords};
use crate::core::vehicle_lights::stalk::{Comfort, OppositePress, RepeatedPress, StalkSettings};

keywords!(OppositePress { "cancels" => OppositePress::Cancels, "switches" => OppositePress::Switches });
keywords!(RepeatedPress { "cancels" => RepeatedPress::Cancels, "keeps" => RepeatedPress::Keeps });

/// `stalk = { … }`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StalkFile {
    /// Flashes after a tap.
    pub comfort_flashes: Option<Spanned<u8>>,
    /// Blinking after a tap, ms.
    pub comfort_ms: Option<Spanned<u64>>,
    /// What a tap against the side that is on does.
    pub opposite_half: Option<Keyword<OppositePress>>,
    /// What a full press against the side that is on does.
    pub opposite_full: Option<Keyword<OppositePress>>,
    /// What a press to the side that is latched does.
    pub repeat: Option<Keyword<RepeatedPress>>,
    /// Longest time a full press is believed to last, ms.
    pub max_on_ms: Option<Spanned<u64>>,
    /// Longest time of unknown positions that cannot hide a press, ms.
    pub max_gap_ms: Option<Spanned<u64>>,
    /// How long the stalk is watched before its state is known, ms.
    pub startup_delay_ms: Option<Spanned<u64>>,
}

/// The rules and times; what the profile does not say is as in most cars.
pub(super) fn stalk_settings(binder: &mut Binder<'_>, file: Option<&Spanned<StalkFile>>) -> StalkSettings {
    let empty = StalkFile::default();
    let file = file.map_or(&empty, Spanned::get_ref);
    let default = StalkSettings::default();
    if let (Some(_), Some(time)) = (&file.comfort_flashes, &file.comfort_ms) {
        let reason = "comfort_flashes and comfort_ms exclude each other";
        binder.refuse(time.span(), reason, "keep one of them");
    }
    let comfort = match (&file.comfort_flashes, &file.comfort_ms) {
        (Some(flashes), _) => match default.comfort {
            Comfort::Flashes { per_minute, .. } => Comfort::Flashes { count: *flashes.get_ref(), per_minute },
            Comfort::For(_) => default.comfort,
        },
        (None, Some(time)) => Comfort::For(binder.checker.limit(Some(time)).unwrap_or_default()),
        (None, None) => default.comfort,
    };
    StalkSettings {
        comfort,
        opposite_half: file.opposite_half.map_or(default.opposite_half, |given| given.0),
        opposite_full: file.opposite_full.map_or(default.opposite_full, |given| given.0),
        repeat: file.repeat.map_or(default.repeat, |given| given.0),
        max_on: binder.checker.limit(file.max_on_ms.as_ref()),
        max_gap: binder.checker.limit(file.max_gap_ms.as_ref()).unwrap_or(default.max_gap),
        startup_delay: binder
            .checker
            .limit(file.startup_delay_ms.as_ref())
            .unwrap_or(default.startup_delay.max(comfort.duration())),
    }
}
