//! The shipped vehicles that take commands: their files, and their command frames read by their facts, which
//! are from what is published of them.

use std::path::Path;

use super::recording::{BusTime, RecordedFrame, Recording};
use crate::support::peer::domain;
use crate::support::process::{self, Folder};
use crate::support::vehicle_facts::{CommandFacts, VEHICLES};

/// A shipped vehicle, by the name of profile and DBC.
pub(crate) struct Vehicle {
    pub(crate) name: &'static str,
}

pub(crate) const PACMOD: Vehicle = Vehicle { name: "pacmod" };
pub(crate) const NEW_EAGLE: Vehicle = Vehicle { name: "new_eagle_dbw" };
pub(crate) const TESLA: Vehicle = Vehicle { name: "tesla_model3" };
pub(crate) const HYUNDAI: Vehicle = Vehicle { name: "hyundai_canfd" };

/// An identifier with bit 31 if it has 29 bits, as in a DBC.
fn dbc_number(id: &str) -> u32 {
    u32::from_str_radix(id, 16).unwrap() | u32::from(id.len() > 3) << 31
}

/// Frames are sent, and all inputs are valid for as long as a slow machine may need.
pub(crate) const PATIENT: &str = "[command]\ntx = \"on\"\nturn_timeout_ms = 20000\n\
    hazard_timeout_ms = 20000\ncontrol_mode_timeout_ms = 20000\n";

impl Vehicle {
    fn facts(&self) -> &'static CommandFacts {
        VEHICLES[self.name].command.as_ref().unwrap()
    }

    /// The command message.
    pub(crate) fn command(&self) -> u32 {
        dbc_number(&self.facts().message)
    }

    /// The report message.
    pub(crate) fn report(&self) -> u32 {
        dbc_number(&self.facts().report)
    }

    /// The request of a frame of the command message, by its name in the facts.
    pub(crate) fn request(&self, data: &[u8]) -> &'static str {
        let digits = data.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ");
        let fits = |frame: &str| {
            let is_digit = |(expected, digit): (char, char)| expected == 'x' || expected == digit;
            frame.len() == digits.len() && frame.chars().zip(digits.chars()).all(is_digit)
        };
        let row = self.facts().requests.iter().find(|[_, _, frame, _]| fits(frame));
        row.map_or("undefined", |[.., name]| name)
    }

    /// The name of a request of nothing.
    pub(crate) fn nothing(&self) -> &'static str {
        let is_nothing = |[turn, hazard, ..]: &&[String; 4]| turn == "-" && hazard == "-";
        &self.facts().requests.iter().find(is_nothing).unwrap()[3]
    }

    /// Its counter, where it has four bits.
    pub(crate) fn counter(&self, data: &[u8]) -> Option<u8> {
        let (start, _) = self.facts().counter.as_ref()?.split_once('|')?;
        let start: usize = start.parse().unwrap();
        Some(data[start / 8] >> (start % 8) & 15)
    }

    /// A configuration folder: copies of profile and DBC, changed, and `gateway.toml` with `[command]`, which
    /// consents to send. The vehicle itself has the profile `car.toml`, with the shipped periods.
    pub(crate) fn folder(&self, interface: &str, keys: &str, change: &Change) -> Folder {
        let shipped = Path::new(env!("CARGO_MANIFEST_DIR"));
        let read = |path: &str| std::fs::read_to_string(shipped.join(path)).unwrap();
        let (profile, dbc) =
            (read(&format!("config/vehicles/{}.toml", self.name)), read(&format!("dbc/{}.dbc", self.name)));
        let name = profile.lines().find_map(|line| line.strip_prefix("name = ")).unwrap();
        let keys = keys.replace("[command]\n", &format!("[command]\nconsent = {name}\n"));
        // The mode is read from the topic, which another node publishes.
        let keys = keys.replace("[ros]\n", "[ros]\ntopics.control_mode_status = \"\"\n");
        let folder = Folder::with_configuration(&format!(
            "profile = \"profile.toml\"\n[can.{}]\ninterface = \"{interface}\"\n{keys}",
            self.facts().bus
        ));
        let dbc_path = format!("../../dbc/{}.dbc", self.name);
        let mut profile = profile.replace(&dbc_path, "vehicle.dbc");
        for (from, to) in change.profile {
            assert!(profile.contains(from), "{} has no {from:?}", self.name);
            profile = profile.replacen(from, to, 1);
        }
        folder.write("car.toml", &(profile.clone() + change.profile_end));
        // A pause of a slow machine is not a silence of the vehicle.
        let patient = profile.lines().map(|line| match line.strip_prefix("timeout_ms") {
            Some(_) => "timeout_ms = 10000\n".to_owned(),
            None => format!("{line}\n"),
        });
        folder.write("profile.toml", &(patient.collect::<String>() + change.profile_end));
        folder.write("vehicle.dbc", &(dbc + change.dbc_end));
        folder
    }

    /// [`folder`](Self::folder) with [`PATIENT`] keys, in a domain that no other test uses.
    pub(crate) fn patient_folder(&self, interface: &str, change: &Change) -> (Folder, u16) {
        let domain = domain();
        (self.folder(interface, &format!("{PATIENT}{}", process::ros_in(domain)), change), domain)
    }

    /// Waits until the newest frame since `mark` requests this.
    pub(crate) fn wait_for(&self, recording: &Recording, mark: BusTime, request: &str) {
        recording.wait(mark, self.command(), request, |frames| {
            frames.last().is_some_and(|frame| self.request(&frame.data) == request)
        });
    }

    /// Asserts that the counter of the frames begins at 0 and has no gap.
    pub(crate) fn assert_counted<'a>(&self, frames: impl ExactSizeIterator<Item = &'a [u8]>) {
        let all = frames.len();
        for (index, data) in frames.enumerate() {
            assert_eq!(usize::from(self.counter(data).unwrap()), index % 16, "frame {index} of {all}");
        }
    }

    /// The requests of the frames, one for each run of equal requests.
    pub(crate) fn runs<'a>(&self, frames: impl IntoIterator<Item = &'a RecordedFrame>) -> Vec<&'static str> {
        let mut runs: Vec<_> = frames.into_iter().map(|frame| self.request(&frame.data)).collect();
        runs.dedup();
        runs
    }
}

/// What a test changes about the shipped files.
pub(crate) struct Change {
    /// In the profile, each once.
    pub(crate) profile: &'static [(&'static str, &'static str)],
    pub(crate) profile_end: &'static str,
    pub(crate) dbc_end: &'static str,
}

impl Change {
    /// As shipped.
    pub(crate) const NONE: Self = Self { profile: &[], profile_end: "", dbc_end: "" };
}
