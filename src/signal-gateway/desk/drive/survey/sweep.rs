//! Repeats a survey with several values of a parameter, or with each country.

use std::path::Path;
use std::str::FromStr;
use std::sync::Arc;

use thiserror::Error;

use crate::config::country::{self, country};
use crate::config::files::Embedded;
use gateway_base::near_miss::did_you_mean;
use turn_signal::decider::DeciderSettings;
use turn_signal::parameters::DeciderParameters;
use turn_signal::parameters::table::{DeciderParameter, PARAMETERS, ParameterError};

/// Number of values in a range without a step.
const VALUES: u32 = 5;
/// Maximum number of values in a sweep, each of which is a whole survey.
const MAX_VALUES: usize = 100;
/// Values are rounded to multiples of the inverse, since sums of steps are not exact.
const ROUNDING: f64 = 1e6;

/// Setting that changes from one survey to the next.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Sweep {
    /// A parameter, by its documented name, and its values.
    Parameter(&'static str, Vec<f64>),
    /// The rules of each shipped country.
    Countries,
}

/// Reason why a sweep is invalid, with remedy.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub(crate) enum SweepError {
    /// The text is neither `country` nor a parameter with its range.
    #[error("expected KEY=FROM..TO, KEY=FROM..TO:STEP or country; give e.g. turn_signal_search_time=1..5")]
    Form,
    #[error("{0:?} is not a parameter of the turn signal decider; {1}")]
    UnknownKey(String, String),
    #[error("{0} takes no numbers; give a parameter with numbers, or set it with --config")]
    NoNumbers(&'static str),
    /// An end or the step is not a number, the end lies before the start, or the step leads nowhere.
    #[error(
        "{0} is not a range that ascends; give FROM..TO or FROM..TO:STEP with FROM below TO and STEP above 0"
    )]
    Range(String),
    #[error("{0} has more than {MAX_VALUES} values; give a longer step")]
    TooMany(String),
    #[error("{name} cannot be {value}; give {expected}")]
    Value { name: &'static str, value: String, expected: &'static str },
}

impl FromStr for Sweep {
    type Err = SweepError;

    fn from_str(text: &str) -> Result<Self, SweepError> {
        if text == "country" {
            return Ok(Self::Countries);
        }
        let (key, range) = text.split_once('=').ok_or(SweepError::Form)?;
        let Some(parameter) = DeciderParameter::named(key) else {
            let names = PARAMETERS.iter().filter(|row| row.takes_numbers()).map(|row| row.name);
            let otherwise = "give one of docs/spec/turn-signal-decider.md#parameters".to_owned();
            return Err(SweepError::UnknownKey(key.to_owned(), did_you_mean(key, names, otherwise)));
        };
        if !parameter.takes_numbers() {
            return Err(SweepError::NoNumbers(parameter.name));
        }
        let values = values(range)?;
        for value in &values {
            let set = DeciderParameters::DEPLOYED.clone().set(parameter.name, &value.to_string());
            if let Err(ParameterError::Value { name, value, expected }) = set {
                return Err(SweepError::Value { name, value, expected });
            }
        }
        Ok(Self::Parameter(parameter.name, values))
    }
}

/// Parses a range: `1..5` as five equally spaced values, or `1..5:0.5`.
fn values(range: &str) -> Result<Vec<f64>, SweepError> {
    let bad = || SweepError::Range(range.to_owned());
    let number = |text: &str| text.parse::<f64>().ok().filter(|number| number.is_finite()).ok_or_else(bad);
    let (ends, step) = range.split_once(':').map_or((range, None), |(ends, step)| (ends, Some(step)));
    let (from, to) = ends.split_once("..").ok_or_else(bad)?;
    let (from, to) = (number(from)?, number(to)?);
    let step = step.map_or(Ok((to - from) / f64::from(VALUES - 1)), number)?;
    if from >= to || step <= 0.0 {
        return Err(bad());
    }
    let steps = (0..=u32::try_from(MAX_VALUES).unwrap_or(u32::MAX)).map(f64::from);
    let values = steps.map(|index| ((from + step * index) * ROUNDING).round() / ROUNDING);
    let values: Vec<f64> = values.take_while(|value| *value <= to).collect();
    if values.len() > MAX_VALUES { Err(SweepError::TooMany(range.to_owned())) } else { Ok(values) }
}

impl Sweep {
    /// Returns the name of the changed parameter, or `country`.
    pub(crate) fn key(&self) -> &'static str {
        match self {
            Self::Parameter(name, _) => name,
            Self::Countries => "country",
        }
    }

    /// Returns each value as text, with `given` changed to it. The rules of a country replace all parameters.
    pub(crate) fn variants(&self, given: &DeciderSettings) -> Vec<(String, DeciderSettings)> {
        match self {
            Self::Parameter(name, values) => {
                let variant = |value: &f64| {
                    let (mut settings, value) = (given.clone(), value.to_string());
                    // Parsing has ensured that the value fits.
                    settings.parameters.set(name, &value).ok()?;
                    Some((value, settings))
                };
                values.iter().filter_map(variant).collect()
            }
            Self::Countries => {
                let variant = |code: &'static str| {
                    let rules = country(&Embedded, Path::new(""), code).ok()?;
                    let parameters = rules.parameters();
                    let country = Some(Arc::new(rules));
                    Some((code.to_owned(), DeciderSettings { parameters, country, ..given.clone() }))
                };
                country::built_in().into_iter().filter_map(variant).collect()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use turn_signal::compat::DeciderCompat;

    #[test]
    fn ranges_have_their_values() {
        let values = |text: &str| match format!("turn_signal_search_time={text}").parse() {
            Ok(Sweep::Parameter("turn_signal_search_time", values)) => values,
            other => panic!("{text}: {other:?}"),
        };
        assert_eq!(values("1..5"), [1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(values("0..0.3:0.1"), [0.0, 0.1, 0.2, 0.3], "without the errors of sums");
        assert_eq!(values("1..2:0.6"), [1.0, 1.6]);
        assert_eq!(values("0..9.9:0.1").len(), 100);
    }

    #[test]
    fn what_is_no_sweep_is_refused_with_a_remedy() {
        let refused = |text: &str| text.parse::<Sweep>().unwrap_err().to_string();
        for (text, reason) in [
            ("turn_signal_search_time", "expected KEY=FROM..TO"),
            ("turn_signal_serch_time=1..2", "did you mean"),
            ("x=1..2", "\"x\" is not a parameter"),
            ("turn_signal_on_swerving=1..2", "takes no numbers"),
            ("turn_signal_search_time=1", "is not a range"),
            ("turn_signal_search_time=a..2", "is not a range"),
            ("turn_signal_search_time=2..1", "is not a range"),
            ("turn_signal_search_time=1..2:0", "is not a range"),
            ("turn_signal_search_time=1..inf", "is not a range"),
            ("turn_signal_search_time=0..10:0.1", "more than 100 values"),
            ("turn_signal_search_time=-4..4", "cannot be -4; give seconds, 0 to 3600"),
            ("turn_signal_roundabout_backward_depth=0..9", "cannot be 2.25; give a whole number"),
        ] {
            assert!(refused(text).contains(reason), "{text}: {}", refused(text));
        }
    }

    #[test]
    fn each_shipped_country_is_a_variant() {
        let deployed = DeciderSettings::deployed(DeciderCompat::Improved);
        let variants = Sweep::Countries.variants(&deployed);
        let codes: Vec<&str> = variants.iter().map(|(code, _)| code.as_str()).collect();
        assert_eq!(codes, country::built_in());
        assert!(variants.iter().any(|(_, settings)| settings.parameters != deployed.parameters));
        let law = |code| variants.iter().find(|(of, _)| of == code).unwrap().1.country.clone().unwrap();
        assert_eq!((law("JP").turn_distance_m, law("DE").turn_distance_m), (Some(30.0), None));
    }
}
