//! The configuration in effect: the keys read through their rows, the keys of the vehicle profile, and the
//! named files, by content.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use crate::config::built_in::{display, full_path, project_path};
use crate::config::files::Files;
use crate::config::reading::{KeyEffect, RecordedKey, WrittenKey};
use crate::config::ros_names::Remapping;
use crate::process_status::configuration::EffectiveConfiguration;
use gateway_core::gateway::GatewaySettings;
use gateway_core::vehicle_lights::binding::{HazardBinding, TurnBinding};
use gateway_core::vehicle_status::StatusReport;
use gateway_core::vehicle_status::doors::Door;

/// Joins the parts: the `recorded` keys of the gateway's file, and the contents of `files`.
pub(super) fn in_effect(
    recorded: Vec<RecordedKey>,
    files: &DigestedFiles<'_>,
    gateway: &GatewaySettings,
    remappings: &[Remapping],
    profile: Vec<WrittenKey>,
) -> EffectiveConfiguration {
    let mut parts = EffectiveConfiguration::default();
    for RecordedKey { section, row, value } in recorded {
        let part =
            if section.is_empty() { row.name().to_owned() } else { format!("[{section}] {}", row.name()) };
        let parts = match row.effect() {
            KeyEffect::Reload => &mut parts.reloadable,
            KeyEffect::Restart => &mut parts.fixed,
        };
        parts.insert(part, value);
    }
    for (path, digest) in files.digests.borrow().iter() {
        let is_built_in = project_path(path).is_some();
        let path = full_path(path).filter(|_| !is_built_in).unwrap_or_else(|| path.clone());
        parts.reloadable.insert(format!("file {}", display(&path)), format!("#{:016x}", digest.get()));
    }
    for WrittenKey { name, value } in profile {
        // The machine that sends frames to the vehicle never changes while it runs: they carry counters and
        // obey its rules.
        let is_fixed = gateway.command.is_some() && name.contains("[command");
        let parts = if is_fixed { &mut parts.fixed } else { &mut parts.reloadable };
        parts.insert(format!("vehicle profile {name}"), value);
    }
    let mut fix = |part: &str, value: String| parts.fixed.insert(part.to_owned(), value);
    let buses: Vec<_> = gateway.buses.iter().map(|bus| bus.name.as_str()).collect();
    fix("vehicle profile: buses", buses.join(", "));
    let lights = &gateway.lights;
    fix("vehicle profile: has [turn]", (!matches!(lights.turn, TurnBinding::LeftOut)).to_string());
    fix("vehicle profile: has [hazard]", (!matches!(lights.hazard, HazardBinding::LeftOut)).to_string());
    // Their topics, and the layout of the doors, are fixed at the start.
    let reports: Vec<_> = gateway.status.reports().map(StatusReport::name).collect();
    fix("vehicle profile: reports on the status", reports.join(", "));
    let doors: Vec<_> = gateway.status.doors.iter().map(Door::layout_text).collect();
    fix("vehicle profile: doors", doors.join(", "));
    let remappings = remappings.iter().map(|rule| format!("{}:={}", rule.from, rule.to));
    fix("remappings", remappings.collect::<Vec<_>>().join(", "));
    if let Some((_, binding)) = &gateway.command {
        // The DBC is part of it.
        let binding = format!("{binding:?}");
        fix(
            "vehicle profile: command messages",
            format!("#{:016x}", digest(DIGEST_START, binding.as_bytes())),
        );
    }
    parts
}

/// A source of files that computes a digest of everything read.
pub(super) struct DigestedFiles<'f> {
    files: &'f dyn Files,
    digests: RefCell<BTreeMap<PathBuf, Rc<Cell<u64>>>>,
}

impl<'f> DigestedFiles<'f> {
    pub(super) fn new(files: &'f dyn Files) -> Self {
        Self { files, digests: RefCell::default() }
    }

    /// Returns the source without a digest, for files that are compared key by key.
    pub(super) fn plain(&self) -> &'f dyn Files {
        self.files
    }

    fn start(&self, path: &Path) -> Rc<Cell<u64>> {
        let digest = Rc::new(Cell::new(DIGEST_START));
        self.digests.borrow_mut().insert(path.to_owned(), Rc::clone(&digest));
        digest
    }
}

impl Files for DigestedFiles<'_> {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let bytes = self.files.read(path)?;
        self.start(path).set(digest(DIGEST_START, &bytes));
        Ok(bytes)
    }

    fn open(&self, path: &Path) -> io::Result<Box<dyn Read>> {
        let file = self.files.open(path)?;
        Ok(Box::new(DigestedFile { file, digest: self.start(path) }))
    }

    fn is_folder(&self, path: &Path) -> io::Result<bool> {
        self.files.is_folder(path)
    }
}

struct DigestedFile {
    file: Box<dyn Read>,
    digest: Rc<Cell<u64>>,
}

impl Read for DigestedFile {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let length = self.file.read(buffer)?;
        let read = buffer.get(..length).unwrap_or_default();
        self.digest.set(digest(self.digest.get(), read));
        Ok(length)
    }
}

/// Initial value of a digest.
pub(super) const DIGEST_START: u64 = 0xcbf2_9ce4_8422_2325;

/// Continues an FNV-1a digest, which is the same in every process, unlike `Hash`.
pub(super) fn digest(start: u64, bytes: &[u8]) -> u64 {
    const PRIME: u64 = 0x0100_0000_01b3;
    bytes.iter().fold(start, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(PRIME))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::config::files::{DEMO_CONFIG, Embedded, Files};
    use crate::config::{Overrides, load};
    use crate::process_status::configuration::{EffectiveConfiguration, ReloadPlan, changes_text, plan};

    const MAP: &str = "config/maps/crossing/lanelet2_map.osm";

    /// The embedded files, with text appended to the configuration and one text replaced everywhere.
    struct Edited<'a>(&'a str, &'a str, &'a str);

    impl Files for Edited<'_> {
        fn read(&self, path: &Path) -> std::io::Result<Vec<u8>> {
            let mut text = String::from_utf8(Embedded.read(path)?).unwrap();
            if path == Path::new(DEMO_CONFIG) {
                text += self.0;
            }
            Ok(text.replace(self.1, self.2).into_bytes())
        }
    }

    fn effective(more: &str, from: &str, to: &str) -> EffectiveConfiguration {
        load(&Edited(more, from, to), Path::new(DEMO_CONFIG), &Overrides::default()).unwrap().in_effect
    }

    fn difference(more: &str, from: &str, to: &str) -> ReloadPlan {
        plan(&effective(more, "\u{1}", ""), &effective(more, from, to))
    }

    const RESTART: bool = true;
    const RELOAD: bool = false;

    #[test]
    fn a_change_is_shown_by_the_users_key_value_and_unit() {
        let decider = format!("[turn_signal]\nenabled = true\nmap = \"../{MAP}\"\nplanning_hz = 10\n");
        let decider = decider.as_str();
        let parameter = "planning_hz = 10\nparameters.turn_signal_search_time = 4.5\n";
        #[rustfmt::skip]
        let cases = [
            (RESTART, "[mcap]\nfile_mb = 256\n", "file_mb = 256", "file_mb = 100", "[mcap] file_mb: 256 → 100"),
            (RESTART, "", "interface = \"can0\"", "interface = \"can7\"", "[can.body] interface: can0 → can7"),
            (RELOAD, decider, "planning_hz = 10\n", "planning_hz = 20.0\n",
                "[turn_signal] planning_hz: 10 → 20"),
            // The default is the same.
            (RELOAD, decider, "planning_hz = 10\n", "", ""),
            (RELOAD, "[reports]\n", "[reports]", "[reports]\nrate_hz = 20", "[reports] rate_hz: 10 → 20"),
            (RELOAD, decider, "planning_hz = 10\n", parameter,
                "[turn_signal.parameters] turn_signal_search_time: 3 s → 4.5 s"),
            (RELOAD, "", "[turn]", "[message.BCM_TurnIndicators]\ntimeout_ms = 300\n[turn]",
                "vehicle profile [message.BCM_TurnIndicators] timeout_ms: added, 300"),
        ];
        for (needs_restart, more, from, to, expected) in cases {
            let plan = difference(more, from, to);
            assert!(needs_restart || plan.restart.is_empty(), "{from} → {to}: {:?}", plan.restart);
            let changes = if needs_restart { &plan.restart } else { &plan.reloadable };
            assert_eq!(changes_text(changes), expected, "{from} → {to}");
        }
    }

    #[test]
    fn named_files_are_compared_by_their_content_and_named_by_their_path() {
        let dbc = difference("", "VERSION \"", "VERSION \"x");
        assert_eq!(dbc.restart, []);
        let text = changes_text(&dbc.reloadable);
        assert!(text.starts_with("file ") && text.ends_with("demo_vehicle.dbc: changed"), "{text}");
    }

    #[test]
    fn a_decider_that_does_not_run_is_not_in_effect() {
        let off = format!("[turn_signal]\nenabled = false\nmap = \"../{MAP}\"\n");
        let has = |more: &str| effective(more, "\u{1}", "").fixed.contains_key("[turn_signal] enabled");
        assert!(!has(&off) && has(&off.replace("false", "true")));
    }
}
