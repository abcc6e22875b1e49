//! Collects the last frame of each identifier and its changes, for `decode --live` on a terminal.

use std::collections::BTreeMap;
use std::time::Duration;

use super::decode::{FrameReader, ReadFrame, ReadSignal};
use crate::config::Settings;
use crate::report::gateway_view::{BusView, GatewayView};
use crate::report::terminal::message_table::MessageRow;
use can_signal::can::{BusIndex, CanId, CanInput, Frame, LinkState};
use can_signal::dbc::model::{Database, Message, Number, Signal};
use gateway_base::diagnostics::Level;
use gateway_base::time::{MonoTime, Now, WallStamp};

/// Maximum number of rows; frames of further identifiers are only counted.
const MAX_ROWS: usize = 4096;
/// Weight of the previous mean in the running mean of the period.
const PERIOD_WEIGHT: u32 = 8;
const RATE_TIME: Duration = Duration::from_secs(1);

/// Table of all identifiers that were received.
#[derive(Debug)]
pub struct LiveMessages<'a> {
    reader: FrameReader,
    databases: Vec<&'a Database>,
    rows: BTreeMap<(BusIndex, CanId), MessageState<'a>>,
    buses: Vec<LiveBus>,
}

#[derive(Debug, Default)]
struct LiveBus {
    interface: String,
    link: Option<LinkState>,
    counted: u32,
    since: MonoTime,
    rate_hz: f64,
    drops: u64,
    /// Number of frames of identifiers beyond [`MAX_ROWS`].
    not_shown: u64,
}

#[derive(Debug)]
struct MessageState<'a> {
    described: Option<&'a Message>,
    frame: Frame,
    read: Option<ReadFrame>,
    at: MonoTime,
    stamp: WallStamp,
    /// Mean period; `None` after the first frame.
    period: Option<Duration>,
    /// Time at which each byte last changed; `None` if it never has.
    changed: Vec<Option<MonoTime>>,
}

impl<'a> LiveMessages<'a> {
    /// Creates an empty table for the buses of a configuration.
    pub fn new(settings: &'a Settings) -> Self {
        let interfaces = settings.gateway.buses.iter().map(|bus| bus.interface.clone());
        let buses = interfaces.map(|interface| LiveBus { interface, ..LiveBus::default() }).collect();
        let databases = settings.dbcs.iter().map(|dbc| &dbc.database).collect();
        Self { reader: FrameReader::new(settings), databases, rows: BTreeMap::new(), buses }
    }

    /// Adds an input.
    pub fn take(&mut self, input: &CanInput, now: Now) {
        let Some(bus) = self.buses.get_mut(usize::from(input.bus().0)) else { return };
        match input {
            CanInput::Frame { bus: index, frame, stamp } => {
                bus.counted += 1;
                let read = self.reader.read(*index, frame, *stamp, now);
                let (key, is_full) = ((*index, frame.id()), self.rows.len() >= MAX_ROWS);
                match self.rows.get_mut(&key) {
                    Some(row) => row.update(frame, read, *stamp, now.mono),
                    None if is_full => bus.not_shown += 1,
                    None => {
                        let bound = self.reader.message_of(*index, frame.id());
                        let id = bound.map_or(frame.id(), |message| message.ids.described());
                        let database = self.databases.get(usize::from(index.0));
                        let described = database
                            .and_then(|database| database.messages.iter().find(|message| message.id == id));
                        let changed = vec![None; frame.data().len()];
                        let (frame, stamp, at) = (*frame, *stamp, now.mono);
                        self.rows.insert(
                            key,
                            MessageState { described, frame, read, at, stamp, period: None, changed },
                        );
                    }
                }
            }
            CanInput::Link { bus: index, state } => {
                bus.link = Some(*state);
                self.reader.link(*index, *state);
            }
            CanInput::Drops { lost, .. } => bus.drops += u64::from(*lost),
            CanInput::ErrorFrame { .. } | CanInput::Controller { .. } | CanInput::BadRecords { .. } => {}
        }
    }

    /// Returns the state of the buses at `now`.
    pub fn picture(&mut self, now: MonoTime) -> GatewayView {
        let buses = self.buses.iter_mut().map(|bus| bus.line(now)).collect();
        GatewayView { buses, ..GatewayView::default() }
    }

    /// Returns a row for each identifier, ordered by bus and identifier.
    pub fn rows(&self, now: MonoTime) -> Vec<MessageRow> {
        self.rows.iter().map(|((bus, id), row)| self.row(*bus, *id, row, now)).collect()
    }

    fn row(&self, bus: BusIndex, id: CanId, row: &MessageState<'_>, now: MonoTime) -> MessageRow {
        let since = |at: &Option<MonoTime>| at.map(|at| now.since(at));
        let signals = self.reader.signals(bus, &row.frame).into_iter();
        let bound: Vec<_> = signals
            .map(|ReadSignal { signal, raw, meanings, .. }| {
                (signal.name.as_str(), format!("{raw} {meanings}"))
            })
            .collect();
        let name = row.described.map(|message| message.name.clone());
        let of_message = name.as_ref().map(|name| format!("{name}.")).unwrap_or_default();
        let is_bound = |signal: &Signal| {
            bound.iter().any(|(name, _)| name.strip_prefix(&of_message) == Some(signal.name.as_str()))
        };
        let described = row.described.iter().flat_map(|message| &message.signals);
        let others =
            described.filter(|signal| !is_bound(signal)).filter_map(|signal| signal_text(signal, &row.frame));
        MessageRow {
            interface: self.buses.get(usize::from(bus.0)).map_or("", |bus| &bus.interface).to_owned(),
            id,
            bytes: row.frame.data().iter().copied().zip(row.changed.iter().map(since)).collect(),
            period: row.period,
            age: now.since(row.at),
            rejected: row.read.and_then(|read| read.outcome.err()).map(|unused| unused.to_string()),
            bound_signals: bound
                .iter()
                .map(|(name, value)| format!("{} = {value}", name.strip_prefix(&of_message).unwrap_or(name)))
                .collect(),
            other_signals: others.collect(),
            name,
        }
    }
}

/// Returns a signal that the profile does not bind, as `SPEED = 12.5 km/h` or `GEAR = 3 (reverse)`; `None` if
/// the frame does not contain it.
fn signal_text(signal: &Signal, frame: &Frame) -> Option<String> {
    let codec = &signal.codec;
    if codec.needed_length() > frame.data().len() || !codec.is_present(frame.padded()) {
        return None;
    }
    let raw = codec.value(frame.padded());
    let name = &signal.name;
    if let Some((_, text)) = signal.values.iter().find(|(value, _)| *value == raw) {
        return Some(format!("{name} = {raw} ({text})"));
    }
    #[allow(clippy::cast_precision_loss)] // for the eye
    let number = match signal.number {
        Number::Integer => raw as f64,
        Number::Float32 => f32::from_bits(u32::try_from(raw).ok()?).into(),
        Number::Float64 => f64::from_bits(u64::try_from(raw).ok()?),
    };
    // The last digits are artefacts of the binary factor.
    let value = (number * signal.factor + signal.offset).to_string();
    let value =
        if value.len() > 12 { format!("{:.3}", number * signal.factor + signal.offset) } else { value };
    let unit = if signal.unit.is_empty() { String::new() } else { format!(" {}", signal.unit) };
    Some(format!("{name} = {value}{unit}"))
}

impl MessageState<'_> {
    fn update(&mut self, frame: &Frame, read: Option<ReadFrame>, stamp: WallStamp, at: MonoTime) {
        let before = self.frame.data();
        self.changed.resize(frame.data().len(), Some(at));
        for (index, (byte, changed)) in frame.data().iter().zip(&mut self.changed).enumerate() {
            if before.get(index) != Some(byte) {
                *changed = Some(at);
            }
        }
        // Batches do not delay the kernel's stamps. A clock that was set back yields no period.
        let nanos = u64::try_from(stamp.as_nanos().saturating_sub(self.stamp.as_nanos()));
        if let Ok(gap) = nanos.map(Duration::from_nanos) {
            let mean = |period: Duration| (period * (PERIOD_WEIGHT - 1) + gap) / PERIOD_WEIGHT;
            self.period = Some(self.period.map_or(gap, mean));
        }
        (self.frame, self.read, self.stamp, self.at) = (*frame, read, stamp, at);
    }
}

impl LiveBus {
    fn line(&mut self, now: MonoTime) -> BusView {
        let time = now.since(self.since);
        if time >= RATE_TIME {
            self.rate_hz = f64::from(std::mem::take(&mut self.counted)) / time.as_secs_f64();
            self.since = now;
        }
        let link = self.link.map_or_else(|| "no link yet".to_owned(), LinkState::text);
        let more = match self.not_shown {
            0 => String::new(),
            frames => format!(", {frames} frames of more than {MAX_ROWS} identifiers not shown"),
        };
        let level = if self.link == Some(LinkState::Up) { Level::Ok } else { Level::Error };
        let bus = BusView::plain(self.interface.clone(), level, &(link + &more), self.rate_hz);
        BusView { drops: self.drops, ..bus }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::built_in::BuiltIn;
    use crate::config::files::Disk;
    use crate::config::load_profile;

    const BODY: BusIndex = BusIndex(0);

    fn at(millis: u64) -> Now {
        let wall = WallStamp::from_nanos(i64::try_from(millis).unwrap() * 1_000_000);
        Now { mono: MonoTime::from_millis(millis), wall }
    }

    fn frame(id: u16, data: &[u8], millis: u64) -> CanInput {
        let frame = Frame::classic(CanId::Standard(id), data).unwrap();
        CanInput::Frame { bus: BODY, frame, stamp: at(millis).wall }
    }

    #[test]
    fn row_shows_what_changed_and_when_the_mean_period_and_the_signals() {
        let settings = load_profile(&Disk, &BuiltIn::Profile.path("demo_vehicle").unwrap()).unwrap();
        let mut messages = LiveMessages::new(&settings);
        for (millis, turn) in [(0, 0), (20, 0), (40, 2)] {
            messages.take(&frame(0x2A5, &[0, 0, turn, 0, 0, 0, 0, 0], millis), at(millis));
        }
        messages.take(&frame(0x123, &[1], 45), at(45));
        let rows = messages.rows(at(100).mono);
        let [unknown, turn] = rows.as_slice() else { panic!("{rows:?}") };
        let changed: Vec<_> = turn.bytes.iter().map(|(_, since)| *since).collect();
        let mut expected = [None; 8];
        expected[2] = Some(Duration::from_millis(60));
        assert_eq!(changed, expected);
        assert_eq!((turn.period, turn.age), (Some(Duration::from_millis(20)), Duration::from_millis(60)));
        assert!(turn.bound_signals[0].contains("= 1 turn left"), "{turn:?}");
        assert_eq!((unknown.name.as_ref(), unknown.bound_signals.len(), unknown.period), (None, 0, None));
    }

    #[test]
    fn bus_counts_frames_and_tells_of_its_link() {
        let settings = load_profile(&Disk, &BuiltIn::Profile.path("demo_vehicle").unwrap()).unwrap();
        let mut messages = LiveMessages::new(&settings);
        messages.take(&CanInput::Link { bus: BODY, state: LinkState::Up }, at(0));
        for millis in 0..100 {
            messages.take(&frame(0x123, &[1], millis * 10), at(millis * 10));
        }
        let picture = messages.picture(at(1_000).mono);
        let [bus] = picture.buses.as_slice() else { panic!("{picture:?}") };
        assert!((bus.rate_hz - 100.0).abs() < 0.1 && bus.level == Level::Ok, "{bus:?}");
        messages.take(&CanInput::Link { bus: BODY, state: LinkState::Down }, at(1_000));
        let picture = messages.picture(at(1_000).mono);
        assert_eq!((picture.buses[0].state.as_str(), picture.buses[0].level), ("link down", Level::Error));
    }

    #[test]
    fn further_identifiers_than_there_are_rows_are_counted() {
        let settings = load_profile(&Disk, &BuiltIn::Profile.path("demo_vehicle").unwrap()).unwrap();
        let mut messages = LiveMessages::new(&settings);
        for id in 0..5_000 {
            let frame = Frame::classic(CanId::Extended(id), &[]).unwrap();
            messages.take(&CanInput::Frame { bus: BODY, frame, stamp: at(0).wall }, at(0));
        }
        assert_eq!(messages.rows(at(0).mono).len(), MAX_ROWS);
        let state = messages.picture(at(0).mono).buses[0].state.clone();
        assert!(state.contains("904 frames of more than 4096 identifiers"), "{state}");
    }
}
