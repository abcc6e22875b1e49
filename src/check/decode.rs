//! `decode`: the bound signals of frames by name, with their meaning.

use std::io::{self, Write};

use crate::config::Settings;
use crate::core::can::frame::{CanId, Frame};
use crate::core::can::input::CanInput;
use crate::core::can::link::BusIndex;
use crate::core::time::WallStamp;
use crate::core::validation::table::{BoundSignal, SignalIndex, SignalTable};
use crate::core::vehicle_lights::binding::LightsBinding;
use crate::core::vehicle_lights::role_texts::texts;

/// Prints bound signals of frames.
#[derive(Debug)]
pub struct Decoder {
    binding: LightsBinding,
    interfaces: Vec<String>,
    changes_only: bool,
    last: Vec<Option<i128>>,
}

/// The bound signals that a frame carries, with their raw values.
pub fn signals_in<'a>(
    table: &'a SignalTable,
    bus: BusIndex,
    frame: &'a Frame,
) -> impl Iterator<Item = (SignalIndex, &'a BoundSignal, i128)> {
    let id: CanId = frame.id();
    let carried = move |signal: &BoundSignal| {
        let message = &table.messages[signal.message.0];
        message.bus == bus
            && message.id == id
            && signal.codec.needed_length() <= frame.data().len()
            && signal.codec.is_present(frame.padded())
    };
    let signals = table.signals.iter().enumerate().filter(move |(_, signal)| carried(signal));
    signals.map(|(index, signal)| (SignalIndex(index), signal, signal.codec.value(frame.padded())))
}

impl Decoder {
    /// A decoder for the bound signals; with `changes_only`, a signal is printed when its
    /// raw value is another than before.
    pub fn new(settings: &Settings, changes_only: bool) -> Self {
        let binding = settings.gateway.lights.clone();
        let interfaces = settings.gateway.buses.iter().map(|bus| bus.interface.clone()).collect();
        Self { last: vec![None; binding.table.signals.len()], binding, interfaces, changes_only }
    }

    /// Prints the bound signals of an input: `(stamp) can0 128 BODY.TURN = 8 (0x8) turn left`.
    ///
    /// # Errors
    /// A closed `out`.
    pub fn print(&mut self, input: &CanInput, out: &mut dyn Write) -> io::Result<()> {
        let CanInput::Frame { bus, frame, stamp } = input else { return Ok(()) };
        let Some(interface) = self.interfaces.get(usize::from(bus.0)) else { return Ok(()) };
        for (index, signal, raw) in signals_in(&self.binding.table, *bus, frame) {
            let before = self.last[index.0].replace(raw);
            if self.changes_only && before == Some(raw) {
                continue;
            }
            let texts: Vec<_> =
                texts(&self.binding, index, raw).into_iter().map(|meaning| meaning.text).collect();
            let stamp = stamp_text(*stamp);
            let (id, name, texts) = (frame.id(), &signal.name, texts.join(", "));
            writeln!(out, "({stamp}) {interface} {id} {name} = {raw} (0x{raw:X}) {texts}")?;
        }
        Ok(())
    }
}

fn stamp_text(stamp: WallStamp) -> String {
    format!("{}.{:06}", stamp.sec(), stamp.nanosec() / 1000)
}
