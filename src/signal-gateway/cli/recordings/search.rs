//! Finds the recordings among the given files and in the given folders.

use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::vec::IntoIter;

use crate::cli::unreadable::HEAD;
use crate::config::file_kind::FileKind;
use can_log::{begins_like_a_bag, files_of_bag, regular_file};

/// Extensions that only recordings have. Such a file is read even if its content is damaged beyond
/// recognition, so that it is not passed over in silence.
const EXTENSIONS: [&str; 8] = ["asc", "blf", "db3", "mcap", "mf4", "pcap", "pcapng", "trc"];

/// The recordings that a command reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::cli) enum Wanted {
    /// Recordings of CAN frames in any format.
    Frames,
    /// Recordings of ROS 2 messages: MCAP and bags.
    Messages,
}

/// Returns the recordings one by one: those of a folder in the order of their names, with its folders.
pub(super) struct Search {
    wanted: Wanted,
    /// Paths that remain, of each folder on the way to the current one.
    remaining: Vec<IntoIter<PathBuf>>,
    /// Number of files in folders that are not recordings.
    pub(super) skipped: u64,
}

impl Search {
    pub(super) fn new(given: Vec<PathBuf>, wanted: Wanted) -> Self {
        Self { wanted, remaining: vec![given.into_iter()], skipped: 0 }
    }

    /// Returns true for a file in a folder that is to be read.
    fn is_wanted(&self, path: &Path) -> bool {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        let is_named = |names: &[&str]| extension.as_deref().is_some_and(|name| names.contains(&name));
        match self.wanted {
            Wanted::Frames => is_named(&EXTENSIONS) || is_recording(path),
            Wanted::Messages => is_named(&["db3", "mcap"]) || begins_like_a_bag(path).unwrap_or(false),
        }
    }
}

impl Iterator for Search {
    type Item = PathBuf;

    fn next(&mut self) -> Option<PathBuf> {
        loop {
            let is_given = self.remaining.len() == 1;
            let Some(path) = self.remaining.last_mut()?.next() else {
                self.remaining.pop();
                continue;
            };
            if is_archive(&path) {
                // A link to a folder may lead back up.
                if !is_given && path.is_symlink() {
                    continue;
                }
                match entries(&path) {
                    Some(entries) => self.remaining.push(entries.into_iter()),
                    // Its process says why it cannot be read.
                    None => return Some(path),
                }
            } else if is_given || path.is_dir() || path.is_file() && self.is_wanted(&path) {
                return Some(path);
            } else {
                self.skipped += 1;
            }
        }
    }
}

/// Returns true for a folder of recordings. The folder of a bag, with its `metadata.yaml`, is one recording.
pub(super) fn is_archive(path: &Path) -> bool {
    let is_bag =
        || path.join("metadata.yaml").is_file() && files_of_bag(path).is_ok_and(|files| !files.is_empty());
    path.is_dir() && !is_bag()
}

/// Returns the files and folders in a folder, sorted, without hidden ones; `None` if it cannot be read.
fn entries(folder: &Path) -> Option<Vec<PathBuf>> {
    let is_shown =
        |path: &PathBuf| path.file_name().is_some_and(|name| !name.as_encoded_bytes().starts_with(b"."));
    let entries = fs::read_dir(folder).ok()?.map(|entry| Some(entry.ok()?.path()));
    let mut entries: Vec<_> = entries.flatten().filter(is_shown).collect();
    entries.sort();
    Some(entries)
}

fn is_recording(path: &Path) -> bool {
    let mut head = Vec::new();
    let read = regular_file::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut head));
    read.is_ok() && FileKind::of(&head) == Some(FileKind::Recording)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_searched_for_recordings_by_their_content() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, content: &[u8]| {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, content).unwrap();
        };
        write("b/drive", b"(1.0) can0 123#00\n");
        write("a.log", b"(1.0) can0 123#00\n");
        write("broken.blf", b"");
        write("notes.txt", b"nothing\n");
        write("car.toml", b"profile = \"x\"\n");
        write(".hidden.log", b"(1.0) can0 123#00\n");
        write("bag/metadata.yaml", b"rosbag2_bagfile_information:\n");
        write("bag/bag_0.mcap", b"\x89MCAP0\r\n");
        write("loose/one.mcap", b"\x89MCAP0\r\n");
        std::os::unix::fs::symlink(folder.path(), folder.path().join("b/up")).unwrap();
        std::os::unix::fs::symlink(folder.path().join("a.log"), folder.path().join("b/link")).unwrap();
        let found = |wanted| {
            let mut search = Search::new(vec![folder.path().to_owned()], wanted);
            let found: Vec<_> = search.by_ref().collect();
            let names =
                found.iter().map(|path| path.strip_prefix(folder.path()).unwrap().display().to_string());
            (names.collect::<Vec<_>>().join(" "), search.skipped)
        };
        let all = "a.log b/drive b/link bag broken.blf loose/one.mcap";
        assert_eq!(found(Wanted::Frames), (all.to_owned(), 2));
        assert_eq!(found(Wanted::Messages), ("bag loose/one.mcap".to_owned(), 6));
    }
}
