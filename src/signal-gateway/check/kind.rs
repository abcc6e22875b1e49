//! The kinds of findings, each with its meaning and remedy: the rows behind text, JSON, schema and document.

use schemars::JsonSchema;
use serde::Serialize;

/// A kind of finding. Names do not change between versions; new kinds may be added.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)] // `KindRow` describes each
pub enum CheckKind {
    HazardNotVisible,
    OppositeSide,
    ServiceCannotRead,
    MapTag,
    MissingDimension,
    Advice,
    NoFrame,
    ForeignInterface,
    NothingBound,
    WrongProfile,
    UnmetRequirement,
    OtherPlatform,
    RecordingFault,
    ErrorFrames,
    MessageNotReceived,
    UnusedAlternative,
    MessageMissing,
    BusSilent,
    SeveralSenders,
    WrongLength,
    WrongPeriod,
    IntegrityRejected,
    UnusedIntegrity,
    UndefinedValue,
    ImplausibleStates,
    StateNotShown,
    ColdStart,
    ReportWithheld,
    MotionContradiction,
    DimensionShown,
}

/// What is known of a kind of finding.
#[derive(Debug)]
pub struct KindRow {
    /// The kind.
    pub kind: CheckKind,
    /// Its possible severities, the usual one first.
    pub severity: &'static str,
    /// The condition, as a sentence.
    pub meaning: &'static str,
    /// Remedy for a warning or an error, as a clause; empty for a kind that is only ever a note.
    pub remedy: &'static str,
}

const fn row(
    kind: CheckKind,
    severity: &'static str,
    meaning: &'static str,
    remedy: &'static str,
) -> KindRow {
    KindRow { kind, severity, meaning, remedy }
}

/// All kinds, in the order of the document: configuration, recording, messages, values, reports, motion.
#[rustfmt::skip]
pub const KINDS: [KindRow; 30] = [
    row(CheckKind::HazardNotVisible, "warning", "The profile shows no hazard lights.",
        "accept it with [reports] hazard_not_visible = \"acknowledged\""),
    row(CheckKind::OppositeSide, "warning", "Profile and DBC name opposite sides.",
        "exchange left and right in the profile, or correct the DBC"),
    row(CheckKind::ServiceCannotRead, "warning", "The packaged service cannot read a file of the configuration.",
        "put it where the service can read it, e.g. into /etc/signal-gateway"),
    row(CheckKind::MapTag, "warning, note", "A tag of the map contradicts the geometry, or is missing.",
        "correct the tag in the map"),
    row(CheckKind::MissingDimension, "warning, note", "A dimension of the car is missing. A note without a recording, or if another source serves the report.",
        "write it into [vehicle_geometry]"),
    row(CheckKind::Advice, "note", "Advice on a valid configuration.", ""),
    row(CheckKind::NoFrame, "error", "The recording has no frame.", "give a recording of the vehicle's bus"),
    row(CheckKind::ForeignInterface, "error", "No frame is from a configured interface.", "use --map INTERFACE=BUS"),
    row(CheckKind::NothingBound, "warning", "The configuration binds no message.", "name a vehicle profile in the configuration"),
    row(CheckKind::WrongProfile, "error", "No message of the profile was received.",
        "use the profile of this vehicle: `signal-gateway identify LOG` finds it"),
    row(CheckKind::UnmetRequirement, "warning, error", "The recording lacks or contradicts what the profile requires of its vehicle.",
        "use the profile of this variant: `signal-gateway identify LOG` finds it"),
    row(CheckKind::OtherPlatform, "warning", "The identifiers on the bus belong to another platform.",
        "use the profile of this vehicle: `signal-gateway identify LOG` finds it"),
    row(CheckKind::RecordingFault, "warning", "Parts of the recording cannot be read, or its stamps are implausible.",
        "record the drive again, since the recording cannot be trusted there"),
    row(CheckKind::ErrorFrames, "warning", "The recording has error frames.",
        "check bit rate, wiring and the terminators of 120 ohm; `signal-gateway doctor` helps"),
    row(CheckKind::MessageNotReceived, "warning", "A message was not received, and a report lacks it.",
        "check the bus with --map, and the profile for this variant; remove the source if the vehicle does not have it"),
    row(CheckKind::UnusedAlternative, "note", "A message was not received, and each of its reports has another source.", ""),
    row(CheckKind::MessageMissing, "warning", "A message was missing for longer than its timeout while others arrived.",
        "give its usual pace with timeout_ms of its [message.NAME]; otherwise find out why the vehicle or the recorder lost it"),
    row(CheckKind::BusSilent, "warning", "The whole bus was silent for longer than a timeout.",
        "record without gaps: the recorder lost frames, or the bus was asleep"),
    row(CheckKind::SeveralSenders, "warning", "A J1939 message comes from several senders.",
        "choose one with source_addresses of its [message.NAME]"),
    row(CheckKind::WrongLength, "error, warning", "Frames have another length than in the DBC.",
        "use a DBC of this model year"),
    row(CheckKind::WrongPeriod, "warning, note", "A message is sent less or more often than described. More often is a note.",
        "give its pace with timeout_ms of its [message.NAME], which --fix prints"),
    row(CheckKind::IntegrityRejected, "warning, error", "Counter or checksum fail. An error if most frames fail.",
        "correct the integrity keys of its [message.NAME]; a few frames may be lost or damaged by the recorder"),
    row(CheckKind::UnusedIntegrity, "warning", "A counter or checksum of the DBC holds, and the profile does not check it.",
        "add the line that --fix prints to the profile"),
    row(CheckKind::UndefinedValue, "warning, error, note", "A value that the profile does not name. Seen once, it is a note.",
        "name the value in the profile: as a state, not_available or fault"),
    row(CheckKind::ImplausibleStates, "warning, error", "Indicators change as no driver would, are on throughout, or show no value that the profile names.",
        "check the signal's bits and its kind in the profile; record off, left, right and hazard"),
    row(CheckKind::StateNotShown, "note", "The recording does not show left, right or hazard.", ""),
    row(CheckKind::ColdStart, "note", "Reports were withheld until their first values arrived, for at most 10 s.", ""),
    row(CheckKind::ReportWithheld, "warning", "A report was withheld after its first value, for longer than at a cold start, or throughout.",
        "see the findings and values above"),
    row(CheckKind::MotionContradiction, "warning", "Signs, dimensions or scales differ from what the drive shows.",
        "correct the key in the profile, or in [vehicle_geometry]"),
    row(CheckKind::DimensionShown, "note", "The drive shows a dimension that the configuration lacks.", ""),
];

impl CheckKind {
    /// Returns the remedy for a warning or an error of this kind.
    pub fn remedy(self) -> &'static str {
        KINDS.iter().find(|row| row.kind == self).map_or("", |row| row.remedy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_has_a_row_and_every_warning_a_remedy() {
        let mut kinds: Vec<_> = KINDS.iter().map(|row| row.kind).collect();
        kinds.sort_unstable();
        kinds.dedup();
        assert_eq!(kinds.len(), CheckKind::DimensionShown as usize + 1);
        for row in &KINDS {
            assert_eq!(row.remedy.is_empty(), row.severity == "note", "{:?}", row.kind);
        }
    }
}
