//! `counter = { … }` of `[message.*]` and `[[command.message]]`.

use super::super::binder::Binder;
use crate::config::reading::{Fields, Keywords};
use can_signal::dbc::model::Message;
use can_signal::validation::integrity::counter::{Counter, CounterRule, IncrementsOn};

const INCREMENTS_ON: Keywords<IncrementsOn> =
    &[("sends", IncrementsOn::Sends), ("changes", IncrementsOn::Changes)];

pub(super) fn counter(binder: &Binder<'_>, fields: &Fields<'_>, message: &Message) -> Option<Counter> {
    fields.require(&["signal"], "");
    let value = |key| fields.whole(key);
    let (first, last, max_step) = (value("first"), value("last"), value("max_step").unwrap_or(1));
    let repeats = fields.number("tolerated_repeats", 0..=u8::MAX, "").unwrap_or(0);
    let sync_after = fields.number("sync_after", 0..=u8::MAX, "").unwrap_or(1);
    let increments_on = fields.keyword("increments_on", INCREMENTS_ON).unwrap_or_default();
    let signal = binder.field(message, &fields.string("signal")?)?;
    let (lowest, highest) = signal.range();
    let limit = |value: i128| u32::try_from(value).unwrap_or(if value < 0 { 0 } else { u32::MAX });
    let counter = CounterRule::new(first.unwrap_or(limit(lowest)), last.unwrap_or(limit(highest)))
        .and_then(|rule| rule.with_max_step(max_step))
        .and_then(|mut rule| {
            rule.increments_on = increments_on;
            rule.tolerated_repeats = repeats;
            rule.sync_after = sync_after;
            Counter::new(rule, signal)
        });
    let see = "see [message.*] counter in config/gateway.toml";
    binder.checker.accept(fields.location(), counter, see)
}
