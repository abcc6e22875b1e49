//! Parses `map_projector_info.yaml`: keys and values, and nested maps, indented or in braces.
//!
//! Autoware writes no other YAML in this file; lists, multi-line texts and references are refused.

use std::collections::BTreeMap;

use super::{Geo, Projector};
use crate::projection::{MgrsSquare, UTM_SCALE};

/// A reason why a text does not name a projector.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)] // the texts say it
pub enum ProjectorError {
    /// This line, from 1, is not of the form `key: value`.
    #[error("map projector info, line {0}: `key: value` expected")]
    NotAKey(usize),
    #[error("map projector info, line {line}: `{key}` appears twice")]
    Twice { line: usize, key: String },
    #[error("map projector info: `{0}` is missing")]
    Missing(&'static str),
    #[error("map projector info: `{key}` is `{value}`, {expected} expected")]
    BadValue { key: &'static str, value: String, expected: &'static str },
}

impl Projector {
    /// Reads the text of the file.
    ///
    /// # Errors
    /// Returns a [`ProjectorError`] with the key.
    pub fn parse(yaml: &str) -> Result<Self, ProjectorError> {
        let keys = ProjectorKeys::read(yaml)?;
        match keys.required("projector_type")? {
            "Local" | "local" => Ok(Self::Local),
            "MGRS" => {
                let name = keys.required("mgrs_grid")?;
                let square = MgrsSquare::parse(name);
                square
                    .map(Self::Mgrs)
                    .ok_or_else(|| bad("mgrs_grid", name, "zone, band, column and row as in `54SUE`"))
            }
            "LocalCartesianUTM" => keys.origin().map(Self::LocalCartesianUtm),
            "LocalCartesian" => keys.origin().map(Self::LocalCartesian),
            "TransverseMercator" => {
                let scale = keys.number("scale_factor")?.unwrap_or(UTM_SCALE);
                if !(0.5..=2.0).contains(&scale) {
                    return Err(bad("scale_factor", &scale.to_string(), "0.5 to 2"));
                }
                Ok(Self::TransverseMercator { origin: keys.origin()?, scale })
            }
            other => {
                const KNOWN: &str = "Local, MGRS, LocalCartesianUTM, LocalCartesian or TransverseMercator";
                Err(bad("projector_type", other, KNOWN))
            }
        }
    }
}

/// Values by key. A key of an inner map is prefixed by the name of that map and a dot.
struct ProjectorKeys<'a>(BTreeMap<String, &'a str>);

impl<'a> ProjectorKeys<'a> {
    fn read(yaml: &'a str) -> Result<Self, ProjectorError> {
        let mut keys = Self(BTreeMap::new());
        let mut outer = "";
        for (at, text) in yaml.lines().enumerate() {
            let line = at + 1;
            let text = text.split_once('#').map_or(text, |(before, _)| before).trim_end();
            if matches!(text.trim(), "" | "---") {
                continue;
            }
            let (key, value) = text.split_once(':').ok_or(ProjectorError::NotAKey(line))?;
            let name = key.trim();
            let inner = key.starts_with([' ', '\t']);
            if name.is_empty() || name.starts_with(['-', '{', '[']) || inner && outer.is_empty() {
                return Err(ProjectorError::NotAKey(line));
            }
            if let Some(rest) = value.trim().strip_prefix('{') {
                let flow = rest.strip_suffix('}').filter(|_| !inner);
                keys.take_flow(name, flow.ok_or(ProjectorError::NotAKey(line))?, line)?;
                outer = "";
                continue;
            }
            if !inner {
                outer = if value.trim().is_empty() { name } else { "" };
            }
            keys.take(if inner { format!("{outer}.{name}") } else { name.to_owned() }, value, line)?;
        }
        Ok(keys)
    }

    /// Adds an inner map on one line, without its braces: `latitude: 35.0, longitude: 139.0`.
    fn take_flow(&mut self, outer: &str, flow: &'a str, line: usize) -> Result<(), ProjectorError> {
        for part in flow.split(',').filter(|part| !part.trim().is_empty()) {
            let (name, value) = part.split_once(':').ok_or(ProjectorError::NotAKey(line))?;
            self.take(format!("{outer}.{}", name.trim()), value, line)?;
        }
        Ok(())
    }

    fn take(&mut self, key: String, value: &'a str, line: usize) -> Result<(), ProjectorError> {
        match self.0.insert(key.clone(), value.trim().trim_matches(['"', '\''])) {
            None => Ok(()),
            Some(_) => Err(ProjectorError::Twice { line, key }),
        }
    }

    fn required(&self, key: &'static str) -> Result<&'a str, ProjectorError> {
        let value = self.0.get(key).copied().filter(|value| !value.is_empty());
        value.ok_or(ProjectorError::Missing(key))
    }

    fn number(&self, key: &'static str) -> Result<Option<f64>, ProjectorError> {
        let Some(&text) = self.0.get(key) else { return Ok(None) };
        let number = text.parse().ok().filter(|number: &f64| number.is_finite());
        number.map(Some).ok_or_else(|| bad(key, text, "a number"))
    }

    fn origin(&self) -> Result<Geo, ProjectorError> {
        let needed = |key| self.number(key)?.ok_or(ProjectorError::Missing(key));
        let origin = Geo {
            latitude_deg: needed("map_origin.latitude")?,
            longitude_deg: needed("map_origin.longitude")?,
            altitude_m: self.number("map_origin.altitude")?.unwrap_or_default(),
        };
        if !origin.is_on_earth() {
            let value = format!("{}, {}", origin.latitude_deg, origin.longitude_deg);
            return Err(bad("map_origin", &value, "latitude -90 to 90 and longitude -360 to 360"));
        }
        Ok(origin)
    }
}

fn bad(key: &'static str, value: &str, expected: &'static str) -> ProjectorError {
    ProjectorError::BadValue { key, value: value.chars().take(80).collect(), expected }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ORIGIN: &str = "map_origin:\n  latitude: 35.5 # degrees\n  longitude: -139.25\n  altitude: 2\n";

    #[test]
    fn each_kind_is_read() {
        let origin = Geo { latitude_deg: 35.5, longitude_deg: -139.25, altitude_m: 2.0 };
        let sea = Geo { altitude_m: 0.0, ..origin };
        let square = MgrsSquare::parse("54SUE").unwrap();
        let low = ORIGIN.replace("  altitude: 2\n", "");
        #[rustfmt::skip]
        let cases = [
            ("---\nprojector_type: Local\nvertical_datum: WGS84\n".to_owned(), Projector::Local),
            ("projector_type: \"MGRS\"\nmgrs_grid: 54SUE\n".to_owned(), Projector::Mgrs(square)),
            (format!("projector_type: LocalCartesianUTM\n{ORIGIN}"), Projector::LocalCartesianUtm(origin)),
            (format!("{low}projector_type: LocalCartesian"), Projector::LocalCartesian(sea)),
            ("projector_type: LocalCartesian\n\
              map_origin: {latitude: 35.5, longitude: '-139.25',} # here".to_owned(), Projector::LocalCartesian(sea)),
            (format!("projector_type: TransverseMercator\n{ORIGIN}scale_factor: 1.0\n"),
                Projector::TransverseMercator { origin, scale: 1.0 }),
            (format!("projector_type: TransverseMercator\n{ORIGIN}"),
                Projector::TransverseMercator { origin, scale: 0.9996 }),
        ];
        for (text, expected) in cases {
            assert_eq!(Projector::parse(&text), Ok(expected), "{text}");
        }
    }

    #[test]
    fn errors_name_the_key_and_what_is_expected() {
        #[rustfmt::skip]
        let cases = [
            ("", "`projector_type` is missing"),
            ("projector_type:", "`projector_type` is missing"),
            ("projector_type: UTM",
                "`projector_type` is `UTM`, Local, MGRS, LocalCartesianUTM, LocalCartesian or TransverseMercator expected"),
            ("projector_type: MGRS", "`mgrs_grid` is missing"),
            ("projector_type: MGRS\nmgrs_grid: 99XXX",
                "`mgrs_grid` is `99XXX`, zone, band, column and row as in `54SUE` expected"),
            ("projector_type: LocalCartesian", "`map_origin.latitude` is missing"),
            ("projector_type: LocalCartesian\nmap_origin:\n  latitude: x",
                "`map_origin.latitude` is `x`, a number expected"),
            ("projector_type: LocalCartesian\nmap_origin:\n  latitude: 95\n  longitude: 1",
                "`map_origin` is `95, 1`, latitude -90 to 90 and longitude -360 to 360 expected"),
            ("projector_type: TransverseMercator\nscale_factor: 0",
                "`scale_factor` is `0`, 0.5 to 2 expected"),
        ];
        for (text, expected) in cases {
            let error = Projector::parse(text).unwrap_err().to_string();
            assert_eq!(error, format!("map projector info: {expected}"), "{text}");
        }
        let lines = [
            ("\nLocal", 2),
            ("  a: b", 1),
            ("- a: b", 1),
            ("a: b\n  c: d", 2),
            (": x", 1),
            ("a: {b: 1", 1),
            ("a: {b}", 1),
        ];
        for (text, line) in lines {
            assert_eq!(Projector::parse(text), Err(ProjectorError::NotAKey(line)), "{text}");
        }
        let twice = ProjectorError::Twice { line: 2, key: "a".to_owned() };
        assert_eq!(Projector::parse("a: 1\na: 2"), Err(twice));
        let twice = ProjectorError::Twice { line: 1, key: "a.b".to_owned() };
        assert_eq!(Projector::parse("a: {b: 1, b: 2}"), Err(twice));
    }

    #[test]
    fn origins_are_zero_and_meters_go_out_from_there() {
        let text = |kind: &str| format!("projector_type: {kind}\n{ORIGIN}");
        for kind in ["LocalCartesianUTM", "LocalCartesian", "TransverseMercator"] {
            let projector = Projector::parse(&text(kind)).unwrap();
            let origin = Geo { latitude_deg: 35.5, longitude_deg: -139.25, altitude_m: 2.0 };
            let [x, y, _] = projector.project(origin).unwrap();
            assert!(x.abs() < 1e-6 && y.abs() < 1e-6, "{kind}");
            let north = Geo { latitude_deg: 35.501, ..origin };
            let [_, y, _] = projector.project(north).unwrap();
            assert!((y - 110.96).abs() < 0.1, "{kind}: {y}");
        }
    }
}
