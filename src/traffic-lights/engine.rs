//! The engine of the traffic lights: inputs and times in, messages and events out.
//!
//! A frame evaluates the controllers, then the storyboard, and then builds the camera's message. Messages of
//! the other topics have their own periods, which begin with the first frame
//! (docs/spec/traffic-lights.md, "Frames and rates").

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use super::bulb::BulbSet;
use super::controller::{Controllers, FrameTimes};
use super::emission::{Emission, LightsContent, LightsTopic};
use super::event_log::{ActionSource, LoggedEvent, ScenarioOutcome};
use super::expiry::Expiry;
use super::outbox::Outbox;
use super::periodic_timer::{FrameClock, PeriodicTimer, Rate, ScenarioMoment};
use super::prediction::Predictions;
use super::quirks::LightQuirks;
use super::received::ReceivedState;
use super::refusal::ActionRefusal;
use super::scenario::{Action, ControllerIndex, Scenario, TrafficSignalController};
use super::scenario_state::ScenarioState;
use super::store::{Light, Stores};
use super::storyboard::Storyboard;
use super::sync::SyncedStores;
use super::target::{LightChannel, StoreId, StoreLayer};
use gateway_base::time::{MonoTime, Now, WallStamp};
use lanelet2_map::light_map::LightMap;

/// A publication and a frame closer than this are simultaneous, and the frame comes first: both are rounded
/// to nanoseconds, from different origins.
const SAME_TIME_NANOS: u64 = 1_000;

/// The settings of the engine.
#[derive(Debug, Clone, PartialEq)]
pub struct LightsSettings {
    /// The lights of the map.
    pub map: Arc<LightMap>,
    /// The scenario to run. In improved mode `config` has already refused ids that are not on the map.
    pub scenario: Scenario,
    /// The rules of upstream to follow.
    pub quirks: LightQuirks,
    /// Rate of the frames, and thus of the camera topic.
    pub frame_rate: Rate,
    /// Number of the first frame: 1 as in the simulator, or 0 for a frame at the very start.
    pub first_frame: u8,
    /// Rate of the ground-truth topic and of the markers, until an action changes it.
    pub ground_truth_rate: Rate,
    /// Rate of the V2I topics, until an action changes it.
    pub v2i_rate: Rate,
    /// True if enabling a head for V2I copies its present state.
    pub copy_on_enable: bool,
    /// True if a group is sent once for each of its lit heads (Q17), as upstream always does.
    pub one_group_per_head: bool,
    /// Age at which an external V2I state is removed; `None` if it is valid until replaced.
    pub v2i_timeout: Option<Duration>,
    /// The topics for which messages are built, all except [`LightsTopic::Arbiter`].
    pub topics: BTreeSet<LightsTopic>,
}

/// The observed state of a light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightObservation {
    /// Bulbs of the light, empty if it is dark.
    pub bulbs: BulbSet,
    /// Confidence of the observation, 0 to 1.
    pub confidence: f64,
}

impl From<LightObservation> for ReceivedState {
    fn from(LightObservation { bulbs, confidence }: LightObservation) -> Self {
        Self { bulbs, confidence, predictions: Vec::new() }
    }
}

/// The engine: traffic lights of a map, with a scenario and external inputs.
#[derive(Debug, Clone)]
pub struct TrafficLights {
    pub(super) scenario: Arc<Scenario>,
    pub(super) scenario_state: ScenarioState,
    storyboard: Storyboard,
    frames: FrameClock,
    last_frame: Option<ScenarioMoment>,
    pub(super) expiry: Expiry,
    pub(super) v2i_timeout: Option<Duration>,
    topics: BTreeSet<LightsTopic>,
    outbox: Outbox,
    origin: MonoTime,
    pub(super) counts: [InputCounts; 2],
    skipped: u64,
}

#[derive(Debug, Clone, Copy, Default)]
pub(super) struct InputCounts {
    pub(super) rejected: u64,
    /// Id of the light, `None` if it could not be read, and the time.
    pub(super) last_rejected: Option<(Option<i64>, MonoTime)>,
}

/// A kind of deadline. Simultaneous deadlines are handled in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Due {
    Expiry,
    Frame,
    GroundTruth,
    V2i,
}

impl LightsSettings {
    /// Creates settings with the default rates, copying and grouping of a mode, without topics.
    pub fn new(map: Arc<LightMap>, scenario: Scenario, quirks: impl Into<LightQuirks>) -> Self {
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

    /// Returns whether a running scenario can continue with these settings instead of `before`: lights,
    /// scenario, rules, frames, topics and expiry are the same.
    pub fn is_same_run(&self, before: &Self) -> bool {
        let expire = self.v2i_timeout.is_some() == before.v2i_timeout.is_some();
        let changeable = Self {
            ground_truth_rate: before.ground_truth_rate,
            v2i_rate: before.v2i_rate,
            copy_on_enable: before.copy_on_enable,
            one_group_per_head: before.one_group_per_head,
            v2i_timeout: before.v2i_timeout,
            ..self.clone()
        };
        expire && changeable == *before
    }
}

impl TrafficLights {
    /// Starts the scenario and performs its init actions; the first frame is not yet due.
    pub fn new(settings: LightsSettings, now: Now) -> Self {
        let LightsSettings { map, scenario, quirks, .. } = settings;
        let predictions = Predictions::new(scenario.controllers.len(), map.heads().len(), quirks);
        let mut scenario_state = ScenarioState {
            quirks,
            copy_on_enable: settings.copy_on_enable,
            lights: SyncedStores::new(Stores::new(map, quirks)),
            controllers: Controllers::new(&scenario, quirks),
            variables: scenario.variables.iter().map(|variable| variable.value.clone()).collect(),
            predictions,
            ground_truth: PeriodicTimer::new(settings.ground_truth_rate),
            v2i: PeriodicTimer::new(settings.v2i_rate),
            verdict: None,
            events: VecDeque::new(),
            is_first_frame: true,
            now: ScenarioMoment::default(),
            wall: now.wall,
        };
        for (index, action) in scenario.init.iter().enumerate() {
            if scenario_state.verdict.is_none()
                && let Err(refusal) = scenario_state.perform(&scenario, action, ActionSource::Init(index))
            {
                scenario_state.end(ScenarioOutcome::Fault(refusal));
            }
        }
        Self {
            storyboard: Storyboard::new(&scenario),
            scenario: Arc::new(scenario),
            scenario_state,
            frames: FrameClock::new(settings.frame_rate, settings.first_frame),
            last_frame: None,
            expiry: Expiry::default(),
            v2i_timeout: settings.v2i_timeout,
            topics: settings.topics,
            outbox: Outbox::new(settings.one_group_per_head),
            origin: now.mono,
            counts: [InputCounts::default(); 2],
            skipped: 0,
        }
    }

    /// Continues with other settings, except for those that require a new scenario: see
    /// [`LightsSettings::is_same_run`]. A rate changed by an action stays unless its setting differs.
    pub fn reconfigure(&mut self, before: &LightsSettings, settings: &LightsSettings, now: Now) {
        self.move_to(now);
        let nanos = self.nanos(now.mono);
        let ScenarioState { ground_truth, v2i, copy_on_enable, .. } = &mut self.scenario_state;
        for (timer, before, rate) in [
            (ground_truth, before.ground_truth_rate, settings.ground_truth_rate),
            (v2i, before.v2i_rate, settings.v2i_rate),
        ] {
            if before != rate {
                timer.restart(rate, nanos);
            }
        }
        *copy_on_enable = settings.copy_on_enable;
        self.v2i_timeout = settings.v2i_timeout;
        self.outbox.reconfigure(settings.one_group_per_head);
    }

    /// Returns the rules of upstream in effect.
    pub fn quirks(&self) -> LightQuirks {
        self.scenario_state.quirks
    }

    /// Returns the scenario's controllers, in the order of the document.
    pub fn controllers(&self) -> &[TrafficSignalController] {
        &self.scenario.controllers
    }

    /// Performs the action of a command, after everything that is due by now. A refused action changes
    /// nothing, except that in upstream mode a state is applied up to its mistake.
    pub fn apply(&mut self, action: &Action, now: Now) -> Result<(), ActionRefusal> {
        self.move_to(now);
        let scenario = Arc::clone(&self.scenario);
        self.scenario_state.perform(&scenario, action, ActionSource::Outside)
    }

    /// Handles everything that is due by now, in order, each at its own time. After a gap the oldest frames
    /// and messages are skipped, see [`TrafficLights::skipped`].
    pub fn advance(&mut self, now: Now) {
        let reached = self.nanos(now.mono);
        self.skipped += self.frames.skip(reached)
            + self.scenario_state.ground_truth.skip(reached)
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

    /// Returns the next time at which [`TrafficLights::advance`] has something to do.
    pub fn next_deadline(&self) -> MonoTime {
        self.next_due()
            .map_or(MonoTime::from_nanos(u64::MAX), |(at, _)| self.origin.after(Duration::from_nanos(at)))
    }

    /// Returns the next message to send, oldest first.
    pub fn poll_output(&mut self) -> Option<Emission> {
        self.outbox.poll()
    }

    /// Returns the next event of the scenario, oldest first.
    pub fn poll_event(&mut self) -> Option<LoggedEvent> {
        self.scenario_state.events.pop_front()
    }

    /// Returns the end of the scenario; `None` while it runs.
    pub fn verdict(&self) -> Option<&ScenarioOutcome> {
        self.scenario_state.verdict.as_ref()
    }

    /// Returns the scenario, for the names behind the positions in events.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// Returns the four stores of light states.
    pub fn stores(&self) -> &Stores {
        &self.scenario_state.lights.stores
    }

    /// Returns the position of a controller's present phase; `None` before the first one.
    pub fn phase(&self, controller: ControllerIndex) -> Option<usize> {
        self.scenario_state.controllers.state(controller)?.phase
    }

    /// Returns the states of a store, ascending by id: of all heads ever touched, by way id, or of detected
    /// lights, by way id; in upstream mode by the id as written.
    pub fn states(&self, store: StoreId) -> BTreeMap<i64, LightObservation> {
        self.iter_states(store).collect()
    }

    /// Returns the same states as [`Self::states`], as an iterator.
    pub(super) fn iter_states(&self, store: StoreId) -> impl Iterator<Item = (i64, LightObservation)> {
        let (map, truth, detected) =
            (&self.stores().map, self.stores().truth(store.channel), self.stores().detected(store.channel));
        let state = |id: i64, Light { bulbs, confidence, .. }: &Light| {
            bulbs.map(|bulbs| (id, LightObservation { bulbs, confidence: *confidence }))
        };
        let is_truth = store.layer == StoreLayer::GroundTruth;
        let truth = is_truth.then(|| map.heads().iter().zip(truth.lights())).into_iter().flatten();
        let detected = (!is_truth).then(|| detected.entries()).into_iter().flatten();
        let truth = truth.filter_map(move |(head, light)| state(head.way_id, light));
        truth.chain(detected.filter_map(move |(id, entry)| state(id, &entry.light)))
    }

    /// Returns the number of frames and messages skipped after gaps.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    pub(super) fn publishes(&self, topic: LightsTopic) -> bool {
        self.topics.contains(&topic)
    }

    /// Returns nanoseconds since the start of the scenario.
    pub(super) fn nanos(&self, at: MonoTime) -> u64 {
        u64::try_from(at.since(self.origin).as_nanos()).unwrap_or(u64::MAX)
    }

    /// Handles everything that is due, and sets the present moment. Upstream's clock advances only with
    /// frames.
    pub(super) fn move_to(&mut self, now: Now) {
        self.advance(now);
        self.scenario_state.now.nanos = self.scenario_state.now.nanos.max(self.nanos(now.mono));
        self.scenario_state.wall = now.wall;
    }

    fn next_due(&self) -> Option<(u64, Due)> {
        let frame = self.frames.next();
        let tick = |at: u64| if at < frame && frame - at <= SAME_TIME_NANOS { frame } else { at };
        let timers =
            [(&self.scenario_state.ground_truth, Due::GroundTruth), (&self.scenario_state.v2i, Due::V2i)];
        let ticks = timers.into_iter().filter_map(|(timer, due)| Some((tick(timer.next()?), due)));
        let expiry = self.expiry.next().map(|at| (at, Due::Expiry));
        ticks.chain(expiry).chain([(frame, Due::Frame)]).min()
    }

    fn frame(&mut self, wall: WallStamp) {
        let now = self.frames.tick();
        (self.scenario_state.now, self.scenario_state.wall) = (now, wall);
        let frame = FrameTimes { now, previous: self.last_frame.replace(now) };
        self.scenario_state.is_first_frame = frame.previous.is_none();
        if self.scenario_state.verdict.is_none() {
            let scenario = Arc::clone(&self.scenario);
            let controllers = self.scenario_state.run_controllers(&scenario, frame);
            if let Err(refusal) =
                controllers.and_then(|()| self.storyboard.step(&scenario, &mut self.scenario_state))
            {
                self.scenario_state.end(ScenarioOutcome::Fault(refusal));
            }
        }
        if self.publishes(LightsTopic::Clock) {
            self.outbox.send(LightsTopic::Clock, wall, LightsContent::Clock);
        }
        if self.publishes(LightsTopic::Camera) {
            self.outbox.send_camera(&self.scenario_state.lights.stores, wall);
        }
        if self.publishes(LightsTopic::GroundTruth) || self.publishes(LightsTopic::Markers) {
            self.scenario_state.ground_truth.start(now.nanos);
        }
        let draws_v2i = self.publishes(LightsTopic::Markers) && self.quirks().draws_each_channel;
        if self.publishes(LightsTopic::V2i) || draws_v2i {
            self.scenario_state.v2i.start(now.nanos);
        }
    }

    fn publish_ground_truth(&mut self, wall: WallStamp) {
        self.scenario_state.ground_truth.tick();
        if self.publishes(LightsTopic::GroundTruth) {
            self.outbox.send_ground_truth(&self.scenario_state.lights.stores, wall);
        }
        if self.publishes(LightsTopic::Markers) {
            self.outbox.send_markers(&self.scenario_state.lights.stores, LightChannel::Conventional, wall);
        }
    }

    fn publish_v2i(&mut self, wall: WallStamp) {
        self.scenario_state.v2i.tick();
        if self.publishes(LightsTopic::V2i) {
            self.scenario_state.lights.stores.drop_past_predictions(wall);
            self.outbox.send_v2i(&self.scenario_state.lights.stores, &self.scenario_state.predictions, wall);
        }
        if self.publishes(LightsTopic::Markers) {
            self.outbox.send_markers(&self.scenario_state.lights.stores, LightChannel::V2i, wall);
        }
    }
}
