//! Scenario files: refusals with their locations and texts, accepted files, and parts that are left out.
//! Most refusals are cases in `tests/cases/scenario`.

mod as_users_write;
mod garbled;
mod hostile;
mod open_scenario;
mod real_size;
mod shipped;
mod storyboard_elements;
mod upstream;
mod variables;

use std::path::Path;

use signal_gateway::config::Problem;
use signal_gateway::config::scenario::{ScenarioFile, read};
use traffic_lights::compat::Compat;

use crate::support::cases::{self, Case};
use crate::support::files::MemoryFiles;

fn read_as(compat: Compat, name: &str, bytes: &[u8]) -> Result<ScenarioFile, Vec<Problem>> {
    read(&MemoryFiles::new([(name, bytes)]), Path::new(name), compat).map_err(|refused| refused.0)
}

fn read_text(name: &str, text: &str) -> Result<ScenarioFile, Vec<Problem>> {
    read_as(Compat::Improved, name, text.as_bytes())
}

fn accepted(compat: Compat, name: &str, text: &str) -> ScenarioFile {
    read_as(compat, name, text.as_bytes()).unwrap_or_else(|problems| panic!("{}", shown(&problems)))
}

fn shown(problems: &[Problem]) -> String {
    problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

/// The answer to a case: what is refused, line by line.
fn answer(compat: Compat, case: &Case) -> String {
    let read = read_as(compat, case.file, case.files.text(case.file).as_bytes());
    read.map_or_else(|problems| shown(&problems), |_| "accepted".to_owned())
}

#[test]
fn broken_scenarios_are_refused_where_they_break() {
    cases::check("scenario", &MemoryFiles::default(), |case| answer(Compat::Improved, case));
}

#[test]
fn refusals_of_upstream_remain_in_upstream_mode() {
    cases::check("scenario_upstream", &MemoryFiles::default(), |case| answer(Compat::Upstream, case));
}
