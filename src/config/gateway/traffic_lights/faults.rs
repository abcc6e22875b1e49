//! `[traffic_lights.faults.<channel>]`: faults on purpose; each is off by default.

use crate::config::reading::fields::Fields;
use crate::core::traffic_light::bulb::Color;
use crate::core::traffic_light::faults::{ChannelFaults, Confusion, FaultSettings, MAX_LATENCY, Spells};

/// Reads the faults of one channel.
pub(super) fn faults(fields: Fields<'_>) -> Option<ChannelFaults> {
    let max_ms = u64::try_from(MAX_LATENCY.as_millis()).unwrap_or(u64::MAX);
    let time = |key| fields.millis(key, 0..=max_ms).unwrap_or_default();
    let share = |key| fields.number(key, 0.0..=1.0, "").unwrap_or_default();
    let length = |key| fields.number(key, 1.0..=f64::MAX, "messages").unwrap_or(1.0);
    let offset_ms: Option<i64> = fields.whole("stamp_offset_ms");
    let settings = FaultSettings {
        seed: fields.whole("seed").unwrap_or_default(),
        latency: time("latency_ms"),
        jitter: time("jitter_ms"),
        loss: share("loss"),
        freeze: Spells { probability: share("freeze"), mean_length: length("freeze_messages") },
        stamp_offset_ns: offset_ms.unwrap_or(0).saturating_mul(1_000_000),
        miss: Spells { probability: share("miss"), mean_length: length("miss_messages") },
        unknown: share("unknown"),
        confusions: fields.tables("confusion").filter_map(confusion).collect(),
        confidence_mean: fields.number("confidence", 0.0..=1.0, ""),
        confidence_spread: fields.number("confidence_spread", 0.0..=f64::MAX, "").unwrap_or_default(),
    };
    let faults = fields.checker.accept(fields.location(), ChannelFaults::new(settings), "");
    fields.done();
    faults
}

fn confusion(fields: Fields<'_>) -> Option<Confusion> {
    fields.require(&["from", "to", "probability"], "");
    let color = |key| {
        let given = fields.string(key)?;
        fields.checker.accept(&given.location, given.text.parse::<Color>(), "")
    };
    let (from, to) = (color("from"), color("to"));
    let probability = fields.number("probability", 0.0..=1.0, "");
    fields.done();
    Some(Confusion { from: from?, to: to?, probability: probability? })
}
