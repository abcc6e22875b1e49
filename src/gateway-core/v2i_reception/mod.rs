//! Traffic-light states sent by a V2X unit over CAN, validated like every received signal
//! (docs/spec/traffic-lights.md, "V2X unit on CAN").
//!
//! Valid states belong in the *ground truth* of the v2i channel: the network's reports are its ground truth,
//! and the detected store stays free for simulated reception errors. Ground truth cannot be "unknown". A
//! group that is not available, faulty, undefined, stale or cut off is therefore *removed*: an arbiter then
//! knows that the network does not report it, while a held state would present an old light as current.

pub mod binding;
pub mod catalogue;
pub mod movement_phase;
mod status;

use binding::{BoundGroup, CyclingMessage, V2iBinding, V2iSource, V2iStates};
use can_signal::can::{Bus, BusIndex, Frame, ReceiveTime};
use can_signal::validation::observation::{Interruption, Observation, Observations};
use can_signal::validation::table::{MessageIndex, Role, SignalIndex};
use can_signal::validation::unusable::Unusable;
use derive_more::From;
use gateway_base::time::{MonoTime, Now, WallStamp, deadline_after};
use traffic_lights::bulb::BulbSet;
use traffic_lights::engine::LightObservation;

/// A valid state of a group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ValidState {
    /// Bulbs of the group, at least one.
    pub bulbs: BulbSet,
    /// Confidence reported by the unit, 0 to 1.
    pub confidence: f64,
    /// Receive time and stamp of its frame.
    pub received: ReceiveTime,
}

impl From<ValidState> for LightObservation {
    fn from(ValidState { bulbs, confidence, .. }: ValidState) -> Self {
        Self { bulbs, confidence }
    }
}

/// Reason why a group has no valid state. Raw values follow their signals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, From)]
pub enum InvalidReason {
    /// A signal has no usable value.
    #[from]
    Signal(Unusable),
    /// The message is received, but has not carried this group since the start or since an interruption.
    NotReceived,
    /// The message is received, but has not carried this group for longer than its limit.
    NotReceivedAgain,
    /// A status signal reports that the states cannot be used.
    StatesUnusable(SignalIndex, i128),
}

impl InvalidReason {
    /// Returns whether the finding deserves a warning. Receiving nothing is normal away from an intersection;
    /// an undefined value, a fault and a silent unit are not.
    pub fn is_bad(self) -> bool {
        match self {
            Self::NotReceived | Self::NotReceivedAgain | Self::Signal(Unusable::NotAvailable(..)) => false,
            Self::Signal(_) | Self::StatesUnusable(..) => true,
        }
    }
}

/// Result of [`V2iReception::settle`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Settled {
    /// New states of the groups whose bulbs or confidence changed, by id, in the order of the profile; `None`
    /// removes a state.
    pub changes: Vec<(i64, Option<ValidState>)>,
    /// True if the diagnostics have changed.
    pub news: bool,
}

/// Counts of received states since the start.
#[derive(Debug, Clone, Copy, Default)]
struct V2iCounts {
    /// Number of valid frames whose group is not mapped by the profile.
    unmapped: u64,
    /// Number of times the state, status or confidence of a group became undefined.
    undefined: u64,
}

/// Receives the states of all bound groups.
#[derive(Debug, Clone)]
pub struct V2iReception {
    binding: V2iBinding,
    observations: Observations,
    groups: Vec<Tracked>,
    counts: V2iCounts,
}

#[derive(Debug, Clone)]
struct Tracked {
    /// Position of its source in the binding.
    source: usize,
    /// Position of the group within its source.
    own: usize,
    /// Its state in the last frame that carried it, if a cycling message does.
    last: Option<CyclingState>,
    /// Its state at the last call of `settle`; `None` before the first call.
    state: Option<State>,
}

type State = Result<ValidState, InvalidReason>;

/// State in one frame of a cycling message.
#[derive(Debug, Clone, Copy)]
struct CyclingState {
    state: State,
    at: MonoTime,
}

impl V2iReception {
    /// Creates the reception of a profile before any frame.
    pub fn new(binding: V2iBinding) -> Self {
        let groups = binding.sources.iter().enumerate().flat_map(|(source, bound)| {
            let count = match &bound.states {
                V2iStates::Single(_) => 1,
                V2iStates::Cycling(cycle) => cycle.groups.len(),
            };
            (0..count).map(move |own| Tracked { source, own, last: None, state: None })
        });
        let groups = groups.collect();
        let observations = Observations::new(&binding.table);
        Self { binding, observations, groups, counts: V2iCounts::default() }
    }

    /// Continues with another binding. Values received in its messages are kept; states from cycling messages
    /// are forgotten. Returns the ids of all states that were valid: remove them before [`Self::settle`]
    /// returns the new ones.
    pub fn reconfigure(&mut self, binding: V2iBinding) -> Vec<i64> {
        if self.binding == binding {
            return Vec::new();
        }
        let valid = self.valid_states().map(|(id, _)| id).collect();
        let observations = self.observations.carried_over(&self.binding.table, &binding.table);
        *self = Self { observations, counts: self.counts, ..Self::new(binding) };
        valid
    }

    /// Returns the binding of the profile.
    pub fn binding(&self) -> &V2iBinding {
        &self.binding
    }

    /// Handles a frame of a bound message; its bus must handle the frame first. Call [`Self::settle`]
    /// afterwards.
    pub fn frame_arrived(
        &mut self,
        message: MessageIndex,
        frame: &Frame,
        stamp: WallStamp,
        buses: &[Bus],
        now: Now,
    ) {
        let Self { binding, observations, groups, counts } = self;
        let cycles = || {
            let sources = binding.sources.iter().enumerate();
            sources.filter_map(|(index, source)| match &source.states {
                V2iStates::Cycling(cycle) if binding.message_of(cycle.group) == message => {
                    Some((index, source, cycle))
                }
                V2iStates::Cycling(_) | V2iStates::Single(_) => None,
            })
        };
        for (index, _, cycle) in cycles() {
            // A state from before an interruption of the message is not valid afterwards.
            let is_interrupted = cycle.groups.first().is_some_and(|(_, group)| {
                observations.valid(&binding.table, group.state.signal, buses, now.mono).is_err()
            });
            if is_interrupted {
                for group in of_source(groups, index) {
                    group.last = None;
                }
            }
        }
        if observations.frame_arrived(&binding.table, message, frame, stamp, now).is_err() {
            return;
        }
        for (index, source, cycle) in cycles() {
            let raw = |signal: SignalIndex| binding.table.signals[signal.0].codec.value(frame.padded());
            let key = (raw(cycle.intersection), raw(cycle.group));
            let Ok(own) = cycle.groups.binary_search_by_key(&key, |(key, _)| *key) else {
                counts.unmapped += 1;
                continue;
            };
            let received = ReceiveTime { at: now.mono, stamp };
            let (_, group) = &cycle.groups[own];
            let mut own_status =
                source.status.iter().filter(|role| binding.message_of(role.signal) == message);
            let status = own_status.try_for_each(|role| usable(role, raw(role.signal)));
            let state = status.and_then(|()| state_of(group, received, |signal| Ok(raw(signal))));
            of_source(groups, index)[own].last = Some(CyclingState { state, at: now.mono });
        }
    }

    /// Forgets the values that do not survive an interruption of a bus.
    pub fn forget(&mut self, bus: BusIndex, by: Interruption) {
        self.observations.forget(&self.binding.table, bus, by);
    }

    /// Evaluates the states of all groups now and returns the changes.
    pub fn settle(&mut self, buses: &[Bus], now: Now) -> Settled {
        let Self { binding, observations, groups, counts } = self;
        let mut settled = Settled::default();
        for tracked in groups {
            let Some((source, group)) = bound(binding, tracked) else { continue };
            let state = evaluate((binding, observations, buses, now.mono), source, group, tracked.last);
            let before = tracked.state.replace(state);
            let content = |state: State| state.ok().map(|state| (state.bulbs, state.confidence));
            if content(state) != before.and_then(content) {
                settled.changes.push((group.id, state.ok()));
            }
            settled.news |=
                before.is_none_or(|before| (content(before), before.err()) != (content(state), state.err()));
            let undefined =
                |state: State| matches!(state, Err(InvalidReason::Signal(Unusable::Undefined(..))));
            counts.undefined += u64::from(undefined(state) && !before.is_some_and(undefined));
        }
        settled
    }

    /// Returns the valid states at the last call of [`Self::settle`], by id, in the order of the profile.
    pub fn valid_states(&self) -> impl Iterator<Item = (i64, ValidState)> {
        self.states().filter_map(|(id, state)| Some((id, state.ok()?)))
    }

    /// Returns the states of all groups like [`Self::valid_states`], with the reasons of the others.
    fn states(&self) -> impl Iterator<Item = (i64, State)> {
        let state = |tracked: &Tracked| Some((bound(&self.binding, tracked)?.1.id, tracked.state?));
        self.groups.iter().filter_map(state)
    }

    /// Returns the next time to call [`Self::settle`] if nothing is received; `None` if only an input can
    /// change anything.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        let expiry = |tracked: &Tracked| match &self.binding.sources.get(tracked.source)?.states {
            V2iStates::Single(_) => None,
            V2iStates::Cycling(cycle) => Some(deadline_after(tracked.last?.at, cycle.timeout)),
        };
        let groups = self.groups.iter().filter_map(expiry).filter(|at| *at > now);
        groups.chain(self.observations.next_deadline(&self.binding.table, now)).min()
    }
}

fn of_source(groups: &mut [Tracked], source: usize) -> &mut [Tracked] {
    let first = groups.partition_point(|group| group.source < source);
    let behind = groups.partition_point(|group| group.source <= source);
    &mut groups[first..behind]
}

fn bound<'a>(binding: &'a V2iBinding, tracked: &Tracked) -> Option<(&'a V2iSource, &'a BoundGroup)> {
    let source = binding.sources.get(tracked.source)?;
    let group = match &source.states {
        V2iStates::Single(group) => Some(group),
        V2iStates::Cycling(CyclingMessage { groups, .. }) => groups.get(tracked.own).map(|(_, group)| group),
    };
    Some((source, group?))
}

type Context<'a> = (&'a V2iBinding, &'a Observations, &'a [Bus], MonoTime);

/// Returns the current state of a group. `last` is its state in a cycling message.
fn evaluate(
    context: Context<'_>,
    source: &V2iSource,
    group: &BoundGroup,
    last: Option<CyclingState>,
) -> State {
    let (binding, _, _, now) = context;
    let cycle = match &source.states {
        V2iStates::Single(_) => None,
        V2iStates::Cycling(cycle) => Some(cycle),
    };
    for role in &source.status {
        // A status signal of the cycling message was evaluated with its frame.
        if cycle.is_some_and(|cycle| binding.message_of(cycle.group) == binding.message_of(role.signal)) {
            continue;
        }
        usable(role, last_observation(context, role.signal)?.raw)?;
    }
    let newest = last_observation(context, group.state.signal)?;
    match (cycle, last) {
        (Some(_), None) => Err(InvalidReason::NotReceived),
        (Some(cycle), Some(last)) if now.since(last.at) > cycle.timeout => {
            Err(InvalidReason::NotReceivedAgain)
        }
        (Some(_), Some(last)) => last.state,
        (None, _) => state_of(group, newest.received, |signal| Ok(last_observation(context, signal)?.raw)),
    }
}

fn last_observation(
    (binding, observations, buses, now): Context<'_>,
    signal: SignalIndex,
) -> Result<Observation, InvalidReason> {
    let last = observations.valid(&binding.table, signal, buses, now);
    last.map_err(|reason| Unusable::Absent(signal, reason).into())
}

/// Checks that a status signal with this value permits the use of the states.
fn usable(role: &Role<bool>, raw: i128) -> Result<(), InvalidReason> {
    if role.defined(raw)? { Ok(()) } else { Err(InvalidReason::StatesUnusable(role.signal, raw)) }
}

/// Returns the state of a group by the values of its signals.
fn state_of(
    group: &BoundGroup,
    received: ReceiveTime,
    raw: impl Fn(SignalIndex) -> Result<i128, InvalidReason>,
) -> State {
    let bulbs = group.state.defined(raw(group.state.signal)?)?;
    let confidence = match &group.confidence {
        None => 1.0,
        Some(confidence) => {
            let signal = confidence.role.signal;
            let raw = raw(signal)?;
            confidence.of(raw).ok_or(Unusable::Undefined(signal, raw))?
        }
    };
    Ok(ValidState { bulbs, confidence, received })
}
