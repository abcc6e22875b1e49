//! `check`: lists bindings, warnings, and the result of a recording, before the drive.

mod commands;
pub mod decode;
pub mod dimensions;
pub mod doctor;
mod fault_survey;
mod finding_text;
pub mod identify;
pub mod identify_text;
mod kind;
mod kinematics;
pub mod live_messages;
mod map;
mod names;
pub mod patch;
mod provenance;
mod report;
mod service;
mod survey;
mod survey_text;
pub mod table;
pub mod timeline;
mod traffic_lights;
mod turn_signal;
mod vehicle_status;

use crate::config::Settings;
use crate::config::gateway::{SourceKind, Stamps};
pub use crate::report::text::Layout;
use crate::report::text::{counted, plain_path};
use can_signal::dbc::model::DbcSeverity;
use can_signal::validation::integrity::MessageIntegrity;
use can_signal::validation::table::Timing;
use gateway_core::vehicle_lights::binding::{
    HazardBinding, HazardSource, LightsBinding, NamedSource, Sources, TurnBinding, TurnSource,
};
use gateway_core::vehicle_lights::catalogue::hazard_not_visible;
use gateway_core::vehicle_lights::lamp::timing::Resolution;
use gateway_core::vehicle_lights::role_texts::roles;
pub use kind::{CheckKind, KINDS};
pub use map::map;
pub use provenance::records;
pub use report::{CheckReport, JsonReport, ReportedFinding};
pub use service::{hiding_folder, service_files};
pub use survey_text::{log_faults, recording, recording_faults, sample_faults};
use vehicle_bringup::plausibility::finding::Severity as Weight;
pub(crate) use vehicle_status::report_names;

/// Lists the bindings of a configuration, and the unread parts of its DBCs.
pub fn binding(settings: &Settings) -> CheckReport {
    let mut report = CheckReport::default();
    report.line("vehicle", &settings.vehicle);
    provenance::provenance(&settings.provenance, &mut report);
    let lights = &settings.gateway.lights;
    for (bus, dbc) in settings.gateway.buses.iter().zip(&settings.dbcs) {
        let (messages, signals) = (dbc.database.messages.len(), dbc.database.signal_count());
        let rejected = dbc.database.rejected();
        let path = plain_path(&dbc.path);
        let [messages, signals, statements] =
            [(messages, "message"), (signals, "signal"), (rejected, "statement")]
                .map(|(count, noun)| counted(count.try_into().unwrap_or(u64::MAX), noun));
        report.line(
            "bus",
            format!(
                "{} on {}: {path}, {messages}, {signals}, {statements} rejected",
                bus.name, bus.interface
            ),
        );
        for finding in dbc.database.findings.iter().filter(|finding| finding.severity != DbcSeverity::Note) {
            report.line("", format!("{path}:{}: {} [{}]", finding.line, finding.reason, finding.excerpt));
        }
    }
    for message in vehicle_status::bound_messages(settings) {
        let timing = match message.timing {
            Timing::Cyclic { timeout } => {
                format!("cyclic, unknown after {} ms of silence", timeout.as_millis())
            }
            Timing::Event => "event, holds while the bus is alive".to_owned(),
            Timing::EventCyclic { timeout } => {
                let limit = timeout.as_millis();
                format!("event and slowly repeated, unknown after {limit} ms of silence or with a silent bus")
            }
        };
        let bus = &settings.gateway.buses[usize::from(message.bus.0)].name;
        report.line("message", format!("{} ({}) on {bus}: {timing}", message.name, message.ids));
        let proof = message.integrity.as_ref().map_or("none".to_owned(), MessageIntegrity::to_string);
        report.line("", format!("integrity check: {proof}"));
    }
    for requirement in &lights.requirements {
        let bus = &settings.gateway.buses[usize::from(requirement.bus.0)].name;
        report.line("requires", format!("on {bus}: {requirement}"));
    }
    names::roles(settings, &lights.table, &roles(lights), &mut report);
    turn_sources(&lights.turn, &mut report);
    hazard_sources(&lights.hazard, &mut report);
    vehicle_status::reports(settings, &mut report);
    commands::commands(settings, &mut report);
    traffic_lights::sources(&settings.gateway.v2i, &mut report);
    settings.turn_signal.iter().for_each(|decider| turn_signal::decider(decider, &mut report));
    for note in notes(settings) {
        report.find(Weight::Note, CheckKind::Advice, note);
    }
    report
}

/// Returns notes for an integrator on a valid configuration.
pub fn notes(settings: &Settings) -> Vec<String> {
    let missed = missed_flashes(&settings.gateway.lights);
    missed.into_iter().chain(traffic_lights::notes(settings)).chain(old_stamps(settings)).collect()
}

/// Warns of published stamps that lie in the past, which readers such as Autoware's diagnostics aggregator
/// treat as stale.
fn old_stamps(settings: &Settings) -> Option<String> {
    let is_published = settings.ros.enabled && settings.source == SourceKind::Recording;
    let stamps = settings.recording.as_ref().filter(|_| is_published)?.stamps;
    (stamps == Stamps::Recorded).then(|| {
        "[recording] stamps = \"recorded\": readers that compare stamps with the present, as Autoware's diagnostics do, \
         take all messages for stale; stamps = \"now\" are current"
            .to_owned()
    })
}

fn missed_flashes(lights: &LightsBinding) -> Vec<String> {
    let note = |named: &NamedSource<TurnSource>| {
        let TurnSource::Lamps { pair, resolution: Resolution::ShortFlashesMayFallBetween, .. } =
            &named.source
        else {
            return None;
        };
        let [left, right] = [&pair.left, &pair.right].map(|role| &lights.table.signals[role.signal.0].name);
        Some(format!(
            "{left} and {right}: frames are further apart than the shortest legal flash, which may fall \
             between them unseen"
        ))
    };
    lights.turn.sources().iter().filter_map(note).collect()
}

fn turn_sources(turn: &TurnBinding, report: &mut CheckReport) {
    let sources = match turn {
        TurnBinding::LeftOut | TurnBinding::NotVisible { .. } => {
            return report.line("turn", "not in the profile: never published, no diagnostics");
        }
        TurnBinding::NotFitted => return report.line("turn", "no indicators fitted: always DISABLE"),
        TurnBinding::From(sources) => sources,
    };
    for named in &sources.list {
        match &named.source {
            TurnSource::Enumerated { tap_hold, .. } | TurnSource::Pair { tap_hold, .. } => {
                if let Some(hold) = tap_hold {
                    report.line("lever", format!("a tap is held for {} ms", hold.as_millis()));
                }
            }
            TurnSource::Lamps { settings, .. } => {
                let (hold, confirm) = (settings.hold.as_millis(), settings.confirm.as_millis());
                report.line("lamps", format!("held {hold} ms, hazard after {confirm} ms of both"));
            }
            TurnSource::Stalk { settings, .. } => {
                let comfort = settings.comfort.duration().as_millis();
                let startup_delay = settings.startup_delay.as_millis();
                report.line(
                    "stalk",
                    format!("a tap blinks for {comfort} ms; unknown for {startup_delay} ms at start"),
                );
            }
        }
    }
    source_order("turn", sources, report);
}

fn hazard_sources(hazard: &HazardBinding, report: &mut CheckReport) {
    let sources = match hazard {
        HazardBinding::LeftOut => {
            return report.line("hazard", "not in the profile: never published, no diagnostics");
        }
        HazardBinding::NotFitted => {
            return report.line("hazard", "no hazard lights fitted: always DISABLE");
        }
        HazardBinding::NotVisible { is_acknowledged: true } => {
            return report.line("hazard", "not visible, acknowledged: never published");
        }
        HazardBinding::NotVisible { is_acknowledged: false } => {
            report.line("hazard", "not visible: never published");
            let text = format!("hazard: {}", hazard_not_visible());
            return report.find(Weight::Warning, CheckKind::HazardNotVisible, text);
        }
        HazardBinding::From(sources) => sources,
    };
    for named in &sources.list {
        match &named.source {
            HazardSource::BothSides => report.line("hazard", "on when both turn sides are on"),
            HazardSource::Signal { .. } => {}
            HazardSource::Button { startup_delay, .. } => {
                let startup_delay = startup_delay.as_millis();
                report.line("hazard", format!("each press toggles; unknown for {startup_delay} ms at start"));
            }
        }
    }
    source_order("hazard", sources, report);
}

fn source_order<S>(subject: &str, sources: &Sources<S>, report: &mut CheckReport) {
    if let [_, _, ..] = sources.list.as_slice() {
        let name = |named: &NamedSource<S>| {
            let condition = if named.condition.is_some() { " (while its condition is on)" } else { "" };
            let fallback = if named.is_fallback { " (fallback)" } else { "" };
            format!("{}{condition}{fallback}", named.name)
        };
        let names: Vec<_> = sources.list.iter().map(name).collect();
        let limit = sources.disagreement.as_millis();
        report.line(subject, format!("from {}; may disagree for {limit} ms", names.join(", then ")));
    }
}
