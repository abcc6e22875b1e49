//! External states: written to the stores or kept for their group, counted, and removed if they are not
//! renewed (docs/spec/traffic-lights.md, "Inputs from outside" and "Received states").

use super::engine::TrafficLights;
use super::expiry::Key;
use super::received::ReceivedState;
use super::store::{LightChange, heads_of};
use super::target::{LightChannel, SignalTarget, StoreId};
use gateway_base::time::Now;

impl TrafficLights {
    /// Writes received states, after everything that is due by now: by way or relation id, `None` to remove
    /// one. If `expires`, V2I states expire after the timeout; others are valid until their sender removes
    /// them. Returns the number of rejected states and predictions: with ids that are not on the map, or with
    /// invalid numbers (docs/spec/traffic-lights.md, "Received states").
    pub fn set_states<S: Into<ReceivedState>>(
        &mut self,
        store: StoreId,
        states: impl IntoIterator<Item = (i64, Option<S>)>,
        expires: bool,
        now: Now,
    ) -> usize {
        self.move_to(now);
        let mut rejected = 0;
        for (id, state) in states {
            let unfit = self.set_state(SignalTarget { id, store }, state.map(Into::into), expires);
            if unfit > 0 {
                rejected += unfit;
                let counts = &mut self.counts[store.channel as usize];
                counts.rejected += u64::try_from(unfit).unwrap_or(u64::MAX);
                counts.last_rejected = Some((Some(id), now.mono));
            }
        }
        rejected
    }

    /// Counts unreadable inputs.
    pub fn count_rejected(&mut self, channel: LightChannel, rejected: u32, now: Now) {
        if rejected > 0 {
            let counts = &mut self.counts[channel as usize];
            counts.rejected += u64::from(rejected);
            counts.last_rejected = Some((None, now.mono));
        }
    }

    /// Writes or removes a received state. Returns the number of rejected items: the state, or some of its
    /// predictions.
    fn set_state(&mut self, target: SignalTarget, state: Option<ReceivedState>, expires: bool) -> usize {
        if state.as_ref().is_some_and(|state| !(0.0..=1.0).contains(&state.confidence)) {
            return 1;
        }
        let is_group = self.stores().map.group(target.id).is_some();
        if is_group && target.store.channel == LightChannel::V2i {
            return self.set_group(target, state, expires);
        }
        let lights = &mut self.scenario_state.lights;
        let (is_known, expires) = match state {
            None => (lights.write(target, LightChange::Remove).is_ok(), false),
            Some(ReceivedState { bulbs, confidence, .. }) => {
                let changes = [LightChange::Set(bulbs), LightChange::Confidence(confidence)];
                (changes.into_iter().all(|change| lights.write(target, change).is_ok()), expires)
            }
        };
        if is_known {
            self.watch(target, expires);
        }
        usize::from(!is_known)
    }

    /// Stores or removes the received state of a group of the map. Returns the number of rejected items.
    fn set_group(&mut self, target: SignalTarget, mut state: Option<ReceivedState>, expires: bool) -> usize {
        let (now, layer) = (self.scenario_state.wall, target.store.layer);
        let rejected = state.as_mut().map_or(0, |state| state.keep_fit_predictions(now));
        let expires = expires && state.is_some();
        if !self.scenario_state.lights.stores.receive(layer, target.id, state) {
            return 1;
        }
        if let Some(timeout) = self.v2i_timeout {
            let at = expires.then(|| self.scenario_state.now.after(timeout).nanos);
            self.expiry.renew(Key::Group(layer, target.id), 0, at);
        }
        rejected
    }

    /// Restarts the expiry of a light, or cancels it. Only V2I states expire.
    fn watch(&mut self, target: SignalTarget, expires: bool) {
        let Some(timeout) = self.v2i_timeout.filter(|_| target.store.channel == LightChannel::V2i) else {
            return;
        };
        let at = expires.then(|| self.scenario_state.now.after(timeout).nanos);
        let stores = &self.scenario_state.lights.stores;
        let heads = heads_of(&stores.map, target.id).into_iter().flatten();
        let way_ids = heads.filter_map(|head| Some(stores.map.at(head)?.way_id));
        let as_written = self.quirks().detects_by_written_id;
        let ids: Vec<_> = if as_written { vec![target.id] } else { way_ids.collect() };
        for id in ids {
            let written = stores.written(SignalTarget { id, ..target });
            self.expiry.renew(Key::Light(target.store.layer, id), written, at);
        }
    }

    /// Removes the state that expires next, unless it was written since.
    pub(super) fn expire(&mut self) {
        let Some((key, written)) = self.expiry.take() else { return };
        let lights = &mut self.scenario_state.lights;
        match key {
            Key::Light(layer, id) => {
                let target = SignalTarget { id, store: StoreId { channel: LightChannel::V2i, layer } };
                if lights.stores.written(target) == written {
                    // The id was known when its expiry was started.
                    let _known = lights.write(target, LightChange::Remove);
                }
            }
            // Every write also restarts the expiry.
            Key::Group(layer, relation_id) => {
                lights.stores.receive(layer, relation_id, None);
            }
        }
    }
}
