//! Parameters of the decider: the rules of a country, from a file that is built into the binary or from another one, and
//! parameters set one by one.

use std::path::Path;

use super::built_in::files_in;
use super::file_kind::FileKind;
use super::files::{Embedded, Files};
use super::reading::checker::{Checker, Keywords, LocatedText};
use super::reading::fields::Fields;
use super::reading::location::Text;
use super::reading::problem::{Problem, cannot_read};
use super::reading::toml_text::from_toml;
use crate::core::near_miss::did_you_mean;
use crate::core::turn_signal::country::Country;
use crate::core::turn_signal::parameters::{DeciderParameter, DeciderParameters, ParameterError};
use crate::core::turn_signal::side::Side;

/// An example of a file of rules, which shows every key.
const SEE: &str = "config/countries/JP.toml";

const SIDES: Keywords<Side> = &[("left", Side::Left), ("right", Side::Right)];
const SIDES_OR_NONE: Keywords<Option<Side>> =
    &[("left", Some(Side::Left)), ("right", Some(Side::Right)), ("none", None)];

/// The reason why a country has no rules.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NoCountry {
    /// The name is unknown, or its file cannot be read.
    Nowhere {
        /// The problem as text.
        reason: String,
        /// The remedy as text.
        remedy: String,
    },
    /// Its file is refused.
    Refused(Vec<Problem>),
}

/// Codes of the countries whose rules are built into the binary, the files of `config/countries`.
pub fn built_in() -> Vec<&'static str> {
    files_in("config/countries").filter_map(|path| path.file_stem()?.to_str()).collect()
}

/// The country with a code, or of the `.toml` file with this path, relative to `folder`.
///
/// # Errors
/// An unknown code, a file that cannot be read, or every problem of the file.
pub fn country(files: &dyn Files, folder: &Path, given: &str) -> Result<Country, NoCountry> {
    if Path::new(given).extension().is_some_and(|extension| extension == "toml") {
        return read(files, &folder.join(given));
    }
    let codes = built_in();
    if !codes.contains(&given) {
        return Err(NoCountry::Nowhere {
            reason: format!("there are no rules for {given:?}"),
            remedy: did_you_mean(
                given,
                codes.iter().copied(),
                format!("give {}, the path of a file like {SEE}, or leave it out", codes.join(", ")),
            ),
        });
    }
    read(&Embedded, Path::new(&format!("config/countries/{given}.toml")))
}

/// Reads the keys `country` and `parameters`, of which the latter set parameters one by one.
pub(super) fn parameters(files: &dyn Files, fields: &Fields<'_>) -> (Option<Country>, DeciderParameters) {
    let checker = fields.checker;
    let country = fields.string("country").and_then(|given| country_at(files, checker, &given));
    let mut parameters =
        country.as_ref().map_or(DeciderParameters::DEPLOYED, |country| country.parameters.clone());
    let mut taken: Vec<&str> = Vec::new();
    for entry in fields.entries("parameters", "give parameters by the names of Autoware") {
        let Some(LocatedText { text, location }) = checker.text(&entry.value) else { continue };
        match parameters.set(&entry.key, &text) {
            Ok(()) => {}
            Err(error @ ParameterError::Unknown { .. }) => {
                checker.refuse_and_explain(&entry.location, error.to_string());
            }
            Err(ParameterError::Value { expected, .. }) => {
                checker.refuse(&location, format!("invalid value {text}"), &format!("give {expected}"));
            }
        }
        let Some(known) = DeciderParameter::named(&entry.key).map(|parameter| parameter.name) else {
            continue;
        };
        if taken.contains(&known) {
            checker.refuse(&entry.location, format!("{known} is given twice"), "keep one of its names");
        }
        taken.push(known);
    }
    (country, parameters)
}

/// The country that a file names; problems are noted.
fn country_at(files: &dyn Files, checker: &Checker, given: &LocatedText) -> Option<Country> {
    match country(files, checker.folder(), &given.text) {
        Ok(country) => return Some(country),
        Err(NoCountry::Nowhere { reason, remedy }) => checker.refuse(&given.location, reason, &remedy),
        Err(NoCountry::Refused(problems)) => checker.adopt(problems),
    }
    None
}

fn read(files: &dyn Files, path: &Path) -> Result<Country, NoCountry> {
    let one = |problem| NoCountry::Refused(vec![problem]);
    let bytes = files.read(path).map_err(|error| NoCountry::Nowhere {
        reason: format!("{}: {}", path.display(), cannot_read(&error)),
        remedy: format!(
            "give the path of a country's rules, relative to this file, or {}",
            built_in().join(", ")
        ),
    })?;
    FileKind::Country.expect(path, &bytes).map_err(one)?;
    let text = Text::new(path, bytes).map_err(one)?;
    let root = from_toml(&text, SEE).map_err(one)?;
    let checker = Checker::new(&text.file, SEE);
    let country = Fields::of(&checker, &root).and_then(interpret);
    checker.finish(country).map_err(NoCountry::Refused)
}

fn interpret(fields: Fields<'_>) -> Option<Country> {
    fields.require(&["code", "source", "traffic", "roundabout"], "");
    let readable = |key| {
        let text = fields.string(key)?.text;
        if text.trim().is_empty() || text.chars().any(char::is_control) {
            fields.refuse(key, "expected a readable text", "write it on one line");
        }
        Some(text)
    };
    let (code, source) = (readable("code"), readable("source"));
    let traffic = fields.keyword("traffic", SIDES);
    let turn_distance_m = fields.number("turn_distance_m", 0.0..=1000.0, "m");
    let search_time_s = fields.number("search_time_s", 0.0..=60.0, "s");
    let roundabout = fields.table("roundabout");
    fields.done();
    let roundabout = roundabout?;
    roundabout.require(&["on_entry", "on_exit"], "");
    let [on_entry, on_exit] = ["on_entry", "on_exit"].map(|key| roundabout.keyword(key, SIDES_OR_NONE));
    let entry_persists = roundabout.flag("entry_persists");
    roundabout.done();
    let (traffic, deployed) = (traffic?, DeciderParameters::DEPLOYED);
    // Where the law gives no number, the deployed one stays.
    let parameters = DeciderParameters {
        intersection_search_distance_m: turn_distance_m.unwrap_or(deployed.intersection_search_distance_m),
        roundabout_search_distance_m: turn_distance_m.unwrap_or(deployed.roundabout_search_distance_m),
        search_time_s: search_time_s.unwrap_or(deployed.search_time_s),
        roundabout_on_entry: on_entry?,
        roundabout_on_exit: on_exit?,
        roundabout_entry_persists: entry_persists.unwrap_or_default(),
        parking_side: traffic,
        centerline_start_side: traffic.opposite(),
        ..deployed
    };
    Some(Country { code: code?, source: source?, turn_distance_m, parameters })
}
