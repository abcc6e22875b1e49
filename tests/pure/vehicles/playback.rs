//! A recording played to its end, reduced to what changed.

use std::collections::BTreeSet;
use std::io::Cursor;
use std::path::Path;

use signal_gateway::config::Settings;
use signal_gateway::core::can::link::BusIndex;
use signal_gateway::core::diagnostics::{Level, Status};
use signal_gateway::core::gateway::event::Output;
use signal_gateway::core::validation::integrity::IntegrityCounts;
use signal_gateway::core::validation::table::MessageIndex;
use signal_gateway::core::vehicle_lights::output::VehicleLightsOutput;
use signal_gateway::io::can::log::Log;
use signal_gateway::replay::{Replay, Routes};

/// What a recording gave.
pub(crate) struct Playback {
    /// Changes of the turn report: milliseconds, and the constant's name or `stops`.
    pub(crate) turn: Vec<(u64, &'static str)>,
    /// Changes of the hazard report, likewise.
    pub(crate) hazard: Vec<(u64, &'static str)>,
    /// Every status that was sent as a change, refreshes left out.
    pub(crate) told: Vec<Told>,
    /// All statuses at the end.
    pub(crate) last: Vec<Status>,
    /// What the guard of the first bound message counted; nothing when it has none.
    pub(crate) checker: IntegrityCounts,
    /// Length, ms.
    pub(crate) end_ms: u64,
}

/// A status that was sent because it changed.
pub(crate) struct Told {
    pub(crate) ms: u64,
    /// The part of the name behind the node.
    pub(crate) task: String,
    pub(crate) level: Level,
    pub(crate) message: String,
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
        told: vec![],
        last: vec![],
        checker: IntegrityCounts::default(),
        end_ms: 0,
    };
    loop {
        let ms = replay.now().mono.as_nanos() / 1_000_000;
        while let Some(output) = replay.poll_output() {
            playback.take(output, ms);
        }
        if !replay.step().unwrap() {
            break;
        }
    }
    playback.end_ms = replay.now().mono.as_nanos() / 1_000_000;
    playback.last = replay.gateway().statuses(replay.now().mono);
    let seen = replay.gateway().lights().observations();
    playback.checker = seen.integrity_counts(MessageIndex(0)).unwrap_or_default();
    assert_eq!(replay.log().bad_lines(), 0);
    playback
}

impl Playback {
    fn take(&mut self, output: Output, ms: u64) {
        match output {
            Output::VehicleLights(VehicleLightsOutput::TurnIndicators { report, .. }) => {
                change(&mut self.turn, ms, report.name());
            }
            Output::VehicleLights(VehicleLightsOutput::HazardLights { report, .. }) => {
                change(&mut self.hazard, ms, report.name());
            }
            Output::VehicleLights(VehicleLightsOutput::WithdrawTurnIndicators) => {
                change(&mut self.turn, ms, "stops");
            }
            Output::VehicleLights(VehicleLightsOutput::WithdrawHazardLights) => {
                change(&mut self.hazard, ms, "stops");
            }
            Output::TrafficLights(_) | Output::TurnSignal(_) | Output::Command(_) => {
                panic!("nothing but reports here")
            }
            Output::Diagnostics { diagnostics, .. } if !diagnostics.refresh => {
                for Status { name, level, message, .. } in diagnostics.statuses {
                    let task = name.rsplit_once(": ").unwrap().1.to_owned();
                    self.told.push(Told { ms, task, level, message });
                }
            }
            Output::Diagnostics { .. } => {}
        }
    }

    /// The states that were ever published on the turn topic.
    pub(crate) fn turn_states(&self) -> BTreeSet<&'static str> {
        self.turn.iter().map(|(_, state)| *state).filter(|state| *state != "stops").collect()
    }

    /// What was said of one task, in order: level and message.
    pub(crate) fn said(&self, task: &str) -> Vec<(Level, &str)> {
        self.of(task).map(|told| (told.level, told.message.as_str())).collect()
    }

    /// What was said of one task, in order.
    pub(crate) fn of(&self, task: &str) -> impl Iterator<Item = &Told> {
        self.told.iter().filter(move |told| told.task == task)
    }

    /// A key of the last status of a task.
    pub(crate) fn value(&self, task: &str, key: &str) -> &str {
        let status = self.last.iter().find(|status| status.name.ends_with(task)).unwrap();
        &status.values.iter().find(|(name, _)| *name == key).unwrap().1
    }
}

fn change(changes: &mut Vec<(u64, &'static str)>, ms: u64, state: &'static str) {
    if changes.last().is_none_or(|(_, last)| *last != state) {
        changes.push((ms, state));
    }
}
