//! From `[hazard]` of a profile to its binding.

use std::collections::BTreeMap;
use std::ops::Range;
use std::time::Duration;

use toml::Spanned;

use super::lights::{disagreement, keys_missing, millis, refuse_keys, source_settings, spans};
use super::roles::{Binder, Meanings};
use super::vehicle_file::{HazardFile, HazardFrom, RawValues, SwitchFile};
use crate::core::trust::meaning::Meaning;
use crate::core::trust::table::Role;
use crate::core::vehicle_lights::binding::{
    HazardBinding, HazardCode, HazardSource, NamedSource, Sources, TurnBinding,
};
use crate::core::vehicle_lights::stalk::StalkSettings;

/// The lights are taken to be off until their button was watched for this long.
const BUTTON_SETTLE: Duration = Duration::from_secs(1);

pub(super) fn hazard(
    binder: &mut Binder<'_>,
    file: &Spanned<HazardFile>,
    turn: Option<&TurnBinding>,
) -> Option<HazardBinding> {
    let (span, file) = (file.span(), file.get_ref());
    let before = binder.problems.len();
    refuse_keys(
        binder,
        spans(&[("name", &file.name)]).chain(spans(&[("fallback", &file.fallback)])),
        "belongs to [[hazard.source]]",
        "remove it, or describe the sources in [[hazard.source]]",
    );
    let sources = if file.source.is_empty() {
        refuse_keys(
            binder,
            spans(&[("disagreement_ms", &file.disagreement_ms)]),
            "needs several sources",
            "remove it, or describe the sources in [[hazard.source]]",
        );
        let from = from(binder, file, &span)?;
        let none = match *from.get_ref() {
            HazardFrom::NotFitted => Some(HazardBinding::NotFitted),
            HazardFrom::Unbound => Some(HazardBinding::Unbound),
            HazardFrom::Signal | HazardFrom::Reason | HazardFrom::BothSides | HazardFrom::Button => None,
        };
        if none.is_some() {
            refuse_strangers(binder, file, *from.get_ref());
            return none.filter(|_| binder.problems.len() == before);
        }
        Sources::only(hazard_source(binder, file, &span, turn)?)
    } else {
        let keys: Vec<_> = spans(&[("from", &file.from)]).chain(form_keys(file)).collect();
        refuse_keys(binder, keys, "stands beside [[hazard.source]]", "move it into a [[hazard.source]]");
        sources(binder, file, turn)?
    };
    (binder.problems.len() == before).then_some(HazardBinding::From(sources))
}

fn sources(
    binder: &mut Binder<'_>,
    file: &HazardFile,
    turn: Option<&TurnBinding>,
) -> Option<Sources<HazardSource>> {
    let mut list: Vec<NamedSource<HazardSource>> = Vec::new();
    for part in &file.source {
        let (span, part) = (part.span(), part.get_ref());
        let nested = part.source.iter().map(|inner| ("source", inner.span()));
        let faults = part.fault_signal.iter().map(|fault| ("fault_signal", fault.signal.span()));
        refuse_keys(
            binder,
            spans(&[("disagreement_ms", &part.disagreement_ms)])
                .chain(spans(&[("on_fault", &part.on_fault)]))
                .chain(nested)
                .chain(faults),
            "belongs to [hazard]",
            "move it there",
        );
        let names: Vec<_> = list.iter().map(|named| named.name.as_str()).collect();
        let settings = source_settings(binder, &span, part.name.as_ref(), part.fallback.as_ref(), &names);
        let source = hazard_source(binder, part, &span, turn);
        let (Some((name, settings)), Some(source)) = (settings, source) else { continue };
        list.push(NamedSource { name, settings, source });
    }
    let disagreement = disagreement(binder, file.disagreement_ms.as_ref(), lamp_hold(turn));
    (list.len() == file.source.len()).then_some(Sources { list, disagreement })
}

fn lamp_hold(turn: Option<&TurnBinding>) -> Duration {
    match turn {
        Some(TurnBinding::From(sources)) => super::turn::longest_hold(&sources.list),
        Some(TurnBinding::NotFitted | TurnBinding::LeftOut) | None => Duration::ZERO,
    }
}

fn from<'f>(
    binder: &mut Binder<'_>,
    file: &'f HazardFile,
    span: &Range<usize>,
) -> Option<&'f Spanned<HazardFrom>> {
    if file.from.is_none() {
        binder.refuse(span.clone(), "missing field `from`", "see config/gateway.toml for every key");
    }
    file.from.as_ref()
}

/// The keys that say what the signal is, as far as given.
fn form_keys(file: &HazardFile) -> impl Iterator<Item = (&'static str, Range<usize>)> {
    let lists = [
        ("on", &file.on),
        ("off", &file.off),
        ("not_available", &file.not_available),
        ("fault", &file.fault),
    ];
    spans(&lists)
        .chain(spans(&[("signal", &file.signal)]))
        .chain(spans(&[("reasons", &file.reasons)]))
        .chain(spans(&[("blind_ms", &file.blind_ms), ("settle_ms", &file.settle_ms)]))
        .collect::<Vec<_>>()
        .into_iter()
}

/// Refuses keys that have no meaning with this `from`.
fn refuse_strangers(binder: &mut Binder<'_>, file: &HazardFile, from: HazardFrom) {
    let takes: &[&str] = match from {
        HazardFrom::Signal => &["signal", "on", "off", "not_available", "fault"],
        HazardFrom::Button => &["signal", "on", "off", "not_available", "fault", "blind_ms", "settle_ms"],
        HazardFrom::Reason => &["signal", "off", "not_available", "fault", "reasons"],
        HazardFrom::BothSides | HazardFrom::NotFitted | HazardFrom::Unbound => &[],
    };
    let strangers = form_keys(file).filter(|(key, _)| !takes.contains(key));
    refuse_keys(binder, strangers, "has no meaning with this `from`", "remove it, or change `from`");
}

fn hazard_source(
    binder: &mut Binder<'_>,
    file: &HazardFile,
    span: &Range<usize>,
    turn: Option<&TurnBinding>,
) -> Option<HazardSource> {
    let from = from(binder, file, span)?;
    let before = binder.problems.len();
    refuse_strangers(binder, file, *from.get_ref());
    if binder.problems.len() > before {
        return None;
    }
    match *from.get_ref() {
        HazardFrom::NotFitted | HazardFrom::Unbound => {
            let remedy = "remove the source, or give this `from` to [hazard] alone";
            binder.refuse(from.span(), "this is no source", remedy);
            None
        }
        HazardFrom::BothSides => {
            if turn.is_some_and(|turn| !shows_both(turn)) {
                let remedy = "give [turn] `both` values or `both_on = \"hazard\"`, or change `from`";
                binder.refuse(from.span(), "the turn binding cannot show both sides on", remedy);
                return None;
            }
            Some(HazardSource::BothSides)
        }
        HazardFrom::Signal | HazardFrom::Button => switched(binder, file, span, *from.get_ref()),
        HazardFrom::Reason => {
            let (Some(signal), Some(off), Some(reasons)) = (&file.signal, &file.off, &file.reasons) else {
                let lists = [("off", file.off.is_none()), ("reasons", file.reasons.is_none())];
                let missing = keys_missing(&[("signal", file.signal.is_none()), lists[0], lists[1]]);
                binder.refuse(
                    span.clone(),
                    missing,
                    "a hazard reason needs signal, off and [hazard.reasons]",
                );
                return None;
            };
            reason_source(binder, file, signal, off, reasons)
        }
    }
}

/// Whether a turn binding can show "both sides on".
fn shows_both(turn: &TurnBinding) -> bool {
    match turn {
        TurnBinding::NotFitted | TurnBinding::LeftOut => false,
        TurnBinding::From(sources) => sources.list.iter().any(|named| named.source.shows_both()),
    }
}

/// A signal or a button.
fn switched(
    binder: &mut Binder<'_>,
    file: &HazardFile,
    span: &Range<usize>,
    from: HazardFrom,
) -> Option<HazardSource> {
    let (Some(signal), Some(on), Some(off)) = (&file.signal, &file.on, &file.off) else {
        let lists = [("on", file.on.is_none()), ("off", file.off.is_none())];
        let missing = keys_missing(&[("signal", file.signal.is_none()), lists[0], lists[1]]);
        binder.refuse(span.clone(), missing, "a hazard signal needs signal, on and off");
        return None;
    };
    if from == HazardFrom::Button {
        let switch = SwitchFile {
            signal: signal.clone(),
            on: on.clone(),
            off: off.clone(),
            not_available: file.not_available.clone(),
            fault: file.fault.clone(),
        };
        let role = binder.switch(&switch);
        let blind = millis(binder, file.blind_ms.as_ref(), StalkSettings::default().blind);
        let settle = millis(binder, file.settle_ms.as_ref(), BUTTON_SETTLE);
        return Some(HazardSource::Button { role: role?, blind, settle });
    }
    let code = |active| Meaning::Defined(HazardCode { active, reason: None });
    binder.require_values(&[on, off]);
    let meanings = vec![(on, code(true)), (off, code(false))];
    let role = hazard_role(binder, file, signal, meanings)?;
    Some(HazardSource::Signal { role, reasons: vec![] })
}

fn reason_source(
    binder: &mut Binder<'_>,
    file: &HazardFile,
    signal: &Spanned<String>,
    off: &RawValues,
    reasons: &Spanned<BTreeMap<String, RawValues>>,
) -> Option<HazardSource> {
    let (span, reasons) = (reasons.span(), reasons.get_ref());
    if reasons.is_empty() || reasons.len() > usize::from(u8::MAX) {
        binder.refuse(span, "no reason is named, or more than 255", "name reasons in [hazard.reasons]");
        return None;
    }
    binder.require_values(&reasons.values().chain([off]).collect::<Vec<_>>());
    let mut meanings = vec![(off, Meaning::Defined(HazardCode { active: false, reason: None }))];
    meanings.extend(
        (0..=u8::MAX).zip(reasons.values()).map(|(index, values)| {
            (values, Meaning::Defined(HazardCode { active: true, reason: Some(index) }))
        }),
    );
    let role = hazard_role(binder, file, signal, meanings)?;
    Some(HazardSource::Signal { role, reasons: reasons.keys().cloned().collect() })
}

fn hazard_role<'f>(
    binder: &mut Binder<'_>,
    file: &'f HazardFile,
    signal: &Spanned<String>,
    mut meanings: Meanings<'f, HazardCode>,
) -> Option<Role<HazardCode>> {
    meanings.extend(file.not_available.iter().map(|values| (values, Meaning::NotAvailable)));
    meanings.extend(file.fault.iter().map(|values| (values, Meaning::Fault)));
    binder.role(signal, &meanings)
}
