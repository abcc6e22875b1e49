//! The configuration in effect, part by part: what a reload compares.
//!
//! Sections are taken apart field by field without `..`, so that a new key cannot be forgotten here.

use std::collections::BTreeMap;
use std::fmt::{self, Debug, Write};
use std::path::{Path, PathBuf};

use super::black_box::BlackBoxConfig;
use super::command::{CommandConfig, CommandTopics};
use super::http::HttpConfig;
use super::mcap::McapConfig;
use super::ros::RosConfig;
use super::status::StatusConfig;
use super::traffic_lights::LightTopics;
use super::turn_signal::{DeciderInputs, DeciderOutputs, TurnSignalConfig};
use super::{Settings, SourceKind};
use crate::core::can::bus::BusSettings;
use crate::core::command::settings::CommandSettings;
use crate::core::gateway::configuration::EffectiveConfiguration;
use crate::core::traffic_light::engine::LightsSettings;
use crate::core::traffic_light::flow::LightsFlowSettings as LightsFlow;
use crate::core::turn_signal::decider::DeciderSettings;
use crate::core::turn_signal::flow::{DeciderRole, TurnSignalSettings};
use crate::core::validation::table::SignalTable;
use crate::core::vehicle_lights::binding::{HazardBinding, LightsBinding, TurnBinding};
use crate::io::ros::settings::Transport;

/// Longest value that is shown as text; of a longer one only a digest is kept.
const MAX_TEXT: usize = 64;

impl Settings {
    /// The parts of the configuration, each with its value in effect. Takes as long as reading the largest map; call it
    /// outside the frame loop.
    pub fn effective(&self) -> EffectiveConfiguration {
        let mut parts = Parts::default();
        parts.process(self);
        parts.ros(&self.ros, &self.gateway.node, &self.hardware_id);
        parts.buses(self);
        parts.lights(&self.gateway.lights);
        parts.reload("[reports] publish", &self.gateway.publish);
        parts.reload("[diagnostics] period_ms", &self.gateway.diagnostics_period);
        if let Some(flow) = &self.gateway.traffic_lights {
            parts.light_topics(&self.light_topics);
            parts.traffic_lights(flow);
            parts.table("v2i", &self.gateway.v2i.table);
            parts.reload("vehicle profile [[v2i]]", &self.gateway.v2i.sources);
        }
        if let Some(decider) = self.turn_signal.as_ref().filter(|decider| decider.runs) {
            parts.decider(decider);
        }
        if let Some(command) = &self.command {
            parts.command(command);
        }
        EffectiveConfiguration { reloadable: parts.reloadable, fixed: parts.fixed }
    }
}

#[derive(Default)]
struct Parts {
    reloadable: BTreeMap<String, String>,
    fixed: BTreeMap<String, String>,
}

impl Parts {
    fn reload(&mut self, part: impl Into<String>, value: &dyn Debug) {
        self.reloadable.insert(part.into(), text(value));
    }

    fn fix(&mut self, part: impl Into<String>, value: &dyn Debug) {
        self.fixed.insert(part.into(), text(value));
    }

    fn process(&mut self, settings: &Settings) {
        let source = match settings.source {
            SourceKind::Socketcan => "socketcan",
            SourceKind::Recording => "recording",
        };
        self.fix("source", &source);
        let recording = settings.recording.as_ref().map(|recording| absolute(&recording.file));
        self.fix("[recording] file", &recording);
        self.reload("vehicle", &settings.vehicle);
        let BlackBoxConfig { folder, before, after, keep } = &settings.black_box;
        self.fix("[black_box] folder", &folder.as_deref().map(absolute));
        self.reload("[black_box] before_s", before);
        self.reload("[black_box] after_s", after);
        self.reload("[black_box] keep", keep);
        let StatusConfig { enabled, socket } = &settings.status;
        self.fix("[status] enabled", enabled);
        self.fix("[status] socket", &socket.as_deref().map(absolute));
        let HttpConfig { address, hosts, page, opens_browser: _ } = &settings.http;
        self.fix("[http] address", address);
        self.fix("[http] hosts", hosts);
        self.fix("[http] page", page);
        let McapConfig { folder, file_bytes, file_duration, total_bytes } = &settings.mcap;
        self.fix("[mcap] folder", &folder.as_deref().map(absolute));
        self.fix("[mcap] file_mb", file_bytes);
        self.fix("[mcap] file_s", file_duration);
        self.fix("[mcap] total_mb", total_bytes);
    }

    fn ros(&mut self, ros: &RosConfig, node: &str, hardware_id: &str) {
        let RosConfig {
            enabled,
            isolated: _,
            memory_limit_mb,
            namespace,
            remappings,
            domain_id,
            graph,
            only_networks,
            transport,
            durability,
            turn_indicators_status,
            hazard_lights_status,
            diagnostics,
            rosout,
        } = ros;
        self.fix("[ros] node", &node);
        self.fix("[ros] enabled", enabled);
        self.fix("[ros] memory_limit_mb", memory_limit_mb);
        self.fix("[ros] namespace", namespace);
        self.fix("remappings", remappings);
        self.fix("[ros] domain_id", domain_id);
        self.fix("[ros] graph", graph);
        self.fix("[ros] only_networks", only_networks);
        let (name, zenoh) = match transport {
            Transport::Dds => ("dds", None),
            Transport::Zenoh(zenoh) => ("zenoh", Some(zenoh)),
        };
        self.fix("[ros] transport", &name);
        self.fix("[ros.zenoh] config", &zenoh.map(|zenoh| &zenoh.config));
        self.fix("[ros.zenoh] type_hashes", &zenoh.map(|zenoh| zenoh.type_hashes));
        self.fix("[reports] durability", durability);
        self.fix("[ros.topics] turn_indicators_status", turn_indicators_status);
        self.fix("[ros.topics] hazard_lights_status", hazard_lights_status);
        self.fix("[ros.topics] diagnostics", diagnostics);
        self.fix("[ros] rosout", rosout);
        self.fix("[diagnostics] hardware_id", &hardware_id);
    }

    fn buses(&mut self, settings: &Settings) {
        let names: Vec<_> = settings.gateway.buses.iter().map(|bus| bus.name.as_str()).collect();
        self.fix("vehicle profile: buses", &names.join(", "));
        for (bus, receive_buffer) in settings.gateway.buses.iter().zip(&settings.receive_buffer_bytes) {
            let BusSettings {
                name,
                interface,
                heartbeat_messages,
                alive_timeout,
                wake_up_timeout,
                may_sleep,
            } = bus;
            self.fix(format!("[can.{name}] interface"), interface);
            self.fix(format!("[can.{name}] receive_buffer_bytes"), receive_buffer);
            self.reload(format!("vehicle profile [bus.{name}] heartbeat_messages"), heartbeat_messages);
            self.reload(format!("vehicle profile [bus.{name}] alive_timeout_ms"), alive_timeout);
            self.reload(format!("vehicle profile [bus.{name}] wake_up_timeout"), wake_up_timeout);
            self.reload(format!("vehicle profile [bus.{name}] may_sleep"), may_sleep);
        }
    }

    fn lights(&mut self, lights: &LightsBinding) {
        let LightsBinding { table, turn, turn_faults, hazard, hazard_faults, turn_while_hazard } = lights;
        self.table("lights", table);
        // Whether there is a topic at all.
        self.fix("vehicle profile: has [turn]", &!matches!(turn, TurnBinding::LeftOut));
        self.fix("vehicle profile: has [hazard]", &!matches!(hazard, HazardBinding::LeftOut));
        self.reload("vehicle profile [turn]", turn);
        self.reload("vehicle profile [turn] faults", turn_faults);
        self.reload("vehicle profile [hazard]", hazard);
        self.reload("vehicle profile [hazard] faults", hazard_faults);
        self.reload("vehicle profile: turn_while_hazard", turn_while_hazard);
    }

    /// The messages and signals of a flow, by their names in the DBC.
    fn table(&mut self, flow: &str, table: &SignalTable) {
        for message in &table.messages {
            let (bus, name) = (message.bus.0, &message.name);
            let part = |what: &str| format!("{flow}: message {name} on bus {bus}: {what}");
            self.reload(part("timeout"), &message.timing);
            self.reload(part("frame"), &(message.id, message.format));
            self.reload(part("integrity"), &message.integrity);
        }
        for signal in &table.signals {
            let bus = table.messages.get(signal.message.0).map_or(0, |message| message.bus.0);
            self.reload(format!("{flow}: signal {} on bus {bus}", signal.name), &signal.codec);
        }
    }

    fn light_topics(&mut self, topics: &LightTopics) {
        let LightTopics { compat, outputs, inputs, camera, command, use_sim_time, not_interpreted: _ } =
            topics;
        self.fix("[traffic_lights]", &"configured");
        self.fix("[traffic_lights] compat", compat);
        self.fix("[traffic_lights] use_sim_time", use_sim_time);
        for output in outputs {
            let part = format!("[traffic_lights.topics] {}", output.name);
            self.fix(part, &(output.topic, output.message));
        }
        for (store, name) in inputs {
            self.fix(format!("[traffic_lights.inputs] {name}"), store);
        }
        self.fix("[traffic_lights.inputs] camera", camera);
        self.fix("[traffic_lights.inputs] command", command);
    }

    fn traffic_lights(&mut self, flow: &LightsFlow) {
        // The rest follows from the topics and the mode.
        let LightsFlow { lights, camera_faults, v2i_faults, arbiter, external_camera: _, use_sim_time: _ } =
            flow;
        let LightsSettings {
            map,
            scenario,
            quirks: _,
            frame_rate,
            first_frame: _,
            ground_truth_rate,
            v2i_rate,
            copy_on_enable,
            one_group_per_head,
            v2i_timeout,
            topics: _,
        } = lights;
        self.reload("[traffic_lights] map", map);
        self.reload("[traffic_lights] scenario", scenario);
        self.reload("[traffic_lights] frame_rate_hz", &frame_rate.as_hz());
        self.reload("[traffic_lights] ground_truth_rate_hz", &ground_truth_rate.as_hz());
        self.reload("[traffic_lights] v2i_rate_hz", &v2i_rate.as_hz());
        self.reload("[traffic_lights] copy_on_enable", copy_on_enable);
        self.reload("[traffic_lights] one_group_per_head", one_group_per_head);
        self.reload("[traffic_lights] v2i_timeout_ms", v2i_timeout);
        self.reload("[traffic_lights.faults.camera]", camera_faults);
        self.reload("[traffic_lights.faults.v2i]", v2i_faults);
        self.reload("[traffic_lights.arbiter]", arbiter);
    }

    fn decider(&mut self, decider: &TurnSignalConfig) {
        let TurnSignalConfig { flow, runs: _, map: _, inputs, outputs } = decider;
        let TurnSignalSettings { decider, road, role, period, publishes_sections: _ } = flow;
        let DeciderSettings {
            compat,
            parameters,
            vehicle,
            age_limits,
            min_durations,
            standing_limit,
            waits_for_junctions,
            country,
        } = decider;
        match role {
            DeciderRole::Command => self.fix("[turn_signal]", &"enabled"),
            DeciderRole::Shadow { tolerance } => {
                self.fix("[turn_signal]", &"shadow");
                self.reload("[turn_signal] shadow_tolerance_ms", tolerance);
            }
        }
        self.reload("[turn_signal] map", road);
        self.reload("[turn_signal] compat", compat);
        self.reload("[turn_signal] parameters", parameters);
        self.reload("[turn_signal] vehicle", vehicle);
        self.reload("[turn_signal] age limits", age_limits);
        self.reload("[turn_signal] min_durations", min_durations);
        self.reload("[turn_signal] standing limit", standing_limit);
        self.reload("[turn_signal] waits_for_junctions", waits_for_junctions);
        let legal_m = country.as_ref().and_then(|country| country.turn_distance_m);
        self.reload("[turn_signal] country's least distance of a turn, m", &legal_m);
        self.reload("[turn_signal] planning_hz", period);
        let DeciderInputs {
            odometry,
            route,
            planned_path,
            planning_factors,
            modified_goal,
            operation_mode,
            scenario,
            hazard_request,
            own_turn_command,
            own_hazard_command,
        } = inputs;
        self.fix("[turn_signal.inputs] odometry", odometry);
        self.fix("[turn_signal.inputs] route", route);
        self.fix("[turn_signal.inputs] planned_path", planned_path);
        self.fix("[turn_signal.inputs] planning_factors", planning_factors);
        self.fix("[turn_signal.inputs] modified_goal", modified_goal);
        self.fix("[turn_signal.inputs] operation_mode", operation_mode);
        self.fix("[turn_signal.inputs] scenario", scenario);
        self.fix("[turn_signal.inputs] hazard_request", hazard_request);
        self.fix("[turn_signal.inputs] own_turn_command", own_turn_command);
        self.fix("[turn_signal.inputs] own_hazard_command", own_hazard_command);
        let DeciderOutputs { turn_command, hazard_command, markers, planning_factors } = outputs;
        self.fix("[turn_signal.outputs] turn_command", turn_command);
        self.fix("[turn_signal.outputs] hazard_command", hazard_command);
        self.fix("[turn_signal.outputs] markers", markers);
        self.fix("[turn_signal.outputs] planning_factors", planning_factors);
    }

    /// Frames to the vehicle carry counters and obey its rules: the machine that sends them never changes while it runs.
    fn command(&mut self, command: &CommandConfig) {
        let CommandConfig { settings, binding, topics } = command;
        let CommandSettings { source, transmit, mode_from, turn_timeout, hazard_timeout, rules, limits } =
            settings;
        self.fix("[command] source", source);
        self.fix("[command] tx", transmit);
        self.fix("[command] control_mode", mode_from);
        self.fix("[command] turn_timeout_ms", turn_timeout);
        self.fix("[command] hazard_timeout_ms", hazard_timeout);
        self.fix("[command] on_turn_timeout", &rules.on_turn_timeout);
        self.fix("[command] on_hazard_timeout", &rules.on_hazard_timeout);
        self.fix("[command] on_shutdown", &rules.on_shutdown);
        self.fix("[command] warn_after_ms", &limits.warn);
        self.fix("[command] error_after_ms", &limits.error);
        let CommandTopics { turn_indicators_cmd, hazard_lights_cmd, control_mode } = topics;
        self.fix("[command.topics] turn_indicators_cmd", turn_indicators_cmd);
        self.fix("[command.topics] hazard_lights_cmd", hazard_lights_cmd);
        self.fix("[command.topics] control_mode", control_mode);
        self.fix("vehicle profile [command]", binding);
    }
}

/// The same path for processes in different folders.
fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// The text of a short value, or `#` and a digest.
fn text(value: &dyn Debug) -> String {
    let mut digest = Digest { text: String::new(), hash: Digest::OFFSET };
    // A digest takes any text.
    let _ = write!(digest, "{value:?}");
    let Digest { text, hash } = digest;
    if text.len() > MAX_TEXT {
        return format!("#{hash:016x}");
    }
    let text = if text == "None" { "none" } else { &text };
    let text = text.strip_prefix("Some(").and_then(|text| text.strip_suffix(')')).unwrap_or(text);
    text.trim_matches('"').to_owned()
}

/// The beginning of a text, and the FNV-1a digest of all of it: the same in every process, which `Hash` is not.
struct Digest {
    text: String,
    hash: u64,
}

impl Digest {
    const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x0100_0000_01b3;
}

impl Write for Digest {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        if self.text.len() <= MAX_TEXT {
            self.text.push_str(text);
        }
        self.hash =
            text.bytes().fold(self.hash, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(Self::PRIME));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::files::{DEMO_CONFIG, Embedded, Files};
    use crate::config::{Overrides, load};
    use crate::core::gateway::configuration::{changes_text, plan};

    struct Edited(&'static str, &'static str);

    impl Files for Edited {
        fn read(&self, path: &Path) -> std::io::Result<Vec<u8>> {
            let text = String::from_utf8(Embedded.read(path)?).unwrap();
            Ok(text.replace(self.0, self.1).into_bytes())
        }
    }

    fn effective(from: &'static str, to: &'static str) -> EffectiveConfiguration {
        load(&Edited(from, to), Path::new(DEMO_CONFIG), &Overrides::default()).unwrap().effective()
    }

    #[test]
    fn short_values_are_shown_and_long_ones_compared() {
        assert_eq!(text(&Some("can0")), "can0");
        assert_eq!((text(&None::<u8>), text(&true)), ("none".to_owned(), "true".to_owned()));
        let [one, same, other] = ["x", "x", "y"].map(|text| super::text(&text.repeat(MAX_TEXT + 1)));
        assert!(one == same && one != other && one.starts_with('#'), "{one} {other}");
    }

    #[test]
    fn same_files_are_the_same_configuration_and_each_change_is_named() {
        let before = effective("", "");
        assert!(plan(&before, &effective("", "")).is_empty());
        let timeout =
            plan(&before, &effective("[turn]", "[message.BCM_TurnIndicators]\ntimeout_ms = 300\n[turn]"));
        assert_eq!(timeout.restart, [], "a threshold is reloaded");
        let text = changes_text(&timeout.reloadable);
        assert!(text.contains("250ms") && text.contains("300ms"), "{text}");
        let interface = plan(&before, &effective("interface = \"can0\"", "interface = \"can7\""));
        assert_eq!(changes_text(&interface.restart), "[can.body] interface: can0 → can7");
        assert_eq!(interface.reloadable, []);
    }
}
