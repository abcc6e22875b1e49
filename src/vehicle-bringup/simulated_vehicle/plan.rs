//! Messages that the vehicle sends, with their periods and the contents of their signals: the vehicle
//! profile from the sender's side.

use std::time::Duration;

use super::encoder::{ReportedSubject, SignalContent, SignalEncoder, SignalValue};
use super::motion::Dimensions;
use can_signal::can::{BusIndex, BusSettings, CanId, Frame, FrameFormat, IdMatch, MAX_DATA};
use can_signal::dbc::codec::SignalCodec;
use can_signal::dbc::model::Database;
use can_signal::validation::integrity::Protection;
use can_signal::validation::table::{Role, SignalIndex, SignalTable, Timing};
use gateway_core::command::settings::CommandBinding;
use gateway_core::vehicle_lights::binding::{HazardSource, LightsBinding, TurnBinding, TurnSource};
use gateway_core::vehicle_lights::stalk::{OppositePress, RepeatedPress};
use gateway_core::vehicle_lights::state::HazardCode;
use gateway_core::vehicle_status::binding::StatusBinding;
use gateway_core::vehicle_status::settings::VehicleGeometry;

/// Maximum period of a message that shows lamps, and of a message with an unknown period.
const MAX_PERIOD: Duration = Duration::from_millis(100);
const MIN_PERIOD: Duration = Duration::from_millis(10);

/// Messages that the vehicle sends and commands that it receives.
#[derive(Debug, Clone)]
pub struct VehiclePlan {
    pub(super) messages: Vec<PlannedMessage>,
    pub(super) command: CommandBinding,
    /// Press that ends a request of the momentary stalk; `None` without one.
    pub(super) ending: Option<CancelPress>,
    pub(super) dimensions: Dimensions,
    /// Names of the doors in the order of the profile.
    pub(super) doors: Vec<String>,
}

/// Reason why a profile cannot be simulated.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)] // the texts say it
pub enum PlanError {
    #[error("the profile binds no message that a vehicle sends: there is nothing to simulate")]
    Nothing,
    #[error("{0}: no frame can carry it, so it cannot be simulated")]
    Unsendable(String),
}

#[derive(Debug, Clone)]
pub(super) struct PlannedMessage {
    pub(super) name: String,
    pub(super) bus: BusIndex,
    pub(super) id: CanId,
    pub(super) length: usize,
    pub(super) format: Option<FrameFormat>,
    /// Period in the DBC; `None` if it has none.
    cycle: Option<Duration>,
    /// Time between two frames without a change; `None` if sent on change only.
    pub(super) period: Option<Duration>,
    /// True if a change is sent immediately.
    pub(super) on_change: bool,
    pub(super) protection: Option<Protection>,
    /// Frames sent each time: one, or one for each value of the multiplexors.
    pub(super) pages: Vec<Page>,
}

/// Signals that one frame carries together.
#[derive(Debug, Clone)]
pub(super) struct Page {
    /// Data with the multiplexors set for this page.
    pub(super) background: [u8; MAX_DATA],
    pub(super) encoders: Vec<SignalEncoder>,
}

/// Press of a momentary stalk that ends its request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CancelPress {
    /// A tap to the other side.
    OppositeHalf,
    /// The same press again.
    SameAgain,
    /// A full press to the other side.
    OppositeFull,
}

impl VehiclePlan {
    /// Builds the plan of a profile, for a vehicle with the configured dimensions. `buses` and `databases`
    /// are indexed by [`BusIndex`].
    pub fn new(
        lights: &LightsBinding,
        (status, geometry): (&StatusBinding, &VehicleGeometry),
        command: &CommandBinding,
        buses: &[BusSettings],
        databases: &[&Database],
    ) -> Result<Self, PlanError> {
        let mut draft = Draft { messages: Vec::new(), databases };
        let dimensions = Dimensions::from(geometry);
        draft.lights(lights)?;
        draft.status(status, &dimensions)?;
        for driver in &command.driver {
            let subject = ReportedSubject::Driver { overrides: driver.overrides };
            draft.add(&command.table, &driver.role, subject, SignalValue::On)?;
        }
        draft.heartbeats(buses)?;
        if draft.messages.is_empty() {
            return Err(PlanError::Nothing);
        }
        Ok(Self {
            messages: draft.messages,
            command: command.clone(),
            ending: ending(&lights.turn),
            dimensions,
            doors: status.doors.iter().map(|door| door.name.clone()).collect(),
        })
    }

    /// Returns the identifiers of the commands on a bus.
    pub fn command_ids(&self, bus: BusIndex) -> Vec<IdMatch> {
        let entries = self.command.allowed.entries().iter();
        entries.filter(|(of, _)| *of == bus).map(|(_, id)| (*id).into()).collect()
    }

    /// Returns the names of the messages that the vehicle sends.
    pub fn sends(&self) -> impl Iterator<Item = &str> {
        self.messages.iter().map(|message| message.name.as_str())
    }

    /// Returns the names of the command messages that the vehicle obeys.
    pub fn follows_commands(&self) -> impl Iterator<Item = &str> {
        self.command.messages.iter().map(|message| message.name.as_str())
    }
}

pub(super) struct Draft<'a> {
    messages: Vec<PlannedMessage>,
    databases: &'a [&'a Database],
}

impl Draft<'_> {
    fn lights(&mut self, lights: &LightsBinding) -> Result<(), PlanError> {
        let table = &lights.table;
        for named in lights.turn.sources() {
            self.turn(table, &named.source)?;
            self.condition(table, named.condition.as_ref())?;
        }
        for named in lights.hazard.sources() {
            self.condition(table, named.condition.as_ref())?;
            match &named.source {
                HazardSource::BothSides => {}
                HazardSource::Signal { role, .. } => {
                    let on = |code: HazardCode| SignalValue::On(code.active);
                    self.add(table, role, ReportedSubject::Hazard, on)?;
                }
                HazardSource::Button { role, .. } => {
                    self.add(table, role, ReportedSubject::Button, SignalValue::On)?;
                }
            }
        }
        for fault in lights.turn_faults.signals.iter().chain(&lights.hazard_faults.signals) {
            self.add(table, &fault.role, ReportedSubject::Fault { sides: fault.sides }, SignalValue::On)?;
        }
        Ok(())
    }

    fn turn(&mut self, table: &SignalTable, source: &TurnSource) -> Result<(), PlanError> {
        match source {
            TurnSource::Enumerated { role, .. } => {
                self.add(table, role, ReportedSubject::Turn, SignalValue::Turn)
            }
            TurnSource::Pair { pair, .. } => {
                for (is_left, role) in [(true, &pair.left), (false, &pair.right)] {
                    let subject = ReportedSubject::Side { is_left, both: pair.both };
                    self.add(table, role, subject, SignalValue::On)?;
                }
                Ok(())
            }
            TurnSource::Lamps { pair, settings, .. } => {
                for (is_left, role) in [(true, &pair.left), (false, &pair.right)] {
                    self.add(table, role, ReportedSubject::Lamp { is_left }, SignalValue::On)?;
                    self.shows_lamps(table, role.signal, settings.lit_until_changed);
                }
                Ok(())
            }
            TurnSource::Stalk { role, .. } => {
                self.add(table, role, ReportedSubject::Stalk, SignalValue::Stalk)
            }
        }
    }

    /// Adds the condition of a source. If sources exclude each other, the first of them applies.
    fn condition(&mut self, table: &SignalTable, condition: Option<&Role<bool>>) -> Result<(), PlanError> {
        condition.map_or(Ok(()), |role| self.add(table, role, ReportedSubject::Condition, SignalValue::On))
    }

    /// Adds the heartbeat messages, which are sent with all bits zero.
    fn heartbeats(&mut self, buses: &[BusSettings]) -> Result<(), PlanError> {
        for (index, bus) in (0..=u8::MAX).map(BusIndex).zip(buses) {
            for ids in &bus.heartbeat_messages {
                let timing = Timing::Cyclic { timeout: bus.alive_timeout };
                let at = self.message(index, ids.described(), &ids.to_string(), timing, None)?;
                if let Some(message) = self.messages.get_mut(at).filter(|message| message.pages.is_empty()) {
                    message.pages.push(Page { background: [0; MAX_DATA], encoders: Vec::new() });
                }
            }
        }
        Ok(())
    }

    /// Adds a subject to the signal of a role, whose values `value` converts.
    pub(super) fn add<T: Copy>(
        &mut self,
        table: &SignalTable,
        role: &Role<T>,
        subject: ReportedSubject,
        value: impl Fn(T) -> SignalValue,
    ) -> Result<(), PlanError> {
        let values = role.values.map(value);
        self.encoder(table, role.signal)?.add(SignalContent { subject, values });
        Ok(())
    }

    /// Returns the encoder of a signal, and plans its message if necessary.
    pub(super) fn encoder(
        &mut self,
        table: &SignalTable,
        signal: SignalIndex,
    ) -> Result<&mut SignalEncoder, PlanError> {
        let signal = &table.signals[signal.0];
        let bound = &table.messages[signal.message.0];
        let protection = bound.integrity.as_ref().map(|integrity| &integrity.protection);
        let at = self.message(bound.bus, bound.ids.described(), &bound.name, bound.timing, protection)?;
        self.messages[at].encoder(&signal.codec)
    }

    /// Makes the message of a lamp signal frequent enough for flashes, or sent on change.
    fn shows_lamps(&mut self, table: &SignalTable, signal: SignalIndex, on_change: bool) {
        let bound = &table.messages[table.signals[signal.0].message.0];
        if let Some(at) = self.position(bound.bus, bound.ids.described()) {
            let message = &mut self.messages[at];
            message.on_change |= on_change;
            message.period = message.period.map(|period| period.min(MAX_PERIOD));
        }
    }

    fn position(&self, bus: BusIndex, id: CanId) -> Option<usize> {
        self.messages.iter().position(|message| (message.bus, message.id) == (bus, id))
    }

    /// Returns the position of a message, and plans it if necessary.
    fn message(
        &mut self,
        bus: BusIndex,
        id: CanId,
        name: &str,
        timing: Timing,
        protection: Option<&Protection>,
    ) -> Result<usize, PlanError> {
        if let Some(at) = self.position(bus, id) {
            let message = &mut self.messages[at];
            // Another flow may need a shorter period.
            let needed = period(timing, message.cycle);
            message.period = message.period.into_iter().chain(needed).min();
            message.on_change |= timing.is_event();
            return Ok(at);
        }
        let database = self.databases.get(usize::from(bus.0));
        let described =
            database.and_then(|database| database.messages.iter().find(|message| message.id == id));
        let described = described.ok_or_else(|| PlanError::Unsendable(name.to_owned()))?;
        let (length, format) = (described.length, described.format);
        let sample = [0; MAX_DATA].get(..length).and_then(|data| Frame::with_format(id, format, data));
        if sample.is_none() {
            return Err(PlanError::Unsendable(name.to_owned()));
        }
        let cycle = described.cycle_ms.map(|ms| Duration::from_millis(ms.into()));
        self.messages.push(PlannedMessage {
            name: described.name.clone(),
            bus,
            id,
            length,
            format,
            cycle,
            period: period(timing, cycle),
            on_change: timing.is_event(),
            protection: protection.cloned(),
            pages: Vec::new(),
        });
        Ok(self.messages.len() - 1)
    }
}

impl PlannedMessage {
    /// Returns the encoder of a signal, in the page that its multiplexors select.
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

/// Returns the period of the DBC if it keeps the message valid with a margin, otherwise a period that does;
/// `None` for a message without a timeout.
fn period(timing: Timing, cycle: Option<Duration>) -> Option<Duration> {
    let timeout = timing.timeout()?;
    let known = cycle.filter(|cycle| *cycle >= MIN_PERIOD && *cycle <= timeout / 3);
    let slowest = match timing {
        Timing::Cyclic { .. } => MAX_PERIOD,
        Timing::Event | Timing::EventCyclic { .. } => Duration::from_secs(1),
    };
    Some(known.unwrap_or_else(|| (timeout / 5).clamp(MIN_PERIOD, slowest)))
}

/// Returns the press that ends a request of the first momentary stalk; `None` without one.
fn ending(turn: &TurnBinding) -> Option<CancelPress> {
    let settings = turn.sources().iter().find_map(|named| match &named.source {
        TurnSource::Stalk { settings, .. } => Some(settings),
        TurnSource::Enumerated { .. } | TurnSource::Pair { .. } | TurnSource::Lamps { .. } => None,
    });
    settings.map(|settings| {
        if settings.opposite_half == OppositePress::Cancels {
            CancelPress::OppositeHalf
        } else if settings.repeat == RepeatedPress::Cancels {
            CancelPress::SameAgain
        } else {
            CancelPress::OppositeFull
        }
    })
}
