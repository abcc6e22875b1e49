//! `lamp = { … }` of `[turn]`: the times of lamps, which blink.

use std::ops::Range;
use std::time::Duration;

use serde::Deserialize;
use toml::Spanned;

use super::super::binder::Binder;
use super::super::keys::refuse_given;
use crate::core::vehicle_lights::binding::{SidePair, TurnSource};
use crate::core::vehicle_lights::lamp::LampSettings;
use crate::core::vehicle_lights::lamp::timing::{Sampling, Unresolvable, resolvable};

/// Time from a change of a lamp to its frame when the profile gives none.
const DEFAULT_LATENCY: Duration = Duration::from_millis(100);

/// `lamp = { … }`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LampFile {
    /// When the message shows the lamps.
    #[serde(default)]
    pub sent: SentFile,
    /// Time from frame to frame, ms.
    pub period_ms: Option<Spanned<u64>>,
    /// By how much more frames may be apart, ms.
    pub jitter_ms: Option<Spanned<u64>>,
    /// Longest time from a change to its frame, ms.
    pub latency_ms: Option<Spanned<u64>>,
    /// How long a side stays on after it was last seen lit, ms.
    pub hold_ms: Option<Spanned<u64>>,
    /// How long both lamps must be lit together to mean hazard, ms.
    pub confirm_ms: Option<Spanned<u64>>,
    /// Longest time a lamp may be lit without a dark frame, ms.
    pub stuck_on_ms: Option<Spanned<u64>>,
    /// A mean flash cycle below this is too fast, ms.
    pub fast_period_ms: Option<Spanned<u64>>,
}

/// `sent = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SentFile {
    /// Again and again.
    #[default]
    Cyclic,
    /// At each change of a lamp.
    OnChange,
}

/// Lamps as a source; `sides` is where the left and the right one are named.
pub(super) fn lamps(
    binder: &mut Binder<'_>,
    pair: SidePair,
    [at_left, at_right]: [Range<usize>; 2],
    times: Option<&Spanned<LampFile>>,
) -> Option<TurnSource> {
    let [left, right] = [&pair.left, &pair.right].map(|role| binder.signals[role.signal.0].message);
    if left != right {
        let reason = "the lamps come in different messages, so they are never seen at the same time";
        binder.refuse(at_right, reason, "bind two lamps of one message");
        return None;
    }
    let message = binder.messages[left.0].1;
    let empty = LampFile::default();
    let times = times.map_or(&empty, Spanned::get_ref);
    let cycle = message.cycle_ms.filter(|cycle| *cycle > 0).map(u64::from);
    let sampling = sampling(binder, times, cycle, &at_left, &message.name)?;
    let default = LampSettings::for_message(sampling);
    let settings = LampSettings {
        hold: binder.checker.limit(times.hold_ms.as_ref()).unwrap_or(default.hold),
        confirm: binder.checker.limit(times.confirm_ms.as_ref()).unwrap_or(default.confirm),
        stuck_on_after: binder.checker.limit(times.stuck_on_ms.as_ref()).unwrap_or(default.stuck_on_after),
        fast_period: binder.checker.limit(times.fast_period_ms.as_ref()).unwrap_or(default.fast_period),
        ..default
    };
    match resolvable(sampling, settings.hold) {
        Ok(resolution) => Some(TurnSource::Lamps { pair, settings, resolution }),
        Err(why) => {
            let given = match why {
                Unresolvable::TooSlow { .. } => &times.period_ms,
                Unresolvable::HoldTooShort { .. } => &times.hold_ms,
            };
            let at = given.as_ref().map_or(at_left, Spanned::span);
            let remedy = match why {
                Unresolvable::TooSlow { .. } => {
                    "bind a logical or request signal, or a message sent at each change (lamp.sent)"
                }
                Unresolvable::HoldTooShort { .. } => "remove hold_ms: the default is long enough",
            };
            binder.refuse(at, format!("{}: {why}", message.name), remedy);
            None
        }
    }
}

fn sampling(
    binder: &mut Binder<'_>,
    times: &LampFile,
    cycle_ms: Option<u64>,
    at: &Range<usize>,
    message: &str,
) -> Option<Sampling> {
    match times.sent {
        SentFile::OnChange => {
            for cyclic in [("period_ms", &times.period_ms), ("jitter_ms", &times.jitter_ms)] {
                refuse_given(binder, cyclic, "has no meaning with sent = \"on_change\"", "give latency_ms");
            }
            Some(Sampling::OnChange {
                latency: binder.checker.limit(times.latency_ms.as_ref()).unwrap_or(DEFAULT_LATENCY),
            })
        }
        SentFile::Cyclic => {
            let latency = ("latency_ms", &times.latency_ms);
            refuse_given(binder, latency, "has no meaning with sent = \"cyclic\"", "give period_ms");
            let default = cycle_ms.map(Duration::from_millis);
            if default.is_none() && times.period_ms.is_none() {
                let reason = format!("no period for {message}: the DBC has no GenMsgCycleTime for it");
                binder.refuse(at.clone(), reason, "add lamp = { period_ms = … }");
                return None;
            }
            let period =
                binder.checker.limit(times.period_ms.as_ref()).unwrap_or(default.unwrap_or_default());
            let jitter = binder.checker.limit(times.jitter_ms.as_ref()).unwrap_or(period / 10);
            Some(Sampling::Cyclic { period, jitter })
        }
    }
}
