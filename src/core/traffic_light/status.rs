//! Diagnostics of the channels and of the scenario.

use std::time::Duration;

use super::engine::TrafficLights;
use super::event_log::ScenarioOutcome;
use super::scenario::ControllerIndex;
use super::target::LightChannel;
use crate::core::diagnostics::{Level, Status};
use crate::core::time::MonoTime;

/// The number of controllers that are listed.
const MAX_LISTED: usize = 8;
/// The time for which a rejected input is a warning.
const REJECTED_LATELY: Duration = Duration::from_secs(10);

impl TrafficLights {
    /// One status for each channel and one for the scenario.
    pub fn statuses(&self, now: MonoTime) -> Vec<Status> {
        let channels = LightChannel::ALL.into_iter().map(|channel| self.channel_status(channel, now));
        channels.chain([self.scenario_status(now)]).collect()
    }

    fn channel_status(&self, channel: LightChannel, now: MonoTime) -> Status {
        let (truth_rate, v2i_rate) = self.rates();
        let (rate, stale) = match channel {
            LightChannel::Conventional => (truth_rate, 0),
            LightChannel::V2i => (v2i_rate, self.expiry.expired()),
        };
        let counts = self.counts[channel as usize];
        let (truth, detected) = (self.stores().truth(channel).counts, self.stores().detected(channel).counts);
        let rejected = counts.last_rejected.filter(|(_, at)| now.since(*at) < REJECTED_LATELY);
        let (level, message) = match (stale, rejected) {
            (0, None) => match self.stores().contradictory_light(channel) {
                None => (Level::Ok, "normal".to_owned()),
                Some(id) => (Level::Warn, format!("{id} shows red and green")),
            },
            (0, Some((Some(id), _))) => (Level::Warn, format!("an input for {id} was rejected")),
            (0, Some((None, _))) => (Level::Warn, "an unreadable input was rejected".to_owned()),
            (_, _) => (Level::Warn, "lights are no longer received".to_owned()),
        };
        let mut values = vec![
            ("lights", truth.lights.to_string()),
            ("dark", truth.dark.to_string()),
            ("unknown", (truth.unknown + detected.unknown).to_string()),
            ("detected", detected.lights.to_string()),
            ("contradictory", (truth.contradictory + detected.contradictory).to_string()),
            ("stale", stale.to_string()),
            ("rejected", counts.rejected.to_string()),
            ("rate_hz", rate.as_hz().to_string()),
        ];
        if let Some((Some(id), _)) = counts.last_rejected {
            values.push(("last_rejected", id.to_string()));
        }
        Status::new(format!("traffic_lights_{}", channel.name()), level, message, values)
    }

    fn scenario_status(&self, now: MonoTime) -> Status {
        let scenario = self.scenario();
        let is_empty = scenario.controllers.is_empty() && scenario.acts.is_empty();
        let (level, message) = match self.verdict() {
            None if is_empty => (Level::Ok, "no scenario".to_owned()),
            None => (Level::Ok, "running".to_owned()),
            Some(ScenarioOutcome::Success) => (Level::Ok, "ended in success".to_owned()),
            Some(ScenarioOutcome::Stopped) => (Level::Ok, "ended".to_owned()),
            Some(ScenarioOutcome::Failure) => (Level::Warn, "ended in failure".to_owned()),
            Some(ScenarioOutcome::Fault(refusal)) => (Level::Error, format!("cannot continue: {refusal}")),
        };
        let mut values = vec![("controllers", scenario.controllers.len().to_string())];
        for (index, controller) in scenario.controllers.iter().enumerate().take(MAX_LISTED) {
            let state = self.controller(ControllerIndex(index));
            let phase = state.and_then(|state| Some((state.start, controller.phases.get(state.phase?)?)));
            let text = match phase {
                None => format!("{}: no phase yet", controller.name),
                Some((start, phase)) => {
                    let next = match phase.duration {
                        _ if self.verdict().is_some() => "stopped".to_owned(),
                        None => "until an action".to_owned(),
                        Some(duration) => {
                            let end = start.after(duration).nanos;
                            let left = Duration::from_nanos(end.saturating_sub(self.nanos(now)));
                            format!("{:.1} s left", left.as_secs_f64())
                        }
                    };
                    format!("{}: {}, {next}", controller.name, phase.name)
                }
            };
            values.push(("controller", text));
        }
        values.push(("skipped", self.skipped().to_string()));
        Status::new("traffic_lights_scenario", level, message, values)
    }
}
