//! Every shipped profile on every public recording: which ones `identify` finds, and what `check` says of the
//! right and the wrong ones. `docs/identify.md` has the table, made by `UPDATE_DOCS=1 cargo test --test pure
//! vehicles::recognition`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use can_log::EntryContent;
use can_log::Log;
use can_signal::can::link::BusIndex;
use signal_gateway::check::identify::Identifier;
use signal_gateway::check::{self, CheckReport};
use signal_gateway::replay::{Replay, Routes};
use vehicle_bringup::plausibility::evidence::ProfileEvidence;
use vehicle_bringup::plausibility::finding::{FindingKind, Severity, findings};
use vehicle_bringup::plausibility::fit::FitVerdict;

use crate::pure::vehicles::{profile, profile_names, project};
use crate::support::prerequisite::{require, shared_data};
use crate::support::vehicle_facts::VEHICLES;

/// A public recording.
struct Recording {
    file: &'static str,
    public: &'static str,
    /// The profiles of this vehicle, the best first. Others of the list bind the same bits of the same
    /// message.
    right: Vec<&'static str>,
}

/// All of them, by file: those of the shipped vehicles, and one of a vehicle that no profile is for.
fn recordings() -> Vec<Recording> {
    let (file, public) = ("remora-truck-engine-on.log", "remora_ctrl_proto, big truck, engine on");
    let mut recordings = vec![Recording { file, public, right: Vec::new() }];
    for (name, vehicle) in &*VEHICLES {
        recordings.extend(vehicle.recording.iter().map(|recording| Recording {
            file: &recording.file,
            public: &recording.public,
            right: std::iter::once(name).chain(&recording.also_fits).map(String::as_str).collect(),
        }));
    }
    recordings.sort_by_key(|recording| recording.file);
    recordings
}

/// Name, interface and verdict of each candidate, the best first.
type Candidates = Vec<(&'static str, String, FitVerdict)>;

fn identify(path: &Path) -> Candidates {
    let (mut log, mut identifier) = (Log::open(path).unwrap(), Identifier::new().unwrap());
    while let Some(record) = log.next_record().unwrap() {
        if let EntryContent::Data(frame) = record.content {
            identifier.frame(&log.interfaces()[record.interface.0], &frame, record.stamp);
        }
    }
    let candidates = identifier.candidates().into_iter();
    candidates.map(|found| (found.profile, found.interface.to_owned(), found.fit.verdict)).collect()
}

/// `check` of a profile with one bus on an interface of a recording.
fn check(path: &Path, name: &str, interface: &str) -> CheckReport {
    let settings = profile(name);
    let routes = Routes(vec![(interface.to_owned(), BusIndex(0))]);
    let replay = Replay::surveying(settings.gateway.clone(), Log::open(path).unwrap(), routes).unwrap();
    let (report, outcome) = check::recording(settings, replay);
    outcome.unwrap();
    report
}

fn counts(report: &CheckReport) -> [usize; 3] {
    [Severity::Error, Severity::Warning, Severity::Note].map(|severity| report.count(severity))
}

/// The weights of a report in the table.
fn weights(report: &CheckReport) -> String {
    let [errors, warnings, _] = counts(report);
    match (errors, warnings) {
        (0, 0) => "0".to_owned(),
        (0, warnings) => format!("{warnings} W"),
        (errors, _) => format!("**{errors} E**"),
    }
}

/// What must be so for a recording, and its row of the table.
fn row(folder: &Path, recording: &Recording) -> String {
    let path = folder.join("can-logs").join(recording.file);
    let identified = identify(&path);
    let possible: Vec<_> = identified.iter().filter(|(_, _, verdict)| *verdict > FitVerdict::No).collect();
    match (possible.first(), recording.right.first()) {
        (Some((name, _, FitVerdict::Fits)), Some(right)) => assert_eq!(name, right, "{}", recording.file),
        (None, None) => {}
        (best, right) => panic!("{}: {best:?} instead of {right:?}", recording.file),
    }
    let first_three: Vec<_> = possible
        .iter()
        .take(3)
        .map(
            |(name, _, verdict)| {
                if *verdict == FitVerdict::Fits { format!("**{name}**") } else { (*name).to_owned() }
            },
        )
        .collect();
    let (mut right, mut wrong) = (Vec::new(), [0; 2]);
    for (name, interface, _) in &identified {
        let report = check(&path, name, interface);
        let [errors, warnings, _] = counts(&report);
        if recording.right.contains(name) {
            let text = report.text(check::Layout::default());
            assert_eq!(errors, 0, "{}: {name} is right\n{text}", recording.file);
            right.push(format!("{name}: {}", weights(&report)));
        } else {
            assert!(errors + warnings > 0, "{}: {name} is wrong and passes", recording.file);
            wrong[usize::from(errors == 0)] += 1;
        }
    }
    let list = |items: &[String]| if items.is_empty() { "–".to_owned() } else { items.join("<br>") };
    let first_three = if first_three.is_empty() { "none".to_owned() } else { first_three.join(", ") };
    let [errors, warnings] = wrong;
    format!(
        "| {} | {first_three} | {} | {errors} with errors, {warnings} with warnings |\n",
        recording.public,
        list(&right)
    )
}

/// The table in the document.
fn table_in(text: &str) -> Option<(&str, &str, &str)> {
    let (before, rest) = text.split_once("<!-- recordings -->\n")?;
    let (table, after) = rest.split_once("<!-- end of recordings -->")?;
    Some((before, table, after))
}

#[test]
fn small_recordings_are_identified() {
    let folder = require!(shared_data());
    let is_small = |recording: &&Recording| {
        ["eld-gt350-2reverselog.trc", "icsim-sample-can.log", "remora-truck-engine-on.log"]
            .contains(&recording.file)
    };
    for recording in recordings().iter().filter(is_small) {
        row(&folder, recording);
    }
}

/// So that the table needs the profiles alone of which a message came.
#[test]
fn a_profile_of_which_no_message_came_is_an_error() {
    for name in profile_names() {
        let settings = profile(&name);
        let databases: Vec<_> = settings.dbcs.iter().map(|dbc| &dbc.database).collect();
        let gateway = &settings.gateway;
        let evidence = ProfileEvidence::new(&gateway.lights, &gateway.v2i.table, &databases);
        let findings = findings(&evidence);
        assert!(
            findings.iter().any(|finding| finding.kind == FindingKind::NoMessage),
            "{name}: {findings:?}"
        );
        assert_eq!(findings[0].severity, Severity::Error, "{name}");
    }
}

mod slow {
    use super::*;

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn the_right_profile_is_first_and_no_wrong_one_passes_a_check() {
        let folder = require!(shared_data());
        let mut table =
            "| recording | identify | check, right profile | check, other profiles of which a message came |\n\
             |---|---|---|---|\n"
                .to_owned();
        for recording in &recordings() {
            let _ = write!(table, "{}", row(&folder, recording));
        }
        let path: PathBuf = project().join("docs/identify.md");
        let text = std::fs::read_to_string(&path).unwrap();
        let (before, shown, after) = table_in(&text).expect("docs/identify.md has a place for the table");
        if std::env::var_os("UPDATE_DOCS").is_some() {
            let text = format!("{before}<!-- recordings -->\n{table}<!-- end of recordings -->{after}");
            std::fs::write(&path, text).unwrap();
        } else {
            assert_eq!(shown, table, "renew it: UPDATE_DOCS=1 cargo test --test pure vehicles::recognition");
        }
    }
}
