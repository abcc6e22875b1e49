//! Handles reports that are decided late because the process was stopped or the machine was busy.
//!
//! Inputs of that time are handled in the order of their stamps, as in a recording. The resulting reports are
//! out of date, so only the last report of each topic is published.

use std::time::Duration;

use super::event::Output;

/// Maximum lag of a report behind its decision. Later reports wait until everything that is due has been
/// decided.
const MAX_REPORT_LAG: Duration = Duration::from_millis(200);

/// The newest late output of each report topic.
#[derive(Debug, Default)]
pub(super) struct LateReports {
    held: Vec<(&'static str, Output)>,
}

/// Returns the report of an output; `None` for other outputs.
fn report(output: &Output) -> Option<&'static str> {
    if let Output::VehicleLights(output) = output {
        return Some(output.named().0);
    }
    if let Output::VehicleStatus(output) = output { Some(output.report().name()) } else { None }
}

impl LateReports {
    /// Holds a report if its `lag` is too large, and returns true in that case. A report that is in time
    /// discards the held report of its topic.
    pub(super) fn holds(&mut self, output: &Output, lag: Duration) -> bool {
        let Some(report) = report(output) else { return false };
        let is_late = lag > MAX_REPORT_LAG;
        self.held.retain(|(held, _)| *held != report);
        if is_late {
            self.held.push((report, output.clone()));
        }
        is_late
    }

    /// Returns and removes the held reports. Call it when everything that is due has been decided.
    pub(super) fn take(&mut self) -> impl Iterator<Item = Output> + use<> {
        std::mem::take(&mut self.held).into_iter().map(|(_, output)| output)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle_lights::output::VehicleLightsOutput;
    use crate::vehicle_lights::verdict::{HazardLights, TurnIndicators};
    use crate::vehicle_report::Step;
    use crate::vehicle_status::output::VehicleStatusOutput;
    use crate::vehicle_status::steering::TireAngle;
    use gateway_base::time::WallStamp;

    const LATE: Duration = Duration::from_millis(201);

    fn turn(turn: TurnIndicators, second: i64) -> Output {
        let stamp = WallStamp::from_nanos(second * 1_000_000_000);
        Output::VehicleLights(VehicleLightsOutput::TurnIndicators(Step::Publish(turn, stamp)))
    }

    fn steering(angle_rad: f64, second: i64) -> Output {
        let stamp = WallStamp::from_nanos(second * 1_000_000_000);
        Output::VehicleStatus(VehicleStatusOutput::Steering(Step::Publish(TireAngle(angle_rad), stamp)))
    }

    #[test]
    fn only_the_newest_of_several_late_reports_is_published() {
        let mut late = LateReports::default();
        let hazard = Output::VehicleLights(VehicleLightsOutput::HazardLights(Step::Withdraw));
        let gear = Output::VehicleStatus(VehicleStatusOutput::Gear(Step::Withdraw));
        let newest = [hazard, gear, turn(TurnIndicators::EnableRight, 2), steering(0.2, 2)];
        let older = [turn(TurnIndicators::EnableLeft, 1), steering(0.1, 1)];
        for output in older.iter().chain(&newest) {
            assert!(late.holds(output, LATE));
        }
        assert_eq!(late.take().collect::<Vec<_>>(), newest);
        assert_eq!(late.take().count(), 0);
    }

    #[test]
    fn a_late_report_is_dropped_when_a_later_decision_withdraws_it() {
        let mut late = LateReports::default();
        let withdrawn = Output::VehicleLights(VehicleLightsOutput::TurnIndicators(Step::Withdraw));
        assert!(late.holds(&turn(TurnIndicators::EnableLeft, 1), LATE));
        assert!(late.holds(&withdrawn, LATE));
        assert_eq!(late.take().collect::<Vec<_>>(), [withdrawn]);
    }

    #[test]
    fn a_report_in_time_is_published_at_once_and_replaces_a_late_one() {
        let mut late = LateReports::default();
        let hazard =
            VehicleLightsOutput::HazardLights(Step::Publish(HazardLights::Enable, WallStamp::default()));
        let hazard = Output::VehicleLights(hazard);
        let in_time = Duration::from_millis(200);
        for (output, lag, is_held) in [
            (turn(TurnIndicators::EnableLeft, 1), LATE, true),
            (steering(0.1, 1), LATE, true),
            (hazard.clone(), LATE, true),
            (turn(TurnIndicators::Disable, 2), in_time, false),
            (steering(0.2, 2), in_time, false),
        ] {
            assert_eq!(late.holds(&output, lag), is_held);
        }
        assert_eq!(late.take().collect::<Vec<_>>(), [hazard]);
    }
}
