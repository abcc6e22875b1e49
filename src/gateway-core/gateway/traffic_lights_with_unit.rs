//! Traffic lights together with the V2X unit on CAN, whose states are written to their stores.

use super::headlines::Headlines;
use crate::v2i_reception::V2iReception;
use crate::v2i_reception::binding::V2iBinding;
use can_signal::can::Bus;
use gateway_base::diagnostics::Status;
use gateway_base::time::{MonoTime, Now};
use traffic_lights::flow::{LightsFlowSettings, TrafficLightFlow};
use traffic_lights::input::TrafficLightInput;

/// The traffic-light flow, and the reception of the V2X unit. Each update of the flow starts with the states
/// of the unit.
#[derive(Debug, Clone)]
pub(super) struct TrafficLightsWithUnit {
    pub(super) flow: TrafficLightFlow,
    pub(super) reception: V2iReception,
    headlines: Headlines,
}

impl TrafficLightsWithUnit {
    pub(super) fn new(settings: LightsFlowSettings, binding: V2iBinding, now: Now) -> Self {
        Self {
            flow: TrafficLightFlow::new(settings, now),
            reception: V2iReception::new(binding),
            headlines: Headlines::default(),
        }
    }

    /// Continues with other settings and another binding. Call [`Self::settle`] afterwards.
    pub(super) fn reconfigure(&mut self, settings: LightsFlowSettings, binding: V2iBinding, now: Now) {
        let ended = self.reception.reconfigure(binding);
        if self.flow.reconfigure(settings, now) {
            self.give_all_states(now);
        } else {
            self.flow.set_unit_states(ended.into_iter().map(|id| (id, None)), now);
        }
    }

    /// Handles an input of the flow. Call [`Self::settle`] afterwards.
    pub(super) fn handle_input(&mut self, input: TrafficLightInput, now: Now) {
        if self.flow.handle_input(input, now) {
            self.give_all_states(now);
        }
    }

    fn give_all_states(&mut self, now: Now) {
        let states = self.reception.valid_states().map(|(id, state)| (id, Some(state.into())));
        self.flow.set_unit_states(states, now);
    }

    /// Updates the reception to `now`, then the flow with the changed states. Returns the changed statuses.
    pub(super) fn settle(&mut self, buses: &[Bus], now: Now) -> Vec<Status> {
        let settled = self.reception.settle(buses, now);
        if !settled.changes.is_empty() {
            let changes = settled.changes.into_iter().map(|(id, state)| (id, state.map(Into::into)));
            self.flow.set_unit_states(changes, now);
        }
        let has_news = self.flow.settle(now) | settled.news;
        if has_news { self.headlines.changed(self.statuses(buses, now.mono)) } else { Vec::new() }
    }

    /// Returns when something must be settled without an input.
    pub(super) fn next_deadline(&self, now: MonoTime) -> MonoTime {
        self.reception.next_deadline(now).into_iter().fold(self.flow.next_deadline(now), MonoTime::min)
    }

    /// Returns the statuses of the flow, and one for the V2X unit if there is one.
    pub(super) fn statuses(&self, buses: &[Bus], now: MonoTime) -> Vec<Status> {
        let unit = (!self.reception.binding().is_empty()).then(|| self.reception.status(buses, now));
        self.flow.statuses(now).into_iter().chain(unit).collect()
    }
}
