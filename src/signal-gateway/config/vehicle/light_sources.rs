//! The keys that `[turn]` and `[hazard]` of a profile have in common: several sources, and signals of faults.

use std::time::Duration;

use super::binder::{Binder, UNUSABLE};
use crate::config::reading::{Fields, Keywords};
use gateway_core::vehicle_lights::binding::{
    FaultBinding, FaultSignal, NamedSource, OnFault, Sources, TurnSource,
};
use gateway_core::vehicle_lights::state::Sides;

const ON_FAULT: Keywords<OnFault> = &[("report", OnFault::Report), ("withhold", OnFault::Withhold)];

const SIDE: Keywords<Sides> = &[
    ("left", Sides { left: true, right: false }),
    ("right", Sides { left: false, right: true }),
    ("both", Sides { left: true, right: true }),
];

/// Time beyond the longest hold of a lamp after which disagreement is a finding.
const BEYOND_HOLD: Duration = Duration::from_millis(500);

/// Default time for which sources may contradict each other.
const DISAGREEMENT: Duration = Duration::from_secs(1);

/// Reads the signals that report a fault, and the reaction to them.
pub(super) fn faults(binder: &mut Binder<'_>, fields: &Fields<'_>) -> FaultBinding {
    let signals = fields.read_tables("fault_signal", |fields| {
        fields.require(&["text"], "");
        let text = fields.string("text");
        let sides = fields.keyword("side", SIDE).unwrap_or(Sides { left: true, right: true });
        let role = binder.switch(fields, ["on", "off"], &[], "");
        Some(FaultSignal { role: role?, sides, text: text?.text })
    });
    FaultBinding { signals, on_fault: fields.keyword("on_fault", ON_FAULT).unwrap_or_default() }
}

/// Reads the sources of a section: the section itself as the only source, or the sources in its `source`,
/// most trusted first. `hold` is the time for which they may differ. `None` if a problem was recorded.
pub(super) fn sources<S>(
    binder: &mut Binder<'_>,
    fields: &Fields<'_>,
    source: impl Fn(&mut Binder<'_>, &Fields<'_>) -> Option<S>,
    hold: impl Fn(&[NamedSource<S>]) -> Duration,
) -> Option<Sources<S>> {
    let disagreement = fields.limit("disagreement_ms");
    if !fields.has("source") {
        if fields.has("disagreement_ms") {
            let remedy = "remove it, or describe the sources in `source`";
            fields.refuse("disagreement_ms", "`disagreement_ms` needs several sources", remedy);
        }
        return source(binder, fields).map(Sources::only);
    }
    fields.set_form("beside `source`");
    let mut list: Vec<NamedSource<S>> = Vec::new();
    let mut is_complete = true;
    for part in fields.tables("source") {
        let named = part.read_all(|part| {
            let name = name(part, &list);
            let is_fallback = part.flag("fallback").unwrap_or_default();
            let remedy = "a condition needs signal, on and off, so that no value of the signal is guessed";
            let condition = part
                .table("when")
                .map(|when| when.read_all(|when| binder.switch(when, ["on", "off"], UNUSABLE, remedy)));
            let source = source(binder, part);
            let condition = match condition {
                None => None,
                Some(condition) => Some(condition?),
            };
            Some(NamedSource { name: name?, is_fallback, condition, source: source? })
        });
        is_complete &= named.is_some();
        list.extend(named);
    }
    if list.is_empty() && is_complete {
        fields.refuse("source", "no source is given", "describe at least one");
    }
    let disagreement = disagreement.unwrap_or(DISAGREEMENT.max(hold(&list)));
    is_complete.then_some(Sources { list, disagreement })
}

fn name<S>(fields: &Fields<'_>, others: &[NamedSource<S>]) -> Option<String> {
    fields.require(&["name"], "name the source for diagnostics");
    let name = fields.string("name")?.text;
    if name.is_empty() || others.iter().any(|other| other.name == name) {
        let reason =
            if name.is_empty() { "the name is empty" } else { "another source of the section has this name" };
        return fields.refused("name", reason, "give each source a name of its own");
    }
    Some(name)
}

/// Returns the longest time for which lamps or a stalk may be held on, plus a margin; other sources may be
/// off by then.
pub(super) fn longest_hold(list: &[NamedSource<TurnSource>]) -> Duration {
    let holds = list.iter().filter_map(|named| match &named.source {
        TurnSource::Lamps { settings, .. } => Some(settings.hold),
        TurnSource::Enumerated { tap_hold, .. } | TurnSource::Pair { tap_hold, .. } => *tap_hold,
        TurnSource::Stalk { .. } => None,
    });
    holds.max().map_or(Duration::ZERO, |hold| hold.saturating_add(BEYOND_HOLD))
}
