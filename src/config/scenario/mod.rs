//! Scenario files: OpenSCENARIO XML (`.xosc`), the same in YAML as TIER IV writes it, and our own
//! bench format in TOML or YAML, which `config/scenarios/bench.toml` explains.
//!
//! [`read`] gives the scenario or every reason why not. What a file says beyond traffic lights is
//! listed, not interpreted.

mod bench;
mod controllers;
mod element;
mod naming;
mod on_map;
mod open_scenario;
mod reading;

use std::fmt;
use std::path::{Path, PathBuf};

pub use crate::config::values::place::Place;

use crate::config::files::Files;
use crate::config::problem::{Problem, Refused};
use crate::config::values::place::Text;
use crate::config::values::{Entry, Kind, Value, from_toml, from_yaml};
use crate::core::map::light_map::GroupEntry;
use crate::core::traffic_light::compat::Compat;
use crate::core::traffic_light::scenario::Scenario;
use reading::Reading;

/// Where the keys of our own form are explained.
const SEE: &str = "config/scenarios/bench.toml";

/// What a scenario file says.
#[derive(Debug, Clone, PartialEq)]
pub struct ScenarioFile {
    /// What shall happen.
    pub scenario: Scenario,
    /// The map it is for, relative to the working directory as the file's own path is; none = the
    /// file does not say, or says it in a way that only its launch system understands.
    pub map: Option<PathBuf>,
    /// Groups that stand in for a map; bench format only.
    pub groups: Vec<GroupEntry>,
    /// What it says beyond traffic lights, in the order of the file.
    pub not_interpreted: Vec<NotInterpreted>,
    /// Every id it names, for [`ScenarioFile::check_against`].
    pub ids: Vec<UsedId>,
}

/// A part of the file that has no effect.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NotInterpreted {
    /// Where it stands first.
    pub place: Place,
    /// What it is, how often, or why it has no effect.
    pub what: String,
}

/// `file:line:column: element: what`
impl fmt::Display for NotInterpreted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: not interpreted: {}", self.place, self.what)
    }
}

/// An id of a light or group where it stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UsedId {
    /// Way or relation id.
    pub id: i64,
    /// Where it stands.
    pub place: Place,
}

/// Reads a scenario; its form follows from the file's extension, and for YAML from the root key.
///
/// # Errors
/// All reasons, each with its place; of what is not even the form's grammar, the first.
pub fn read(files: &dyn Files, path: &Path, compat: Compat) -> Result<ScenarioFile, Refused> {
    let one = |problem| Refused(vec![problem]);
    let form = Form::of(path).map_err(one)?;
    let bytes = files.read(path).map_err(|error| one(unreadable(path, &error)))?;
    let text = Text::new(path, bytes).map_err(one)?;
    let mut reading = Reading::new(text.file.clone(), compat);
    let mut file = match form {
        Form::Xml => {
            let root = element::from_xml(&text).map_err(one)?;
            open_scenario::interpret(&root, path, &mut reading)
        }
        Form::Toml => bench::interpret(&from_toml(&text, SEE).map_err(one)?, path, &mut reading),
        Form::Yaml => {
            let value = from_yaml(&text).map_err(one)?;
            match open_scenario_in(&value) {
                None => bench::interpret(&value, path, &mut reading),
                Some((root, others)) => {
                    let root = element::from_values(&text, root).map_err(one)?;
                    let is_filled = |entry: &&Entry| !matches!(entry.value.kind, Kind::Null);
                    for entry in others.filter(is_filled) {
                        reading.leave_out(&entry.spot, "it stands beside OpenSCENARIO");
                    }
                    open_scenario::interpret(&root, path, &mut reading)
                }
            }
        }
    };
    if !reading.problems.is_empty() {
        let mut problems = reading.problems;
        problems.sort_by_key(|problem| problem.position);
        problems.dedup();
        return Err(Refused(problems));
    }
    reading.not_interpreted.sort_by_key(|part| part.place.position);
    file.not_interpreted = reading.not_interpreted;
    reading.ids.sort_by_key(|used| used.place.position);
    file.ids = reading.ids;
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
            Some(_) | None => Err(Problem {
                file: path.to_owned(),
                position: None,
                key: String::new(),
                reason: "the extension tells no form of scenario".to_owned(),
                remedy: "name it .xosc, .yaml or .toml".to_owned(),
            }),
        }
    }
}

fn unreadable(path: &Path, error: &std::io::Error) -> Problem {
    Problem {
        file: path.to_owned(),
        position: None,
        key: String::new(),
        reason: format!("cannot read it: {error}"),
        remedy: "give the path of a scenario".to_owned(),
    }
}

/// The root of TIER IV's form, and what stands beside it.
fn open_scenario_in(value: &Value) -> Option<(&Entry, impl Iterator<Item = &Entry>)> {
    let Kind::Map(entries) = &value.kind else { return None };
    let is_root = |entry: &&Entry| entry.key == open_scenario::ROOT;
    let root = entries.iter().find(is_root)?;
    Some((root, entries.iter().filter(move |entry| !is_root(entry))))
}

/// A path in a scenario file is relative to that file.
fn beside(path: &Path, named: &str) -> PathBuf {
    path.parent().unwrap_or(Path::new("")).join(named)
}
