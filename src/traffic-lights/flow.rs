//! The whole traffic-light flow: states of a V2X unit enter the engine, its messages pass the injected
//! faults, and arriving messages go to the arbiter. The time is the gateway's or a simulator's.

use std::collections::VecDeque;

use super::arbiter::{Arbiter, ArbiterSettings, ArbiterStamp};
use super::catalogue;
use super::command::parse_command;
use super::emission::{Emission, Groups, LightsContent, LightsTopic};
use super::engine::{LightObservation, LightsSettings, TrafficLights};
use super::event_log::ScenarioEvent;
use super::faults::ChannelFaults;
use super::input::TrafficLightInput;
use super::output::TrafficLightOutput;
use super::simulated_clock::SimulatedClock;
use super::target::{LightChannel, StoreId};
use gateway_base::diagnostics::Status;
use gateway_base::time::{MonoTime, Now, WallStamp};

/// The settings of the flow.
#[derive(Debug, Clone)]
pub struct LightsFlowSettings {
    /// Settings of the engine.
    pub lights: LightsSettings,
    /// Injected faults of the camera topic.
    pub camera_faults: Option<ChannelFaults>,
    /// Injected faults of the V2I topics.
    pub v2i_faults: Option<ChannelFaults>,
    /// Settings of the arbiter; `None` if there is no merged topic.
    pub arbiter: Option<ArbiterSettings>,
    /// True if the arbiter merges [`TrafficLightInput::Camera`] instead of the messages of the camera topic.
    pub external_camera: bool,
    /// True if [`TrafficLightInput::Clock`] gives the time of scenario, faults and messages: nothing happens
    /// before the first one.
    pub use_sim_time: bool,
}

impl LightsFlowSettings {
    /// Creates settings with only the engine, in the gateway's time.
    pub fn new(lights: LightsSettings) -> Self {
        Self {
            lights,
            camera_faults: None,
            v2i_faults: None,
            arbiter: None,
            external_camera: false,
            use_sim_time: false,
        }
    }
}

/// The traffic lights with injected faults and arbiter.
///
/// Pass inputs, call [`Self::settle`] after them and at [`Self::next_deadline`], then poll the outputs:
///
/// ```
/// # use std::sync::Arc;
/// # use traffic_lights::compat::Compat;
/// # use lanelet2_map::light_map::LightMap;
/// # use gateway_base::time::{MonoTime, Now, WallStamp};
/// # use traffic_lights::emission::LightsTopic;
/// # use traffic_lights::engine::LightsSettings;
/// # use traffic_lights::flow::{LightsFlowSettings, TrafficLightFlow};
/// # let map = Arc::new(LightMap::default());
/// let mut lights = LightsSettings::new(map, Default::default(), Compat::Improved);
/// lights.topics = [LightsTopic::Camera].into();
/// let at_ms = |ms| Now { mono: MonoTime::from_millis(ms), wall: WallStamp::default() };
/// let mut flow = TrafficLightFlow::new(LightsFlowSettings::new(lights), at_ms(0));
/// flow.settle(at_ms(100));
/// let messages = std::iter::from_fn(|| flow.poll_output()).count();
/// assert_eq!(messages, 3, "30 frames a second");
/// ```
#[derive(Debug, Clone)]
pub struct TrafficLightFlow {
    run: LightsRun,
    settings: Box<LightsFlowSettings>,
    /// The clock of a simulator; `None` if the gateway's own time is used.
    clock: Option<SimulatedClock>,
    ready: VecDeque<TrafficLightOutput>,
    /// Number of commands since the start that were invalid or could not be performed.
    pub(super) refused: u64,
    news: bool,
}

/// State that restarts with the clock.
#[derive(Debug, Clone)]
struct LightsRun {
    engine: TrafficLights,
    camera: Option<ChannelFaults>,
    v2i: Option<ChannelFaults>,
    arbiter: Option<Arbiter>,
}

impl LightsRun {
    fn new(settings: LightsFlowSettings, now: Now) -> Self {
        Self {
            arbiter: settings.arbiter.map(|arbiter| Arbiter::new(arbiter, &settings.lights.map)),
            camera: settings.camera_faults,
            v2i: settings.v2i_faults,
            engine: TrafficLights::new(settings.lights, now),
        }
    }

    fn reconfigure(&mut self, before: &LightsFlowSettings, settings: LightsFlowSettings, now: Now) {
        self.engine.reconfigure(&before.lights, &settings.lights, now);
        for (faults, before, configured) in [
            (&mut self.camera, &before.camera_faults, settings.camera_faults),
            (&mut self.v2i, &before.v2i_faults, settings.v2i_faults),
        ] {
            if before.as_ref().map(ChannelFaults::settings)
                != configured.as_ref().map(ChannelFaults::settings)
            {
                *faults = configured;
            }
        }
        match (&mut self.arbiter, settings.arbiter) {
            (Some(arbiter), Some(settings)) => arbiter.reconfigure(settings),
            (arbiter, settings) => {
                *arbiter = settings.map(|settings| Arbiter::new(settings, &before.lights.map));
            }
        }
    }
}

impl TrafficLightFlow {
    /// Starts the scenario and performs its init actions, before the first frame.
    pub fn new(settings: LightsFlowSettings, now: Now) -> Self {
        Self {
            clock: settings.use_sim_time.then(SimulatedClock::default),
            run: LightsRun::new(settings.clone(), now),
            settings: Box::new(settings),
            ready: VecDeque::new(),
            refused: 0,
            news: true,
        }
    }

    /// Continues with other settings. The scenario continues if its lights, rules and topics are the same;
    /// otherwise it restarts. Returns true if a new run begins: then pass all states of the V2X unit. Call
    /// [`Self::settle`] afterwards.
    pub fn reconfigure(&mut self, settings: LightsFlowSettings, now: Now) -> bool {
        self.news = true;
        let before = std::mem::replace(&mut *self.settings, settings.clone());
        let Some(now) = self.time(now) else { return false };
        let is_same_run = settings.lights.is_same_run(&before.lights);
        if is_same_run {
            self.run.reconfigure(&before, settings, now);
        } else {
            self.run = LightsRun::new(settings, now);
        }
        !is_same_run
    }

    /// Writes the changed states of a V2X unit, or all states for a new run: by way or relation id, `None` to
    /// remove one. They do not expire, since their receiver knows their age. Call [`Self::settle`]
    /// afterwards.
    pub fn set_unit_states(
        &mut self,
        states: impl IntoIterator<Item = (i64, Option<LightObservation>)>,
        now: Now,
    ) {
        if let Some(now) = self.time(now) {
            self.run.engine.set_states(StoreId::V2I, states, false, now);
        }
    }

    /// Processes an input. Returns true if a new run begins with it: then pass all states of the V2X unit.
    /// Call [`Self::settle`] afterwards.
    pub fn handle_input(&mut self, input: TrafficLightInput, now: Now) -> bool {
        if let TrafficLightInput::Clock(stamp) = input {
            return self.handle_clock(stamp, now);
        }
        let Some(now) = self.time(now) else {
            // States are sent again, commands are not.
            self.refused += u64::from(matches!(input, TrafficLightInput::Command(_)));
            return false;
        };
        match input {
            TrafficLightInput::States { store, states, rejected, .. } => {
                // Diagnostics show the last rejected state, preferably one with an id.
                self.run.engine.count_rejected(store.channel, rejected, now);
                let refused = self.run.engine.set_states(store, states, true, now);
                self.news |= refused > 0 || rejected > 0;
            }
            TrafficLightInput::Camera { stamp, groups, rejected } => {
                self.run.engine.count_rejected(LightChannel::Conventional, rejected, now);
                self.news |= rejected > 0;
                let arbiter = self.arbiter(now);
                let merged =
                    arbiter.map(|arbiter| arbiter.perception(ArbiterStamp(stamp.as_nanos()), &groups));
                self.publish_merged(merged, stamp);
            }
            TrafficLightInput::Clock(_) => {}
            TrafficLightInput::Command(text) => {
                let done = self.perform(&text, now);
                self.refused += u64::from(!done);
                self.news |= !done;
            }
        }
        false
    }

    /// Returns the time of the run; `None` before a simulator has given one.
    fn time(&self, now: Now) -> Option<Now> {
        self.clock.as_ref().map_or(Some(now), SimulatedClock::now)
    }

    /// Processes the time of a simulator. Returns true if a new run begins with it.
    fn handle_clock(&mut self, stamp: WallStamp, now: Now) -> bool {
        let Some(clock) = &mut self.clock else { return false };
        let was_silent = clock.is_silent(now.mono);
        let begins = clock.handle(stamp, now.mono);
        self.news |= begins || was_silent;
        let start = clock.now().filter(|_| begins);
        if let Some(start) = start {
            self.run = LightsRun::new((*self.settings).clone(), start);
        }
        start.is_some()
    }

    /// Performs the action of a command. Returns false if the command is invalid, or cannot be performed.
    fn perform(&mut self, text: &str, now: Now) -> bool {
        match parse_command(text, self.run.engine.controllers(), self.run.engine.quirks()) {
            Ok(action) => self.run.engine.apply(&action, now).is_ok(),
            Err(error) => {
                self.ready.push_back(TrafficLightOutput::CommandRefused(error));
                false
            }
        }
    }

    /// Handles everything that is due by now. Returns true if the diagnostics have changed.
    pub fn settle(&mut self, now: Now) -> bool {
        self.news |= self.clock.as_ref().is_some_and(|clock| clock.is_silent(now.mono));
        let Some(now) = self.time(now) else { return std::mem::take(&mut self.news) };
        self.run.engine.advance(now);
        while let Some(logged) = self.run.engine.poll_event() {
            self.news |= matches!(logged.event, ScenarioEvent::Ended(_));
        }
        while let Some(emission) = self.run.engine.poll_output() {
            let faults = match emission.topic {
                LightsTopic::Camera => &mut self.run.camera,
                LightsTopic::V2i => &mut self.run.v2i,
                LightsTopic::GroundTruth
                | LightsTopic::Arbiter
                | LightsTopic::Markers
                | LightsTopic::Clock => &mut None,
            };
            match faults {
                Some(faults) => faults.send(emission, now.mono),
                None => self.arrived(emission, now),
            }
        }
        while let Some(emission) = self.next_arrival(now.mono) {
            self.arrived(emission, now);
        }
        std::mem::take(&mut self.news)
    }

    /// Returns the next output, oldest first.
    pub fn poll_output(&mut self) -> Option<TrafficLightOutput> {
        self.ready.pop_front()
    }

    /// Returns the next time at which [`Self::settle`] has something to do. With a simulated clock, a run
    /// only waits for its messages.
    pub fn next_deadline(&self, now: MonoTime) -> MonoTime {
        match &self.clock {
            Some(clock) => clock.next_deadline(now).unwrap_or(MonoTime::MAX),
            None => {
                let faults = [&self.run.camera, &self.run.v2i].into_iter().flatten();
                let faults = faults.filter_map(ChannelFaults::next_deadline);
                faults.fold(self.run.engine.next_deadline(), MonoTime::min)
            }
        }
    }

    /// Returns the engine that the flow runs.
    pub fn engine(&self) -> &TrafficLights {
        &self.run.engine
    }

    /// Returns one status for each channel, and one for the scenario.
    pub fn statuses(&self, now: MonoTime) -> Vec<Status> {
        let clock = self.clock.as_ref();
        let time = clock.and_then(SimulatedClock::now).map_or(now, |time| time.mono);
        let finding = clock.and_then(|clock| match clock.now() {
            None => Some(catalogue::waiting_for_clock()),
            Some(_) => clock.is_silent(now).then(catalogue::clock_silent),
        });
        let mut statuses = self.run.engine.statuses(finding, time);
        if let Some(scenario) = statuses.last_mut() {
            scenario.values.push(("refused_commands", self.refused.to_string()));
            if let Some(clock) = clock {
                scenario.values.push(("clock_restarts", clock.restarts.to_string()));
                scenario.values.push(("clock_overtaken", clock.overtaken.to_string()));
            }
        }
        statuses
    }

    /// Returns the first delayed message that has arrived by now.
    fn next_arrival(&mut self, now: MonoTime) -> Option<Emission> {
        let delayed = [&mut self.run.camera, &mut self.run.v2i].into_iter().flatten();
        let due = delayed.filter_map(|faults| Some((faults.next_deadline()?, faults)));
        due.min_by_key(|(at, _)| *at)?.1.poll(now)
    }

    /// Returns the arbiter at this time. An external camera pipeline may stop, unlike our own camera topic.
    fn arbiter(&mut self, now: Now) -> Option<&mut Arbiter> {
        let may_stop = self.settings.external_camera && !self.run.engine.quirks().keeps_last_camera;
        let arbiter = self.run.arbiter.as_mut()?;
        if may_stop {
            arbiter.clock = Some(ArbiterStamp(now.wall.as_nanos()));
        }
        Some(arbiter)
    }

    /// Sends an arrived message, and the arbiter's output for it with the same stamp.
    fn arrived(&mut self, emission: Emission, now: Now) {
        let is_replaced = self.settings.external_camera && emission.topic == LightsTopic::Camera;
        let arbiter = self.arbiter(now).filter(|_| !is_replaced);
        let merged = arbiter.and_then(|arbiter| merge(arbiter, &emission, now.wall));
        let stamp = emission.stamp;
        self.ready.push_back(TrafficLightOutput::Publish(emission));
        self.publish_merged(merged, stamp);
    }

    fn publish_merged(&mut self, merged: Option<Groups>, stamp: WallStamp) {
        self.ready.extend(merged.map(|groups| {
            let (topic, content) = (LightsTopic::Arbiter, LightsContent::Groups(groups));
            TrafficLightOutput::Publish(Emission { topic, stamp, content })
        }));
    }
}

/// Returns the groups that the arbiter merges from a message; `None` if the message is not for the arbiter,
/// or causes no output.
fn merge(arbiter: &mut Arbiter, emission: &Emission, clock: WallStamp) -> Option<Groups> {
    let LightsContent::Groups(groups) = &emission.content else { return None };
    let stamp = ArbiterStamp(emission.stamp.as_nanos());
    match emission.topic {
        LightsTopic::Camera => Some(arbiter.perception(stamp, groups)),
        LightsTopic::V2i => arbiter.external(stamp, groups, ArbiterStamp(clock.as_nanos())),
        LightsTopic::GroundTruth | LightsTopic::Arbiter | LightsTopic::Markers | LightsTopic::Clock => None,
    }
}
