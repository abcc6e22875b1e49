//! The text of a file, and locations in it: line, column, and the path of keys or elements.

use std::fmt;
use std::io;
use std::path::Path;
use std::rc::Rc;
use std::sync::Arc;

use derive_more::Display;

use super::problem::{Position, Problem};
use crate::config::built_in::display;

/// Maximum size of a file, bytes.
pub(crate) const MAX_BYTES: usize = 4 << 20;
pub(crate) const MAX_DEPTH: usize = 64;
/// Maximum number of elements or values in a file, with aliases expanded.
pub(crate) const MAX_NODES: usize = 100_000;
/// Maximum length of a key in a refusal, characters.
const MAX_NAME: usize = 60;

/// Distance between the positions for which the number of preceding characters is stored, bytes.
const STRIDE: usize = 256;

/// Maximum length of a reason, characters.
const MAX_REASON: usize = 600;

/// A location in a file, for texts: `file:line:column: key`.
#[derive(Debug, Clone, PartialEq, Eq, Display)]
#[display("{}:{position}: {key}", display(file))]
pub struct SourceLocation {
    /// Path of the file, as it was named.
    pub file: Arc<Path>,
    /// Location in the file.
    pub position: Position,
    /// Path of elements (`OpenSCENARIO/Storyboard/…/@name`) or of keys (`event[2].do[1].set`).
    pub key: String,
}

impl SourceLocation {
    /// Creates a problem at this location.
    pub fn problem(&self, reason: impl Into<String>, remedy: impl Into<String>) -> Problem {
        let (position, key) = (Some(self.position), self.key.as_str().into());
        Problem { position, key, ..Problem::whole_file(&self.file, reason, remedy) }
    }
}

/// A path of keys that shares its beginning with related paths, so that a deeply nested file uses little
/// memory.
#[derive(Debug)]
pub(crate) struct KeyPath {
    parent: Option<Rc<KeyPath>>,
    /// Last segment, including its preceding separator.
    segment: String,
}

impl KeyPath {
    /// Returns the empty path, at which every other begins.
    pub(crate) fn root() -> Rc<Self> {
        Rc::new(Self { parent: None, segment: String::new() })
    }

    /// Returns `parent` extended by `separator` and `name`, with the name shortened and on one line.
    pub(crate) fn below(parent: &Rc<Self>, separator: &str, name: &str) -> Rc<Self> {
        let plain = |char: char| !char.is_control();
        let mut segment = separator.to_owned();
        if name.chars().all(plain) && name.chars().nth(MAX_NAME).is_none() {
            segment.push_str(name);
        } else {
            segment.extend(name.chars().take(MAX_NAME).map(|char| if plain(char) { char } else { ' ' }));
            segment.push('…');
        }
        Rc::new(Self { parent: Some(Rc::clone(parent)), segment })
    }

    /// Returns the path of the child element with this number: `Phase`, `Phase[2]`, …
    pub(crate) fn numbered(parent: &Rc<Self>, name: &str, count: usize) -> Rc<Self> {
        let key = Self::below(parent, "/", name);
        if count == 1 { key } else { Self::below(&key, "", &format!("[{count}]")) }
    }
}

impl fmt::Display for KeyPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut segments = Vec::new();
        let mut key = Some(self);
        while let Some(Self { parent, segment }) = key {
            segments.push(segment.as_str());
            key = parent.as_deref();
        }
        segments.reverse();
        f.write_str(segments.concat().trim_start_matches(['/', '.']))
    }
}

#[derive(Debug, Clone)]
pub(crate) struct Location {
    pub(crate) position: Position,
    pub(crate) key: Rc<KeyPath>,
}

impl Location {
    /// Returns the location with the name of the file.
    pub(crate) fn in_file(&self, file: &Arc<Path>) -> SourceLocation {
        SourceLocation { file: Arc::clone(file), position: self.position, key: self.key.to_string() }
    }
}

/// The text of a file, without byte-order mark, with the starts of its lines.
#[derive(Debug)]
pub(crate) struct Text {
    pub(crate) file: Arc<Path>,
    pub(crate) content: String,
    /// Byte at which each line begins.
    starts: Vec<usize>,
    /// The number of characters before each stretch of [`STRIDE`] bytes, since a whole file may be one line.
    before: Vec<usize>,
}

impl Text {
    /// Creates the text of a file from the result of reading it; `remedy` is for a file that could not be
    /// read.
    ///
    /// # Errors
    /// Fails if the file cannot be read, is too large, or is not UTF-8.
    pub(crate) fn read(path: &Path, bytes: io::Result<Vec<u8>>, remedy: &str) -> Result<Self, Problem> {
        let bytes = bytes.map_err(|error| Problem::unreadable(path, &error, remedy))?;
        Self::new(path, bytes)
    }

    /// Creates the text from a file's bytes.
    ///
    /// # Errors
    /// Fails if there are too many bytes, or they are not UTF-8.
    pub(crate) fn new(path: &Path, bytes: Vec<u8>) -> Result<Self, Problem> {
        if bytes.len() > MAX_BYTES {
            let reason = format!("the file is too large: {} bytes", bytes.len());
            let problem = Problem::whole_file(path, reason, "split it: at most 4 MiB are read");
            return Err(Problem { position: Some(Position::START), ..problem });
        }
        let content = String::from_utf8(bytes).map_err(|error| {
            let good = error.utf8_error().valid_up_to();
            let before = String::from_utf8_lossy(error.as_bytes().get(..good).unwrap_or_default());
            let text = Self::of(path, before.into_owned());
            text.problem(text.position(text.content.len()), "this is not UTF-8", "save the file as UTF-8")
        })?;
        Ok(Self::of(path, content.strip_prefix('\u{FEFF}').map_or(content.clone(), str::to_owned)))
    }

    /// Returns the same text; a blank text is refused.
    pub(crate) fn not_blank(self) -> Result<Self, Problem> {
        if self.content.trim().is_empty() {
            return Err(self.problem(Position::START, "the file is empty", "write a scenario into it"));
        }
        Ok(self)
    }

    /// Creates the text with the content that a file has, or would have.
    pub(crate) fn of(path: &Path, content: String) -> Self {
        let ends = content.match_indices('\n').map(|(at, _)| at + 1);
        let starts = std::iter::once(0).chain(ends).collect();
        let stretches = content.as_bytes().chunks(STRIDE).scan(0, |sum, stretch| {
            *sum += characters(stretch);
            Some(*sum)
        });
        let before = std::iter::once(0).chain(stretches).collect();
        Self { file: path.into(), content, starts, before }
    }

    /// Returns the number of characters before a byte.
    fn characters_before(&self, offset: usize) -> usize {
        let stretch = offset / STRIDE;
        let rest = self.content.as_bytes().get(stretch * STRIDE..offset).unwrap_or_default();
        self.before.get(stretch).copied().unwrap_or(0) + characters(rest)
    }

    /// Returns the line and column of a byte; the column counts characters.
    pub(crate) fn position(&self, offset: usize) -> Position {
        let line = self.starts.partition_point(|start| *start <= offset).max(1);
        let start = self.starts.get(line - 1).copied().unwrap_or(0);
        let offset = offset.min(self.content.len());
        let before = self.characters_before(offset) - self.characters_before(start.min(offset));
        Position { line, column: before + 1 }
    }

    /// Creates a problem that does not belong to a key.
    pub(crate) fn problem(&self, position: Position, reason: &str, remedy: &str) -> Problem {
        Problem { position: Some(position), ..Problem::whole_file(&self.file, line(reason), remedy) }
    }
}

/// Returns the number of characters of UTF-8 that begin in these bytes.
fn characters(bytes: &[u8]) -> usize {
    bytes.iter().filter(|byte| **byte & 0xC0 != 0x80).count()
}

/// Returns the text on one line and shortened to a bounded length, regardless of its contents.
pub(crate) fn line(text: &str) -> String {
    text.chars().take(MAX_REASON).map(|char| if char.is_control() { ' ' } else { char }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_count_lines_and_characters_from_one() {
        let text = Text::new(Path::new("a"), "\u{FEFF}ä=1\nöb\n".into()).unwrap();
        let at = |part: &str| text.position(text.content.find(part).unwrap()).to_string();
        assert_eq!(["ä", "=", "ö", "b"].map(at), ["1:1", "1:2", "2:1", "2:2"]);
    }

    #[test]
    fn positions_on_a_long_line_are_counted_in_characters() {
        let text = Text::new(Path::new("a"), "äb日".repeat(1_000).into()).unwrap();
        for character in [0, 1, 2, 84, 85, 86, 127, 128, 129, 1_500, 2_999] {
            let offset = text.content.char_indices().nth(character).unwrap().0;
            assert_eq!(text.position(offset), Position { line: 1, column: character + 1 });
        }
        assert_eq!(text.position(text.content.len() + 1), Position { line: 1, column: 3_001 });
    }

    #[test]
    fn bytes_that_are_not_utf8_are_refused_at_their_position() {
        let refused = |bytes: &[u8]| Text::new(Path::new("a"), bytes.to_vec()).unwrap_err().to_string();
        assert_eq!(refused(b"a\nb\xFF"), "a:2:2: this is not UTF-8; save the file as UTF-8");
        let blank = Text::new(Path::new("a"), b"\xEF\xBB\xBF \n".to_vec()).unwrap().not_blank();
        assert!(blank.unwrap_err().to_string().contains("a:1:1: the file is empty"));
        assert!(refused(&vec![b' '; MAX_BYTES + 1]).contains("4194305 bytes"));
    }

    #[test]
    fn long_and_broken_names_stay_short_and_on_one_line() {
        let key = KeyPath::below(&KeyPath::root(), ".", &format!("a\nb{}", "c".repeat(100)));
        let shown = KeyPath::below(&key, "", "[2]").to_string();
        assert!(shown.starts_with("a bccc") && shown.ends_with("…[2]"), "{shown}");
        assert!(shown.chars().count() < 70);
    }
}
