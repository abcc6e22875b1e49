//! A reference model of the arbiter that does not keep its last result: it merges all groups again at each
//! input.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use super::selection::{GroupSides, select};
use super::settings::{ArbiterSettings, ArbiterStamp};
use crate::emission::{GroupState, Groups};
use lanelet2_map::light_map::LightMap;

pub(super) struct ArbiterModel {
    settings: ArbiterSettings,
    map: BTreeMap<i64, bool>,
    perception: Option<(ArbiterStamp, Vec<Arc<GroupState>>)>,
    external: BTreeMap<i64, (ArbiterStamp, Arc<GroupState>)>,
}

impl ArbiterModel {
    pub(super) fn new(settings: ArbiterSettings, map: &LightMap) -> Self {
        let map = map.groups().map(|(id, group)| (id, group.is_pedestrian)).collect();
        Self { settings, map, perception: None, external: BTreeMap::new() }
    }

    pub(super) fn perception(&mut self, stamp: ArbiterStamp, groups: &[Arc<GroupState>]) -> Groups {
        self.perception = Some((stamp, groups.to_vec()));
        self.forget_external(stamp, self.settings.external_time_tolerance);
        self.merge()
    }

    pub(super) fn external(
        &mut self,
        stamp: ArbiterStamp,
        groups: &[Arc<GroupState>],
        clock: ArbiterStamp,
    ) -> Option<Groups> {
        let tolerance = self.settings.external_delay_tolerance;
        if clock.distance(stamp) > tolerance {
            return None;
        }
        self.external.extend(groups.iter().map(|group| (group.relation_id, (stamp, Arc::clone(group)))));
        self.forget_external(clock, tolerance);
        Some(self.merge())
    }

    fn forget_external(&mut self, reference: ArbiterStamp, tolerance: Duration) {
        self.external.retain(|_, (stamp, _)| reference.distance(*stamp) <= tolerance);
    }

    fn timely_perception(&self) -> &[Arc<GroupState>] {
        let Some((stamp, groups)) = &self.perception else { return &[] };
        let lags = |newest: ArbiterStamp| {
            newest > *stamp && newest.distance(*stamp) > self.settings.perception_time_tolerance
        };
        if self.external.values().map(|(stamp, _)| *stamp).max().is_some_and(lags) { &[] } else { groups }
    }

    fn merge(&self) -> Groups {
        let mut reports: BTreeMap<i64, Vec<Arc<GroupState>>> = BTreeMap::new();
        for group in self.timely_perception() {
            reports.entry(group.relation_id).or_default().push(Arc::clone(group));
        }
        for id in self.external.keys() {
            reports.entry(*id).or_default();
        }
        let merged = reports.into_iter().filter_map(|(relation_id, perception)| {
            let external = self.external.get(&relation_id).map(|(_, group)| &**group);
            let sides = GroupSides { perception: &perception, external };
            Some(Arc::new(GroupState {
                relation_id,
                elements: select(&sides, *self.map.get(&relation_id)?, &self.settings),
                predictions: sides.predictions(),
            }))
        });
        Arc::new(merged.collect())
    }
}
