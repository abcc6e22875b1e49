//! Checks of the sections of the gateway's file that need no file of their own.

use std::path::Path;
use std::time::Duration;

use toml::Spanned;

use super::file::{BlackBoxFile, GatewayFile, PublishFile, RecordingFile};
use super::problem::{Document, Problem};
use super::settings::{BlackBoxConfig, Recording, RosConfig};
use super::vehicle::Vehicle;
use crate::core::vehicle_lights::report::Publish;

const DEFAULT_RATE_HZ: f64 = 10.0;
const DEFAULT_DIAGNOSTICS_MS: u64 = 250;
const DEFAULT_RECEIVE_BUFFER: usize = 4 << 20;

pub(super) struct Checks<'a> {
    pub(super) document: &'a Document,
    pub(super) problems: Vec<Problem>,
}

impl Checks<'_> {
    pub(super) fn refuse_at(&mut self, at: std::ops::Range<usize>, reason: impl Into<String>, remedy: &str) {
        self.problems.push(self.document.problem(at, reason, remedy));
    }

    pub(super) fn refuse<T>(&mut self, value: &Spanned<T>, reason: impl Into<String>, remedy: &str) {
        self.refuse_at(value.span(), reason, remedy);
    }

    /// A ROS name: letters, digits and underscores, not beginning with a digit.
    pub(super) fn name(&mut self, given: Option<&Spanned<String>>, default: &str) -> String {
        if let Some(name) = given.filter(|name| !is_ros_name(name.get_ref())) {
            self.refuse(
                name,
                format!("{:?} is no ROS name", name.get_ref()),
                "use letters, digits and _, no digit first",
            );
        }
        given.map_or(default.to_owned(), |name| name.get_ref().clone())
    }

    /// An absolute topic: `/a/b`.
    fn topic(&mut self, given: Option<&Spanned<String>>, default: &str) -> String {
        if let Some(topic) = given.filter(|topic| !is_topic(topic.get_ref())) {
            self.refuse(topic, format!("{:?} is no absolute topic", topic.get_ref()), "write it as /a/b");
        }
        given.map_or(default.to_owned(), |topic| topic.get_ref().clone())
    }

    pub(super) fn publish(&mut self, file: &GatewayFile) -> Publish {
        let rate = file.reports.rate_hz.as_ref();
        match file.reports.publish {
            PublishFile::OnChange => {
                if let Some(rate) = rate {
                    self.refuse(rate, "on_change has no rate", "remove it, or use publish = \"periodic\"");
                }
                Publish::OnChange
            }
            PublishFile::Periodic => {
                if let Some(rate) = rate.filter(|rate| !(0.1..=1000.0).contains(rate.get_ref())) {
                    self.refuse(
                        rate,
                        format!("{} Hz cannot be published", rate.get_ref()),
                        "give 0.1 to 1000 Hz",
                    );
                    return Publish::OnChange;
                }
                Publish::Periodic(Duration::from_secs_f64(
                    1.0 / rate.map_or(DEFAULT_RATE_HZ, |rate| *rate.get_ref()),
                ))
            }
        }
    }

    pub(super) fn diagnostics_period(&mut self, file: &GatewayFile) -> Duration {
        let given = file.diagnostics.period_ms.as_ref();
        if let Some(period) = given.filter(|period| !(20..=500).contains(period.get_ref())) {
            let remedy = "give 20 to 500 ms: aggregators call a status stale after 1 s";
            self.refuse(period, format!("{} ms is no usable refresh period", period.get_ref()), remedy);
        }
        Duration::from_millis(given.map_or(DEFAULT_DIAGNOSTICS_MS, |period| *period.get_ref()))
    }

    pub(super) fn ros(&mut self, file: &GatewayFile) -> RosConfig {
        let ros = &file.ros;
        let namespace = match &ros.namespace {
            Some(root) if root.get_ref() == "/" => "/".to_owned(),
            namespace => self.topic(namespace.as_ref(), "/"),
        };
        if let Some(domain) = ros.domain_id.as_ref().filter(|domain| *domain.get_ref() > 232) {
            self.refuse(domain, format!("domain {} has no ports", domain.get_ref()), "give 0 to 232");
        }
        let topics = &ros.topics;
        RosConfig {
            enabled: ros.enabled.unwrap_or(true),
            namespace,
            domain_id: ros.domain_id.as_ref().map(|domain| *domain.get_ref()),
            only_networks: ros.only_networks.clone(),
            durability: file.reports.durability,
            turn_indicators_status: self
                .topic(topics.turn_indicators_status.as_ref(), "/vehicle/status/turn_indicators_status"),
            hazard_lights_status: self
                .topic(topics.hazard_lights_status.as_ref(), "/vehicle/status/hazard_lights_status"),
            diagnostics: self.topic(topics.diagnostics.as_ref(), "/diagnostics"),
        }
    }

    pub(super) fn black_box(&mut self, file: &BlackBoxFile) -> BlackBoxConfig {
        let mut seconds = |given: &Option<Spanned<u64>>, default: u64| {
            if let Some(time) = given.as_ref().filter(|time| !(1..=300).contains(time.get_ref())) {
                self.refuse(time, format!("{} s cannot be kept", time.get_ref()), "give 1 to 300 s");
            }
            Duration::from_secs(given.as_ref().map_or(default, |time| *time.get_ref()))
        };
        let (before, after) = (seconds(&file.before_s, 30), seconds(&file.after_s, 10));
        if let Some(keep) = file.keep.as_ref().filter(|keep| !(1..=1000).contains(keep.get_ref())) {
            self.refuse(keep, format!("{} recordings cannot be kept", keep.get_ref()), "give 1 to 1000");
        }
        let folder = file.folder.as_ref();
        let beside = self.document.path().parent().unwrap_or(Path::new(""));
        BlackBoxConfig {
            folder: folder.map(|folder| beside.join(folder.get_ref())),
            before,
            after,
            keep: file.keep.as_ref().map_or(20, |keep| *keep.get_ref()),
        }
    }

    pub(super) fn recording(&mut self, file: &RecordingFile) -> Recording {
        if let Some(speed) = file.speed.as_ref().filter(|speed| !(0.01..=1000.0).contains(speed.get_ref())) {
            self.refuse(
                speed,
                format!("{} is no usable speed", speed.get_ref()),
                "give 0.01 to 1000 (1 = original)",
            );
        }
        Recording {
            file: self.document.path().parent().unwrap_or(Path::new("")).join(file.file.get_ref()),
            speed: file.speed.as_ref().map_or(1.0, |speed| *speed.get_ref()),
            repeat: file.repeat,
            stamps: file.stamps,
        }
    }

    /// Interface and receive buffer of each bus of the vehicle, in its order.
    pub(super) fn cans(&mut self, file: &GatewayFile, vehicle: &Vehicle) -> Vec<(String, usize)> {
        let buses: Vec<_> = vehicle.buses.iter().map(|bus| bus.name.as_str()).collect();
        let known = buses.join(", ");
        for (name, _) in file.can.iter().filter(|(name, _)| !buses.contains(&name.get_ref().as_str())) {
            self.refuse(
                name,
                format!("the vehicle profile has no bus {}", name.get_ref()),
                &format!("it has {known}"),
            );
        }
        let mut taken: Vec<&str> = Vec::new();
        for can in file.can.values() {
            let interface = can.interface.get_ref();
            if !is_interface_name(interface) {
                let remedy = "give 1 to 15 characters without spaces and slashes, e.g. can0";
                self.refuse(&can.interface, format!("{interface:?} is no interface name"), remedy);
            }
            if taken.contains(&interface.as_str()) {
                self.refuse(
                    &can.interface,
                    format!("{interface} serves two buses"),
                    "give each bus its own interface",
                );
            }
            taken.push(interface);
            if let Some(bytes) =
                can.receive_buffer_bytes.as_ref().filter(|bytes| !(4096..=1 << 30).contains(bytes.get_ref()))
            {
                self.refuse(
                    bytes,
                    format!("{} bytes is no usable buffer", bytes.get_ref()),
                    "give 4096 to 1073741824",
                );
            }
        }
        let mut cans = Vec::new();
        for bus in buses {
            match file.can.get(bus) {
                Some(can) => {
                    let buffer = can.receive_buffer_bytes.as_ref();
                    cans.push((
                        can.interface.get_ref().clone(),
                        buffer.map_or(DEFAULT_RECEIVE_BUFFER, |bytes| *bytes.get_ref()),
                    ));
                }
                None => self.refuse_at(
                    0..0,
                    format!("bus {bus} of the vehicle profile has no interface"),
                    &format!("add [can.{bus}] interface = \"can0\""),
                ),
            }
        }
        cans
    }
}

/// An absolute topic: `/a/b`.
pub(super) fn is_topic(topic: &str) -> bool {
    topic.strip_prefix('/').is_some_and(|rest| rest.split('/').all(is_ros_name))
}

fn is_ros_name(name: &str) -> bool {
    name.chars().next().is_some_and(|first| first.is_ascii_alphabetic() || first == '_')
        && name.chars().all(|char| char.is_ascii_alphanumeric() || char == '_')
}

/// As the kernel's `dev_valid_name`.
fn is_interface_name(name: &str) -> bool {
    (1..=15).contains(&name.len())
        && name != "."
        && name != ".."
        && name.chars().all(|char| char.is_ascii_graphic() && char != '/' && char != ':')
}
