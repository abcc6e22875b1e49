//! Diagnostic status of the vehicle status reports.

pub(super) mod snapshot;

use serde::Serialize;

use super::VehicleStatus;
use super::binding::StatusBinding;
use super::catalogue::{self, SECTION};
use super::control_mode::ControlModeBinding;
use super::doors::doors_text;
use super::gear::GearBinding;
use super::measure::Measure;
use super::plausibility::alarm::AlarmSet;
use super::settings::VehicleGeometry;
use super::state::{StatusContext, StatusReason};
use super::velocity::VelocityPart;
use super::velocity::binding::{HeadingRateSource, VelocityBinding};
use crate::vehicle_report::{FailureHistory, ReceivedSignals, ReportSignals, catalogue as report_catalogue};
use can_signal::can::Bus;
use can_signal::validation::display::raw_text;
use can_signal::validation::table::SignalIndex;
use can_signal::validation::unusable::FaultKind;
use gateway_base::diagnostics::{MessagePart, Status, texts};
use gateway_base::names::named_by_variant;
use gateway_base::time::MonoTime;

/// A report on the vehicle's status, named like its diagnostic task.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StatusReport {
    /// Speed and heading rate.
    Velocity,
    /// Angle of the front wheels.
    Steering,
    /// Engaged gear.
    Gear,
    /// Control mode: who is in control.
    ControlMode,
    /// States of the doors.
    Doors,
}

named_by_variant!(StatusReport);

impl StatusReport {
    /// Returns the reports that a profile describes, in their order.
    pub fn of(binding: &StatusBinding) -> impl Iterator<Item = Self> + use<> {
        let described = [
            (Self::Velocity, binding.velocity.is_some()),
            (Self::Steering, !binding.steering.is_empty()),
            (Self::Gear, binding.gear.is_some()),
            (Self::ControlMode, binding.control_mode.is_some()),
            (Self::Doors, !binding.doors.is_empty()),
        ];
        described.into_iter().filter_map(|(report, is_described)| is_described.then_some(report))
    }

    /// Returns the signals on which the report depends.
    fn signals(self, binding: &StatusBinding) -> Vec<SignalIndex> {
        let mut signals: Vec<_> = match self {
            Self::Velocity => binding.velocity.iter().flat_map(VelocityBinding::signals).collect(),
            Self::Steering => binding.steering.iter().flat_map(|source| source.angle.signals()).collect(),
            Self::Gear => binding.gear.iter().flat_map(GearBinding::signals).collect(),
            Self::ControlMode => binding.control_mode.iter().flat_map(ControlModeBinding::signals).collect(),
            Self::Doors => binding.doors.iter().map(|door| door.role.signal).collect(),
        };
        let mut seen = Vec::new();
        signals.retain(|signal| {
            let is_new = !seen.contains(signal);
            seen.push(*signal);
            is_new
        });
        signals
    }

    /// Returns the name of the source at a position; empty for the only source.
    fn source_name(self, binding: &StatusBinding, position: usize) -> &str {
        let StatusBinding { velocity, steering, gear, .. } = binding;
        let name = match self {
            Self::Velocity => {
                velocity.iter().flat_map(|of| &of.speeds).nth(position).map(|source| &source.name)
            }
            Self::Steering => steering.get(position).map(|source| &source.name),
            Self::Gear => gear.iter().flat_map(|of| &of.sources).nth(position).map(|source| &source.name),
            Self::ControlMode | Self::Doors => None,
        };
        name.map_or("", String::as_str)
    }
}

/// Finding about a report: the reason why it is unavailable, and other problems.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct StatusFinding {
    /// Reason why there is no value.
    pub(super) reason: Option<StatusReason>,
    /// The missing part of a velocity.
    pub(super) part: VelocityPart,
    /// Position of the deciding source.
    pub(super) source: usize,
    /// Reason why a more trusted source, or one of the doors, has no value.
    pub(super) fallback: Option<StatusReason>,
    /// Contradictions between parts of the motion.
    pub(super) alarms: AlarmSet,
    /// Finding about the heading rate of a velocity.
    pub(super) heading: HeadingFinding,
}

/// Finding about a heading rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct HeadingFinding {
    /// Position of the deciding source.
    pub(super) source: usize,
    /// Reason why a more trusted source has no value.
    pub(super) fallback: Option<StatusReason>,
    /// Reason why it is unknown and published as 0.
    pub(super) replaced: Option<StatusReason>,
}

impl StatusFinding {
    fn failure(self) -> Option<FaultKind> {
        self.reason.and_then(StatusReason::failure)
    }

    /// Omits sources that need a dimension if no dimension is configured at all, since they are then not
    /// wanted.
    fn as_configured(self, geometry: &VehicleGeometry) -> Self {
        let counts = |reason: &StatusReason| {
            geometry.is_configured || !matches!(reason, StatusReason::NotConfigured(_))
        };
        let heading = HeadingFinding { fallback: self.heading.fallback.filter(counts), ..self.heading };
        Self { fallback: self.fallback.filter(counts), heading, ..self }
    }
}

/// Finding of a report, with its history.
#[derive(Debug, Clone)]
pub(super) struct StatusTask {
    report: StatusReport,
    signals: ReportSignals,
    finding: Option<StatusFinding>,
    failures: FailureHistory,
}

impl StatusTask {
    pub(super) fn new(report: StatusReport, binding: &StatusBinding) -> Self {
        let signals = ReportSignals::new(report.signals(binding));
        Self { report, signals, finding: None, failures: FailureHistory::default() }
    }

    pub(super) fn report(&self) -> StatusReport {
        self.report
    }

    /// Returns the task with the signals of another binding, keeping its history.
    pub(super) fn reconfigured(mut self, binding: &StatusBinding) -> Self {
        self.signals.reconfigure(self.report.signals(binding));
        self
    }

    /// Updates the finding and returns whether it has changed.
    pub(super) fn update(
        &mut self,
        finding: StatusFinding,
        binding: &StatusBinding,
        context: StatusContext<'_>,
    ) -> bool {
        let finding = finding.as_configured(&context.settings.geometry);
        if self.finding == Some(finding) {
            return false;
        }
        let before = self.finding.replace(finding).and_then(StatusFinding::failure);
        let geometry = &context.settings.geometry;
        let text = || texts(&message(binding, geometry, context.buses, self.report, finding));
        self.failures.changed(before, finding.failure(), text, context.now.mono);
        true
    }
}

impl VehicleStatus {
    /// Returns the diagnostic status of a report; `None` if the profile does not describe it.
    pub fn status(&self, report: StatusReport, buses: &[Bus], now: MonoTime) -> Option<Status> {
        let task = self.tasks.iter().find(|task| task.report == report)?;
        let finding = task.finding.unwrap_or_default();
        let value = self.published_text(report);
        let mut values = vec![("report", value.unwrap_or_else(|| "not published".to_owned()))];
        let source = report.source_name(&self.binding, finding.source);
        if !source.is_empty() {
            values.push(("source", source.to_owned()));
        }
        values.extend(task.signals.status_values(self.received(), now));
        values.extend(task.failures.status_values(finding.failure().is_some(), now));
        let message = message(&self.binding, &self.settings.geometry, buses, report, finding);
        let signals = task.signals.names(&self.binding.table);
        Some(Status { signals, ..Status::new(&SECTION, report.name(), &message, values) })
    }

    /// Returns all diagnostic statuses.
    pub fn statuses(&self, buses: &[Bus], now: MonoTime) -> Vec<Status> {
        self.tasks.iter().filter_map(|task| self.status(task.report, buses, now)).collect()
    }

    /// Samples the frame counts from which rates are computed; call it at every refresh.
    pub fn sample_rates(&mut self, now: MonoTime) {
        let received = ReceivedSignals { table: &self.binding.table, observations: &self.observations };
        for task in &mut self.tasks {
            task.signals.sample_rate(received, now);
        }
    }

    /// Returns the published value for display; `None` while nothing is published.
    fn published_text(&self, report: StatusReport) -> Option<String> {
        match report {
            StatusReport::Velocity => {
                self.velocity.current().map(|(velocity, _)| Measure::texts(&velocity.measures()))
            }
            StatusReport::Steering => {
                self.steering.current().map(|(angle, _)| Measure::texts(&angle.measures()))
            }
            StatusReport::Gear => self.gear.current().map(|(gear, _)| gear.name().to_owned()),
            StatusReport::ControlMode => self.control_mode.current().map(|(mode, _)| mode.name().to_owned()),
            StatusReport::Doors => self.doors.current().map(|(states, _)| {
                let named = self.binding.doors.iter().zip(states.as_slice());
                doors_text(named.map(|(door, state)| (door.name.as_str(), *state)))
            }),
        }
    }

    fn received(&self) -> ReceivedSignals<'_> {
        ReceivedSignals { table: &self.binding.table, observations: &self.observations }
    }
}

fn message(
    binding: &StatusBinding,
    geometry: &VehicleGeometry,
    buses: &[Bus],
    report: StatusReport,
    finding: StatusFinding,
) -> Vec<MessagePart> {
    let unavailable = |reason| unavailable_message(binding, buses, reason);
    let part = match finding.part {
        VelocityPart::Speed => "",
        VelocityPart::Direction => "direction: ",
        VelocityPart::HeadingRate => "heading rate: ",
    };
    if let Some(reason) = finding.reason {
        let message = if let StatusReason::NotConfigured(key) = reason
            && !geometry.is_configured
        {
            catalogue::geometry_left_out(key.key())
        } else {
            unavailable(reason)
        };
        return vec![message.with_text(|text| format!("{part}{text}"))];
    }
    let fallback = finding.fallback.map(|reason| match report {
        StatusReport::Doors => unavailable(reason).within(catalogue::doors_without_state),
        StatusReport::Velocity | StatusReport::Steering | StatusReport::Gear | StatusReport::ControlMode => {
            let source = report.source_name(binding, finding.source);
            unavailable(reason).within(|reason| report_catalogue::fallback(source, reason))
        }
    });
    let HeadingFinding { source, fallback: heading, replaced } = finding.heading;
    let rates = binding.velocity.as_ref().map_or(&[][..], |velocity| &velocity.heading_rates);
    let heading = heading.filter(|_| replaced.is_none()).map(|reason| {
        let source = rates.get(source).map_or("", HeadingRateSource::name);
        unavailable(reason).within(|reason| catalogue::fallback_heading_rate(source, reason))
    });
    let replaced = replaced.map(|reason| unavailable(reason).within(catalogue::heading_rate_replaced));
    let alarms = finding
        .alarms
        .iter()
        .map(|row| catalogue::implausible(row.text, row.remedy).with_remedy(row.remedy_sentence()));
    let parts: Vec<_> = fallback.into_iter().chain(heading).chain(replaced).chain(alarms).collect();
    if parts.is_empty() { vec![report_catalogue::publishing()] } else { parts }
}

/// Returns the message for an unavailable value: the kind of failure, if it is a failure, and the cause.
fn unavailable_message(binding: &StatusBinding, buses: &[Bus], reason: StatusReason) -> MessagePart {
    let name = |signal: SignalIndex| binding.table.signals[signal.0].name.as_str();
    let cause = match reason {
        StatusReason::Signal(reason) => reason.message(&binding.table, buses),
        StatusReason::OtherVehicle(unmet) if unmet.is_contradicted => catalogue::other_vehicle(),
        StatusReason::OtherVehicle(_) => catalogue::waiting_for_requirement(),
        StatusReason::BadQuality(signal, raw) => {
            catalogue::bad_quality(binding.flag_text(signal), name(signal), raw_text(raw))
        }
        StatusReason::OutOfRange(signal) => catalogue::out_of_range(name(signal)),
        StatusReason::BetweenGears { signal, is_long: false } => return catalogue::shifting(name(signal)),
        StatusReason::BetweenGears { signal, is_long: true } => {
            catalogue::between_gears_too_long(name(signal))
        }
        StatusReason::OnlyReverseShown(signal) => return catalogue::only_reverse_shown(name(signal)),
        StatusReason::NotConfigured(key) => return catalogue::dimension_missing(key.key()),
        StatusReason::NoSpeedForSteering => catalogue::speed_unknown(),
        StatusReason::Implausible(alarm) => {
            let row = alarm.row();
            catalogue::contradicted(row.text, row.remedy).with_remedy(row.remedy_sentence())
        }
        StatusReason::OutOfStep => catalogue::out_of_step(),
        StatusReason::DirectionNotTold => catalogue::direction_unknown(),
        StatusReason::HeadingRateOutOfRange => catalogue::heading_rate_out_of_range(),
        StatusReason::NoRearWheels => catalogue::no_rear_wheels(),
        StatusReason::NotChosen => catalogue::no_source_at_this_speed(),
        StatusReason::NoSource => catalogue::no_source(),
    };
    cause.within(match reason.failure() {
        Some(FaultKind::Unknown) => report_catalogue::unknown,
        Some(FaultKind::Invalid) => report_catalogue::invalid,
        Some(FaultKind::HardwareFault) => report_catalogue::hardware_fault,
        None => report_catalogue::asleep,
    })
}
