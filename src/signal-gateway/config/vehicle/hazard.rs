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

/// Origins of the hazard-light state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum HazardFrom {
    /// A signal that is on while the lights are on.
    Signal,
    /// A signal that gives a reason.
    Reason,
    /// Both turn sides on at once.
    BothSides,
    /// A momentary button, which toggles.
    Button,
    /// The vehicle has no hazard lights.
    NotFitted,
    /// No signal shows the state.
    NotVisible,
}

const FROM: Keywords<HazardFrom> = &[
    ("signal", HazardFrom::Signal),
    ("reason", HazardFrom::Reason),
    ("both_sides", HazardFrom::BothSides),
    ("button", HazardFrom::Button),
    ("not_fitted", HazardFrom::NotFitted),
    ("not_visible", HazardFrom::NotVisible),
];

/// Reads the binding; `None` if a problem was recorded.
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

/// Returns true if the hazard-light state comes from both turn sides.
pub(super) fn is_from_both_sides(fields: &Fields<'_>) -> bool {
    fields.is("from", "both_sides")
}

/// Reads one source of the hazard lights.
fn source(binder: &mut Binder<'_>, fields: &Fields<'_>, turn: Option<&TurnBinding>) -> Option<HazardSource> {
    fields.require(&["from"], "");
    if fields.is("from", "unbound") {
        fields.refuse("from", "`unbound` is not a source any more", "write not_visible");
        fields.accept_rest();
        return None;
    }
    let Some(from) = fields.keyword("from", FROM) else {
        fields.accept_rest();
        return None;
    };
    match from {
        HazardFrom::NotFitted | HazardFrom::NotVisible => {
            let remedy = "remove the source, or give this `from` to [hazard] alone";
            fields.refuse("from", "this is not a source", remedy);
            fields.accept_rest();
            None
        }
        HazardFrom::BothSides => {
            fields.set_form("with from = \"both_sides\"");
            let shows_both =
                |turn: &TurnBinding| turn.sources().iter().any(|named| named.source.shows_both());
            if turn.is_some_and(|turn| !shows_both(turn)) {
                let remedy = "give [turn] `both` values or `both_on = \"hazard\"`, or change `from`";
                fields.refuse("from", "the turn binding cannot show both sides on", remedy);
                return None;
            }
            Some(HazardSource::BothSides)
        }
        HazardFrom::Signal => {
            fields.set_form("with from = \"signal\"");
            let code = |active| HazardCode { active, reason: None };
            let states = [("on", code(true)), ("off", code(false))];
            let role =
                binder.states(fields, [&states, &[]], UNUSABLE, "a hazard signal needs signal, on and off");
            Some(HazardSource::Signal { role: role?, reasons: vec![] })
        }
        HazardFrom::Button => {
            fields.set_form("with from = \"button\"");
            let max_gap = fields.limit("max_gap_ms").unwrap_or(StalkSettings::default().max_gap);
            let startup_delay = fields.limit("startup_delay_ms").unwrap_or(BUTTON_STARTUP_DELAY);
            let role =
                binder.switch(fields, ["on", "off"], UNUSABLE, "a hazard button needs signal, on and off")?;
            Some(HazardSource::Button { role, max_gap, startup_delay })
        }
        HazardFrom::Reason => {
            fields.set_form("with from = \"reason\"");
            reason(binder, fields)
        }
    }
}

/// Reads a signal whose values are reasons for the lights being on.
fn reason(binder: &mut Binder<'_>, fields: &Fields<'_>) -> Option<HazardSource> {
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
        fields.refuse("reasons", reason, "name them in [hazard.reasons]");
        return None;
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
