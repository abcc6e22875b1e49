//! What `[turn]` and `[hazard]` of a profile have in common: several sources, and signals of faults.

use std::ops::Range;
use std::time::Duration;

use serde::Deserialize;
use toml::Spanned;

use super::binder::Binder;
use super::keys::Spans;
use super::raw_values::RawValues;
use crate::config::reading::keyword::{Keyword, keywords};
use crate::core::validation::table::FaultSignal;
use crate::core::vehicle_lights::binding::{FaultBinding, NamedSource, OnFault, TurnSource};
use crate::core::vehicle_lights::fusion::SourceSettings;

keywords!(OnFault { "report" => OnFault::Report, "withhold" => OnFault::Withhold });

/// `[[turn.fault_signal]]`, `[[hazard.fault_signal]]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FaultSignalFile {
    /// `MESSAGE.SIGNAL`
    pub signal: Spanned<String>,
    /// Values for "broken".
    pub on: RawValues,
    /// Values for "sound".
    pub off: RawValues,
    /// What is broken, for an operator.
    pub text: String,
}

impl Spans for Vec<FaultSignalFile> {
    fn spans(&self) -> Vec<Range<usize>> {
        self.iter().map(|fault| fault.signal.span()).collect()
    }
}

/// Disagreement is not a finding while a lamp may still be held, and this much longer.
const BEYOND_HOLD: Duration = Duration::from_millis(500);

/// How long sources may contradict each other when the profile does not say.
const DISAGREEMENT: Duration = Duration::from_secs(1);

pub(super) fn faults(
    binder: &mut Binder<'_>,
    files: &[FaultSignalFile],
    on_fault: Option<&Spanned<Keyword<OnFault>>>,
) -> FaultBinding {
    let fault = |file: &FaultSignalFile| {
        let role = binder.switch(&file.signal, [&file.on, &file.off], std::iter::empty())?;
        Some(FaultSignal { role, text: file.text.clone() })
    };
    let signals = files.iter().filter_map(fault).collect();
    FaultBinding { signals, on_fault: on_fault.map(|given| given.get_ref().0).unwrap_or_default() }
}

/// How long sources may contradict each other; by default longer than what they may differ by.
pub(super) fn disagreement(
    binder: &mut Binder<'_>,
    given: Option<&Spanned<u64>>,
    at_least: Duration,
) -> Duration {
    binder.checker.limit(given).unwrap_or(DISAGREEMENT.max(at_least))
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

/// How long lamps may be held on, and a bit; other sources may be off by then.
pub(super) fn longest_hold(list: &[NamedSource<TurnSource>]) -> Duration {
    let holds = list.iter().filter_map(|named| match &named.source {
        TurnSource::Lamps { settings, .. } => Some(settings.hold.saturating_add(BEYOND_HOLD)),
        TurnSource::Enumerated(_) | TurnSource::Pair(_) | TurnSource::Stalk { .. } => None,
    });
    holds.max().unwrap_or_default()
}
