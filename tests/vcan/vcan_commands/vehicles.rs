//! The shipped vehicles that take commands: their files, and their command frames read by hand, bit by bit
//! from what is published of them.

use std::path::Path;

use crate::support::process::Folder;

/// A shipped vehicle. Identifiers have bit 31 for 29-bit ones, as in a DBC.
pub(crate) struct Vehicle {
    /// Name of profile and DBC.
    pub(crate) name: &'static str,
    /// The bus of its profile.
    pub(crate) bus: &'static str,
    /// The command message.
    pub(crate) command: u32,
    /// The report message.
    pub(crate) report: u32,
    /// The request of a frame of the command message: `none`, `off`, `left`, `right` or `hazard`, and
    /// `left, any` and so on where the hazard lights are left to the vehicle.
    pub(crate) request: fn(&[u8]) -> &'static str,
    /// Its counter.
    pub(crate) counter: Option<fn(&[u8]) -> u8>,
    /// The text for a frame that requests nothing.
    pub(crate) nothing: &'static str,
}

pub(crate) const PACMOD: Vehicle = Vehicle {
    name: "pacmod",
    bus: "pacmod",
    command: 0x130,
    report: 0x230,
    request: |data| match *data {
        [0, 1] => "none",
        [1, 0] => "right",
        [1, 1] => "off",
        [1, 2] => "left",
        [1, 3] => "hazard",
        _ => "undefined",
    },
    counter: None,
    nothing: "none",
};

pub(crate) const NEW_EAGLE: Vehicle = Vehicle {
    name: "new_eagle_dbw",
    bus: "dbw",
    command: 0x2F06 | 1 << 31,
    report: 0x1F14 | 1 << 31,
    request: |data| match *data {
        [0x00, 0, 0, 0, 0, 0, 0..=15, _] => "off",
        [0x10, 0, 0, 0, 0, 0, 0..=15, _] => "left",
        [0x20, 0, 0, 0, 0, 0, 0..=15, _] => "right",
        [0x30, 0, 0, 0, 0, 0, 0..=15, _] => "hazard",
        _ => "undefined",
    },
    counter: Some(|data| data[6] & 15),
    // No request and off are one value.
    nothing: "off",
};

pub(crate) const TESLA: Vehicle = Vehicle {
    name: "tesla_model3",
    bus: "vehicle",
    command: 0x3E9,
    report: 0x3F5,
    request: |data| match *data {
        [0xFF, 0x0C, 0, 0, 0, 0, _, _] => "none",
        [0xFF, 0x0D, 0, 0, 0, 0, _, _] => "left, any",
        [0xF3, 0x0C, 0, 0, 0, 0, _, _] => "off",
        [0xF3, 0x0D, 0, 0, 0, 0, _, _] => "left",
        [0xF3, 0x0E, 0, 0, 0, 0, _, _] => "right",
        [0xF7, 0x0C, 0, 0, 0, 0, _, _] => "hazard",
        _ => "undefined",
    },
    counter: Some(|data| data[6] >> 4),
    nothing: "none",
};

/// Frames are sent, and all inputs are valid for as long as a slow machine may need.
pub(crate) const PATIENT: &str = "[command]\ntx = \"on\"\nturn_timeout_ms = 20000\n\
    hazard_timeout_ms = 20000\ncontrol_mode_timeout_ms = 20000\n";

impl Vehicle {
    /// A configuration folder: copies of profile and DBC, changed, and `gateway.toml` with `[command]`. The
    /// vehicle itself has the profile `car.toml`, with the shipped periods.
    pub(crate) fn folder(&self, interface: &str, keys: &str, change: &Change) -> Folder {
        let shipped = Path::new(env!("CARGO_MANIFEST_DIR"));
        let read = |path: &str| std::fs::read_to_string(shipped.join(path)).unwrap();
        let (profile, dbc) =
            (read(&format!("config/vehicles/{}.toml", self.name)), read(&format!("dbc/{}.dbc", self.name)));
        let folder = Folder::with_configuration(&format!(
            "profile = \"profile.toml\"\n[can.{}]\ninterface = \"{interface}\"\n{keys}",
            self.bus
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

    /// The requests of the frames, one for each run of equal requests.
    pub(crate) fn runs<'a>(
        &self,
        frames: impl IntoIterator<Item = &'a super::recording::RecordedFrame>,
    ) -> Vec<&'static str> {
        let mut runs: Vec<_> = frames.into_iter().map(|frame| (self.request)(&frame.data)).collect();
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
