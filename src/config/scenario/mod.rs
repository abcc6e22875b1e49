//! Scenario files: OpenSCENARIO XML (`.xosc`), the same in YAML as TIER IV writes it, and our own
//! bench format in TOML or YAML, which `config/scenarios/bench.toml` explains.
//!
//! [`read`] gives the scenario or every reason why not. What a file says beyond traffic lights is
//! listed, not interpreted.

mod bench;
mod controllers;
mod file;
mod naming;
mod open_scenario;
mod reader;

use std::path::Path;

pub use crate::config::reading::location::SourceLocation;
pub use file::{NotInterpreted, ScenarioFile, UsedId};

use crate::config::files::Files;
use crate::config::reading::location::Text;
use crate::config::reading::problem::{Problem, Refused};
use crate::config::reading::toml_text::from_toml;
use crate::config::reading::value::{Entry, Kind, Value};
use crate::config::reading::xml_text::from_xml;
use crate::config::reading::yaml_text::from_yaml;
use crate::core::compat::Compat;
use reader::{Reader, SEE};

/// Reads a scenario; its form follows from the file's extension, and for YAML from the root key.
///
/// # Errors
/// All reasons, each with its place; of what is not even the form's grammar, the first.
pub fn read(files: &dyn Files, path: &Path, compat: Compat) -> Result<ScenarioFile, Refused> {
    let one = |problem| Refused(vec![problem]);
    let form = Form::of(path).map_err(one)?;
    let bytes = files
        .read(path)
        .map_err(|error| one(Problem::unreadable(path, &error, "give the path of a scenario")))?;
    let text = Text::new(path, bytes).map_err(one)?;
    let mut reader = Reader::new(text.file.clone(), compat);
    let mut file = match form {
        Form::Xml => {
            let root = from_xml(&text).map_err(one)?;
            open_scenario::interpret(&root, &mut reader)
        }
        Form::Toml => bench::interpret(&from_toml(&text, SEE).map_err(one)?, &mut reader),
        Form::Yaml => {
            let value = from_yaml(&text).map_err(one)?;
            match open_scenario_in(&value) {
                None => bench::interpret(&value, &mut reader),
                Some((root, others)) => {
                    let root = open_scenario::from_values(&text, root).map_err(one)?;
                    let is_filled = |entry: &&Entry| !matches!(entry.value.kind, Kind::Null);
                    for entry in others.filter(is_filled) {
                        reader.leave_out(&entry.location, "it is outside OpenSCENARIO");
                    }
                    open_scenario::interpret(&root, &mut reader)
                }
            }
        }
    };
    if !reader.problems.is_empty() {
        let mut problems = reader.problems;
        problems.sort_by_key(|problem| problem.position);
        problems.dedup();
        return Err(Refused(problems));
    }
    reader.not_interpreted.sort_by_key(|part| part.location.position);
    file.not_interpreted = reader.not_interpreted;
    reader.ids.sort_by_key(|used| used.location.position);
    file.ids = reader.ids;
    Ok(file)
}

/// How a file is written.
enum Form {
    Xml,
    Yaml,
    Toml,
}

impl Form {
    fn of(path: &Path) -> Result<Self, Problem> {
        let extension = path.extension().and_then(|extension| extension.to_str());
        match extension.map(str::to_ascii_lowercase).as_deref() {
            Some("xosc" | "xml") => Ok(Self::Xml),
            Some("yaml" | "yml") => Ok(Self::Yaml),
            Some("toml") => Ok(Self::Toml),
            Some(_) | None => {
                let reason = "unknown file extension of a scenario";
                Err(Problem::whole_file(path, reason, "name it .xosc, .yaml or .toml"))
            }
        }
    }
}

/// The root of TIER IV's form, and what stands beside it.
fn open_scenario_in(value: &Value) -> Option<(&Entry, impl Iterator<Item = &Entry>)> {
    let Kind::Map(entries) = &value.kind else { return None };
    let is_root = |entry: &&Entry| entry.key == open_scenario::ROOT;
    let root = entries.iter().find(is_root)?;
    Some((root, entries.iter().filter(move |entry| !is_root(entry))))
}
