//! From `[[v2i]]` of a profile to its binding.

use std::ops::Range;
use std::time::Duration;

use toml::Spanned;

use super::lights::{keys_missing, millis, refuse_keys, spans};
use super::roles::{Binder, Meanings};
use super::v2i_file::{ConfidenceFile, StatesFile, StatusFile, V2iFile, V2iGroupFile};
use super::vehicle_file::{RawValue, RawValues};
use crate::core::traffic_light::bulb::{BulbSet, Category, Shape};
use crate::core::traffic_light::text::parse_bulbs;
use crate::core::traffic_light::v2i_reception::binding::{
    Confidence, Cycle, Group, GroupKey, V2iSource, V2iStates,
};
use crate::core::traffic_light::v2i_reception::movement_phase::movement_phase_states;
use crate::core::trust::meaning::{Meaning, RawRange};
use crate::core::trust::table::{MessageIndex, Role, SignalIndex};

const FORMS: &str =
    "give `id` for one group, or intersection, group, groups and group_timeout_ms for a message of many";

/// The sources, unless a problem was noted.
pub(super) fn v2i(binder: &mut Binder<'_>, files: &[Spanned<V2iFile>]) -> Option<Vec<V2iSource>> {
    let before = binder.problems.len();
    let mut ids = Vec::new();
    let sources = files.iter().filter_map(|file| source(binder, file.get_ref(), &file.span(), &mut ids));
    let sources: Vec<_> = sources.collect();
    (binder.problems.len() == before).then_some(sources)
}

fn source(
    binder: &mut Binder<'_>,
    file: &V2iFile,
    span: &Range<usize>,
    ids: &mut Vec<i64>,
) -> Option<V2iSource> {
    // What is refused here is noted, so it is not missed.
    let confidence = file.confidence.as_ref().and_then(|file| confidence(binder, file.get_ref()));
    let status: Vec<_> = file.status.iter().filter_map(|file| status(binder, file)).collect();
    let many = spans(&[("intersection", &file.intersection), ("group", &file.group)])
        .chain(spans(&[("groups", &file.groups)]))
        .chain(spans(&[("group_timeout_ms", &file.group_timeout_ms)]));
    let many: Vec<_> = many.collect();
    let states = match (&file.id, many.is_empty()) {
        (Some(id), true) => {
            let state = states(binder, file, file.arrow.as_ref());
            note_id(binder, id, ids);
            V2iStates::Single(Group { id: *id.get_ref(), state: state?, confidence })
        }
        (None, false) => V2iStates::Cycling(cycle(binder, file, span, confidence.as_ref(), ids)?),
        (Some(_), false) => {
            refuse_keys(binder, many.into_iter().take(1), "stands beside `id`", FORMS);
            return None;
        }
        (None, true) => {
            binder.refuse(span.clone(), "neither `id` nor `groups` say whose states these are", FORMS);
            return None;
        }
    };
    Some(V2iSource { states, status })
}

fn note_id(binder: &mut Binder<'_>, id: &Spanned<i64>, ids: &mut Vec<i64>) {
    let number = *id.get_ref();
    if number == 0 {
        binder.refuse(id.span(), "0 is no id", "give the id of a regulatory element or of a light's way");
    }
    if ids.contains(&number) {
        binder.refuse(id.span(), format!("{number} is told of twice"), "give each id one signal");
    }
    ids.push(number);
}

/// The state signal with its values.
fn states(binder: &mut Binder<'_>, file: &V2iFile, arrow: Option<&Spanned<String>>) -> Option<Role<BulbSet>> {
    let mut numbers = Vec::new();
    let mut meanings: Meanings<'_, BulbSet> = Vec::new();
    match file.states.get_ref() {
        StatesFile::MovementPhaseState => {
            let protected = arrow.map_or(Some(Shape::Circle), |arrow| arrow_shape(binder, arrow))?;
            let at = file.states.span();
            numbers.extend(movement_phase_states(protected).map(|(number, meaning)| {
                let value = Spanned::new(at.clone(), RawValue(RawRange::single(number)));
                (Spanned::new(at.clone(), vec![value]), meaning)
            }));
            meanings.extend(numbers.iter().map(|(values, meaning)| (values, *meaning)));
        }
        StatesFile::Texts(texts) => {
            if let Some(arrow) = arrow {
                let remedy = "remove it, or use states = \"movement_phase_state\"";
                binder.refuse(arrow.span(), "the states say themselves which arrow is lit", remedy);
                return None;
            }
            if texts.is_empty() {
                let remedy = "name states with their raw values, e.g. { \"red\" = [3], \"green\" = [5] }";
                binder.refuse(file.states.span(), "no state is named", remedy);
                return None;
            }
            let bulbs: Vec<_> = texts.keys().map(|text| bulbs(binder, text)).collect();
            binder.require_values(&texts.values().collect::<Vec<&RawValues>>());
            for (bulbs, values) in bulbs.into_iter().zip(texts.values()) {
                meanings.push((values, Meaning::Defined(bulbs?)));
            }
        }
    }
    meanings.extend(file.not_available.iter().map(|values| (values, Meaning::NotAvailable)));
    meanings.extend(file.fault.iter().map(|values| (values, Meaning::Fault)));
    binder.role(&file.signal, &meanings)
}

/// A state in words. What is unknown is no ground truth (traffic-lights section 3.2).
fn bulbs(binder: &mut Binder<'_>, text: &Spanned<String>) -> Option<BulbSet> {
    let (reason, remedy) = match parse_bulbs(text.get_ref()) {
        Ok(bulbs) if bulbs.is_empty() => {
            ("a state has at least one bulb".to_owned(), "write \"solidOff\" for a dark light")
        }
        Ok(_) if text.get_ref().to_lowercase().contains("unknown") => {
            ("what the network tells is known".to_owned(), "put these values into `not_available`")
        }
        Ok(bulbs) => return Some(bulbs),
        Err(error) => {
            (error.to_string(), "write bulbs as colour, status, shape, e.g. \"red\" or \"red, green right\"")
        }
    };
    binder.refuse(text.span(), reason, remedy);
    None
}

fn arrow_shape(binder: &mut Binder<'_>, text: &Spanned<String>) -> Option<Shape> {
    let shape: Option<Shape> = text.get_ref().parse().ok();
    let arrow = shape.filter(|shape| shape.category() == Category::Arrow);
    if arrow.is_none() {
        let arrows = Shape::ALL.into_iter().filter(|shape| shape.category() == Category::Arrow);
        let names: Vec<_> = arrows.map(Shape::name).collect();
        let reason = format!("{:?} is no arrow", text.get_ref());
        binder.refuse(text.span(), reason, &format!("use one of {}", names.join(", ")));
    }
    arrow
}

fn confidence(binder: &mut Binder<'_>, file: &ConfidenceFile) -> Option<Confidence> {
    let (full, at) = (*file.full.get_ref(), file.full.span());
    if full == 0 {
        binder.refuse(at, "0 cannot mean full confidence", "give the raw value that does, e.g. 100");
        return None;
    }
    let range = RawRange { first: 0, last: full.into() };
    let defined = Spanned::new(at.clone(), vec![Spanned::new(at, RawValue(range))]);
    let mut meanings = vec![(&defined, Meaning::Defined(()))];
    meanings.extend(file.not_available.iter().map(|values| (values, Meaning::NotAvailable)));
    Some(Confidence { role: binder.role(&file.signal, &meanings)?, full })
}

fn status(binder: &mut Binder<'_>, file: &StatusFile) -> Option<Role<bool>> {
    binder.require_values(&[&file.good, &file.bad]);
    let meanings = vec![(&file.good, Meaning::Defined(true)), (&file.bad, Meaning::Defined(false))];
    binder.role(&file.signal, &meanings)
}

fn cycle(
    binder: &mut Binder<'_>,
    file: &V2iFile,
    span: &Range<usize>,
    confidence: Option<&Confidence>,
    ids: &mut Vec<i64>,
) -> Option<Cycle> {
    let (Some(intersection_file), Some(group_file), Some(groups), Some(timeout)) =
        (&file.intersection, &file.group, &file.groups, &file.group_timeout_ms)
    else {
        let missing = keys_missing(&[
            ("intersection", file.intersection.is_none()),
            ("group", file.group.is_none()),
            ("groups", file.groups.is_none()),
            ("group_timeout_ms", file.group_timeout_ms.is_none()),
        ]);
        binder.refuse(span.clone(), missing, FORMS);
        return None;
    };
    if let Some(arrow) = &file.arrow {
        let remedy = "move it into the entries of `groups`";
        binder.refuse(arrow.span(), "each group has its own arrow", remedy);
    }
    let state = states(binder, file, None);
    let intersection = binder.signal(intersection_file);
    let group = binder.signal(group_file);
    let timeout = millis(binder, Some(timeout), Duration::ZERO);
    if groups.get_ref().is_empty() {
        binder.refuse(groups.span(), "no group is mapped", "add { intersection = 1, group = 1, id = … }");
    }
    let (state, (intersection, intersections), (group, numbers)) = (state?, intersection?, group?);
    let mut in_frame =
        vec![(state.signal, &file.signal), (group, group_file), (intersection, intersection_file)];
    if let (Some(bound), Some(file)) = (confidence, &file.confidence) {
        in_frame.push((bound.role.signal, &file.get_ref().signal));
    }
    let message = binder.signals[state.signal.0].message;
    in_every_frame(binder, message, &in_frame);
    let mut mapped: Vec<(GroupKey, Group)> = Vec::new();
    for entry in groups.get_ref() {
        let (at, entry) = (entry.span(), entry.get_ref());
        let V2iGroupFile { intersection, group, id, arrow } = entry;
        for (number, signal) in [(intersection, intersections), (group, numbers)] {
            let (lowest, highest) = signal.codec.range();
            let raw = i128::from(*number.get_ref());
            if raw < lowest || raw > highest {
                let reason = format!("{} cannot hold {raw}", signal.name);
                binder.refuse(number.span(), reason, &format!("its raw values are {lowest} to {highest}"));
            }
        }
        let key = (i128::from(*intersection.get_ref()), i128::from(*group.get_ref()));
        if mapped.iter().any(|(known, _)| *known == key) {
            let reason = format!("group {} of intersection {} is mapped twice", key.1, key.0);
            binder.refuse(at, reason, "map each group to one id");
        }
        note_id(binder, id, ids);
        let state = match arrow {
            None => Some(state.clone()),
            Some(arrow) => states(binder, file, Some(arrow)),
        };
        let Some(state) = state else { continue };
        mapped.push((key, Group { id: *id.get_ref(), state, confidence: confidence.cloned() }));
    }
    mapped.sort_by_key(|(key, _)| *key);
    Some(Cycle { intersection, group, groups: mapped, timeout })
}

/// Refuses signals that do not come in each frame of the message, beside the state.
fn in_every_frame(
    binder: &mut Binder<'_>,
    message: MessageIndex,
    signals: &[(SignalIndex, &Spanned<String>)],
) {
    for (signal, text) in signals {
        let bound = &binder.signals[signal.0];
        if bound.message != message {
            let reason = "the state comes in another message, so they do not belong together";
            binder.refuse(text.span(), reason, "bind signals of one message");
        } else if bound.codec.is_multiplexed() {
            let reason = format!("{} is not in each frame of its message", bound.name);
            binder.refuse(text.span(), reason, "bind a signal that is, or give it an `id` of its own");
        }
    }
}
