//! The present state as text for people.

use std::fmt::Write as _;

use super::counts;
use super::live_view::{integrity_text, message_of};
use super::text::{counted, escaped, wrapped};
use crate::process_status::configuration::ConfigurationState;
use crate::process_status::snapshot::{ProcessSnapshot, RosSnapshot, Snapshot};
use can_signal::can::BusSnapshot;
use can_signal::validation::snapshot::{IntegritySnapshot, SignalSnapshot};
use gateway_base::diagnostics::Level;
use gateway_base::names::words;
use gateway_core::command::snapshot::{CommandSnapshot, FunctionSnapshot, LightsValue};
use gateway_core::control_mode::ControlMode;
use gateway_core::provenance::ProvenanceSummary;
use gateway_core::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use gateway_core::vehicle_report::ReportSnapshot;
use gateway_core::vehicle_status::gear::Gear;
use ros_transport::link::ZenohLinks;
use traffic_lights::snapshot::TrafficLightsSnapshot;
use traffic_lights::target::StoreLayer;
use turn_signal::flow::snapshot::DeciderSnapshot;

/// Longest headline, in characters; `systemctl status` shows one line.
const MAX_HEADLINE: usize = 200;

/// The state in one short line: what is published, or everything that is worst.
pub fn headline(snapshot: &Snapshot) -> String {
    let text = if snapshot.level == Level::Ok {
        let turn = snapshot.turn_indicators.as_ref().map(|report| ("turn", turn_name(report)));
        let hazard = snapshot.hazard_lights.as_ref().map(|report| ("hazard", hazard_name(report)));
        let status = &snapshot.vehicle_status;
        // What is measured changes all the time.
        let gear = status.gear.as_ref().map(|report| ("gear", report.published.map(Gear::name)));
        let mode = status.control_mode.as_ref();
        let mode = mode.map(|report| ("control mode", report.published.map(ControlMode::name)));
        let reports = [turn, hazard, gear, mode].into_iter().flatten();
        let texts: Vec<_> =
            reports.map(|(name, value)| format!("{name} {}", value.unwrap_or("not published"))).collect();
        if texts.is_empty() { "OK".to_owned() } else { format!("OK: {}", texts.join(", ")) }
    } else {
        let worst = snapshot.diagnostics.iter().filter(|status| status.level == snapshot.level);
        let texts: Vec<_> = worst.map(|status| format!("{}: {}", status.task, status.message)).collect();
        format!("{}: {}", snapshot.level, texts.join("; "))
    };
    let text = escaped(&text);
    if text.chars().count() <= MAX_HEADLINE {
        return text.into_owned();
    }
    text.chars().take(MAX_HEADLINE - 1).chain(['…']).collect()
}

/// The whole state, in sections with a heading each, wrapped at a width if there is one.
pub fn text(snapshot: &Snapshot, width: Option<usize>) -> String {
    let mut text = Text { width, ..Text::default() };
    text.line(&heading(snapshot));
    text.reports(snapshot);
    text.signals(snapshot);
    if let Some(commands) = &snapshot.commands {
        text.commands(commands);
    }
    text.buses(&snapshot.buses);
    if let Some(lights) = &snapshot.traffic_lights {
        text.traffic_lights(lights);
    }
    if let Some(decider) = &snapshot.decider {
        text.decider(decider);
    }
    text.diagnostics(snapshot);
    if let Some(process) = &snapshot.process {
        text.process(process, snapshot.stamp_ns);
    }
    text.finish()
}

fn turn_name(report: &ReportSnapshot<TurnIndicators>) -> Option<&'static str> {
    report.published.map(TurnIndicators::name)
}

fn hazard_name(report: &ReportSnapshot<HazardLights>) -> Option<&'static str> {
    report.published.map(HazardLights::name)
}

fn heading(snapshot: &Snapshot) -> String {
    let name = format!("{:<5} {}", snapshot.level.to_string(), snapshot.node);
    let Some(process) = &snapshot.process else { return name };
    let build = &process.build;
    let origin = [build.commit.as_deref(), build.distribution.as_deref()];
    let origin: Vec<_> = origin.into_iter().flatten().collect();
    let origin = if origin.is_empty() { String::new() } else { format!(" ({})", origin.join(", ")) };
    let up = duration(process.uptime_ms);
    format!(
        "{name}: {}, up {up}, version {}{origin}, process {}",
        process.vehicle, build.version, process.pid
    )
}

/// Lines: a heading, and below it rows in two columns.
#[derive(Default)]
struct Text {
    width: Option<usize>,
    written: String,
    rows: Vec<(String, String)>,
}

/// Widest first column that the second one gives way to.
const MAX_NAME: usize = 44;
/// Narrowest second column; a narrower one stands below the first.
const MIN_COLUMN: usize = 30;
/// Before what is wrapped of a heading, and of a row whose columns stand below each other.
const INDENT: usize = 6;

impl Text {
    /// A heading. Names may come from files, and are escaped.
    fn line(&mut self, text: &str) {
        self.write_rows();
        let room = self.width.map(|width| width.saturating_sub(INDENT));
        let lines = wrapped(&escaped(text.trim_end()), room, 0);
        // Writing to a String cannot fail.
        let _ = writeln!(self.written, "{}", lines.join(&format!("\n{:INDENT$}", "")));
    }

    fn row(&mut self, name: &str, text: &str) {
        self.rows.push((escaped(name).into_owned(), escaped(text).into_owned()));
    }

    fn write_rows(&mut self) {
        let names = self.rows.iter().map(|(name, _)| name.chars().count());
        let width = names.filter(|length| *length <= MAX_NAME).max().unwrap_or_default();
        let column = 2 + width + 2;
        let is_narrow = self.width.is_some_and(|total| total < column + MIN_COLUMN);
        for (name, text) in self.rows.drain(..) {
            let (mut row, indent) = if is_narrow {
                (format!("  {name}\n{:INDENT$}", ""), INDENT)
            } else {
                (format!("  {name:<width$}  "), column)
            };
            let room = self.width.map(|total| total.saturating_sub(indent));
            row += &wrapped(&text, room, 0).join(&format!("\n{:indent$}", ""));
            let _ = writeln!(self.written, "{}", row.trim_end());
        }
    }

    fn finish(mut self) -> String {
        self.write_rows();
        self.written
    }

    fn reports(&mut self, snapshot: &Snapshot) {
        self.line("reports");
        if let Some(report) = &snapshot.turn_indicators {
            self.report("turn_indicators", report, turn_name(report));
        }
        if let Some(report) = &snapshot.hazard_lights {
            self.report("hazard_lights", report, hazard_name(report));
        }
        for (name, report) in snapshot.vehicle_status.reports() {
            self.report(name.name(), &report, report.published.as_deref());
        }
    }

    fn report<T>(&mut self, name: &str, report: &ReportSnapshot<T>, published: Option<&str>) {
        let source = report.source.as_ref().map_or_else(String::new, |source| format!(" from {source}"));
        let message = if report.level == Level::Ok { String::new() } else { format!(": {}", report.message) };
        self.row(name, &format!("{}{source}{message}", published.unwrap_or("withheld")));
    }

    fn signals(&mut self, snapshot: &Snapshot) {
        if snapshot.signals.is_empty() {
            return;
        }
        self.line("signals");
        for signal in &snapshot.signals {
            let integrity = message_of(snapshot, signal).and_then(|message| message.integrity.as_ref());
            let integrity = integrity.map_or_else(String::new, checked_text);
            self.row(&signal.name, &format!("{}{integrity}", signal_text(signal)));
        }
    }

    fn commands(&mut self, commands: &CommandSnapshot) {
        let dry = if commands.is_transmitting { "" } else { ", dry run: nothing is sent" };
        let mode = match (commands.control_mode, commands.undefined_control_mode) {
            (Some(mode), _) => mode.name().to_owned(),
            (None, Some(raw)) => format!("undefined ({raw})"),
            (None, None) => "unknown".to_owned(),
        };
        self.line(&format!("commands (from {}, control mode {mode}{dry})", words(&commands.source)));
        for (name, function) in
            [("turn_indicators", &commands.turn_indicators), ("hazard_lights", &commands.hazard_lights)]
        {
            self.row(name, &function_text(function));
        }
        for message in &commands.messages {
            let failed = message.queue_full + message.refused;
            self.row(
                &message.name,
                &format!("{} sent, {failed} failed, {} foreign", message.sent, message.foreign),
            );
        }
    }

    fn buses(&mut self, buses: &[BusSnapshot]) {
        self.line("buses");
        for bus in buses {
            self.row(&format!("{} ({})", bus.name, bus.interface), &bus_text(bus));
        }
    }

    fn traffic_lights(&mut self, lights: &TrafficLightsSnapshot) {
        self.line("traffic lights");
        for channel in &lights.channels {
            let known = counted(channel.lights.into(), "light");
            let parts =
                [("dark", channel.dark), ("unknown", channel.unknown), ("detected", channel.detected)];
            let parts =
                parts.iter().filter(|(_, count)| *count > 0).map(|(name, count)| format!(", {count} {name}"));
            self.row(channel.channel.name(), &format!("{known}{}", parts.collect::<String>()));
            for light in &channel.states {
                let layer = if light.layer == StoreLayer::Detected { " (detected)" } else { "" };
                self.row(&format!("  {}{layer}", light.id), &light.text());
            }
        }
        for controller in &lights.controllers {
            self.row(&controller.name, controller.phase.as_deref().unwrap_or("no phase yet"));
        }
    }

    fn decider(&mut self, decider: &DeciderSnapshot) {
        self.line(&format!("turn signal decider ({})", decider.role));
        self.row("state", &decider.message);
        let Some(decision) = &decider.decision else { return };
        let winner = decision.winner.map(|winner| format!(", {winner}"));
        let rule = decision.rule.map(|rule| format!(" by rule {rule}"));
        let held = decision.held.map(|held| format!(", held: {held}"));
        let reason = [winner, rule, held].into_iter().flatten().collect::<String>();
        self.row("decision", &format!("turn {}, hazard {}{reason}", decision.turn, decision.hazard));
        for candidate in &decision.candidates {
            let subject =
                candidate.subject.as_ref().map_or_else(String::new, |subject| format!(" ({subject})"));
            self.row(candidate.source.name(), &format!("{}{subject}", candidate.outcome));
        }
        let manoeuvres = decision.manoeuvres.iter().map(ToString::to_string);
        for text in decision.findings.iter().cloned().chain(manoeuvres) {
            self.row("", &text);
        }
    }

    fn diagnostics(&mut self, snapshot: &Snapshot) {
        let bad: Vec<_> = snapshot.diagnostics.iter().filter(|status| status.level > Level::Ok).collect();
        self.line(&format!(
            "diagnostics ({} of {} OK)",
            snapshot.diagnostics.len() - bad.len(),
            snapshot.diagnostics.len()
        ));
        for status in bad {
            self.row(&status.task, &format!("{} {}", status.level, status.message));
            for text in [&status.remedy, &status.document].into_iter().flatten() {
                self.row("", &format!("→ {text}"));
            }
        }
    }

    fn configuration(&mut self, configuration: &ConfigurationState, stamp_ns: i64) {
        let Some(last) = &configuration.last_reload else { return };
        let reloads = counted(configuration.reloads, "reload");
        self.line(&format!("configuration ({reloads}, {} refused)", configuration.refused));
        let seconds = stamp_ns.saturating_sub(last.stamp_ns) / 1_000_000_000;
        let at = format!("{seconds} s ago");
        match &last.reason {
            None => self.row(&at, "reloaded"),
            Some(reason) => {
                let text = reason.lines().collect::<Vec<_>>().join("; ");
                self.row(&at, &format!("refused, the one before goes on: {text}"));
            }
        }
        for change in last.changes.iter().filter(|_| last.is_applied) {
            self.row("", &change.to_string());
        }
    }

    /// Writes how much of the vehicle profile has been verified; nothing for a profile without facts.
    fn provenance(&mut self, provenance: &ProvenanceSummary) {
        let ProvenanceSummary { car, recording, bench, unverified } = provenance;
        let verified = [(car, "a car"), (recording, "a recording"), (bench, "a bench")];
        let verified = verified.iter().filter(|(count, _)| **count > 0);
        let verified: Vec<_> =
            verified.map(|(count, by)| format!("{} by {by}", counted(**count as u64, "fact"))).collect();
        if verified.is_empty() && unverified.is_empty() {
            return;
        }
        self.line("vehicle profile");
        if !verified.is_empty() {
            self.row("verified", &verified.join(", "));
        }
        if !unverified.is_empty() {
            self.row("unverified", &unverified.join(", "));
        }
    }

    fn process(&mut self, process: &ProcessSnapshot, stamp_ns: i64) {
        self.provenance(&process.provenance);
        if let Some(configuration) = &process.configuration {
            self.configuration(configuration, stamp_ns);
        }
        if let Some(black_box) = &process.black_box {
            let newest =
                black_box.newest.as_ref().map_or_else(String::new, |newest| format!(", the newest {newest}"));
            let recordings = counted(u64::try_from(black_box.recordings).unwrap_or(u64::MAX), "recording");
            self.line("black box");
            self.row(&black_box.folder, &format!("{recordings}{newest}"));
        }
        if let Some(ros) = &process.ros {
            self.line(&format!("ROS 2 (domain {}, {})", ros.domain_id, ros_text(ros)));
            for topic in &ros.written {
                self.row(&topic.name, &counted(topic.peers, "reader"));
            }
            for topic in &ros.read {
                self.row(&topic.name, &counted(topic.peers, "writer"));
            }
        }
    }
}

fn signal_text(signal: &SignalSnapshot) -> String {
    let Some(raw) = signal.raw else {
        return format!("unknown: {}", signal.missing.as_ref().map_or("unknown", |missing| &missing.text));
    };
    let meanings =
        if signal.meanings.is_empty() { String::new() } else { format!(" ({})", signal.meanings.join(", ")) };
    let age = signal.age_ms.map_or_else(String::new, |age| format!(", {age} ms old"));
    let missing =
        signal.missing.as_ref().map_or_else(String::new, |missing| format!(", not valid: {}", missing.text));
    format!("{raw}{meanings}{age}{missing}")
}

fn checked_text(integrity: &IntegritySnapshot) -> String {
    let rejected =
        if integrity.rejected > 0 { format!(" ({} rejected)", integrity.rejected) } else { String::new() };
    format!(", integrity: {}{rejected}", integrity_text(integrity))
}

fn function_text(function: &FunctionSnapshot) -> String {
    let or = |value: Option<LightsValue>, other: &str| {
        value.map_or_else(|| other.to_owned(), |value| value.to_string())
    };
    let age = function.command_age_ms.map_or_else(String::new, |age| format!(" {age} ms ago"));
    format!(
        "command {}{age}, requested {} ({}), reported {}",
        words(&function.command),
        or(function.requested, "nothing"),
        function.reason.text(),
        or(function.reported, "unknown"),
    )
}

fn bus_text(bus: &BusSnapshot) -> String {
    let mut parts: Vec<_> = bus.details().map(|(_, text)| text).collect();
    parts.push(format!("{} frames of the profile/s", bus.rate_hz));
    if let Some(traffic) = bus.traffic {
        let load = traffic.load_percent.map_or_else(String::new, |load| format!(", load {load} %"));
        parts.push(format!("{} frames/s in all{load}", traffic.rate_hz));
    }
    let counts = counts::BUS.iter().filter_map(|count| Some((count.label?, (count.value)(bus))));
    parts.extend(counts.filter(|(_, count)| *count > 0).map(|(label, count)| format!("{label} {count}")));
    parts.join(", ")
}

fn ros_text(ros: &RosSnapshot) -> String {
    let zenoh =
        ros.links.as_ref().map_or_else(String::new, |ZenohLinks { routers, peers, lost, unreachable }| {
            let unreachable = if unreachable.is_empty() {
                String::new()
            } else {
                format!(", not connected {}", unreachable.join(" "))
            };
            format!(", Zenoh: routers {routers}, peers {peers}, connections lost {lost}{unreachable}")
        });
    match (ros.is_up, &ros.last_failure) {
        (true, _) if ros.restarts > 0 => format!("up, replaced {} times{zenoh}", ros.restarts),
        (true, _) => format!("up{zenoh}"),
        (false, Some(failure)) => format!("down: {failure}"),
        (false, None) => "joining".to_owned(),
    }
}

/// A time in its two largest units.
fn duration(millis: u64) -> String {
    let seconds = millis / 1000;
    match (seconds / 86_400, seconds / 3600 % 24, seconds / 60 % 60, seconds % 60) {
        (0, 0, 0, seconds) => format!("{seconds} s"),
        (0, 0, minutes, seconds) => format!("{minutes} min {seconds} s"),
        (0, hours, minutes, _) => format!("{hours} h {minutes} min"),
        (days, hours, _, _) => format!("{days} d {hours} h"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_wrapped_between_words_and_a_wide_name_stands_above_its_text() {
        let words = "link up, receiving, 122.14 frames of the profile/s, 255.9 frames/s in all";
        let text = |width| {
            let mut text = Text { width, ..Text::default() };
            text.line(words);
            text.row("body (vcan0)", words);
            text.line("signals");
            text.row("BCM_TurnIndicators.TurnIndicatorState", words);
            text.finish()
        };
        let in_words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        for width in [50, 80, 120] {
            let wrapped = text(Some(width));
            assert!(wrapped.lines().all(|line| line.chars().count() <= width), "{wrapped}");
            assert_eq!(in_words(&wrapped), in_words(&text(None)));
        }
        let narrow = text(Some(50));
        assert!(
            narrow.contains("\n  BCM_TurnIndicators.TurnIndicatorState\n      link up, receiving,"),
            "{narrow}"
        );
        assert!(
            narrow.contains("\n  body (vcan0)  link up, receiving, 122.14 frames\n                of the"),
            "{narrow}"
        );
        assert_eq!(text(None).lines().count(), 4);
    }
}
