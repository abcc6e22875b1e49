//! A recording played to its end, reduced to what changed.

use std::collections::BTreeSet;
use std::io::Cursor;
use std::path::Path;

use can_log::Log;
use can_signal::can::link::BusIndex;
use can_signal::validation::integrity::IntegrityCounts;
use can_signal::validation::table::MessageIndex;
use gateway_base::diagnostics::{Level, Status};
use gateway_base::time::MonoTime;
use gateway_core::gateway::event::Output;
use gateway_core::vehicle_lights::output::VehicleLightsOutput;
use gateway_core::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use gateway_core::vehicle_status::output::VehicleStatusOutput;
use signal_gateway::config::Settings;
use signal_gateway::replay::{Replay, Routes};

use crate::support::clock::millis;
use crate::support::virtual_gateway::StatusChange;

/// The results of a recording.
pub(crate) struct Playback {
    /// Changes of the turn report: milliseconds, and the constant's name or `stops`.
    pub(crate) turn: Vec<(u64, &'static str)>,
    /// Changes of the hazard report, likewise.
    pub(crate) hazard: Vec<(u64, &'static str)>,
    /// Every report on the vehicle's status, with its time in milliseconds.
    pub(crate) status: Vec<(u64, VehicleStatusOutput)>,
    /// Every status that was sent as a change, refreshes left out.
    pub(crate) changes: Vec<StatusChange>,
    /// All statuses at the end.
    pub(crate) last: Vec<Status>,
    /// The counts of the first bound message's checker; zero when it has none.
    pub(crate) checker: IntegrityCounts,
    /// Length, ms.
    pub(crate) end_ms: u64,
}

/// The two tasks that judge reports.
pub(crate) const TURN: &str = "turn_indicators";
pub(crate) const HAZARD: &str = "hazard_lights";

/// Plays a log file; when profile and log know one interface each, they need not agree on its name.
pub(crate) fn play_file(settings: &Settings, path: &Path) -> Playback {
    let mut routes = Routes::by_interface(&settings.gateway);
    routes.adopt_only_interface(path);
    play(settings, Log::open(path).unwrap(), routes)
}

/// Plays one interface of a log file, whatever the profile's only bus calls it.
pub(crate) fn play_interface(settings: &Settings, path: &Path, interface: &str) -> Playback {
    play(settings, Log::open(path).unwrap(), Routes(vec![(interface.to_owned(), BusIndex(0))]))
}

/// Plays candump text; `interface` is that of the only bus.
pub(crate) fn play_text(settings: &Settings, text: &str, interface: &str) -> Playback {
    let log = Log::new(Box::new(Cursor::new(text.as_bytes().to_vec()))).unwrap();
    play(settings, log, Routes(vec![(interface.to_owned(), BusIndex(0))]))
}

/// Plays candump text of the settings' own interfaces.
pub(crate) fn play_log(settings: &Settings, text: &str) -> Playback {
    let log = Log::new(Box::new(Cursor::new(text.as_bytes().to_vec()))).unwrap();
    play(settings, log, Routes::by_interface(&settings.gateway))
}

fn play(settings: &Settings, log: Log, routes: Routes) -> Playback {
    let mut replay = Replay::new(settings.gateway.clone(), log, routes).unwrap();
    let mut playback = Playback {
        turn: vec![],
        hazard: vec![],
        status: vec![],
        changes: vec![],
        last: vec![],
        checker: IntegrityCounts::default(),
        end_ms: 0,
    };
    loop {
        let at = replay.now().mono;
        while let Some(output) = replay.poll_output() {
            playback.take(output, at);
        }
        if !replay.step().unwrap() {
            break;
        }
    }
    playback.end_ms = millis(replay.now().mono);
    playback.last = replay.gateway().statuses(replay.now().mono);
    let observations = replay.gateway().lights().observations();
    playback.checker = observations.integrity_counts(MessageIndex(0)).unwrap_or_default();
    assert_eq!(replay.log().bad_lines(), 0);
    playback
}

impl Playback {
    fn take(&mut self, output: Output, at: MonoTime) {
        let ms = millis(at);
        match output {
            Output::VehicleLights(VehicleLightsOutput::TurnIndicators(step)) => {
                note(&mut self.turn, ms, step.value().map_or("stops", TurnIndicators::name));
            }
            Output::VehicleLights(VehicleLightsOutput::HazardLights(step)) => {
                note(&mut self.hazard, ms, step.value().map_or("stops", HazardLights::name));
            }
            Output::VehicleStatus(status) => self.status.push((ms, status)),
            Output::TrafficLights(_) | Output::TurnSignal(_) | Output::Command(_) => {
                panic!("nothing but reports here")
            }
            Output::Diagnostics { diagnostics, .. } => {
                self.changes.extend(StatusChange::all(diagnostics, at));
            }
        }
    }

    /// The states that were ever published on the turn topic.
    pub(crate) fn turn_states(&self) -> BTreeSet<&'static str> {
        self.turn.iter().map(|(_, state)| *state).filter(|state| *state != "stops").collect()
    }

    /// The status changes of one task, in order: level and message.
    pub(crate) fn statuses_of(&self, task: &str) -> Vec<(Level, &str)> {
        self.changes_of(task).map(|change| (change.level, change.message.as_str())).collect()
    }

    /// The status changes of one task, in order.
    pub(crate) fn changes_of(&self, task: &str) -> impl Iterator<Item = &StatusChange> {
        self.changes.iter().filter(move |change| change.task == task)
    }

    /// A key of the last status of a task.
    pub(crate) fn value(&self, task: &str, key: &str) -> &str {
        let status = self.last.iter().find(|status| status.task == task).unwrap();
        &status.values.iter().find(|(name, _)| *name == key).unwrap().1
    }
}

fn note(changes: &mut Vec<(u64, &'static str)>, ms: u64, state: &'static str) {
    if changes.last().is_none_or(|(_, last)| *last != state) {
        changes.push((ms, state));
    }
}
