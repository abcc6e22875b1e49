//! The arbiter without memory of what it judged: all groups anew with each input.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use super::selection::{Sides, select};
use super::{ArbiterSettings, ArbiterStamp, Judged, NoOutput};
use crate::core::map::light_map::LightMap;
use crate::core::traffic_light::emission::GroupState;

pub(super) struct Model {
    settings: ArbiterSettings,
    map: Option<BTreeMap<i64, bool>>,
    perception: Option<(ArbiterStamp, Vec<Arc<GroupState>>)>,
    external: BTreeMap<i64, (ArbiterStamp, Arc<GroupState>)>,
}

impl Model {
    pub(super) fn new(settings: ArbiterSettings) -> Self {
        Self { settings, map: None, perception: None, external: BTreeMap::new() }
    }

    pub(super) fn map(&mut self, map: &LightMap) {
        self.map = Some(map.groups().map(|(id, group)| (id, group.is_pedestrian)).collect());
    }

    pub(super) fn perception(
        &mut self,
        stamp: ArbiterStamp,
        groups: &[Arc<GroupState>],
    ) -> Result<Judged, NoOutput> {
        self.perception = Some((stamp, groups.to_vec()));
        self.forget_external(stamp, self.settings.external_time_tolerance);
        self.judge(stamp)
    }

    pub(super) fn external(
        &mut self,
        stamp: ArbiterStamp,
        groups: &[Arc<GroupState>],
        clock: ArbiterStamp,
    ) -> Result<Judged, NoOutput> {
        let tolerance = self.settings.external_delay_tolerance;
        if clock.distance(stamp) > tolerance {
            return Err(NoOutput::ExternalDelay);
        }
        self.external.extend(groups.iter().map(|group| (group.relation_id, (stamp, Arc::clone(group)))));
        self.forget_external(clock, tolerance);
        self.judge(stamp)
    }

    fn newest_external(&self) -> Option<ArbiterStamp> {
        self.external.values().map(|(stamp, _)| *stamp).max()
    }

    fn forget_external(&mut self, reference: ArbiterStamp, tolerance: Duration) {
        self.external.retain(|_, (stamp, _)| reference.distance(*stamp) <= tolerance);
    }

    fn timely_perception(&self) -> &[Arc<GroupState>] {
        let Some((stamp, groups)) = &self.perception else { return &[] };
        let lags = |newest: ArbiterStamp| {
            newest > *stamp && newest.distance(*stamp) > self.settings.perception_time_tolerance
        };
        if self.newest_external().is_some_and(lags) { &[] } else { groups }
    }

    fn judge(&self, stamp: ArbiterStamp) -> Result<Judged, NoOutput> {
        let map = self.map.as_ref().ok_or(NoOutput::NoMap)?;
        let stamps = self.perception.iter().map(|(stamp, _)| *stamp).chain(self.newest_external());
        let newer_input = stamps.max().is_some_and(|latest| latest > stamp);
        let (mut groups, mut off_map) = (Vec::new(), Vec::new());
        if !map.is_empty() {
            let mut seen: BTreeMap<i64, Vec<Arc<GroupState>>> = BTreeMap::new();
            for group in self.timely_perception() {
                seen.entry(group.relation_id).or_default().push(Arc::clone(group));
            }
            for id in self.external.keys() {
                seen.entry(*id).or_default();
            }
            for (relation_id, perception) in seen {
                let external = self.external.get(&relation_id).map(|(_, group)| &**group);
                let sides = Sides { perception: &perception, external };
                match map.get(&relation_id) {
                    Some(is_pedestrian) => groups.push(Arc::new(GroupState {
                        relation_id,
                        elements: select(&sides, *is_pedestrian, &self.settings),
                        predictions: sides.predictions(),
                    })),
                    None => off_map.push(relation_id),
                }
            }
        }
        Ok(Judged { stamp, groups: Arc::new(groups), off_map, newer_input })
    }
}
