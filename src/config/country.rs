//! Rules of a country from a file, one of those built into the binary or another.

use std::path::Path;

use serde::Deserialize;
use toml::Spanned;

use super::files::{Embedded, Files};
use super::reading::checker::Checker;
use super::reading::document::Document;
use super::reading::keyword::{Keyword, keywords};
use super::reading::problem::Problem;
use crate::core::turn_signal::country::Country;
use crate::core::turn_signal::signal::Side;

/// Countries that the binary knows, files of `config/countries`.
pub const BUILT_IN: [&str; 7] = ["JP", "DE", "KR", "AT", "CH", "GB", "US-CA"];

/// Why there are no rules.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NoCountry {
    /// Nothing has the name that was given.
    Nowhere {
        /// What is wrong.
        reason: String,
        /// What to do about it.
        remedy: String,
    },
    /// Its file is refused.
    Refused(Vec<Problem>),
}

/// The country with a code, or of the `.toml` file with this path, relative to `folder`.
///
/// # Errors
/// An unknown code, a file that cannot be read, or one that says what cannot be.
pub fn country(files: &dyn Files, folder: &Path, given: &str) -> Result<Country, NoCountry> {
    if Path::new(given).extension().is_some_and(|extension| extension == "toml") {
        return read(files, &folder.join(given));
    }
    if !BUILT_IN.contains(&given) {
        return Err(NoCountry::Nowhere {
            reason: format!("there are no rules for {given:?}"),
            remedy: format!(
                "give {}, the path of a file like config/countries/JP.toml, or leave it out",
                BUILT_IN.join(", ")
            ),
        });
    }
    read(&Embedded, Path::new(&format!("config/countries/{given}.toml")))
}

fn read(files: &dyn Files, path: &Path) -> Result<Country, NoCountry> {
    let one = |problem| NoCountry::Refused(vec![problem]);
    let bytes = files.read(path).map_err(|error| NoCountry::Nowhere {
        reason: format!("{}: cannot read it: {error}", path.display()),
        remedy: format!(
            "give the path of a country's rules, relative to this file, or {}",
            BUILT_IN.join(", ")
        ),
    })?;
    let document = Document::new(path, bytes).map_err(one)?;
    let file: CountryFile = document.parse().map_err(|problem| {
        one(Problem { remedy: "see config/countries/JP.toml for every key".to_owned(), ..problem })
    })?;
    interpret(&document, file)
}

fn interpret(document: &Document, file: CountryFile) -> Result<Country, NoCountry> {
    let mut checker = Checker::new(document);
    for text in [&file.code, &file.source] {
        if text.get_ref().trim().is_empty() || text.get_ref().chars().any(char::is_control) {
            checker.refuse(text, "this says nothing readable", "write it on one line");
        }
    }
    let turn_distance_m = file.turn_distance_m.as_ref();
    let turn_distance_m =
        checker.in_range(turn_distance_m, &(0.0..=1000.0), "{} m is out of range", "give 0 to 1000 m");
    let lane_change_time_s = file.lane_change_time_s.as_ref();
    let lane_change_time_s =
        checker.in_range(lane_change_time_s, &(0.0..=60.0), "{} s is out of range", "give 0 to 60 s");
    if !checker.problems.is_empty() {
        return Err(NoCountry::Refused(checker.problems));
    }
    Ok(Country {
        code: file.code.into_inner(),
        source: file.source.into_inner(),
        traffic: file.traffic.0,
        turn_distance_m,
        lane_change_time_s,
        roundabout_on_entry: file.roundabout.on_entry.0,
        roundabout_on_exit: file.roundabout.on_exit.0,
        roundabout_entry_persists: file.roundabout.entry_persists,
    })
}

/// A country's file, as it stands there.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CountryFile {
    code: Spanned<String>,
    source: Spanned<String>,
    traffic: Keyword<Side>,
    turn_distance_m: Option<Spanned<f64>>,
    lane_change_time_s: Option<Spanned<f64>>,
    roundabout: RoundaboutFile,
}

keywords!(Side { "left" => Side::Left, "right" => Side::Right });
keywords!(Option<Side> { "left" => Some(Side::Left), "right" => Some(Side::Right), "none" => None });

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RoundaboutFile {
    on_entry: Keyword<Option<Side>>,
    on_exit: Keyword<Option<Side>>,
    #[serde(default)]
    entry_persists: bool,
}
