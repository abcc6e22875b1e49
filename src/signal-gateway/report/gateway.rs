//! Formats outputs of the gateway: messages as JSON lines for programs, changes as text lines for users.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;
use serde_json::json;

use super::text::escaped;
use super::{decision, seconds};
use crate::io::ros::messages::LightsMessage;
use crate::io::ros::outgoing::messages::{Publication, publications};
use crate::io::ros::topics::Topics;
use can_signal::can::{BusIndex, CanId, Frame};
use gateway_base::diagnostics::{Level, Status};
use gateway_base::time::MonoTime;
use gateway_core::command::output::CommandOutput;
use gateway_core::gateway::event::Output;
use gateway_core::gateway::history::{Change, ChangeKind};
use gateway_core::vehicle_status::output::NamedValue;
use traffic_lights::emission::Emission;
use traffic_lights::output::TrafficLightOutput;
use turn_signal::output::TurnSignalOutput;

/// One object per line: `{"t": seconds, "topic": name, "data": {message fields}}`.
///
/// Every published report is a line. Diagnostics are a line whenever a status changes, with the changed
/// statuses; plain refreshes are omitted. A decision of the turn signal decider is a line when it or its
/// reason has changed; its topic is [`DECISIONS`] and its data an object, see [`decision::fields`]. A frame
/// to the vehicle is a line with the topic [`FRAMES`] and the data `{"bus": name, "id": number, "extended":
/// bool, "fd": bool, "data": "hex", "sent": bool}`; `sent` is false in a dry run, and always in a replay.
#[derive(Debug, Clone)]
pub struct JsonTimeline {
    /// Names of the topics, as configured.
    pub topics: Topics,
    /// `hardware_id` of each status.
    pub hardware_id: String,
    /// Name of each bus, by its index.
    pub buses: Vec<String>,
}

/// Used as the topic of decisions, which are not published.
pub const DECISIONS: &str = "turn_signal_decision";

/// Used as the topic of frames to the vehicle, which are not published.
pub const FRAMES: &str = "command_frame";

#[derive(Serialize)]
struct JsonLine<'a, T> {
    /// Virtual time, seconds, to the nanosecond.
    t: f64,
    topic: &'a str,
    data: T,
}

impl JsonTimeline {
    /// Returns the line for an output, without line end; `None` for outputs that are not messages and for
    /// refreshes. Traffic lights are one line per message and topic.
    pub fn line(&self, output: &Output, at: MonoTime) -> Option<String> {
        match output {
            Output::TrafficLights(TrafficLightOutput::Publish(emission)) => self.lights(emission, at),
            Output::TurnSignal(TurnSignalOutput::Decision(decision)) => {
                line(at, DECISIONS, decision::fields(decision))
            }
            Output::Command(CommandOutput::Transmit { frame, .. }) => {
                self.frame(frame.bus(), frame.frame(), true, at)
            }
            Output::Command(CommandOutput::WouldTransmit { bus, frame, .. }) => {
                self.frame(*bus, frame, false, at)
            }
            Output::Diagnostics { diagnostics, .. } if diagnostics.refresh => None,
            // Meant for viewers on ROS; the lines have sections in the decisions.
            Output::TurnSignal(TurnSignalOutput::Sections { .. }) => None,
            Output::VehicleLights(_)
            | Output::VehicleStatus(_)
            | Output::TrafficLights(_)
            | Output::TurnSignal(_)
            | Output::Diagnostics { .. } => self.published(output, at),
        }
    }

    fn published(&self, output: &Output, at: MonoTime) -> Option<String> {
        lines(publications(output, &self.hardware_id).into_iter().filter_map(|(topic, publication)| {
            let (Publication::Publish(message), Some(name)) = (publication, self.topics.name(topic)) else {
                return None;
            };
            // Plain structs of numbers and strings: this cannot fail.
            let [t, topic] = [serde_json::to_string(&seconds(at)).ok()?, serde_json::to_string(name).ok()?];
            Some(format!(r#"{{"t":{t},"topic":{topic},"data":{}}}"#, message.json().ok()?))
        }))
    }

    fn frame(&self, bus: BusIndex, frame: &Frame, sent: bool, at: MonoTime) -> Option<String> {
        let bus = self.buses.get(usize::from(bus.0)).map_or("", String::as_str);
        let data: String = frame.data().iter().map(|byte| format!("{byte:02X}")).collect();
        let extended = matches!(frame.id(), CanId::Extended(_));
        let fields = json!({
            "bus": bus, "id": frame.id().number(), "extended": extended, "fd": frame.is_fd(),
            "data": data, "sent": sent,
        });
        line(at, FRAMES, fields)
    }

    fn lights(&self, emission: &Emission, at: MonoTime) -> Option<String> {
        let topics = self.topics.lights.iter().filter(|lights_topic| lights_topic.topic == emission.topic);
        lines(topics.flat_map(|lights_topic| {
            let messages = LightsMessage::of(emission, lights_topic.lights, lights_topic.compat);
            messages.into_iter().filter_map(|message| line(at, &lights_topic.name, message))
        }))
    }
}

/// Joins lines; `None` if there are none.
fn lines(lines: impl Iterator<Item = String>) -> Option<String> {
    lines.reduce(|lines, line| lines + "\n" + &line)
}

fn line(at: MonoTime, topic: &str, data: impl Serialize) -> Option<String> {
    // Plain structs of numbers and strings: this cannot fail.
    serde_json::to_string(&JsonLine { t: seconds(at), topic, data }).ok()
}

/// A change of a report or of a status, or a new frame to the vehicle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Event {
    /// The change, e.g. of `turn_indicators` to `left`, or to `no longer published`.
    pub change: Change,
    /// Signals concerned, as named in the status.
    pub signals: Vec<String>,
}

impl Event {
    fn new(kind: ChangeKind, level: Level, subject: &str, text: String) -> Self {
        let change = Change { kind, level, subject: subject.to_owned(), text, remedy: String::new() };
        Self { change, signals: Vec::new() }
    }

    /// Returns the message of a status that is not OK; empty for other events.
    pub fn cause(&self) -> &str {
        let is_bad = self.change.kind == ChangeKind::Status && self.change.level > Level::Ok;
        if is_bad { &self.change.text } else { "" }
    }

    /// Returns the `MESSAGE_ID` for the journal: one per kind, and per level of a status. They never change.
    pub fn message_id(&self) -> &'static str {
        match (self.change.kind, self.change.level) {
            (ChangeKind::ReportPublished, _) => "4c1e8a4b0f5d4a0e9f0b6a3d7c52e101",
            (ChangeKind::ReportWithdrawn, _) => "4c1e8a4b0f5d4a0e9f0b6a3d7c52e102",
            (ChangeKind::CommandSent, _) => "4c1e8a4b0f5d4a0e9f0b6a3d7c52e120",
            (_, Level::Ok) => "4c1e8a4b0f5d4a0e9f0b6a3d7c52e110",
            (_, Level::Warn | Level::Stale) => "4c1e8a4b0f5d4a0e9f0b6a3d7c52e111",
            (_, Level::Error) => "4c1e8a4b0f5d4a0e9f0b6a3d7c52e112",
        }
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Change { level, subject, text, .. } = &self.change;
        write!(f, "{:<5} {:<16} {}", level.to_string(), escaped(subject), escaped(text))
    }
}

/// Finds the changes in a stream of outputs.
#[derive(Debug, Clone, Default)]
pub struct Changes {
    /// Published reports by name, each with the word for its value.
    pub reports: BTreeMap<&'static str, String>,
    statuses: BTreeMap<String, (Level, String)>,
}

impl Changes {
    /// Returns the changes in this output.
    pub fn of(&mut self, output: &Output) -> Vec<Event> {
        let event = match output {
            Output::VehicleLights(output) => {
                let (report, value) = output.named();
                let value = value.map(|state| NamedValue { state, measured: String::new() });
                self.published(report, value)
            }
            Output::VehicleStatus(output) => self.published(output.report().name(), output.named()),
            Output::Diagnostics { diagnostics, .. } => {
                return diagnostics.statuses.iter().filter_map(|status| self.status(status)).collect();
            }
            // Many per second, whether changed or not. Diagnostics contain the decisions.
            Output::TrafficLights(_) | Output::TurnSignal(_) => None,
            Output::Command(CommandOutput::Transmit { frame, is_news }) => {
                is_news.then(|| commanded("sends", frame.frame()))
            }
            Output::Command(CommandOutput::WouldTransmit { frame, is_news, .. }) => {
                is_news.then(|| commanded("would send", frame))
            }
        };
        event.into_iter().collect()
    }

    /// Records the value of a report, whose change is an event; `None` if the report is withdrawn.
    fn published(&mut self, report: &'static str, value: Option<NamedValue>) -> Option<Event> {
        let before = match &value {
            Some(value) => self.reports.insert(report, value.state.clone()),
            None => self.reports.remove(report),
        };
        if before.as_ref() == value.as_ref().map(|value| &value.state) {
            return None;
        }
        let (level, text, kind) = match value {
            Some(value) => (Level::Ok, value.to_string(), ChangeKind::ReportPublished),
            None => (Level::Warn, "no longer published".to_owned(), ChangeKind::ReportWithdrawn),
        };
        Some(Event::new(kind, level, report, text))
    }

    fn status(&mut self, status: &Status) -> Option<Event> {
        let now = (status.level, status.message.clone());
        if self.statuses.get(&status.task) == Some(&now) {
            return None;
        }
        self.statuses.insert(status.task.clone(), now);
        let mut event = Event::new(ChangeKind::Status, status.level, &status.task, status.message.clone());
        (event.change.remedy, event.signals) = (status.remedy.clone(), status.signals.clone());
        Some(event)
    }
}

fn commanded(verb: &str, frame: &Frame) -> Event {
    Event::new(ChangeKind::CommandSent, Level::Ok, FRAMES, format!("{verb} {frame}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::ros::messages::LightsType;
    use crate::io::ros::topics::LightsTopicSettings;
    use crate::process_status::catalogue::LOG;
    use gateway_base::diagnostics::Diagnostics;
    use gateway_base::time::WallStamp;
    use gateway_core::vehicle_lights::output::VehicleLightsOutput;
    use gateway_core::vehicle_lights::verdict::TurnIndicators;
    use gateway_core::vehicle_report::Step;
    use traffic_lights::compat::Compat;
    use traffic_lights::emission::{GroupState, LightsContent, LightsTopic};

    fn timeline(topics: Topics) -> JsonTimeline {
        JsonTimeline { topics, hardware_id: "car".into(), buses: vec!["body".into()] }
    }

    fn left() -> Output {
        let step = Step::Publish(TurnIndicators::EnableLeft, WallStamp::from_nanos(1_500_000_001));
        Output::VehicleLights(VehicleLightsOutput::TurnIndicators(step))
    }

    const WITHDRAW: Output = Output::VehicleLights(VehicleLightsOutput::TurnIndicators(Step::Withdraw));

    fn status(level: Level, refresh: bool) -> Output {
        let values = vec![("age_ms", "3".to_owned())];
        let status = Status { level, message: "text".to_owned(), ..Status::new(&LOG, "can0", &[], values) };
        let statuses = vec![status];
        let diagnostics = Diagnostics { node: "gw".into(), statuses, refresh };
        Output::Diagnostics { diagnostics, stamp: WallStamp::from_nanos(2_000_000_000) }
    }

    #[test]
    fn json_lines_are_the_contract() {
        let timeline = timeline(Topics::default());
        assert_eq!(
            timeline.line(&left(), MonoTime::from_nanos(1_250_000_000)).unwrap(),
            r#"{"t":1.25,"topic":"/vehicle/status/turn_indicators_status","data":{"stamp":{"sec":1,"nanosec":500000001},"report":2}}"#
        );
        assert_eq!(
            timeline.line(&status(Level::Error, false), MonoTime::from_millis(3)).unwrap(),
            r#"{"t":0.003,"topic":"/diagnostics","data":{"header":{"stamp":{"sec":2,"nanosec":0},"frame_id":""},"status":[{"level":2,"name":"gw: can0","message":"text","hardware_id":"car","values":[{"key":"age_ms","value":"3"}]}]}}"#
        );
        assert_eq!(timeline.line(&status(Level::Error, true), MonoTime::ZERO), None);
        assert_eq!(timeline.line(&WITHDRAW, MonoTime::ZERO), None);
    }

    #[test]
    fn traffic_lights_are_a_line_on_each_of_their_topics() {
        let lights_topic = |topic, name: &str| LightsTopicSettings {
            topic,
            name: name.to_owned(),
            lights: LightsType::GroupArray,
            compat: Compat::Improved,
        };
        let (v2i, camera) = (LightsTopic::V2i, LightsTopic::Camera);
        let lights = vec![lights_topic(v2i, "/a"), lights_topic(camera, "/b"), lights_topic(v2i, "/c")];
        let mut topics = Topics::default();
        topics.lights = lights;
        let timeline = timeline(topics);
        let emission = |topic| {
            let groups = vec![GroupState { relation_id: 7, ..GroupState::default() }];
            let (stamp, content) = (WallStamp::from_nanos(3), LightsContent::groups(groups));
            Output::TrafficLights(TrafficLightOutput::Publish(Emission { topic, stamp, content }))
        };
        let data = r#"{"stamp":{"sec":0,"nanosec":3},"traffic_light_groups":[{"traffic_light_group_id":7,"elements":[],"predictions":[]}]}"#;
        let line = |topic: &str| format!(r#"{{"t":0.0,"topic":"{topic}","data":{data}}}"#);
        assert_eq!(
            timeline.line(&emission(v2i), MonoTime::ZERO).unwrap(),
            format!("{}\n{}", line("/a"), line("/c"))
        );
        assert_eq!(timeline.line(&emission(LightsTopic::Arbiter), MonoTime::ZERO), None);
    }

    #[test]
    fn every_frame_to_the_vehicle_is_a_json_line_and_new_ones_are_lines_for_people() {
        let timeline = timeline(Topics::default());
        let frame = Frame::classic(CanId::Extended(0x130), &[1, 0xFF]).unwrap();
        let output =
            |is_news| Output::Command(CommandOutput::WouldTransmit { bus: BusIndex(0), frame, is_news });
        let line = r#"{"t":0.0,"topic":"command_frame","data":{"bus":"body","id":304,"extended":true,"fd":false,"data":"01FF","sent":false}}"#;
        for is_news in [false, true] {
            assert_eq!(timeline.line(&output(is_news), MonoTime::ZERO).unwrap(), line);
            let events = Changes::default().of(&output(is_news));
            let texts: Vec<_> = events.into_iter().map(|event| event.change.text).collect();
            assert_eq!(texts, vec!["would send 00000130#01FF"; usize::from(is_news)]);
        }
    }

    #[test]
    fn only_changes_are_lines_for_people() {
        let mut changes = Changes::default();
        assert_eq!(changes.of(&left())[0].change.text, "left");
        assert!(changes.of(&left()).is_empty());
        assert_eq!(changes.of(&WITHDRAW)[0].change.text, "no longer published");
        assert!(changes.of(&WITHDRAW).is_empty());
        assert_eq!(changes.of(&status(Level::Error, false)).len(), 1);
        assert!(changes.of(&status(Level::Error, true)).is_empty());
        assert_eq!(changes.of(&status(Level::Ok, false))[0].to_string(), "OK    can0             text");
    }
}
