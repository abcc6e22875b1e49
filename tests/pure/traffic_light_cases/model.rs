//! An independent model of controllers and stores for random scenarios, and properties of all of them.
//!
//! The model has whole seconds only and finds everything by plain loops.

use std::collections::{BTreeMap, BTreeSet};

use proptest::prelude::*;
use proptest::sample::select;
use traffic_lights::bulb::{Bulb, BulbSet};
use traffic_lights::compat::Compat::{self, Improved, Upstream};
use traffic_lights::emission::{LightsContent, LightsTopic};
use traffic_lights::scenario::{Action, Scenario, StateText, TrafficSignalController};
use traffic_lights::target::{SignalTarget, StoreId, StoreLayer};

use super::scene::{Scene, controller, script, settings, small_map};

const IDS: [i64; 5] = [11, 12, 21, 100, 200];
const STATES: [&str; 5] = ["green", "red", "yellow", "red, green right", ""];

const CONVENTIONAL_DETECTED: StoreId = StoreId { layer: StoreLayer::Detected, ..StoreId::CONVENTIONAL };

type Bulbs = BTreeSet<Bulb>;

/// All states by store and id.
#[derive(Default)]
struct Model {
    upstream: bool,
    lights: BTreeMap<(StoreId, i64), Bulbs>,
    enabled: BTreeSet<i64>,
    phases: Vec<Option<(usize, u64)>>,
}

fn heads(id: i64) -> Vec<i64> {
    match id {
        100 => vec![11, 12],
        200 => vec![21],
        head => vec![head],
    }
}

impl Model {
    /// Adds bulbs to each light of a target, or clears it.
    fn write(&mut self, at: SignalTarget, add: Option<&Bulbs>) {
        if at.store.layer == StoreLayer::Detected {
            let keys = if self.upstream { vec![at.id] } else { heads(at.id) };
            for key in keys {
                match add {
                    Some(bulbs) => self.lights.entry((at.store, key)).or_default().extend(bulbs),
                    None => drop(self.lights.remove(&(at.store, key))),
                }
            }
            return;
        }
        for head in heads(at.id) {
            let mut stores = vec![at.store];
            let enabled = if self.upstream { at.id } else { head };
            if at.store == StoreId::CONVENTIONAL && self.enabled.contains(&enabled) {
                stores.push(StoreId::V2I);
            }
            for light in stores.into_iter().map(|store| (store, head)) {
                match add {
                    Some(bulbs) => self.lights.entry(light).or_default().extend(bulbs),
                    None if self.upstream => drop(self.lights.insert(light, Bulbs::new())),
                    None => self.lights.entry(light).or_default().clear(),
                }
            }
        }
    }

    fn enter(&mut self, number: usize, controller: &TrafficSignalController, phase: usize, now: u64) {
        if let Some((left, _)) = self.phases[number] {
            for entry in &controller.phases[left].entries {
                self.clear(entry.target);
            }
        }
        self.phases[number] = Some((phase, now));
        let entries = &controller.phases[phase].entries;
        for entry in entries {
            self.clear(entry.target);
        }
        for entry in entries {
            self.write(entry.target, Some(&entry.state.bulbs.iter().collect()));
        }
        if !self.upstream {
            let own: Vec<_> = entries.iter().filter(|entry| entry.target.store == StoreId::V2I).collect();
            for entry in &own {
                self.clear(entry.target);
            }
            for entry in own {
                self.write(entry.target, Some(&entry.state.bulbs.iter().collect()));
            }
        }
    }

    /// Improved mode does not make a light by clearing it.
    fn clear(&mut self, at: SignalTarget) {
        if self.upstream || at.store.layer == StoreLayer::Detected {
            return self.write(at, None);
        }
        let before: BTreeSet<_> = self.lights.keys().copied().collect();
        self.write(at, None);
        self.lights.retain(|key, _| before.contains(key));
    }

    fn frame(&mut self, controllers: &[TrafficSignalController], now: u64) {
        for (number, controller) in controllers.iter().enumerate() {
            match self.phases[number] {
                None => self.enter(number, controller, 0, now),
                Some((phase, start)) => {
                    let duration = controller.phases[phase].duration;
                    if duration.is_some_and(|duration| start + duration.as_secs() <= now) {
                        self.enter(number, controller, (phase + 1) % controller.phases.len(), now);
                    }
                }
            }
        }
    }

    fn act(&mut self, action: &Action) {
        match action {
            Action::SetState { target, state } => {
                self.clear(*target);
                self.write(*target, Some(&state.bulbs.iter().collect()));
            }
            Action::Clear(target) => self.clear(*target),
            Action::EnableV2i(ids) => self.enabled.extend(ids.iter().flat_map(|id| heads(*id))),
            Action::DisableV2i(ids) => {
                self.enabled.retain(|head| !ids.iter().any(|id| heads(*id).contains(head)));
            }
            Action::EnterPhase { .. }
            | Action::SetV2iState { .. }
            | Action::SetV2iRate(_)
            | Action::SetGroundTruthRate(_)
            | Action::SetConfidence { .. }
            | Action::SetVariable { .. }
            | Action::ModifyVariable { .. }
            | Action::End(_) => unreachable!("is not among the random ones"),
        }
    }

    fn states(&self, store: StoreId) -> Vec<(i64, BulbSet)> {
        let of_store = self.lights.iter().filter(|((of, _), _)| *of == store);
        of_store.map(|((_, id), bulbs)| (*id, bulbs.iter().copied().collect())).collect()
    }
}

fn some_target() -> impl Strategy<Value = SignalTarget> {
    (select(&IDS[..]), select(&StoreId::ALL[..])).prop_map(|(id, store)| SignalTarget { id, store })
}

fn some_controllers() -> impl Strategy<Value = Vec<TrafficSignalController>> {
    let entry = (some_target(), select(&STATES[..])).prop_map(|(target, state)| format!("{target}={state}"));
    let phase = (0..4_u32, proptest::collection::vec(entry, 0..4)).prop_map(|(seconds, entries)| {
        (if seconds == 3 { "inf".to_owned() } else { seconds.to_string() }, entries.join(";"))
    });
    let of_phases = proptest::collection::vec(phase, 1..4).prop_map(|phases| {
        let phases: Vec<_> =
            phases.iter().map(|(seconds, entries)| ("p", seconds.as_str(), entries.as_str())).collect();
        controller("A", &phases)
    });
    proptest::collection::vec(of_phases, 1..4)
}

fn some_action() -> impl Strategy<Value = Action> {
    prop_oneof![
        3 => (some_target(), select(&STATES[..]))
            .prop_map(|(target, state)| Action::SetState { target, state: StateText::new(state) }),
        1 => some_target().prop_map(Action::Clear),
        1 => select(&IDS[..]).prop_map(|id| Action::EnableV2i(vec![id])),
        1 => select(&IDS[..]).prop_map(|id| Action::DisableV2i(vec![id])),
    ]
}

fn some_script() -> impl Strategy<Value = Vec<(u32, Action)>> {
    proptest::collection::vec((0..12_u32, some_action()), 0..12)
}

fn some_compat() -> impl Strategy<Value = Compat> {
    select(vec![Improved, Upstream])
}

proptest! {
    #[test]
    fn the_engine_agrees_with_the_model(
        compat in some_compat(),
        controllers in some_controllers(),
        actions in some_script(),
    ) {
        let scenario =
            Scenario { controllers: controllers.clone(), acts: script(&actions), ..Scenario::default() };
        let mut settings = settings(small_map(), scenario, compat);
        settings.copy_on_enable = false;
        let mut scene = Scene::new(settings);
        let phases = vec![None; controllers.len()];
        let mut model = Model { upstream: compat == Upstream, phases, ..Model::default() };
        for now in 0..15_u32 {
            scene.run_to(u64::from(now));
            model.frame(&controllers, u64::from(now));
            actions.iter().filter(|(at, _)| *at == now).for_each(|(_, action)| model.act(action));
            // A text with two bulbs ends upstream's scenario as soon as it has to be predicted (Q10).
            if compat == Upstream && scene.verdict().is_some() {
                return Ok(());
            }
            for store in StoreId::ALL {
                let states: Vec<_> =
                    scene.lights.states(store).into_iter().map(|(id, light)| (id, light.bulbs)).collect();
                prop_assert_eq!(states, model.states(store), "{} at {}", store, now);
            }
        }
    }

    #[test]
    fn the_last_write_wins(
        compat in some_compat(),
        mut actions in some_script(),
        target in some_target(),
        state in select(&STATES[..]).prop_map(StateText::new),
    ) {
        let expected = state.bulbs;
        actions.push((12, Action::SetState { target, state }));
        let mut scene = Scene::of(compat, Vec::new(), &actions);
        scene.run_to(13);
        prop_assert!(scene.lights.stores().bulbs(target).unwrap().all(|bulbs| bulbs == expected));
    }

    #[test]
    fn a_phase_clears_what_it_names_and_nothing_else(
        compat in some_compat(),
        named in proptest::collection::btree_set(0..3_usize, 0..3),
        by_hand in proptest::collection::btree_set(0..3_usize, 0..4),
    ) {
        let entries: Vec<_> = named.iter().map(|head| format!("{} conventional_detected=red", IDS[*head])).collect();
        let phases = [("p1", "3", &*entries.join(";")), ("p2", "3", "")];
        let hand = |head: &usize| {
            let target = SignalTarget { id: IDS[*head], store: CONVENTIONAL_DETECTED };
            (1, Action::SetState { target, state: StateText::new("yellow") })
        };
        let actions: Vec<_> = by_hand.iter().map(hand).collect();
        let mut scene = Scene::of(compat, vec![controller("A", &phases)], &actions);
        scene.run_to(3);
        let left: Vec<_> = scene.lights.states(CONVENTIONAL_DETECTED).into_keys().collect();
        let expected: Vec<_> = by_hand.difference(&named).map(|head| IDS[*head]).collect();
        prop_assert_eq!(left, expected);
    }

    #[test]
    fn no_lit_detection_is_lost_in_the_merge(
        compat in some_compat(),
        merged in any::<bool>(),
        controllers in some_controllers(),
        actions in some_script(),
    ) {
        let scenario = Scenario { controllers, acts: script(&actions), ..Scenario::default() };
        let mut settings = settings(small_map(), scenario, compat);
        settings.one_group_per_head = !merged;
        let mut scene = Scene::new(settings);
        for now in 0..13 {
            scene.run_to(now);
            let LightsContent::Groups(groups) = &scene.last[&LightsTopic::Camera].content else { unreachable!() };
            for (id, light) in scene.lights.states(CONVENTIONAL_DETECTED) {
                let relation = if [11, 12, 100].contains(&id) { 100 } else { 200 };
                let sent = groups.iter().filter(|group| group.relation_id == relation);
                let sent: BulbSet = sent.flat_map(|group| &group.elements).map(|element| element.bulb).collect();
                prop_assert!(sent.contains_all(&light.bulbs), "{id} at {now}: {sent}");
            }
            prop_assert!(groups.iter().all(|group| !group.elements.is_empty()));
        }
    }
}
