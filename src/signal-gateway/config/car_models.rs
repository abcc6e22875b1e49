//! The list of cars by make, model and year, `config/cars/models.toml` in the binary.

use std::path::Path;

use serde::Deserialize;

use super::built_in;
use vehicle_bringup::car_model::{CarModel, ListedDimensions, ModelProfile};

const PATH: &str = "config/cars/models.toml";

/// The tables of the file; comments in the file explain the rows.
#[derive(Debug, Deserialize)]
struct ModelFile {
    opendbc: OpendbcModels,
    profiles: ProfileModels,
}

#[derive(Debug, Deserialize)]
struct OpendbcModels {
    models: Vec<[String; 7]>,
    without_profile: Vec<[String; 4]>,
    notes: Vec<[String; 3]>,
}

#[derive(Debug, Deserialize)]
struct ProfileModels {
    models: Vec<[String; 5]>,
}

/// Returns all models by make and name, including the models of the profiles.
///
/// # Errors
///
/// Fails only if the file in the binary is invalid.
pub fn models() -> Result<Vec<CarModel>, String> {
    let text = String::from_utf8_lossy(built_in::contents(Path::new(PATH)).unwrap_or_default());
    let file: ModelFile = toml::from_str(&text).map_err(|refused| format!("{PATH}: {refused}"))?;
    let OpendbcModels { models, without_profile, notes } = file.opendbc;
    let shipped = |profile, plug: String| {
        let plug = Some(plug).filter(|plug| !plug.is_empty());
        ModelProfile::Shipped { profile, plug }
    };
    let model = |[make, model, written]: [String; 3], profile, unproven_dimensions| {
        let years = years(&written).ok_or_else(|| {
            format!("{PATH}: {make} {model}: expected years such as 2016-2018, 2020, found {written}")
        })?;
        let note = notes.iter().find(|[of_make, of_model, _]| *of_make == make && *of_model == model);
        let note = note.map(|[.., note]| note.clone());
        Ok::<_, String>(CarModel { make, model, years, profile, note, unproven_dimensions })
    };
    let mut all = Vec::new();
    for [make, name, years, profile, plug, wheel_base_m, steering_ratio] in models {
        let listed = wheel_base_m.parse().ok().zip(steering_ratio.parse().ok());
        let listed =
            listed.map(|(wheel_base_m, steering_ratio)| ListedDimensions { wheel_base_m, steering_ratio });
        all.push(model([make, name, years], shipped(profile, plug), listed)?);
    }
    for [make, name, years, profile, plug] in file.profiles.models {
        all.push(model([make, name, years], shipped(profile, plug), None)?);
    }
    for [make, name, years, reason] in without_profile {
        all.push(model([make, name, years], ModelProfile::Missing { reason }, None)?);
    }
    all.sort_by(|one, other| {
        (&one.make, &one.model, &one.years).cmp(&(&other.make, &other.model, &other.years))
    });
    Ok(all)
}

/// Parses spans of years; returns `None` if one of them is invalid.
fn years(text: &str) -> Option<Vec<(u16, u16)>> {
    let spans = text.split(',').map(str::trim).filter(|span| !span.is_empty());
    spans
        .map(|span| {
            let (first, last) = span.split_once('-').unwrap_or((span, span));
            let span = (first.parse().ok()?, last.parse().ok()?);
            (span.0 <= span.1).then_some(span)
        })
        .collect()
}
