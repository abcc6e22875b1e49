//! Traffic lights in motion: inputs and times in, messages and notes out.
//!
//! Within a frame: controllers, then events, then the camera's message. Messages of the other topics
//! have rhythms of their own, which begin with the first frame (traffic-lights sections 4.2 and 5.4).

use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use super::bulb::BulbSet;
use super::cadence::{Cadence, FrameClock, Moment, Rate};
use super::compat::Compat;
use super::controller::{ControllerState, Controllers, Frame};
use super::emission::{Emission, LightState, LightsTopic};
use super::expiry::Expiry;
use super::note::{ActionSource, Note, Verdict};
use super::outbox::Outbox;
use super::prediction::Predictions;
use super::refusal::Refusal;
use super::scenario::{Action, ControllerIndex, Scenario};
use super::stage::Stage;
use super::store::{Change, Stores, heads_of};
use super::storyboard::Storyboard;
use super::sync::SyncedStores;
use super::target::{Channel, StoreId, Target};
use crate::core::map::light_map::LightMap;
use crate::core::time::{MonoTime, Now, WallStamp};

pub use super::controller::cycles_agree;

/// A publication and a frame closer than this are at the same time, and the frame comes first: both
/// are rounded to nanoseconds, from different origins.
const SAME_TIME_NANOS: u64 = 1_000;

/// What the engine runs on.
#[derive(Debug, Clone)]
pub struct LightsSettings {
    /// The lights.
    pub map: Arc<LightMap>,
    /// What shall happen; its ids were checked, see [`unknown_ids`](super::unknown_ids::check_ids).
    pub scenario: Scenario,
    /// Whose behaviour.
    pub compat: Compat,
    /// Of the evaluation, and of the camera topic.
    pub frame_rate: Rate,
    /// Number of the first frame: 1 as in the simulator, or 0 for one at the very start.
    pub first_frame: u8,
    /// Of the ground-truth topic, and of the markers.
    pub ground_truth_rate: Rate,
    /// Of the V2I topics, until an action changes it.
    pub v2i_rate: Rate,
    /// Whether enabling a head for V2I copies what it shows at that time.
    pub copy_on_enable: bool,
    /// Whether a group is sent once for each of its lit heads (Q17); upstream always does.
    pub one_group_per_head: bool,
    /// After this an external state of V2I that was not renewed is removed; none = never.
    pub v2i_timeout: Option<Duration>,
    /// What is wanted of [`LightsTopic`]; [`LightsTopic::Arbiter`] is not made here.
    pub topics: BTreeSet<LightsTopic>,
}

/// A state from outside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    /// The bulbs; none = dark.
    pub bulbs: BulbSet,
    /// 0 to 1.
    pub confidence: f64,
}

/// Traffic lights of a map, with a scenario and inputs from outside.
#[derive(Debug, Clone)]
pub struct TrafficLights {
    pub(super) scenario: Arc<Scenario>,
    pub(super) stage: Stage,
    storyboard: Storyboard,
    frames: FrameClock,
    last_frame: Option<Moment>,
    ground_truth: Cadence,
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
    pub(super) last_rejected: Option<(i64, MonoTime)>,
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
    pub fn new(map: Arc<LightMap>, scenario: Scenario, compat: Compat) -> Self {
        Self {
            map,
            scenario,
            compat,
            frame_rate: Rate::THIRTY_HZ,
            first_frame: 1,
            ground_truth_rate: Rate::THIRTY_HZ,
            v2i_rate: Rate::TEN_HZ,
            copy_on_enable: compat == Compat::Improved,
            one_group_per_head: compat == Compat::Upstream,
            v2i_timeout: None,
            topics: BTreeSet::new(),
        }
    }
}

impl TrafficLights {
    /// The scenario starts now: its init actions are done, the first frame is yet to come.
    pub fn new(settings: LightsSettings, now: Now) -> Self {
        let LightsSettings { map, scenario, compat, .. } = settings;
        let predictions = Predictions::new(scenario.controllers.len(), map.heads().len(), compat);
        let mut stage = Stage {
            compat,
            copy_on_enable: settings.copy_on_enable,
            lights: SyncedStores::new(Stores::new(map, compat)),
            controllers: Controllers::new(&scenario, compat),
            predictions,
            v2i: Cadence::new(settings.v2i_rate),
            verdict: None,
            notes: VecDeque::new(),
            now: Moment::default(),
            wall: now.wall,
        };
        for (index, action) in scenario.init.iter().enumerate() {
            if let Err(refusal) = stage.perform(&scenario, action, ActionSource::Init(index)) {
                stage.end(Verdict::Fault(refusal));
            }
            if stage.verdict.is_some() {
                break;
            }
        }
        Self {
            storyboard: Storyboard::new(&scenario),
            scenario: Arc::new(scenario),
            stage,
            frames: FrameClock::new(settings.frame_rate, settings.first_frame),
            last_frame: None,
            ground_truth: Cadence::new(settings.ground_truth_rate),
            expiry: Expiry::default(),
            v2i_timeout: settings.v2i_timeout,
            topics: settings.topics,
            outbox: Outbox::new(settings.one_group_per_head),
            origin: now.mono,
            counts: [InputCounts::default(); 2],
            skipped: 0,
        }
    }

    /// Does an action asked for from outside, after all that is due by now. A refused one changes
    /// nothing, save that upstream's behaviour applies a state up to the mistake in it.
    pub fn apply(&mut self, action: &Action, now: Now) -> Result<(), Refusal> {
        self.move_to(now);
        let scenario = Arc::clone(&self.scenario);
        self.stage.perform(&scenario, action, ActionSource::Outside)
    }

    /// Takes states from outside, after all that is due by now: by way or relation id, `None` where
    /// there is none any more. Returns how many were rejected, for an id the map does not know or a
    /// confidence outside 0 to 1; the others count.
    pub fn set_states(
        &mut self,
        store: StoreId,
        states: impl IntoIterator<Item = (i64, Option<Sight>)>,
        now: Now,
    ) -> usize {
        self.take_states(store, states, true, now)
    }

    /// Likewise, from who says it himself when a state is too old: it holds until then.
    pub fn set_lasting_states(
        &mut self,
        store: StoreId,
        states: impl IntoIterator<Item = (i64, Option<Sight>)>,
        now: Now,
    ) -> usize {
        self.take_states(store, states, false, now)
    }

    /// Counts inputs that could not even be read.
    pub fn count_rejected(&mut self, channel: Channel, rejected: u32) {
        self.counts_mut(channel).rejected += u64::from(rejected);
    }

    /// Does all that is due by now, in order, each at its own time. After a gap the oldest frames and
    /// messages are left out, see [`TrafficLights::skipped`].
    pub fn advance(&mut self, now: Now) {
        let reached = self.nanos(now.mono);
        self.skipped +=
            self.frames.skip(reached) + self.ground_truth.skip(reached) + self.stage.v2i.skip(reached);
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
        self.stage.notes.pop_front()
    }

    /// How the scenario ended; none while it goes on.
    pub fn verdict(&self) -> Option<&Verdict> {
        self.stage.verdict.as_ref()
    }

    /// The scenario that runs, for the names behind the positions in notes.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// The stores, to look at.
    pub fn stores(&self) -> &Stores {
        self.stage.lights.stores()
    }

    /// Position of the phase a controller is in; none before the first one.
    pub fn phase(&self, controller: ControllerIndex) -> Option<usize> {
        self.stage.controllers.state(controller)?.phase
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
    pub fn detected(&self, channel: Channel) -> impl Iterator<Item = (i64, Sight)> + '_ {
        self.stores().detected(channel).entries().filter_map(|(id, entry)| {
            let confidence = entry.light.confidence;
            entry.light.bulbs.map(|bulbs| (id, Sight { bulbs, confidence }))
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
        (self.ground_truth.rate(), self.stage.v2i.rate())
    }

    /// Where a controller stands.
    pub(super) fn controller(&self, controller: ControllerIndex) -> Option<&ControllerState> {
        self.stage.controllers.state(controller)
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
        self.stage.now.nanos = self.stage.now.nanos.max(self.nanos(now.mono));
        self.stage.wall = now.wall;
    }

    fn next_due(&self) -> Option<(u64, Due)> {
        let frame = self.frames.next();
        let tick = |at: u64| if at < frame && frame - at <= SAME_TIME_NANOS { frame } else { at };
        let ticks = [(&self.ground_truth, Due::GroundTruth), (&self.stage.v2i, Due::V2i)];
        let ticks = ticks.into_iter().filter_map(|(cadence, due)| Some((tick(cadence.next()?), due)));
        let expiry = self.expiry.next().map(|at| (at, Due::Expiry));
        ticks.chain(expiry).chain([(frame, Due::Frame)]).min()
    }

    fn frame(&mut self, wall: WallStamp) {
        let now = self.frames.tick();
        (self.stage.now, self.stage.wall) = (now, wall);
        let frame = Frame { now, previous: self.last_frame.replace(now) };
        if self.stage.verdict.is_none() {
            let scenario = Arc::clone(&self.scenario);
            let controllers = self.stage.run_controllers(&scenario, frame);
            if let Err(refusal) = controllers.and_then(|()| self.storyboard.step(&scenario, &mut self.stage))
            {
                self.stage.end(Verdict::Fault(refusal));
            }
        }
        if self.wants(LightsTopic::Camera) {
            self.outbox.send_camera(self.stage.lights.stores(), wall);
        }
        if self.wants(LightsTopic::GroundTruth) || self.wants(LightsTopic::Markers) {
            self.ground_truth.start(now.nanos);
        }
        let draws_v2i = self.wants(LightsTopic::Markers) && self.stage.compat == Compat::Upstream;
        if self.wants(LightsTopic::V2i) || draws_v2i {
            self.stage.v2i.start(now.nanos);
        }
    }

    fn publish_ground_truth(&mut self, wall: WallStamp) {
        self.ground_truth.tick();
        if self.wants(LightsTopic::GroundTruth) {
            self.outbox.send_ground_truth(self.stage.lights.stores(), wall);
        }
        if self.wants(LightsTopic::Markers) {
            self.outbox.send_markers(self.stage.lights.stores(), Channel::Conventional, wall);
        }
    }

    fn publish_v2i(&mut self, wall: WallStamp) {
        self.stage.v2i.tick();
        if self.wants(LightsTopic::V2i) {
            self.outbox.send_v2i(self.stage.lights.stores(), &self.stage.predictions, wall);
        }
        if self.wants(LightsTopic::Markers) {
            self.outbox.send_markers(self.stage.lights.stores(), Channel::V2i, wall);
        }
    }

    fn take_states(
        &mut self,
        store: StoreId,
        states: impl IntoIterator<Item = (i64, Option<Sight>)>,
        ages: bool,
        now: Now,
    ) -> usize {
        self.move_to(now);
        let mut rejected = 0;
        for (id, sight) in states {
            if !self.set_state(Target { id, store }, sight, ages) {
                rejected += 1;
                let counts = self.counts_mut(store.channel);
                counts.rejected += 1;
                counts.last_rejected = Some((id, now.mono));
            }
        }
        rejected
    }

    /// Whether it was taken.
    fn set_state(&mut self, target: Target, sight: Option<Sight>, ages: bool) -> bool {
        let Some(Sight { bulbs, confidence }) = sight else {
            let is_known = self.stage.lights.write(target, Change::Remove).is_ok();
            self.watch(target, false);
            return is_known;
        };
        let is_taken = (0.0..=1.0).contains(&confidence)
            && self.stage.lights.write(target, Change::Set(bulbs)).is_ok()
            && self.stage.lights.write(target, Change::Confidence(confidence)).is_ok();
        if is_taken {
            self.watch(target, ages);
        }
        is_taken
    }

    /// From now on the light has to be renewed, or no longer. Only V2I is watched.
    fn watch(&mut self, target: Target, renewed: bool) {
        let Some(timeout) = self.v2i_timeout.filter(|_| target.store.channel == Channel::V2i) else { return };
        let at = self.stage.now.after(timeout).nanos;
        let stores = self.stage.lights.stores();
        let heads = heads_of(stores.map(), target.id).into_iter().flatten();
        let way_ids = heads.filter_map(|head| Some(stores.map().heads().get(head.0 as usize)?.way_id));
        // Upstream keeps a light under the id as it came.
        let ids: Vec<_> = match self.stage.compat {
            Compat::Improved => way_ids.collect(),
            Compat::Upstream => vec![target.id],
        };
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
        if self.stage.lights.stores().written(target) == written {
            // The id was known when it was watched.
            let _known = self.stage.lights.write(target, Change::Remove);
        }
    }
}
