//! Handles reports that are decided late, because the process was stopped or the machine was busy.
//!
//! Inputs of that time are decided in the order of their stamps, as in a recording. The reports are out of date when
//! they are decided, so only the last one of each topic is published.

use std::mem::discriminant;
use std::time::Duration;

use crate::core::gateway::event::Output;
use crate::core::vehicle_lights::output::VehicleLightsOutput;

/// Maximum lag of a report behind its decision. Later reports wait until everything that is due has been decided.
const MAX_REPORT_LAG: Duration = Duration::from_millis(200);

/// The newest late output of each report topic.
#[derive(Debug, Default)]
pub(super) struct LateReports {
    held: Vec<VehicleLightsOutput>,
}

impl LateReports {
    /// Keeps a report that is `lag` late, and returns true, if that is too late. A report in time replaces the kept
    /// one of its topic.
    pub(super) fn holds(&mut self, output: &Output, lag: Duration) -> bool {
        let Output::VehicleLights(output) = output else { return false };
        let is_late = lag > MAX_REPORT_LAG;
        self.held.retain(|held| discriminant(held) != discriminant(output));
        self.held.extend(is_late.then_some(*output));
        is_late
    }

    /// Takes the kept reports. Call it when everything that is due has been decided.
    pub(super) fn take(&mut self) -> impl Iterator<Item = VehicleLightsOutput> + use<> {
        std::mem::take(&mut self.held).into_iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::time::WallStamp;
    use crate::core::vehicle_lights::verdict::{HazardLights, TurnIndicators};
    use crate::core::vehicle_report::Step;

    const LATE: Duration = Duration::from_millis(201);

    fn turn(turn: TurnIndicators, second: i64) -> VehicleLightsOutput {
        let stamp = WallStamp::from_nanos(second * 1_000_000_000);
        VehicleLightsOutput::TurnIndicators(Step::Publish(turn, stamp))
    }

    #[test]
    fn only_the_newest_of_several_late_reports_is_published() {
        let mut late = LateReports::default();
        let hazard = VehicleLightsOutput::HazardLights(Step::Withdraw);
        for output in [turn(TurnIndicators::EnableLeft, 1), hazard, turn(TurnIndicators::EnableRight, 2)] {
            assert!(late.holds(&Output::VehicleLights(output), LATE));
        }
        assert_eq!(late.take().collect::<Vec<_>>(), [hazard, turn(TurnIndicators::EnableRight, 2)]);
        assert_eq!(late.take().count(), 0);
    }

    #[test]
    fn a_late_report_is_dropped_when_a_later_decision_withdraws_it() {
        let mut late = LateReports::default();
        let withdrawn = VehicleLightsOutput::TurnIndicators(Step::Withdraw);
        assert!(late.holds(&Output::VehicleLights(turn(TurnIndicators::EnableLeft, 1)), LATE));
        assert!(late.holds(&Output::VehicleLights(withdrawn), LATE));
        assert_eq!(late.take().collect::<Vec<_>>(), [withdrawn]);
    }

    #[test]
    fn a_report_in_time_is_published_at_once_and_replaces_a_late_one() {
        let mut late = LateReports::default();
        let hazard =
            VehicleLightsOutput::HazardLights(Step::Publish(HazardLights::Enable, WallStamp::from_nanos(0)));
        assert!(late.holds(&Output::VehicleLights(turn(TurnIndicators::EnableLeft, 1)), LATE));
        assert!(late.holds(&Output::VehicleLights(hazard), LATE));
        assert!(
            !late.holds(&Output::VehicleLights(turn(TurnIndicators::Disable, 2)), Duration::from_millis(200))
        );
        assert_eq!(late.take().collect::<Vec<_>>(), [hazard]);
    }
}
