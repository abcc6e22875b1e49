//! Scenario files: OpenSCENARIO XML (`.xosc`), the same in TIER IV's YAML form, and our own bench format in
//! TOML, which `config/scenarios/bench.toml` explains.
//!
//! [`read`] returns the scenario or every problem. Parts that are not about traffic lights are listed, not
//! interpreted.

mod bench;
mod bulb_order;
mod controllers;
mod file;
mod light_names;
mod modifiers;
mod naming;
mod open_scenario;
mod reader;

use std::path::Path;

pub use crate::config::reading::location::SourceLocation;
pub use bulb_order::BulbOrder;
pub use file::{NotInterpreted, ScenarioFile, UncertainEnd, UsedId};
pub use light_names::LightNames;
pub use reader::ReadOptions;

use crate::config::built_in::BuiltIn;
use crate::config::file_kind::FileKind;
use crate::config::files::Files;
use crate::config::named_file;
use crate::config::reading::{Checker, Kind, Problem, Refused, from_toml, from_xml, from_yaml};
use modifiers::Modifiers;
use reader::{SEE, ScenarioReader};

/// Reads a scenario, by path or built-in name; its form is determined by the file's extension, otherwise by
/// its content.
///
/// # Errors
/// Returns every problem with its location; only the first problem if the file violates the grammar of its
/// form.
pub fn read(
    files: &dyn Files,
    path: &Path,
    options: impl Into<ReadOptions>,
) -> Result<ScenarioFile, Refused> {
    let options = options.into();
    let path = &named_file::find_here(BuiltIn::Scenario, files, path);
    let missing = BuiltIn::Scenario.did_you_mean(path, "give the path of a scenario");
    let text = FileKind::Scenario.read(files, path, &missing)?.not_blank()?;
    let form = ScenarioForm::of(path, &text.content)?;
    let checker = Checker::new(&text.file, SEE);
    let mut reader = ScenarioReader::new(&checker, &options);
    let mut file = match form {
        ScenarioForm::Xml => open_scenario::interpret(&from_xml(&text)?, &mut reader),
        ScenarioForm::Toml => bench::interpret(&from_toml(&text, SEE)?, &mut reader),
        ScenarioForm::Yaml => {
            let value = from_yaml(&text)?;
            let entries = checker.entries(&value, "give OpenSCENARIO in YAML");
            let (roots, others): (Vec<_>, Vec<_>) =
                entries.iter().partition(|entry| entry.key == open_scenario::ROOT);
            for entry in others.iter().filter(|entry| !matches!(entry.value.kind, Kind::Null)) {
                if entry.key == modifiers::ROOT {
                    reader.modifiers = Modifiers::read(&checker, &entry.value, &options.modifiers);
                    reader.list_modifiers(&entry.location);
                } else {
                    reader.leave_out(&entry.location, "it is outside OpenSCENARIO");
                }
            }
            match roots.first() {
                Some(root) => {
                    let mut root = open_scenario::from_values(&text, root)?;
                    reader.modifiers.replace_in(&checker, &mut root);
                    open_scenario::interpret(&root, &mut reader)
                }
                None if !matches!(value.kind, Kind::Map(_)) => ScenarioFile::default(),
                None if entries.iter().any(|entry| entry.key == modifiers::ROOT) => {
                    let reason = "this is a scenario modifier, not a scenario";
                    let remedy = "give the scenario that it is applied to";
                    checker.refused(&value.location, reason, remedy).unwrap_or_default()
                }
                None => {
                    let reason = format!("the key {} is missing", open_scenario::ROOT);
                    let remedy = "write OpenSCENARIO in YAML, or our own form in TOML";
                    checker.refused(&value.location, reason, remedy).unwrap_or_default()
                }
            }
        }
    };
    if let Some(unknown) = options.modifiers.keys().find(|name| !reader.modifiers.has(name)) {
        let reason = format!("no scenario modifier is called {unknown:?}");
        checker.adopt(vec![Problem::whole_file(&text.file, reason, reader.modifiers.listed())]);
    }
    let ScenarioReader { mut not_interpreted, mut ids, names, .. } = reader;
    not_interpreted.sort_by_key(|part| part.location.position);
    ids.sort_by_key(|used| used.location.position);
    (file.not_interpreted, file.ids, file.light_names) = (not_interpreted, ids, names);
    checker.finish(Some(file)).map_err(Refused)
}

enum ScenarioForm {
    Xml,
    Yaml,
    Toml,
}

impl ScenarioForm {
    /// Returns the form by the extension, otherwise by the content (standard input has no extension).
    fn of(path: &Path, content: &str) -> Result<Self, Problem> {
        let extension = path.extension().and_then(|extension| extension.to_str());
        match extension.map(str::to_ascii_lowercase).as_deref() {
            Some("xosc" | "xml") => Ok(Self::Xml),
            Some("yaml" | "yml") => Ok(Self::Yaml),
            Some("toml") => Ok(Self::Toml),
            _ if content.trim_start().starts_with('<') => Ok(Self::Xml),
            _ if content.lines().any(|line| line.starts_with(open_scenario::ROOT)) => Ok(Self::Yaml),
            _ if FileKind::of(content.as_bytes()) == Some(FileKind::Scenario) => Ok(Self::Toml),
            Some(_) | None => {
                let reason = "unknown file extension of a scenario";
                Err(Problem::whole_file(path, reason, "name it .xosc, .yaml or .toml"))
            }
        }
    }
}
