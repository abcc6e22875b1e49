//! `[[v2i]]` of a profile: traffic-light states received over CAN.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;

use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Unexpected, Visitor};
use toml::Spanned;

use super::binder::{Binder, Meanings, no_state};
use super::keys::{refuse_keys, require, section};
use super::raw_values::{RawValue, RawValues};
use crate::core::traffic_light::bulb::{BulbSet, Category, Shape};
use crate::core::traffic_light::text::parse_bulbs;
use crate::core::traffic_light::v2i_reception::binding::{
    Confidence, Cycle, Group, GroupKey, V2iSource, V2iStates,
};
use crate::core::traffic_light::v2i_reception::movement_phase::movement_phase_states;
use crate::core::validation::meaning::{Meaning, RawRange};
use crate::core::validation::table::{MessageIndex, Role, SignalIndex};

const FORMS: &str =
    "give `id` for one group, or intersection, group, groups and group_timeout_ms for a message of many";

/// What a key of `[[v2i]]` belongs to, unless to both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum V2iForm {
    /// A signal for one group.
    Single,
    /// A message that tells of one group after another.
    Cycling,
}

section! {
    /// `[[v2i]]`: a signal for one group, or a message that tells of one group after another.
    pub struct V2iFile by V2iForm {
        /// The signal with the state.
        signal: Spanned<String>,
        /// Its values by what they mean.
        states: Spanned<StatesFile>,
        /// Its values for "not available".
        not_available: Option<RawValues>,
        /// Its values for "fault".
        fault: Option<RawValues>,
        /// How sure the unit is.
        confidence: Option<Spanned<ConfidenceFile>>,
        /// Signals that say whether the states can be used.
        #[serde(default)]
        status: Vec<StatusFile>,
        /// Of one group or head: its relation or way id.
        id: Option<Spanned<i64>> [Single],
        /// Of one group: the arrow of a protected movement.
        arrow: Option<Spanned<String>> [Single],
        /// Of a cycling message: the signal with the intersection's number.
        intersection: Option<Spanned<String>> [Cycling],
        /// Of a cycling message: the signal with the signal group's number.
        group: Option<Spanned<String>> [Cycling],
        /// Of a cycling message: which of them are which ids.
        groups: Option<Spanned<Vec<Spanned<V2iGroupFile>>>> [Cycling],
        /// Of a cycling message: longest believed time from one word of a group to the next, ms.
        group_timeout_ms: Option<Spanned<u64>> [Cycling],
    }
}

/// One entry of `groups = [{ … }]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct V2iGroupFile {
    /// Number of the intersection.
    pub intersection: Spanned<i64>,
    /// Number of the signal group there.
    pub group: Spanned<i64>,
    /// Relation or way id.
    pub id: Spanned<i64>,
    /// The arrow of a protected movement.
    pub arrow: Option<Spanned<String>>,
}

/// `confidence = { … }`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConfidenceFile {
    /// `MESSAGE.SIGNAL`
    pub signal: Spanned<String>,
    /// The raw value that means 1.
    pub full: Spanned<u32>,
    /// Values for "not available".
    pub not_available: Option<RawValues>,
}

/// `[[v2i.status]]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StatusFile {
    /// `MESSAGE.SIGNAL`
    pub signal: Spanned<String>,
    /// Values that let the states be used.
    pub good: RawValues,
    /// Values that make all states unknown.
    pub bad: RawValues,
}

/// `states = …`
#[derive(Debug, Clone)]
pub enum StatesFile {
    /// The numbers of SAE J2735 and ETSI TS 103 301.
    MovementPhaseState,
    /// Values by state text.
    Texts(BTreeMap<Spanned<String>, RawValues>),
}

impl<'de> Deserialize<'de> for StatesFile {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(StatesVisitor)
    }
}

struct StatesVisitor;

impl<'de> Visitor<'de> for StatesVisitor {
    type Value = StatesFile;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("\"movement_phase_state\", or states with their raw values such as { \"red\" = [3] }")
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<StatesFile, E> {
        if text == "movement_phase_state" {
            Ok(StatesFile::MovementPhaseState)
        } else {
            Err(E::invalid_value(Unexpected::Str(text), &self))
        }
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<StatesFile, A::Error> {
        Deserialize::deserialize(MapAccessDeserializer::new(map)).map(StatesFile::Texts)
    }
}

/// The sources, unless a problem was noted.
pub(super) fn v2i(binder: &mut Binder<'_>, files: &[Spanned<V2iFile>]) -> Option<Vec<V2iSource>> {
    let before = binder.checker.problems.len();
    let mut ids = Vec::new();
    let sources = files.iter().filter_map(|file| source(binder, file.get_ref(), &file.span(), &mut ids));
    let sources: Vec<_> = sources.collect();
    (binder.checker.problems.len() == before).then_some(sources)
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
    let mut many = file.keys();
    many.retain(|key| key.is_for(&V2iForm::Cycling));
    let states = match (&file.id, many.is_empty()) {
        (Some(id), true) => {
            let state = states(binder, file, file.arrow.as_ref());
            note_id(binder, id, ids);
            V2iStates::Single(Group { id: *id.get_ref(), state: state?, confidence })
        }
        (None, false) => V2iStates::Cycling(cycle(binder, file, span, confidence.as_ref(), ids)?),
        (Some(_), false) => {
            refuse_keys(binder, many.into_iter().take(1), "conflicts with `id`", FORMS);
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
        binder.refuse(id.span(), "0 is not an id", "give the id of a regulatory element or of a light's way");
    }
    if ids.contains(&number) {
        binder.refuse(id.span(), format!("{number} appears twice"), "give each id one signal");
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
    meanings.extend(no_state(file.not_available.as_ref(), file.fault.as_ref()));
    binder.role(&file.signal, &meanings)
}

/// A state in words. What is unknown is not ground truth (docs/spec/traffic-lights.md, "The word unknown").
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
        let reason = format!("{:?} is not an arrow", text.get_ref());
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
    meanings.extend(no_state(file.not_available.as_ref(), None));
    Some(Confidence { role: binder.role(&file.signal, &meanings)?, full })
}

fn status(binder: &mut Binder<'_>, file: &StatusFile) -> Option<Role<bool>> {
    binder.switch(&file.signal, [&file.good, &file.bad], std::iter::empty())
}

fn cycle(
    binder: &mut Binder<'_>,
    file: &V2iFile,
    span: &Range<usize>,
    confidence: Option<&Confidence>,
    ids: &mut Vec<i64>,
) -> Option<Cycle> {
    require!(binder, span, file.{ intersection, group, groups, group_timeout_ms }, FORMS);
    if let Some(arrow) = &file.arrow {
        let remedy = "move it into the entries of `groups`";
        binder.refuse(arrow.span(), "each group has its own arrow", remedy);
    }
    let state = states(binder, file, None);
    let bound = (binder.signal(intersection), binder.signal(group));
    let timeout = binder.checker.limit(Some(group_timeout_ms)).unwrap_or_default();
    if groups.get_ref().is_empty() {
        binder.refuse(groups.span(), "no group is mapped", "add { intersection = 1, group = 1, id = … }");
    }
    let (state, (intersection_role, intersections), (group_role, numbers)) = (state?, bound.0?, bound.1?);
    let mut in_frame =
        vec![(state.signal, &file.signal), (group_role, group), (intersection_role, intersection)];
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
    Some(Cycle { intersection: intersection_role, group: group_role, groups: mapped, timeout })
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
