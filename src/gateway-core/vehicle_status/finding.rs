//! Findings about the vehicle status reports, and the messages about them.

use super::binding::StatusBinding;
use super::catalogue;
use super::measure::StatusReport;
use super::plausibility::alarm::AlarmSet;
use super::settings::{RatioOrigin, VehicleGeometry};
use super::state::StatusReason;
use super::velocity::binding::HeadingRateSource;
use crate::vehicle_report::{ReportFinding, ReportState, catalogue as report_catalogue};
use can_signal::can::Bus;
use can_signal::validation::display::raw_text;
use can_signal::validation::table::SignalIndex;
use can_signal::validation::unusable::FaultKind;
use gateway_base::diagnostics::MessagePart;

/// Finding about a report: the reason why it is unavailable, and other problems.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct StatusFinding {
    /// Reason why there is no value.
    pub(super) reason: Option<StatusReason>,
    /// True if the reason is that the first value since the start is awaited.
    pub(super) is_starting: bool,
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

/// The affected part of a velocity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum VelocityPart {
    #[default]
    Speed,
    Direction,
    HeadingRate,
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

impl ReportFinding for StatusFinding {
    fn failure(&self) -> Option<FaultKind> {
        self.reason.filter(|_| !self.is_starting).and_then(StatusReason::failure)
    }

    fn state(&self) -> ReportState {
        match self.reason {
            None => ReportState::Published,
            Some(_) if self.is_starting => ReportState::Starting,
            Some(reason) => reason.state(),
        }
    }
}

impl StatusFinding {
    /// Omits sources that need a dimension if no dimension is configured at all, since they are then not
    /// wanted.
    pub(super) fn as_configured(self, geometry: &VehicleGeometry) -> Self {
        let counts = |reason: &StatusReason| {
            geometry.is_configured || !matches!(reason, StatusReason::NotConfigured(_))
        };
        let heading = HeadingFinding { fallback: self.heading.fallback.filter(counts), ..self.heading };
        Self { fallback: self.fallback.filter(counts), heading, ..self }
    }
}

/// Returns the message of a report's status: the reason why it is unavailable, or all other problems.
pub(super) fn message(
    binding: &StatusBinding,
    geometry: &VehicleGeometry,
    buses: &[Bus],
    report: StatusReport,
    finding: StatusFinding,
) -> Vec<MessagePart> {
    let unavailable = |reason| unavailable_message(binding, buses, reason, finding.is_starting);
    let part = match finding.part {
        VelocityPart::Speed => "",
        VelocityPart::Direction => "direction: ",
        VelocityPart::HeadingRate => "heading rate: ",
    };
    if let Some(reason) = finding.reason {
        let message = if let StatusReason::NotConfigured(key) = reason {
            catalogue::dimension_missing(key.key(), consequence(report))
        } else {
            unavailable(reason)
        };
        return vec![message.with_text(|text| format!("{part}{text}"))];
    }
    let fallback = finding.fallback.map(|reason| match report {
        StatusReport::Doors => unavailable(reason).within(catalogue::doors_without_state),
        StatusReport::Velocity | StatusReport::Steering | StatusReport::Gear | StatusReport::ControlMode => {
            let source = binding.source_name(report, finding.source);
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
    let listed = listed_ratio(binding, geometry, report, finding.source);
    let parts: Vec<_> =
        listed.into_iter().chain(fallback).chain(heading).chain(replaced).chain(alarms).collect();
    if parts.is_empty() { vec![report_catalogue::publishing()] } else { parts }
}

/// Returns what Autoware does without a report, as a clause.
fn consequence(report: StatusReport) -> &'static str {
    match report {
        StatusReport::Velocity => "Autoware has no odometry",
        StatusReport::Steering | StatusReport::Gear | StatusReport::ControlMode | StatusReport::Doors => {
            "Autoware's /api/vehicle/status never appears"
        }
    }
}

/// Returns the message about a steering report whose ratio was not measured on this car; `None` for other
/// reports.
fn listed_ratio(
    binding: &StatusBinding,
    geometry: &VehicleGeometry,
    report: StatusReport,
    source: usize,
) -> Option<MessagePart> {
    let RatioOrigin::Listed { car } = &geometry.ratio_origin else { return None };
    let is_used = report == StatusReport::Steering && binding.uses_ratio(source);
    let ratio = geometry.wheel_to_tire.as_ref()?.constant_ratio().filter(|_| is_used)?;
    Some(catalogue::ratio_listed(ratio, car))
}

/// Returns the message for an unavailable value: the kind of failure, if it is a failure, and the cause.
fn unavailable_message(
    binding: &StatusBinding,
    buses: &[Bus],
    reason: StatusReason,
    is_starting: bool,
) -> MessagePart {
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
        StatusReason::NotConfigured(key) => return catalogue::source_without_dimension(key.key()),
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
    if reason.is_awaited(is_starting) {
        return cause.within(report_catalogue::starting);
    }
    cause.within(match reason.failure() {
        Some(FaultKind::Unknown) => report_catalogue::unknown,
        Some(FaultKind::Invalid) => report_catalogue::invalid,
        Some(FaultKind::HardwareFault) => report_catalogue::hardware_fault,
        None => report_catalogue::asleep,
    })
}
