//! `lamp = { … }` of `[turn]`: the times of flashing lamps.

use std::time::Duration;

use super::super::binder::Binder;
use crate::config::reading::{Fields, Keywords};
use can_signal::dbc::model::Message;
use gateway_core::vehicle_lights::binding::{SidePair, TurnSource};
use gateway_core::vehicle_lights::lamp::LampSettings;
use gateway_core::vehicle_lights::lamp::timing::{Sampling, Unresolvable, resolvable};

/// Default time from a change of a lamp to its frame.
const DEFAULT_LATENCY: Duration = Duration::from_millis(100);

/// Occasions at which a message is sent; true for each change of a lamp.
const ON_CHANGE: Keywords<bool> = &[("cyclic", false), ("on_change", true)];

/// The given times; each is `None` if it is absent or was refused.
struct Given {
    /// True for lamps that are sent at each change; `None` if it was refused.
    on_change: Option<bool>,
    latency: Option<Duration>,
    period: Option<Duration>,
    jitter: Option<Duration>,
}

/// Reads the occasions at which the lamps are sent, and the corresponding keys.
fn given(times: &Fields<'_>) -> Given {
    let on_change = times.keyword("sent", ON_CHANGE).or((!times.has("sent")).then_some(false));
    let (is_on_change, is_cyclic) = (on_change == Some(true), on_change == Some(false));
    times.set_form(if is_on_change { "with sent = \"on_change\"" } else { "with sent = \"cyclic\"" });
    if on_change.is_none() {
        times.accept_rest();
    }
    let limit = |key, is_known: bool| if is_known { times.limit(key) } else { None };
    Given {
        on_change,
        latency: limit("latency_ms", !is_cyclic),
        period: limit("period_ms", !is_on_change),
        jitter: limit("jitter_ms", !is_on_change),
    }
}

/// Binds lamps as a source: the `pair` of `fields`, unless it was refused, with their `times`.
pub(super) fn lamps(
    binder: &Binder<'_>,
    pair: Option<SidePair>,
    fields: &Fields<'_>,
    times: &Fields<'_>,
) -> Option<TurnSource> {
    let given = given(times);
    let [hold, confirm, stuck_on_after, fast_period] =
        ["hold_ms", "confirm_ms", "stuck_on_ms", "fast_period_ms"].map(|key| times.limit(key));
    let pair = pair?;
    let [left, right] = [&pair.left, &pair.right].map(|role| binder.signals[role.signal.0].message);
    if left != right {
        let reason = "the lamps are in different messages, so they are not received at the same time";
        return fields.refused("right_signal", reason, "bind two lamps of one message");
    }
    let message = binder.messages[left.0].1;
    let sampling = sampling(fields, times, &given, message)?;
    let default = LampSettings::for_message(sampling);
    let settings = LampSettings {
        hold: hold.unwrap_or(default.hold),
        confirm: confirm.unwrap_or(default.confirm),
        stuck_on_after: stuck_on_after.unwrap_or(default.stuck_on_after),
        fast_period: fast_period.unwrap_or(default.fast_period),
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
    binder.checker.refused(at, format!("{}: {why}", message.name), remedy)
}

fn sampling(fields: &Fields<'_>, times: &Fields<'_>, given: &Given, message: &Message) -> Option<Sampling> {
    if given.on_change? {
        return Some(Sampling::OnChange { latency: given.latency.unwrap_or(DEFAULT_LATENCY) });
    }
    let cycle = message.cycle_ms.filter(|cycle| *cycle > 0).map(|ms| Duration::from_millis(ms.into()));
    if cycle.is_none() && !times.has("period_ms") {
        let reason = format!("no period for {}: the DBC has no GenMsgCycleTime for it", message.name);
        fields.refuse("left_signal", reason, "add lamp = { period_ms = … }");
    }
    let period = given.period.or(cycle)?;
    Some(Sampling::Cyclic { period, jitter: given.jitter.unwrap_or(period / 10) })
}
