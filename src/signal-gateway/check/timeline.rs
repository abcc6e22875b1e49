//! Collects the timeline of a replayed recording: each state with the frame that caused it.

use std::collections::BTreeMap;
use std::io;

use super::decode::{FrameReader, ReadFrame, ReadSignal};
use crate::config::Settings;
use crate::replay::{RecordedInput, Replay};
use crate::report::seconds;
use crate::report::timeline::{CausingFrame, Curve, DOOR, Group, Lane, Timeline, Tone};
use can_signal::can::{BusIndex, CanInput, Frame, LinkState, link_text};
use can_signal::validation::display::raw_and_bits;
use gateway_base::diagnostics::Diagnostics;
use gateway_base::names::state_word;
use gateway_base::time::{MonoTime, Now, WallStamp};
use gateway_core::command::output::CommandOutput;
use gateway_core::gateway::event::Output;
use gateway_core::vehicle_lights::output::VehicleLightsOutput;
use gateway_core::vehicle_lights::raw_state::RawState;
use gateway_core::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use gateway_core::vehicle_status::measure::Measure;
use gateway_core::vehicle_status::output::VehicleStatusOutput;
use traffic_lights::emission::{Emission, LightsContent, LightsTopic};
use traffic_lights::output::TrafficLightOutput;
use turn_signal::light_command::{HazardCommand, TurnCommand};
use turn_signal::output::TurnSignalOutput;

/// Maximum number of lanes for traffic lights; a map has thousands of lights.
const MAX_LIGHTS: usize = 60;
/// Position of the lanes of the vehicle's status, below the lights.
const STATUS_LANES: usize = 10;
/// Maximum number of stored frames.
const MAX_FRAMES: usize = 100_000;

/// Collects a timeline while a recording is replayed.
#[derive(Debug)]
pub struct TimelineCollector {
    reader: FrameReader,
    interfaces: Vec<String>,
    lanes: BTreeMap<(Group, usize, String), Lane>,
    /// Frames that were the latest bound frame at a change.
    frames: Vec<CausingFrame>,
    /// The latest bound frame, and its position in `frames` once it is stored there.
    last: Option<(BusIndex, Frame, WallStamp, MonoTime)>,
    last_kept: Option<usize>,
    /// Reason why the latest bound frame was rejected.
    unused: Option<String>,
    lights_left_out: bool,
    frames_left_out: u64,
    doors: Vec<String>,
    curves: BTreeMap<Measure, Curve>,
}

impl TimelineCollector {
    /// Creates an empty timeline for a configuration.
    pub fn new(settings: &Settings) -> Self {
        let interfaces = settings.gateway.buses.iter().map(|bus| bus.interface.clone());
        let mut collector = Self {
            reader: FrameReader::new(settings),
            interfaces: interfaces.collect(),
            lanes: BTreeMap::new(),
            frames: Vec::new(),
            last: None,
            last_kept: None,
            unused: None,
            lights_left_out: false,
            frames_left_out: 0,
            doors: settings.gateway.status.doors.iter().map(|door| door.name.clone()).collect(),
            curves: BTreeMap::new(),
        };
        for interface in collector.interfaces.clone() {
            collector.begin((Group::Links, 0, interface), MonoTime::ZERO, Tone::Ok, "up", false);
        }
        collector
    }

    /// Replays a recording by its stamps, and returns its timeline. Fails if the recording cannot be read to
    /// its end.
    pub fn replayed(settings: &Settings, mut replay: Replay, title: String) -> io::Result<Timeline> {
        let mut collector = Self::new(settings);
        loop {
            let now = replay.now();
            while let Some(output) = replay.poll_output() {
                collector.given_out(&output, now.mono);
            }
            if let Some((RecordedInput::Can(input), at)) = replay.upcoming() {
                collector.received(input, Now { mono: at, wall: now.wall.after(at.since(now.mono)) });
            }
            if !replay.step()? {
                return Ok(collector.finish(title, settings.vehicle.clone(), replay.length()));
            }
        }
    }

    /// Adds an input. Call it before the gateway handles the input.
    pub fn received(&mut self, input: &CanInput, now: Now) {
        let interface = self.interface(input.bus());
        let (place, label, tone, text) = match input {
            CanInput::Frame { bus, frame, stamp } => return self.frame(*bus, frame, *stamp, now),
            CanInput::BadRecords { .. } => return,
            CanInput::Link { bus, state } => {
                self.reader.link(*bus, *state);
                let tone = if *state == LinkState::Up { Tone::Ok } else { Tone::Error };
                (0, "", tone, link_text(&interface, *state))
            }
            CanInput::ErrorFrame { error, .. } => {
                (1, " error frames", Tone::Warn, format!("error frame {}", error.log_text()))
            }
            CanInput::Controller { report, .. } => {
                (2, " controller", Tone::from(report.state.level()), report.to_string())
            }
            CanInput::Drops { lost, .. } => (3, " losses", Tone::Warn, format!("{lost} frames lost by then")),
        };
        self.begin((Group::Links, place, interface + label), now.mono, tone, &text, false);
    }

    /// Adds an output of the last step.
    pub fn given_out(&mut self, output: &Output, at: MonoTime) {
        match output {
            Output::VehicleLights(output) => self.report(*output, at),
            Output::Diagnostics { diagnostics, .. } => self.diagnostics(diagnostics, at),
            Output::TrafficLights(TrafficLightOutput::Publish(emission)) => self.lights(emission, at),
            Output::TrafficLights(TrafficLightOutput::CommandRefused(_)) => {}
            Output::VehicleStatus(output) => self.vehicle_status(*output, at),
            Output::TurnSignal(output) => self.turn_signal(output, at),
            Output::Command(output) => {
                let (verb, bus, frame) = match output {
                    CommandOutput::Transmit { frame, .. } => ("sent", frame.bus(), *frame.frame()),
                    CommandOutput::WouldTransmit { bus, frame, .. } => ("would be sent", *bus, *frame),
                };
                let label = format!("{} {} {verb}", self.interface(bus), frame.id());
                self.begin((Group::Commands, 2, label), at, Tone::Plain, &frame.to_string(), true);
            }
        }
    }

    /// Returns the timeline, which ends at `length`.
    pub fn finish(mut self, title: String, subtitle: String, length: MonoTime) -> Timeline {
        let length_s = seconds(length);
        let mut lanes: Vec<_> = std::mem::take(&mut self.lanes).into_values().collect();
        for lane in &mut lanes {
            lane.finish(length_s);
        }
        lanes.sort_by_key(Lane::section);
        let mut remarks = Vec::new();
        if self.lights_left_out {
            remarks.push(format!("of the traffic lights, {MAX_LIGHTS} are shown"));
        }
        if self.frames_left_out > 0 {
            remarks.push(format!("{} later states are shown without their frames", self.frames_left_out));
        }
        let curves = self.curves.into_values().collect();
        let mut timeline =
            Timeline { title, subtitle, length_s, curves, lanes, frames: self.frames, remarks };
        timeline.close();
        timeline
    }

    fn frame(&mut self, bus: BusIndex, frame: &Frame, stamp: WallStamp, now: Now) {
        let Some(ReadFrame { message, outcome }) = self.reader.read(bus, frame, stamp, now) else { return };
        self.unused = outcome.err().map(|unused| unused.to_string());
        (self.last, self.last_kept) = (Some((bus, *frame, stamp, now.mono)), None);
        let is_rejected = self.unused.is_some();
        let rejected = if is_rejected { " (rejected)" } else { "" };
        let state = |(place, signal): (usize, ReadSignal<'_>)| {
            let ReadSignal { position, signal, raw, meanings, measured } = signal;
            let tone = if is_rejected { Tone::Warn } else { tone_of(self.reader.state(position, raw)) };
            // Measured values are shown as a curve.
            let text = measured.map_or_else(|| format!("{raw} {meanings}"), str::to_owned);
            ((Group::Raw, message * 1_000 + place, signal.name.clone()), tone, text + rejected)
        };
        let states: Vec<_> = self.reader.signals(bus, frame).into_iter().enumerate().map(state).collect();
        for (key, tone, text) in states {
            self.begin(key, now.mono, tone, &text, true);
        }
    }

    fn diagnostics(&mut self, diagnostics: &Diagnostics, at: MonoTime) {
        for (position, status) in diagnostics.statuses.iter().enumerate() {
            let tone = Tone::from(status.level);
            let label = &status.task;
            let known =
                self.lanes.keys().find(|(group, _, name)| *group == Group::Diagnostics && name == label);
            let key = known.cloned().unwrap_or_else(|| (Group::Diagnostics, position, label.to_owned()));
            self.begin(key, at, tone, &status.message, true);
        }
    }

    fn lights(&mut self, emission: &Emission, at: MonoTime) {
        let LightsContent::Groups(groups) = &emission.content else { return };
        for group in groups.iter() {
            let key =
                (Group::TrafficLights, 0, format!("{} {}", topic_name(emission.topic), group.relation_id));
            let is_known = self.lanes.contains_key(&key);
            let lights = self.lanes.keys().filter(|(group, ..)| *group == Group::TrafficLights).count();
            if !is_known && lights >= MAX_LIGHTS {
                self.lights_left_out = true;
                continue;
            }
            let bulbs: Vec<_> = group.elements.iter().map(|element| element.bulb.to_string()).collect();
            let (tone, text) = if bulbs.is_empty() {
                (Tone::Nothing, "dark".to_owned())
            } else {
                (Tone::Plain, bulbs.join(", "))
            };
            self.begin(key, at, tone, &text, true);
        }
    }

    /// Begins a state of a report with a lane.
    fn report(&mut self, output: VehicleLightsOutput, at: MonoTime) {
        let (lane, tone) = match output {
            VehicleLightsOutput::TurnIndicators(step) => {
                let tone = step.value().map(|value| match value {
                    TurnIndicators::Disable => Tone::Off,
                    TurnIndicators::EnableLeft => Tone::Left,
                    TurnIndicators::EnableRight => Tone::Right,
                });
                (0, tone)
            }
            VehicleLightsOutput::HazardLights(step) => {
                let is_on = step.value().map(|value| value == HazardLights::Enable);
                (1, is_on.map(|is_on| if is_on { Tone::Hazard } else { Tone::Off }))
            }
        };
        let (report, value) = output.named();
        let (tone, text) = (tone.unwrap_or(Tone::Nothing), value.as_deref().unwrap_or("not published"));
        self.begin((Group::Reports, lane, report.to_owned()), at, tone, text, true);
    }

    /// Begins a state of a report, and adds to the curves of measured values.
    fn vehicle_status(&mut self, output: VehicleStatusOutput, at: MonoTime) {
        let report = output.report();
        for (measure, value) in output.measures() {
            let row = measure.row();
            let curve =
                self.curves.entry(measure).or_insert_with(|| Curve::new(report.name(), row.name, row.unit));
            curve.add(seconds(at), measure.shown(value));
        }
        let value = output.named();
        if value.is_none() {
            let curves = self.curves.iter_mut().filter(|(measure, _)| measure.report() == report);
            curves.for_each(|(_, curve)| curve.interrupt());
        }
        let doors = self.doors.clone();
        let mut begin = |place: usize, label: String, text: Option<&str>| {
            let tone = if text.is_some() { Tone::Plain } else { Tone::Nothing };
            let key = (Group::Reports, STATUS_LANES + 100 * report as usize + place, label);
            self.begin(key, at, tone, text.unwrap_or("not published"), true);
        };
        if let VehicleStatusOutput::Doors(step) = output {
            let states = step.value();
            for (place, name) in doors.into_iter().enumerate() {
                let state = states.as_ref().and_then(|states| states.as_slice().get(place));
                begin(place, format!("{DOOR}{name}"), state.map(state_word).as_deref());
            }
        } else {
            begin(0, report.name().to_owned(), value.as_ref().map(|value| value.state.as_str()));
        }
    }

    fn turn_signal(&mut self, output: &TurnSignalOutput, at: MonoTime) {
        let (place, label, tone, text) = match output {
            TurnSignalOutput::TurnCommand { command, .. } => {
                let tone = match command {
                    TurnCommand::Left => Tone::Left,
                    TurnCommand::Right => Tone::Right,
                    TurnCommand::Disable => Tone::Off,
                    TurnCommand::NoCommand => Tone::Nothing,
                };
                (0, "decider: turn", tone, state_word(command))
            }
            TurnSignalOutput::HazardCommand { command, .. } => {
                let tone = match command {
                    HazardCommand::Enable => Tone::Hazard,
                    HazardCommand::Disable => Tone::Off,
                    HazardCommand::NoCommand => Tone::Nothing,
                };
                (1, "decider: hazard", tone, state_word(command))
            }
            TurnSignalOutput::Decision(_) | TurnSignalOutput::Sections { .. } => return,
        };
        self.begin((Group::Commands, place, label.to_owned()), at, tone, &text, false);
    }

    /// Begins a state of a lane, with the latest bound frame as its cause if `with_frame` is set.
    fn begin(&mut self, key: (Group, usize, String), at: MonoTime, tone: Tone, text: &str, with_frame: bool) {
        let present = self.lanes.get(&key).and_then(|lane| lane.spans.last());
        if present.is_some_and(|present| present.text == text && present.tone == tone && present.states == 1)
        {
            return;
        }
        let frame = if with_frame { self.causing_frame() } else { None };
        let lane =
            self.lanes.entry(key).or_insert_with_key(|(group, _, label)| Lane::new(*group, label.as_str()));
        lane.begin(seconds(at), tone, text, frame);
    }

    /// Stores the latest bound frame and returns its position.
    fn causing_frame(&mut self) -> Option<usize> {
        if self.last_kept.is_some() {
            return self.last_kept;
        }
        let (bus, frame, stamp, at) = self.last?;
        if self.frames.len() >= MAX_FRAMES {
            self.frames_left_out += 1;
            return None;
        }
        let message = self.reader.message_of(bus, frame.id());
        let mut signals: Vec<_> = self.unused.iter().map(|unused| format!("rejected: {unused}")).collect();
        let read = self.reader.signals(bus, &frame).into_iter();
        signals.extend(read.map(|ReadSignal { signal, raw, meanings, .. }| {
            format!("{} = {} {meanings}", signal.name, raw_and_bits(raw, &signal.codec))
        }));
        let bytes: Vec<_> = frame.data().iter().map(|byte| format!("{byte:02X}")).collect();
        self.frames.push(CausingFrame {
            at_s: seconds(at),
            stamp: stamp.candump_text(),
            interface: self.interface(bus),
            id: frame.id().to_string(),
            message: message.map_or_else(String::new, |message| message.name.clone()),
            bytes: bytes.join(" "),
            signals,
        });
        self.last_kept = Some(self.frames.len() - 1);
        self.last_kept
    }

    fn interface(&self, bus: BusIndex) -> String {
        self.interfaces.get(usize::from(bus.0)).cloned().unwrap_or_default()
    }
}

const fn topic_name(topic: LightsTopic) -> &'static str {
    match topic {
        LightsTopic::GroundTruth => "ground truth",
        LightsTopic::Camera => "camera",
        LightsTopic::V2i => "V2I",
        LightsTopic::Arbiter => "arbiter",
        LightsTopic::Markers => "markers",
        LightsTopic::Clock => "clock",
    }
}

const fn tone_of(state: RawState) -> Tone {
    match state {
        RawState::Faulty => Tone::Error,
        RawState::Hazard => Tone::Hazard,
        RawState::Left => Tone::Left,
        RawState::Right => Tone::Right,
        RawState::NotAvailable => Tone::Nothing,
        RawState::Off => Tone::Off,
        RawState::Other => Tone::Plain,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::built_in::BuiltIn;
    use crate::config::files::Disk;
    use crate::config::load_profile;
    use gateway_core::vehicle_lights::raw_state::raw_state;
    use gateway_core::vehicle_lights::role_texts::{roles, texts};

    /// Returns the expected tone for a text with one use.
    fn expected(text: &str) -> Tone {
        let ends_with = |ends: &[&str]| ends.iter().any(|end| text.ends_with(end));
        if ends_with(&["UNDEFINED", " fault"]) || (text.contains("fault") && text.ends_with(" on")) {
            Tone::Error
        } else if ends_with(&["not available"]) {
            Tone::Nothing
        } else if ends_with(&[" off", " idle"]) {
            Tone::Off
        } else if ends_with(&["left on", "left lamp on", " left", " left half", " left full"]) {
            Tone::Left
        } else if ends_with(&["right on", "right lamp on", " right", " right half", " right full"]) {
            Tone::Right
        } else if text.starts_with("hazard on") || text.ends_with("turn both") {
            Tone::Hazard
        } else {
            Tone::Plain
        }
    }

    #[test]
    fn every_value_of_every_profile_has_the_colour_of_its_meaning() {
        let mut signals_for_each_side = 0;
        for name in BuiltIn::Profile.names() {
            let settings = load_profile(&Disk, &BuiltIn::Profile.path(name).unwrap()).unwrap();
            let binding = &settings.gateway.lights;
            for role in roles(binding) {
                signals_for_each_side += usize::from(role.subject == "left" || role.subject == "left lamp");
                for (range, _) in &role.named {
                    let meanings = texts(binding, role.signal, range.first);
                    let [meaning] = meanings.as_slice() else { continue };
                    let found = tone_of(raw_state(binding, role.signal, range.first));
                    assert_eq!(found, expected(&meaning.text), "{name}: {}", meaning.text);
                }
            }
        }
        assert!(signals_for_each_side > 20, "{signals_for_each_side}");
    }
}
