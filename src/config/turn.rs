//! From `[turn]` of a profile to its binding.

use std::ops::Range;
use std::time::Duration;

use toml::Spanned;

use super::lights::{disagreement, keys_missing, millis, refuse_keys, source_settings, spans};
use super::roles::{Binder, Meanings};
use super::vehicle_file::{LampFile, SentFile, StalkFile, TurnFile, TurnKind};
use crate::core::trust::meaning::Meaning;
use crate::core::vehicle_lights::binding::{
    NamedSource, SidePair, Sources, TurnBinding, TurnCode, TurnSource,
};
use crate::core::vehicle_lights::lamp::LampSettings;
use crate::core::vehicle_lights::lamp::timing::{Sampling, Unresolvable, resolvable};
use crate::core::vehicle_lights::stalk::{Comfort, StalkPosition, StalkSettings};

/// The ways to bind the turn state.
const FORMS: &str = "give `signal` with off, left and right, or `left_signal`, `right_signal` and `both_on`, \
                     or `kind`, or [[turn.source]], or `fitted = false`";
const STATE_KEYS: &[&str] = &["signal", "off", "left", "right", "both", "not_available", "fault"];
const PAIR_KEYS: &[&str] = &["left_signal", "right_signal", "both_on"];
const LAMP_KEYS: &[&str] = &["left_signal", "right_signal", "both_on", "lamp"];
const STALK_KEYS: &[&str] = &[
    "signal",
    "idle",
    "left_half",
    "left_full",
    "right_half",
    "right_full",
    "not_available",
    "fault",
    "stalk",
];
/// Time from a change of a lamp to its frame when the profile gives none.
const DEFAULT_LATENCY: Duration = Duration::from_millis(100);
/// Disagreement is no finding while a lamp may still be held, and this much longer.
const BEYOND_HOLD: Duration = Duration::from_millis(500);

pub(super) fn turn(binder: &mut Binder<'_>, file: &Spanned<TurnFile>) -> Option<TurnBinding> {
    let (span, file) = (file.span(), file.get_ref());
    let before = binder.problems.len();
    let keys = form_keys(file);
    if file.fitted.as_ref().is_some_and(|fitted| !fitted.get_ref()) {
        let sources = file.source.iter().map(Spanned::span);
        let Some(extra) = keys.iter().map(|(_, at)| at.clone()).chain(sources).next() else {
            return Some(TurnBinding::NotFitted);
        };
        binder.refuse(extra, "a vehicle without indicators has no turn signal", FORMS);
        return None;
    }
    refuse_keys(
        binder,
        spans(&[("name", &file.name)]).chain(spans(&[("fallback", &file.fallback)])),
        "belongs to [[turn.source]]",
        "remove it, or describe the sources in [[turn.source]]",
    );
    let sources = if file.source.is_empty() {
        refuse_keys(
            binder,
            spans(&[("disagreement_ms", &file.disagreement_ms)]),
            "needs several sources",
            "remove it, or describe the sources in [[turn.source]]",
        );
        Sources::only(turn_source(binder, file, &span)?)
    } else {
        refuse_keys(binder, keys, "stands beside [[turn.source]]", "move it into a [[turn.source]]");
        sources(binder, file)?
    };
    (binder.problems.len() == before).then_some(TurnBinding::From(sources))
}

fn sources(binder: &mut Binder<'_>, file: &TurnFile) -> Option<Sources<TurnSource>> {
    let mut list: Vec<NamedSource<TurnSource>> = Vec::new();
    for part in &file.source {
        let (span, part) = (part.span(), part.get_ref());
        let nested = part.source.iter().map(|inner| ("source", inner.span()));
        let faults = part.fault_signal.iter().map(|fault| ("fault_signal", fault.signal.span()));
        refuse_keys(
            binder,
            spans(&[("disagreement_ms", &part.disagreement_ms)])
                .chain(spans(&[("while_hazard", &part.while_hazard)]))
                .chain(spans(&[("on_fault", &part.on_fault)]))
                .chain(spans(&[("fitted", &part.fitted)]))
                .chain(nested)
                .chain(faults),
            "belongs to [turn]",
            "move it there",
        );
        let names: Vec<_> = list.iter().map(|named| named.name.as_str()).collect();
        let settings = source_settings(binder, &span, part.name.as_ref(), part.fallback.as_ref(), &names);
        let source = turn_source(binder, part, &span);
        let (Some((name, settings)), Some(source)) = (settings, source) else { continue };
        list.push(NamedSource { name, settings, source });
    }
    let disagreement = disagreement(binder, file.disagreement_ms.as_ref(), longest_hold(&list));
    (list.len() == file.source.len()).then_some(Sources { list, disagreement })
}

/// How long lamps may be held on, and a bit; other sources may be off by then.
pub(super) fn longest_hold(list: &[NamedSource<TurnSource>]) -> Duration {
    let holds = list.iter().filter_map(|named| match &named.source {
        TurnSource::Lamps { settings, .. } => Some(settings.hold.saturating_add(BEYOND_HOLD)),
        TurnSource::Enumerated(_) | TurnSource::Pair(_) | TurnSource::Stalk { .. } => None,
    });
    holds.max().unwrap_or_default()
}

/// The keys that say what the signals are, as far as given.
fn form_keys(file: &TurnFile) -> Vec<(&'static str, Range<usize>)> {
    spans(&[("kind", &file.kind)])
        .chain(spans(&[("signal", &file.signal)]))
        .chain(spans(&[
            ("off", &file.off),
            ("left", &file.left),
            ("right", &file.right),
            ("both", &file.both),
            ("not_available", &file.not_available),
            ("fault", &file.fault),
        ]))
        .chain(spans(&[("left_signal", &file.left_signal), ("right_signal", &file.right_signal)]))
        .chain(spans(&[("both_on", &file.both_on)]))
        .chain(spans(&[("lamp", &file.lamp)]))
        .chain(spans(&[
            ("idle", &file.idle),
            ("left_half", &file.left_half),
            ("left_full", &file.left_full),
            ("right_half", &file.right_half),
            ("right_full", &file.right_full),
        ]))
        .chain(spans(&[("stalk", &file.stalk)]))
        .collect()
}

fn turn_source(binder: &mut Binder<'_>, file: &TurnFile, span: &Range<usize>) -> Option<TurnSource> {
    let mut keys = form_keys(file);
    keys.retain(|(key, _)| *key != "kind");
    let given = |of: &[&str]| keys.iter().find(|(key, _)| of.contains(key)).map(|(_, at)| at.clone());
    let (takes, name): (&[&str], _) = match file.kind.as_ref().map(|kind| *kind.get_ref()) {
        Some(TurnKind::Lamp) => (LAMP_KEYS, "with kind = \"lamp\""),
        Some(TurnKind::Stalk) => (STALK_KEYS, "with kind = \"stalk\""),
        None => match (given(STATE_KEYS), given(PAIR_KEYS)) {
            (Some(_), Some(extra)) => {
                let reason = "one enumerated signal and a pair of signals exclude each other";
                binder.refuse(extra, reason, FORMS);
                return None;
            }
            (None, None) if keys.is_empty() => {
                binder.refuse(span.clone(), "the turn state comes from no signal", FORMS);
                return None;
            }
            (_, None) => (STATE_KEYS, "without `kind`"),
            (None, Some(_)) => (PAIR_KEYS, "without `kind`"),
        },
    };
    let is_pair = takes == PAIR_KEYS;
    keys.retain(|(key, _)| !takes.contains(key));
    if !keys.is_empty() {
        refuse_keys(binder, keys, &format!("has no meaning {name}"), "remove it, or change `kind`");
        return None;
    }
    match &file.kind {
        Some(kind) => match kind.get_ref() {
            TurnKind::Lamp => lamps(binder, file, span),
            TurnKind::Stalk => stalk(binder, file, span),
        },
        None if is_pair => turn_pair(binder, file, span).map(TurnSource::Pair),
        None => enumerated_turn(binder, file, span),
    }
}

fn enumerated_turn(binder: &mut Binder<'_>, file: &TurnFile, span: &Range<usize>) -> Option<TurnSource> {
    let (Some(signal), Some(off), Some(left), Some(right)) =
        (&file.signal, &file.off, &file.left, &file.right)
    else {
        let missing = keys_missing(&[
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
    binder.role(signal, &meanings).map(TurnSource::Enumerated)
}

fn turn_pair(binder: &mut Binder<'_>, file: &TurnFile, span: &Range<usize>) -> Option<SidePair> {
    let (Some(left_file), Some(right_file), Some(both)) =
        (&file.left_signal, &file.right_signal, &file.both_on)
    else {
        let missing = keys_missing(&[
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
    Some(SidePair { left, right, both: (*both.get_ref()).into() })
}

fn lamps(binder: &mut Binder<'_>, file: &TurnFile, span: &Range<usize>) -> Option<TurnSource> {
    let pair = turn_pair(binder, file, span)?;
    let message =
        |side: &SidePair| [&side.left, &side.right].map(|role| binder.signals[role.signal.0].message);
    let [left, right] = message(&pair);
    let at = |side: &Option<Spanned<_>>| side.as_ref().map_or(span.clone(), Spanned::span);
    if left != right {
        let reason = "the lamps come in different messages, so they are never seen at the same time";
        binder.refuse(at(&file.right_signal), reason, "bind two lamps of one message");
        return None;
    }
    let message = binder.messages[left.0].1;
    let empty = LampFile::default();
    let times = file.lamp.as_ref().map_or(&empty, Spanned::get_ref);
    let cycle = message.cycle_ms.filter(|cycle| *cycle > 0).map(u64::from);
    let sampling = sampling(binder, times, cycle, &at(&file.left_signal), &message.name)?;
    let default = LampSettings::for_message(sampling);
    let settings = LampSettings {
        hold: millis(binder, times.hold_ms.as_ref(), default.hold),
        confirm: millis(binder, times.confirm_ms.as_ref(), default.confirm),
        steady_limit: millis(binder, times.steady_limit_ms.as_ref(), default.steady_limit),
        fast_period: millis(binder, times.fast_period_ms.as_ref(), default.fast_period),
        ..default
    };
    match resolvable(sampling, settings.hold) {
        Ok(resolution) => Some(TurnSource::Lamps { pair, settings, resolution }),
        Err(why) => {
            let given = match why {
                Unresolvable::TooSlow { .. } => &times.period_ms,
                Unresolvable::HoldTooShort { .. } => &times.hold_ms,
            };
            let at = given.as_ref().map_or_else(|| at(&file.left_signal), Spanned::span);
            let remedy = match why {
                Unresolvable::TooSlow { .. } => {
                    "bind a logical or request signal, or a message sent at each change (lamp.sent)"
                }
                Unresolvable::HoldTooShort { .. } => "remove hold_ms: the default is long enough",
            };
            binder.refuse(at, format!("{}: {why}", message.name), remedy);
            None
        }
    }
}

fn sampling(
    binder: &mut Binder<'_>,
    times: &LampFile,
    cycle_ms: Option<u64>,
    at: &Range<usize>,
    message: &str,
) -> Option<Sampling> {
    match times.sent {
        SentFile::OnChange => {
            let cyclic = spans(&[("period_ms", &times.period_ms), ("jitter_ms", &times.jitter_ms)]);
            refuse_keys(binder, cyclic, "has no meaning with sent = \"on_change\"", "give latency_ms");
            Some(Sampling::OnChange { latency: millis(binder, times.latency_ms.as_ref(), DEFAULT_LATENCY) })
        }
        SentFile::Cyclic => {
            let latency = spans(&[("latency_ms", &times.latency_ms)]);
            refuse_keys(binder, latency, "has no meaning with sent = \"cyclic\"", "give period_ms");
            let default = cycle_ms.map(Duration::from_millis);
            if default.is_none() && times.period_ms.is_none() {
                let reason = format!("no period for {message}: the DBC has no GenMsgCycleTime for it");
                binder.refuse(at.clone(), reason, "add lamp = { period_ms = … }");
                return None;
            }
            let period = millis(binder, times.period_ms.as_ref(), default.unwrap_or_default());
            let jitter = millis(binder, times.jitter_ms.as_ref(), period / 10);
            Some(Sampling::Cyclic { period, jitter })
        }
    }
}

fn stalk(binder: &mut Binder<'_>, file: &TurnFile, span: &Range<usize>) -> Option<TurnSource> {
    let (Some(signal), Some(idle), Some(left_full), Some(right_full)) =
        (&file.signal, &file.idle, &file.left_full, &file.right_full)
    else {
        let missing = keys_missing(&[
            ("signal", file.signal.is_none()),
            ("idle", file.idle.is_none()),
            ("left_full", file.left_full.is_none()),
            ("right_full", file.right_full.is_none()),
        ]);
        let remedy =
            "a stalk needs signal, idle, left_full and right_full; left_half and right_half if it has them";
        binder.refuse(span.clone(), missing, remedy);
        return None;
    };
    binder.require_values(&[idle, left_full, right_full]);
    let defined = |position| Meaning::Defined(position);
    let mut meanings: Meanings<'_, StalkPosition> = vec![
        (idle, defined(StalkPosition::Idle)),
        (left_full, defined(StalkPosition::LeftFull)),
        (right_full, defined(StalkPosition::RightFull)),
    ];
    meanings.extend(file.left_half.iter().map(|values| (values, defined(StalkPosition::LeftHalf))));
    meanings.extend(file.right_half.iter().map(|values| (values, defined(StalkPosition::RightHalf))));
    meanings.extend(file.not_available.iter().map(|values| (values, Meaning::NotAvailable)));
    meanings.extend(file.fault.iter().map(|values| (values, Meaning::Fault)));
    let role = binder.role(signal, &meanings);
    let empty = StalkFile::default();
    let settings = stalk_settings(binder, file.stalk.as_ref().map_or(&empty, Spanned::get_ref));
    Some(TurnSource::Stalk { role: role?, settings })
}

fn stalk_settings(binder: &mut Binder<'_>, file: &StalkFile) -> StalkSettings {
    let default = StalkSettings::default();
    if let (Some(_), Some(time)) = (&file.comfort_flashes, &file.comfort_ms) {
        let reason = "comfort_flashes and comfort_ms exclude each other";
        binder.refuse(time.span(), reason, "keep one of them");
    }
    let comfort = match (&file.comfort_flashes, &file.comfort_ms) {
        (Some(flashes), _) => match default.comfort {
            Comfort::Flashes { per_minute, .. } => Comfort::Flashes { count: *flashes.get_ref(), per_minute },
            Comfort::For(_) => default.comfort,
        },
        (None, Some(time)) => Comfort::For(millis(binder, Some(time), Duration::ZERO)),
        (None, None) => default.comfort,
    };
    StalkSettings {
        comfort,
        opposite_half: file.opposite_half.map_or(default.opposite_half, Into::into),
        opposite_full: file.opposite_full.map_or(default.opposite_full, Into::into),
        repeat: file.repeat.map_or(default.repeat, Into::into),
        max_on: file.max_on_ms.as_ref().map(|limit| millis(binder, Some(limit), Duration::ZERO)),
        blind: millis(binder, file.blind_ms.as_ref(), default.blind),
        settle: millis(binder, file.settle_ms.as_ref(), default.settle.max(comfort.duration())),
    }
}
