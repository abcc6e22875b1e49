//! Dimensions of the car that a report needs and the configuration lacks, with the rows of the list of cars
//! that have them.

use super::kind::CheckKind;
use super::report::CheckReport;
use crate::config::Settings;
use crate::config::built_in::BuiltIn;
use crate::config::car_models::models;
use gateway_core::vehicle_status::StatusReport;
use gateway_core::vehicle_status::kinematics::{Estimate, RatioEstimate};
use gateway_core::vehicle_status::missing_dimensions::missing_dimensions;
use gateway_core::vehicle_status::settings::GeometryKey;
use vehicle_bringup::car_model::{CarModel, DimensionRange, ListedDimensions, ModelProfile};
use vehicle_bringup::plausibility::finding::Severity;

/// Maximum number of rows that are written out.
const MAX_ROWS: usize = 4;
/// Maximum factor between a listed and a measured value of the same car: lists are often wrong by 10 %.
const MAX_LIST_ERROR: f64 = 1.1;

/// Returns a note for each missing dimension, for a check without a recording.
pub fn missing(settings: &Settings) -> CheckReport {
    let mut report = CheckReport::default();
    for (_, _, text) in entries(settings) {
        report.find(Severity::Note, CheckKind::MissingDimension, text);
    }
    report
}

/// Returns the reports that were never published and lack a dimension.
pub(super) fn withheld(
    settings: &Settings,
    published: impl Iterator<Item = (StatusReport, bool)>,
) -> Vec<StatusReport> {
    let lacking: Vec<_> = entries(settings).into_iter().map(|(of, ..)| of).collect();
    let never = published.filter(|(_, was_published)| !was_published).map(|(of, _)| of);
    never.filter(|of| lacking.contains(of)).collect()
}

/// Reports each missing dimension: as a warning if its report was never published, and otherwise as a note.
/// `ratio` is the steering ratio that the recording shows.
pub(super) fn of_recording(
    settings: &Settings,
    published: &[(StatusReport, bool)],
    ratio: Option<RatioEstimate>,
    report: &mut CheckReport,
) {
    let withheld = withheld(settings, published.iter().copied());
    for (of, key, text) in entries(settings) {
        if withheld.contains(&of) {
            let text = format!("{text}, so that this report is never published");
            let remedy = remedy(settings, key, ratio);
            report.find_with(Severity::Warning, CheckKind::MissingDimension, text, remedy);
        } else {
            report.find(Severity::Note, CheckKind::MissingDimension, text);
        }
    }
}

/// Returns report, dimension and text for each source that cannot be used, each once.
fn entries(settings: &Settings) -> Vec<(StatusReport, GeometryKey, String)> {
    let geometry = &settings.gateway.status_settings.geometry;
    let mut entries: Vec<(StatusReport, GeometryKey, String)> = Vec::new();
    for (of, source, key) in missing_dimensions(&settings.gateway.status, geometry) {
        let text =
            format!("{}: {source} cannot be used without {} of [vehicle_geometry]", of.name(), key.key());
        if !entries.iter().any(|(.., known)| *known == text) {
            entries.push((of, key, text));
        }
    }
    entries
}

/// Returns what to write, with the rows of the list of cars for this profile.
fn remedy(settings: &Settings, key: GeometryKey, ratio: Option<RatioEstimate>) -> String {
    let general = CheckKind::MissingDimension.remedy();
    let is_listed = matches!(key, GeometryKey::WheelBase | GeometryKey::SteeringRatio);
    let models = models().ok().filter(|_| is_listed).unwrap_or_default();
    let rows = rows(settings, &models, ratio);
    if rows.is_empty() {
        return general.to_owned();
    }
    let named: Vec<_> = rows.iter().map(|(model, listed)| row_text(model, *listed)).collect();
    let range = DimensionRange::of(rows.iter().map(|(model, _)| *model)).filter(|_| rows.len() > MAX_ROWS);
    let Some(range) = range else {
        return format!(
            "{general}; the row of the car in config/cars/models.toml is {}",
            named.join(", or ")
        );
    };
    let (low, high) =
        if key == GeometryKey::WheelBase { range.wheel_base_m() } else { range.steering_ratio() };
    format!(
        "{general}; config/cars/models.toml has {} rows for this profile, with {} = {low} to {high}: `signal-gateway profiles \
         find MAKE MODEL YEAR` shows the row of the car",
        rows.len(),
        key.key()
    )
}

fn row_text(model: &CarModel, listed: ListedDimensions) -> String {
    let CarModel { make, model, years, .. } = model;
    let ListedDimensions { wheel_base_m, steering_ratio } = listed;
    let years: Vec<_> = years
        .iter()
        .map(|(first, last)| if first == last { first.to_string() } else { format!("{first}-{last}") })
        .collect();
    let years = years.join(", ");
    format!("{make} {model} {years} (wheel_base_m = {wheel_base_m}, steering_ratio = {steering_ratio})")
}

/// Returns the listed cars of this profile; if the recording shows the steering ratio, only those whose
/// dimensions agree with it.
fn rows<'a>(
    settings: &Settings,
    models: &'a [CarModel],
    ratio: Option<RatioEstimate>,
) -> Vec<(&'a CarModel, ListedDimensions)> {
    let Some(own) = settings.profile.as_ref().map(|profile| &*profile.file) else { return Vec::new() };
    let of_profile = models.iter().filter_map(|model| {
        let ModelProfile::Shipped { profile, .. } = &model.profile else { return None };
        let is_own = BuiltIn::Profile.path(profile).is_some_and(|path| path == own);
        is_own.then_some((model, model.unproven_dimensions?))
    });
    let rows: Vec<_> = of_profile.collect();
    let near = |value: f64, Estimate { low, high, .. }: Estimate| {
        (low / MAX_LIST_ERROR..=high * MAX_LIST_ERROR).contains(&value)
    };
    let agrees = |listed: &ListedDimensions| match ratio {
        Some(RatioEstimate::Ratio(ratio)) => near(listed.steering_ratio, ratio),
        Some(RatioEstimate::RatioByWheelBase(product)) => {
            near(listed.steering_ratio * listed.wheel_base_m, product)
        }
        Some(RatioEstimate::TireScale(_)) | None => true,
    };
    let agreeing: Vec<_> = rows.iter().copied().filter(|(_, listed)| agrees(listed)).collect();
    if agreeing.is_empty() { rows } else { agreeing }
}
