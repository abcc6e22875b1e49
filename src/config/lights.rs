//! From `[turn]` and `[hazard]` of a profile to their bindings.

use std::collections::BTreeMap;

use toml::Spanned;

use super::roles::{Binder, Meanings};
use super::vehicle_file::{
    FaultSignalFile, HazardFile, HazardFrom, OnFaultFile, RawValues, SwitchFile, TurnFile, WhileHazardFile,
};
use crate::core::vehicle_lights::binding::{
    BothOn, FaultBinding, FaultSignal, HazardBinding, HazardCode, Role, TurnBinding, TurnCode,
    TurnWhileHazard,
};
use crate::core::vehicle_lights::meaning::Meaning;

/// The three ways to bind the turn state.
const FORMS: &str = "give `signal` with off, left and right, or `left_signal`, `right_signal` and `both_on`, \
                         or `fitted = false`";

pub(super) fn turn(binder: &mut Binder<'_>, file: &Spanned<TurnFile>) -> Option<TurnBinding> {
    let (span, file) = (file.span(), file.get_ref());
    let enumerated: Vec<_> = [
        file.signal.as_ref().map(Spanned::span),
        file.off.as_ref().map(Spanned::span),
        file.left.as_ref().map(Spanned::span),
        file.right.as_ref().map(Spanned::span),
        file.both.as_ref().map(Spanned::span),
        file.not_available.as_ref().map(Spanned::span),
        file.fault.as_ref().map(Spanned::span),
    ]
    .into_iter()
    .flatten()
    .collect();
    let pair: Vec<_> = [
        file.left_signal.as_ref().map(Spanned::span),
        file.right_signal.as_ref().map(Spanned::span),
        file.both_on.as_ref().map(Spanned::span),
    ]
    .into_iter()
    .flatten()
    .collect();
    let not_fitted = file.fitted.as_ref().is_some_and(|fitted| !fitted.get_ref());
    match (not_fitted, enumerated.first(), pair.first()) {
        (true, None, None) => Some(TurnBinding::NotFitted),
        (true, Some(extra), _) | (true, None, Some(extra)) => {
            binder.refuse(extra.clone(), "a vehicle without indicators has no turn signal", FORMS);
            None
        }
        (false, Some(_), Some(extra)) => {
            binder.refuse(
                extra.clone(),
                "one enumerated signal and a pair of signals exclude each other",
                FORMS,
            );
            None
        }
        (false, None, None) => {
            binder.refuse(span, "the turn state comes from no signal", FORMS);
            None
        }
        (false, Some(_), None) => enumerated_turn(binder, file, &span),
        (false, None, Some(_)) => turn_pair(binder, file, &span),
    }
}

fn enumerated_turn(
    binder: &mut Binder<'_>,
    file: &TurnFile,
    span: &std::ops::Range<usize>,
) -> Option<TurnBinding> {
    let (Some(signal), Some(off), Some(left), Some(right)) =
        (&file.signal, &file.off, &file.left, &file.right)
    else {
        let missing = missing(&[
            ("signal", file.signal.is_none()),
            ("off", file.off.is_none()),
            ("left", file.left.is_none()),
            ("right", file.right.is_none()),
        ]);
        binder.refuse(span.clone(), missing, "an enumerated turn signal needs signal, off, left and right");
        return None;
    };
    binder.require_values(&[off, left, right]);
    let defined = |code| Meaning::Defined(code);
    let mut meanings: Meanings<'_, TurnCode> = vec![
        (off, defined(TurnCode::Off)),
        (left, defined(TurnCode::Left)),
        (right, defined(TurnCode::Right)),
    ];
    meanings.extend(file.both.iter().map(|values| (values, defined(TurnCode::Both))));
    meanings.extend(file.not_available.iter().map(|values| (values, Meaning::NotAvailable)));
    meanings.extend(file.fault.iter().map(|values| (values, Meaning::Fault)));
    binder.role(signal, &meanings).map(TurnBinding::Enumerated)
}

fn turn_pair(binder: &mut Binder<'_>, file: &TurnFile, span: &std::ops::Range<usize>) -> Option<TurnBinding> {
    let (Some(left_file), Some(right_file), Some(both)) =
        (&file.left_signal, &file.right_signal, &file.both_on)
    else {
        let missing = missing(&[
            ("left_signal", file.left_signal.is_none()),
            ("right_signal", file.right_signal.is_none()),
            ("both_on", file.both_on.is_none()),
        ]);
        let remedy = "a pair of turn signals needs left_signal, right_signal and both_on";
        binder.refuse(span.clone(), missing, remedy);
        return None;
    };
    let left = binder.switch(left_file.get_ref());
    let right = binder.switch(right_file.get_ref());
    let (left, right) = (left?, right?);
    if left.signal == right.signal {
        binder.refuse(right_file.span(), "left and right are the same signal", "bind one signal a side");
        return None;
    }
    Some(TurnBinding::Pair { left, right, both: (*both.get_ref()).into() })
}

/// Names the keys that are missing.
fn missing(keys: &[(&str, bool)]) -> String {
    let missing: Vec<_> = keys.iter().filter(|(_, missing)| *missing).map(|(key, _)| *key).collect();
    format!("{} missing: {}", if missing.len() == 1 { "a key is" } else { "keys are" }, missing.join(", "))
}

/// Whether a turn binding can show "both sides on".
fn shows_both(turn: &TurnBinding) -> bool {
    match turn {
        TurnBinding::NotFitted => false,
        TurnBinding::Enumerated(role) => {
            role.values.entries().iter().any(|(_, meaning)| *meaning == Meaning::Defined(TurnCode::Both))
        }
        TurnBinding::Pair { both, .. } => *both == BothOn::Hazard,
    }
}

pub(super) fn hazard(
    binder: &mut Binder<'_>,
    file: &Spanned<HazardFile>,
    turn: Option<&TurnBinding>,
) -> Option<HazardBinding> {
    let (span, file) = (file.span(), file.get_ref());
    let lists: [(&str, &Option<RawValues>); 4] = [
        ("on", &file.on),
        ("off", &file.off),
        ("not_available", &file.not_available),
        ("fault", &file.fault),
    ];
    let from = *file.from.get_ref();
    let takes: &[&str] = match from {
        HazardFrom::Signal => &["signal", "on", "off", "not_available", "fault"],
        HazardFrom::Reason => &["signal", "off", "not_available", "fault", "reasons"],
        HazardFrom::BothSides | HazardFrom::NotFitted | HazardFrom::Unbound => &[],
    };
    let before = binder.problems.len();
    let given = lists.iter().filter_map(|(key, values)| values.as_ref().map(|values| (*key, values.span())));
    let signal = file.signal.as_ref().map(|signal| ("signal", signal.span()));
    let reasons = file.reasons.as_ref().map(|reasons| ("reasons", reasons.span()));
    for (key, at) in given.chain(signal).chain(reasons).filter(|(key, _)| !takes.contains(key)) {
        binder.refuse(at, format!("`{key}` has no meaning with this `from`"), "remove it, or change `from`");
    }
    if binder.problems.len() > before {
        return None;
    }
    match from {
        HazardFrom::NotFitted => Some(HazardBinding::NotFitted),
        HazardFrom::Unbound => Some(HazardBinding::Unbound),
        HazardFrom::BothSides => {
            if turn.is_some_and(|turn| !shows_both(turn)) {
                let remedy = "give [turn] `both` values or `both_on = \"hazard\"`, or change `from`";
                binder.refuse(file.from.span(), "the turn binding cannot show both sides on", remedy);
                return None;
            }
            Some(HazardBinding::BothLamps)
        }
        HazardFrom::Signal => {
            let (Some(signal), Some(on), Some(off)) = (&file.signal, &file.on, &file.off) else {
                let lists = [("on", file.on.is_none()), ("off", file.off.is_none())];
                let missing = missing(&[("signal", file.signal.is_none()), lists[0], lists[1]]);
                binder.refuse(span, missing, "a hazard signal needs signal, on and off");
                return None;
            };
            let code = |active| Meaning::Defined(HazardCode { active, reason: None });
            binder.require_values(&[on, off]);
            let meanings = vec![(on, code(true)), (off, code(false))];
            let role = hazard_role(binder, file, signal, meanings)?;
            Some(HazardBinding::Signal { role, reasons: vec![] })
        }
        HazardFrom::Reason => {
            let (Some(signal), Some(off), Some(reasons)) = (&file.signal, &file.off, &file.reasons) else {
                let lists = [("off", file.off.is_none()), ("reasons", file.reasons.is_none())];
                let missing = missing(&[("signal", file.signal.is_none()), lists[0], lists[1]]);
                binder.refuse(span, missing, "a hazard reason needs signal, off and [hazard.reasons]");
                return None;
            };
            reason_binding(binder, file, signal, off, reasons)
        }
    }
}

fn reason_binding(
    binder: &mut Binder<'_>,
    file: &HazardFile,
    signal: &Spanned<String>,
    off: &RawValues,
    reasons: &Spanned<BTreeMap<String, RawValues>>,
) -> Option<HazardBinding> {
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
    Some(HazardBinding::Signal { role, reasons: reasons.keys().cloned().collect() })
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

pub(super) fn faults(
    binder: &mut Binder<'_>,
    files: &[FaultSignalFile],
    on_fault: OnFaultFile,
) -> FaultBinding {
    let fault = |file: &FaultSignalFile| {
        let switch = SwitchFile {
            signal: file.signal.clone(),
            on: file.on.clone(),
            off: file.off.clone(),
            not_available: None,
            fault: None,
        };
        Some(FaultSignal { role: binder.switch(&switch)?, text: file.text.clone() })
    };
    FaultBinding { signals: files.iter().filter_map(fault).collect(), on_fault: on_fault.into() }
}

pub(super) fn while_hazard(binder: &mut Binder<'_>, turn: &TurnFile, hazard: &HazardFile) -> TurnWhileHazard {
    let Some(policy) = &turn.while_hazard else { return TurnWhileHazard::default() };
    if *policy.get_ref() == WhileHazardFile::Keep && *hazard.from.get_ref() == HazardFrom::BothSides {
        let reason = "hazard comes from both sides, so there is no turn state to keep";
        binder.refuse(policy.span(), reason, "use while_hazard = \"disable\"");
    }
    (*policy.get_ref()).into()
}
