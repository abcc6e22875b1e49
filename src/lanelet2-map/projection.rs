//! Projects latitude and longitude on WGS 84 to metres.
//!
//! Transverse Mercator uses Krüger's series to the fourth power of the third flattening: the error within a
//! zone is less than a micrometre. Crates with this projection bring all other projections along.

/// Semi-major axis of WGS 84, metres.
const A_M: f64 = 6_378_137.0;
const F: f64 = 1.0 / 298.257_223_563;
/// Scale on the central meridian of a UTM zone.
pub(super) const UTM_SCALE: f64 = 0.9996;
/// Easting of the central meridian, metres.
const UTM_EASTING_M: f64 = 500_000.0;
/// Side of a square of the military grid, metres.
const SQUARE_M: f64 = 1e5;
/// Maximum distance from its meridian at which the projection is used, degrees.
const MAX_WIDTH_DEG: f64 = 45.0;

/// A position on the WGS 84 ellipsoid.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Geo {
    /// Latitude, degrees, -90 to 90.
    pub latitude_deg: f64,
    /// Longitude, degrees, -180 to 180.
    pub longitude_deg: f64,
    /// Altitude above the ellipsoid, metres.
    pub altitude_m: f64,
}

impl Geo {
    /// Returns whether the angles are in range and the altitude is a number.
    pub fn is_on_earth(&self) -> bool {
        self.latitude_deg.abs() <= 90.0 && self.longitude_deg.abs() <= 360.0 && self.altitude_m.is_finite()
    }
}

/// Returns x east of a meridian and y north of the equator, metres; `None` far from the meridian.
pub(super) fn transverse_mercator(position: Geo, meridian_deg: f64, scale: f64) -> Option<[f64; 2]> {
    let longitude_deg = (position.longitude_deg - meridian_deg + 540.0).rem_euclid(360.0) - 180.0;
    if !position.is_on_earth() || longitude_deg.abs() > MAX_WIDTH_DEG {
        return None;
    }
    let n = F / (2.0 - F);
    let [n2, n3, n4] = [n.powi(2), n.powi(3), n.powi(4)];
    let series = [
        n / 2.0 - 2.0 / 3.0 * n2 + 5.0 / 16.0 * n3 + 41.0 / 180.0 * n4,
        13.0 / 48.0 * n2 - 3.0 / 5.0 * n3 + 557.0 / 1440.0 * n4,
        61.0 / 240.0 * n3 - 103.0 / 140.0 * n4,
        49_561.0 / 161_280.0 * n4,
    ];
    let radius_m = A_M / (1.0 + n) * (1.0 + n2 / 4.0 + n4 / 64.0);
    let eccentricity = (F * (2.0 - F)).sqrt();
    let (sin, longitude) = (position.latitude_deg.to_radians().sin(), longitude_deg.to_radians());
    // Tangent of the conformal latitude, then both coordinates on the conformal sphere.
    let tangent = (sin.atanh() - eccentricity * (eccentricity * sin).atanh()).sinh();
    let xi = tangent.atan2(longitude.cos());
    let eta = (longitude.sin() / tangent.hypot(longitude.cos())).asinh();
    let (mut x, mut y) = (eta, xi);
    for (factor, twice) in series.into_iter().zip([2.0, 4.0, 6.0, 8.0]) {
        x += factor * (twice * xi).cos() * (twice * eta).sinh();
        y += factor * (twice * xi).sin() * (twice * eta).cosh();
    }
    Some([scale * radius_m * x, scale * radius_m * y])
}

/// Returns the position east, north and up of an origin, metres; `None` for a position that is not on earth.
pub(super) fn east_north_up(position: Geo, origin: Geo) -> Option<[f64; 3]> {
    if !position.is_on_earth() || !origin.is_on_earth() {
        return None;
    }
    let [there, here] = [earth_centred(position), earth_centred(origin)];
    let [x, y, z] = [0, 1, 2].map(|axis| there[axis] - here[axis]);
    let (sin_lat, cos_lat) = origin.latitude_deg.to_radians().sin_cos();
    let (sin_lon, cos_lon) = origin.longitude_deg.to_radians().sin_cos();
    let outwards = cos_lon * x + sin_lon * y;
    Some([cos_lon * y - sin_lon * x, cos_lat * z - sin_lat * outwards, cos_lat * outwards + sin_lat * z])
}

fn earth_centred(position: Geo) -> [f64; 3] {
    let (sin_lat, cos_lat) = position.latitude_deg.to_radians().sin_cos();
    let (sin_lon, cos_lon) = position.longitude_deg.to_radians().sin_cos();
    let e2 = F * (2.0 - F);
    let normal_m = A_M / (1.0 - e2 * sin_lat * sin_lat).sqrt();
    let from_axis_m = (normal_m + position.altitude_m) * cos_lat;
    [from_axis_m * cos_lon, from_axis_m * sin_lon, (normal_m * (1.0 - e2) + position.altitude_m) * sin_lat]
}

/// Returns the central meridian of a position's UTM zone, degrees.
pub(super) fn utm_meridian_deg(position: Geo) -> f64 {
    let longitude_deg = (position.longitude_deg + 180.0).rem_euclid(360.0) - 180.0;
    let within = |low: f64, high: f64| (low..high).contains(&longitude_deg);
    if (56.0..64.0).contains(&position.latitude_deg) && within(3.0, 6.0) {
        return 9.0; // the south of Norway is all in zone 32
    }
    if position.latitude_deg >= 72.0 && within(0.0, 42.0) {
        // Svalbard has only the odd zones, 12 degrees wide except for the outer ones.
        return [(9.0, 3.0), (21.0, 15.0), (33.0, 27.0)]
            .into_iter()
            .find_map(|(end, meridian)| (longitude_deg < end).then_some(meridian))
            .unwrap_or(39.0);
    }
    (longitude_deg / 6.0).floor() * 6.0 + 3.0
}

/// A 100 km square of the military grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MgrsSquare {
    meridian_deg: f64,
    /// Easting of the square's western edge, metres.
    easting_m: f64,
    /// Northing of the square's southern edge, metres, without a multiple of 2000 km.
    northing_m: f64,
}

impl MgrsSquare {
    /// Reads a name such as `54SUE`: zone, band, column and row. `None` for any other text, including polar
    /// squares.
    pub fn parse(name: &str) -> Option<Self> {
        let digits = name.find(|letter: char| !letter.is_ascii_digit())?;
        let (zone, letters) = name.split_at(digits);
        let zone: u8 = zone.parse().ok().filter(|zone| (1..=60).contains(zone))?;
        let &[band, column, row] = letters.as_bytes() else { return None };
        "CDEFGHJKLMNPQRSTUVWX".bytes().find(|letter| *letter == band)?;
        let columns = match zone % 3 {
            1 => "ABCDEFGH",
            2 => "JKLMNPQR",
            _ => "STUVWXYZ",
        };
        let position = |letters: &str, letter| {
            let found = letters.bytes().position(|known| known == letter);
            found.and_then(|at| u8::try_from(at).ok()).map(f64::from)
        };
        let column = position(columns, column)?;
        let row = position("ABCDEFGHJKLMNPQRSTUV", row)? - if zone.is_multiple_of(2) { 5.0 } else { 0.0 };
        Some(Self {
            meridian_deg: f64::from(zone) * 6.0 - 183.0,
            easting_m: (column + 1.0) * SQUARE_M,
            northing_m: row * SQUARE_M,
        })
    }

    /// Returns the square that contains a position. `None` for a position that is not on earth.
    pub(super) fn around(position: Geo) -> Option<Self> {
        let meridian_deg = utm_meridian_deg(position);
        let [x, y] = transverse_mercator(position, meridian_deg, UTM_SCALE)?;
        let edge = |metres: f64| (metres / SQUARE_M).floor() * SQUARE_M;
        Some(Self { meridian_deg, easting_m: edge(x + UTM_EASTING_M), northing_m: edge(y) })
    }

    /// Returns x and y from the south-western corner, metres, also beyond the square's edges; `None` far from
    /// the zone.
    pub(super) fn project(self, position: Geo) -> Option<[f64; 2]> {
        let [x, y] = transverse_mercator(position, self.meridian_deg, UTM_SCALE)?;
        // Rows repeat every 2000 km; the nearest row with this name is meant.
        let y = (y - self.northing_m + 1e6).rem_euclid(2e6) - 1e6;
        Some([x + UTM_EASTING_M - self.easting_m, y])
    }
}

#[cfg(test)]
mod tests;
