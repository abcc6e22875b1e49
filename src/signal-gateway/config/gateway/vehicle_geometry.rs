//! `[vehicle_geometry]`: the dimensions of the car, for both the decider and the reports on velocity and
//! steering. Autoware's own file contains most of them.

use std::path::{Path, PathBuf};

use crate::config::built_in::{BuiltIn, display};
use crate::config::car_models::models;
use crate::config::files::Files;
use crate::config::reading::{
    ConfigKey, Fields, KeyRow, ValueShape, collection, key_rows, number, path, text,
};
use crate::config::ros_names::NodeNames;
use crate::config::ros_parameters::{FileParameter, read_parameters};
use gateway_core::vehicle_status::settings::{RatioOrigin, VehicleGeometry, WheelToTire};
use turn_signal::parameters::VehicleInfo;
use vehicle_bringup::car_model::{CarModel, ListedDimensions, ModelProfile, ModelVerdict, find};

key_rows! {
    FILE: PathBuf = path("file").example("\"vehicle_info.param.yaml\"").doc("Autoware's file; the keys below replace its values");
    CAR: String = text("car").example("\"Toyota RAV4 2018\"")
        .doc("make, model and year: wheel base and steering ratio as opendbc lists them for this car, where file and keys give none; steering is then a WARN, since no one has measured them on this car");
    WHEEL_BASE_M: f64 = metres("wheel_base_m").example("2.79").doc("from axle to axle");
    WHEEL_TREAD_M: f64 = metres("wheel_tread_m").example("1.63").doc("from rear wheel to rear wheel");
    WHEEL_RADIUS_M: f64 = metres("wheel_radius_m").example("0.33").doc("effective rolling radius, for wheels in rad/s or rpm");
    FRONT_OVERHANG_M: f64 = metres("front_overhang_m").example("1.0").doc("front axle to the front end");
    REAR_OVERHANG_M: f64 = metres("rear_overhang_m").example("1.1").doc("rear axle to the rear end");
    LEFT_M: f64 = metres("left_m").example("0.948").doc("centre line to the left side");
    RIGHT_M: f64 = metres("right_m").example("0.948").doc("centre line to the right side");
    MAX_STEER_ANGLE_RAD: f64 = number("max_steer_angle_rad", 0.05, 1.5, "rad").or_number(MAX_STEER_ANGLE_RAD_DEFAULT)
        .doc("greatest angle of the front wheels; {range}");
    STEERING_RATIO: f64 = number("steering_ratio", 5.0, 60.0, "").example("16.9")
        .doc("angle of the steering wheel for each angle of the front wheels; without it, steering_table, vgr_coef_a or car: no steering report");
    MEASURED: String = text("measured").example("\"12 turns, 15.9 to 17.0\"")
        .doc("how the ratio was measured on this car, as `check LOG` prints it; for diagnostics, `ratio_source` is then `measured`");
    STEERING_TABLE: Vec<(f64, f64)> = collection("steering_table", || ValueShape::Tables(table_keys()), table)
        .example("[{ wheel_deg = -500.0, tire_deg = -33.0 }, { wheel_deg = 500.0, tire_deg = 33.0 }]").doc("the same as a table, ascending");
    VGR_COEF_A: f64 = number("vgr_coef_a", 1.0, 60.0, "").example("15.713").doc("the same as Autoware's raw_vehicle_cmd_converter has it: a + b v² - c |wheel|");
    VGR_COEF_B: f64 = number("vgr_coef_b", -1.0, 1.0, "s²/m²").or_number(0.0).doc("its b");
    VGR_COEF_C: f64 = number("vgr_coef_c", -10.0, 10.0, "1/rad").or_number(0.0).doc("its c");
    STEERING_OFFSET_DEG: f64 = number("steering_offset_deg", -10.0, 10.0, "deg").or_number(0.0)
        .doc("angle of the front wheels that is measured straight ahead");
    SPEED_SCALE: f64 = number("speed_scale", 0.5, 2.0, "").or_number(1.0)
        .doc("factor for each speed; Autoware's speed_scale_factor does the same, so use one of them");
}

/// Maximum number of cars that a refusal lists.
const MAX_CANDIDATES: usize = 6;

/// Value of Autoware's sample vehicle.
const MAX_STEER_ANGLE_RAD_DEFAULT: f64 = 0.70;

static WHEEL_DEG: ConfigKey<f64> =
    number("wheel_deg", -2000.0, 2000.0, "deg").doc("angle of the steering wheel, left positive");
static TIRE_DEG: ConfigKey<f64> =
    number("tire_deg", -80.0, 80.0, "deg").doc("angle of the front wheels, left positive");

fn table_keys() -> Vec<&'static dyn KeyRow> {
    vec![&WHEEL_DEG, &TIRE_DEG]
}

const fn metres(name: &'static str) -> ConfigKey<f64> {
    number(name, 0.0, 50.0, "m")
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Dimensions {
    /// Dimensions for the decider; Autoware's sample vehicle unless configured.
    pub(super) outline: VehicleInfo,
    /// Dimensions for the reports, which have no defaults.
    pub(super) geometry: VehicleGeometry,
}

/// Reads the section. `profile` is the file of the vehicle profile, which the car must fit.
pub(super) fn vehicle_geometry(files: &dyn Files, fields: &Fields<'_>, profile: Option<&Path>) -> Dimensions {
    let listed = fields.given(&CAR).and_then(|car| listed_car(fields, &car, profile));
    let of_file = fields.given(&FILE).and_then(|path| VehicleInfoFile::read(files, fields, path));
    let from_file = |name| of_file.as_ref().and_then(|file| file.value(fields, name));
    let [base, tread, radius] =
        [(&WHEEL_BASE_M, "wheel_base"), (&WHEEL_TREAD_M, "wheel_tread"), (&WHEEL_RADIUS_M, "wheel_radius")]
            .map(|(row, name)| fields.given(row).or_else(|| from_file(name)));
    let base = base.or(listed.as_ref().map(|(_, dimensions)| dimensions.wheel_base_m));
    let [front, rear] = [(&FRONT_OVERHANG_M, "front_overhang"), (&REAR_OVERHANG_M, "rear_overhang")]
        .map(|(row, name)| fields.given(row).or_else(|| from_file(name)));
    // Autoware measures the sides from the wheels.
    let side = |name| Some(tread? / 2.0 + from_file(name)?);
    let [left, right] = [(&LEFT_M, "left_overhang"), (&RIGHT_M, "right_overhang")]
        .map(|(row, name)| fields.given(row).or_else(|| side(name)));
    let max_tire = fields.read(&MAX_STEER_ANGLE_RAD);
    let max_tire =
        from_file("max_steer_angle").filter(|_| !fields.has(MAX_STEER_ANGLE_RAD.name)).unwrap_or(max_tire);
    let is_measured = fields.given(&MEASURED).is_some();
    let (wheel_to_tire, ratio_origin) = match (wheel_to_tire(fields), listed) {
        (Some(given), _) if is_measured => (Some(given), RatioOrigin::Measured),
        (None, Some((car, dimensions))) => {
            (Some(WheelToTire::Ratio(dimensions.steering_ratio)), RatioOrigin::Listed { car })
        }
        (given, _) => (given, RatioOrigin::Configured),
    };
    let sample = VehicleInfo::SAMPLE;
    Dimensions {
        outline: VehicleInfo {
            wheel_base_m: base.unwrap_or(sample.wheel_base_m),
            front_overhang_m: front.unwrap_or(sample.front_overhang_m),
            rear_overhang_m: rear.unwrap_or(sample.rear_overhang_m),
            left_m: left.unwrap_or(sample.left_m),
            right_m: right.unwrap_or(sample.right_m),
        },
        geometry: VehicleGeometry {
            is_configured: fields.keys().next().is_some(),
            wheel_base_m: base.filter(|base| *base > 0.0),
            wheel_tread_m: tread.filter(|tread| *tread > 0.0),
            wheel_radius_m: radius.filter(|radius| *radius > 0.0),
            speed_scale: fields.read(&SPEED_SCALE),
            wheel_to_tire,
            ratio_origin,
            steering_offset_rad: fields.read(&STEERING_OFFSET_DEG).to_radians(),
            max_tire_rad: max_tire,
        },
    }
}

/// Returns the only car of opendbc's list with this name, and its dimensions; anything else is refused.
fn listed_car(fields: &Fields<'_>, name: &str, profile: Option<&Path>) -> Option<(String, ListedDimensions)> {
    let models = models().map_err(|refused| fields.refuse(CAR.name, refused, "report this")).ok()?;
    let candidates = |models: &[&CarModel]| {
        let names: Vec<_> = models.iter().take(MAX_CANDIDATES).map(|model| model.name()).collect();
        let more = if models.len() > MAX_CANDIDATES { " …" } else { "" };
        format!("{}{more}", names.join(", "))
    };
    let named: Vec<_> = models.iter().filter(|model| model.is_named_by(name)).collect();
    let [first, others @ ..] = named.as_slice() else {
        let search = find(&models, name);
        let near = if search.verdict == ModelVerdict::Unknown { Vec::new() } else { search.models };
        let reason = format!("opendbc's list has no car {name:?}");
        let remedy = if near.is_empty() {
            "give make, model and year as `signal-gateway profiles find` shows them".to_owned()
        } else {
            format!("give one of {}", candidates(&near))
        };
        return fields.refused(CAR.name, reason, &remedy);
    };
    let Some(dimensions) = first.unproven_dimensions else {
        let reason = format!("opendbc lists no dimensions for {}", first.name());
        return fields.refused(
            CAR.name,
            reason,
            "remove the key, and measure wheel_base_m and steering_ratio",
        );
    };
    if others.iter().any(|other| other.unproven_dimensions != Some(dimensions)) {
        let reason = format!("{name:?} is more than one car of opendbc's list, with different dimensions");
        return fields.refused(CAR.name, reason, &format!("give one of {}", candidates(&named)));
    }
    let configured = profile.and_then(|path| BuiltIn::Profile.name_at(path));
    let fits = |model: &&CarModel| matches!(&model.profile, ModelProfile::Shipped { profile, .. } if Some(profile.as_str()) == configured);
    if let (Some(configured), None) = (configured, named.iter().find(|model| fits(model))) {
        let of_car = named.iter().find_map(|model| model.profile.shipped()).unwrap_or("another");
        let reason = format!("the profile of {} is {of_car}, not {configured}", first.name());
        return fields.refused(CAR.name, reason, "name the car that this profile is for");
    }
    Some((first.name(), dimensions))
}

/// Reads how the front wheels follow the steering wheel, in one of three forms.
fn wheel_to_tire(fields: &Fields<'_>) -> Option<WheelToTire> {
    let forms = [STEERING_RATIO.name, STEERING_TABLE.name, VGR_COEF_A.name];
    let is_given = forms.iter().any(|form| fields.has(form));
    let form = is_given.then(|| fields.only_one_of(&forms, "the steering ratio is given twice")).flatten();
    let (ratio, table) = (fields.given(&STEERING_RATIO), fields.read(&STEERING_TABLE));
    let constant = fields.given(&VGR_COEF_A);
    let (per_speed_squared, per_angle) = (fields.read(&VGR_COEF_B), fields.read(&VGR_COEF_C));
    for key in [VGR_COEF_B.name, VGR_COEF_C.name].into_iter().filter(|key| fields.has(key)) {
        if form != Some(VGR_COEF_A.name) {
            fields.refuse(key, format!("`{key}` needs vgr_coef_a"), "give all three coefficients");
        }
    }
    if !is_given && fields.has(MEASURED.name) {
        let remedy = "give the measured steering_ratio as well, or remove this key";
        fields.refuse(MEASURED.name, "`measured` needs a steering ratio", remedy);
    }
    if form == Some(STEERING_TABLE.name) {
        let ascends = table.windows(2).all(|pair| pair[0].0 < pair[1].0);
        if table.len() < 2 || !ascends {
            let remedy = "give at least two pairs, by ascending wheel_deg";
            return fields.refused(STEERING_TABLE.name, "the pairs of the table do not ascend", remedy);
        }
        return Some(WheelToTire::Table(table));
    }
    let variable = |constant| WheelToTire::Variable { constant, per_speed_squared, per_angle };
    ratio.map(WheelToTire::Ratio).or(constant.map(variable))
}

fn table(fields: &Fields<'_>, key: &'static str) -> Vec<(f64, f64)> {
    fields.read_tables(key, |fields| {
        fields.require(&[WHEEL_DEG.name, TIRE_DEG.name], "");
        let (wheel, tire) = (fields.given(&WHEEL_DEG), fields.given(&TIRE_DEG));
        Some((wheel?.to_radians(), tire?.to_radians()))
    })
}

/// Autoware's `vehicle_info.param.yaml`.
struct VehicleInfoFile {
    path: PathBuf,
    parameters: Vec<FileParameter>,
}

impl VehicleInfoFile {
    /// Reads the file; `None` if it was refused.
    fn read(files: &dyn Files, fields: &Fields<'_>, path: PathBuf) -> Option<Self> {
        // Autoware passes the file to every node.
        let names = NodeNames { namespace: "/", node: "vehicle_info", remappings: &[] };
        let parameters = read_parameters(files, &path, names);
        let parameters = parameters.map_err(|refused| fields.checker.adopt(refused.0)).ok()?;
        Some(Self { path, parameters })
    }

    fn value(&self, fields: &Fields<'_>, name: &str) -> Option<f64> {
        let given = self.parameters.iter().rev().find(|parameter| parameter.name == name);
        let number = given.and_then(|parameter| parameter.value.as_ref()?.text.parse::<f64>().ok());
        let number = number.filter(|number| (0.0..=50.0).contains(number));
        if number.is_none() {
            let reason = format!("{}: expected a number of 0 to 50 for {name}", display(&self.path));
            fields.refuse(FILE.name, reason, "name Autoware's vehicle_info.param.yaml");
        }
        number
    }
}
