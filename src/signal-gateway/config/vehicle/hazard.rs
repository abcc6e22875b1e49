//! `[hazard]` of a profile: the source of the hazard-light state.

use std::time::Duration;

use super::binder::{Binder, Meanings, UNUSABLE, unusable_values};
use super::light_sources::{longest_hold, sources};
use super::raw_values::RawValues;
use crate::config::reading::{Fields, Keywords};
use can_signal::validation::meaning::Meaning;
use gateway_core::vehicle_lights::binding::{HazardBinding, HazardSource, TurnBinding};
use gateway_core::vehicle_lights::stalk::StalkSettings;
use gateway_core::vehicle_lights::state::HazardCode;

/// Default time for which a button is observed before the lights are known to be off.
const BUTTON_STARTUP_DELAY: Duration = Duration::from_secs(1);

type SourceReader = fn(&mut Binder<'_>, &Fields<'_>, Option<&TurnBinding>) -> Option<HazardSource>;

/// Origins of the hazard-light state, with their readers.
const FROM: Keywords<SourceReader> = &[
    ("signal", signal),
    ("reason", reason),
    ("both_sides", both_sides),
    ("button", button),
    ("not_fitted", no_source),
    ("not_visible", no_source),
];

pub(super) fn hazard(
    binder: &mut Binder<'_>,
    fields: &Fields<'_>,
    turn: Option<&TurnBinding>,
) -> Option<HazardBinding> {
    let not_visible = HazardBinding::NotVisible { is_acknowledged: false };
    let none = [("not_fitted", HazardBinding::NotFitted), ("not_visible", not_visible)];
    let none = none.into_iter().find(|(from, _)| fields.is("from", from) && !fields.has("source"));
    if let Some((_, none)) = none {
        fields.value("from");
        fields.set_form("without a source");
        return Some(none);
    }
    let hold = turn.map_or(Duration::ZERO, |turn| longest_hold(turn.sources()));
    let source = |binder: &mut Binder<'_>, fields: &Fields<'_>| source(binder, fields, turn);
    sources(binder, fields, source, |_| hold).map(HazardBinding::From)
}

pub(super) fn is_from_both_sides(fields: &Fields<'_>) -> bool {
    fields.is("from", "both_sides")
}

fn source(binder: &mut Binder<'_>, fields: &Fields<'_>, turn: Option<&TurnBinding>) -> Option<HazardSource> {
    fields.require(&["from"], "");
    if fields.is("from", "unbound") {
        fields.refuse("from", "`unbound` is not a source any more", "write not_visible");
        fields.accept_rest();
        return None;
    }
    fields.form("from", FROM)?(binder, fields, turn)
}

/// Refuses hazard lights that the vehicle does not have, or that no signal shows, as one of several sources.
fn no_source(_: &mut Binder<'_>, fields: &Fields<'_>, _: Option<&TurnBinding>) -> Option<HazardSource> {
    let remedy = "remove the source, or give this `from` to [hazard] alone";
    fields.refuse("from", "this is not a source", remedy);
    fields.accept_rest();
    None
}

/// Reads the state from both turn sides, which are on at once.
fn both_sides(_: &mut Binder<'_>, fields: &Fields<'_>, turn: Option<&TurnBinding>) -> Option<HazardSource> {
    fields.set_form("with from = \"both_sides\"");
    let shows_both = |turn: &TurnBinding| turn.sources().iter().any(|named| named.source.shows_both());
    if turn.is_some_and(|turn| !shows_both(turn)) {
        let remedy = "give [turn] `both` values or `both_on = \"hazard\"`, or change `from`";
        return fields.refused("from", "the turn binding cannot show both sides on", remedy);
    }
    Some(HazardSource::BothSides)
}

/// Reads a signal that is on while the lights are on.
fn signal(binder: &mut Binder<'_>, fields: &Fields<'_>, _: Option<&TurnBinding>) -> Option<HazardSource> {
    fields.set_form("with from = \"signal\"");
    let code = |active| HazardCode { active, reason: None };
    let states = [("on", code(true)), ("off", code(false))];
    let role = binder.states(fields, [&states, &[]], UNUSABLE, "a hazard signal needs signal, on and off");
    Some(HazardSource::Signal { role: role?, reasons: vec![] })
}

/// Reads a momentary button, which toggles.
fn button(binder: &mut Binder<'_>, fields: &Fields<'_>, _: Option<&TurnBinding>) -> Option<HazardSource> {
    fields.set_form("with from = \"button\"");
    let max_gap = fields.limit("max_gap_ms").unwrap_or(StalkSettings::default().max_gap);
    let startup_delay = fields.limit("startup_delay_ms").unwrap_or(BUTTON_STARTUP_DELAY);
    let role = binder.switch(fields, ["on", "off"], UNUSABLE, "a hazard button needs signal, on and off")?;
    Some(HazardSource::Button { role, max_gap, startup_delay })
}

/// Reads a signal whose values are reasons for the lights being on.
fn reason(binder: &mut Binder<'_>, fields: &Fields<'_>, _: Option<&TurnBinding>) -> Option<HazardSource> {
    fields.set_form("with from = \"reason\"");
    let remedy = "a hazard reason needs signal, off and [hazard.reasons]";
    let is_complete = fields.require(&["signal", "off", "reasons"], remedy);
    let signal = fields.string("signal");
    let off = RawValues::some_given(fields, "off");
    let mut reasons: Vec<_> = fields.entries("reasons", "give a table of reasons").iter().collect();
    reasons.sort_by_key(|entry| &entry.key);
    let unusable = unusable_values(fields, UNUSABLE);
    is_complete?;
    if reasons.is_empty() || reasons.len() > usize::from(u8::MAX) {
        let reason = format!("expected 1 to 255 reasons, found {}", reasons.len());
        return fields.refused("reasons", reason, "name them in [hazard.reasons]");
    }
    let off = (off?, Meaning::Defined(HazardCode { active: false, reason: None }));
    let mut meanings: Meanings<_> = vec![off];
    for (index, entry) in (0..=u8::MAX).zip(&reasons) {
        let code = HazardCode { active: true, reason: Some(index) };
        meanings.push((RawValues::some_of(fields.checker, &entry.value), Meaning::Defined(code)));
    }
    meanings.extend(unusable);
    let role = binder.role(&signal?, &meanings)?;
    Some(HazardSource::Signal { role, reasons: reasons.iter().map(|entry| entry.key.clone()).collect() })
}
