//! Traffic lights in motion: inputs and times in, messages and notes out.
//!
//! Within a frame: controllers, then events, then the camera's message. Messages of the other topics
//! have rhythms of their own, which begin with the first frame
//! (docs/spec/traffic-lights.md, "Frames and rates").

use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use super::bulb::BulbSet;
use super::controller::{ControllerState, Controllers, Frame};
use super::emission::{Emission, LightState, LightsTopic};
use super::event_log::{ActionSource, Note, ScenarioOutcome};
use super::expiry::Expiry;
use super::outbox::Outbox;
use super::periodic_timer::{FrameClock, Moment, PeriodicTimer, Rate};
use super::prediction::Predictions;
use super::quirks::UpstreamQuirks;
use super::refusal::Refusal;
use super::scenario::{Action, Controller, ControllerIndex, Scenario};
use super::scenario_state::ScenarioState;
use super::store::{Change, Stores, heads_of};
use super::storyboard::Storyboard;
use super::sync::SyncedStores;
use super::target::{Channel, StoreId, Target};
use crate::core::map::light_map::LightMap;
use crate::core::time::{MonoTime, Now, WallStamp};

/// A publication and a frame closer than this are at the same time, and the frame comes first: both
/// are rounded to nanoseconds, from different origins.
const SAME_TIME_NANOS: u64 = 1_000;

/// What the engine runs on.
#[derive(Debug, Clone)]
pub struct LightsSettings {
    /// The lights.
    pub map: Arc<LightMap>,
    /// The scenario to run; `config` has refused ids that the map does not have.
    pub scenario: Scenario,
    /// The rules of upstream to follow.
    pub quirks: UpstreamQuirks,
    /// Rate of the evaluation, and of the camera topic.
    pub frame_rate: Rate,
    /// Number of the first frame: 1 as in the simulator, or 0 for one at the very start.
    pub first_frame: u8,
    /// Rate of the ground-truth topic, and of the markers.
    pub ground_truth_rate: Rate,
    /// Rate of the V2I topics, until an action changes it.
    pub v2i_rate: Rate,
    /// Whether enabling a head for V2I copies what it shows at that time.
    pub copy_on_enable: bool,
    /// Whether a group is sent once for each of its lit heads (Q17); upstream always does.
    pub one_group_per_head: bool,
    /// After this an external state of V2I that was not renewed is removed; none = never.
    pub v2i_timeout: Option<Duration>,
    /// The topics to make messages for; [`LightsTopic::Arbiter`] is not made here.
    pub topics: BTreeSet<LightsTopic>,
}

/// A state from outside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightObservation {
    /// The bulbs; none = dark.
    pub bulbs: BulbSet,
    /// 0 to 1.
    pub confidence: f64,
}

/// Traffic lights of a map, with a scenario and inputs from outside.
#[derive(Debug, Clone)]
pub struct TrafficLights {
    pub(super) scenario: Arc<Scenario>,
    pub(super) scenario_state: ScenarioState,
    storyboard: Storyboard,
    frames: FrameClock,
    last_frame: Option<Moment>,
    ground_truth: PeriodicTimer,
    pub(super) expiry: Expiry,
    v2i_timeout: Option<Duration>,
    topics: BTreeSet<LightsTopic>,
    outbox: Outbox,
    origin: MonoTime,
    pub(super) counts: [InputCounts; 2],
    skipped: u64,
}

/// What came of inputs to one channel.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct InputCounts {
    pub(super) rejected: u64,
    /// Id of the light, if that could be read, and the time.
    pub(super) last_rejected: Option<(Option<i64>, MonoTime)>,
}

/// What is due at some time. The order is that of things due at the same time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Due {
    Expiry,
    Frame,
    GroundTruth,
    V2i,
}

impl LightsSettings {
    /// The usual rates, no topics; copies and groups as usual for the behaviour.
    pub fn new(map: Arc<LightMap>, scenario: Scenario, quirks: impl Into<UpstreamQuirks>) -> Self {
        let quirks = quirks.into();
        Self {
            map,
            scenario,
            quirks,
            frame_rate: Rate::THIRTY_HZ,
            first_frame: 1,
            ground_truth_rate: Rate::THIRTY_HZ,
            v2i_rate: Rate::TEN_HZ,
            copy_on_enable: !quirks.enables_without_copy,
            one_group_per_head: quirks.one_group_per_head,
            v2i_timeout: None,
            topics: BTreeSet::new(),
        }
    }
}

impl TrafficLights {
    /// The scenario starts now: its init actions are done, the first frame is yet to come.
    pub fn new(settings: LightsSettings, now: Now) -> Self {
        let LightsSettings { map, scenario, quirks, .. } = settings;
        let predictions = Predictions::new(scenario.controllers.len(), map.heads().len(), quirks);
        let mut scenario_state = ScenarioState {
            quirks,
            copy_on_enable: settings.copy_on_enable,
            lights: SyncedStores::new(Stores::new(map, quirks)),
            controllers: Controllers::new(&scenario, quirks),
            predictions,
            v2i: PeriodicTimer::new(settings.v2i_rate),
            verdict: None,
            notes: VecDeque::new(),
            now: Moment::default(),
            wall: now.wall,
        };
        for (index, action) in scenario.init.iter().enumerate() {
            if let Err(refusal) = scenario_state.perform(&scenario, action, ActionSource::Init(index)) {
                scenario_state.end(ScenarioOutcome::Fault(refusal));
            }
            if scenario_state.verdict.is_some() {
                break;
            }
        }
        Self {
            storyboard: Storyboard::new(&scenario),
            scenario: Arc::new(scenario),
            scenario_state,
            frames: FrameClock::new(settings.frame_rate, settings.first_frame),
            last_frame: None,
            ground_truth: PeriodicTimer::new(settings.ground_truth_rate),
            expiry: Expiry::default(),
            v2i_timeout: settings.v2i_timeout,
            topics: settings.topics,
            outbox: Outbox::new(settings.one_group_per_head),
            origin: now.mono,
            counts: [InputCounts::default(); 2],
            skipped: 0,
        }
    }

    /// The rules of upstream that are followed.
    pub fn quirks(&self) -> UpstreamQuirks {
        self.scenario_state.quirks
    }

    /// The scenario's controllers, which actions call by name.
    pub fn controllers(&self) -> &[Controller] {
        &self.scenario.controllers
    }

    /// Does an action asked for from outside, after all that is due by now. A refused one changes
    /// nothing, save that upstream's behaviour applies a state up to the mistake in it.
    pub fn apply(&mut self, action: &Action, now: Now) -> Result<(), Refusal> {
        self.move_to(now);
        let scenario = Arc::clone(&self.scenario);
        self.scenario_state.perform(&scenario, action, ActionSource::Outside)
    }

    /// Takes states from outside, after all that is due by now: by way or relation id, `None` where
    /// there is none any more. Returns how many were rejected, for an id the map does not know or a
    /// confidence outside 0 to 1; the others count.
    pub fn set_states(
        &mut self,
        store: StoreId,
        states: impl IntoIterator<Item = (i64, Option<LightObservation>)>,
        now: Now,
    ) -> usize {
        self.take_states(store, states, true, now)
    }

    /// Takes states likewise that hold until their sender removes them: it knows itself when one is too old.
    pub fn set_lasting_states(
        &mut self,
        store: StoreId,
        states: impl IntoIterator<Item = (i64, Option<LightObservation>)>,
        now: Now,
    ) -> usize {
        self.take_states(store, states, false, now)
    }

    /// Counts inputs that could not even be read.
    pub fn count_rejected(&mut self, channel: Channel, rejected: u32, now: Now) {
        if rejected > 0 {
            let counts = self.counts_mut(channel);
            counts.rejected += u64::from(rejected);
            counts.last_rejected = Some((None, now.mono));
        }
    }

    /// Does all that is due by now, in order, each at its own time. After a gap the oldest frames and
    /// messages are left out, see [`TrafficLights::skipped`].
    pub fn advance(&mut self, now: Now) {
        let reached = self.nanos(now.mono);
        self.skipped += self.frames.skip(reached)
            + self.ground_truth.skip(reached)
            + self.scenario_state.v2i.skip(reached);
        while let Some((at, due)) = self.next_due().filter(|(at, _)| *at <= reached) {
            let late = i64::try_from(reached - at).unwrap_or(i64::MAX);
            let wall = WallStamp::from_nanos(now.wall.as_nanos().saturating_sub(late));
            match due {
                Due::Expiry => self.expire(),
                Due::Frame => self.frame(wall),
                Due::GroundTruth => self.publish_ground_truth(wall),
                Due::V2i => self.publish_v2i(wall),
            }
        }
    }

    /// When [`TrafficLights::advance`] has something to do.
    pub fn next_deadline(&self) -> MonoTime {
        self.next_due()
            .map_or(MonoTime::from_nanos(u64::MAX), |(at, _)| self.origin.after(Duration::from_nanos(at)))
    }

    /// The next message to send, oldest first.
    pub fn poll_output(&mut self) -> Option<Emission> {
        self.outbox.poll()
    }

    /// The next thing that happened, oldest first.
    pub fn poll_note(&mut self) -> Option<Note> {
        self.scenario_state.notes.pop_front()
    }

    /// How the scenario ended; none while it goes on.
    pub fn verdict(&self) -> Option<&ScenarioOutcome> {
        self.scenario_state.verdict.as_ref()
    }

    /// The scenario that runs, for the names behind the positions in notes.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// The four stores.
    pub fn stores(&self) -> &Stores {
        self.scenario_state.lights.stores()
    }

    /// Position of the phase a controller is in; none before the first one.
    pub fn phase(&self, controller: ControllerIndex) -> Option<usize> {
        self.scenario_state.controllers.state(controller)?.phase
    }

    /// Ground truth of a channel: the heads that were ever touched, ascending by way id.
    pub fn ground_truth(&self, channel: Channel) -> impl Iterator<Item = LightState> + '_ {
        let heads = self.stores().map().heads().iter().zip(self.stores().truth(channel).lights());
        heads.filter_map(|(head, light)| {
            let (way_id, confidence) = (head.way_id, light.confidence);
            light.bulbs.map(|bulbs| LightState { way_id, bulbs, confidence })
        })
    }

    /// Detections of a channel, ascending by id: that of the head, or for upstream as written.
    pub fn detected(&self, channel: Channel) -> impl Iterator<Item = (i64, LightObservation)> + '_ {
        self.stores().detected(channel).entries().filter_map(|(id, entry)| {
            let confidence = entry.light.confidence;
            entry.light.bulbs.map(|bulbs| (id, LightObservation { bulbs, confidence }))
        })
    }

    /// Frames and messages left out after gaps.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// Whether a topic is wanted.
    pub(super) fn wants(&self, topic: LightsTopic) -> bool {
        self.topics.contains(&topic)
    }

    /// How often the ground truth is sent, and V2I.
    pub(super) fn rates(&self) -> (Rate, Rate) {
        (self.ground_truth.rate(), self.scenario_state.v2i.rate())
    }

    /// Where a controller stands.
    pub(super) fn controller(&self, controller: ControllerIndex) -> Option<&ControllerState> {
        self.scenario_state.controllers.state(controller)
    }

    /// Since the start of the scenario.
    pub(super) fn nanos(&self, at: MonoTime) -> u64 {
        u64::try_from(at.since(self.origin).as_nanos()).unwrap_or(u64::MAX)
    }

    fn counts_mut(&mut self, channel: Channel) -> &mut InputCounts {
        let [conventional, v2i] = &mut self.counts;
        match channel {
            Channel::Conventional => conventional,
            Channel::V2i => v2i,
        }
    }

    /// All that is due is done, and the moment at hand is now. Upstream's clock moves by frames only.
    fn move_to(&mut self, now: Now) {
        self.advance(now);
        self.scenario_state.now.nanos = self.scenario_state.now.nanos.max(self.nanos(now.mono));
        self.scenario_state.wall = now.wall;
    }

    fn next_due(&self) -> Option<(u64, Due)> {
        let frame = self.frames.next();
        let tick = |at: u64| if at < frame && frame - at <= SAME_TIME_NANOS { frame } else { at };
        let ticks = [(&self.ground_truth, Due::GroundTruth), (&self.scenario_state.v2i, Due::V2i)];
        let ticks =
            ticks.into_iter().filter_map(|(periodic_timer, due)| Some((tick(periodic_timer.next()?), due)));
        let expiry = self.expiry.next().map(|at| (at, Due::Expiry));
        ticks.chain(expiry).chain([(frame, Due::Frame)]).min()
    }

    fn frame(&mut self, wall: WallStamp) {
        let now = self.frames.tick();
        (self.scenario_state.now, self.scenario_state.wall) = (now, wall);
        let frame = Frame { now, previous: self.last_frame.replace(now) };
        if self.scenario_state.verdict.is_none() {
            let scenario = Arc::clone(&self.scenario);
            let controllers = self.scenario_state.run_controllers(&scenario, frame);
            if let Err(refusal) =
                controllers.and_then(|()| self.storyboard.step(&scenario, &mut self.scenario_state))
            {
                self.scenario_state.end(ScenarioOutcome::Fault(refusal));
            }
        }
        if self.wants(LightsTopic::Camera) {
            self.outbox.send_camera(self.scenario_state.lights.stores(), wall);
        }
        if self.wants(LightsTopic::GroundTruth) || self.wants(LightsTopic::Markers) {
            self.ground_truth.start(now.nanos);
        }
        let draws_v2i = self.wants(LightsTopic::Markers) && self.quirks().draws_each_channel;
        if self.wants(LightsTopic::V2i) || draws_v2i {
            self.scenario_state.v2i.start(now.nanos);
        }
    }

    fn publish_ground_truth(&mut self, wall: WallStamp) {
        self.ground_truth.tick();
        if self.wants(LightsTopic::GroundTruth) {
            self.outbox.send_ground_truth(self.scenario_state.lights.stores(), wall);
        }
        if self.wants(LightsTopic::Markers) {
            self.outbox.send_markers(self.scenario_state.lights.stores(), Channel::Conventional, wall);
        }
    }

    fn publish_v2i(&mut self, wall: WallStamp) {
        self.scenario_state.v2i.tick();
        if self.wants(LightsTopic::V2i) {
            self.outbox.send_v2i(self.scenario_state.lights.stores(), &self.scenario_state.predictions, wall);
        }
        if self.wants(LightsTopic::Markers) {
            self.outbox.send_markers(self.scenario_state.lights.stores(), Channel::V2i, wall);
        }
    }

    fn take_states(
        &mut self,
        store: StoreId,
        states: impl IntoIterator<Item = (i64, Option<LightObservation>)>,
        ages: bool,
        now: Now,
    ) -> usize {
        self.move_to(now);
        let mut rejected = 0;
        for (id, observation) in states {
            if !self.set_state(Target { id, store }, observation, ages) {
                rejected += 1;
                let counts = self.counts_mut(store.channel);
                counts.rejected += 1;
                counts.last_rejected = Some((Some(id), now.mono));
            }
        }
        rejected
    }

    /// Whether it was taken.
    fn set_state(&mut self, target: Target, observation: Option<LightObservation>, ages: bool) -> bool {
        let Some(LightObservation { bulbs, confidence }) = observation else {
            let is_known = self.scenario_state.lights.write(target, Change::Remove).is_ok();
            self.watch(target, false);
            return is_known;
        };
        let is_taken = (0.0..=1.0).contains(&confidence)
            && self.scenario_state.lights.write(target, Change::Set(bulbs)).is_ok()
            && self.scenario_state.lights.write(target, Change::Confidence(confidence)).is_ok();
        if is_taken {
            self.watch(target, ages);
        }
        is_taken
    }

    /// From now on the light has to be renewed, or no longer. Only V2I is watched.
    fn watch(&mut self, target: Target, renewed: bool) {
        let Some(timeout) = self.v2i_timeout.filter(|_| target.store.channel == Channel::V2i) else { return };
        let at = self.scenario_state.now.after(timeout).nanos;
        let stores = self.scenario_state.lights.stores();
        let heads = heads_of(stores.map(), target.id).into_iter().flatten();
        let way_ids = heads.filter_map(|head| Some(stores.map().heads().get(head.0 as usize)?.way_id));
        let is_one = self.quirks().detects_by_written_id;
        let ids: Vec<_> = if is_one { vec![target.id] } else { way_ids.collect() };
        for id in ids {
            let written = stores.written(Target { id, ..target });
            if renewed {
                self.expiry.watch((target.store.layer, id), written, at);
            } else {
                self.expiry.forget((target.store.layer, id));
            }
        }
    }

    /// Removes the oldest external state, unless something else was written since.
    fn expire(&mut self) {
        let Some(((layer, id), written)) = self.expiry.take() else { return };
        let target = Target { id, store: StoreId { channel: Channel::V2i, layer } };
        if self.scenario_state.lights.stores().written(target) == written {
            // The id was known when it was watched.
            let _known = self.scenario_state.lights.write(target, Change::Remove);
        }
    }
}
