//! The messages and signals of a discovered vehicle, as named in its files.

use std::collections::BTreeMap;
use std::time::Duration;

use super::dbc::{DraftMessage, DraftSignal};
use can_signal::can::BusIndex;
use can_signal::dbc::codec::Layout;
use vehicle_bringup::discovery::candidate::{Switch, TurnForm};
use vehicle_bringup::discovery::capture::{Capture, FrameTrack, MessageGaps, MessageKey};
use vehicle_bringup::discovery::findings::DiscoveryFindings;

/// A discovered vehicle, for which files are drafted.
#[derive(Debug)]
pub struct VehicleDraft<'a> {
    /// Name of the vehicle; the files are named after it.
    pub name: &'a str,
    /// Interfaces of the buses, by [`BusIndex`].
    pub interfaces: &'a [String],
    /// The frames of the session.
    pub capture: &'a Capture,
    /// The discovered signals.
    pub findings: &'a DiscoveryFindings,
}

/// Maximum silence of a message that counts as cyclic.
const MAX_CYCLIC: Duration = Duration::from_secs(3);
const MIN_TIMEOUT: Duration = Duration::from_millis(200);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Timing {
    /// Regularly, with this timeout in ms.
    Cyclic { period_ms: u32, timeout_ms: u128 },
    /// On change; the message is valid while the bus is alive.
    Event,
}

impl VehicleDraft<'_> {
    pub(super) fn interface(&self, bus: BusIndex) -> String {
        self.interfaces.get(usize::from(bus.0)).cloned().unwrap_or_else(|| format!("can{}", bus.0))
    }

    pub(super) fn timing(&self, key: MessageKey) -> Timing {
        let gaps = self.capture.track(key).and_then(FrameTrack::gaps);
        match gaps {
            Some(MessageGaps { median, usual, .. }) if usual < MAX_CYCLIC => {
                let timeout = (median * 5).max(usual * 5 / 2).max(MIN_TIMEOUT);
                let period_ms = u32::try_from((median.as_micros() + 500) / 1000).unwrap_or(u32::MAX).max(1);
                Timing::Cyclic { period_ms, timeout_ms: timeout.as_millis().div_ceil(50) * 50 }
            }
            Some(_) | None => Timing::Event,
        }
    }
}

/// The messages of the files, as they are collected.
pub(super) struct DraftMessages<'a> {
    pub(super) vehicle: &'a VehicleDraft<'a>,
    pub(super) messages: BTreeMap<MessageKey, DraftMessage>,
}

impl DraftMessages<'_> {
    pub(super) fn add_turn(&mut self, form: &TurnForm) {
        match *form {
            TurnForm::Enumerated { signal, off, left, right, both } => {
                let mut values = vec![(off, "off"), (left, "left"), (right, "right")];
                values.extend(both.map(|both| (both, "hazard")));
                self.add_signal(signal.message, "TURN", signal.layout, values);
            }
            TurnForm::Stalk { signal, idle, left, right, half, .. } => {
                let mut values = vec![(idle, "rest"), (left, "left"), (right, "right")];
                let names = half.into_iter().zip(["left half", "right half"]);
                values.extend(names.filter_map(|(value, name)| Some((value?, name))));
                self.add_signal(signal.message, "STALK", signal.layout, values);
            }
            TurnForm::Pair { left, right, .. } => {
                self.add_switch(left, "LEFT");
                self.add_switch(right, "RIGHT");
            }
        }
    }

    pub(super) fn add_switch(&mut self, Switch { signal, off, on }: Switch, name: &'static str) {
        self.add_signal(signal.message, name, signal.layout, vec![(off, "off"), (on, "on")]);
    }

    fn add_signal(
        &mut self,
        key: MessageKey,
        name: &'static str,
        layout: Layout,
        mut values: Vec<(u64, &'static str)>,
    ) {
        values.sort_unstable();
        self.message(key).signals.push(DraftSignal { name, layout, values });
    }

    pub(super) fn add_protection(&mut self) {
        let keys: Vec<_> = self.messages.keys().copied().collect();
        for key in keys {
            let Some(protection) = self.vehicle.findings.protection.get(&key) else { continue };
            let counter = protection.counter.map(|counter| ("COUNTER", counter.layout));
            let checksum = protection.checksum.as_ref().map(|checksum| ("CHECKSUM", checksum.layout));
            for (name, layout) in [counter, checksum].into_iter().flatten() {
                self.add_signal(key, name, layout, Vec::new());
            }
        }
    }

    /// Adds the most regular message of each bus that has a message sent on change: it proves that the bus is
    /// alive.
    pub(super) fn add_heartbeats(&mut self) -> BTreeMap<BusIndex, String> {
        let VehicleDraft { capture, .. } = self.vehicle;
        let is_event = |key: &&MessageKey| self.vehicle.timing(**key) == Timing::Event;
        let buses: Vec<_> = self.messages.keys().filter(is_event).map(|key| key.bus).collect();
        let mut heartbeats = BTreeMap::new();
        for bus in buses {
            let of_bus = capture.tracks().filter(|(key, _)| key.bus == bus);
            // A message that has stopped for good has no long gap, but no longer proves anything.
            let (_, end) = capture.span().unwrap_or_default();
            let silence = |track: &FrameTrack| track.times().last().map(|last| end.since(*last));
            let regular = of_bus.filter_map(|(key, track)| {
                let (gaps, silence) = (track.gaps()?, silence(track)?);
                Some((gaps.longest.max(silence), gaps.usual.max(silence), key))
            });
            let regular = regular.filter(|(_, usual, _)| *usual < MAX_CYCLIC);
            if let Some((_, _, key)) = regular.min() {
                heartbeats.insert(bus, self.message(key).name.clone());
            }
        }
        heartbeats
    }

    fn message(&mut self, key: MessageKey) -> &mut DraftMessage {
        let VehicleDraft { capture, .. } = self.vehicle;
        self.messages.entry(key).or_insert_with(|| DraftMessage {
            id: key.id,
            name: format!("MSG_{}", key.id),
            length: capture.track(key).map_or(8, |track| track.length().unwrap_or(track.shortest())),
            cycle_ms: match self.vehicle.timing(key) {
                Timing::Cyclic { period_ms, .. } => Some(period_ms),
                Timing::Event => None,
            },
            signals: Vec::new(),
        })
    }
}
