//! From stores to what is sent: truth, detections over truth, groups, markers (traffic-lights
//! sections 5.1, 5.2 and 5.7).

use std::collections::BTreeMap;

use super::bulb::{Bulb, BulbSet, Color, Shape, Status};
use super::compat::Compat;
use super::emission::{Element, GroupState, LampMarker, LightState, Prediction};
use super::prediction::{Predicted, Predictions, add};
use super::store::{Light, Stores};
use super::target::Channel;
use crate::core::map::light_map::{Head, HeadIndex, LampColor};

/// `PredictedTrafficLightState::INFORMATION_SOURCE_SIMULATION`
const SOURCE: &str = "SIMULATION";

/// How one head is reported.
#[derive(Debug, Clone, Copy)]
struct Report<'a> {
    head: HeadIndex,
    relation_ids: &'a [i64],
    bulbs: BulbSet,
    confidence: f64,
}

/// Ground truth of a channel, of the heads that were ever touched.
pub(super) fn lights(stores: &Stores, channel: Channel) -> Vec<LightState> {
    let heads = stores.map().heads().iter().zip(stores.truth(channel).lights());
    let state = |(head, light): (&Head, &Light)| {
        let (way_id, confidence) = (sent_id(head.way_id, stores.compat()), light.confidence);
        light.bulbs.map(|bulbs| LightState { way_id, bulbs, confidence })
    };
    heads.filter_map(state).collect()
}

/// What the pipeline of a channel reports; dark heads are left out.
pub(super) fn groups(
    stores: &Stores,
    channel: Channel,
    predictions: Option<&Predictions>,
    one_group_per_head: bool,
) -> Vec<GroupState> {
    let predictions = |head| predictions.map_or(&[][..], |predictions| predictions.of(head));
    let reports = match stores.compat() {
        Compat::Improved => reports(stores, channel),
        Compat::Upstream => upstream_reports(stores, channel),
    };
    let lit = reports.into_iter().filter(|report| !report.bulbs.is_empty());
    if stores.compat() == Compat::Improved && !one_group_per_head {
        return merged_groups(stores, lit, predictions);
    }
    let mut groups = Vec::new();
    for Report { head, relation_ids, bulbs, confidence } in lit {
        for relation_id in relation_ids {
            groups.push(GroupState {
                relation_id: sent_id(*relation_id, stores.compat()),
                elements: bulbs.iter().map(|bulb| Element { bulb, confidence }).collect(),
                predictions: predictions(head).iter().map(prediction).collect(),
            });
        }
    }
    if stores.compat() == Compat::Upstream {
        forget_upper_diagonals(&mut groups);
    }
    groups
}

/// Upstream has no number for them, so they are sent as unknown shapes (Q7).
fn forget_upper_diagonals(groups: &mut [GroupState]) {
    for GroupState { elements, predictions, .. } in groups {
        let announced = predictions.iter_mut().flat_map(|prediction| &mut prediction.elements);
        for Element { bulb, .. } in elements.iter_mut().chain(announced) {
            if matches!(bulb.shape, Shape::UpperLeft | Shape::UpperRight) {
                bulb.shape = Shape::Unknown;
            }
        }
    }
}

/// A marker for each lamp with a place, of the heads that were ever touched: as they truly are, on
/// the first of the channels that knows.
pub(super) fn markers(stores: &Stores, channels: &[Channel]) -> Vec<LampMarker> {
    let mut markers = Vec::new();
    for (index, head) in (0..).map(HeadIndex).zip(stores.map().heads()) {
        let bulbs = |channel: &Channel| stores.truth(*channel).light(index)?.bulbs;
        let Some(bulbs) = channels.iter().find_map(bulbs) else { continue };
        markers.extend(head.lamps.iter().map(|lamp| LampMarker {
            way_id: sent_id(head.way_id, stores.compat()),
            lamp: *lamp,
            is_on: shows_circle(&bulbs, lamp.color),
        }));
    }
    markers
}

/// One group for each relation: the bulbs of all its heads, each as sure as the surest head.
fn merged_groups<'a>(
    stores: &Stores,
    lit: impl Iterator<Item = Report<'a>>,
    predictions: impl Fn(HeadIndex) -> &'a [Predicted],
) -> Vec<GroupState> {
    let mut by_head: Vec<Option<Report<'_>>> = vec![None; stores.map().heads().len()];
    for report in lit {
        if let Some(place) = by_head.get_mut(report.head.0 as usize) {
            *place = Some(report);
        }
    }
    let mut groups = Vec::new();
    for (relation_id, group) in stores.map().groups() {
        let heads = group.heads.iter().filter_map(|head| by_head.get(head.0 as usize)?.as_ref());
        let bulbs = heads.clone().fold(BulbSet::EMPTY, |all, report| all.union(report.bulbs));
        if bulbs.is_empty() {
            continue;
        }
        let confidence = |bulb| {
            let of_bulb = heads.clone().filter(|report| report.bulbs.contains(bulb));
            of_bulb.map(|report| report.confidence).fold(0.0, f64::max)
        };
        let elements = bulbs.iter().map(|bulb| Element { bulb, confidence: confidence(bulb) }).collect();
        let mut announced =
            heads.clone().map(|report| predictions(report.head)).filter(|list| !list.is_empty());
        let first = announced.next().unwrap_or_default();
        let predictions = match announced.next() {
            None => first.iter().map(prediction).collect(),
            Some(second) => union([first, second].into_iter().chain(announced)),
        };
        groups.push(GroupState { relation_id, elements, predictions });
    }
    groups
}

/// The predictions of several heads as those of one: ascending, each bulb once at a time.
fn union<'a>(lists: impl Iterator<Item = &'a [Predicted]>) -> Vec<Prediction> {
    let mut all = Vec::new();
    for predicted in lists.flatten() {
        add(&mut all, predicted.at, predicted.bulbs.iter().copied());
    }
    all.sort_by_key(|predicted| predicted.at.as_nanos());
    for predicted in &mut all {
        predicted.bulbs = predicted.bulbs.drain(..).collect::<BulbSet>().iter().collect();
    }
    all.iter().map(prediction).collect()
}

fn prediction(predicted: &Predicted) -> Prediction {
    let elements = predicted.bulbs.iter().map(|bulb| Element { bulb: *bulb, confidence: 1.0 });
    Prediction { at: predicted.at, elements: elements.collect(), reliability: 1.0, source: SOURCE }
}

/// Head by head, what is detected, else what is so.
fn reports(stores: &Stores, channel: Channel) -> Vec<Report<'_>> {
    let mut detected = stores.detected(channel).entries().peekable();
    let mut reports = Vec::new();
    let heads = stores.map().heads().iter().zip(stores.truth(channel).lights());
    for (index, (head, truth)) in (0..).map(HeadIndex).zip(heads) {
        let seen = detected.next_if(|(key, _)| *key == head.way_id).map(|(_, entry)| entry.light);
        let light = seen.filter(|light| light.bulbs.is_some()).unwrap_or(*truth);
        if let Some(bulbs) = light.bulbs {
            let confidence = light.confidence;
            reports.push(Report { head: index, relation_ids: &head.relation_ids, bulbs, confidence });
        }
    }
    reports
}

/// Upstream: all truth, then each detection in the place of the entry whose way id is its key, else
/// at the end. Keys are compared with ids cut to 32 bits (Q3, Q6).
fn upstream_reports(stores: &Stores, channel: Channel) -> Vec<Report<'_>> {
    let mut reports = Vec::new();
    let mut places = BTreeMap::new();
    let heads = stores.map().heads();
    for (index, (head, light)) in (0..).map(HeadIndex).zip(heads.iter().zip(stores.truth(channel).lights())) {
        if let Some(bulbs) = light.bulbs {
            places.entry(sent_id(head.way_id, Compat::Upstream)).or_insert(reports.len());
            let confidence = light.confidence;
            reports.push(Report { head: index, relation_ids: &head.relation_ids, bulbs, confidence });
        }
    }
    for (key, entry) in stores.detected(channel).entries() {
        let (bulbs, confidence) = (entry.light.bulbs.unwrap_or_default(), entry.light.confidence);
        if let Some(report) = places.get(&key).and_then(|place: &usize| reports.get_mut(*place)) {
            (report.bulbs, report.confidence) = (bulbs, confidence);
        } else if let Some(head) = heads.get(entry.head.0 as usize) {
            places.entry(sent_id(head.way_id, Compat::Upstream)).or_insert(reports.len());
            reports.push(Report { head: entry.head, relation_ids: &head.relation_ids, bulbs, confidence });
        }
    }
    reports
}

/// Upstream's ids travel in 32 bits and are cut (Q6).
#[allow(clippy::cast_possible_truncation)] // that is what is reproduced
fn sent_id(id: i64, compat: Compat) -> i64 {
    match compat {
        Compat::Improved => id,
        Compat::Upstream => i64::from(id as i32),
    }
}

/// Whatever its status: `solidOff` is drawn as on.
fn shows_circle(bulbs: &BulbSet, color: LampColor) -> bool {
    let color = match color {
        LampColor::Green => Color::Green,
        LampColor::Yellow => Color::Yellow,
        LampColor::Red => Color::Red,
    };
    Status::ALL.into_iter().any(|status| bulbs.contains(Bulb { color, status, shape: Shape::Circle }))
}

#[cfg(test)]
mod tests;
