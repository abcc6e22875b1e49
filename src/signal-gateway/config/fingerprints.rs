//! The public lists of identifiers, `config/cars/fingerprints.toml` in the binary.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::LazyLock;

use serde::Deserialize;

use super::built_in;
use super::reading::problem::Problem;
use can_signal::can::CanId;
use vehicle_bringup::plausibility::fingerprint::PlatformList;

const PATH: &str = "config/cars/fingerprints.toml";

/// The tables of the file, as explained at its top; the origin of the lists is only for readers.
#[derive(Debug, Deserialize)]
struct ListFile {
    lists: Vec<ListTable>,
}

#[derive(Debug, Deserialize)]
struct ListTable {
    name: String,
    make: String,
    title: String,
    #[serde(default)]
    standard: BTreeMap<String, String>,
    #[serde(default)]
    extended: BTreeMap<String, String>,
}

static LISTS: LazyLock<Result<Vec<PlatformList>, Problem>> = LazyLock::new(|| {
    let problem = |reason: String| Problem::whole_file(Path::new(PATH), reason, "");
    let bytes = built_in::contents(Path::new(PATH)).ok_or_else(|| problem("not in the binary".to_owned()))?;
    let text = str::from_utf8(bytes).map_err(|error| problem(error.to_string()))?;
    read(text).map_err(problem)
});

/// Returns all public lists, in the order of their names.
///
/// # Errors
///
/// Fails only if the file in the binary is invalid.
pub fn lists() -> Result<&'static [PlatformList], Problem> {
    LISTS.as_deref().map_err(Clone::clone)
}

fn read(text: &str) -> Result<Vec<PlatformList>, String> {
    let file: ListFile = toml::from_str(text).map_err(|refused| refused.to_string())?;
    let list = |table: ListTable| {
        let mut messages = BTreeSet::new();
        let rows = table.standard.iter().map(|row| (row, CanId::standard as fn(u32) -> Option<CanId>));
        let rows = rows.chain(table.extended.iter().map(|row| (row, CanId::extended as _)));
        for ((length, distances), id) in rows {
            let row = identifiers(length, distances, id).ok_or_else(|| {
                format!(
                    "{}: expected a length and distances of identifiers, found {length} = {distances}",
                    table.name
                )
            })?;
            messages.extend(row);
        }
        if messages.is_empty() {
            return Err(format!("{}: expected identifiers, found none", table.name));
        }
        Ok(PlatformList { name: table.name, make: table.make, title: table.title, messages })
    };
    file.lists.into_iter().map(list).collect()
}

/// Reads a length, and the distances between the identifiers with this length.
fn identifiers(length: &str, distances: &str, id: fn(u32) -> Option<CanId>) -> Option<Vec<(CanId, usize)>> {
    let length = length.parse().ok()?;
    let mut number = 0_u32;
    let next = |distance| {
        number = number.checked_add(u32::from_str_radix(distance, 16).ok()?)?;
        Some((id(number)?, length))
    };
    distances.split_ascii_whitespace().map(next).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_lists_are_read() {
        let lists = lists().unwrap();
        let count: usize = lists.iter().map(|list| list.messages.len()).sum();
        assert_eq!((lists.len(), count), (71, 4_740));
        assert!(lists.iter().all(|list| list.messages.len() >= 8), "a list of few messages says nothing");
        let kia = lists.iter().find(|list| list.name == "hyundai_can_generated").unwrap();
        assert_eq!((kia.make.as_str(), kia.title.as_str()), ("Hyundai", "Hyundai and Kia, classic CAN"));
        assert!(kia.messages.contains(&(CanId::Standard(0x541), 8)), "CGW1");
        let low_speed = lists.iter().find(|list| list.name == "gm_global_a_lowspeed").unwrap();
        assert!(low_speed.messages.contains(&(CanId::Extended(0x1020_C000), 5)), "BlinkerStatus");
        assert!(built_in::contents(Path::new(PATH)).unwrap().len() < 300_000);
    }

    /// Returns a file with one list of these rows.
    fn file(rows: &str) -> String {
        format!("[[lists]]\nname = \"x\"\nmake = \"X\"\ntitle = \"X\"\n{rows}\n")
    }

    #[test]
    fn identifiers_are_the_sums_of_their_distances() {
        let lists = read(&file("standard = { 8 = \"7F 1\" }\nextended = { 2 = \"1FFFFFFF\" }")).unwrap();
        let expected =
            [(CanId::Standard(0x7F), 8), (CanId::Standard(0x80), 8), (CanId::Extended(0x1FFF_FFFF), 2)];
        assert_eq!(lists[0].messages, BTreeSet::from(expected));
    }

    #[test]
    fn a_row_that_is_not_of_the_form_is_refused() {
        for rows in [
            "standard = { 8 = \"G\" }",
            "standard = { 8 = \"800\" }",
            "standard = { x = \"1\" }",
            "extended = { 8 = \"1FFFFFFF 1\" }",
            "extended = { 8 = \"FFFFFFFF FFFFFFFF\" }",
            "other = { 8 = \"1\" }",
        ] {
            assert!(read(&file(rows)).is_err(), "{rows}");
        }
    }
}
