//! Decodes the bound signals of frames for `decode`.

use std::io::{self, Write};

use crate::config::Settings;
use crate::report::text::escaped;
use can_signal::can::{BusIndex, CanId, CanInput, Frame, LinkState};
use can_signal::validation::display::{RoleTexts, raw_and_bits};
use can_signal::validation::meaning::Meaning;
use can_signal::validation::observation::{Interruption, Observations, Unused};
use can_signal::validation::table::{BoundMessage, BoundSignal, SignalIndex, SignalTable};
use gateway_base::time::{Now, WallStamp};
use gateway_core::vehicle_lights::binding::LightsBinding;
use gateway_core::vehicle_lights::raw_state::{RawState, raw_state};
use gateway_core::vehicle_lights::role_texts::roles;
use gateway_core::vehicle_status::role_texts::StatusTexts;

/// Prints bound signals of frames.
#[derive(Debug)]
pub struct Decoder {
    reader: FrameReader,
    interfaces: Vec<String>,
    changes_only: bool,
    /// Raw value of each signal in the last accepted frame.
    last: Vec<Option<i128>>,
    /// Reason why the last frame of each message was rejected; `None` if it was accepted.
    rejected: Vec<Option<&'static str>>,
}

/// Finds the message of a frame and checks the frame like the gateway, for the lights and for the vehicle's
/// status.
#[derive(Debug)]
pub(super) struct FrameReader {
    lights: LightsBinding,
    light_roles: Vec<RoleTexts>,
    light_values: Observations,
    status: SignalTable,
    status_texts: StatusTexts,
    status_values: Observations,
}

/// A frame of a bound message.
#[derive(Debug, Clone, Copy)]
pub(super) struct ReadFrame {
    /// Position of the message among [`FrameReader::messages`].
    pub(super) message: usize,
    /// The reason if the gateway would reject the frame.
    pub(super) outcome: Result<(), Unused>,
}

/// A bound signal in a frame.
#[derive(Debug)]
pub(super) struct ReadSignal<'a> {
    /// Position of the signal among the signals of the lights, followed by the signals of the status.
    pub(super) position: usize,
    pub(super) signal: &'a BoundSignal,
    pub(super) raw: i128,
    /// Meanings of the raw value, e.g. `turn left`.
    pub(super) meanings: String,
    /// The state in words, if the signal is a measured value, which changes with nearly every frame.
    pub(super) measured: Option<&'static str>,
}

/// Returns the bound signals in a frame, with their raw values.
pub fn signals_in<'a>(
    table: &'a SignalTable,
    bus: BusIndex,
    frame: &'a Frame,
) -> impl Iterator<Item = (SignalIndex, &'a BoundSignal, i128)> {
    let id: CanId = frame.id();
    let carried = move |signal: &BoundSignal| {
        let message = &table.messages[signal.message.0];
        message.bus == bus
            && message.ids.contains(id)
            && signal.codec.needed_length() <= frame.data().len()
            && signal.codec.is_present(frame.padded())
    };
    let signals = table.signals.iter().enumerate().filter(move |(_, signal)| carried(signal));
    signals.map(|(index, signal)| (SignalIndex(index), signal, signal.codec.value(frame.padded())))
}

impl FrameReader {
    pub(super) fn new(settings: &Settings) -> Self {
        let (lights, status) = (settings.gateway.lights.clone(), &settings.gateway.status);
        Self {
            light_values: Observations::new(&lights.table),
            light_roles: roles(&lights),
            lights,
            status: status.table.clone(),
            status_texts: StatusTexts::of(status),
            status_values: Observations::new(&status.table),
        }
    }

    /// Checks a frame that was received at `stamp`; returns `None` if its message is not bound.
    pub(super) fn read(
        &mut self,
        bus: BusIndex,
        frame: &Frame,
        stamp: WallStamp,
        now: Now,
    ) -> Option<ReadFrame> {
        let of_lights = self.lights.table.message_of(bus, frame.id()).map(|message| {
            let outcome = self.light_values.frame_arrived(&self.lights.table, message, frame, stamp, now);
            ReadFrame { message: message.0, outcome: outcome.map(drop) }
        });
        let of_status = self.status.message_of(bus, frame.id()).map(|message| {
            let outcome = self.status_values.frame_arrived(&self.status, message, frame, stamp, now);
            let message = self.lights.table.messages.len() + message.0;
            ReadFrame { message, outcome: outcome.map(drop) }
        });
        of_lights.or(of_status)
    }

    /// Updates the state of a link. After a lost link, earlier frames no longer count.
    pub(super) fn link(&mut self, bus: BusIndex, state: LinkState) {
        if state != LinkState::Up {
            self.light_values.forget(&self.lights.table, bus, Interruption::LinkLost);
            self.status_values.forget(&self.status, bus, Interruption::LinkLost);
        }
    }

    /// Returns the messages of the lights, followed by the messages of the status.
    fn messages(&self) -> impl Iterator<Item = &BoundMessage> {
        self.lights.table.messages.iter().chain(&self.status.messages)
    }

    /// Returns the bound message with this identifier; `None` if it is not bound.
    pub(super) fn message_of(&self, bus: BusIndex, id: CanId) -> Option<&BoundMessage> {
        self.messages().find(|message| message.bus == bus && message.ids.contains(id))
    }

    /// Returns the number of signals of the lights and the status.
    fn signal_count(&self) -> usize {
        self.lights.table.signals.len() + self.status.signals.len()
    }

    /// Returns the bound signals of a frame. A signal of both lights and status has the meanings of both.
    pub(super) fn signals<'a>(&'a self, bus: BusIndex, frame: &'a Frame) -> Vec<ReadSignal<'a>> {
        let of_lights = signals_in(&self.lights.table, bus, frame).map(|(index, signal, raw)| {
            let roles = self.light_roles.iter().filter(|role| role.signal == index);
            let texts = roles.map(|role| role.value_text(raw).text);
            ReadSignal {
                position: index.0,
                signal,
                raw,
                meanings: texts.collect::<Vec<_>>().join(", "),
                measured: None,
            }
        });
        let mut signals: Vec<_> = of_lights.collect();
        for (index, signal, raw) in signals_in(&self.status, bus, frame) {
            let meanings = self.status_texts.text(index, raw);
            if let Some(known) = signals.iter_mut().find(|known| known.signal.name == signal.name) {
                known.meanings = format!("{}, {meanings}", known.meanings);
                continue;
            }
            signals.push(ReadSignal {
                position: self.lights.table.signals.len() + index.0,
                signal,
                raw,
                meanings,
                measured: self
                    .status_texts
                    .is_measured(index)
                    .then(|| meaning_name(self.status_texts.meaning(index, raw))),
            });
        }
        signals
    }

    /// Returns the state of the lights for a raw value of the signal at `position`. For a signal of the
    /// status it is at most unusable.
    pub(super) fn state(&self, position: usize, raw: i128) -> RawState {
        let lights = self.lights.table.signals.len();
        if position < lights {
            return raw_state(&self.lights, SignalIndex(position), raw);
        }
        match self.status_texts.meaning(SignalIndex(position - lights), raw) {
            Meaning::Defined(()) => RawState::Other,
            Meaning::NotAvailable => RawState::NotAvailable,
            Meaning::Fault | Meaning::Undefined => RawState::Faulty,
        }
    }
}

fn meaning_name(meaning: Meaning<()>) -> &'static str {
    match meaning {
        Meaning::Defined(()) => "measured",
        Meaning::NotAvailable => "not available",
        Meaning::Fault => "fault",
        Meaning::Undefined => "UNDEFINED",
    }
}

impl Decoder {
    /// Creates a decoder. With `changes_only` a signal is printed only when its raw value changes, and a
    /// rejected frame only when the reason changes.
    pub fn new(settings: &Settings, changes_only: bool) -> Self {
        let reader = FrameReader::new(settings);
        let interfaces = settings.gateway.buses.iter().map(|bus| bus.interface.clone()).collect();
        Self {
            last: vec![None; reader.signal_count()],
            rejected: vec![None; reader.messages().count()],
            reader,
            interfaces,
            changes_only,
        }
    }

    /// Prints the bound signals of an input: `(stamp) can0 128 BODY.TURN = 8 (0x8) turn left`. For a frame
    /// that the gateway rejects, the reason comes first: `(stamp) can0 128 BODY REJECTED: wrong checksum:
    /// 0x1, not 0x2`. Fails only if `out` does.
    pub fn print(&mut self, input: &CanInput, now: Now, out: &mut dyn Write) -> io::Result<()> {
        if let CanInput::Link { bus, state } = *input {
            self.reader.link(bus, state);
        }
        let CanInput::Frame { bus, ref frame, stamp } = *input else { return Ok(()) };
        let Some(interface) = self.interfaces.get(usize::from(bus.0)) else { return Ok(()) };
        let Some(ReadFrame { message, outcome }) = self.reader.read(bus, frame, stamp, now) else {
            return Ok(());
        };
        let reason = outcome.err().map(Unused::reason);
        let before = std::mem::replace(&mut self.rejected[message], reason);
        let (stamp, id) = (stamp.candump_text(), frame.id());
        let mut line = |text: &str| writeln!(out, "({stamp}) {interface} {id} {}", escaped(text));
        if let Err(unused) = outcome {
            if !self.changes_only || before != reason {
                let name = self.reader.messages().nth(message).map_or("", |message| message.name.as_str());
                line(&format!("{name} REJECTED: {unused}"))?;
            }
            if self.changes_only {
                return Ok(());
            }
        }
        for ReadSignal { position, signal, raw, meanings, .. } in self.reader.signals(bus, frame) {
            if outcome.is_ok() {
                let before = self.last[position].replace(raw);
                if self.changes_only && before == Some(raw) {
                    continue;
                }
            }
            let rejected = if outcome.is_ok() { "" } else { " (rejected)" };
            let value = raw_and_bits(raw, &signal.codec);
            line(&format!("{} = {value} {meanings}{rejected}", signal.name))?;
        }
        Ok(())
    }
}
