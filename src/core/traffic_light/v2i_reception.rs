//! Traffic-light states that a V2X unit sends over CAN, judged like every received signal: what is
//! believed of each group now, and what no longer holds (docs/spec/traffic-lights.md, "V2X unit on CAN").
//!
//! What is known belongs in the *ground truth* of the v2i channel: ground truth of a network is what
//! the network reports, and the detected store stays free for imitating errors of the reception.
//! Ground truth cannot be "unknown". So a group that is not available, faulty, undefined, stale or cut
//! off is *removed* instead: an arbiter takes a missing group for one that the network does not report
//! of, which is the case, while a held one would be an old light shown as a present one.

pub mod binding;
mod finding;
pub mod movement_phase;

use crate::core::can::bus::{Bus, Received};
use crate::core::can::frame::Frame;
use crate::core::can::link::BusIndex;
use crate::core::time::{MonoTime, Now, WallStamp, deadline_after};
use crate::core::traffic_light::bulb::BulbSet;
use crate::core::validation::meaning::Meaning;
use crate::core::validation::observation::{MissingReason, Observation, Observations};
use crate::core::validation::table::{MessageIndex, Role, SignalIndex};
use binding::{Cycle, Group, V2iBinding, V2iSource, V2iStates};

pub use finding::{GroupFinding, TASK_NAME};

/// A state that is believed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ValidState {
    /// At least one bulb.
    pub bulbs: BulbSet,
    /// 0 to 1.
    pub confidence: f64,
    /// When its frame came.
    pub received: Received,
}

/// Why no state of a group is believed. Raw values go with their signals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InvalidReason {
    /// No believable value of this signal.
    Absent(SignalIndex, MissingReason),
    /// The message is received, but without this group since start or since it broke off.
    NotReceived,
    /// The message is received, but without this group for longer than its limit.
    NotReceivedAgain,
    /// A status signal reports that the states cannot be used.
    Unusable(SignalIndex, i128),
    /// The unit reports that it does not know.
    NotAvailable(SignalIndex, i128),
    /// The unit reports a fault.
    Fault(SignalIndex, i128),
    /// The profile gives this value no meaning.
    Undefined(SignalIndex, i128),
}

/// What to do with one entry of the store.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// Relation id of a group, or way id of a head.
    pub id: i64,
    /// Put this there; `None` = remove what is there.
    pub state: Option<ValidState>,
}

/// What came of a call of [`V2iReception::settle`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Settled {
    /// In the order of the profile; an entry whose bulbs and confidence stay the same is not in it.
    pub changes: Vec<Change>,
    /// Whether the diagnostics have changed.
    pub news: bool,
}

/// Counts since start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct V2iCounts {
    /// Trusted frames with a group that the profile does not map.
    pub unmapped: u64,
    /// Times a group's state, status or confidence became a value without meaning.
    pub undefined: u64,
}

/// Receives the states of all bound groups.
#[derive(Debug, Clone)]
pub struct V2iReception {
    binding: V2iBinding,
    observations: Observations,
    /// Every group of every source, in the order of the profile.
    groups: Vec<Tracked>,
    counts: V2iCounts,
}

/// One group with what is known of it.
#[derive(Debug, Clone)]
struct Tracked {
    /// Its source, by position, and its own position there.
    at: (usize, usize),
    /// The last state that a cycling message carried.
    last: Option<LastJudgement>,
    /// What was judged last; `None` before the first time.
    judged: Option<Judged>,
}

type Judged = Result<ValidState, InvalidReason>;

/// The state in one frame of a cycling message.
#[derive(Debug, Clone, Copy)]
struct LastJudgement {
    state: Judged,
    at: MonoTime,
}

impl V2iReception {
    /// Nothing was received yet.
    pub fn new(binding: V2iBinding) -> Self {
        let groups = binding.sources.iter().enumerate().flat_map(|(source, bound)| {
            let count = match &bound.states {
                V2iStates::Single(_) => 1,
                V2iStates::Cycling(cycle) => cycle.groups.len(),
            };
            (0..count).map(move |own| Tracked { at: (source, own), last: None, judged: None })
        });
        let groups = groups.collect();
        Self {
            observations: Observations::new(&binding.table),
            binding,
            groups,
            counts: V2iCounts::default(),
        }
    }

    /// What the profile binds.
    pub fn binding(&self) -> &V2iBinding {
        &self.binding
    }

    /// The last values.
    pub fn observations(&self) -> &Observations {
        &self.observations
    }

    /// Counts since start.
    pub fn counts(&self) -> V2iCounts {
        self.counts
    }

    /// Takes a frame of a bound message, after its bus has. Call [`Self::settle`] afterwards.
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
            // A state from before a message broke off does not come back with it.
            let broke_off = cycle.groups.first().is_some_and(|(_, group)| {
                observations.valid(&binding.table, group.state.signal, buses, now.mono).is_err()
            });
            if broke_off {
                for group in of_source(groups, index) {
                    group.last = None;
                }
            }
        }
        if !observations.frame_arrived(&binding.table, message, frame, stamp, now) {
            return;
        }
        for (index, source, cycle) in cycles() {
            let raw = |signal: SignalIndex| binding.table.signals[signal.0].codec.value(frame.padded());
            let key = (raw(cycle.intersection), raw(cycle.group));
            let Ok(own) = cycle.groups.binary_search_by_key(&key, |(key, _)| *key) else {
                counts.unmapped += 1;
                continue;
            };
            let received = Received { at: now.mono, stamp };
            let (_, group) = &cycle.groups[own];
            let mut own_status =
                source.status.iter().filter(|role| binding.message_of(role.signal) == message);
            let status = own_status.try_for_each(|role| usable(role, raw(role.signal)));
            let state = status.and_then(|()| believe(group, received, |signal| Ok(raw(signal))));
            of_source(groups, index)[own].last = Some(LastJudgement { state, at: now.mono });
        }
    }

    /// Forgets what came over a bus. Call [`Self::settle`] afterwards.
    pub fn forget_bus(&mut self, bus: BusIndex) {
        self.observations.forget_bus(&self.binding.table, bus);
    }

    /// Forgets the event messages of a bus that was silent. Call [`Self::settle`] afterwards.
    pub fn forget_events(&mut self, bus: BusIndex) {
        self.observations.forget_events(&self.binding.table, bus);
    }

    /// Judges all groups now and returns the changes.
    pub fn settle(&mut self, buses: &[Bus], now: Now) -> Settled {
        let Self { binding, observations, groups, counts } = self;
        let mut settled = Settled::default();
        for tracked in groups {
            let Some((source, group)) = bound(binding, tracked.at) else { continue };
            let judged = judge((binding, observations, buses, now.mono), source, group, tracked.last);
            let before = tracked.judged.replace(judged);
            let content = |judged: Judged| judged.ok().map(|state| (state.bulbs, state.confidence));
            if content(judged) != before.and_then(content) {
                settled.changes.push(Change { id: group.id, state: judged.ok() });
            }
            settled.news |= before
                .is_none_or(|before| (content(before), before.err()) != (content(judged), judged.err()));
            let undefined = |judged: Judged| matches!(judged, Err(InvalidReason::Undefined(..)));
            counts.undefined += u64::from(undefined(judged) && !before.is_some_and(undefined));
        }
        settled
    }

    /// What was believed of each group when all was settled last, in the order of the profile, with the
    /// times of the newest frames.
    pub fn valid_states(&self) -> impl Iterator<Item = (i64, ValidState)> {
        self.groups.iter().filter_map(|tracked| {
            let (_, group) = bound(&self.binding, tracked.at)?;
            Some((group.id, tracked.judged?.ok()?))
        })
    }

    /// When to call [`Self::settle`] with nothing happening.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        let over_at = |tracked: &Tracked| {
            let V2iStates::Cycling(cycle) = &self.binding.sources.get(tracked.at.0)?.states else {
                return None;
            };
            Some(deadline_after(tracked.last?.at, cycle.timeout))
        };
        let groups = self.groups.iter().filter_map(over_at).filter(|at| *at > now);
        groups.chain(self.observations.next_deadline(&self.binding.table, now)).min()
    }
}

/// The groups of a source.
fn of_source(groups: &mut [Tracked], source: usize) -> &mut [Tracked] {
    let first = groups.partition_point(|group| group.at.0 < source);
    let behind = groups.partition_point(|group| group.at.0 <= source);
    &mut groups[first..behind]
}

fn bound(binding: &V2iBinding, (source, own): (usize, usize)) -> Option<(&V2iSource, &Group)> {
    let source = binding.sources.get(source)?;
    let group = match &source.states {
        V2iStates::Single(group) => Some(group),
        V2iStates::Cycling(Cycle { groups, .. }) => groups.get(own).map(|(_, group)| group),
    };
    Some((source, group?))
}

/// Binding, last values, buses and time.
type View<'a> = (&'a V2iBinding, &'a Observations, &'a [Bus], MonoTime);

fn judge(view: View<'_>, source: &V2iSource, group: &Group, last: Option<LastJudgement>) -> Judged {
    let (binding, _, _, now) = view;
    let cycle = match &source.states {
        V2iStates::Single(_) => None,
        V2iStates::Cycling(cycle) => Some(cycle),
    };
    for role in &source.status {
        // The integrity of a cycling message's frame was judged with the frame.
        if cycle.is_some_and(|cycle| binding.message_of(cycle.group) == binding.message_of(role.signal)) {
            continue;
        }
        usable(role, last_observation(view, role.signal)?.raw)?;
    }
    let newest = last_observation(view, group.state.signal)?;
    match (cycle, last) {
        (Some(_), None) => Err(InvalidReason::NotReceived),
        (Some(cycle), Some(last)) if now.since(last.at) > cycle.timeout => {
            Err(InvalidReason::NotReceivedAgain)
        }
        (Some(_), Some(last)) => last.state,
        (None, _) => believe(group, newest.received, |signal| Ok(last_observation(view, signal)?.raw)),
    }
}

/// The last value of a signal, when it may be believed.
fn last_observation(
    (binding, observations, buses, now): View<'_>,
    signal: SignalIndex,
) -> Result<Observation, InvalidReason> {
    observations.valid(&binding.table, signal, buses, now).map_err(|why| InvalidReason::Absent(signal, why))
}

/// Whether a status signal with this value lets the states be used.
fn usable(role: &Role<bool>, raw: i128) -> Result<(), InvalidReason> {
    if defined(role, raw)? { Ok(()) } else { Err(InvalidReason::Unusable(role.signal, raw)) }
}

fn defined<T: Copy>(role: &Role<T>, raw: i128) -> Result<T, InvalidReason> {
    match role.values.meaning(raw) {
        Meaning::Defined(value) => Ok(value),
        Meaning::NotAvailable => Err(InvalidReason::NotAvailable(role.signal, raw)),
        Meaning::Fault => Err(InvalidReason::Fault(role.signal, raw)),
        Meaning::Undefined => Err(InvalidReason::Undefined(role.signal, raw)),
    }
}

/// What the values of a group's signals come to.
fn believe(
    group: &Group,
    received: Received,
    raw: impl Fn(SignalIndex) -> Result<i128, InvalidReason>,
) -> Judged {
    let bulbs = defined(&group.state, raw(group.state.signal)?)?;
    let confidence = match &group.confidence {
        None => 1.0,
        Some(confidence) => {
            let signal = confidence.role.signal;
            let raw = raw(signal)?;
            confidence.of(raw).ok_or(InvalidReason::Undefined(signal, raw))?
        }
    };
    Ok(ValidState { bulbs, confidence, received })
}
