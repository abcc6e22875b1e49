//! `[[v2i]]` of a profile: traffic-light states received over CAN.

use super::binder::{Binder, Meanings, NOT_AVAILABLE, UNUSABLE, unusable_values};
use super::raw_values::RawValues;
use crate::config::reading::{Fields, Kind, LocatedText, Location, SourceLocation};
use can_signal::validation::meaning::{Meaning, RawRange};
use can_signal::validation::table::{MessageIndex, Role, SignalIndex};
use gateway_core::v2i_reception::binding::{
    BoundGroup, Confidence, CyclingMessage, GroupKey, V2iSource, V2iStates,
};
use gateway_core::v2i_reception::movement_phase::movement_phase_states;
use traffic_lights::bulb::{BulbSet, BulbShape};
use traffic_lights::text::parse_bulbs;

const FORMS: &str =
    "give `id` for one group, or intersection, group, groups and group_timeout_ms for a message of many";

/// Keys of a message that carries the states of one group after another.
const CYCLE_KEYS: &[&str] = &["intersection", "group", "groups", "group_timeout_ms"];

/// An id with a state, and its location in the profile.
#[derive(Debug, Clone)]
pub(in crate::config) struct LocatedId {
    pub id: i64,
    pub location: SourceLocation,
}

/// Reads the sources, and the ids of their groups and heads; `None` if a problem was recorded.
pub(super) fn v2i(binder: &mut Binder<'_>, top: &Fields<'_>) -> Option<(Vec<V2iSource>, Vec<LocatedId>)> {
    let before = binder.checker.count();
    let mut ids = Vec::new();
    let sources = top.read_tables("v2i", |fields| source(binder, fields, &mut ids));
    (top.checker.count() == before).then_some((sources, ids))
}

fn source(binder: &mut Binder<'_>, fields: &Fields<'_>, ids: &mut Vec<LocatedId>) -> Option<V2iSource> {
    let is_complete = fields.require(&["signal", "states"], "");
    let confidence = fields.read_table("confidence", |section| confidence(binder, section));
    let status = fields.read_tables("status", |part| binder.switch(part, ["good", "bad"], &[], ""));
    if is_complete.is_none() {
        fields.accept_rest();
        return None;
    }
    let states = if fields.has("id") {
        fields.set_form("with `id`");
        let arrow = fields.string("arrow");
        let state = states(binder, fields, arrow.as_ref());
        V2iStates::Single(BoundGroup { id: id(fields, ids)?, state: state?, confidence })
    } else if CYCLE_KEYS.iter().any(|key| fields.has(key)) {
        fields.set_form("without `id`");
        V2iStates::Cycling(cycle(binder, fields, confidence.as_ref(), ids)?)
    } else {
        binder.refuse(fields.location(), "neither `id` nor `groups` names the traffic light", FORMS);
        fields.accept_rest();
        return None;
    };
    Some(V2iSource { states, status })
}

/// Reads the id of a relation or way, which must be unique.
fn id(fields: &Fields<'_>, ids: &mut Vec<LocatedId>) -> Option<i64> {
    let number = fields.whole("id")?;
    if number == 0 {
        fields.refuse("id", "0 is not an id", "give the id of a regulatory element or of a light's way");
    }
    if ids.iter().any(|known| known.id == number) {
        fields.refuse("id", format!("{number} appears twice"), "give each id one signal");
    }
    ids.push(LocatedId { id: number, location: fields.checker.source_location(fields.at("id")) });
    Some(number)
}

/// Reads the state signal with its values; `arrow` is for a protected movement.
fn states(
    binder: &mut Binder<'_>,
    fields: &Fields<'_>,
    arrow: Option<&LocatedText>,
) -> Option<Role<BulbSet>> {
    let (signal, unusable) = (fields.string("signal"), unusable_values(fields, UNUSABLE));
    let value = fields.value("states")?;
    let mut meanings: Meanings<BulbSet> = Vec::new();
    match &value.kind {
        Kind::Scalar { text, is_quoted: true } if text == "movement_phase_state" => {
            let protected = arrow.map_or(Some(BulbShape::Circle), |arrow| arrow_shape(binder, arrow))?;
            meanings.extend(movement_phase_states(protected).map(|(number, meaning)| {
                (RawValues::one(RawRange::single(number), &value.location), meaning)
            }));
        }
        Kind::Map(texts) => {
            if let Some(arrow) = arrow {
                let remedy = "remove it, or use states = \"movement_phase_state\"";
                let reason = "states that are written out name their arrows themselves";
                return binder.checker.refused(&arrow.location, reason, remedy);
            }
            if texts.is_empty() {
                let remedy = "name states with their raw values, e.g. { \"red\" = [3], \"green\" = [5] }";
                binder.refuse(&value.location, "no state is given", remedy);
            }
            for entry in texts {
                let bulbs = bulbs(binder, &entry.key, &entry.location);
                let values = RawValues::some_of(binder.checker, &entry.value);
                meanings.extend(bulbs.map(|bulbs| (values, Meaning::Defined(bulbs))));
            }
        }
        Kind::Null | Kind::Scalar { .. } | Kind::List(_) => {
            let expected =
                "\"movement_phase_state\", or states with their raw values such as { \"red\" = [3] }";
            binder.checker.refuse_kind(value, expected);
        }
    }
    meanings.extend(unusable);
    binder.role(&signal?, &meanings)
}

/// Reads the text of a state. An unknown state is not ground truth (docs/spec/traffic-lights.md,
/// "Unknown states").
fn bulbs(binder: &Binder<'_>, text: &str, at: &Location) -> Option<BulbSet> {
    let (reason, remedy) = match parse_bulbs(text) {
        Ok(bulbs) if bulbs.is_empty() => {
            ("a state has at least one bulb".to_owned(), "write \"solidOff\" for a dark light")
        }
        Ok(_) if text.to_lowercase().contains("unknown") => (
            "a state received over V2I cannot be unknown".to_owned(),
            "put these values into `not_available`",
        ),
        Ok(bulbs) => return Some(bulbs),
        Err(error) => {
            (error.to_string(), "write bulbs as colour, status, shape, e.g. \"red\" or \"red, green right\"")
        }
    };
    binder.checker.refused(at, reason, remedy)
}

fn arrow_shape(binder: &Binder<'_>, given: &LocatedText) -> Option<BulbShape> {
    let shape: Option<BulbShape> = given.text.parse().ok();
    let arrow = shape.filter(|shape| shape.is_arrow());
    if arrow.is_none() {
        let arrows = BulbShape::ALL.into_iter().filter(|shape| shape.is_arrow());
        let names: Vec<_> = arrows.map(BulbShape::name).collect();
        let reason = format!("{:?} is not an arrow", given.text);
        binder.refuse(&given.location, reason, &format!("use one of {}", names.join(", ")));
    }
    arrow
}

/// Reads the signal of the unit's confidence, and the raw value that means 1.
fn confidence(binder: &mut Binder<'_>, fields: &Fields<'_>) -> Option<Confidence> {
    fields.require(&["signal", "full"], "");
    let signal = fields.string("signal");
    let full = fields.number("full", 1..=u32::MAX, "");
    let unusable = unusable_values(fields, NOT_AVAILABLE);
    let (signal, full) = (signal?, full?);
    let values = RawValues::one(RawRange { first: 0, last: full.into() }, fields.at("full"));
    let mut meanings = vec![(values, Meaning::Defined(()))];
    meanings.extend(unusable);
    Some(Confidence { role: binder.role(&signal, &meanings)?, full })
}

/// Reads a message that carries the states of one group after another.
fn cycle(
    binder: &mut Binder<'_>,
    fields: &Fields<'_>,
    confidence: Option<&Confidence>,
    ids: &mut Vec<LocatedId>,
) -> Option<CyclingMessage> {
    let is_complete = fields.require(CYCLE_KEYS, FORMS);
    if fields.value("arrow").is_some() {
        let remedy = "move it into the entries of `groups`";
        fields.refuse("arrow", "each group has its own arrow", remedy);
    }
    let (intersection, group) = (fields.string("intersection"), fields.string("group"));
    let timeout = fields.limit("group_timeout_ms").unwrap_or_default();
    let entries: Vec<_> = fields.tables("groups").collect();
    let state = states(binder, fields, None);
    is_complete?;
    let bound = (binder.signal(&intersection?), binder.signal(&group?));
    if entries.is_empty() {
        fields.refuse("groups", "no group is given", "add { intersection = 1, group = 1, id = … }");
    }
    let (state, (intersection, intersections), (group, numbers)) = (state?, bound.0?, bound.1?);
    let mut in_frame = vec![
        (state.signal, fields.at("signal")),
        (group, fields.at("group")),
        (intersection, fields.at("intersection")),
    ];
    let confidence_at = fields.section("confidence").at("signal");
    in_frame.extend(confidence.map(|bound| (bound.role.signal, confidence_at)));
    in_every_frame(binder, binder.signals[state.signal.0].message, &in_frame);
    let mut groups: Vec<(GroupKey, BoundGroup)> = Vec::new();
    for entry in entries {
        entry.require(&["intersection", "group", "id"], "");
        let number = |key, (lowest, highest): (i128, i128), name: &str| {
            let raw = entry.whole::<i128>(key)?;
            if raw < lowest || raw > highest {
                let reason = format!("{name} cannot hold {raw}");
                entry.refuse(key, reason, &format!("its raw values are {lowest} to {highest}"));
            }
            Some(raw)
        };
        let key = (
            number("intersection", intersections.codec.range(), &intersections.name),
            number("group", numbers.codec.range(), &numbers.name),
        );
        let (id, arrow) = (id(&entry, ids), entry.string("arrow"));
        let location = entry.location();
        entry.done();
        let (Some(key), Some(id)) = (key.0.zip(key.1), id) else { continue };
        if groups.iter().any(|(known, _)| *known == key) {
            let reason = format!("group {} of intersection {} is mapped twice", key.1, key.0);
            binder.refuse(location, reason, "map each group to one id");
        }
        let state = match arrow {
            None => Some(state.clone()),
            Some(arrow) => states(binder, fields, Some(&arrow)),
        };
        let Some(state) = state else { continue };
        groups.push((key, BoundGroup { id, state, confidence: confidence.cloned() }));
    }
    groups.sort_by_key(|(key, _)| *key);
    Some(CyclingMessage { intersection, group, groups, timeout })
}

/// Refuses signals, other than the state, that are not in every frame of the message.
fn in_every_frame(binder: &Binder<'_>, message: MessageIndex, signals: &[(SignalIndex, &Location)]) {
    for (signal, at) in signals {
        let bound = &binder.signals[signal.0];
        if bound.message != message {
            let reason = "the state is in another message, so they may differ in age";
            binder.refuse(at, reason, "bind signals of one message");
        } else if bound.codec.is_multiplexed() {
            let reason = format!("{} is not in every frame of its message", bound.name);
            binder.refuse(at, reason, "bind a signal that is, or give it an `id` of its own");
        }
    }
}
