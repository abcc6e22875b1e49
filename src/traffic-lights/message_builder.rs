//! Builds lists of lights from the stores: truth, detections over truth, received states of groups, groups,
//! markers (docs/spec/traffic-lights.md, "Message building", "Received states" and "Markers").

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::bulb::{Bulb, BulbSet, BulbShape, BulbStatus, Color};
use super::emission::{GroupElement, GroupState, LampMarker, LightState, Prediction};
use super::prediction::{Predicted, Predictions, add};
use super::quirks::LightQuirks;
use super::received::ReceivedState;
use super::store::{Light, Stores};
use super::target::{LightChannel, StoreLayer};
use lanelet2_map::light_map::{Head, HeadIndex, LampColor, LightGroup};

/// `INFORMATION_SOURCE_SIMULATION` of `autoware_perception_msgs/msg/PredictedTrafficLightState`.
const SOURCE: &str = "SIMULATION";

#[derive(Debug, Clone, Copy)]
struct HeadReport<'a> {
    head: HeadIndex,
    relation_ids: &'a [i64],
    bulbs: BulbSet,
    confidence: f64,
    is_detected: bool,
}

/// The part of the heads' reports used for a group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum HeadReports {
    All,
    Detected,
    None,
}

impl HeadReports {
    fn include(self, report: &HeadReport<'_>) -> bool {
        match self {
            Self::All => true,
            Self::Detected => report.is_detected,
            Self::None => false,
        }
    }
}

/// Returns the ground truth of a channel for these heads, by way id; untouched heads have no item.
pub(super) fn lights(
    stores: &Stores,
    channel: LightChannel,
    heads: &BTreeSet<HeadIndex>,
) -> Vec<(i64, Vec<LightState>)> {
    let light = |(index, head): KnownHead<'_>| {
        let way_id = sent_id(head.way_id, stores.quirks);
        let light = stores.truth(channel).light(index);
        let state = light.and_then(|&Light { bulbs, confidence, .. }| {
            bulbs.map(|bulbs| LightState { way_id, bulbs, confidence })
        });
        (head.way_id, state.into_iter().collect())
    };
    known(stores, heads).map(light).collect()
}

/// Returns the reports of a channel for the groups that refer to any of these heads, by relation id; a dark
/// group has no item.
pub(super) fn groups(
    stores: &Stores,
    channel: LightChannel,
    predictions: Option<&Predictions>,
    heads: &BTreeSet<HeadIndex>,
) -> Vec<(i64, Vec<Arc<GroupState>>)> {
    let ids: BTreeSet<i64> = known(stores, heads).flat_map(|(_, head)| head.relation_ids.to_vec()).collect();
    let group = |id| merged(stores, channel, predictions, id, stores.map.group(id)?);
    ids.into_iter().map(|id| (id, group(id).map(Arc::new).into_iter().collect())).collect()
}

/// Returns the reports of a channel, with one group for each lit head and relation (Q17).
pub(super) fn groups_by_head(
    stores: &Stores,
    channel: LightChannel,
    predictions: Option<&Predictions>,
) -> Vec<Arc<GroupState>> {
    let reports = if stores.quirks.detects_by_written_id {
        upstream_reports(stores, channel)
    } else {
        let heads = (0..).map(HeadIndex).zip(stores.map.heads());
        heads.filter_map(|(index, head)| report(stores, channel, index, head)).collect()
    };
    let mut groups = Vec::new();
    for report in reports.into_iter().filter(|report| !report.bulbs.is_empty()) {
        let HeadReport { head, relation_ids, bulbs, confidence, .. } = report;
        for relation_id in relation_ids {
            let (_, reports) = received(stores, channel, *relation_id);
            if !reports.include(&report) {
                continue;
            }
            let predictions = predictions.filter(|_| reports == HeadReports::All);
            let predictions = predictions.map_or(&[][..], |predictions| predictions.of(head));
            groups.push(GroupState {
                relation_id: sent_id(*relation_id, stores.quirks),
                elements: bulbs.iter().map(|bulb| GroupElement { bulb, confidence }).collect(),
                predictions: predictions.iter().map(prediction).collect(),
            });
        }
    }
    for layer in [StoreLayer::GroundTruth, StoreLayer::Detected] {
        for (relation_id, state) in stores.received.states(layer).filter(|_| channel == LightChannel::V2i) {
            // Both layers may have equal states.
            let sent = received(stores, channel, relation_id).0;
            if sent.is_some_and(|sent| std::ptr::eq(sent, state)) {
                let relation_id = sent_id(relation_id, stores.quirks);
                groups.push(GroupState { relation_id, ..of_received(state) });
            }
        }
    }
    if stores.quirks.loses_upper_diagonals {
        forget_upper_diagonals(&mut groups);
    }
    groups.into_iter().map(Arc::new).collect()
}

/// Replaces upper diagonal arrows by unknown shapes, since upstream has no number for them (Q7).
fn forget_upper_diagonals(groups: &mut [GroupState]) {
    for GroupState { elements, predictions, .. } in groups {
        let predicted = predictions.iter_mut().flat_map(|prediction| &mut prediction.elements);
        for GroupElement { bulb, .. } in elements.iter_mut().chain(predicted) {
            if matches!(bulb.shape, BulbShape::UpperLeft | BulbShape::UpperRight) {
                bulb.shape = BulbShape::Unknown;
            }
        }
    }
}

/// Returns a marker for each lamp of these heads, by way id; untouched heads have no item. The lamps show the
/// ground truth of the first channel in which the head was ever touched.
pub(super) fn markers(
    stores: &Stores,
    channels: &[LightChannel],
    heads: &BTreeSet<HeadIndex>,
) -> Vec<(i64, Vec<LampMarker>)> {
    let lamps = |(index, head): KnownHead<'_>| {
        let bulbs = channels.iter().find_map(|channel| stores.shown(*channel, index));
        let way_id = sent_id(head.way_id, stores.quirks);
        let marker = |bulbs: BulbSet| {
            head.lamps.iter().map(move |lamp| LampMarker {
                way_id,
                lamp: *lamp,
                is_on: shows_circle(&bulbs, lamp.color),
            })
        };
        (head.way_id, bulbs.into_iter().flat_map(marker).collect())
    };
    known(stores, heads).map(lamps).collect()
}

type KnownHead<'a> = (HeadIndex, &'a Head);

fn known<'a>(stores: &'a Stores, heads: &'a BTreeSet<HeadIndex>) -> impl Iterator<Item = KnownHead<'a>> {
    heads.iter().filter_map(|index| Some((*index, stores.map.at(*index)?)))
}

/// Returns the received state of a group, if it is sent, and the reports of its heads that are sent with it.
fn received(
    stores: &Stores,
    channel: LightChannel,
    relation_id: i64,
) -> (Option<&ReceivedState>, HeadReports) {
    let state = |layer| {
        let state = stores.received.state(layer, relation_id);
        state.filter(|_| channel == LightChannel::V2i)
    };
    if let Some(detected) = state(StoreLayer::Detected) {
        return (Some(detected), HeadReports::None);
    }
    let Some(truth) = state(StoreLayer::GroundTruth) else { return (None, HeadReports::All) };
    let mut heads = stores.map.group(relation_id).into_iter().flat_map(|group| &group.heads);
    // It replaces the truth of each head, and a detection hides truth.
    let is_shown = heads.any(|index| {
        let head = stores.map.at(*index);
        head.is_none_or(|head| stores.detected(channel).light(head.way_id).bulbs.is_none())
    });
    (is_shown.then_some(truth), HeadReports::Detected)
}

/// Returns a group that contains only a received state, without an id.
fn of_received(state: &ReceivedState) -> GroupState {
    let element = |bulb| GroupElement { bulb, confidence: state.confidence };
    let elements = state.bulbs.iter().map(element).collect();
    GroupState { relation_id: 0, elements, predictions: state.predictions.clone() }
}

/// Returns the group of a relation: its received state, and the bulbs of all its heads that are sent with it,
/// each bulb with its highest confidence. `None` if the group is dark.
fn merged(
    stores: &Stores,
    channel: LightChannel,
    predictions: Option<&Predictions>,
    relation_id: i64,
    group: &LightGroup,
) -> Option<GroupState> {
    let (received, of_heads) = received(stores, channel, relation_id);
    let reports = group.heads.iter().filter_map(|index| {
        let report = report(stores, channel, *index, stores.map.at(*index)?)?;
        (!report.bulbs.is_empty() && of_heads.include(&report)).then_some(report)
    });
    let reports: Vec<_> = reports.collect();
    if let Some(state) = received.filter(|_| reports.is_empty()) {
        return Some(GroupState { relation_id, ..of_received(state) });
    }
    let shown = reports.iter().map(|report| (report.bulbs, report.confidence));
    let shown = || shown.clone().chain(received.map(|state| (state.bulbs, state.confidence)));
    let bulbs = shown().fold(BulbSet::EMPTY, |all, (bulbs, _)| all.union(bulbs));
    if bulbs.is_empty() {
        return None;
    }
    let confidence = |bulb| {
        let of_bulb = shown().filter(|(bulbs, _)| bulbs.contains(bulb));
        of_bulb.map(|(_, confidence)| confidence).fold(0.0, f64::max)
    };
    let elements = bulbs.iter().map(|bulb| GroupElement { bulb, confidence: confidence(bulb) }).collect();
    if of_heads != HeadReports::All {
        let predictions = received.map(|state| state.predictions.clone()).unwrap_or_default();
        return Some(GroupState { relation_id, elements, predictions });
    }
    let of_head = |report: &HeadReport<'_>| predictions.map_or(&[][..], |known| known.of(report.head));
    let mut predicted = reports.iter().map(of_head).filter(|list| !list.is_empty());
    let first = predicted.next().unwrap_or_default();
    let predictions = match predicted.next() {
        None => first.iter().map(prediction).collect(),
        Some(second) => union([first, second].into_iter().chain(predicted)),
    };
    Some(GroupState { relation_id, elements, predictions })
}

/// Returns the union of the predictions of several heads: ascending by time, each bulb once per time.
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
    let elements = predicted.bulbs.iter().map(|bulb| GroupElement { bulb: *bulb, confidence: 1.0 });
    Prediction {
        at: predicted.at,
        elements: elements.collect(),
        reliability: 1.0,
        source: Cow::Borrowed(SOURCE),
    }
}

/// Returns the detected state of a head, otherwise its ground truth.
fn report<'a>(
    stores: &Stores,
    channel: LightChannel,
    index: HeadIndex,
    head: &'a Head,
) -> Option<HeadReport<'a>> {
    let detected = stores.detected(channel).light(head.way_id);
    let is_detected = detected.bulbs.is_some();
    let light = if is_detected { &detected } else { stores.truth(channel).light(index)? };
    let (relation_ids, confidence) = (&*head.relation_ids, light.confidence);
    light.bulbs.map(|bulbs| HeadReport { head: index, relation_ids, bulbs, confidence, is_detected })
}

/// Returns the reports of upstream: all truth, then each detection in place of the entry with its key as way
/// id, otherwise at the end. Keys are compared with ids truncated to 32 bits (Q3, Q6).
fn upstream_reports(stores: &Stores, channel: LightChannel) -> Vec<HeadReport<'_>> {
    let mut reports = Vec::new();
    let mut indices = BTreeMap::new();
    let heads = stores.map.heads();
    for (index, (head, light)) in (0..).map(HeadIndex).zip(heads.iter().zip(stores.truth(channel).lights())) {
        if let Some(bulbs) = light.bulbs {
            indices.entry(sent_id(head.way_id, stores.quirks)).or_insert(reports.len());
            let (relation_ids, confidence) = (&*head.relation_ids, light.confidence);
            reports.push(HeadReport { head: index, relation_ids, bulbs, confidence, is_detected: false });
        }
    }
    for (key, entry) in stores.detected(channel).entries() {
        let (bulbs, confidence) = (entry.light.bulbs.unwrap_or_default(), entry.light.confidence);
        if let Some(report) = indices.get(&key).and_then(|index: &usize| reports.get_mut(*index)) {
            (report.bulbs, report.confidence, report.is_detected) = (bulbs, confidence, true);
        } else if let Some(head) = stores.map.at(entry.head) {
            indices.entry(sent_id(head.way_id, stores.quirks)).or_insert(reports.len());
            reports.push(HeadReport {
                head: entry.head,
                relation_ids: &head.relation_ids,
                bulbs,
                confidence,
                is_detected: true,
            });
        }
    }
    reports
}

/// Returns the id as sent: upstream truncates it to 32 bits (Q6).
#[allow(clippy::cast_possible_truncation)] // that is what is reproduced
fn sent_id(id: i64, quirks: LightQuirks) -> i64 {
    if quirks.cuts_ids { i64::from(id as i32) } else { id }
}

/// Returns whether a circle of this colour is among the bulbs, whatever its status: `solidOff` is drawn as
/// on.
fn shows_circle(bulbs: &BulbSet, color: LampColor) -> bool {
    let color = match color {
        LampColor::Green => Color::Green,
        LampColor::Yellow => Color::Yellow,
        LampColor::Red => Color::Red,
    };
    BulbStatus::ALL.into_iter().any(|status| bulbs.contains(Bulb { color, status, shape: BulbShape::Circle }))
}

#[cfg(test)]
mod tests;
