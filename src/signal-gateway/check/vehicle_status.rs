//! Checks the reports of the vehicle's status: sources, values, missing dimensions, and a recording.

use std::collections::BTreeMap;
use std::time::Duration;

use super::fault_survey::{FaultSurvey, seconds_text};
use super::kind::CheckKind;
use super::names;
use super::report::CheckReport;
use crate::config::Settings;
use crate::replay::Replay;
use can_signal::validation::table::BoundMessage;
use can_signal::validation::unusable::FaultKind;
use gateway_base::diagnostics::Level;
use gateway_base::time::MonoTime;
use gateway_core::gateway::event::Output;
use gateway_core::vehicle_lights::Task;
use gateway_core::vehicle_lights::binding::{HazardBinding, TurnBinding};
use gateway_core::vehicle_report::catalogue::is_starting;
use gateway_core::vehicle_status::StatusReport;
use gateway_core::vehicle_status::binding::StatusBinding;
use gateway_core::vehicle_status::doors::Door;
use gateway_core::vehicle_status::measure::Measure;
use gateway_core::vehicle_status::role_texts::StatusTexts;
use gateway_core::vehicle_status::velocity::binding::{DirectionSource, HeadingRateSource};
use vehicle_bringup::plausibility::finding::Severity;

/// Maximum number of reasons listed for a report.
const MAX_REASONS: usize = 8;

/// Returns all bound messages, each once: of the vehicle's lights, then those that only V2I uses, then those
/// that only the vehicle's status uses.
pub(super) fn bound_messages(settings: &Settings) -> Vec<&BoundMessage> {
    let lights = &settings.gateway.lights.table.messages;
    let v2i = settings.gateway.v2i.table.messages.iter().filter(|message| !lights.contains(message));
    let mut bound: Vec<_> = lights.iter().chain(v2i).collect();
    let known: Vec<_> = bound.iter().map(|message| (message.bus, message.ids)).collect();
    let status = settings.gateway.status.table.messages.iter();
    bound.extend(status.filter(|message| !known.contains(&(message.bus, message.ids))));
    bound
}

/// Returns the names of all reports that a configuration provides, starting with the reports on the lights.
pub(crate) fn report_names(settings: &Settings) -> Vec<&'static str> {
    let lights = &settings.gateway.lights;
    let is_turn_shown = matches!(lights.turn, TurnBinding::From(_) | TurnBinding::NotFitted);
    let is_hazard_shown = matches!(lights.hazard, HazardBinding::From(_) | HazardBinding::NotFitted);
    let of_lights = [(Task::TurnIndicators, is_turn_shown), (Task::HazardLights, is_hazard_shown)];
    let of_lights = of_lights.into_iter().filter(|(_, is_shown)| *is_shown).map(|(task, _)| task.name());
    of_lights.chain(settings.gateway.status.reports().map(StatusReport::name)).collect()
}

/// Lists the meanings of all values and the sources of each report, and reports missing configuration.
pub(super) fn reports(settings: &Settings, report: &mut CheckReport) {
    let status = &settings.gateway.status;
    let roles: Vec<_> = StatusTexts::of(status).roles().collect();
    names::roles(settings, &status.table, &roles, report);
    for of in status.reports() {
        // `control_mode` is wider than the column.
        let heading = if of == StatusReport::ControlMode { "mode" } else { of.name() };
        report.line(heading, sources(of, settings));
    }
    if status.control_mode.is_some() {
        let text = "control_mode: Autoware engages through the service /control/control_mode_request, which the \
                    by-wire node must still serve";
        report.find(Severity::Note, CheckKind::Advice, text);
    }
}

/// Describes the sources of a report and when it is published.
fn sources(report: StatusReport, settings: &Settings) -> String {
    let status = &settings.gateway.status;
    let rate_hz = settings.gateway.status_settings.min_period.as_secs_f64().recip();
    let streamed = format!("published with its frames, at most {rate_hz:.0} times a second");
    let from = |names: Vec<&str>| names.join(", then ");
    match report {
        StatusReport::Velocity => {
            let velocity = status.velocity.iter();
            let speeds = velocity.clone().flat_map(|velocity| &velocity.speeds);
            let directions = velocity.clone().flat_map(|velocity| &velocity.directions);
            let rates = velocity.flat_map(|velocity| &velocity.heading_rates);
            let direction = |source: &DirectionSource| match source {
                DirectionSource::Signal(_) => "a signal",
                DirectionSource::Gear => "the gear",
            };
            let directions = match from(directions.map(direction).collect()) {
                directions if directions.is_empty() => "its sign".to_owned(),
                directions => directions,
            };
            format!(
                "speed from {}; direction from {directions}; heading rate from {}; {streamed}",
                from(speeds.map(|source| source.name.as_str()).collect()),
                from(rates.map(HeadingRateSource::name).collect()),
            )
        }
        StatusReport::Steering => {
            let sources = status.steering.iter();
            let names = from(sources.map(|source| source.name.as_str()).collect());
            if names.is_empty() { streamed } else { format!("from {names}; {streamed}") }
        }
        StatusReport::Gear => {
            let sources = status.gear.iter().flat_map(|gear| &gear.sources);
            let names = from(sources.map(|source| source.name.as_str()).collect());
            if names.is_empty() { "from one signal".to_owned() } else { format!("from {names}") }
        }
        StatusReport::ControlMode => match &status.control_mode {
            Some(mode) if mode.is_not_ready_while_unknown => "NOT_READY while it is unknown".to_owned(),
            Some(_) | None => "withheld while it is unknown".to_owned(),
        },
        StatusReport::Doors => {
            let doors = status.doors.iter().map(Door::layout_text);
            doors.collect::<Vec<_>>().join(", ")
        }
    }
}

/// Survey of the reports over a recording.
#[derive(Debug)]
pub(super) struct StatusSurvey(Vec<ReportSurvey>);

#[derive(Debug)]
struct ReportSurvey {
    report: StatusReport,
    is_published: bool,
    published: Duration,
    /// Lowest and highest published value of each measure.
    ranges: BTreeMap<Measure, (f64, f64)>,
    /// Level and message of its status.
    status: Option<(Level, String)>,
    /// Times at which it was withheld, by reason.
    reasons: BTreeMap<String, WithheldReason>,
    /// True once it was published.
    was_published: bool,
}

#[derive(Debug)]
struct WithheldReason {
    times: FaultSurvey,
    kind: Option<FaultKind>,
    remedy: String,
}

impl StatusSurvey {
    /// Returns each report, and whether it was published at any time.
    pub(super) fn published(&self) -> impl Iterator<Item = (StatusReport, bool)> {
        self.0.iter().map(|survey| (survey.report, survey.was_published))
    }

    pub(super) fn new(status: &StatusBinding) -> Self {
        let survey = |report| ReportSurvey {
            report,
            is_published: false,
            published: Duration::ZERO,
            ranges: BTreeMap::new(),
            status: None,
            reasons: BTreeMap::new(),
            was_published: false,
        };
        Self(status.reports().map(survey).collect())
    }

    /// Adds the time of one step to the states before it.
    pub(super) fn passed(&mut self, time: Duration) {
        for survey in &mut self.0 {
            if survey.is_published {
                survey.published += time;
            } else if let Some((_, message)) = &survey.status
                && let Some(reason) = survey.reasons.get_mut(message)
            {
                reason.times.total += time;
            }
        }
    }

    /// Adds an output of a step.
    pub(super) fn given_out(&mut self, output: &Output, replay: &Replay) {
        match output {
            Output::VehicleStatus(output) => {
                let Some(survey) = self.0.iter_mut().find(|survey| survey.report == output.report()) else {
                    return;
                };
                survey.is_published = output.named().is_some();
                survey.was_published |= survey.is_published;
                for (measure, value) in output.measures() {
                    let (low, high) = survey.ranges.entry(measure).or_insert((value, value));
                    (*low, *high) = (low.min(value), high.max(value));
                }
            }
            Output::Diagnostics { diagnostics, .. } => {
                for status in &diagnostics.statuses {
                    let of = |survey: &&mut ReportSurvey| survey.report.name() == status.task;
                    let Some(survey) = self.0.iter_mut().find(of) else { continue };
                    let state = (status.level, status.message.clone());
                    if survey.status.as_ref() == Some(&state) {
                        continue;
                    }
                    // The time until the first values, and between them and the first report, is not a fault.
                    if !survey.is_published && status.level != Level::Ok && !is_starting(status) {
                        let reason = survey.reasons.entry(status.message.clone());
                        let reason = reason.or_insert_with(|| WithheldReason {
                            times: FaultSurvey::begin(replay.now().mono),
                            kind: replay.gateway().vehicle_status().failure(survey.report),
                            remedy: status.remedy.clone(),
                        });
                        reason.times.begins_again(survey.was_published);
                    }
                    survey.status = Some(state);
                }
            }
            Output::VehicleLights(_)
            | Output::TrafficLights(_)
            | Output::TurnSignal(_)
            | Output::Command(_) => {}
        }
    }

    /// Lists how long each report would be published, its values, and the reasons for withholding it, of
    /// which the longest is a finding. The reports of `explained` have another finding. Returns the reports
    /// that had to wait for their first value.
    pub(super) fn lines(
        &self,
        whole: MonoTime,
        explained: &[StatusReport],
        report: &mut CheckReport,
    ) -> Vec<(&'static str, Duration)> {
        let mut cold_starts = Vec::new();
        for survey in &self.0 {
            let name = survey.report.name();
            let published = seconds_text(MonoTime::ZERO.after(survey.published));
            let whole = seconds_text(whole);
            report.line("report", format!("{name} would be published for {published} of {whole}"));
            for (measure, (low, high)) in &survey.ranges {
                let text =
                    format!("{} {} to {}", measure.row().name, measure.text(*low), measure.text(*high));
                report.line("", text);
            }
            let mut reasons: Vec<_> = survey.reasons.iter().collect();
            reasons.sort_by_key(|(_, reason)| std::cmp::Reverse(reason.times.total));
            let mut is_warned = explained.contains(&survey.report);
            let mut cold_start = None;
            for (message, reason) in reasons.iter().take(MAX_REASONS) {
                let text = format!("{name} withheld {}: {message}", reason.times.text());
                let is_cold_start = reason.times.is_cold_start(reason.kind, survey.was_published);
                if is_cold_start {
                    *cold_start.get_or_insert(Duration::ZERO) += reason.times.total;
                }
                if is_cold_start || is_warned {
                    report.line("", text);
                } else {
                    is_warned = true;
                    let remedy = Some(reason.remedy.as_str()).filter(|remedy| !remedy.is_empty());
                    let remedy = remedy.unwrap_or(CheckKind::ReportWithheld.remedy());
                    report.find_with(Severity::Warning, CheckKind::ReportWithheld, text, remedy);
                }
            }
            cold_starts.extend(cold_start.map(|waited| (name, waited)));
            if reasons.len() > MAX_REASONS {
                report.line("", format!("{name}: further reasons are not listed"));
            }
        }
        cold_starts
    }
}
