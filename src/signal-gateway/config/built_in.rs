//! Project files built into the binary: profiles with their DBCs, maps, drives and scenarios by name, and
//! rules of countries by code.

use std::path::{Component, Path, PathBuf, absolute};

use serde::Serialize;

use can_log::standard_input;
use gateway_base::names::variant_name;
use gateway_base::near_miss::near_misses;

/// Every built-in file by its path in the project, ascending; `build.rs` lists them.
const FILES: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/built_in.rs"));

/// First component of the path of a built-in file, so that it is never mistaken for a file on the disk.
const ROOT: &str = "built-in:";

/// Kinds of built-in files that have names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BuiltIn {
    /// A vehicle profile; its DBCs are also built in.
    Profile,
    /// A lanelet2 map, with its projector.
    Map,
    /// A drive of the turn signal decider.
    Drive,
    /// A scenario of traffic lights.
    Scenario,
}

impl BuiltIn {
    const ALL: [Self; 4] = [Self::Profile, Self::Map, Self::Drive, Self::Scenario];

    fn noun(self) -> &'static str {
        variant_name(&self)
    }

    /// Returns folder and suffix of the paths of its files in the project, between which is the name.
    fn affixes(self) -> (&'static str, &'static str) {
        match self {
            Self::Profile => ("config/vehicles/", ".toml"),
            Self::Map => ("config/maps/", "/lanelet2_map.osm"),
            Self::Drive => ("config/drives/", ".toml"),
            // For the other format, the extension is part of the name.
            Self::Scenario => ("config/scenarios/", ""),
        }
    }

    /// Returns the name of a file of this kind from its path in the project; `None` for other files.
    fn name_of(self, path: &str) -> Option<&str> {
        let (folder, end) = self.affixes();
        let name = path.strip_prefix(folder)?.strip_suffix(end)?;
        Some(name.strip_suffix(".toml").unwrap_or(name)).filter(|name| !name.contains('/'))
    }

    /// Returns the names of the built-in files of this kind, ascending.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        FILES.iter().filter_map(move |(path, _)| self.name_of(path))
    }

    /// Returns the name of the built-in file of this kind at a path; `None` for other files.
    pub(super) fn name_at(self, path: &Path) -> Option<&'static str> {
        let path = project_path(path)?;
        let (path, _) = FILES.iter().find(|(known, _)| Path::new(known) == path)?;
        self.name_of(path)
    }

    /// Returns the path of the built-in file with a name, for [`Disk`](super::files::Disk). A profile can
    /// also be given by its listed name, e.g. `Hyundai Kona 2020`, in any case.
    pub fn path(self, name: &str) -> Option<PathBuf> {
        let named = FILES.iter().find(|(path, _)| self.name_of(path) == Some(name));
        let titled = || {
            let mut profiles =
                FILES.iter().filter(|(path, _)| self == Self::Profile && self.name_of(path).is_some());
            profiles.find(|(_, bytes)| title(bytes).is_some_and(|title| title.eq_ignore_ascii_case(name)))
        };
        let (name, _) = named.or_else(titled)?;
        Some(path(name))
    }

    /// Returns the built-in names that were probably meant by a name or path, at most three.
    pub fn probably_meant(self, given: &Path) -> Vec<&'static str> {
        let Some(given) = given.file_stem().map(|stem| stem.to_string_lossy().to_lowercase()) else {
            return Vec::new();
        };
        let contains = |name: &&str| given.len() >= 3 && name.contains(&given);
        let mut names = near_misses(&given, self.names());
        if names.is_empty() {
            names = self.names().filter(contains).collect();
        }
        names.truncate(3);
        names
    }

    /// Returns the built-in names that were probably meant by a name or path, as a question, or `otherwise`
    /// if there are none.
    pub fn did_you_mean(self, given: &Path, otherwise: &str) -> String {
        let names = self.probably_meant(given);
        if names.is_empty() {
            return otherwise.to_owned();
        }
        format!("did you mean the built-in {} {}?", self.noun(), names.join(" or "))
    }
}

fn title(profile: &[u8]) -> Option<String> {
    let profile: toml::Table = toml::from_slice(profile).ok()?;
    Some(profile.get("name")?.as_str()?.to_owned())
}

/// Returns the path for [`Disk`](super::files::Disk) of a built-in file, from its path in the project.
pub fn path(project_path: &str) -> PathBuf {
    Path::new(ROOT).join(project_path)
}

/// Returns the path for texts: e.g. `built-in profile hyundai_kia` for a built-in file, `standard input`, or
/// the path itself.
pub fn display(path: &Path) -> String {
    if standard_input::is_named(path) {
        return "standard input".to_owned();
    }
    let Some(built_in) = project_path(path) else { return path.display().to_string() };
    let built_in = built_in.to_string_lossy();
    let name = |kind: BuiltIn| Some((kind, kind.name_of(&built_in)?));
    match BuiltIn::ALL.into_iter().find_map(name) {
        Some((kind, name)) => format!("built-in {} {name}", kind.noun()),
        None => format!("built-in {built_in}"),
    }
}

/// Returns the paths of the built-in files in a project folder, ascending.
pub(super) fn files_in(folder: &str) -> impl Iterator<Item = &'static Path> {
    FILES.iter().map(|(path, _)| Path::new(path)).filter(move |path| path.starts_with(folder))
}

/// Returns the contents of a built-in file, by its path in the project.
pub(super) fn contents(path: &Path) -> Option<&'static [u8]> {
    let path = without_dots(path);
    FILES.iter().find(|(name, _)| Path::new(name) == path).map(|(_, bytes)| *bytes)
}

/// Returns the path in the project of a built-in file; `None` for the path of a file on the disk.
pub(super) fn project_path(path: &Path) -> Option<PathBuf> {
    path.strip_prefix(ROOT).map(without_dots).ok()
}

/// Returns the path from the root, without `.` and `..`, so that a file has the same name regardless of the
/// working directory; `None` for an empty path.
pub(crate) fn full_path(path: &Path) -> Option<PathBuf> {
    absolute(path).ok().map(|path| without_dots(&path))
}

/// Returns a path without `.` and `..`, e.g. `a/c` for `a/b/../c`.
fn without_dots(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for component in path.components() {
        match component {
            Component::ParentDir => {
                plain.pop();
            }
            Component::CurDir => {}
            Component::Prefix(_) | Component::RootDir | Component::Normal(_) => plain.push(component),
        }
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_profile_is_found_by_its_own_name_too() {
        for name in BuiltIn::Profile.names() {
            let path = BuiltIn::Profile.path(name).unwrap();
            let own = title(contents(&project_path(&path).unwrap()).unwrap()).unwrap();
            assert_eq!(BuiltIn::Profile.path(&own.to_lowercase()), Some(path), "{own}");
        }
        assert_eq!(BuiltIn::Drive.path("Demo vehicle"), None);
    }

    #[test]
    fn a_near_miss_gets_a_question_and_nonsense_gets_the_other_advice() {
        let advice = |given: &str| BuiltIn::Profile.did_you_mean(Path::new(given), "look at the list");
        assert_eq!(advice("hyundai_ki"), "did you mean the built-in profile hyundai_kia?");
        assert_eq!(advice("vehicles/Hyundai_Kia.toml"), "did you mean the built-in profile hyundai_kia?");
        assert!(advice("honda").contains("honda_civic_hatchback_2017 or honda_civic_touring_2016?"));
        assert_eq!(advice("zeppelin"), "look at the list");
    }
}
