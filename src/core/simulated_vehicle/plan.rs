//! Which messages the vehicle sends, in what rhythm, and what their signals are about: the vehicle
//! profile, read from the sender's side.

use std::time::Duration;

use super::encoder::{SignalContent, SignalEncoder, sides_named};
use crate::core::can::bus::BusSettings;
use crate::core::can::frame::{CanId, Frame, MAX_DATA};
use crate::core::can::link::BusIndex;
use crate::core::command::settings::CommandBinding;
use crate::core::dbc::codec::SignalCodec;
use crate::core::dbc::model::Database;
use crate::core::validation::integrity::Protection;
use crate::core::validation::table::{FaultSignal, Role, SignalIndex, SignalTable, Timing};
use crate::core::vehicle_lights::binding::{
    HazardBinding, HazardSource, LightsBinding, TurnBinding, TurnSource,
};
use crate::core::vehicle_lights::stalk::{OppositePress, RepeatedPress, StalkSettings};

/// Slowest rhythm of a message that shows lamps, and of one whose period nobody knows.
const MAX_PERIOD: Duration = Duration::from_millis(100);
const MIN_PERIOD: Duration = Duration::from_millis(10);

/// What the vehicle sends and what it listens to.
#[derive(Debug, Clone)]
pub struct VehiclePlan {
    pub(super) messages: Vec<PlannedMessage>,
    pub(super) command: CommandBinding,
    /// How a momentary stalk is told to end what is on, where there is one.
    pub(super) ending: Option<Ending>,
}

/// Why a profile cannot be played.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PlanError {
    /// A profile without a vehicle.
    #[error("the profile binds no message that a vehicle sends: there is nothing to simulate")]
    Nothing,
    /// A message that no frame can carry.
    #[error("{0}: no frame can carry it, so it cannot be simulated")]
    Unsendable(String),
}

/// A message the vehicle sends.
#[derive(Debug, Clone)]
pub(super) struct PlannedMessage {
    pub(super) name: String,
    pub(super) bus: BusIndex,
    pub(super) id: CanId,
    pub(super) length: usize,
    /// From frame to frame while nothing changes; none = only on a change.
    pub(super) period: Option<Duration>,
    /// Whether a change is sent at once.
    pub(super) on_change: bool,
    pub(super) protection: Option<Protection>,
    /// What goes out each time: one frame, or one for each value of its multiplexors.
    pub(super) pages: Vec<Page>,
}

/// Signals that one frame carries together.
#[derive(Debug, Clone)]
pub(super) struct Page {
    /// The multiplexors, set for this page.
    pub(super) background: [u8; MAX_DATA],
    pub(super) encoders: Vec<SignalEncoder>,
}

/// What a hand does to end what a momentary stalk has switched on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ending {
    /// A tap to the other side.
    OppositeHalf,
    /// The same press again.
    SameAgain,
    /// A full press to the other side.
    OppositeFull,
}

impl VehiclePlan {
    /// Reads a profile. `buses` and `databases` are in the order that bus indices count.
    pub fn new(
        lights: &LightsBinding,
        command: &CommandBinding,
        buses: &[BusSettings],
        databases: &[&Database],
    ) -> Result<Self, PlanError> {
        let mut draft = Draft { messages: Vec::new(), databases };
        draft.lights(lights)?;
        draft.command(command)?;
        draft.signs_of_life(buses)?;
        if draft.messages.is_empty() {
            return Err(PlanError::Nothing);
        }
        Ok(Self { messages: draft.messages, command: command.clone(), ending: ending(&lights.turn) })
    }

    /// The identifiers that matter to the vehicle on a bus: the commands.
    pub fn command_ids(&self, bus: BusIndex) -> Vec<CanId> {
        let entries = self.command.allowed.entries().iter();
        entries.filter(|(there, _)| *there == bus).map(|(_, id)| *id).collect()
    }

    /// Names of the messages it sends, in their order.
    pub fn sends(&self) -> impl Iterator<Item = &str> {
        self.messages.iter().map(|message| message.name.as_str())
    }

    /// Names of the messages it obeys.
    pub fn follows_commands(&self) -> impl Iterator<Item = &str> {
        self.command.messages.iter().map(|message| message.name.as_str())
    }
}

struct Draft<'a> {
    messages: Vec<PlannedMessage>,
    databases: &'a [&'a Database],
}

impl Draft<'_> {
    fn lights(&mut self, lights: &LightsBinding) -> Result<(), PlanError> {
        let table = &lights.table;
        if let TurnBinding::From(sources) = &lights.turn {
            for named in &sources.list {
                self.turn(table, &named.source)?;
            }
        }
        if let HazardBinding::From(sources) = &lights.hazard {
            for named in &sources.list {
                match &named.source {
                    HazardSource::BothSides => {}
                    HazardSource::Signal { role, .. } => self.say(table, role, SignalContent::Hazard)?,
                    HazardSource::Button { role, .. } => self.say(table, role, SignalContent::Button)?,
                }
            }
        }
        for fault in lights.turn_faults.signals.iter().chain(&lights.hazard_faults.signals) {
            self.fault(table, fault)?;
        }
        Ok(())
    }

    fn turn(&mut self, table: &SignalTable, source: &TurnSource) -> Result<(), PlanError> {
        match source {
            TurnSource::Enumerated(role) => self.say(table, role, SignalContent::Turn),
            TurnSource::Pair(pair) => {
                [(true, &pair.left), (false, &pair.right)].into_iter().try_for_each(|(is_left, role)| {
                    self.say(table, role, |values| SignalContent::Side { is_left, both: pair.both, values })
                })
            }
            TurnSource::Lamps { pair, settings, .. } => {
                for (is_left, role) in [(true, &pair.left), (false, &pair.right)] {
                    self.say(table, role, |values| SignalContent::Lamp { is_left, values })?;
                    self.shows_lamps(table, role.signal, settings.lit_until_changed);
                }
                Ok(())
            }
            TurnSource::Stalk { role, .. } => self.say(table, role, SignalContent::Stalk),
        }
    }

    fn command(&mut self, command: &CommandBinding) -> Result<(), PlanError> {
        if let Some(role) = &command.control_mode {
            self.say(&command.table, role, SignalContent::Mode)?;
        }
        command.driver.iter().try_for_each(|sign| {
            self.say(&command.table, &sign.role, |values| SignalContent::Driver {
                overrides: sign.overrides,
                values,
            })
        })
    }

    fn fault(&mut self, table: &SignalTable, fault: &FaultSignal) -> Result<(), PlanError> {
        let name = table.signals.get(fault.role.signal.0).map_or("", |signal| signal.name.as_str());
        let of = sides_named(&format!("{name} {}", fault.text));
        self.say(table, &fault.role, |values| SignalContent::Fault { of, values })
    }

    /// Messages that prove a bus alive are sent with all bits zero.
    fn signs_of_life(&mut self, buses: &[BusSettings]) -> Result<(), PlanError> {
        for (index, bus) in (0..=u8::MAX).map(BusIndex).zip(buses) {
            for id in &bus.heartbeat_messages {
                let at = self.message(
                    index,
                    *id,
                    &format!("{id}"),
                    Timing::Cyclic { timeout: bus.alive_timeout },
                    None,
                )?;
                if let Some(message) = self.messages.get_mut(at).filter(|message| message.pages.is_empty()) {
                    message.pages.push(Page { background: [0; MAX_DATA], encoders: Vec::new() });
                }
            }
        }
        Ok(())
    }

    fn say<T: Copy>(
        &mut self,
        table: &SignalTable,
        role: &Role<T>,
        content: impl FnOnce(crate::core::validation::meaning::ValueMap<T>) -> SignalContent,
    ) -> Result<(), PlanError> {
        let Some(signal) = table.signals.get(role.signal.0) else { return Ok(()) };
        let Some(bound) = table.messages.get(signal.message.0) else { return Ok(()) };
        let protection = bound.integrity.as_ref().map(|integrity| &integrity.protection);
        let at = self.message(bound.bus, bound.id, &bound.name, bound.timing, protection)?;
        if let Some(message) = self.messages.get_mut(at) {
            message.encoder(&signal.codec)?.add(content(role.values.clone()));
        }
        Ok(())
    }

    /// Lamps need frames often enough, or at each of their changes.
    fn shows_lamps(&mut self, table: &SignalTable, signal: SignalIndex, on_change: bool) {
        let bound = table.signals.get(signal.0).and_then(|signal| table.messages.get(signal.message.0));
        let message = bound.and_then(|bound| {
            self.messages.iter_mut().find(|message| (message.bus, message.id) == (bound.bus, bound.id))
        });
        if let Some(message) = message {
            message.on_change |= on_change;
            message.period = message.period.map(|period| period.min(MAX_PERIOD));
        }
    }

    /// Where the message is, made if it is not there yet.
    fn message(
        &mut self,
        bus: BusIndex,
        id: CanId,
        name: &str,
        timing: Timing,
        protection: Option<&Protection>,
    ) -> Result<usize, PlanError> {
        let same = |message: &PlannedMessage| (message.bus, message.id) == (bus, id);
        if let Some(at) = self.messages.iter().position(same) {
            return Ok(at);
        }
        let database = self.databases.get(usize::from(bus.0));
        let described =
            database.and_then(|database| database.messages.iter().find(|message| message.id == id));
        let unsendable = || PlanError::Unsendable(name.to_owned());
        let described = described.ok_or_else(unsendable)?;
        let length = described.length;
        let sample = [0; MAX_DATA];
        let cycle = described.cycle_ms.map(|ms| Duration::from_millis(ms.into()));
        self.messages.push(PlannedMessage {
            name: described.name.clone(),
            bus,
            id,
            length,
            period: period(timing, cycle),
            on_change: timing.is_event(),
            protection: protection.cloned(),
            pages: Vec::new(),
        });
        sample.get(..length).and_then(|data| Frame::with_room(id, data)).ok_or_else(unsendable)?;
        Ok(self.messages.len() - 1)
    }
}

impl PlannedMessage {
    /// The signal, in the page that its multiplexors choose.
    fn encoder(&mut self, codec: &SignalCodec) -> Result<&mut SignalEncoder, PlanError> {
        let mut background = [0; MAX_DATA];
        codec.select(&mut background).map_err(|_| PlanError::Unsendable(self.name.clone()))?;
        let at = self.pages.iter().position(|page| page.background == background);
        let at = at.unwrap_or_else(|| {
            self.pages.push(Page { background, encoders: Vec::new() });
            self.pages.len() - 1
        });
        let encoders = &mut self.pages[at].encoders;
        let known = encoders.iter().position(|encoder| encoder.codec == *codec);
        let known = known.unwrap_or_else(|| {
            encoders.push(SignalEncoder::new(codec.clone()));
            encoders.len() - 1
        });
        Ok(&mut encoders[known])
    }
}

/// The DBC's rhythm, if it keeps the message alive with something to spare; else one that does.
fn period(timing: Timing, cycle: Option<Duration>) -> Option<Duration> {
    let timeout = timing.timeout()?;
    let known = cycle.filter(|cycle| *cycle >= MIN_PERIOD && *cycle <= timeout / 3);
    let slowest = match timing {
        Timing::Cyclic { .. } => MAX_PERIOD,
        Timing::Event | Timing::EventCyclic { .. } => Duration::from_secs(1),
    };
    Some(known.unwrap_or_else(|| (timeout / 5).clamp(MIN_PERIOD, slowest)))
}

/// How the first momentary stalk is ended.
fn ending(turn: &TurnBinding) -> Option<Ending> {
    let TurnBinding::From(sources) = turn else { return None };
    let settings = sources.list.iter().find_map(|named| match &named.source {
        TurnSource::Stalk { settings, .. } => Some(settings),
        TurnSource::Enumerated(_) | TurnSource::Pair(_) | TurnSource::Lamps { .. } => None,
    });
    settings.map(|settings: &StalkSettings| {
        if settings.opposite_half == OppositePress::Cancels {
            Ending::OppositeHalf
        } else if settings.repeat == RepeatedPress::Cancels {
            Ending::SameAgain
        } else {
            Ending::OppositeFull
        }
    })
}
