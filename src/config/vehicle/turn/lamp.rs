//! `lamp = { … }` of `[turn]`: the times of lamps, which flash.

use std::time::Duration;

use super::super::binder::Binder;
use crate::config::reading::checker::Keywords;
use crate::config::reading::fields::Fields;
use crate::core::dbc::model::Message;
use crate::core::vehicle_lights::binding::{SidePair, TurnSource};
use crate::core::vehicle_lights::lamp::LampSettings;
use crate::core::vehicle_lights::lamp::timing::{Sampling, Unresolvable, resolvable};

/// Default of the time from a change of a lamp to its frame.
const DEFAULT_LATENCY: Duration = Duration::from_millis(100);

/// Occasions at which a message is sent; true for each change of a lamp.
const ON_CHANGE: Keywords<bool> = &[("cyclic", false), ("on_change", true)];

/// Binds lamps as a source: the `pair` of `fields` with their `times`.
pub(super) fn lamps(
    binder: &Binder<'_>,
    pair: SidePair,
    fields: &Fields<'_>,
    times: &Fields<'_>,
) -> Option<TurnSource> {
    let [left, right] = [&pair.left, &pair.right].map(|role| binder.signals[role.signal.0].message);
    if left != right {
        let reason = "the lamps are in different messages, so they are not received at the same time";
        fields.refuse("right_signal", reason, "bind two lamps of one message");
        return None;
    }
    let message = binder.messages[left.0].1;
    let sampling = sampling(fields, times, message)?;
    let default = LampSettings::for_message(sampling);
    let limit = |key, default| times.limit(key).unwrap_or(default);
    let settings = LampSettings {
        hold: limit("hold_ms", default.hold),
        confirm: limit("confirm_ms", default.confirm),
        stuck_on_after: limit("stuck_on_ms", default.stuck_on_after),
        fast_period: limit("fast_period_ms", default.fast_period),
        ..default
    };
    let why = match resolvable(sampling, settings.hold) {
        Ok(resolution) => return Some(TurnSource::Lamps { pair, settings, resolution }),
        Err(why) => why,
    };
    let (key, remedy) = match why {
        Unresolvable::TooSlow { .. } => {
            ("period_ms", "bind a logical or request signal, or a message sent at each change (lamp.sent)")
        }
        Unresolvable::HoldTooShort { .. } => ("hold_ms", "remove hold_ms: the default is long enough"),
    };
    let at = if times.has(key) { times.at(key) } else { fields.at("left_signal") };
    binder.refuse(at, format!("{}: {why}", message.name), remedy);
    None
}

fn sampling(fields: &Fields<'_>, times: &Fields<'_>, message: &Message) -> Option<Sampling> {
    if times.keyword("sent", ON_CHANGE).unwrap_or_default() {
        times.set_form("with sent = \"on_change\"");
        return Some(Sampling::OnChange { latency: times.limit("latency_ms").unwrap_or(DEFAULT_LATENCY) });
    }
    times.set_form("with sent = \"cyclic\"");
    let cycle = message.cycle_ms.filter(|cycle| *cycle > 0).map(|ms| Duration::from_millis(ms.into()));
    if cycle.is_none() && !times.has("period_ms") {
        let reason = format!("no period for {}: the DBC has no GenMsgCycleTime for it", message.name);
        fields.refuse("left_signal", reason, "add lamp = { period_ms = … }");
    }
    let period = times.limit("period_ms").or(cycle)?;
    Some(Sampling::Cyclic { period, jitter: times.limit("jitter_ms").unwrap_or(period / 10) })
}
