//! Recognises the kind of a file by its content, so that a refusal can name a file that was given by mistake.

use std::io;
use std::path::Path;

use super::files::Files;
use super::reading::{Position, Problem, Refusal, Text};
use can_log::Log;
use can_log::{Looks, begins_like_binary, known_magic};

/// Length of the beginning by which a file is recognised, bytes. A TOML file is read as a whole.
const HEAD: usize = 16 << 10;

/// Kinds of files that users give to this program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// A configuration of the gateway.
    Gateway,
    /// A profile that describes a vehicle.
    Profile,
    /// A drive of the turn signal decider.
    Drive,
    /// A scenario of traffic lights in any of its forms.
    Scenario,
    /// The rules of a country.
    Country,
    /// A map in the lanelet2 format.
    Map,
    /// A DBC file of CAN messages.
    Dbc,
    /// An AUTOSAR description of CAN messages.
    Arxml,
    /// A recording of CAN frames.
    Recording,
    /// Something else, such as a picture.
    Other(Looks),
}

/// How to convert files that cantools reads to a DBC.
pub(super) const BY_CANTOOLS: &str =
    "convert it: pip install cantools, then `cantools convert FILE out.dbc`, and name out.dbc";
const BY_CANMATRIX: &str =
    "convert it: pip install canmatrix, then `canconvert FILE out.dbc`, and name out.dbc";

const KCD: Looks = Looks { name: "a Kayak description (KCD)", remedy: BY_CANTOOLS };
const SYM: Looks = Looks { name: "a PCAN symbol file (SYM)", remedy: BY_CANTOOLS };
const FIBEX: Looks = Looks { name: "a FIBEX description", remedy: BY_CANMATRIX };
const DBF: Looks = Looks { name: "a BUSMASTER database (DBF)", remedy: BY_CANMATRIX };

/// Top-level keys that only one kind of TOML file has.
const TOP_KEYS: [(FileKind, &[&str]); 5] = [
    (
        FileKind::Gateway,
        &[
            "profile",
            "source",
            "can",
            "ros",
            "reports",
            "diagnostics",
            "black_box",
            "recording",
            "traffic_lights",
            "turn_signal",
        ],
    ),
    (FileKind::Profile, &["bus", "turn", "hazard", "message", "v2i"]),
    (FileKind::Drive, &["drive", "route", "expect", "manoeuvre", "disturbance", "planning_hz"]),
    (FileKind::Scenario, &["groups", "controller", "event", "stop_at_s", "stop_when", "pedestrian_groups"]),
    (FileKind::Country, &["roundabout", "traffic", "turn_distance_m", "search_time_s"]),
];

impl FileKind {
    /// Returns the kind of a file with this content; `None` if it is not recognised.
    pub fn of(content: &[u8]) -> Option<Self> {
        Self::candidates(content).into_iter().next()
    }

    /// Returns the possible kinds of a file with this content; several only for a TOML file with keys of
    /// several kinds.
    fn candidates(content: &[u8]) -> Vec<Self> {
        let head = content.get(..HEAD).unwrap_or(content);
        let text = String::from_utf8_lossy(head);
        let text = text.trim_start_matches('\u{FEFF}');
        if let Some(kind) = of_xml(text).or_else(|| of_lines(text)) {
            return vec![kind];
        }
        let kinds = of_toml(content);
        if !kinds.is_empty() {
            return kinds;
        }
        if is_recording(head) {
            return vec![Self::Recording];
        }
        known_magic(head).map(Self::Other).into_iter().collect()
    }

    /// Reads the text of a file of this kind; `missing` is the remedy if the file does not exist.
    ///
    /// # Errors
    /// Fails if the file cannot be read, is of another kind, is too large, or is not UTF-8.
    pub(super) fn read(self, files: &dyn Files, path: &Path, missing: &str) -> Result<Text, Problem> {
        let bytes = files.read(path);
        if let Ok(bytes) = &bytes {
            self.expect(path, bytes)?;
        }
        Text::read(path, bytes, missing)
    }

    /// Refuses the file at `path` if its content is of another kind.
    ///
    /// # Errors
    /// Returns its actual kind, and where a file of that kind belongs.
    pub(super) fn expect(self, path: &Path, content: &[u8]) -> Result<(), Problem> {
        let Some(Refusal { reason, remedy }) = self.mismatch(content) else { return Ok(()) };
        // The first line shows the kind.
        let position = str::from_utf8(content).is_ok().then_some(Position::START);
        Err(Problem { position, ..Problem::whole_file(path, reason, remedy) })
    }

    /// Returns the refusal of content of another kind; `None` if the kind is right or not recognised.
    pub fn mismatch(self, content: &[u8]) -> Option<Refusal> {
        let candidates = Self::candidates(content);
        let found = candidates.first().filter(|_| !candidates.contains(&self))?;
        let ((found, place), (expected, _)) = (found.texts(), self.texts());
        Some(Refusal::new(format!("this is {found}, not {expected}"), place))
    }

    /// Returns the name of the kind in texts, and where such a file belongs, as advice.
    fn texts(self) -> (&'static str, &'static str) {
        match self {
            Self::Gateway => ("a gateway configuration", "give it with --config"),
            Self::Profile => (
                "a vehicle profile",
                "give it with --profile, or name it in a gateway configuration: profile = \"…\"",
            ),
            Self::Drive => ("a drive of the turn signal decider", "run it with `signal-gateway decide`"),
            Self::Scenario => ("a scenario of traffic lights", "run it with `signal-gateway lights`"),
            Self::Country => {
                ("a file of a country's rules", "name it in [turn_signal]: country = \"….toml\"")
            }
            Self::Map => (
                "a map",
                "check it with `signal-gateway check`; drives and configurations name it with the key map",
            ),
            Self::Dbc => (
                "a DBC file",
                "a vehicle profile names it: [bus.<name>] dbc = \"….dbc\"; `signal-gateway profiles show demo_vehicle` \
                 prints an example",
            ),
            Self::Arxml => (
                "an AUTOSAR description (ARXML)",
                "a vehicle profile names it: [bus.<name>] dbc = \"….arxml\"",
            ),
            Self::Recording => (
                "a recording of CAN frames",
                "give it as the LOG of `signal-gateway check`, `identify`, `decode` or `replay`",
            ),
            Self::Other(looks) => (looks.name, looks.remedy),
        }
    }
}

/// Returns the kind of an XML file by the name of its root.
fn of_xml(text: &str) -> Option<FileKind> {
    if !text.trim_start().starts_with('<') {
        return None;
    }
    let root = text.split('<').skip(1).find(|tag| !tag.starts_with(['?', '!']))?;
    match root.split(|char: char| char.is_whitespace() || char == '>' || char == '/').next()? {
        "osm" => Some(FileKind::Map),
        "OpenSCENARIO" => Some(FileKind::Scenario),
        "AUTOSAR" => Some(FileKind::Arxml),
        "NetworkDefinition" => Some(FileKind::Other(KCD)),
        "fx:FIBEX" | "FIBEX" => Some(FileKind::Other(FIBEX)),
        _ => None,
    }
}

/// Returns the kind of a file with a line of a DBC or another message database, or of a scenario in YAML.
fn of_lines(text: &str) -> Option<FileKind> {
    let begins = |marks: &[&str]| text.lines().any(|line| marks.iter().any(|mark| line.starts_with(mark)));
    if text.trim_start().starts_with("VERSION \"") || begins(&["BO_ ", "BU_:", "NS_ :", "BS_:"]) {
        Some(FileKind::Dbc)
    } else if begins(&["OpenSCENARIO:", "ScenarioModifiers:"]) {
        Some(FileKind::Scenario)
    } else if begins(&["FormatVersion="]) {
        Some(FileKind::Other(SYM))
    } else if begins(&["[DATABASE_VERSION]"]) {
        Some(FileKind::Other(DBF))
    } else {
        None
    }
}

/// Returns the kinds whose top-level keys a TOML file has, the kind with the most keys first. The file need
/// not be valid.
fn of_toml(content: &[u8]) -> Vec<FileKind> {
    let Ok(text) = str::from_utf8(content) else { return Vec::new() };
    let mut keys = Vec::new();
    let mut is_top = true;
    for line in text.lines().map(str::trim_start) {
        let name = if let Some(header) = line.strip_prefix('[') {
            is_top = false;
            header.trim_start_matches('[')
        } else if is_top && line.contains('=') {
            line
        } else {
            continue;
        };
        let end = name.find(|char: char| !char.is_ascii_alphanumeric() && char != '_').unwrap_or(name.len());
        keys.push(&name[..end]);
    }
    let count = |known: &[&str]| known.iter().filter(|known| keys.contains(known)).count();
    let mut kinds: Vec<_> = TOP_KEYS.iter().map(|(kind, known)| (count(known), *kind)).collect();
    kinds.retain(|(count, _)| *count > 0);
    kinds.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
    kinds.into_iter().map(|(_, kind)| kind).collect()
}

/// Returns true for the beginning of a recording: binary, or with a frame in it.
fn is_recording(head: &[u8]) -> bool {
    match Log::new(Box::new(io::Cursor::new(head.to_vec()))) {
        Ok(mut log) => begins_like_binary(head) || matches!(log.next_record(), Ok(Some(_))),
        // A binary file whose beginning is not sufficient.
        Err(error) => begins_like_binary(head) && error.kind() == io::ErrorKind::UnexpectedEof,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::built_in::BuiltIn;
    use crate::config::files::{Disk, Files};

    #[test]
    fn every_built_in_file_is_recognised() {
        for (kind, expected) in [
            (BuiltIn::Profile, FileKind::Profile),
            (BuiltIn::Drive, FileKind::Drive),
            (BuiltIn::Scenario, FileKind::Scenario),
            (BuiltIn::Map, FileKind::Map),
        ] {
            for name in kind.names() {
                let content = Disk.read(&kind.path(name).unwrap()).unwrap();
                assert_eq!(FileKind::of(&content), Some(expected), "{name}");
                assert_eq!(expected.mismatch(&content), None, "{name}");
            }
        }
    }

    #[test]
    fn files_are_recognised_by_their_content() {
        let gateway = include_bytes!("../../../config/gateway.toml");
        let rules = include_bytes!("../../../config/countries/JP.toml");
        let dbc = include_bytes!("../../../dbc/demo_vehicle.dbc");
        let log = include_bytes!("../../../config/demo.log.gz");
        for (content, expected) in [
            (&gateway[..], Some(FileKind::Gateway)),
            (rules, Some(FileKind::Country)),
            (dbc, Some(FileKind::Dbc)),
            (log, Some(FileKind::Recording)),
            (b"BO_ 1 M: 8 X\n", Some(FileKind::Dbc)),
            (b"\xEF\xBB\xBF(1.0) can0 123#\n", Some(FileKind::Recording)),
            (b"; nothing\n", None),
            (b"MDF     4.10", Some(FileKind::Recording)),
            (b"OpenSCENARIO:\n  a: 1\n", Some(FileKind::Scenario)),
            (b"\x89PNG\r\n", Some(FileKind::Other(Looks { name: "a picture (PNG)", remedy: "" }))),
            (b"<html><body>", Some(FileKind::Other(Looks { name: "a web page", remedy: "" }))),
            (b"<?xml version='1.0'?>\n<AUTOSAR xmlns=\"x\">", Some(FileKind::Arxml)),
            (b"<NetworkDefinition xmlns='x'/>", Some(FileKind::Other(KCD))),
            (b"<fx:FIBEX>", Some(FileKind::Other(FIBEX))),
            (b"FormatVersion=6.0 // Do not edit this line!\n", Some(FileKind::Other(SYM))),
            (b"//***BUSMASTER\n\n[DATABASE_VERSION] 1.3\n", Some(FileKind::Other(DBF))),
            (b"name = \"x\"\n", None),
            (b"", None),
        ] {
            assert_eq!(FileKind::of(content), expected, "{}", String::from_utf8_lossy(content));
        }
    }

    #[test]
    fn a_file_with_a_key_of_the_expected_kind_is_not_taken_for_another() {
        let mixed = b"profile = \"x\"\n[can.a]\n[ros]\n[turn]\n";
        assert_eq!(FileKind::Profile.mismatch(mixed), None);
        let reason = "this is a gateway configuration, not a drive of the turn signal decider";
        assert_eq!(FileKind::Drive.mismatch(mixed), Some(Refusal::new(reason, "give it with --config")));
    }
}
