//! The selection of elements from two reports of one group
//! (docs/spec/traffic-lights.md, "Priority mode" and "Matching mode").

use std::sync::Arc;

use super::settings::{ArbiterSettings, Priority};
use crate::bulb::{Bulb, BulbShape, BulbStatus, Color};
use crate::emission::{GroupElement, GroupState, Prediction};

#[derive(Debug, Clone, Copy)]
pub(super) struct GroupSides<'a> {
    /// The camera's reports; a message may contain the group more than once.
    pub(super) perception: &'a [Arc<GroupState>],
    pub(super) external: Option<&'a GroupState>,
}

impl GroupSides<'_> {
    pub(super) fn is_empty(&self) -> bool {
        self.perception.is_empty() && self.external.is_none()
    }

    /// Returns the predictions of perception, followed by those of external, unchanged.
    pub(super) fn predictions(&self) -> Vec<Prediction> {
        let groups = self.perception.iter().map(Arc::as_ref).chain(self.external);
        groups.flat_map(|group| &group.predictions).cloned().collect()
    }
}

/// Returns the selected elements, ascending by the number of their shape, one for each shape.
pub(super) fn select(
    sides: &GroupSides<'_>,
    is_pedestrian: bool,
    settings: &ArbiterSettings,
) -> Vec<GroupElement> {
    let external = sides.external.map(|group| group.elements.as_slice());
    if !settings.matching {
        let perception = sides.perception.iter().flat_map(|group| &group.elements);
        return pooled(perception, external.unwrap_or_default(), settings.priority);
    }
    let perception = sides.perception.last().map(|group| group.elements.as_slice());
    match (perception, external, settings.priority) {
        _ if !is_pedestrian => matched(perception, external),
        (Some(perception), Some(external), Priority::Confidence) => {
            pooled(perception, external, Priority::Confidence)
        }
        (Some(only), None, _) | (None, Some(only), _) => one_for_each_shape(only),
        (Some(_), Some(external), Priority::External) => one_for_each_shape(external),
        (Some(perception), Some(_), Priority::Perception) => one_for_each_shape(perception),
        (None, None, _) => Vec::new(),
    }
}

/// Returns the elements of both sides; for each shape the preferred side wins, then the more confident
/// element, then the first.
fn pooled<'a>(
    perception: impl IntoIterator<Item = &'a GroupElement>,
    external: &'a [GroupElement],
    priority: Priority,
) -> Vec<GroupElement> {
    let perception = perception.into_iter().map(|element| (priority == Priority::Perception, *element));
    let external = external.iter().map(|element| (priority == Priority::External, *element));
    let mut best: Vec<(bool, GroupElement)> = Vec::new();
    for (preferred, element) in perception.chain(external) {
        match best.iter_mut().find(|(_, kept)| kept.bulb.shape == element.bulb.shape) {
            Some(kept) if (preferred, element.confidence) > (kept.0, kept.1.confidence) => {
                *kept = (preferred, element);
            }
            Some(_) => {}
            None => best.push((preferred, element)),
        }
    }
    let mut elements: Vec<_> = best.into_iter().map(|(_, element)| element).collect();
    sort_by_shape(&mut elements);
    elements
}

fn one_for_each_shape(elements: &[GroupElement]) -> Vec<GroupElement> {
    pooled(elements, &[], Priority::Confidence)
}

/// For vehicles: returns the elements that both sides report; if they differ, or one side is missing, unknown
/// elements with the same shapes.
fn matched(perception: Option<&[GroupElement]>, external: Option<&[GroupElement]>) -> Vec<GroupElement> {
    match (perception, external) {
        (Some(perception), Some(external)) if agree(perception, external) => one_for_each_shape(perception),
        _ => {
            let all = perception.into_iter().chain(external).flatten();
            let unknown: Vec<_> = all.map(|element| unknown(element.bulb.shape)).collect();
            one_for_each_shape(&unknown)
        }
    }
}

/// Returns whether both have the same shapes in the same colours; status and confidence are ignored.
fn agree(perception: &[GroupElement], external: &[GroupElement]) -> bool {
    let sorted = |elements: &[GroupElement]| {
        let mut elements = elements.to_vec();
        sort_by_shape(&mut elements);
        elements.into_iter().map(|element| (element.bulb.shape, element.bulb.color)).collect::<Vec<_>>()
    };
    sorted(perception) == sorted(external)
}

fn unknown(shape: BulbShape) -> GroupElement {
    let bulb = Bulb { color: Color::Unknown, status: BulbStatus::Unknown, shape };
    GroupElement { bulb, confidence: 1.0 }
}

fn sort_by_shape(elements: &mut [GroupElement]) {
    elements.sort_by_key(|element| ros_number(element.bulb.shape));
}

/// Returns the constant of `TrafficLightElement`, by which the arbiter sorts shapes.
const fn ros_number(shape: BulbShape) -> u8 {
    match shape {
        BulbShape::Unknown => 0,
        BulbShape::Circle => 1,
        BulbShape::Left => 2,
        BulbShape::Right => 3,
        BulbShape::Up => 4,
        BulbShape::UpperLeft => 5,
        BulbShape::UpperRight => 6,
        BulbShape::Down => 7,
        BulbShape::LowerLeft => 8,
        BulbShape::LowerRight => 9,
        BulbShape::Cross => 10,
    }
}
