//! Diagnostics of the channels and of the scenario.

use std::time::Duration;

use super::catalogue::{self, CHANNELS, TRAFFIC_LIGHTS_SCENARIO};
use super::engine::TrafficLights;
use super::event_log::ScenarioOutcome;
use super::scenario::ControllerIndex;
use super::target::{LightChannel, StoreId, StoreLayer};
use gateway_base::diagnostics::{Level, MessagePart, Status};
use gateway_base::time::MonoTime;

/// Maximum number of controllers listed.
const MAX_LISTED: usize = 8;
/// Time for which a rejected input is a warning.
const REJECTED_LATELY: Duration = Duration::from_secs(10);

impl TrafficLights {
    /// Returns one status for each channel and one for the scenario; `clock` is the fault of the simulated
    /// clock, if any.
    pub fn statuses(&self, clock: Option<MessagePart>, now: MonoTime) -> Vec<Status> {
        let channels = LightChannel::ALL.into_iter().map(|channel| self.channel_status(channel, now));
        channels.chain([self.scenario_status(clock, now)]).collect()
    }

    fn channel_status(&self, channel: LightChannel, now: MonoTime) -> Status {
        let (timer, stale) = match channel {
            LightChannel::Conventional => (&self.scenario_state.ground_truth, 0),
            LightChannel::V2i => (&self.scenario_state.v2i, self.expiry.expired()),
        };
        let counts = self.counts[channel as usize];
        let [truth, detected] = [StoreLayer::GroundTruth, StoreLayer::Detected]
            .map(|layer| self.stores().counts(StoreId { channel, layer }));
        let rejected = counts.last_rejected.filter(|(_, at)| now.since(*at) < REJECTED_LATELY);
        let message = match (stale, rejected) {
            (0, None) => match self.stores().contradictory_light(channel) {
                None => catalogue::normal(),
                Some(id) => catalogue::red_and_green(id),
            },
            (0, Some((Some(id), _))) => catalogue::rejected(id),
            (0, Some((None, _))) => catalogue::unreadable(),
            (_, _) => catalogue::stale(),
        };
        let mut values = vec![
            ("lights", truth.lights.to_string()),
            ("dark", truth.dark.to_string()),
            ("unknown", (truth.unknown + detected.unknown).to_string()),
            ("detected", detected.lights.to_string()),
            ("contradictory", (truth.contradictory + detected.contradictory).to_string()),
            ("stale", stale.to_string()),
            ("rejected", counts.rejected.to_string()),
            ("rate_hz", timer.rate.as_hz().to_string()),
        ];
        if let Some((Some(id), _)) = counts.last_rejected {
            values.push(("last_rejected", id.to_string()));
        }
        Status::new(&CHANNELS, format!("traffic_lights_{}", channel.name()), &[message], values)
    }

    fn scenario_status(&self, clock: Option<MessagePart>, now: MonoTime) -> Status {
        let scenario = self.scenario();
        let is_empty = scenario.controllers.is_empty() && scenario.acts.is_empty();
        let message = match self.verdict() {
            None if is_empty => catalogue::no_scenario(),
            None => catalogue::running(),
            Some(ScenarioOutcome::Success) => catalogue::ended_in_success(),
            Some(ScenarioOutcome::Stopped) => catalogue::ended(),
            Some(ScenarioOutcome::Failure) => catalogue::ended_in_failure(),
            Some(ScenarioOutcome::Fault(refusal)) => catalogue::cannot_continue(refusal),
        };
        let message = clock.filter(|_| message.level() == Level::Ok).unwrap_or(message);
        let mut values = vec![("controllers", scenario.controllers.len().to_string())];
        for (index, controller) in scenario.controllers.iter().enumerate().take(MAX_LISTED) {
            let state = self.scenario_state.controllers.state(ControllerIndex(index));
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
        Status::new(&TRAFFIC_LIGHTS_SCENARIO, "traffic_lights_scenario", &[message], values)
    }
}
