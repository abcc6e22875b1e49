//! Decodes the bound signals of frames for `decode`.

use std::io::{self, Write};

use crate::config::Settings;
use crate::core::can::{BusIndex, CanId, CanInput, Frame, LinkState};
use crate::core::time::{Now, WallStamp};
use crate::core::validation::display::{RoleTexts, raw_and_bits};
use crate::core::validation::observation::{Observations, Unused};
use crate::core::validation::table::{BoundSignal, MessageIndex, SignalIndex, SignalTable};
use crate::core::vehicle_lights::binding::LightsBinding;
use crate::core::vehicle_lights::role_texts::roles;
use crate::report::text::escaped;

/// Prints bound signals of frames.
#[derive(Debug)]
pub struct Decoder {
    reader: FrameReader,
    interfaces: Vec<String>,
    changes_only: bool,
    /// Raw value of each signal in the last frame that was used.
    last: Vec<Option<i128>>,
    /// Why the last frame of each message was rejected; `None` if it was used.
    rejected: Vec<Option<&'static str>>,
}

/// Finds the message of a frame and checks it, as the gateway does.
#[derive(Debug)]
pub(super) struct FrameReader {
    pub(super) binding: LightsBinding,
    observations: Observations,
    /// The uses of all signals, with the texts of their values.
    roles: Vec<RoleTexts>,
}

/// A frame of a bound message.
#[derive(Debug, Clone, Copy)]
pub(super) struct ReadFrame {
    pub(super) message: MessageIndex,
    /// The reason if the gateway would reject the frame.
    pub(super) outcome: Result<(), Unused>,
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
        let binding = settings.gateway.lights.clone();
        Self { observations: Observations::new(&binding.table), roles: roles(&binding), binding }
    }

    /// Checks a frame that was received at `stamp`; returns `None` if its message is not bound.
    pub(super) fn read(
        &mut self,
        bus: BusIndex,
        frame: &Frame,
        stamp: WallStamp,
        now: Now,
    ) -> Option<ReadFrame> {
        let table = &self.binding.table;
        let message = table.message_of(bus, frame.id())?;
        let outcome = self.observations.frame_arrived(table, message, frame, stamp, now);
        Some(ReadFrame { message, outcome: outcome.map(drop) })
    }

    /// Updates the state of a link. After a lost link, earlier frames no longer count.
    pub(super) fn link(&mut self, bus: BusIndex, state: LinkState) {
        if state != LinkState::Up {
            self.observations.forget_bus(&self.binding.table, bus);
        }
    }

    pub(super) fn table(&self) -> &SignalTable {
        &self.binding.table
    }

    /// Returns the meanings of a raw value, e.g. `turn left`.
    pub(super) fn meanings(&self, signal: SignalIndex, raw: i128) -> String {
        let of_signal = self.roles.iter().filter(|role| role.signal == signal);
        of_signal.map(|role| role.value_text(raw).text).collect::<Vec<_>>().join(", ")
    }
}

impl Decoder {
    /// Creates a decoder. With `changes_only` a signal is printed only when its raw value changes, and a rejected
    /// frame only when the reason changes.
    pub fn new(settings: &Settings, changes_only: bool) -> Self {
        let reader = FrameReader::new(settings);
        let interfaces = settings.gateway.buses.iter().map(|bus| bus.interface.clone()).collect();
        Self {
            last: vec![None; reader.table().signals.len()],
            rejected: vec![None; reader.table().messages.len()],
            reader,
            interfaces,
            changes_only,
        }
    }

    /// Prints the bound signals of an input: `(stamp) can0 128 BODY.TURN = 8 (0x8) turn left`. For a frame that the
    /// gateway rejects, the reason comes first: `(stamp) can0 128 BODY REJECTED: wrong checksum: 0x1, not 0x2`. Fails
    /// only if `out` does.
    pub fn print(&mut self, input: &CanInput, now: Now, out: &mut dyn Write) -> io::Result<()> {
        let (bus, frame, stamp) = match input {
            CanInput::Frame { bus, frame, stamp } => (*bus, frame, *stamp),
            CanInput::Link { bus, state } => {
                self.reader.link(*bus, *state);
                return Ok(());
            }
            CanInput::Drops { .. }
            | CanInput::ErrorFrame { .. }
            | CanInput::Controller { .. }
            | CanInput::BadRecords { .. } => return Ok(()),
        };
        let Some(interface) = self.interfaces.get(usize::from(bus.0)) else { return Ok(()) };
        let Some(ReadFrame { message, outcome }) = self.reader.read(bus, frame, stamp, now) else {
            return Ok(());
        };
        let table = self.reader.table();
        let reason = outcome.err().map(Unused::reason);
        let before = std::mem::replace(&mut self.rejected[message.0], reason);
        let (stamp, id) = (stamp.candump_text(), frame.id());
        let mut line = |text: &str| writeln!(out, "({stamp}) {interface} {id} {}", escaped(text));
        if let Err(unused) = outcome {
            if !self.changes_only || before != reason {
                line(&format!("{} REJECTED: {unused}", table.messages[message.0].name))?;
            }
            if self.changes_only {
                return Ok(());
            }
        }
        for (index, signal, raw) in signals_in(table, bus, frame) {
            if outcome.is_ok() {
                let before = self.last[index.0].replace(raw);
                if self.changes_only && before == Some(raw) {
                    continue;
                }
            }
            let rejected = if outcome.is_ok() { "" } else { " (rejected)" };
            let meanings = self.reader.meanings(index, raw);
            let value = raw_and_bits(raw, &signal.codec);
            line(&format!("{} = {value} {meanings}{rejected}", signal.name))?;
        }
        Ok(())
    }
}
