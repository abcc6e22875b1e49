//! The file that preserves the history across restarts: first a line with the state of the writing process,
//! then one line of JSON per entry.

use std::fs::{self, File, TryLockError};
use std::io::{self, BufRead, BufReader, ErrorKind, Write as _};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::new_files::write_whole;
use gateway_core::gateway::history::HistoryEntry;

const NAME: &str = "history.jsonl";
/// Format version, incremented when an older program would misread the file.
const VERSION: u32 = 1;
/// Maximum number of bytes that are read. A file that the gateway writes has less than half as many.
const MAX_BYTES: u64 = 32 * 1024 * 1024;

/// State of the process when it wrote the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WriterState {
    /// It continued to run. If no newer file exists, it did not stop in an orderly way.
    Running,
    /// It was about to end.
    Stopped,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    history: u32,
    writer: WriterState,
}

/// Contents of a history file.
#[derive(Debug)]
pub struct ReadHistory {
    /// State of the process when it wrote the file.
    pub writer: WriterState,
    /// Entries in file order.
    pub entries: Vec<HistoryEntry>,
    /// Number of lines that are not valid entries.
    pub unreadable: u64,
}

/// The history file in a folder.
#[derive(Debug, Clone)]
pub struct HistoryFile {
    /// Path of the file.
    pub path: PathBuf,
}

impl HistoryFile {
    /// Returns the history file of this folder, which need not exist.
    pub fn in_folder(folder: &Path) -> Self {
        Self { path: folder.join(NAME) }
    }

    /// Claims the file for this process until the result is dropped; `None` if the lock file cannot be
    /// created, e.g. because the folder is not writable yet. Fails if another process stores its history
    /// there.
    pub fn claim(&self) -> io::Result<Option<File>> {
        let path = self.path.with_extension("lock");
        let folder = self.path.parent().map(fs::create_dir_all).transpose();
        let opened = folder.and_then(|_| File::options().create(true).truncate(false).write(true).open(path));
        let Ok(lock) = opened else { return Ok(None) };
        match lock.try_lock() {
            Err(TryLockError::WouldBlock) => {
                Err(io::Error::new(ErrorKind::ResourceBusy, "another gateway keeps its history there"))
            }
            Ok(()) | Err(TryLockError::Error(_)) => Ok(Some(lock)),
        }
    }

    /// Reads the file; `None` if there is none. Fails if the file cannot be read, or is not a history that
    /// this version supports.
    pub fn read(&self) -> io::Result<Option<ReadHistory>> {
        let invalid = |text: String| io::Error::new(ErrorKind::InvalidData, text);
        match fs::metadata(&self.path) {
            Ok(found) if found.is_file() => {}
            // Opening a pipe would wait for its writer.
            Ok(_) => return Err(invalid("expected a file".to_owned())),
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(error),
        }
        parse(BufReader::new(File::open(&self.path)?)).map(Some)
    }

    /// Writes the whole file, or leaves the old one unchanged. Creates the folder if it is missing. Fails if
    /// the folder or the disk does not accept the file.
    pub fn write(&self, entries: &[HistoryEntry], writer: WriterState) -> io::Result<()> {
        if let Some(folder) = self.path.parent() {
            fs::create_dir_all(folder)?;
        }
        write_whole(&self.path.with_extension("draft"), &self.path, |file| {
            serde_json::to_writer(&mut *file, &Header { history: VERSION, writer })?;
            for entry in entries {
                file.write_all(b"\n")?;
                serde_json::to_writer(&mut *file, entry)?;
            }
            file.write_all(b"\n")
        })
    }
}

/// Reads the lines of a history. Fails if reading fails, or if this is not a history that this version
/// supports.
pub fn parse(reader: impl BufRead) -> io::Result<ReadHistory> {
    let invalid = |text: String| io::Error::new(ErrorKind::InvalidData, text);
    let mut lines = reader.take(MAX_BYTES).split(b'\n');
    let first = lines.next().transpose()?.unwrap_or_default();
    let header: Header = serde_json::from_slice(&first)
        .map_err(|error| invalid(format!("expected a history, found another file: {error}")))?;
    if header.history != VERSION {
        let found = header.history;
        return Err(invalid(format!("expected a history of version {VERSION}, found version {found}")));
    }
    let mut read = ReadHistory { writer: header.writer, entries: Vec::new(), unreadable: 0 };
    for line in lines {
        match serde_json::from_slice(&line?) {
            Ok(entry) => read.entries.push(entry),
            Err(_) => read.unreadable += 1,
        }
    }
    Ok(read)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gateway_base::diagnostics::Level;
    use gateway_base::time::{MonoTime, WallStamp};
    use gateway_core::gateway::history::{Change, ChangeKind, History};

    fn entries(texts: &[&str]) -> Vec<HistoryEntry> {
        let mut history = History::new(1_000_000);
        for text in texts {
            let change = Change {
                kind: ChangeKind::Status,
                level: Level::Error,
                subject: "turn\nindicators".to_owned(),
                text: (*text).to_owned(),
                remedy: "mend it".to_owned(),
            };
            history.add(change, Some(MonoTime::ZERO), WallStamp::from_nanos(-1));
        }
        history.recorded(&(MonoTime::ZERO..=MonoTime::ZERO), "boot-time");
        history.entries()
    }

    #[test]
    fn file_gives_back_what_was_written_and_lies_in_a_new_folder() {
        let folder = tempfile::tempdir().unwrap();
        let file = HistoryFile::in_folder(&folder.path().join("new/folder"));
        assert!(file.read().unwrap().is_none());
        let written = entries(&["one", "two\n\"{", "\u{1b}[31m ä"]);
        for writer in [WriterState::Running, WriterState::Stopped] {
            file.write(&written, writer).unwrap();
            let read = file.read().unwrap().unwrap();
            assert_eq!((read.writer, read.entries, read.unreadable), (writer, written.clone(), 0));
        }
        let names: Vec<_> = fs::read_dir(file.path.parent().unwrap()).unwrap().collect();
        assert_eq!(names.len(), 1, "no draft is left");
    }

    #[test]
    fn what_is_no_entry_is_counted_and_what_is_no_history_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let file = HistoryFile::in_folder(folder.path());
        file.write(&entries(&["one", "two"]), WriterState::Running).unwrap();
        let whole = fs::read(&file.path).unwrap();
        // A power cut, and a byte that is not UTF-8.
        fs::write(&file.path, &whole[..whole.len() - 30]).unwrap();
        let cut = file.read().unwrap().unwrap();
        assert_eq!((cut.entries.len(), cut.unreadable), (1, 1));
        fs::write(&file.path, [&whole, b"\xff\n{}\n[1]\n".as_slice()].concat()).unwrap();
        let mixed = file.read().unwrap().unwrap();
        assert_eq!((mixed.entries.len(), mixed.unreadable), (2, 3));
        for (text, expected) in [
            ("", "expected a history, found another file"),
            ("\n\n", "expected a history, found another file"),
            ("{\"history\":1}\n", "expected a history, found another file"),
            ("{\"history\":2,\"writer\":\"stopped\"}", "expected a history of version 1, found version 2"),
        ] {
            fs::write(&file.path, text).unwrap();
            let error = file.read().unwrap_err().to_string();
            assert!(error.contains(expected), "{text:?}: {error}");
        }
        fs::remove_file(&file.path).unwrap();
        fs::create_dir(&file.path).unwrap();
        assert!(file.read().is_err());
    }
}
