//! Files given by path, or by the name of a built-in file. A file on the disk has priority.

use std::io;
use std::path::{Path, PathBuf};

use super::built_in::BuiltIn;
use super::files::Files;
use super::reading::fields::Fields;

/// Returns the path to read for a file given by name or path: `path`, unless only a built-in file has this
/// name.
pub(super) fn find(kind: BuiltIn, files: &dyn Files, given: &str, path: PathBuf) -> PathBuf {
    let Some(built_in) = kind.path(given) else { return path };
    match files.is_folder(&path).map_err(|error| error.kind()) {
        // A folder stands for the map in it.
        Ok(is_folder) if !is_folder || kind == BuiltIn::Map => path,
        Ok(_) | Err(io::ErrorKind::NotFound) => built_in,
        Err(_) => path,
    }
}

/// Returns the path to read for a file given by name, or by a path relative to the working directory.
pub(super) fn find_here(kind: BuiltIn, files: &dyn Files, given: &Path) -> PathBuf {
    find(kind, files, &given.to_string_lossy(), given.to_owned())
}

/// Returns the path to read for a file that a key gives by name, or by a path relative to the file with the
/// key.
pub(super) fn path_at(
    kind: BuiltIn,
    files: &dyn Files,
    fields: &Fields<'_>,
    key: &'static str,
) -> Option<PathBuf> {
    let given = fields.string(key)?.text;
    Some(find(kind, files, &given, fields.checker.beside(&given)))
}

/// Returns the remedy for an unusable file: if it does not exist, the built-in names that were probably
/// meant.
pub(super) fn remedy(kind: BuiltIn, files: &dyn Files, path: &Path, otherwise: &str) -> String {
    match files.is_folder(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => kind.did_you_mean(path, otherwise),
        Ok(_) | Err(_) => otherwise.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::built_in::display;
    use crate::config::files::Disk;
    use crate::config::load_profile;

    #[test]
    fn every_built_in_profile_is_loaded_with_its_dbcs_by_name() {
        let mut count = 0;
        for name in BuiltIn::Profile.names() {
            let settings = load_profile(&Disk, &BuiltIn::Profile.path(name).unwrap()).unwrap();
            assert!(
                settings.dbcs.iter().all(|dbc| display(&dbc.path).starts_with("built-in dbc/")),
                "{name}"
            );
            count += 1;
        }
        assert!(count > 40);
    }

    #[test]
    fn a_file_wins_over_a_built_in_name_and_a_folder_only_over_that_of_a_map() {
        let folder = tempfile::tempdir().unwrap();
        let found = |kind: BuiltIn, name: &str| {
            let path = folder.path().join(name);
            display(&find(kind, &Disk, name, path)).replace(folder.path().to_str().unwrap(), "FOLDER")
        };
        assert_eq!(found(BuiltIn::Profile, "hyundai_kia"), "built-in profile hyundai_kia");
        assert_eq!(found(BuiltIn::Profile, "hyundai"), "FOLDER/hyundai");
        assert_eq!(found(BuiltIn::Map, "crossing"), "built-in map crossing");
        assert_eq!(found(BuiltIn::Drive, "crossing_left"), "built-in drive crossing_left");
        assert_eq!(found(BuiltIn::Scenario, "bench"), "built-in scenario bench");
        assert_eq!(found(BuiltIn::Scenario, "bench.xosc"), "built-in scenario bench.xosc");
        for name in ["crossing", "mg"] {
            std::fs::create_dir(folder.path().join(name)).unwrap();
        }
        std::fs::write(folder.path().join("hyundai_kia"), "name = \"mine\"").unwrap();
        assert_eq!(found(BuiltIn::Profile, "hyundai_kia"), "FOLDER/hyundai_kia");
        assert_eq!(found(BuiltIn::Profile, "mg"), "built-in profile mg");
        assert_eq!(found(BuiltIn::Map, "crossing"), "FOLDER/crossing");
    }
}
