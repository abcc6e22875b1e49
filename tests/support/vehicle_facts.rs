//! What the tests know of each shipped vehicle: `tests/vehicles/NAME.toml`, one file for each profile. A key
//! that is not described here is refused.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::LazyLock;

use serde::Deserialize;

use super::rows::rows;

/// The facts about every vehicle, by the name of its profile.
pub(crate) static VEHICLES: LazyLock<BTreeMap<String, VehicleFacts>> = LazyLock::new(|| {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/vehicles");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let read = files.map(|path| {
        let text = std::fs::read_to_string(&path).unwrap();
        let facts = toml::from_str(&text).unwrap_or_else(|refused| panic!("{}: {refused}", path.display()));
        (path.file_stem().unwrap().to_string_lossy().into_owned(), facts)
    });
    read.collect()
});

/// One vehicle.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct VehicleFacts {
    pub(crate) dbc: DbcOrigin,
    /// Frames, separated by `;`, and the outcome of turn and hazard report. A frame is written as
    /// `payload::frame` reads it, `614 8 29|2@0=3`; `9*` in front sends it nine times, 50 ms apart. An
    /// outcome is the constant's name, `unknown`, `invalid RAW`, `fault`, or a constant and `+fault` or
    /// `+fallback`.
    #[serde(default, deserialize_with = "rows")]
    pub(crate) reports: Vec<[String; 3]>,
    /// Frames like those of `reports`, sent twice, and reports on the status that follow, separated by `;`:
    /// `velocity` in m/s, `heading` in rad/s, `steering` in degrees of the steering wheel, `gear`,
    /// `control_mode`, or `doors` with the state of each; `-` if nothing is published. The wheels have a
    /// radius of 0.3 m. Counters and checksums are filled in.
    #[serde(default, deserialize_with = "rows")]
    pub(crate) status: Vec<[String; 2]>,
    pub(crate) labelled: Option<LabelledFrames>,
    pub(crate) protection: Option<ProtectionFacts>,
    pub(crate) command: Option<CommandFacts>,
    /// Empty for a vehicle that opendbc does not have.
    pub(crate) opendbc: Vec<Counterpart>,
    #[serde(default)]
    pub(crate) recording: Vec<Recording>,
    /// Number of a state in the message of a V2X unit, and its bulbs; empty where it has none.
    #[serde(default, deserialize_with = "rows")]
    pub(crate) v2i_states: Vec<[String; 2]>,
    #[serde(default)]
    pub(crate) v2i: Vec<V2iDrive>,
    /// Changes that the demo shows: second, topic or diagnostic task, and its value from then on; within 50
    /// ms.
    #[serde(default)]
    pub(crate) demo: Vec<String>,
}

/// What the DBC of a vehicle was written from.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum DbcOrigin {
    /// A public file among the shared data.
    Twin(Twin),
    /// A file of opendbc, which packs the vehicle's frames in `pure::vehicles::opendbc`.
    Opendbc,
    /// Nothing public: invented, written from a standard, or from labelled frames.
    Own,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Twin {
    pub(crate) file: String,
    /// Our signals that differ from it on purpose.
    #[serde(default)]
    pub(crate) differing: Vec<String>,
    /// What a reader finds in it.
    pub(crate) size: DbcSize,
    /// Number of a message in the file, and layouts of its signals of the turn and hazard state.
    #[serde(deserialize_with = "rows")]
    pub(crate) turn_signals: Vec<[String; 2]>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct DbcSize {
    pub(crate) messages: usize,
    pub(crate) signals: usize,
    /// Statements that are malformed.
    pub(crate) rejected: usize,
}

/// Frames of a real vehicle that somebody has labelled.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LabelledFrames {
    /// A file among the shared data.
    pub(crate) file: String,
    pub(crate) id: String,
    /// Label, and the outcome of turn and hazard report.
    #[serde(deserialize_with = "rows")]
    pub(crate) frames: Vec<[String; 3]>,
}

/// Counters and checksums.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ProtectionFacts {
    pub(crate) messages: Vec<ProtectedMessage>,
    /// A frame of the first message that shows left; or else one with dark lamps, known only after an
    /// observation time.
    pub(crate) left: Option<String>,
    pub(crate) dark: Option<String>,
    /// Bits that the checksum covers from the first on, itself included; all if it is left out.
    pub(crate) covered_bits: Option<usize>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ProtectedMessage {
    pub(crate) id: String,
    /// `start|length@order`, as in a DBC.
    pub(crate) counter: String,
    pub(crate) checksum: Option<ChecksumKind>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum ChecksumKind {
    Honda,
    Psa,
    Mazda,
    /// Identifier and bytes in a sum, in the first byte.
    Sum,
}

/// The one message that commands the lights.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CommandFacts {
    /// The only bus of the profile.
    pub(crate) bus: String,
    /// Identifiers of the command and of the report that shows its effect.
    pub(crate) message: String,
    pub(crate) report: String,
    /// `start|length@order`, as in a DBC.
    pub(crate) counter: Option<String>,
    /// Rule and place of the checksum; given with a counter only.
    pub(crate) checksum: Option<CommandChecksum>,
    /// Requests to the turn indicators and to the hazard lights, `-` for none; the frame, where `x` is a
    /// digit of counter or checksum; and a name, `left, any` where the hazard lights are left to the vehicle.
    #[serde(deserialize_with = "rows")]
    pub(crate) requests: Vec<[String; 4]>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum CommandChecksum {
    /// In the last of eight bytes.
    J1850,
    /// Sum of the identifier's bytes and the data, in the last of eight bytes.
    Sum,
    /// Of 32 bytes, in the first two.
    HyundaiFd,
}

/// Frames of a V2X unit, and what comes of them.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct V2iDrive {
    pub(crate) name: String,
    /// A frame that is sent twice before the steps, after a good state of the radio; the first one proves
    /// nothing.
    pub(crate) start: Option<String>,
    /// Each is `MS WHAT -> RESULT`, or has `FIRST-LAST/PERIOD` instead of one time. WHAT is a frame or
    /// `settle`, whose result is the changes of the states (`-ID` for a removal); `deadline`, the next one in
    /// nanoseconds; or `finding ID`, `status` or a key of the status, each with its text.
    pub(crate) steps: Vec<String>,
}

/// Cars of opendbc that send the same message as the vehicle, and must all agree with each other.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Counterpart {
    /// The file that frames are packed with, and the platform whose car state reads them; without one where
    /// opendbc has the file alone.
    pub(crate) cars: Vec<String>,
    pub(crate) message: String,
    /// True if opendbc knows counter and checksum of the message, where the profile checks them; else the
    /// test fills them in.
    #[serde(default = "yes")]
    pub(crate) packs_protection: bool,
    /// Signals with their physical values, as `MESSAGE.SIGNAL=VALUE`, and the part of the status that both
    /// must read alike from them: `speed` without its sign, `yaw_rate`, `steering`, `gear` or `doors`. Values
    /// after a `~` are swept from 0 to a multiple. The first car reads them.
    #[serde(default, deserialize_with = "rows")]
    pub(crate) status: Vec<[String; 2]>,
    /// Another vehicle, whose states are tried.
    states_of: Option<String>,
    #[serde(default)]
    states: Vec<State>,
}

/// A state that is tried. One that begins with `tap` lasts for 0.3 s, and is read 1 s after its start.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct State {
    pub(crate) name: String,
    /// Each as `SIGNAL=VALUE`, or `SIGNAL~VALUE` if it flashes, with `MESSAGE.` in front when not of the
    /// first message, `MESSAGE.` alone for one that is only sent.
    #[serde(default)]
    pub(crate) signals: String,
    /// How the two readings differ, if they do.
    pub(crate) difference: Option<String>,
}

/// A public recording of the vehicle, and what must come out of it as far as it is known. A change is a text
/// that begins with its second, `8.461 DISABLE`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Recording {
    /// Its file among the shared data.
    pub(crate) file: String,
    /// Where it was published, and the name that it has there.
    pub(crate) public: String,
    /// Other profiles that bind the same bits of the same message.
    #[serde(default)]
    pub(crate) also_fits: Vec<String>,
    /// The interface of the vehicle's only bus, where the recording has several.
    pub(crate) interface: Option<String>,
    /// By topic or diagnostic task: the reports, `stops` when one is no longer published, and the statuses
    /// with their levels.
    #[serde(default)]
    pub(crate) changes: BTreeMap<String, Vec<String>>,
    /// Keys of the last status by task.
    #[serde(default)]
    pub(crate) values: BTreeMap<String, BTreeMap<String, String>>,
    pub(crate) length_ms: Option<u64>,
    /// Frames of the protected message that were checked.
    pub(crate) integrity: Option<IntegrityFacts>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct IntegrityFacts {
    pub(crate) initial: u64,
    pub(crate) trusted: u64,
}

impl Counterpart {
    /// Returns the states to try, which are never none.
    pub(crate) fn states(&'static self) -> &'static [State] {
        let borrowed = self.states_of.as_ref().map(|other| &VEHICLES[other].opendbc[0].states);
        let states = borrowed.unwrap_or(&self.states);
        let is_given_once = self.states.is_empty() == self.states_of.is_some();
        assert!(
            is_given_once && !states.is_empty(),
            "{self:?} needs `states`, or `states_of` a vehicle that has them"
        );
        states
    }
}

impl Recording {
    /// Whether anything is known that must come out of it.
    pub(crate) fn is_judged(&self) -> bool {
        let is_silent = self.changes.is_empty() && self.values.is_empty();
        !is_silent || self.length_ms.is_some() || self.integrity.is_some()
    }
}

fn yes() -> bool {
    true
}
