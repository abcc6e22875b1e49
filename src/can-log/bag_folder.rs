//! The folder of a bag, as written by `rosbag2` and the gateway's recorder: its recordings follow one
//! another.

use std::cmp::Ordering;
use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::compression::decompressed;
use crate::file_budget::FileBudget;
use crate::formats::{HEAD, is_in_bags};
use crate::regular_file;

/// Returns the recordings of a bag in the order of the numbers in their names; empty if the folder is not a
/// bag.
///
/// # Errors
/// Fails if a folder or file cannot be read.
pub fn files(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_file() && begins_like_a_bag(&path)? {
            files.push(path);
        }
    }
    files.sort_by(|one, other| by_number(&one.to_string_lossy(), &other.to_string_lossy()));
    Ok(files)
}

/// Returns true if a file begins like a recording of a bag, plain or compressed.
///
/// # Errors
/// Fails if a file cannot be read.
pub fn begins_like_a_bag(path: &Path) -> io::Result<bool> {
    let file = io::BufReader::new(regular_file::open(path)?);
    let mut head = Vec::new();
    // The part that can be unpacked is enough.
    let _cut_off =
        decompressed(Box::new(file), &FileBudget::default())?.take(HEAD as u64).read_to_end(&mut head);
    Ok(is_in_bags(&head))
}

/// Compares digits as numbers, so that `bag_10` comes after `bag_9`.
fn by_number(one: &str, other: &str) -> Ordering {
    let parts = |text: &str| {
        let mut parts: Vec<(String, u128)> = Vec::new();
        for char in text.chars() {
            match (char.to_digit(10), parts.last_mut()) {
                (Some(digit), Some((_, number))) => {
                    *number = number.saturating_mul(10).saturating_add(digit.into());
                }
                (Some(digit), None) => parts.push((String::new(), digit.into())),
                (None, _) => parts.push((char.to_string(), 0)),
            }
        }
        parts
    };
    parts(one).cmp(&parts(other)).then_with(|| one.cmp(other))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_in_the_order_of_their_numbers() {
        let mut names = ["bag_10.mcap", "bag_9.mcap", "bag_0.mcap", "bag_100.mcap", "9_1", "10_0"];
        names.sort_by(|one, other| by_number(one, other));
        assert_eq!(names, ["9_1", "10_0", "bag_0.mcap", "bag_9.mcap", "bag_10.mcap", "bag_100.mcap"]);
    }

    #[test]
    fn only_recordings_of_a_bag_belong_to_it_whatever_their_names() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).unwrap();
        write("metadata.yaml", b"rosbag2_bagfile_information:\n");
        write("drive.log", b"(1.0) can0 123#\n");
        write("part_2", b"\x89MCAP0\r\n");
        write("part_10.mcap", b"\x89MCAP0\r\n");
        fs::create_dir(folder.path().join("part_3.mcap")).unwrap();
        let names: Vec<_> =
            files(folder.path()).unwrap().iter().map(|path| path.file_name().unwrap().to_owned()).collect();
        assert_eq!(names, ["part_2", "part_10.mcap"]);
    }
}
