//! Scenario files: refusals with their locations and texts, accepted files, and parts that are left out.

mod as_users_write;
mod garbled;
mod hostile;
mod open_scenario;
mod own_form;
mod real_size;
mod shipped;
mod storyboard_elements;
mod upstream;
mod variables;

use std::path::Path;

use signal_gateway::config::Problem;
use signal_gateway::config::scenario::{ScenarioFile, read};
use signal_gateway::core::compat::Compat;

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

/// A text to be refused, with `@@` at the location that must be named; the key; parts of reason and remedy.
type Row<'a> = (&'a str, &'a str, &'a str, &'a str);

/// Checks that every text is refused with exactly one problem, at its mark and with those parts.
fn assert_refused(compat: Compat, name: &str, rows: &[(String, Row<'_>)]) {
    let mut wrong = Vec::new();
    for (marked, (part, key, reason, remedy)) in rows {
        let before = marked.split_once("@@").map_or("", |(before, _)| before);
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap().chars().count() + 1;
        match read_as(compat, name, marked.replace("@@", "").as_bytes()) {
            Ok(_) => wrong.push(format!("{part:?} is accepted")),
            Err(problems) => {
                let [problem] = problems.as_slice() else {
                    wrong.push(format!("{part:?} has several problems:\n{}", shown(&problems)));
                    continue;
                };
                let is_placed = problem.position == Some((line, column)) && problem.key.ends_with(key);
                let is_keyed = !key.is_empty() || problem.key.is_empty();
                if !is_placed
                    || !is_keyed
                    || !problem.reason.contains(reason)
                    || !problem.remedy.contains(remedy)
                {
                    wrong.push(format!(
                        "{part:?}:\n  {problem}\n  {name}:{line}:{column}: …{key}: {reason}; {remedy}"
                    ));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}
