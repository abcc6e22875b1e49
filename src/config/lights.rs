//! What `[turn]` and `[hazard]` of a profile have in common.

use std::ops::Range;
use std::time::Duration;

use toml::Spanned;

use super::roles::Binder;
use super::vehicle::{is_timeout, out_of_range};
use super::vehicle_file::{
    FaultSignalFile, HazardFile, HazardFrom, OnFaultFile, SwitchFile, TurnFile, WhileHazardFile,
};
use crate::core::trust::table::FaultSignal;
use crate::core::vehicle_lights::binding::{FaultBinding, TurnWhileHazard};
use crate::core::vehicle_lights::fusion::SourceSettings;

/// How long sources may contradict each other when the profile does not say.
const DISAGREEMENT: Duration = Duration::from_secs(1);

pub(super) fn faults(
    binder: &mut Binder<'_>,
    files: &[FaultSignalFile],
    on_fault: Option<&Spanned<OnFaultFile>>,
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
    let on_fault = on_fault.map_or(OnFaultFile::default(), |given| *given.get_ref());
    FaultBinding { signals: files.iter().filter_map(fault).collect(), on_fault: on_fault.into() }
}

pub(super) fn while_hazard(
    binder: &mut Binder<'_>,
    turn: &TurnFile,
    hazard: Option<&HazardFile>,
) -> TurnWhileHazard {
    let Some(policy) = &turn.while_hazard else { return TurnWhileHazard::default() };
    let both_sides = hazard
        .and_then(|hazard| hazard.from.as_ref())
        .is_some_and(|from| *from.get_ref() == HazardFrom::BothSides);
    if *policy.get_ref() == WhileHazardFile::Keep && both_sides && turn.source.is_empty() {
        let reason = "hazard comes from both sides, so there is no turn state to keep";
        binder.refuse(policy.span(), reason, "use while_hazard = \"disable\"");
    }
    (*policy.get_ref()).into()
}

/// The keys that are given, with their places.
pub(super) fn spans<T>(
    keys: &[(&'static str, &Option<Spanned<T>>)],
) -> std::vec::IntoIter<(&'static str, Range<usize>)> {
    let given: Vec<_> = keys.iter().filter_map(|(key, value)| Some((*key, value.as_ref()?.span()))).collect();
    given.into_iter()
}

/// Refuses each of these keys: "`key` reason".
pub(super) fn refuse_keys(
    binder: &mut Binder<'_>,
    keys: impl IntoIterator<Item = (&'static str, Range<usize>)>,
    reason: &str,
    remedy: &str,
) {
    for (key, at) in keys {
        binder.refuse(at, format!("`{key}` {reason}"), remedy);
    }
}

/// Names the keys that are missing.
pub(super) fn keys_missing(keys: &[(&str, bool)]) -> String {
    let missing: Vec<_> = keys.iter().filter(|(_, missing)| *missing).map(|(key, _)| *key).collect();
    format!("{} missing: {}", if missing.len() == 1 { "a key is" } else { "keys are" }, missing.join(", "))
}

/// A time of the profile, or what holds without; one that is no time is noted.
pub(super) fn millis(binder: &mut Binder<'_>, given: Option<&Spanned<u64>>, default: Duration) -> Duration {
    let Some(given) = given else { return default };
    if !is_timeout(*given.get_ref()) {
        binder.problems.push(out_of_range(binder.document, given));
    }
    Duration::from_millis(*given.get_ref())
}

/// How long sources may contradict each other; by default longer than what they may differ by.
pub(super) fn disagreement(
    binder: &mut Binder<'_>,
    given: Option<&Spanned<u64>>,
    at_least: Duration,
) -> Duration {
    millis(binder, given, DISAGREEMENT.max(at_least))
}

/// Name and settings of one of several sources.
pub(super) fn source_settings(
    binder: &mut Binder<'_>,
    span: &Range<usize>,
    name: Option<&Spanned<String>>,
    fallback: Option<&Spanned<bool>>,
    taken: &[&str],
) -> Option<(String, SourceSettings)> {
    let Some(name) = name else {
        binder.refuse(span.clone(), "a key is missing: name", "name the source for diagnostics");
        return None;
    };
    let text = name.get_ref();
    if text.is_empty() || taken.contains(&text.as_str()) {
        let reason = format!("{text:?} does not tell this source from the others");
        binder.refuse(name.span(), reason, "give each source a name of its own");
        return None;
    }
    let fallback = fallback.is_some_and(|fallback| *fallback.get_ref());
    Some((text.clone(), SourceSettings { fallback }))
}
