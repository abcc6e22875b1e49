//! `[hazard]` of a profile: where the state of the hazard lights comes from.

use std::collections::BTreeMap;
use std::ops::Range;
use std::time::Duration;

use toml::Spanned;

use super::binder::{Binder, no_state};
use super::keys::{Key, refuse_given, refuse_keys, require, section};
use super::light_sources::{FaultSignalFile, disagreement, longest_hold, source_settings};
use super::raw_values::RawValues;
use crate::config::reading::keyword::{Keyword, keywords};
use crate::core::validation::table::Role;
use crate::core::vehicle_lights::binding::{
    HazardBinding, HazardSource, NamedSource, OnFault, Sources, TurnBinding,
};
use crate::core::vehicle_lights::stalk::StalkSettings;
use crate::core::vehicle_lights::state::HazardCode;

/// The lights are taken to be off until their button was watched for this long.
const BUTTON_SETTLE: Duration = Duration::from_secs(1);

/// What a key of `[hazard]` belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum HazardForm {
    /// `[hazard]` alone.
    Section,
    /// `[[hazard.source]]` alone.
    Source,
    /// Any form.
    From,
    /// A signal of its own.
    Signal,
    /// A signal that says why.
    Reason,
    /// A button that springs back.
    Button,
}

impl Key<HazardForm> {
    /// Whether it says what the signal is.
    fn is_of_signal(&self) -> bool {
        [HazardForm::Signal, HazardForm::Reason, HazardForm::Button].iter().any(|form| self.is_for(form))
    }
}

section! {
    /// `[hazard]` and `[[hazard.source]]`
    pub struct HazardFile by HazardForm {
        /// What diagnostics call a source.
        name: Option<Spanned<String>> [Source],
        /// Whether a source may stand in for one above it.
        fallback: Option<Spanned<bool>> [Source],
        /// Where the state comes from.
        from: Option<Spanned<Keyword<HazardFrom>>> [From],
        /// The signal.
        signal: Option<Spanned<String>> [Signal, Reason, Button],
        /// Its values for "on".
        on: Option<RawValues> [Signal, Button],
        /// Its values for "off".
        off: Option<RawValues> [Signal, Reason, Button],
        /// Its values for "not available".
        not_available: Option<RawValues> [Signal, Reason, Button],
        /// Its values for "fault".
        fault: Option<RawValues> [Signal, Reason, Button],
        /// Values by reason; each means "on".
        reasons: Option<Spanned<BTreeMap<String, RawValues>>> [Reason],
        /// Longest time of unknown positions of a button that cannot hide a press, ms.
        max_gap_ms: Option<Spanned<u64>> [Button],
        /// How long a button is watched before the state is known, ms.
        startup_delay_ms: Option<Spanned<u64>> [Button],
        /// Several sources, the most trusted first.
        #[serde(default)]
        source: Vec<Spanned<HazardFile>> [Section],
        /// How long sources may contradict each other, ms.
        disagreement_ms: Option<Spanned<u64>> [Section],
        /// What a reported fault does.
        on_fault: Option<Spanned<Keyword<OnFault>>> [Section],
        /// Signals that report a fault.
        #[serde(default)]
        fault_signal: Vec<FaultSignalFile> [Section],
    }
}

/// `from = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HazardFrom {
    /// A signal of its own.
    Signal,
    /// A signal that says why.
    Reason,
    /// Both turn sides on.
    BothSides,
    /// A button that springs back.
    Button,
    /// No hazard lights.
    NotFitted,
    /// Not visible on the bus.
    Unbound,
}

keywords!(HazardFrom {
    "signal" => HazardFrom::Signal,
    "reason" => HazardFrom::Reason,
    "both_sides" => HazardFrom::BothSides,
    "button" => HazardFrom::Button,
    "not_fitted" => HazardFrom::NotFitted,
    "unbound" => HazardFrom::Unbound,
});

pub(super) fn hazard(
    binder: &mut Binder<'_>,
    file: &Spanned<HazardFile>,
    turn: Option<&TurnBinding>,
) -> Option<HazardBinding> {
    let (span, file) = (file.span(), file.get_ref());
    let before = binder.checker.problems.len();
    let keys = file.keys();
    refuse_keys(
        binder,
        keys.iter().filter(|key| key.is_for(&HazardForm::Source)).cloned(),
        "belongs to [[hazard.source]]",
        "remove it, or describe the sources in [[hazard.source]]",
    );
    let sources = if file.source.is_empty() {
        refuse_given(
            binder,
            ("disagreement_ms", &file.disagreement_ms),
            "needs several sources",
            "remove it, or describe the sources in [[hazard.source]]",
        );
        let (from, _) = from(binder, file, &span)?;
        let none = match from {
            HazardFrom::NotFitted => Some(HazardBinding::NotFitted),
            HazardFrom::Unbound => Some(HazardBinding::Unbound),
            HazardFrom::Signal | HazardFrom::Reason | HazardFrom::BothSides | HazardFrom::Button => None,
        };
        if none.is_some() {
            refuse_strangers(binder, file, from);
            return none.filter(|_| binder.checker.problems.len() == before);
        }
        Sources::only(hazard_source(binder, file, &span, turn)?)
    } else {
        let keys = keys.into_iter().filter(|key| key.is_for(&HazardForm::From) || key.is_of_signal());
        refuse_keys(binder, keys, "conflicts with [[hazard.source]]", "move it into a [[hazard.source]]");
        sources(binder, file, turn)?
    };
    (binder.checker.problems.len() == before).then_some(HazardBinding::From(sources))
}

fn sources(
    binder: &mut Binder<'_>,
    file: &HazardFile,
    turn: Option<&TurnBinding>,
) -> Option<Sources<HazardSource>> {
    let mut list: Vec<NamedSource<HazardSource>> = Vec::new();
    for part in &file.source {
        let (span, part) = (part.span(), part.get_ref());
        let misplaced = part.keys().into_iter().filter(|key| key.is_for(&HazardForm::Section));
        refuse_keys(binder, misplaced, "belongs to [hazard]", "move it there");
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
    turn.map_or(Duration::ZERO, |turn| longest_hold(turn.sources()))
}

fn from(
    binder: &mut Binder<'_>,
    file: &HazardFile,
    span: &Range<usize>,
) -> Option<(HazardFrom, Range<usize>)> {
    if file.from.is_none() {
        binder.refuse(span.clone(), "missing field `from`", "see config/gateway.toml for every key");
    }
    file.from.as_ref().map(|from| (from.get_ref().0, from.span()))
}

/// Refuses keys that have no meaning with this `from`.
fn refuse_strangers(binder: &mut Binder<'_>, file: &HazardFile, from: HazardFrom) {
    let form = match from {
        HazardFrom::Signal => Some(HazardForm::Signal),
        HazardFrom::Button => Some(HazardForm::Button),
        HazardFrom::Reason => Some(HazardForm::Reason),
        HazardFrom::BothSides | HazardFrom::NotFitted | HazardFrom::Unbound => None,
    };
    let strangers = file.keys().into_iter().filter(Key::is_of_signal);
    let strangers = strangers.filter(|key| form.is_none_or(|form| !key.is_for(&form)));
    refuse_keys(binder, strangers, "has no meaning with this `from`", "remove it, or change `from`");
}

fn hazard_source(
    binder: &mut Binder<'_>,
    file: &HazardFile,
    span: &Range<usize>,
    turn: Option<&TurnBinding>,
) -> Option<HazardSource> {
    let (from, at) = from(binder, file, span)?;
    let before = binder.checker.problems.len();
    refuse_strangers(binder, file, from);
    if binder.checker.problems.len() > before {
        return None;
    }
    match from {
        HazardFrom::NotFitted | HazardFrom::Unbound => {
            let remedy = "remove the source, or give this `from` to [hazard] alone";
            binder.refuse(at, "this is not a source", remedy);
            None
        }
        HazardFrom::BothSides => {
            let shows_both =
                |turn: &TurnBinding| turn.sources().iter().any(|named| named.source.shows_both());
            if turn.is_some_and(|turn| !shows_both(turn)) {
                let remedy = "give [turn] `both` values or `both_on = \"hazard\"`, or change `from`";
                binder.refuse(at, "the turn binding cannot show both sides on", remedy);
                return None;
            }
            Some(HazardSource::BothSides)
        }
        HazardFrom::Signal | HazardFrom::Button => switched(binder, file, span, from),
        HazardFrom::Reason => {
            let remedy = "a hazard reason needs signal, off and [hazard.reasons]";
            require!(binder, span, file.{ signal, off, reasons }, remedy);
            reason_source(binder, file, signal, off, reasons)
        }
    }
}

/// A signal or a button.
fn switched(
    binder: &mut Binder<'_>,
    file: &HazardFile,
    span: &Range<usize>,
    from: HazardFrom,
) -> Option<HazardSource> {
    require!(binder, span, file.{ signal, on, off }, "a hazard signal needs signal, on and off");
    if from == HazardFrom::Button {
        let role =
            binder.switch(signal, [on, off], no_state(file.not_available.as_ref(), file.fault.as_ref()));
        let max_gap =
            binder.checker.limit(file.max_gap_ms.as_ref()).unwrap_or(StalkSettings::default().max_gap);
        let startup_delay = binder.checker.limit(file.startup_delay_ms.as_ref()).unwrap_or(BUTTON_SETTLE);
        return Some(HazardSource::Button { role: role?, max_gap, startup_delay });
    }
    binder.require_values(&[on, off]);
    let code = |active| HazardCode { active, reason: None };
    let role = hazard_role(binder, file, signal, [(on, code(true)), (off, code(false))])?;
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
    let numbered = (0..=u8::MAX).zip(reasons.values());
    let active = numbered.map(|(index, values)| (values, HazardCode { active: true, reason: Some(index) }));
    let codes = std::iter::once((off, HazardCode { active: false, reason: None })).chain(active);
    let role = hazard_role(binder, file, signal, codes)?;
    Some(HazardSource::Signal { role, reasons: reasons.keys().cloned().collect() })
}

fn hazard_role<'f>(
    binder: &mut Binder<'_>,
    file: &'f HazardFile,
    signal: &Spanned<String>,
    codes: impl IntoIterator<Item = (&'f RawValues, HazardCode)>,
) -> Option<Role<HazardCode>> {
    let codes = codes.into_iter().map(|(values, code)| (Some(values), code));
    binder.state_role(signal, codes, file.not_available.as_ref(), file.fault.as_ref())
}

impl HazardFile {
    /// Both turn sides on are the hazard lights.
    pub(super) fn is_from_both_sides(&self) -> bool {
        self.from.as_ref().is_some_and(|from| from.get_ref().0 == HazardFrom::BothSides)
    }
}
