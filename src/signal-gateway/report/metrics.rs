//! The current state as metrics for Prometheus: `OpenMetrics` text, or the older text format.
//!
//! `docs/metrics.md` lists them, and comes with a dashboard and alert rules.

use std::collections::BTreeSet;
use std::fmt;

use prometheus_client::collector::Collector;
use prometheus_client::encoding::{DescriptorEncoder, MetricEncoder, NoLabelSet, text};
use prometheus_client::metrics::MetricType;
use prometheus_client::registry::{Registry, Unit};

use super::counts::{self, Count};
use crate::process_status::snapshot::{ProcessSnapshot, Snapshot};
use can_signal::can::{BusSnapshot, LinkState};
use gateway_base::names::{state_word, variant_name};
use gateway_core::control_mode::ControlMode;
use gateway_core::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use gateway_core::vehicle_report::FailureCounts;
use gateway_core::vehicle_status::VehicleStatusSnapshot;
use gateway_core::vehicle_status::doors::DoorState;
use gateway_core::vehicle_status::gear::Gear;
use gateway_core::vehicle_status::measure::MeasureRow;
use turn_signal::light_command::Numbered as _;

/// Media type of [`openmetrics`].
pub const OPENMETRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";
/// Media type of [`classic`].
pub const CLASSIC: &str = "text/plain; version=0.0.4; charset=utf-8";

/// Returns the metrics as `OpenMetrics` text.
pub fn openmetrics(snapshot: &Snapshot) -> String {
    let mut registry = Registry::with_prefix("signal_gateway");
    registry.register_collector(Box::new(Metrics(snapshot.clone())));
    let mut written = String::new();
    // Writing to a String cannot fail.
    let _ = text::encode(&mut written, &registry);
    written
}

/// Returns the metrics in the older text format, where a counter's name ends in `_total` everywhere.
pub fn classic(snapshot: &Snapshot) -> String {
    let written = openmetrics(snapshot);
    let suffixes = |kind: &'static str, suffix: &'static str| {
        let types = written.lines().filter_map(|line| line.strip_prefix("# TYPE "));
        types.filter_map(move |line| Some((line.strip_suffix(kind)?.trim_end(), suffix)))
    };
    let renamed: BTreeSet<_> = suffixes(" counter", "_total").chain(suffixes(" info", "_info")).collect();
    let mut classic = String::new();
    for line in written.lines() {
        let mut words = line.splitn(4, ' ');
        match (words.next(), words.next(), words.next(), words.next()) {
            (Some("#"), Some("EOF" | "UNIT"), _, _) => {}
            (Some("#"), Some(what), Some(name), rest) => {
                let suffix =
                    renamed.iter().find(|(renamed, _)| *renamed == name).map_or("", |(_, suffix)| suffix);
                let rest = rest.map(|rest| if what == "TYPE" && rest == "info" { "gauge" } else { rest });
                classic += &format!("# {what} {name}{suffix} {}\n", rest.unwrap_or_default());
            }
            _ => classic += &format!("{line}\n"),
        }
    }
    classic
}

#[derive(Debug)]
struct Metrics(Snapshot);

impl Collector for Metrics {
    fn encode(&self, encoder: DescriptorEncoder<'_>) -> fmt::Result {
        let mut writer = Writer(encoder);
        let snapshot = &self.0;
        writer.reports(snapshot)?;
        writer.vehicle_status(&snapshot.vehicle_status)?;
        writer.signals(snapshot)?;
        writer.buses(&snapshot.buses)?;
        writer.commands(snapshot)?;
        writer.lights_and_decider(snapshot)?;
        let statuses = snapshot.diagnostics.iter();
        let levels = statuses.map(|status| ([("task", status.task.as_str())], f64::from(status.level as u8)));
        writer.gauges("status_level", "Level of a diagnostic status: 0 OK, 1 WARN, 2 ERROR", levels)?;
        let remedies = snapshot.diagnostics.iter().filter_map(|status| {
            let (remedy, document) = (status.remedy.as_deref()?, status.document.as_deref()?);
            Some(([("task", status.task.as_str()), ("remedy", remedy), ("document", document)], 1.0))
        });
        let help = "1 for a diagnostic status that is not OK, with what to do and where it is documented";
        writer.gauges("status_remedy", help, remedies)?;
        snapshot.process.as_ref().map_or(Ok(()), |process| writer.process(process))
    }
}

/// Labels of a sample, and its value.
type Sample<'a, const N: usize, V> = ([(&'static str, &'a str); N], V);

struct Writer<'a>(DescriptorEncoder<'a>);

impl Writer<'_> {
    fn gauges<'a, const N: usize>(
        &mut self,
        name: &str,
        help: &str,
        samples: impl IntoIterator<Item = Sample<'a, N, f64>>,
    ) -> fmt::Result {
        self.measures(name, help, None, samples)
    }

    fn measures<'a, const N: usize>(
        &mut self,
        name: &str,
        help: &str,
        unit: Option<&Unit>,
        samples: impl IntoIterator<Item = Sample<'a, N, f64>>,
    ) -> fmt::Result {
        self.family(name, help, unit, MetricType::Gauge, samples, |mut sample, value| {
            sample.encode_gauge(&value)
        })
    }

    fn counters<'a, const N: usize>(
        &mut self,
        name: &str,
        help: &str,
        samples: impl IntoIterator<Item = Sample<'a, N, u64>>,
    ) -> fmt::Result {
        self.family(name, help, None, MetricType::Counter, samples, |mut sample, value| {
            sample.encode_counter::<NoLabelSet, u64, f64>(&value, None)
        })
    }

    /// Writes a metric with its samples; nothing without samples.
    fn family<'a, const N: usize, V>(
        &mut self,
        name: &str,
        help: &str,
        unit: Option<&Unit>,
        kind: MetricType,
        samples: impl IntoIterator<Item = Sample<'a, N, V>>,
        encode: fn(MetricEncoder<'_>, V) -> fmt::Result,
    ) -> fmt::Result {
        let mut samples = samples.into_iter().peekable();
        if samples.peek().is_none() {
            return Ok(());
        }
        let mut metric = self.0.encode_descriptor(name, help, unit, kind)?;
        samples.try_for_each(|(labels, value)| encode(metric.encode_family(&labels)?, value))
    }

    fn reports(&mut self, snapshot: &Snapshot) -> fmt::Result {
        let (turn, hazard) = (&snapshot.turn_indicators, &snapshot.hazard_lights);
        let turn = turn.iter().map(|report| {
            ("turn_indicators", report.published.map(|value| state_word(&value)), report.failures)
        });
        let hazard = hazard.iter().map(|report| {
            ("hazard_lights", report.published.map(|value| state_word(&value)), report.failures)
        });
        let status = snapshot.vehicle_status.reports().into_iter();
        let status = status.map(|(name, report)| (name.name(), report.published, report.failures));
        let reports: Vec<(&str, Option<String>, FailureCounts)> = turn.chain(hazard).chain(status).collect();
        let published = reports.iter().map(|(name, value, _)| ([("report", *name)], flag(value.is_some())));
        self.gauges("report_published", "1 while a report is published, 0 while it is withheld", published)?;
        let states = reports.iter().flat_map(|(name, value, _)| {
            let states = match *name {
                "turn_indicators" => TurnIndicators::ALL.iter().map(constant_and_word).collect(),
                "hazard_lights" => HazardLights::ALL.iter().map(constant_and_word).collect(),
                "gear" => Gear::all().map(|gear| constant_and_word(&gear)).collect(),
                "control_mode" => ControlMode::ALL.iter().map(constant_and_word).collect(),
                // Measured values and doors have no sample here.
                _ => Vec::new(),
            };
            let states = states.into_iter();
            states.map(move |(constant, word)| {
                ([("report", *name), ("state", constant)], flag(value.as_ref() == Some(&word)))
            })
        });
        self.gauges("report_state", "1 for the state that a report has, 0 for every other one", states)?;
        let failures = reports.iter().flat_map(|(name, _, failures)| {
            let kinds = [
                ("unknown", failures.unknown),
                ("invalid", failures.invalid),
                ("hardware_fault", failures.hardware_fault),
            ];
            kinds.map(|(kind, count)| ([("report", *name), ("kind", kind)], count))
        });
        self.counters("report_failures", "Failures of a report", failures)
    }

    fn vehicle_status(&mut self, status: &VehicleStatusSnapshot) -> fmt::Result {
        for (measure, value) in status.measures() {
            let MeasureRow { metric, metric_unit, metric_help, .. } = measure.row();
            let unit = Unit::Other((*metric_unit).to_owned());
            self.measures(metric, metric_help, Some(&unit), [([], value)])?;
        }
        let doors = status.doors.iter().filter_map(|report| report.published.as_ref()).flatten();
        let states = doors.flat_map(|door| {
            DoorState::ALL.iter().map(|state| {
                ([("door", door.name.as_str()), ("state", state.name())], flag(door.state == *state))
            })
        });
        self.gauges("door_state", "1 for the state that a door has, 0 for every other one", states)
    }

    fn signals(&mut self, snapshot: &Snapshot) -> fmt::Result {
        let signals = || {
            snapshot.signals.iter().map(|signal| {
                let labels = [
                    ("signal", signal.name.as_str()),
                    ("bus", signal.bus.as_str()),
                    ("used_by", variant_name(&signal.used_by)),
                ];
                (labels, signal)
            })
        };
        let valid = signals().map(|(labels, signal)| (labels, flag(signal.missing.is_none())));
        self.gauges("signal_valid", "1 while a signal has a valid value", valid)?;
        let ages = signals().filter_map(|(labels, signal)| Some((labels, seconds(signal.age_ms?))));
        self.measures("signal_age", "Time since a signal was received", Some(&Unit::Seconds), ages)?;
        let messages = || {
            snapshot.messages.iter().map(|message| {
                let labels = [
                    ("message", message.name.as_str()),
                    ("bus", message.bus.as_str()),
                    ("used_by", variant_name(&message.used_by)),
                ];
                (labels, message)
            })
        };
        let frames = messages().map(|(labels, message)| (labels, message.frames));
        self.counters("message_frames", "Frames of a message", frames)?;
        let rejected =
            messages().filter_map(|(labels, message)| Some((labels, message.integrity.as_ref()?.rejected)));
        self.counters("message_rejected_frames", "Frames that failed the integrity check", rejected)?;
        let lost =
            messages().filter_map(|(labels, message)| Some((labels, message.integrity.as_ref()?.lost)));
        self.counters("message_lost_frames", "Frames missing before trusted ones, by the counter", lost)
    }

    fn buses(&mut self, buses: &[BusSnapshot]) -> fmt::Result {
        let each = || {
            buses.iter().map(|bus| ([("bus", bus.name.as_str()), ("interface", bus.interface.as_str())], bus))
        };
        let up = each().map(|(labels, bus)| (labels, flag(bus.link == LinkState::Up)));
        self.gauges("bus_link_up", "1 while the link of a bus is up", up)?;
        let receiving = each().map(|(labels, bus)| (labels, flag(bus.is_receiving())));
        self.gauges("bus_receiving", "1 while frames of the vehicle profile are received", receiving)?;
        let load = each().filter_map(|(labels, bus)| Some((labels, bus.traffic?.load_percent? / 100.0)));
        self.gauges("bus_load_ratio", "Estimated share of the time in which a bus is busy", load)?;
        for Count { metric, help, value, .. } in counts::BUS {
            self.counters(metric, help, each().map(|(labels, bus)| (labels, value(bus))))?;
        }
        Ok(())
    }

    fn commands(&mut self, snapshot: &Snapshot) -> fmt::Result {
        let Some(commands) = &snapshot.commands else { return Ok(()) };
        let functions =
            [("turn_indicators", &commands.turn_indicators), ("hazard_lights", &commands.hazard_lights)];
        for Count { metric, help, value, .. } in counts::FUNCTION {
            let samples = functions.map(|(name, function)| ([("function", name)], value(function)));
            self.counters(metric, help, samples)?;
        }
        let messages = || {
            commands.messages.iter().map(|message| ([("message", message.name.as_str())], &message.counts))
        };
        let sent = messages().map(|(labels, counts)| (labels, counts.sent));
        self.counters("command_sent_frames", "Frames sent to the vehicle", sent)?;
        let failed = messages().map(|(labels, counts)| (labels, counts.queue_full + counts.refused));
        self.counters("command_failed_frames", "Frames to the vehicle that could not be sent", failed)
    }

    fn lights_and_decider(&mut self, snapshot: &Snapshot) -> fmt::Result {
        let channels = || {
            let channels = snapshot.traffic_lights.iter().flat_map(|lights| &lights.channels);
            channels.map(|channel| ([("channel", channel.channel.name())], channel))
        };
        let lights = channels().map(|(labels, channel)| (labels, f64::from(channel.lights)));
        self.gauges("traffic_lights", "Traffic lights with a known state", lights)?;
        let rejected = channels().map(|(labels, channel)| (labels, channel.rejected));
        let help = "Inputs of traffic lights that were rejected";
        self.counters("traffic_light_rejected_inputs", help, rejected)?;
        for Count { metric, help, value, .. } in counts::DECIDER {
            self.counters(metric, help, snapshot.decider.as_ref().map(|decider| ([], value(decider))))?;
        }
        Ok(())
    }

    fn process(&mut self, process: &ProcessSnapshot) -> fmt::Result {
        let build = &process.build;
        let labels = [
            ("version", build.version.as_str()),
            ("commit", build.commit.as_deref().unwrap_or("unknown")),
            ("distribution", build.distribution.as_deref().unwrap_or("none")),
        ];
        self.0
            .encode_descriptor("build", "Build of the gateway", None, MetricType::Info)?
            .encode_info(&labels)?;
        let uptime = [([], seconds(process.uptime_ms))];
        self.measures("uptime", "Time since the start of the gateway", Some(&Unit::Seconds), uptime)?;
        if let Some(black_box) = &process.black_box {
            self.counters("black_box_written", "Black-box recordings written", [([], black_box.written)])?;
            let failures = [([], black_box.failures)];
            self.counters("black_box_failures", "Black-box recordings that failed", failures)?;
        }
        if let Some(log) = &process.log {
            self.counters("log_suppressed_lines", "Log lines left out", [([], log.suppressed)])?;
            self.counters("log_dropped_lines", "Log lines lost", [([], log.dropped)])?;
        }
        let Some(ros) = &process.ros else { return Ok(()) };
        self.gauges("ros_up", "1 while the network side of ROS 2 works", [([], flag(ros.is_up))])?;
        self.counters("ros_restarts", "Times that the network side was replaced", [([], ros.restarts)])?;
        self.counters("ros_write_errors", "Samples that could not be written", [([], ros.write_errors)])?;
        let memory = ros.memory_bytes.map(|bytes| ([], float(bytes)));
        self.measures("ros_memory", "Memory of the network process", Some(&Unit::Bytes), memory)?;
        let peers = [("written", &ros.written), ("read", &ros.read)].into_iter();
        let peers = peers.flat_map(|(direction, topics)| topics.iter().map(move |topic| (direction, topic)));
        let peers = peers.map(|(direction, topic)| {
            ([("topic", topic.name.as_str()), ("direction", direction)], float(topic.peers))
        });
        let help = "Readers of a topic that is written, writers of one that is read";
        self.gauges("ros_topic_peers", help, peers)?;
        let others =
            ros.written.iter().map(|topic| ([("topic", topic.name.as_str())], float(topic.other_writers)));
        self.gauges("ros_topic_other_writers", "Writers of other nodes on a topic that is written", others)
    }
}

/// Returns the constant for a state, which is its label, and its word.
fn constant_and_word(state: &impl serde::Serialize) -> (&'static str, String) {
    (variant_name(state), state_word(state))
}

fn flag(is_on: bool) -> f64 {
    f64::from(u8::from(is_on))
}

fn seconds(millis: u64) -> f64 {
    float(millis) / 1000.0
}

#[allow(clippy::cast_precision_loss)] // exact below 2^53
fn float(number: u64) -> f64 {
    number as f64
}
