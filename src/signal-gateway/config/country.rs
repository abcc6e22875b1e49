//! Parameters of the decider: the rules of a country, from a built-in file or another file, and individually
//! set parameters.

use std::path::Path;

use super::built_in::files_in;
use super::file_kind::FileKind;
use super::files::{Embedded, Files};
use super::reading::{
    Checker, Fields, KeyRow, Keywords, LocatedText, Problem, Refusal, Text, ValueShape, cannot_read,
    from_toml, key_rows, text,
};
use gateway_base::near_miss::did_you_mean;
use turn_signal::country::{Country, ROUNDABOUT, RULES, RuleValue};
use turn_signal::parameters::DeciderParameters;
use turn_signal::parameters::table::{DeciderParameter, PARAMETERS, ParameterError, ParameterValues};
use turn_signal::side::Side;

/// An example of a file of rules, which shows every key.
const SEE: &str = "config/countries/JP.toml";

const SIDES: Keywords<Side> = &[("left", Side::Left), ("right", Side::Right)];
const SIDES_OR_NONE: Keywords<Option<Side>> =
    &[("left", Some(Side::Left)), ("right", Some(Side::Right)), ("none", None)];

/// Reason why a country has no rules.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NoCountry {
    /// The name is unknown, or its file cannot be read.
    Nowhere(Refusal),
    /// The country's file is refused.
    Refused(Vec<Problem>),
}

/// Returns the codes of the countries whose rules are built into the binary, from `config/countries`.
pub fn built_in() -> Vec<&'static str> {
    files_in("config/countries").filter_map(|path| path.file_stem()?.to_str()).collect()
}

/// Reads the country with a code, or the `.toml` file with this path, relative to `folder`.
///
/// # Errors
/// Fails for an unknown code or a file that cannot be read, or with every problem of the file.
pub fn country(files: &dyn Files, folder: &Path, given: &str) -> Result<Country, NoCountry> {
    if Path::new(given).extension().is_some_and(|extension| extension == "toml") {
        return read(files, &folder.join(given));
    }
    let codes = built_in();
    if !codes.contains(&given) {
        let all = format!("give {}, the path of a file like {SEE}, or leave it out", codes.join(", "));
        let remedy = did_you_mean(given, codes.iter().copied(), all);
        return Err(NoCountry::Nowhere(Refusal::new(format!("there are no rules for {given:?}"), remedy)));
    }
    read(&Embedded, Path::new(&format!("config/countries/{given}.toml")))
}

/// Reads the keys `country` and `parameters`; the latter sets individual parameters.
pub(super) fn parameters(files: &dyn Files, fields: &Fields<'_>) -> (Option<Country>, DeciderParameters) {
    let checker = fields.checker;
    let named = fields.given(&COUNTRY);
    let named = named.map(|text| LocatedText { text, location: fields.at(COUNTRY.name).clone() });
    let country = named.and_then(|given| country_at(files, checker, &given));
    let mut parameters = country.as_ref().map_or(DeciderParameters::DEPLOYED, Country::parameters);
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
    for row in PARAMETERS {
        let value = match row.values() {
            ParameterValues::Numbers(.., unit) => format!("{} {unit}", row.value(&parameters)),
            ParameterValues::WholeNumbers | ParameterValues::Flags | ParameterValues::Texts(_) => {
                row.value(&parameters)
            }
        };
        checker.record(&format!("{}.parameters", fields.table_path()), row, value);
    }
    (country, parameters)
}

key_rows! {
    COUNTRY: String = text("country").example("\"JP\"")
        .doc("AT, CH, DE, GB, JP, KR, US-CA, or a file like config/countries/JP.toml; default: none, the parameters that Autoware is deployed with");
}

/// Returns the rows of the section `[turn_signal.parameters]`.
pub(super) fn parameter_keys() -> Vec<&'static dyn KeyRow> {
    PARAMETERS.iter().map(|row| -> &'static dyn KeyRow { row }).collect()
}

impl KeyRow for DeciderParameter {
    fn name(&self) -> &'static str {
        self.name
    }

    fn shape(&self) -> ValueShape {
        match self.values() {
            ParameterValues::Numbers(min, max, unit) => ValueShape::Number(min, max, unit),
            ParameterValues::WholeNumbers => ValueShape::Whole(i64::MIN, u32::MAX.into(), ""),
            ParameterValues::Flags => ValueShape::Flag,
            ParameterValues::Texts(words) => ValueShape::Keyword(words),
        }
    }

    fn default_toml(&self) -> Option<String> {
        let value = self.value(&DeciderParameters::DEPLOYED);
        Some(match self.values() {
            ParameterValues::Numbers(..) if !value.contains('.') => format!("{value}.0"),
            ParameterValues::Texts(_) => format!("{value:?}"),
            ParameterValues::Numbers(..) | ParameterValues::WholeNumbers | ParameterValues::Flags => value,
        })
    }

    fn doc(&self) -> &'static str {
        match self.values() {
            ParameterValues::WholeNumbers => "lanelets; negative: no limit",
            ParameterValues::Numbers(..) | ParameterValues::Flags | ParameterValues::Texts(_) => "{range}",
        }
    }
}

/// Reads the country named in a file, and records problems.
fn country_at(files: &dyn Files, checker: &Checker, given: &LocatedText) -> Option<Country> {
    match country(files, checker.folder(), &given.text) {
        Ok(country) => return Some(country),
        Err(NoCountry::Nowhere(Refusal { reason, remedy })) => {
            checker.refuse(&given.location, reason, &remedy);
        }
        Err(NoCountry::Refused(problems)) => checker.adopt(problems),
    }
    None
}

fn read(files: &dyn Files, path: &Path) -> Result<Country, NoCountry> {
    let one = |problem| NoCountry::Refused(vec![problem]);
    let bytes = files.read(path).map_err(|error| {
        let known = built_in().join(", ");
        let remedy = format!("give the path of a country's rules, relative to this file, or {known}");
        let reason = format!("{}: {}", path.display(), cannot_read(&error));
        NoCountry::Nowhere(Refusal { reason, remedy })
    })?;
    FileKind::Country.expect(path, &bytes).map_err(one)?;
    let text = Text::new(path, bytes).map_err(one)?;
    let root = from_toml(&text, SEE).map_err(one)?;
    let checker = Checker::new(&text.file, SEE);
    let country = Fields::of(&checker, &root).and_then(interpret);
    checker.finish(country).map_err(NoCountry::Refused)
}

fn interpret(fields: Fields<'_>) -> Option<Country> {
    fields.require(&[&["code", "source"], &*required_of(""), &[ROUNDABOUT]].concat(), "");
    let readable = |key| {
        let text = fields.string(key)?.text;
        if text.trim().is_empty() || text.chars().any(char::is_control) {
            fields.refuse(key, "expected a readable text", "write it on one line");
        }
        Some(text)
    };
    let [code, source] = ["code", "source"].map(|key| readable(key).unwrap_or_default());
    let mut country = Country::new(code, source);
    read_rules(&fields, "", &mut country);
    let roundabout = fields.read_table(ROUNDABOUT, |fields| {
        fields.require(&required_of(ROUNDABOUT), "");
        read_rules(fields, ROUNDABOUT, &mut country);
        Some(())
    });
    fields.done();
    roundabout.map(|()| country)
}

fn required_of(table: &str) -> Vec<&'static str> {
    let required = RULES.iter().filter(|rule| rule.table == table && rule.is_required());
    required.map(|rule| rule.name).collect()
}

/// Reads the rules of a table. A missing or refused rule keeps its value.
fn read_rules(fields: &Fields<'_>, table: &str, country: &mut Country) {
    for rule in RULES.iter().filter(|rule| rule.table == table) {
        match rule.value {
            RuleValue::Number { unit, max, field } => {
                *field(country) = fields.number(rule.name, 0.0..=max, unit);
            }
            RuleValue::Side(field) => {
                let given = fields.keyword(rule.name, SIDES);
                let side = field(country);
                *side = given.unwrap_or(*side);
            }
            RuleValue::SideOrNone(field) => {
                *field(country) = fields.keyword(rule.name, SIDES_OR_NONE).flatten();
            }
            RuleValue::Flag(field) => *field(country) = fields.flag(rule.name).unwrap_or_default(),
        }
    }
}
