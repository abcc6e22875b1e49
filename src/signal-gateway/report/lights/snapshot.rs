//! The state of a scenario at a time.

use std::collections::BTreeMap;

use gateway_base::time::{MonoTime, WallStamp};
use traffic_lights::emission::Groups;
use traffic_lights::engine::LightObservation;
use traffic_lights::event_log::LoggedEvent;
use traffic_lights::scenario::Scenario;
use traffic_lights::target::StoreId;

/// One time at which something was due.
#[derive(Debug, Clone, Copy)]
pub struct Snapshot<'a> {
    /// Time since the start of the scenario, which is time zero.
    pub at: MonoTime,
    pub is_frame: bool,
    /// True if there are events or changes.
    pub has_changed: bool,
    /// The events since the previous snapshot, oldest first.
    pub events: &'a [LoggedEvent],
    /// The states afterwards.
    pub states: &'a States,
    /// The scenario, which has the names for positions.
    pub scenario: &'a Scenario,
}

/// The states of all lights, groups and controllers.
#[derive(Debug, Clone, Default)]
pub struct States {
    /// Lights of each store that were set or detected, by id.
    pub stores: BTreeMap<StoreId, BTreeMap<i64, LightObservation>>,
    /// The groups of the last camera message; `None` before the first.
    pub internal: Option<Groups>,
    /// The groups of the last V2I message, with predictions; `None` before the first.
    pub external: Option<Groups>,
    /// Position of the phase of each controller; `None` before the first.
    pub phases: Vec<Option<usize>>,
}

impl States {
    /// Returns the number of states of lights and groups.
    pub fn count(&self) -> usize {
        let groups = [&self.internal, &self.external].into_iter().flatten().map(|groups| groups.len());
        self.stores.values().map(BTreeMap::len).chain(groups).sum()
    }

    /// Returns the lights of a store, ascending by id.
    pub(super) fn store(&self, store: StoreId) -> impl Iterator<Item = (i64, &LightObservation)> {
        self.stores.get(&store).into_iter().flatten().map(|(id, light)| (*id, light))
    }
}

/// Returns the time of a stamp, which also counts from the start of the scenario.
pub(super) fn time_of(stamp: WallStamp) -> MonoTime {
    u64::try_from(stamp.as_nanos()).map_or(MonoTime::ZERO, MonoTime::from_nanos)
}
